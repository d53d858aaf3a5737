//! Requests: one head of at most 8 KiB within five seconds, exact `Host` and `Origin`, and the page's files.

use std::io::{self, ErrorKind, Read, Write};
use std::net::TcpStream;
use std::time::{Duration, Instant};

use tungstenite::handshake::derive_accept_key;

use super::hub::Hub;
use super::page;

/// Greatest length of a request's head, in bytes.
const MOST_HEAD: usize = 8_192;
/// Greatest number of headers.
const MOST_HEADERS: usize = 64;
/// Time for a request's head, and for the answer to be taken.
const PATIENCE: Duration = Duration::from_secs(5);

/// A request: its path, its headers, and the bytes behind its head.
struct Request {
    path: String,
    headers: Vec<(String, String)>,
    rest: Vec<u8>,
}

impl Request {
    /// Returns the value of a header that stands exactly once.
    fn header(&self, name: &str) -> Option<&str> {
        let mut all = self.headers.iter().filter(|(own, _)| own.eq_ignore_ascii_case(name));
        all.next().filter(|_| all.next().is_none()).map(|(_, value)| &**value)
    }
}

/// Why a request is refused: status and reason.
type Refusal = (u16, &'static str);

/// Reads a request and answers it. Returns the bytes behind its head if the connection is now one for messages, and `None` if it is done.
pub(super) fn receive(stream: &mut TcpStream, hub: &Hub) -> io::Result<Option<Vec<u8>>> {
    stream.set_write_timeout(Some(PATIENCE))?;
    let answered = read_head(stream)?.and_then(|request| {
        check_host(&request, hub)?;
        match &*request.path {
            "/live" => upgrade(&request, hub).map(|head| (head, Some(request.rest))),
            path => file(path, hub).map(|answer| (answer, None)),
        }
    });
    let (answer, rest) = answered.unwrap_or_else(|refusal| (refused(refusal), None));
    stream.write_all(&answer)?;
    stream.flush()?;
    Ok(rest)
}

fn read_head(stream: &mut TcpStream) -> io::Result<Result<Request, Refusal>> {
    let until = Instant::now() + PATIENCE;
    let mut head = Vec::new();
    let mut piece = [0; 1_024];
    loop {
        let left = until.saturating_duration_since(Instant::now());
        if left.is_zero() {
            return Ok(Err((408, "the request took too long")));
        }
        stream.set_read_timeout(Some(left))?;
        let count = match stream.read(&mut piece) {
            Ok(0) => return Err(ErrorKind::UnexpectedEof.into()),
            Ok(count) => count,
            Err(error) if error.kind() == ErrorKind::Interrupted => continue,
            Err(error) if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => {
                continue;
            }
            Err(error) => return Err(error),
        };
        // The end may lie across two pieces.
        let from = head.len().saturating_sub(3);
        head.extend_from_slice(&piece[..count]);
        if let Some(end) = head[from..].windows(4).position(|four| four == b"\r\n\r\n") {
            let rest = head.split_off(from + end + 4);
            return Ok(parse(&head, rest));
        }
        if head.len() > MOST_HEAD {
            return Ok(Err((431, "the request's head is too long")));
        }
    }
}

fn parse(head: &[u8], rest: Vec<u8>) -> Result<Request, Refusal> {
    const BAD: Refusal = (400, "this is no request");
    if head.len() > MOST_HEAD {
        return Err((431, "the request's head is too long"));
    }
    let head = std::str::from_utf8(head).map_err(|_| BAD)?;
    let mut lines = head.trim_end_matches("\r\n").split("\r\n");
    let first: Vec<&str> = lines.next().unwrap_or_default().split(' ').collect();
    let [method, path, "HTTP/1.1"] = first[..] else { return Err(BAD) };
    if method != "GET" {
        return Err((405, "only GET is allowed"));
    }
    let mut headers = Vec::new();
    for line in lines {
        let (name, value) = line.split_once(':').ok_or(BAD)?;
        if name.is_empty() || name.contains(|c: char| c.is_whitespace() || c.is_control()) {
            return Err(BAD);
        }
        if headers.len() >= MOST_HEADERS {
            return Err((431, "the request has too many headers"));
        }
        headers.push((name.into(), value.trim().into()));
    }
    Ok(Request { path: path.into(), headers, rest })
}

/// Another name for this machine is refused: a page of another site could use one.
fn check_host(request: &Request, hub: &Hub) -> Result<(), Refusal> {
    let own = format!("127.0.0.1:{}", hub.port);
    match request.header("Host") {
        Some(host) if host == own => Ok(()),
        _ => Err((403, "the Host is not this address")),
    }
}

/// Returns the head of the answer that makes the connection one for messages.
fn upgrade(request: &Request, hub: &Hub) -> Result<Vec<u8>, Refusal> {
    let own = format!("http://127.0.0.1:{}", hub.port);
    if request.header("Origin") != Some(&own) {
        return Err((403, "the Origin is not this address"));
    }
    let has = |name: &str, word: &str| {
        let words = request.header(name).unwrap_or_default().split(',');
        words.map(str::trim).any(|own| own.eq_ignore_ascii_case(word))
    };
    let wanted = has("Upgrade", "websocket")
        && has("Connection", "upgrade")
        && request.header("Sec-WebSocket-Version") == Some("13");
    let key = request.header("Sec-WebSocket-Key").filter(|key| wanted && key.len() == 24);
    let key = key.ok_or((400, "this is no WebSocket of version 13"))?;
    Ok(format!(
        "HTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Accept: {}\r\n\r\n",
        derive_accept_key(key.as_bytes())
    )
    .into())
}

fn file(path: &str, hub: &Hub) -> Result<Vec<u8>, Refusal> {
    let (kind, text) = page::file(path).ok_or((404, "there is no such file"))?;
    Ok(answer(200, "OK", kind, &text, hub.port))
}

fn refused((status, reason): Refusal) -> Vec<u8> {
    answer(status, "Refused", "text/plain; charset=utf-8", &format!("{reason}\n"), 0)
}

fn answer(status: u16, word: &str, kind: &str, text: &str, port: u16) -> Vec<u8> {
    let head = format!(
        "HTTP/1.1 {status} {word}\r\nContent-Type: {kind}\r\nContent-Length: {}\r\nConnection: close\r\n\
         Content-Security-Policy: default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; \
         connect-src ws://127.0.0.1:{port}; base-uri 'none'; form-action 'none'; frame-ancestors 'none'\r\n\
         X-Content-Type-Options: nosniff\r\nReferrer-Policy: no-referrer\r\nCache-Control: no-store\r\n\
         Cross-Origin-Resource-Policy: same-origin\r\nCross-Origin-Opener-Policy: same-origin\r\n\r\n",
        text.len()
    );
    [head.as_bytes(), text.as_bytes()].concat()
}
