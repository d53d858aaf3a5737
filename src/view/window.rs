//! One window: its token, its commands, and the latest frame whenever it can take one.

use std::io::{ErrorKind, Read};
use std::net::TcpStream;
use std::time::{Duration, Instant};

use serde::Deserialize;
use serde_json::json;
use tungstenite::protocol::frame::coding::CloseCode;
use tungstenite::protocol::{CloseFrame, Role, WebSocketConfig};
use tungstenite::{Bytes, Error, Message, WebSocket};

use super::command::{Command, MOST_BYTES, plot_key};
use super::hub::Hub;

/// Time for the token to come.
const FIRST: Duration = Duration::from_secs(5);
/// Time after which a window that takes nothing is dropped.
const STALLED: Duration = Duration::from_secs(20);
/// Time between two pings, and time without an answer after which a window is dropped.
const PINGS: [Duration; 2] = [Duration::from_secs(15), Duration::from_secs(60)];
/// Time between two looks at the socket of a window that waits for frames. Each takes a processor from the run for a moment.
const NAP: Duration = Duration::from_millis(16);
/// Time between two looks at a socket that takes nothing.
const BLOCKED: Duration = Duration::from_millis(50);
/// Greatest number of messages that are read between two frames.
const MOST_READ: usize = 64;
/// Greatest number of malformed messages before a window is dropped.
const MOST_MALFORMED: usize = 100;

/// The first message.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct First {
    token: String,
}

/// Compares in a time that depends on the lengths alone.
fn same(a: &str, b: &str) -> bool {
    let different = a.bytes().zip(b.bytes()).fold(0, |all, (a, b)| all | (a ^ b));
    // A compiler must not see that the first difference decides.
    std::hint::black_box(different) == 0 && a.len() == b.len()
}

/// Why the window's thread ends; nobody asks further.
struct Gone;

/// A window's place among those that are open. Dropping it, in a panic as well, gives the place back.
struct Entered<'h> {
    hub: &'h Hub,
    id: u64,
}

impl Drop for Entered<'_> {
    fn drop(&mut self) {
        self.hub.leave(self.id);
    }
}

struct Talk<'h> {
    socket: WebSocket<TcpStream>,
    hub: &'h Hub,
    /// Since when the socket takes nothing.
    blocked: Option<Instant>,
    heard: Instant,
    malformed: usize,
    /// Whether a message was too long: the socket cannot read another one.
    oversized: bool,
}

/// Talks with a window until it is gone.
pub(super) fn talk(stream: TcpStream, rest: Vec<u8>, hub: &Hub) {
    if stream.set_nonblocking(true).is_err() || stream.set_nodelay(true).is_err() {
        return;
    }
    let config = WebSocketConfig::default()
        .max_message_size(Some(MOST_BYTES))
        .max_frame_size(Some(MOST_BYTES))
        .read_buffer_size(16_384);
    let socket = WebSocket::from_partially_read(stream, rest, Role::Server, Some(config));
    let mut talk =
        Talk { socket, hub, blocked: None, heard: Instant::now(), malformed: 0, oversized: false };
    if talk.admitted().is_err() {
        return;
    }
    match hub.enter() {
        Ok(id) => {
            let _entered = Entered { hub, id };
            let Gone = talk.frames(id);
        }
        Err(_) => talk.refuse(CloseCode::Again, "ten windows are open already"),
    }
}

