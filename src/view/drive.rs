//! The loop of a watched run: takes commands, runs ticks, and publishes frames.

use std::collections::VecDeque;
use std::ops::ControlFlow;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::sync::mpsc::RecvTimeoutError;
use std::time::{Duration, Instant};

use serde_json::{Map, Value, json};

use super::branches::Branches;
use super::command::{Command, How};
use super::sampler::{Sampler, pointer};
use super::{FRAME, View};
use crate::sim::{
    Graph, GraphOutline, Intervention, InterventionLog, Live, LiveError, SimDuration, SimView,
    Simulator, Stop, StopReason, cut,
};
use crate::spa::OutputVocabulary;

/// Greatest number of commands that are taken between two stretches of ticks.
const MOST_COMMANDS: usize = 64;
/// Number of interventions that windows are told of, and of characters of each; they can ask for the whole log.
const TOLD: usize = 100;
const LINE: usize = 200;
/// Shortest time between two frames of a run that goes on: a little less than between two looks of the clock.
const SHORTEST: Duration = Duration::from_millis(14);
/// The same if no window has taken the last frame.
const UNREAD: Duration = Duration::from_millis(250);
/// Ticks after which recordings are moved to their files.
const RECORDED: u64 = 1_000;
/// Number of events that windows are told of.
const LISTED: u32 = 200;

/// How a watched run ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Driven {
    /// The stop condition ended it.
    Stopped(StopReason),
    /// A window has gone back from the end.
    WentBack,
    /// A window ended it.
    Ended,
}

/// What the run does.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Mode {
    Stopped,
    /// At a speed in simulated seconds a second since a moment and a tick, or without one as fast as it goes.
    Running {
        speed: Option<f64>,
        since: Option<(Instant, u64)>,
    },
    /// As fast as it goes to the end of this tick.
    To(u64),
    /// As fast as it goes until the number of events is another.
    Until(u32),
}

impl Mode {
    pub fn running(speed: Option<f64>) -> Self {
        Self::Running { speed, since: None }
    }
}

/// A loop over one live run.
struct Loop<'v, 'l> {
    view: &'v mut View,
    live: &'l mut Live,
    sampler: Sampler,
    /// Why the run cannot go on: it has failed, or its end is reached.
    halted: Option<String>,
    /// Whether the run has reached its end.
    over: bool,
    /// The failure of the last tick.
    failure: Option<LiveError>,
    ended: bool,
    /// Moment and tick of the last frame.
    shown: (Instant, u64),
    /// Whether something has changed since the last frame.
    fresh: bool,
    doing: String,
    /// The length of the log and the epoch that windows were told of, and that are in the log's file.
    told: Option<(usize, u32)>,
    filed: Option<(usize, u32)>,
    /// Whether a window has returned to a branch.
    turned: bool,
    poses: Vec<f32>,
    /// The tick up to which recordings are in their files.
    recorded: u64,
    /// The last events in words, with the number of all, as windows were told; `None` after the run has gone back.
    listed: Option<(u32, VecDeque<String>)>,
}

