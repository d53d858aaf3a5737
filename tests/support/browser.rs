//! Opens pages in headless Chromium.

use std::path::PathBuf;
use std::process::Command;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use serde_json::Value;

/// Returns the path of Chromium: the value of the variable `CHROMIUM`, else the first on the `PATH`. Returns `None` if
/// Chromium is missing.
pub fn browser() -> Option<PathBuf> {
    let named = std::env::var_os("CHROMIUM").filter(|name| !name.is_empty()).map(PathBuf::from);
    let paths = std::env::var_os("PATH").unwrap_or_default();
    let names = ["chromium", "chromium-browser", "google-chrome"];
    let found = std::env::split_paths(&paths)
        .flat_map(|folder| names.map(|name| folder.join(name)))
        .find(|path| path.is_file());
    named.or(found)
}

/// Opens a page, runs `script` in it, and returns the object `found`, which the script fills.
pub fn opened(page: &str, script: &str) -> Value {
    let browser = browser().expect("Chromium is installed");
    let place = tempfile::tempdir().expect("a folder");
    let driver = format!(
        "<script type=\"module\">\nconst page = window.symbolt?.page;\nconst found = {{}};\n\
         found.opened_ms = performance.now();\n\
         try {{ {script} }} catch (error) {{ found.error = String(error.stack ?? error); }}\n\
         const answer = document.createElement(\"pre\");\nanswer.id = \"found\";\n\
         answer.textContent = btoa(unescape(encodeURIComponent(JSON.stringify(found))));\n\
         document.body.append(answer);\n</script>\n</body>"
    );
    let path = place.path().join("page.html");
    std::fs::write(&path, page.replacen("</body>", &driver, 1)).expect("written");
    let output = Command::new(browser)
        .args(["--headless", "--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader"])
        .args(["--enable-unsafe-swiftshader", "--window-size=1366,900", "--dump-dom"])
        .arg(format!("--user-data-dir={}", place.path().join("profile").display()))
        .arg("--virtual-time-budget=20000")
        .arg(format!("file://{}", path.display()))
        .output()
        .expect("the browser starts");
    let dom = String::from_utf8_lossy(&output.stdout);
    let answer =
        dom.split_once("<pre id=\"found\">").and_then(|(_, rest)| rest.split_once("</pre>"));
    let said = String::from_utf8_lossy(&output.stderr);
    let (answer, _) = answer.unwrap_or_else(|| panic!("no answer from the page: {said}"));
    let found: Value =
        serde_json::from_slice(&STANDARD.decode(answer).expect("base64")).expect("JSON");
    assert!(found["error"].is_null(), "{}", found["error"]);
    found
}
