//! A window on a live run, without a browser: it sends commands and reads frames.

// No group of tests uses all of it.
#![allow(dead_code)]

use std::net::TcpStream;
use std::sync::mpsc::channel;
use std::thread::{JoinHandle, spawn};
use std::time::{Duration, Instant};

use serde_json::{Map, Value, json};
use symbolt::prelude::*;
use symbolt::sim::{Live, LiveOptions};
use symbolt::view::View;
use tungstenite::client::{IntoClientRequest, client};
use tungstenite::{Error, Message, WebSocket};

/// A run that is served on a thread of its own.
pub struct Served {
    pub port: u16,
    pub token: String,
    run: JoinHandle<Live>,
}

/// Serves a run until a window ends it.
pub fn served(sim: Simulator) -> Served {
    served_by(View::bind().unwrap(), sim)
}

pub fn served_by(mut view: View, sim: Simulator) -> Served {
    let (tell, told) = channel();
    let run = spawn(move || {
        tell.send(view.address().to_owned()).unwrap();
        view.serve(Live::new(sim, LiveOptions::default()).unwrap()).unwrap()
    });
    let (port, token) = parts(&told.recv().unwrap());
    Served { port, token, run }
}

/// The port and the token of an address.
pub fn parts(address: &str) -> (u16, String) {
    let (host, token) = address.split_once("/#").unwrap();
    let port = host.strip_prefix("http://127.0.0.1:").unwrap().parse().unwrap();
    (port, token.into())
}

impl Served {
    /// Opens a window.
    pub fn window(&self) -> Window {
        Window::opened(self.port, &self.token)
    }

    /// Opens a connection that has not shown the token.
    pub fn unknown(&self) -> Window {
        Window::unknown(self.port)
    }

    /// Ends the run and returns it.
    pub fn ended(self) -> Live {
        // It stays open until then: a connection that is closed with frames unread is reset, and the command may be lost.
        let mut window = self.window();
        window.send(&json!({ "end": {} }));
        self.run.join().unwrap()
    }
}

/// The head of a frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Frame {
    pub mode: u8,
    pub epoch: u32,
    pub tick: f64,
    pub earliest: f64,
    pub logged: u32,
}

pub struct Window {
    pub socket: WebSocket<TcpStream>,
    pub hello: Value,
    /// The last answer of each kind.
    told: Map<String, Value>,
}

impl Window {
    pub fn opened(port: u16, token: &str) -> Self {
        let mut window = Self::unknown(port);
        window.send(&json!({ "token": token }));
        let hello = window.answer("hello");
        Self { hello, ..window }
    }

    fn unknown(port: u16) -> Self {
        let mut request = format!("ws://127.0.0.1:{port}/live").into_client_request().unwrap();
        let origin = format!("http://127.0.0.1:{port}");
        request.headers_mut().insert("Origin", origin.parse().unwrap());
        let stream = TcpStream::connect(("127.0.0.1", port)).unwrap();
        stream.set_read_timeout(Some(Duration::from_secs(30))).unwrap();
        let (socket, _) = client(request, stream).unwrap();
        Self { socket, hello: Value::Null, told: Map::new() }
    }

    pub fn send(&mut self, what: &Value) {
        self.socket.send(Message::text(what.to_string())).unwrap();
    }

    /// Reads until an answer of this kind comes.
    pub fn answer(&mut self, kind: &str) -> Value {
        let until = Instant::now() + Duration::from_secs(30);
        while Instant::now() < until {
            if let Message::Text(text) = self.socket.read().unwrap() {
                let answer = self.note(&text);
                if let Some(answer) = answer.get(kind) {
                    return answer.clone();
                }
            }
        }
        panic!("no {kind} came");
    }

    fn note(&mut self, text: &str) -> Map<String, Value> {
        let answer: Map<String, Value> = serde_json::from_str(text).unwrap();
        self.told.extend(answer.clone());
        answer
    }

    /// The last answer of a kind that has been read.
    pub fn last(&self, kind: &str) -> Option<Value> {
        self.told.get(kind).cloned()
    }

    /// Reads the next frame with its bytes.
    pub fn frame(&mut self) -> (Frame, Vec<u8>) {
        loop {
            let message = self.socket.read().unwrap();
            if let Message::Text(text) = &message {
                self.note(text);
            }
            if let Message::Binary(bytes) = message {
                assert_eq!(bytes[0], 1, "the layout");
                let word = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap());
                let double = |at: usize| f64::from_le_bytes(bytes[at..at + 8].try_into().unwrap());
                let (tick, earliest) = (double(8), double(24));
                let frame =
                    Frame { mode: bytes[1], epoch: word(4), tick, earliest, logged: word(44) };
                return (frame, bytes.to_vec());
            }
        }
    }

    /// Reads frames until the run stands at a tick.
    pub fn stands_at(&mut self, tick: u64) -> (Frame, Vec<u8>) {
        loop {
            let (frame, bytes) = self.frame();
            if frame.mode != 1 && frame.tick == tick as f64 {
                return (frame, bytes);
            }
        }
    }

    /// Sends a command, and waits until the run stands at a tick.
    pub fn goes(&mut self, what: &Value, tick: u64) -> Vec<u8> {
        self.send(what);
        self.stands_at(tick).1
    }

    /// Sends a command, and waits until the run stands at a tick. Returns the samples of the last plot of all frames on
    /// the way: on a busy machine a step is told in several, each with the samples since the one before.
    pub fn sampled(&mut self, what: &Value, tick: u64) -> (Vec<f64>, Vec<f32>) {
        self.send(what);
        let (mut ticks, mut values) = (Vec::new(), Vec::new());
        loop {
            let (frame, bytes) = self.frame();
            let (at, of) = samples(&bytes);
            ticks.extend(at);
            values.extend(of);
            if frame.mode != 1 && frame.tick == tick as f64 {
                return (ticks, values);
            }
        }
    }

    /// Reads until the connection is closed. Returns the reason.
    pub fn closed(&mut self) -> String {
        loop {
            match self.socket.read() {
                Ok(Message::Close(Some(frame))) => return frame.reason.to_string(),
                Ok(_) => {}
                Err(Error::ConnectionClosed | Error::AlreadyClosed) => return String::new(),
                Err(error) => return error.to_string(),
            }
        }
    }
}

/// The samples of the last plot of a frame: ticks and values.
pub fn samples(bytes: &[u8]) -> (Vec<f64>, Vec<f32>) {
    let short = |at: usize| usize::from(u16::from_le_bytes(bytes[at..at + 2].try_into().unwrap()));
    let word = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()) as usize;
    let mut at = 60 + 4 * (short(56) + short(58));
    let mut last = (Vec::new(), Vec::new());
    for _ in 0..short(2) {
        let (rows, width) = (word(at + 4), word(at + 8).max(1));
        at += 12;
        let doubles = bytes[at..at + 8 * rows].chunks_exact(8);
        let ticks = doubles.map(|eight| f64::from_le_bytes(eight.try_into().unwrap())).collect();
        at += 8 * rows;
        let singles = bytes[at..at + 4 * rows * width].chunks_exact(4);
        last = (ticks, singles.map(|four| f32::from_le_bytes(four.try_into().unwrap())).collect());
        at += 4 * rows * width;
    }
    assert_eq!(at, bytes.len(), "a frame ends with its last plot");
    last
}
