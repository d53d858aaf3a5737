//! What all pages share: their style, and how a page is filled with its data and its code.

use std::io::Write;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use serde::Serialize;

/// The style of all pages.
pub(crate) const STYLE: &str = include_str!("../../assets/report/style.css");

/// Returns bytes as text that the code of a page reads.
pub(crate) fn base64(bytes: &[u8]) -> String {
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

/// Fills a page with texts at their marks, in order, and then with its data and its code.
pub(crate) fn filled(
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