impl View {
    /// Runs a live run as windows ask for, until `stop` breaks or a window ends it. `stop` is called after every tick, but not
    /// while the run goes back. Later calls may have another run; what it does goes on.
    ///
    /// # Errors
    /// The run's own, if it had failed when it was ended. Before that a window can go back.
    pub fn drive(
        &mut self,
        live: &mut Live,
        mut stop: impl FnMut(SimView<'_>) -> Stop,
    ) -> Result<Driven, LiveError> {
        let mut own = Loop::new(self, live, None);
        loop {
            own.obey();
            own.file_log();
            if own.live.tick().abs_diff(own.recorded) >= RECORDED {
                own.record();
            }
            if own.ended {
                return own.finish(Driven::Ended);
            }
            let ticks = own.ticks();
            if ticks == 0 {
                own.publish();
                if own.abandoned() {
                    return own.finish(Driven::Ended);
                }
                own.wait();
                continue;
            }
            if let Some(reason) = own.run(ticks, &mut stop) {
                own.publish();
                return own.finish(Driven::Stopped(reason));
            }
            own.publish();
        }
    }

    /// Stands at the end of a run, for the reason `why`, until a window goes back or ends it. A view that is read-only ends it
    /// when no window is open.
    ///
    /// # Errors
    /// As [`drive`](Self::drive).
    pub fn hold(&mut self, live: &mut Live, why: &str) -> Result<Driven, LiveError> {
        let end = live.tick();
        self.mode = Mode::Stopped;
        let mut own = Loop::new(self, live, Some(why.into()));
        own.over = true;
        loop {
            own.publish();
            own.wait();
            own.obey();
            own.file_log();
            if own.ended || own.abandoned() {
                return own.finish(Driven::Ended);
            }
            if own.turned || own.live.tick() < end {
                return own.finish(Driven::WentBack);
            }
        }
    }
}

impl View {
    /// Returns what windows are told of a graph.
    fn hello(&self, graph: &Graph, outline: &GraphOutline) -> Value {
        let names = outline.nodes.iter().flat_map(|node| &node.outputs).filter_map(|output| {
            let vocabulary = OutputVocabulary::of(graph, &output.name)?;
            Some((output.name.clone(), vocabulary.names().into()))
        });
        let pointers: Map<String, Value> = names.collect();
        let readings: Vec<_> = self.readings.iter().map(|reading| &reading.name).collect();
        json!({
            "title": self.title,
            "graph": outline,
            "pointers": pointers,
            "readings": readings,
            "read_only": self.hub.read_only,
            "events": self.events.is_some(),
            "listed": self.describe.is_some(),
            "scene": self.scene.as_ref().map(|scene| &scene.outline),
        })
    }
}

impl<'v, 'l> Loop<'v, 'l> {
    fn new(view: &'v mut View, live: &'l mut Live, halted: Option<String>) -> Self {
        let graph = live.sim().graph();
        let sampler = match view.sampled.take() {
            Some((own, sampler)) if Arc::ptr_eq(&own, graph) => sampler,
            // Plots belong to a graph: windows add theirs again.
            _ => {
                let outline = graph.outline();
                view.hub.tell_graph(&json!({ "hello": view.hello(graph, &outline) }));
                view.standing.epoch = view.standing.epoch.wrapping_add(1);
                view.branches = Branches::default();
                // So do ticks, which count from the start of each run.
                view.mode = match view.mode {
                    Mode::To(_) => Mode::Stopped,
                    Mode::Running { speed, .. } => Mode::running(speed),
                    mode => mode,
                };
                Sampler::new(graph, &outline)
            }
        };
        let shown = (Instant::now(), live.tick());
        Self {
            recorded: live.tick(),
            view,
            live,
            sampler,
            halted,
            over: false,
            failure: None,
            ended: false,
            shown,
            fresh: true,
            doing: String::new(),
            told: None,
            filed: None,
            turned: false,
            poses: Vec::new(),
            listed: None,
        }
    }

    fn finish(mut self, driven: Driven) -> Result<Driven, LiveError> {
        self.file_log();
        self.record();
        self.view.sampled = Some((self.live.sim().graph().clone(), self.sampler));
        match self.failure {
            Some(failure) => Err(failure),
            None => Ok(driven),
        }
    }

    /// Takes the commands that wait.
    fn obey(&mut self) {
        for _ in 0..MOST_COMMANDS {
            let Ok((window, command)) = self.view.commands.try_recv() else { return };
            self.take(window, command);
        }
    }

    /// Waits for a command, or for the next tick of a slow run.
    fn wait(&mut self) {
        let wait = match self.view.mode {
            Mode::Running { speed: Some(speed), .. } if self.halted.is_none() => {
                Duration::from_secs_f64(self.dt_s() / speed).min(FRAME)
            }
            _ => FRAME,
        };
        match self.view.commands.recv_timeout(wait) {
            Ok((window, command)) => self.take(window, command),
            Err(RecvTimeoutError::Timeout) => {}
            // The hub of the view holds the other end.
            Err(RecvTimeoutError::Disconnected) => self.ended = true,
        }
    }

