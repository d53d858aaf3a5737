//! Drives a page in headless Chromium as a person does, over the browser's debugging port.

use std::net::TcpStream;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use serde_json::{Value, json};
use tempfile::TempDir;
use tungstenite::client::client;
use tungstenite::{Message, WebSocket};

use crate::chromium::browser;

/// A browser with one page. Dropping it ends the browser.
pub struct Devtools {
    browser: Child,
    socket: WebSocket<TcpStream>,
    sent: u64,
    /// The page's name in messages, once there is a page.
    session: Option<String>,
    _profile: TempDir,
}

/// Waits for something, at most half a minute.
fn waited<T>(what: &str, mut look: impl FnMut() -> Option<T>) -> T {
    let until = Instant::now() + Duration::from_secs(30);
    loop {
        if let Some(found) = look() {
            return found;
        }
        assert!(Instant::now() < until, "{what} did not come");
        std::thread::sleep(Duration::from_millis(30));
    }
}

impl Devtools {
    /// Opens an address in a window of this size.
    pub fn open(address: &str, width: u32, height: u32) -> Self {
        let profile = tempfile::tempdir().unwrap();
        let child = Command::new(browser().expect("Chromium is installed"))
            .args(["--headless=new", "--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader"])
            .args(["--enable-unsafe-swiftshader", "--remote-debugging-port=0", "--no-first-run"])
            .arg(format!("--window-size={width},{height}"))
            .arg(format!("--user-data-dir={}", profile.path().display()))
            .arg("about:blank")
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .expect("the browser starts");
        let told = profile.path().join("DevToolsActivePort");
        let (port, path) = waited("the debugging port", || {
            let text = std::fs::read_to_string(&told).ok()?;
            let (port, path) = text.split_once('\n')?;
            Some((port.parse::<u16>().ok()?, path.to_owned()))
        });
        let stream = TcpStream::connect(("127.0.0.1", port)).unwrap();
        stream.set_read_timeout(Some(Duration::from_secs(60))).unwrap();
        let (socket, _) = client(format!("ws://127.0.0.1:{port}{path}"), stream).unwrap();
        let mut tools = Self { browser: child, socket, sent: 0, session: None, _profile: profile };
        let target = tools.page("Target.createTarget", json!({ "url": "about:blank" }));
        let attached = json!({ "targetId": target["targetId"], "flatten": true });
        let session = tools.page("Target.attachToTarget", attached);
        tools.session = session["sessionId"].as_str().map(str::to_owned);
        let size = json!({ "width": width, "height": height, "deviceScaleFactor": 1, "mobile": width < 600 });
        tools.page("Emulation.setDeviceMetricsOverride", size);
        tools.page("Page.navigate", json!({ "url": address }));
        tools
    }

    /// Calls a method of the page, or of the browser before there is a page.
    pub fn page(&mut self, method: &str, params: Value) -> Value {
        self.sent += 1;
        let mut message = json!({ "id": self.sent, "method": method, "params": params });
        if let Some(session) = &self.session {
            message["sessionId"] = session.clone().into();
        }
        self.socket.send(Message::text(message.to_string())).unwrap();
        loop {
            let Message::Text(text) = self.socket.read().unwrap() else { continue };
            let answer: Value = serde_json::from_str(&text).unwrap();
            if answer["id"] == self.sent {
                assert!(answer["error"].is_null(), "{method}: {answer}");
                return answer["result"].clone();
            }
        }
    }

    /// Evaluates an expression in the page.
    pub fn value(&mut self, expression: &str) -> Value {
        let asked =
            json!({ "expression": expression, "returnByValue": true, "awaitPromise": true });
        let answer = self.page("Runtime.evaluate", asked);
        assert!(answer["exceptionDetails"].is_null(), "{expression}: {answer}");
        answer["result"]["value"].clone()
    }

    /// Waits until an expression is true in the page.
    pub fn until(&mut self, expression: &str) {
        waited(expression, || self.holds(expression).then_some(()));
    }

    /// Returns whether an expression is true in the page, which may not have been loaded yet.
    fn holds(&mut self, expression: &str) -> bool {
        let asked = json!({ "expression": expression, "returnByValue": true });
        self.page("Runtime.evaluate", asked)["result"]["value"] == true
    }

    /// Clicks an element until an expression is true, as a person does on a busy machine, where a click can meet what is being
    /// drawn anew.
    pub fn click_until(&mut self, selector: &str, expression: &str) {
        waited(expression, || {
            self.click(selector);
            let mut looks = std::iter::repeat_n(Duration::from_millis(30), 100);
            let came = looks.any(|pause| {
                std::thread::sleep(pause);
                self.holds(expression)
            });
            came.then_some(())
        });
    }

    /// Clicks the middle of an element with the mouse, once it stays in its place: on a busy machine pictures and lists above it
    /// come late.
    pub fn click(&mut self, selector: &str) {
        let middle = format!(
            "(() => {{ const element = document.querySelector({}); element.scrollIntoView({{ block: 'center' }});\
             const r = element.getBoundingClientRect(); return [r.x + r.width / 2, r.y + r.height / 2]; }})()",
            json!(selector)
        );
        let mut before = Value::Null;
        let place = waited(selector, || {
            let now = self.value(&middle);
            (std::mem::replace(&mut before, now.clone()) == now).then_some(now)
        });
        for kind in ["mousePressed", "mouseReleased"] {
            let event = json!({ "type": kind, "x": place[0], "y": place[1], "button": "left", "clickCount": 1 });
            self.page("Input.dispatchMouseEvent", event);
        }
    }

    /// Types into the element that has the focus.
    pub fn types(&mut self, text: &str) {
        self.page("Input.insertText", json!({ "text": text }));
    }

    /// Presses a key.
    pub fn press(&mut self, key: &str, text: &str) {
        for kind in ["keyDown", "keyUp"] {
            let event = json!({ "type": kind, "key": key, "text": if kind == "keyDown" { text } else { "" } });
            self.page("Input.dispatchKeyEvent", event);
        }
    }

    /// Writes a picture of what is in view.
    pub fn picture(&mut self, file: &Path) {
        self.write(file, json!({ "format": "png" }));
    }

    /// Writes a picture of the whole page.
    pub fn whole(&mut self, file: &Path) {
        self.write(file, json!({ "format": "png", "captureBeyondViewport": true }));
    }

    fn write(&mut self, file: &Path, how: Value) {
        let answer = self.page("Page.captureScreenshot", how);
        let bytes = STANDARD.decode(answer["data"].as_str().unwrap()).unwrap();
        std::fs::write(file, bytes).unwrap();
    }
}

impl Drop for Devtools {
    fn drop(&mut self) {
        let _ = self.browser.kill();
        let _ = self.browser.wait();
    }
}
