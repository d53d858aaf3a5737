//! Opens pages in headless Chromium.

use std::path::PathBuf;
use std::process::Command;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use serde_json::Value;

/// Returns the path of Chromium: the variable `CHROMIUM`, or the first on the `PATH`. `None` if there is none.
pub fn browser() -> Option<PathBuf> {
    let named = std::env::var_os("CHROMIUM").filter(|name| !name.is_empty()).map(PathBuf::from);
    let paths = std::env::var_os("PATH").unwrap_or_default();
    let names = ["chromium", "chromium-browser", "google-chrome"];
    let found = std::env::split_paths(&paths)
        .flat_map(|folder| names.map(|name| folder.join(name)))
        .find(|path| path.is_file());
    named.or(found)
}

/// How a page is looked at.
pub struct Window {
    /// Width of the page, in pixels.
    pub width: u32,
    /// Whether the system asks for a dark page.
    pub dark: bool,
}

/// Collects errors, and notes whether the page is drawn when it has loaded and what moves later.
const WATCH: &str = "<head><script>\n\
    window.faults = [];\n\
    addEventListener('error', (event) => faults.push(event.message));\n\
    addEventListener('unhandledrejection', (event) => faults.push(String(event.reason)));\n\
    for (const kind of ['error', 'warn']) {\n\
        const own = console[kind];\n\
        console[kind] = (...said) => { faults.push(said.join(' ')); own.apply(console, said); };\n\
    }\n\
    window.shifts = 0;\n\
    new PerformanceObserver((list) => list.getEntries().forEach((entry) => { shifts += entry.value; }))\n\
        .observe({ type: 'layout-shift', buffered: true });\n\
    </script>";

/// Opens a page in a window, runs `script` in it, and returns the object `found` that the script fills. The page stands
/// in a frame, because headless Chromium has no window as
/// narrow as a telephone. The script must not wait: Chromium does not wait for timers in a frame.
pub fn opened_in(window: &Window, page: &str, script: &str) -> Value {
    let browser = browser().expect("Chromium is installed");
    let place = tempfile::tempdir().expect("a folder");
    let driver = format!(
        "<script type=\"module\">\nconst page = window.symbolt?.page;\n\
         const found = {{ faults: window.faults }};\n\
         found.opened_ms = performance.now();\n\
         const byId = (id) => document.getElementById(id);\n\
         const press = (key, options = {{}}) => (document.activeElement ?? document.body).dispatchEvent(\n\
             new KeyboardEvent('keydown', {{ key, bubbles: true, cancelable: true, ...options }}));\n\
         try {{ {script} }} catch (error) {{ found.error = String(error.stack ?? error); }}\n\
         parent.postMessage(btoa(unescape(encodeURIComponent(JSON.stringify(found)))), '*');\n\
         </script>\n</body>"
    );
    let watched = page.replacen("<head>", WATCH, 1).replacen("</body>", &driver, 1);
    std::fs::write(place.path().join("page.html"), watched).expect("written");
    let width = window.width;
    let frame = format!(
        "<!doctype html><body><iframe src=\"page.html\" width=\"{width}\" height=\"900\"></iframe><script>\n\
         addEventListener('message', (event) => {{ const answer = document.createElement('pre');\n\
         answer.id = 'found'; answer.textContent = event.data; document.body.append(answer); }});</script></body>"
    );
    let path = place.path().join("frame.html");
    std::fs::write(&path, frame).expect("written");
    let scheme = if window.dark { 0 } else { 1 };
    let output = Command::new(browser)
        .args(["--headless", "--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader"])
        .args(["--enable-unsafe-swiftshader", "--window-size=1500,1000", "--dump-dom"])
        .arg(format!("--blink-settings=preferredColorScheme={scheme}"))
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
    assert_eq!(found["faults"], serde_json::json!([]), "errors on the console");
    found
}