    /// Writes to the log's file what has changed.
    fn file_log(&mut self) {
        let now = Some((self.live.made().len(), self.view.standing.epoch));
        if self.filed == now {
            return;
        }
        self.filed = now;
        if let Some(log) = &mut self.view.log
            && let Err(fault) = log.keep(self.live.made())
        {
            self.view.log = None;
            self.view.log_fault = Some(fault);
        }
    }

    /// Moves what was recorded to the files.
    fn record(&mut self) {
        self.recorded = self.live.tick();
        if let Some(files) = &mut self.view.recordings
            && let Err(fault) = files.take_live(self.live)
        {
            self.view.recordings = None;
            self.view.recording_fault = Some(fault);
        }
    }

    /// Cuts the files of recordings after a tick: the run has gone back, or to a branch that parted there.
    fn unrecord(&mut self, tick: u64) {
        self.recorded = self.live.tick();
        let time_s = tick as f64 * self.dt_s();
        if let Some(files) = &mut self.view.recordings {
            self.live.clear_recordings();
            if let Err(fault) = files.cut(time_s) {
                self.view.recordings = None;
                self.view.recording_fault = Some(fault);
            }
        }
    }

    fn dt_s(&self) -> f64 {
        self.live.sim().graph().timebase().dt_s()
    }

    fn take(&mut self, window: u64, command: Command) {
        let plot = match &command {
            Command::Plot { key, .. } => Some(*key),
            _ => None,
        };
        if let Err(reason) = self.make(window, command) {
            self.view.hub.tell(window, &json!({ "refused": reason, "plot": plot }));
        }
        self.fresh = true;
    }

    /// Does what a window asks for. The error is a sentence for the window.
    fn make(&mut self, window: u64, command: Command) -> Result<(), String> {
        let tick = self.live.tick();
        match command {
            Command::Pause {} => self.view.mode = Mode::Stopped,
            Command::Run { speed } => self.go(Mode::running(speed))?,
            Command::Step { ticks } => self.go_to(tick.saturating_add(ticks))?,
            Command::Until {} => {
                if self.view.events.is_none() {
                    return Err("this run tells of no events".into());
                }
                let events = self.events();
                self.go(Mode::Until(events))?;
            }
            Command::Back { ticks } => {
                let to = tick.checked_sub(ticks).ok_or("the run began less than that ago")?;
                self.go_back(to)?;
            }
            Command::Seek { tick: to } if to > tick => self.go_to(to)?,
            Command::Seek { tick: to } => self.go_back(to)?,
            Command::Plot { key, what } => {
                let graph = self.live.sim().graph();
                let (id, names) = self.sampler.plot(window, &what, graph, &self.view.readings)?;
                let plotted = json!({ "key": key, "id": id, "names": names });
                self.view.hub.tell(window, &json!({ "plotted": plotted }));
            }
            Command::Unplot { id } => {
                if !self.sampler.unplot(window, id) {
                    return Err(format!("this window has no plot {id}"));
                }
            }
            Command::Do(what) => self.intervene(what)?,
            Command::Point { output, to, how } => {
                let values = pointer(self.live.sim().graph(), &output, &to)?;
                self.intervene(match how {
                    How::Set => Intervention::Set { output, values },
                    How::Clamp => Intervention::Clamp { output, values },
                })?;
            }
            Command::Branch { id } => self.turn(id)?,
            Command::Forget {} => {
                if !self.live.ahead().is_empty() {
                    self.view.branches.part(tick);
                }
                let none = InterventionLog::default();
                self.live.follow(&none).map_err(|error| error.to_string())?;
            }
            Command::Log {} => {
                if self.view.hub.log_waits(window) {
                    return Err("the log that was asked for before is still on its way".into());
                }
                self.view.hub.tell_log(window, self.live.log());
            }
            Command::End {} => self.ended = true,
        }
        Ok(())
    }

    fn intervene(&mut self, what: Intervention) -> Result<(), String> {
        if self.over {
            return Err("the run is over; go back to change it".into());
        }
        let tick = self.live.tick();
        self.live.intervene(what).map_err(|error| error.to_string())?;
        self.view.branches.part(tick);
        Ok(())
    }

