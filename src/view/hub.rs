//! What the run's thread and the windows' threads share: the latest frame, answers, and the commands that wait.
//!
//! The run never waits for a window. It replaces the frame, and windows take the latest when they can.

use std::collections::VecDeque;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc::{SyncSender, TrySendError};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use serde_json::json;

use super::command::Command;
use crate::sim::InterventionLog;

/// Greatest number of windows.
pub(super) const MOST_WINDOWS: usize = 10;
/// Greatest number of answers that wait for a window.
const MOST_ANSWERS: usize = 256;
/// Greatest number of their bytes, if there are several.
const MOST_BYTES: usize = 16_000_000;

/// A command with the number of its window.
pub(super) type Sent = (u64, Command);

/// A frame: what all windows get, then the plots of all windows.
#[derive(Clone, Default)]
pub(super) struct Frame {
    bytes: Arc<[u8]>,
    /// Where the plots begin.
    head: usize,
    /// The window of each plot, and where the plot ends.
    plots: Arc<[(u64, usize)]>,
}

impl Frame {
    pub fn new(bytes: Vec<u8>, head: usize, plots: Vec<(u64, usize)>) -> Self {
        Self { bytes: bytes.into(), head, plots: plots.into() }
    }

    /// Returns the frame with the plots of one window.
    pub fn of(&self, window: u64) -> Vec<u8> {
        let mut own = self.bytes[..self.head].to_vec();
        let (mut from, mut count) = (self.head, 0_u16);
        for (owner, end) in self.plots.iter() {
            if *owner == window {
                own.extend_from_slice(&self.bytes[from..*end]);
                count += 1;
            }
            from = *end;
        }
        own[2..4].copy_from_slice(&count.to_le_bytes());
        own
    }
}

/// A frame with its number, counted from 1.
#[derive(Clone, Default)]
struct Latest {
    number: u64,
    frame: Frame,
}

/// Answers for one window.
struct Window {
    id: u64,
    answers: VecDeque<Arc<str>>,
    /// The log of the run, which can be long: it comes after the answers.
    log: Option<InterventionLog>,
    /// Whether answers were lost because the window does not read.
    lost: bool,
}

#[derive(Default)]
struct Windows {
    next: u64,
    open: Vec<Window>,
    /// What a window is told first: the graph.
    hello: Option<Arc<str>>,
    /// What it is told next: how the run stands, its log, its branches, and its events.
    standing: [Option<Arc<str>>; 4],
}

/// Why a window is not let in.
pub(super) struct Full;

/// See the module.
pub(super) struct Hub {
    pub token: String,
    pub port: u16,
    pub read_only: bool,
    /// The run looks up from its ticks: a frame is due, or a command waits.
    pub due: AtomicBool,
    /// A window has taken the latest frame, or has come since: another frame is of use.
    pub wanted: AtomicBool,
    pub closing: AtomicBool,
    /// Number of connections, windows included.
    pub connections: AtomicUsize,
    commands: SyncSender<Sent>,
    latest: Mutex<Latest>,
    news: Condvar,
    windows: Mutex<Windows>,
}

