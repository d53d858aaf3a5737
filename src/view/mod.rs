//! Live runs in a browser: a server on the loopback address, and a page that shows the run and changes it.
//!
//! [`View::bind`] opens the address, and [`View::serve`] runs a [`Live`] run for whoever opens the page, until a window ends it:
//!
//! ```no_run
//! use symbolt::prelude::*;
//! use symbolt::sim::{Live, LiveOptions};
//! use symbolt::view::View;
//!
//! let mut graph = GraphBuilder::new();
//! graph.add("one", Constant::scalar(1.0));
//! let sim = graph.start(&PopulationPlan::direct(), Seed::new(1))?;
//!
//! let mut view = View::bind()?;
//! println!("{}", view.address());
//! let live = view.serve(Live::new(sim, LiveOptions::default())?)?;
//! print!("{}", live.log());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! The run stays on the calling thread. It never waits for a window: each has a thread of its own, which takes the latest
//! frame when it can, and hands on commands. What a window changes is in the log of the run, so a run that follows the log
//! repeats the session with the same bits.
//!
//! | file | content |
//! |---|---|
//! | `command` | the closed set of commands |
//! | `hub` | what threads share |
//! | `http` | requests, and the files of `page` |
//! | `window` | one window: token, commands, frames |
//! | `sampler` | plots, and the layout of frames |
//! | `drive` | the loop of the run: stop, step, go back, change |
//! | `branches` | what a run had done before a window went back |
//! | `log_file` | the log as a file that grows |

mod branches;
mod command;
mod drive;
mod http;
mod hub;
mod log_file;
mod page;
mod sampler;
mod window;

use std::io;
use std::net::{Ipv4Addr, SocketAddr, TcpListener, TcpStream};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::sync::mpsc::{Receiver, sync_channel};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use rand::TryRng;
use rand::rngs::SysRng;
use serde_json::Value;
use thiserror::Error;

use self::branches::Branches;
pub use self::drive::Driven;
use self::drive::Mode;
use self::hub::{Hub, Sent};
use self::log_file::LogFile;
use self::sampler::{Reading, Sampler, Standing};
use crate::record::RecordingFiles;
use crate::sim::{Graph, Live, LiveError, Real, SimView};

/// Greatest number of commands that wait for the run.
const MOST_COMMANDS: usize = 256;
/// Greatest number of connections at a time.
const MOST_CONNECTIONS: usize = 64;
/// Time between two frames.
const FRAME: Duration = Duration::from_micros(16_667);

/// Why a view cannot be opened.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ViewError {
    /// The address cannot be opened.
    #[error("no port of 127.0.0.1 can be opened: {0}")]
    Listen(#[source] io::Error),
    /// The system gives no random numbers for the token, or no threads.
    #[error("the system gives no {what}: {why}")]
    System {
        /// What is missing.
        what: &'static str,
        /// The reason.
        why: String,
    },
}

