//! Assembles the page of a run of a task, or of experiments: style, code, the 3-D library and the data in one file.

use serde::Serialize;
use serde_json::json;

use crate::record::shell::{STYLE, base64, filled};

const PAGE: &str = include_str!("../../assets/report/page.html");
/// The page's code. In this order the files form one JavaScript module.
const CODE: [&str; 26] = [
    include_str!("../../assets/report/data.js"),
    include_str!("../../assets/report/theme.js"),
    include_str!("../../assets/report/names.js"),
    include_str!("../../assets/report/tables.js"),
    include_str!("../../assets/report/scene.js"),
    include_str!("../../assets/report/camera.js"),
    include_str!("../../assets/report/labels.js"),
    include_str!("../../assets/report/replay.js"),
    include_str!("../../assets/report/strips.js"),
    include_str!("../../assets/graph/names.js"),
    include_str!("../../assets/report/raster.js"),
    include_str!("../../assets/report/timeline.js"),
    include_str!("../../assets/report/export.js"),
    include_str!("../../assets/report/panels.js"),
    include_str!("../../assets/report/words.js"),
    include_str!("../../assets/report/thinking.js"),
    include_str!("../../assets/report/episode.js"),
    include_str!("../../assets/report/story.js"),
    include_str!("../../assets/report/episodes.js"),
    include_str!("../../assets/report/decisions.js"),
    include_str!("../../assets/report/failures.js"),
    include_str!("../../assets/report/now.js"),
    include_str!("../../assets/report/run.js"),
    include_str!("../../assets/report/keys.js"),
    include_str!("../../assets/report/experiments.js"),
    include_str!("../../assets/report/main.js"),
];
const THREE: &str = include_str!("../../assets/vendor/three/three.module.min.js");
const ORBIT: &str = include_str!("../../assets/vendor/three/OrbitControls.js");

/// The title in the head of every page, within its first 1000 bytes. By it a page is recognised.
pub const TITLE: &str = "<title>symbolt</title>";

/// Returns the page that shows `data`. The data are written into the page without a further copy.
pub(super) fn html(data: &impl Serialize) -> String {
    let library = |code: &str| format!("data:text/javascript;base64,{}", base64(code.as_bytes()));
    let imports = json!({"imports": {"three": library(THREE), "three/orbit": library(ORBIT)}});
    let (imports, code) = (imports.to_string(), CODE.concat());
    filled(PAGE, &[("{{style}}", STYLE), ("{{imports}}", &imports)], data, &code)
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
