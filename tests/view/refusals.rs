//! What is refused: requests, tokens, commands; floods, windows that vanish, and messages at random. The run goes on unharmed.

use std::io::{Read, Write};
use std::net::TcpStream;
use std::time::Duration;

use serde_json::{Value, json};
use symbolt::prelude::*;
use symbolt::view::View;
use tungstenite::Message;

use crate::model::model;
use crate::window::{Served, served, served_by};

fn exact() -> Simulator {
    model(&PopulationPlan::direct(), 64).unwrap()
}

/// Checks that the run answers, steps, and has the bits of a run that nobody touched.
fn unharmed(served: Served) {
    let mut window = served.window();
    let (frame, _) = window.frame();
    window.goes(&json!({ "step": { "ticks": 20 } }), frame.tick as u64 + 20);
    let live = served.ended();
    assert_eq!(live.made(), []);
    let mut alone = exact();
    alone.run_for(SimDuration::from_millis(live.tick())).unwrap();
    assert!(live.sim().checkpoint().unwrap() == alone.checkpoint().unwrap());
}

/// Sends a request and returns what is answered.
fn answered(served: &Served, request: &[u8]) -> String {
    let mut stream = TcpStream::connect(("127.0.0.1", served.port)).unwrap();
    stream.set_read_timeout(Some(Duration::from_secs(10))).unwrap();
    // The other end may have closed already.
    let _ = stream.write_all(request);
    let mut answer = Vec::new();
    let _ = stream.read_to_end(&mut answer);
    String::from_utf8_lossy(&answer).into_owned()
}

#[test]
fn requests_with_another_host_origin_method_or_path_are_refused() {
    let served = served(exact());
    let own = format!("127.0.0.1:{}", served.port);
    let upgrade = |host: &str, origin: &str| {
        format!(
            "GET /live HTTP/1.1\r\nHost: {host}\r\n{origin}Upgrade: websocket\r\nConnection: keep-alive, Upgrade\r\n\
             Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n\r\n"
        )
    };
    let origin = format!("Origin: http://{own}\r\n");
    let cases = [
        (format!("GET / HTTP/1.1\r\nHost: {own}\r\n\r\n"), "200"),
        (format!("GET /view.js HTTP/1.1\r\nhost: {own}\r\n\r\n"), "200"),
        (format!("GET / HTTP/1.1\r\nHost: localhost:{}\r\n\r\n", served.port), "403"),
        (format!("GET / HTTP/1.1\r\nHost: evil.example:{}\r\n\r\n", served.port), "403"),
        (format!("GET / HTTP/1.1\r\nHost: {own}\r\nHost: {own}\r\n\r\n"), "403"),
        ("GET / HTTP/1.1\r\n\r\n".into(), "403"),
        (format!("POST / HTTP/1.1\r\nHost: {own}\r\n\r\n"), "405"),
        (format!("GET /../Cargo.toml HTTP/1.1\r\nHost: {own}\r\n\r\n"), "404"),
        (format!("GET /live HTTP/1.1\r\nHost: {own}\r\n{origin}\r\n"), "400"),
        (format!("GET / HTTP/1.1\r\nHost {own}\r\n\r\n"), "400"),
        (format!("GET / HTTP/1.1\r\nHost: {own}\r\nX: {}\r\n\r\n", "a".repeat(9_000)), "431"),
        (format!("GET / HTTP/1.1\r\nHost: {own}\r\n{}\r\n", "X: a\r\n".repeat(70)), "431"),
        ("\r\n\r\n".into(), "400"),
        (upgrade(&own, &origin), "101"),
        (upgrade(&own, ""), "403"),
        (upgrade(&own, "Origin: http://evil.example\r\n"), "403"),
        (upgrade(&own, "Origin: null\r\n"), "403"),
        (upgrade("evil.example", &origin), "403"),
        (upgrade(&own, &origin).replace("13", "8"), "400"),
    ];
    for (request, status) in cases {
        let answer = answered(&served, request.as_bytes());
        assert!(answer.starts_with(&format!("HTTP/1.1 {status} ")), "{request}: {answer:.200}");
    }
    let page = answered(&served, format!("GET / HTTP/1.1\r\nHost: {own}\r\n\r\n").as_bytes());
    let policy = "Content-Security-Policy: default-src 'none'; script-src 'self'; style-src 'self'";
    assert!(page.contains(policy) && !page.contains(&served.token), "{page:.900}");
    unharmed(served);
}

#[test]
fn a_wrong_token_is_refused_and_nothing_is_told_before_the_right_one() {
    let served = served(exact());
    let right = served.token.clone();
    let wrong = [
        json!({ "token": "0".repeat(32) }),
        json!({ "token": &right[..31] }),
        json!({ "token": format!("{right}0") }),
        json!({ "token": right, "more": 1 }),
        json!({ "step": { "ticks": 1 } }),
        json!(right),
    ];
    for first in wrong {
        let mut window = served.unknown();
        window.send(&first);
        assert_eq!(window.closed(), "wrong token", "{first}");
    }
    let mut binary = served.unknown();
    binary.socket.send(Message::binary(right.into_bytes())).unwrap();
    assert_eq!(binary.closed(), "the first message is the token");
    let mut silent = served.unknown();
    assert_eq!(silent.closed(), "no token came");
    unharmed(served);
}