    fn go(&mut self, mode: Mode) -> Result<(), String> {
        match &self.halted {
            Some(why) => Err(format!("{why}; go back to go on")),
            None => {
                self.view.mode = mode;
                Ok(())
            }
        }
    }

    fn go_to(&mut self, tick: u64) -> Result<(), String> {
        self.sampler.space(tick.saturating_sub(self.live.tick()));
        self.go(Mode::To(tick))
    }

    fn turn(&mut self, id: u32) -> Result<(), String> {
        self.view.mode = Mode::Stopped;
        self.record();
        let parted = self.view.branches.turn(id, self.live)?;
        self.unrecord(parted);
        self.listed = None;
        self.sampler.forget();
        self.view.standing.epoch = self.view.standing.epoch.wrapping_add(1);
        (self.halted, self.failure, self.turned) = (None, None, true);
        Ok(())
    }

    fn go_back(&mut self, tick: u64) -> Result<(), String> {
        self.view.mode = Mode::Stopped;
        self.view.branches.leave(self.live);
        self.record();
        let gone = self.live.seek(tick);
        self.unrecord(self.live.tick());
        self.listed = None;
        self.sampler.forget();
        self.view.standing.epoch = self.view.standing.epoch.wrapping_add(1);
        match gone {
            Ok(()) => {
                if !self.over {
                    (self.halted, self.failure) = (None, None);
                }
                Ok(())
            }
            Err(error) => {
                let said = error.to_string();
                if matches!(error, LiveError::Sim(_)) {
                    (self.halted, self.failure) = (Some(said.clone()), Some(error));
                }
                Err(said)
            }
        }
    }

    fn events(&mut self) -> u32 {
        let events = self.view.events.as_mut();
        events.map_or(0, |tell| tell(&SimView::of(self.live.sim()), &mut self.doing))
    }

    /// Tells windows the events in words, if there are others than before.
    fn list(&mut self, events: u32) {
        let Some(describe) = &mut self.view.describe else { return };
        if self.listed.as_ref().is_some_and(|(known, _)| *known == events) {
            return;
        }
        let view = SimView::of(self.live.sim());
        let (known, texts) = self.listed.get_or_insert_default();
        for number in (*known).max(events.saturating_sub(LISTED))..events {
            texts.extend(describe(&view, number).map(|text| cut(&text, LINE).into_owned()));
        }
        *known = events;
        texts.drain(..texts.len().saturating_sub(LISTED as usize));
        self.view.hub.tell_standing(3, &json!({ "events": texts }));
    }

    /// Returns whether the run cannot go on and nobody is there who could take it back.
    fn abandoned(&self) -> bool {
        let hub = &self.view.hub;
        hub.read_only && self.halted.is_some() && hub.open().is_empty()
    }

    /// Returns how many ticks are due now.
    fn ticks(&mut self) -> u64 {
        let tick = self.live.tick();
        // Nobody can let a run go that is read-only: it starts with the first window.
        let hub = &self.view.hub;
        if self.halted.is_some() || hub.read_only && !hub.was_entered() {
            return 0;
        }
        let dt_s = self.dt_s();
        match &mut self.view.mode {
            Mode::Stopped => 0,
            Mode::Running { speed: None, .. } | Mode::Until(_) => u64::MAX - tick,
            Mode::To(to) => to.saturating_sub(tick),
            Mode::Running { speed: Some(speed), since } => {
                let (moment, from) = *since.get_or_insert((Instant::now(), tick));
                let passed = moment.elapsed().as_secs_f64();
                let due = from.saturating_add((passed * *speed / dt_s) as u64);
                if due > tick.saturating_add((0.2 * *speed / dt_s) as u64 + 1) {
                    // The machine is too slow for this speed: what was missed is not made up for.
                    *since = Some((Instant::now(), tick));
                    return 1;
                }
                due.saturating_sub(tick)
            }
        }
    }