/// Locks. A thread that panicked while it held the lock left whole values behind.
fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Hub {
    pub fn new(token: String, port: u16, read_only: bool, commands: SyncSender<Sent>) -> Self {
        Self {
            token,
            port,
            read_only,
            due: AtomicBool::new(false),
            wanted: AtomicBool::new(true),
            closing: AtomicBool::new(false),
            connections: AtomicUsize::new(0),
            commands,
            latest: Mutex::default(),
            news: Condvar::new(),
            windows: Mutex::default(),
        }
    }

    /// Makes the run look up after the tick that it computes.
    pub fn look_up(&self) {
        self.due.store(true, Ordering::Relaxed);
    }

    /// Hands a command to the run. Never waits; `false` if too many commands wait already.
    pub fn send(&self, window: u64, command: Command) -> bool {
        let sent = match self.commands.try_send((window, command)) {
            Ok(()) => true,
            Err(TrySendError::Full(_) | TrySendError::Disconnected(_)) => false,
        };
        self.look_up();
        sent
    }

    /// Replaces the latest frame.
    pub fn publish(&self, frame: Frame) {
        self.wanted.store(false, Ordering::Relaxed);
        let mut latest = locked(&self.latest);
        *latest = Latest { number: latest.number + 1, frame };
        drop(latest);
        self.news.notify_all();
    }

    /// Returns the latest frame if it is newer than number `seen`. Waits at most `wait` for one.
    pub fn newer(&self, seen: u64, wait: Duration) -> Option<(u64, Frame)> {
        let latest = locked(&self.latest);
        let old = |latest: &mut Latest| latest.number <= seen;
        let waited = self.news.wait_timeout_while(latest, wait, old);
        let (latest, _) = waited.unwrap_or_else(PoisonError::into_inner);
        let newer = (latest.number > seen).then(|| (latest.number, latest.frame.clone()));
        if newer.is_some() {
            self.wanted.store(true, Ordering::Relaxed);
        }
        newer
    }

    /// Lets a window in. It is told the graph first.
    pub fn enter(&self) -> Result<u64, Full> {
        let mut windows = locked(&self.windows);
        if windows.open.len() >= MOST_WINDOWS {
            return Err(Full);
        }
        windows.next += 1;
        let (id, standing) = (windows.next, windows.standing.clone());
        let answers = windows.hello.iter().cloned().chain(standing.into_iter().flatten()).collect();
        windows.open.push(Window { id, answers, log: None, lost: false });
        drop(windows);
        self.wanted.store(true, Ordering::Relaxed);
        self.look_up();
        Ok(id)
    }

    pub fn leave(&self, id: u64) {
        locked(&self.windows).open.retain(|window| window.id != id);
        self.look_up();
    }

    /// Returns the numbers of the open windows.
    pub fn open(&self) -> Vec<u64> {
        locked(&self.windows).open.iter().map(|window| window.id).collect()
    }

    /// Returns the next answer for a window; an error if some were lost or the window is closed.
    pub fn answer(&self, id: u64) -> Result<Option<Arc<str>>, Full> {
        let mut windows = locked(&self.windows);
        let window = windows.open.iter_mut().find(|window| window.id == id);
        let window = window.filter(|window| !window.lost).ok_or(Full)?;
        let (answer, log) = match window.answers.pop_front() {
            Some(answer) => (Some(answer), None),
            None => (None, window.log.take()),
        };
        // The run does not wait for a long log to be written out.
        drop(windows);
        let written = |log: InterventionLog| json!({ "saved": log.to_string() }).to_string();
        Ok(answer.or_else(|| log.map(|log| written(log).into())))
    }

    /// Returns whether there has been a window.
    pub fn was_entered(&self) -> bool {
        locked(&self.windows).next > 0
    }

    /// Returns whether a log waits for a window.
    pub fn log_waits(&self, id: u64) -> bool {
        locked(&self.windows).open.iter().any(|window| window.id == id && window.log.is_some())
    }

    /// Tells a window the log. At most one waits. The window's thread writes it out.
    pub fn tell_log(&self, id: u64, log: InterventionLog) {
        let mut windows = locked(&self.windows);
        if let Some(window) = windows.open.iter_mut().find(|window| window.id == id) {
            window.log = Some(log);
        }
    }

    /// Tells a window something.
    pub fn tell(&self, id: u64, what: &serde_json::Value) {
        let what: Arc<str> = what.to_string().into();
        let mut windows = locked(&self.windows);
        if let Some(window) = windows.open.iter_mut().find(|window| window.id == id) {
            put(window, what);
        }
    }

    /// Tells all windows, also those that come later, what graph runs.
    pub fn tell_graph(&self, hello: &serde_json::Value) {
        let hello: Arc<str> = hello.to_string().into();
        let mut windows = locked(&self.windows);
        windows.hello = Some(hello.clone());
        windows.open.iter_mut().for_each(|window| put(window, hello.clone()));
    }

    /// Tells all windows, also those that come later: as number 0 how the run stands, as number 1 its log, as number 2 its
    /// branches, as number 3 its events. Says it only if it has changed.
    pub fn tell_standing(&self, number: usize, what: &serde_json::Value) {
        let what: Arc<str> = what.to_string().into();
        let mut windows = locked(&self.windows);
        if windows.standing[number].as_ref() == Some(&what) {
            return;
        }
        windows.standing[number] = Some(what.clone());
        windows.open.iter_mut().for_each(|window| put(window, what.clone()));
    }
}

fn put(window: &mut Window, what: Arc<str>) {
    let bytes: usize = window.answers.iter().map(|answer| answer.len()).sum();
    let room = bytes == 0 || bytes + what.len() <= MOST_BYTES;
    match room && window.answers.len() < MOST_ANSWERS {
        true => window.answers.push_back(what),
        false => {
            window.lost = true;
            window.answers.clear();
        }
    }
}
