//! Assembles the page: style, code, the 3-D library and the data in one file.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use serde_json::{Value, json};

const PAGE: &str = include_str!("../../assets/report/page.html");
const STYLE: &str = include_str!("../../assets/report/style.css");
/// The page's code. In this order the files form one JavaScript module.
const CODE: [&str; 15] = [
    include_str!("../../assets/report/data.js"),
    include_str!("../../assets/report/theme.js"),
    include_str!("../../assets/report/tables.js"),
    include_str!("../../assets/report/scene.js"),
    include_str!("../../assets/report/camera.js"),
    include_str!("../../assets/report/labels.js"),
    include_str!("../../assets/report/replay.js"),
    include_str!("../../assets/report/strips.js"),
    include_str!("../../assets/report/timeline.js"),
    include_str!("../../assets/report/words.js"),
    include_str!("../../assets/report/thinking.js"),
    include_str!("../../assets/report/run.js"),
    include_str!("../../assets/report/keys.js"),
    include_str!("../../assets/report/experiments.js"),
    include_str!("../../assets/report/main.js"),
];
const THREE: &str = include_str!("../../assets/vendor/three/three.module.min.js");
const ORBIT: &str = include_str!("../../assets/vendor/three/OrbitControls.js");

/// The title in the head of every page, within its first 1000 bytes. By it a page is recognised.
pub const TITLE: &str = "<title>symbolt</title>";

pub(super) fn base64(bytes: &[u8]) -> String {
    STANDARD.encode(bytes)
}

/// Returns the page that shows `data`. Every `<` in the data is escaped, so no text can end the element that holds the
/// data.
pub(super) fn html(data: &Value) -> String {
    let library = |code: &str| format!("data:text/javascript;base64,{}", base64(code.as_bytes()));
    let imports = json!({"imports": {"three": library(THREE), "three/orbit": library(ORBIT)}});
    let mut html = String::with_capacity(2_000_000);
    let parts = [
        ("{{style}}", STYLE.to_owned()),
        ("{{imports}}", imports.to_string()),
        ("{{data}}", data.to_string().replace('<', "\\u003c")),
        ("{{code}}", CODE.concat()),
    ];
    let mut rest = PAGE;
    for (mark, content) in parts {
        let (before, after) = rest.split_once(mark).unwrap_or((rest, ""));
        html.push_str(before);
        html.push_str(&content);
        rest = after;
    }
    html.push_str(rest);
    html
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_page_is_recognised_by_its_first_bytes() {
        let page = html(&json!({}));
        assert!(page.find(TITLE).is_some_and(|at| at < 900), "{:?}", page.find(TITLE));
    }
}