impl Talk<'_> {
    /// Reads the token.
    fn admitted(&mut self) -> Result<(), Gone> {
        let until = Instant::now() + FIRST;
        loop {
            match self.read()? {
                Some(Message::Text(text)) => {
                    let first: Option<First> = serde_json::from_str(&text).ok();
                    if first.is_some_and(|first| same(&first.token, &self.hub.token)) {
                        return Ok(());
                    }
                    self.refuse(CloseCode::Policy, "wrong token");
                    return Err(Gone);
                }
                Some(Message::Ping(_) | Message::Pong(_)) => {}
                Some(_) => {
                    self.refuse(CloseCode::Policy, "the first message is the token");
                    return Err(Gone);
                }
                None if Instant::now() >= until || self.closing() => {
                    self.refuse(CloseCode::Policy, "no token came");
                    return Err(Gone);
                }
                None => std::thread::sleep(NAP),
            }
        }
    }

    fn closing(&self) -> bool {
        self.hub.closing.load(std::sync::atomic::Ordering::Relaxed)
    }

    /// Closes the connection with a reason. Gives the window a moment to take it.
    fn refuse(&mut self, code: CloseCode, reason: &'static str) {
        let frame = CloseFrame { code, reason: reason.into() };
        let until = Instant::now() + Duration::from_millis(500);
        let mut closing = self.socket.close(Some(frame));
        while Instant::now() < until {
            match closing {
                Err(Error::Io(error)) if error.kind() == ErrorKind::WouldBlock => {}
                Err(_) => return,
                Ok(()) => {}
            }
            std::thread::sleep(NAP);
            closing = match self.oversized {
                true => self.drain(),
                false => self.socket.read().map(|_| ()),
            };
        }
    }

    /// Throws away a piece of what still comes. A connection that is closed with bytes unread is reset, and its reason lost.
    fn drain(&mut self) -> Result<(), Error> {
        self.socket.flush()?;
        let mut piece = [0; 16_384];
        for _ in 0..MOST_READ {
            if self.socket.get_mut().read(&mut piece)? == 0 {
                return Err(Error::ConnectionClosed);
            }
        }
        Ok(())
    }

    /// Reads a message; `None` if none has come.
    fn read(&mut self) -> Result<Option<Message>, Gone> {
        match self.socket.read() {
            Ok(message) => {
                self.heard = Instant::now();
                Ok(Some(message))
            }
            Err(Error::Io(error)) if error.kind() == ErrorKind::WouldBlock => Ok(None),
            Err(Error::Capacity(_)) => {
                self.oversized = true;
                self.refuse(CloseCode::Size, "a message has more than 64 kB");
                Err(Gone)
            }
            Err(_) => Err(Gone),
        }
    }

    /// Writes a message, or what is left of those before. Notes since when the socket takes nothing.
    fn write(&mut self, message: Option<Message>) -> Result<(), Gone> {
        let written = match message {
            Some(message) => self.socket.write(message).and_then(|()| self.socket.flush()),
            None => self.socket.flush(),
        };
        match written {
            Ok(()) => self.blocked = None,
            Err(Error::Io(error)) if error.kind() == ErrorKind::WouldBlock => {
                let since = *self.blocked.get_or_insert_with(Instant::now);
                if since.elapsed() > STALLED {
                    return Err(Gone);
                }
            }
            Err(_) => return Err(Gone),
        }
        Ok(())
    }

    /// Sends answers and frames and takes commands until the window is gone.
    fn frames(&mut self, id: u64) -> Gone {
        let run = |talk: &mut Self| -> Result<(), Gone> {
            let (mut seen, mut pinged) = (0, Instant::now());
            loop {
                if talk.closing() {
                    talk.refuse(CloseCode::Away, "the run has ended");
                    return Err(Gone);
                }
                talk.write(None)?;
                let frame = match talk.blocked {
                    None => talk.hub.newer(seen, NAP),
                    Some(_) => {
                        std::thread::sleep(BLOCKED);
                        None
                    }
                };
                while talk.blocked.is_none()
                    && let Some(answer) = talk.hub.answer(id).map_err(|_| Gone)?
                {
                    talk.write(Some(Message::text(&*answer)))?;
                }
                if let Some((number, frame)) = frame
                    && talk.blocked.is_none()
                {
                    seen = number;
                    talk.write(Some(Message::binary(frame.of(id))))?;
                }
                if pinged.elapsed() > PINGS[0] && talk.blocked.is_none() {
                    pinged = Instant::now();
                    talk.write(Some(Message::Ping(Bytes::new())))?;
                }
                if talk.heard.elapsed() > PINGS[1] {
                    return Err(Gone);
                }
                // A window that takes no answers gets none: its commands wait in the socket.
                for _ in 0..MOST_READ {
                    if talk.blocked.is_some() {
                        break;
                    }
                    let Some(message) = talk.read()? else { break };
                    talk.obey(id, &message)?;
                }
            }
        };
        run(self).err().unwrap_or(Gone)
    }

    /// Hands a command to the run, or says why not.
    fn obey(&mut self, id: u64, message: &Message) -> Result<(), Gone> {
        let refused = match message {
            Message::Text(text) => match Command::parse(text) {
                Ok(command) if self.hub.read_only && command.touches() => {
                    Some("this run is read-only: it can be watched, not changed".into())
                }
                Ok(command) => (!self.hub.send(id, command))
                    .then(|| "too many commands wait; send again when the run has gone on".into()),
                Err(reason) => {
                    self.malformed += 1;
                    Some(reason)
                }
            },
            Message::Binary(_) => {
                self.malformed += 1;
                Some("commands are text".into())
            }
            _ => None,
        };
        if self.malformed > MOST_MALFORMED {
            self.refuse(CloseCode::Policy, "too many malformed commands");
            return Err(Gone);
        }
        match refused {
            Some(reason) => {
                let plot = match message {
                    Message::Text(text) => plot_key(text),
                    _ => None,
                };
                let answer = json!({ "refused": reason, "plot": plot }).to_string();
                self.write(Some(Message::text(answer)))
            }
            None => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::same;

    #[test]
    fn tokens_are_compared_whole() {
        assert!(same("0123", "0123"));
        for wrong in ["", "0", "012", "0124", "1123", "01234"] {
            assert!(!same(wrong, "0123"), "{wrong}");
        }
    }
}