#[test]
fn commands_that_are_malformed_oversized_or_out_of_range_are_refused() {
    let served = served(exact());
    let mut window = served.window();
    let plot = |what: Value| json!({ "plot": { "key": 1, "what": what } });
    let refused = [
        (json!({ "eval": { "code": "1" } }), "unknown variant"),
        (json!({ "step": { "ticks": 0 } }), "expected 1 to 10000000"),
        (json!({ "run": { "speed": 0.001 } }), "expected 0.01 to 1000"),
        (json!({ "back": { "ticks": 5 } }), "began less than that ago"),
        (json!({ "until": {} }), "no events"),
        (json!({ "unplot": { "id": 99 } }), "no plot 99"),
        (json!({ "do": { "silence": { "at": "memry" } } }), "most similar"),
        (
            json!({ "do": { "clamp": { "output": "memory.output", "values": [1.0] } } }),
            "takes 64 values",
        ),
        (
            json!({ "do": { "set": { "output": "memory.output", "values": vec![0.0; 64] } } }),
            "not set",
        ),
        (json!({ "do": { "noise": { "scale": -1.0 } } }), "at least 0"),
        (json!({ "point": { "output": "memory.output", "to": "SCREW", "how": "clamp" } }), "SCREW"),
        (json!({ "point": { "output": "memory.output", "to": "NUT *", "how": "clamp" } }), "NUT *"),
        (
            json!({ "point": { "output": "rules.chosen", "to": "NUT", "how": "clamp" } }),
            "no pointers",
        ),
        (plot(json!({ "values": { "output": "nothing", "count": 1 } })), "no output `nothing`"),
        (
            plot(json!({ "values": { "output": "memory.output", "from": 60, "count": 5 } })),
            "to be at most",
        ),
        (
            plot(json!({ "values": { "output": "memory.output", "from": u64::MAX, "count": 5 } })),
            "to be at most",
        ),
        (plot(json!({ "spikes": { "layer": "memory", "count": 5 } })), "no spiking layer"),
        (plot(json!({ "reading": { "name": "goal" } })), "no reading"),
    ];
    for (command, reason) in refused {
        window.send(&command);
        let said = window.answer("refused");
        assert!(said.as_str().unwrap().contains(reason), "{command}: {said}");
    }
    // Sixteen plots a window.
    for key in 0..16 {
        window.send(&json!({ "plot": { "key": key, "what": { "values": { "output": "memory.output", "count": 1 } } } }));
        window.answer("plotted");
    }
    window.send(&plot(json!({ "values": { "output": "memory.output", "count": 1 } })));
    assert!(window.answer("refused").as_str().unwrap().contains("16 plots"));
    window.socket.send(Message::text("A".repeat(70_000))).unwrap();
    assert_eq!(window.closed(), "a message has more than 64 kB");
    // A window that never sends a command is dropped.
    let mut babbling = served.window();
    for _ in 0..101 {
        if babbling.socket.send(Message::text("[]")).is_err() {
            break;
        }
    }
    assert_eq!(babbling.closed(), "too many malformed commands");
    unharmed(served);
}

#[test]
fn messages_of_more_than_64_kb_that_arrive_whole_leave_room_for_windows() {
    let served = served(exact());
    for turn in 0..70 {
        let mut window = if turn % 2 == 0 { served.window() } else { served.unknown() };
        // The server may close before all is written.
        let _ = window.socket.send(Message::text("A".repeat(66_000)));
        if turn < 2 {
            assert_eq!(window.closed(), "a message has more than 64 kB");
        } else {
            window.closed();
        }
    }
    let own = format!("127.0.0.1:{}", served.port);
    let page = answered(&served, format!("GET / HTTP/1.1\r\nHost: {own}\r\n\r\n").as_bytes());
    assert!(page.starts_with("HTTP/1.1 200 "), "{page:.200}");
    unharmed(served);
}

#[test]
fn a_plot_that_is_refused_before_the_run_sees_it_is_refused_by_its_key() {
    let served = served(exact());
    let mut window = served.window();
    let what = json!({ "values": { "output": "memory.output", "count": -1 } });
    window.send(&json!({ "plot": { "key": 7, "what": what } }));
    let text = loop {
        if let Message::Text(text) = window.socket.read().unwrap()
            && text.contains("refused")
        {
            break text;
        }
    };
    let answer: Value = serde_json::from_str(&text).unwrap();
    assert_eq!(answer["plot"], 7);
    assert_eq!(answer["refused"], "count is -1; expected a whole number from 1 to 64");
    drop(window);
    unharmed(served);
}