type Poses = dyn FnMut(&SimView<'_>, &mut Vec<Real>) + Send;
type Tell = dyn FnMut(&SimView<'_>, &mut String) -> u32 + Send;
type Describe = dyn FnMut(&SimView<'_>, u32) -> Option<String> + Send;

/// A scene in three dimensions.
struct Scene {
    outline: Value,
    poses: Box<Poses>,
}

/// A server on 127.0.0.1 with the page of a live run. Dropping it closes all windows.
///
/// At most ten windows are open at a time. Only who knows the address's fragment, 128 random bits, can open one.
pub struct View {
    hub: Arc<Hub>,
    address: String,
    commands: Receiver<Sent>,
    threads: Vec<JoinHandle<()>>,
    title: String,
    readings: Vec<Reading>,
    scene: Option<Scene>,
    events: Option<Box<Tell>>,
    describe: Option<Box<Describe>>,
    mode: Mode,
    standing: Standing,
    /// The plots, with the graph to which they belong.
    sampled: Option<(Arc<Graph>, Sampler)>,
    /// Branches of the run of that graph.
    branches: Branches,
    log: Option<LogFile>,
    /// Why the log could not be written.
    log_fault: Option<io::Error>,
    recordings: Option<RecordingFiles>,
    /// Why the recordings could not be written.
    recording_fault: Option<io::Error>,
}

impl std::fmt::Debug for View {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        // Without the token.
        write!(f, "View(port {})", self.hub.port)
    }
}

impl View {
    /// Opens a free port of 127.0.0.1. The run of [`serve`](Self::serve) waits at its start until a window lets it go.
    ///
    /// # Errors
    /// [`ViewError::Listen`] or [`ViewError::System`].
    pub fn bind() -> Result<Self, ViewError> {
        Self::open(false)
    }

    /// As [`bind`](Self::bind), but windows can only watch. The run starts with the first window, in simulated time as on the clock. It
    /// ends when it cannot go on and the last window has left.
    ///
    /// # Errors
    /// As [`bind`](Self::bind).
    pub fn bind_read_only() -> Result<Self, ViewError> {
        Self::open(true)
    }

    fn open(read_only: bool) -> Result<Self, ViewError> {
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).map_err(ViewError::Listen)?;
        let port = listener.local_addr().map_err(ViewError::Listen)?.port();
        let system = |what, why: String| ViewError::System { what, why };
        let mut random = [0_u8; 16];
        SysRng
            .try_fill_bytes(&mut random)
            .map_err(|error| system("random numbers", error.to_string()))?;
        let token: String = random.iter().map(|byte| format!("{byte:02x}")).collect();
        let address = format!("http://127.0.0.1:{port}/#{token}");
        let (sender, commands) = sync_channel(MOST_COMMANDS);
        let hub = Arc::new(Hub::new(token, port, read_only, sender));
        let mut view = Self {
            hub: hub.clone(),
            address,
            commands,
            threads: Vec::new(),
            title: "live run".into(),
            readings: Vec::new(),
            scene: None,
            events: None,
            describe: None,
            mode: if read_only { Mode::running(Some(1.0)) } else { Mode::Stopped },
            standing: Standing::default(),
            sampled: None,
            branches: Branches::default(),
            log: None,
            log_fault: None,
            recordings: None,
            recording_fault: None,
        };
        let thread = |name: &str, run: Box<dyn FnOnce() + Send>| {
            let thread = thread::Builder::new().name(name.into()).spawn(run);
            thread.map_err(|error| system("threads", error.to_string()))
        };
        let pace = hub.clone();
        let paced = move || {
            while !pace.closing.load(Ordering::Relaxed) {
                thread::sleep(FRAME);
                if !pace.open().is_empty() {
                    pace.look_up();
                }
            }
        };
        view.threads.push(thread("view pace", Box::new(paced))?);
        view.threads.push(thread("view", Box::new(move || accept(&listener, &hub)))?);
        Ok(view)
    }

    /// Returns the address to open in a browser, with the token in its fragment.
    pub fn address(&self) -> &str {
        &self.address
    }

    /// Sets the title of the page.
    #[must_use]
    pub fn titled(mut self, title: &str) -> Self {
        self.title = title.into();
        self
    }

    /// Offers named numbers for plots. `read` writes one number for each of `names` after a tick.
    #[must_use]
    pub fn with_reading(
        mut self,
        name: &str,
        names: &[String],
        read: impl Fn(&SimView<'_>, &mut [Real]) + Send + 'static,
    ) -> Self {
        let names = names.to_vec();
        self.readings.push(Reading { name: name.into(), names, read: Box::new(read) });
        self
    }

    /// Takes back all readings: another graph is to run, which they do not fit.
    pub fn forget_readings(&mut self) {
        self.readings.clear();
    }

    /// Shows a scene in three dimensions: its outline as the page of a run has it, and what moves. `poses` writes, after a tick,
    /// the angles of the joints, the distances of both fingers, and the pose of each part as position and orientation.
    #[must_use]
    pub fn with_scene(
        mut self,
        outline: Value,
        poses: impl FnMut(&SimView<'_>, &mut Vec<Real>) + Send + 'static,
    ) -> Self {
        self.scene = Some(Scene { outline, poses: Box::new(poses) });
        self
    }

    /// Says what happens in the run: `tell` writes a text after a tick and returns the number of events so far, such as decisions.
    /// Windows can let the run go on until that number changes. It is called in every tick then.
    #[must_use]
    pub fn with_events(
        mut self,
        tell: impl FnMut(&SimView<'_>, &mut String) -> u32 + Send + 'static,
    ) -> Self {
        self.events = Some(Box::new(tell));
        self
    }

    /// Lists the events of [`with_events`](Self::with_events): `describe` returns the sentence of an event, by its number from 0.
    /// It is called after a tick, for events that windows have not been told of.
    #[must_use]
    pub fn with_list(
        mut self,
        describe: impl FnMut(&SimView<'_>, u32) -> Option<String> + Send + 'static,
    ) -> Self {
        self.describe = Some(Box::new(describe));
        self
    }

    /// Moves what the probes of the run record to files as the run goes on, so that memory stays bounded. When the run goes
    /// back, so do the files. After a return to a branch they go on at its end. They end with the run that
    /// [`serve`](Self::serve) returns: a further run needs files of its own.
    #[must_use]
    pub fn with_recordings(mut self, files: RecordingFiles) -> Self {
        self.recordings = Some(files);
        self
    }

    /// Returns why the recordings could not be written, if they could not.
    pub fn recording_fault(&mut self) -> Option<io::Error> {
        self.recording_fault.take()
    }

    /// Writes the log of what is changed to a file as the run goes on, so that nothing is lost if the program is stopped. A file
    /// that exists is replaced.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn with_log(mut self, path: &Path) -> io::Result<Self> {
        self.log = Some(LogFile::create(path)?);
        Ok(self)
    }

    /// Ends the log of [`with_log`](Self::with_log), for another graph is to run: what is changed there is not written.
    pub fn end_log(&mut self) {
        self.log = None;
    }

    /// Returns why the log could not be written, if it could not.
    pub fn log_fault(&mut self) -> Option<io::Error> {
        self.log_fault.take()
    }

    /// Runs a live run as windows ask for, until one ends it. Returns it where it stands.
    ///
    /// # Errors
    /// The run's own, if it had failed when it was ended. Before that a window can go back.
    pub fn serve(&mut self, mut live: Live) -> Result<Live, LiveError> {
        let driven = self.drive(&mut live, |_| std::ops::ControlFlow::Continue(()));
        self.recordings = None;
        driven.map(|_| live)
    }
}

impl Drop for View {
    fn drop(&mut self) {
        self.hub.closing.store(true, Ordering::Relaxed);
        // Wakes the thread that waits for connections.
        drop(TcpStream::connect(SocketAddr::from((Ipv4Addr::LOCALHOST, self.hub.port))));
        for thread in self.threads.drain(..) {
            // A thread that panicked has nothing left to clean up.
            drop(thread.join());
        }
        // Windows are told why.
        let until = std::time::Instant::now() + Duration::from_secs(1);
        while self.hub.connections.load(Ordering::Acquire) > 0 && std::time::Instant::now() < until
        {
            thread::sleep(Duration::from_millis(5));
        }
    }
}

/// A connection's place among those that are open. Dropping it, in a panic as well, gives the place back.
struct Connection(Arc<Hub>);

impl Drop for Connection {
    fn drop(&mut self) {
        self.0.connections.fetch_sub(1, Ordering::AcqRel);
    }
}

/// Takes connections, each on a thread of its own.
fn accept(listener: &TcpListener, hub: &Arc<Hub>) {
    for stream in listener.incoming() {
        if hub.closing.load(Ordering::Relaxed) {
            return;
        }
        let Ok(mut stream) = stream else {
            // Too many open files, for example.
            thread::sleep(Duration::from_millis(50));
            continue;
        };
        if hub.connections.fetch_add(1, Ordering::AcqRel) >= MOST_CONNECTIONS {
            hub.connections.fetch_sub(1, Ordering::AcqRel);
            continue;
        }
        let own = Connection(hub.clone());
        let connected = move || {
            if let Ok(Some(rest)) = http::receive(&mut stream, &own.0) {
                window::talk(stream, rest, &own.0);
            }
        };
        // If there is no thread, the connection is dropped with its place.
        drop(thread::Builder::new().name("view window".into()).spawn(connected));
    }
}
