//! Assembles the page: style, code, the 3-D library and the data in one file.

use std::io::Write;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use serde::Serialize;
use serde_json::json;

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

/// Writes JSON into a page. Every `<` is escaped, so no text can end the element that holds the data.
struct Escaped<'a>(&'a mut Vec<u8>);

impl Write for Escaped<'_> {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        for (index, part) in bytes.split(|byte| *byte == b'<').enumerate() {
            if index > 0 {
                self.0.extend(br"\u003c");
            }
            self.0.extend(part);
        }
        Ok(bytes.len())
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

/// Returns the page that shows `data`. The data are written into the page without a further copy.
pub(super) fn html(data: &impl Serialize) -> String {
    let library = |code: &str| format!("data:text/javascript;base64,{}", base64(code.as_bytes()));
    let imports = json!({"imports": {"three": library(THREE), "three/orbit": library(ORBIT)}});
    let (imports, code) = (imports.to_string(), CODE.concat());
    filled(PAGE, &[("{{style}}", STYLE), ("{{imports}}", &imports)], data, &code)
}

/// Fills a page with texts at their marks, in order, and then with its data and its code.
pub(super) fn filled(
    page: &str,
    texts: &[(&str, &str)],
    data: &impl Serialize,
    code: &str,
) -> String {
    let mut html = Vec::with_capacity(2_000_000);
    let mut rest = page;
    for (mark, text) in texts.iter().chain(&[("{{data}}", ""), ("{{code}}", code)]) {
        let (before, after) = rest.split_once(mark).unwrap_or((rest, ""));
        html.extend(before.bytes());
        if *mark == "{{data}}" {
            // Data of numbers and text are always JSON.
            drop(serde_json::to_writer(Escaped(&mut html), data));
        }
        html.extend(text.bytes());
        rest = after;
    }
    html.extend(rest.bytes());
    String::from_utf8(html).unwrap_or_default()
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
