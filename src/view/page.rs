//! The files of the page, by their paths.

/// The page's own code behind that of the report's pages, whose colours, 3-D view and words it shares. In this order the files form one
/// JavaScript module.
const CODE: [&str; 12] = [
    include_str!("../../assets/report/data.js"),
    include_str!("../../assets/report/theme.js"),
    include_str!("../../assets/report/scene.js"),
    include_str!("../../assets/report/camera.js"),
    include_str!("../../assets/report/labels.js"),
    include_str!("../../assets/report/replay.js"),
    include_str!("../../assets/graph/names.js"),
    include_str!("../../assets/view/plots.js"),
    include_str!("../../assets/view/network.js"),
    include_str!("../../assets/view/touch.js"),
    include_str!("../../assets/view/scene.js"),
    include_str!("../../assets/view/main.js"),
];
/// The connection with the run, which waits for no library.
const SESSION: [&str; 2] =
    [include_str!("../../assets/view/frames.js"), include_str!("../../assets/view/session.js")];
const PAGE: &str = include_str!("../../assets/view/page.html");
const STYLE: [&str; 2] =
    [include_str!("../../assets/report/style.css"), include_str!("../../assets/view/style.css")];
const THREE: &str = include_str!("../../assets/vendor/three/three.module.min.js");
const ORBIT: &str = include_str!("../../assets/vendor/three/OrbitControls.js");

/// Returns the content type and the text of a file; `None` if there is none of this path.
pub(super) fn file(path: &str) -> Option<(&'static str, String)> {
    const SCRIPT: &str = "text/javascript; charset=utf-8";
    // The policy allows no import map in the page, so libraries are named by their paths.
    let by_path = |code: &str| {
        let code = code.replace("from \"three/orbit\"", "from \"./orbit.js\"");
        code.replace("from \"three\"", "from \"./three.js\"")
            .replace("from 'three'", "from './three.js'")
    };
    Some(match path {
        "/" => ("text/html; charset=utf-8", PAGE.into()),
        "/style.css" => ("text/css; charset=utf-8", STYLE.concat()),
        "/session.js" => (SCRIPT, SESSION.concat()),
        "/view.js" => (SCRIPT, by_path(&CODE.concat())),
        "/three.js" => (SCRIPT, THREE.into()),
        "/orbit.js" => (SCRIPT, by_path(ORBIT)),
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn libraries_are_imported_by_path_and_the_page_has_no_code_of_its_own() {
        for path in ["/session.js", "/view.js", "/orbit.js", "/three.js"] {
            let (_, code) = file(path).expect("a file");
            let bare = |line: &&str| line.contains("from \"three") || line.contains("from 'three'");
            assert_eq!(code.lines().find(bare), None, "{path}");
        }
        assert!(file("/view.js").is_some_and(|(_, code)| code.contains("from \"./three.js\"")));
        let (_, page) = file("/").expect("a page");
        assert!(
            !page.contains("<script>") && !page.contains("style=") && !page.contains("onclick")
        );
        assert_eq!(file("/../Cargo.toml"), None);
    }
}