#[test]
fn a_flood_of_commands_and_windows_that_vanish_leave_the_run_unharmed() {
    let served = served(exact());
    let mut other = served.window();
    let mut flooding = served.window();
    flooding.socket.get_ref().set_write_timeout(Some(Duration::from_millis(200))).unwrap();
    for _ in 0..20_000 {
        // It reads no answers, so at some time the socket takes nothing more.
        if flooding.socket.send(Message::text("{\"unplot\":{\"id\":1}}")).is_err() {
            break;
        }
    }
    other.goes(&json!({ "step": { "ticks": 10 } }), 10);
    drop(flooding);
    for _ in 0..30 {
        let window = served.window();
        let stream = window.socket.get_ref().try_clone().unwrap();
        stream.shutdown(std::net::Shutdown::Both).unwrap();
        drop(window);
        std::thread::sleep(Duration::from_millis(20));
    }
    for _ in 0..30 {
        drop(TcpStream::connect(("127.0.0.1", served.port)).unwrap());
    }
    other.goes(&json!({ "step": { "ticks": 10 } }), 20);
    drop(other);
    unharmed(served);
}

#[test]
fn a_read_only_run_is_watched_but_not_changed() {
    let served = served_by(View::bind_read_only().unwrap(), exact());
    let mut window = served.window();
    assert_eq!(window.hello["read_only"], true);
    for command in [
        json!({ "pause": {} }),
        json!({ "end": {} }),
        json!({ "step": { "ticks": 1 } }),
        json!({ "do": { "silence": { "at": "memory" } } }),
        json!({ "point": { "output": "request.out", "to": "NUT", "how": "set" } }),
    ] {
        window.send(&command);
        assert!(window.answer("refused").as_str().unwrap().contains("read-only"), "{command}");
    }
    let what = json!({ "similar": { "output": "memory.output", "to": ["NUT"] } });
    window.send(&json!({ "plot": { "key": 1, "what": what } }));
    window.answer("plotted");
    let (first, _) = window.frame();
    while window.frame().0.tick <= first.tick {}
    assert_eq!(window.frame().0.logged, 0);
}

/// A generator of a fixed sequence.
struct Dice(u64);

impl Dice {
    fn throw(&mut self, sides: usize) -> usize {
        self.0 =
            self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as usize % sides
    }
}

#[test]
fn messages_at_random_are_refused_or_done_and_the_run_lives() {
    let served = served(exact());
    let seeds = [
        r#"{"plot":{"key":1,"what":{"values":{"output":"memory.output","count":3}}}}"#,
        r#"{"plot":{"key":2,"what":{"similar":{"output":"memory.output","to":["NUT * (BOLT + ~NUT)"]}}}}"#,
        r#"{"do":{"clamp":{"output":"rules.chosen","values":[1,0.5,-2e30]}}}"#,
        r#"{"do":{"noise":{"scale":1.5}}}"#,
        r#"{"do":{"silence":{"at":"memory"}}}"#,
        r#"{"do":{"release":{"at":"memory"}}}"#,
        r#"{"point":{"output":"request.out","to":"NUT","how":"set"}}"#,
        r#"{"step":{"ticks":3}}"#,
        r#"{"back":{"ticks":2}}"#,
        r#"{"seek":{"tick":7}}"#,
        r#"{"run":{"speed":3.5}}"#,
        r#"{"unplot":{"id":1}}"#,
        r#"{"pause":{}}"#,
        r#"{"log":{}}"#,
    ];
    let pieces: [&[u8]; 8] = [b"{", b"}", b"null", b"9e99", b"-1", b"\"", b"\\u0000", b"[[[["];
    let mut dice = Dice(44);
    let mut answers = 0;
    for _ in 0..25 {
        let mut window = served.window();
        for _ in 0..60 {
            let mut text = seeds[dice.throw(seeds.len())].as_bytes().to_vec();
            for _ in 0..dice.throw(4) {
                let at = dice.throw(text.len());
                match dice.throw(4) {
                    0 => text[at] = dice.throw(256) as u8,
                    1 => drop(text.drain(at..(at + dice.throw(9)).min(text.len()))),
                    2 => drop(text.splice(at..at, pieces[dice.throw(8)].iter().copied())),
                    _ => text.extend_from_within(at..),
                }
                if text.is_empty() {
                    text.push(b' ');
                }
            }
            let message = match (String::from_utf8(text), dice.throw(50)) {
                (Ok(text), 1..) => Message::text(text),
                (Ok(text), 0) => Message::binary(text.into_bytes()),
                (Err(bytes), _) => Message::binary(bytes.into_bytes()),
            };
            window.socket.send(message).unwrap();
        }
        // Everything before was done or refused.
        window.send(&json!({ "log": {} }));
        window.answer("saved");
        answers += 1;
    }
    assert_eq!(answers, 25);
    // It stands, answers and can be repeated from its log.
    let mut last = served.window();
    last.send(&json!({ "pause": {} }));
    last.send(&json!({ "log": {} }));
    last.answer("saved");
    drop(last);
    let live = served.ended();
    let mut again = symbolt::sim::Live::new(exact(), symbolt::sim::LiveOptions::default()).unwrap();
    again.follow(&live.log()).unwrap();
    again.seek(live.tick()).unwrap();
    assert!(live.sim().checkpoint().unwrap() == again.sim().checkpoint().unwrap());
}