    /// Runs at most so many ticks, until a frame is due or a command waits. Returns why the stop condition ended the run.
    fn run(
        &mut self,
        ticks: u64,
        stop: &mut impl FnMut(SimView<'_>) -> Stop,
    ) -> Option<StopReason> {
        let Self { view, live, sampler, doing, .. } = self;
        let View { hub, readings, events, mode, recordings, .. } = &mut **view;
        // Without a window nothing else interrupts the run.
        let ticks = if recordings.is_some() { ticks.min(RECORDED) } else { ticks };
        hub.due.store(false, Ordering::Relaxed);
        let until = match *mode {
            Mode::Until(events) => Some(events),
            _ => None,
        };
        let (mut over, mut happened) = (None, false);
        let ran = live.run_until(span(live.sim(), ticks), |view| {
            sampler.tick(&view, readings);
            if let (Some(before), Some(tell)) = (until, events.as_mut()) {
                happened = tell(&view, doing) != before;
            }
            if let ControlFlow::Break(reason) = stop(view) {
                over = Some(reason);
                return ControlFlow::Break(reason);
            }
            match happened || hub.due.load(Ordering::Relaxed) {
                true => ControlFlow::Break(StopReason::Condition("a window")),
                false => ControlFlow::Continue(()),
            }
        });
        self.fresh = true;
        let arrived = matches!(self.view.mode, Mode::To(to) if self.live.tick() >= to);
        if let Err(error) = ran {
            self.halted = Some(error.to_string());
            self.failure = Some(error);
        }
        if arrived || happened || self.halted.is_some() {
            self.view.mode = Mode::Stopped;
        }
        over
    }

    /// Publishes a frame if one is due: something has changed, and a window is open.
    fn publish(&mut self) {
        let (moment, from) = self.shown;
        let running = !matches!(self.view.mode, Mode::Stopped);
        let passed = moment.elapsed();
        let shortest = if self.view.hub.wanted.load(Ordering::Relaxed) { SHORTEST } else { UNREAD };
        if !self.fresh || running && passed < shortest {
            return;
        }
        let open = self.view.hub.open();
        self.sampler.keep(&open);
        if open.is_empty() {
            return;
        }
        let tick = self.live.tick();
        let gone = tick.saturating_sub(from);
        if running {
            self.sampler.space(gone);
        }
        let events = self.events();
        self.list(events);
        let (logged, ahead) = (self.live.made(), self.live.ahead().len());
        let earliest = self.live.earliest();
        let speed = gone as f64 * self.dt_s() / passed.as_secs_f64().max(1e-6);
        let standing = &mut self.view.standing;
        standing.mode = if self.over { 2 } else { u8::from(running) };
        (standing.earliest, standing.events) = (earliest, events);
        (standing.logged, standing.ahead) = (logged.len() as u32, ahead as u32);
        standing.speed = if running { speed as f32 } else { 0.0 };
        self.poses.clear();
        if let Some(scene) = &mut self.view.scene {
            (scene.poses)(&SimView::of(self.live.sim()), &mut self.poses);
        }
        let View { hub, standing, readings, .. } = &*self.view;
        let faults = [("log", &self.view.log_fault), ("recordings", &self.view.recording_fault)];
        let faults = faults.into_iter().filter_map(|(what, fault)| {
            fault.as_ref().map(|fault| format!("the {what} can no longer be written: {fault}"))
        });
        let faults: Vec<String> = faults.collect();
        hub.tell_standing(
            0,
            &json!({ "standing": { "doing": self.doing, "halted": self.halted, "faults": faults } }),
        );
        hub.tell_standing(2, &self.view.branches.told());
        if self.told != Some((logged.len(), standing.epoch)) {
            self.told = Some((logged.len(), standing.epoch));
            let last = logged.iter().skip(logged.len().saturating_sub(TOLD)).map(|entry| {
                let what = json!(entry.what).to_string();
                json!({ "tick": entry.tick, "do": cut(&what, LINE) })
            });
            let last: Vec<_> = last.collect();
            hub.tell_standing(1, &json!({ "log": { "count": logged.len(), "last": last } }));
        }
        hub.publish(self.sampler.frame(self.live.sim(), standing, readings, &self.poses));
        self.shown = (Instant::now(), tick);
        self.fresh = false;
    }
}

fn span(sim: &Simulator, ticks: u64) -> SimDuration {
    // A stretch ends at the next frame anyway.
    sim.graph().timebase().span(ticks.min(10_000_000))
}
