//! Live runs: step, go back, change and branch a run, with a log of all changes. Windows, scripts and tests share it.

/// The code of the guide is compiled with the tests.
#[cfg(doctest)]
#[doc = include_str!("../../../docs/live.md")]
struct Guide;

mod commands;
mod log;
mod ring;

use std::ops::ControlFlow;
use std::sync::Arc;

use thiserror::Error;

pub use commands::{CommandError, Commands, Refused};
pub use log::{InterventionLog, LogError, Logged};

use self::commands::Inbox;
use self::log::check_room;
use self::ring::Ring;
use super::error::SimError;
use super::run::checkpoint::Checkpoint;
use super::run::config::{RunConfig, Stop, StopReason};
use super::run::intervention::{Intervention, InterventionError};
use super::run::simulator::{SimView, Simulator};
use super::time::SimDuration;

/// The settings of a [`Live`] run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LiveOptions {
    /// Greatest memory of the checkpoints to go back to, in bytes; 0 for a run that never goes back. Default: 256 MB.
    pub memory_bytes: usize,
    /// Ticks between two checkpoints while they are new, at least 1. Those further back are thinned out. Default: 50.
    pub spacing_ticks: u64,
}

impl Default for LiveOptions {
    fn default() -> Self {
        Self { memory_bytes: 256_000_000, spacing_ticks: 50 }
    }
}

/// Why a live run cannot do what was asked. Unless it is a [`SimError`] the run stands where it stood.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum LiveError {
    /// The simulator failed.
    #[error(transparent)]
    Sim(#[from] SimError),
    /// An intervention that is not possible.
    #[error(transparent)]
    Intervention(#[from] InterventionError),
    /// A log that cannot be followed.
    #[error(transparent)]
    Log(#[from] LogError),
    /// A tick before the earliest to which the run can go back.
    #[error("the run can go back to tick {earliest} at the earliest, not to tick {asked}")]
    TooFarBack {
        /// The tick asked for.
        asked: u64,
        /// The earliest tick that can be reached.
        earliest: u64,
    },
}

/// A moment of a live run to return to, or to branch from: its state, and the log that led there.
#[derive(Debug, Clone)]
pub struct Mark {
    checkpoint: Arc<Checkpoint>,
    log: Vec<Logged>,
    /// The run that the mark was taken of.
    run: Arc<()>,
}

impl Mark {
    /// Returns the number of completed ticks.
    pub fn tick(&self) -> u64 {
        self.checkpoint.tick()
    }

    /// Returns the interventions that led there.
    pub fn log(&self) -> &[Logged] {
        &self.log
    }
}

/// How a stretch of a run ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Stretch {
    /// Reason why it ended.
    pub reason: StopReason,
    /// Number of ticks that it lasted.
    pub ticks: u64,
}

/// A run that can be stepped, changed, taken back and branched.
///
/// Every [`Intervention`] is logged with the number of ticks completed before it. After [`seek`](Self::seek) to an earlier
/// tick the interventions of later ticks lie ahead: they are made again at their ticks, with the same bits, until a new
/// intervention takes their place. Going back restores a checkpoint and runs on from it, so it costs up to as many ticks
/// as lie between two checkpoints: [`LiveOptions::spacing_ticks`] if they are new, more further back.
///
/// ```
/// use symbolt::prelude::*;
/// use symbolt::sim::{Intervention, Live, LiveOptions};
///
/// let mut graph = GraphBuilder::new();
/// let one = graph.add("one", Constant::scalar(1.0));
/// let sum = graph.add("sum", Add::scalar());
/// graph.connect(&one, &sum.input, Synapse::lowpass_ms(10));
/// let sim = graph.start(&PopulationPlan::direct(), Seed::new(1))?;
/// let mut live = Live::new(sim, LiveOptions::default())?;
/// live.step(20)?;
/// live.intervene(Intervention::Silence { at: "one".into() })?;
/// live.step(30)?;
/// let silenced = live.sim().value(&sum.output)[0];
///
/// live.back(30)?; // The silence at tick 20 is in force.
/// live.step(30)?;
/// assert_eq!(live.sim().value(&sum.output)[0].to_bits(), silenced.to_bits());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct Live {
    sim: Simulator,
    ring: Ring,
    log: Vec<Logged>,
    /// Number of logged interventions that have been made. The others lie ahead.
    made: usize,
    inbox: Inbox,
    /// Tells marks of this run from those of others.
    run: Arc<()>,
}

impl std::fmt::Debug for Live {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Live(tick {}, {} interventions)", self.sim.tick(), self.log.len())
    }
}

impl Live {
    /// Takes a run at any tick. Interventions of the run up to there are in force, but not in the log.
    ///
    /// # Errors
    /// As [`Simulator::checkpoint`], except that a world may refuse.
    pub fn new(sim: Simulator, options: LiveOptions) -> Result<Self, LiveError> {
        let inbox = Inbox::new();
        let ring = Ring::new(options.memory_bytes, options.spacing_ticks);
        let mut live = Self { sim, ring, log: Vec::new(), made: 0, inbox, run: Arc::new(()) };
        live.ring.save(&live.sim, 0)?;
        Ok(live)
    }

    /// Starts another run of the same graph at a mark. Both then go on independently. Its log begins as that of the
    /// mark. It cannot go back beyond the mark. `config` gives its threads and its world, which must be of the same kind; the seed and the
    /// noise are those of the mark.
    ///
    /// # Errors
    /// As [`Simulator::new`] and [`Simulator::restore`].
    pub fn branch(
        &self,
        mark: &Mark,
        config: RunConfig,
        options: LiveOptions,
    ) -> Result<Self, LiveError> {
        let mut sim = Simulator::new(self.sim.graph().clone(), config)?;
        sim.restore(&mark.checkpoint)?;
        sim.clear_recordings();
        let mut branch = Self::new(sim, options)?;
        branch.made = mark.log.len();
        branch.log.clone_from(&mark.log);
        branch.ring.save_as(branch.made);
        Ok(branch)
    }

    /// Returns the run, with its values and recordings.
    pub fn sim(&self) -> &Simulator {
        &self.sim
    }

    /// Deletes what the probes have recorded, after it was written elsewhere.
    pub fn clear_recordings(&mut self) {
        self.sim.clear_recordings();
    }

    /// Ends the live run and returns the simulator as it stands.
    pub fn into_simulator(self) -> Simulator {
        self.sim
    }

    /// Returns the number of completed ticks.
    pub fn tick(&self) -> u64 {
        self.sim.tick()
    }

    /// Returns the earliest tick to which the run can go back.
    pub fn earliest(&self) -> u64 {
        self.ring.earliest().unwrap_or(self.sim.tick())
    }

    /// Returns the memory that the checkpoints take, in bytes. It never exceeds [`LiveOptions::memory_bytes`].
    pub fn memory_bytes(&self) -> usize {
        self.ring.bytes()
    }

    /// Returns the log of the interventions made so far.
    pub fn log(&self) -> InterventionLog {
        InterventionLog { entries: self.made().to_vec() }
    }

    /// Returns the interventions made so far, without a copy of them.
    pub fn made(&self) -> &[Logged] {
        &self.log[..self.made]
    }

    /// Returns the interventions that lie ahead: they are made at their ticks, until a new one takes their place.
    pub fn ahead(&self) -> &[Logged] {
        &self.log[self.made..]
    }

    /// Returns a sender of interventions for other threads, such as a window. They are made between two ticks, in the order
    /// in which they arrive.
    pub fn commands(&self) -> Commands {
        self.inbox.commands()
    }

    /// Returns the commands refused since the last call, at most the first 1,024.
    pub fn take_refused(&mut self) -> Vec<Refused> {
        self.inbox.take_refused()
    }

    /// Makes an intervention now and logs it. It takes the place of those that lie ahead. A log holds at most 100,000
    /// interventions with 2,000,000 values in all, so that its file can be read again.
    ///
    /// # Errors
    /// [`LiveError::Intervention`], with [`InterventionError::LogFull`] if the log is full. The run and its log have not
    /// changed then.
    pub fn intervene(&mut self, what: Intervention) -> Result<(), LiveError> {
        check_room(self.made(), &what)?;
        self.sim.intervene(&what)?;
        self.log.truncate(self.made);
        self.log.push(Logged { tick: self.sim.tick(), what });
        self.made = self.log.len();
        self.ring.forget_after(self.sim.tick());
        Ok(())
    }

    /// Runs for `ticks` ticks.
    ///
    /// # Errors
    /// As [`run_until`](Self::run_until).
    pub fn step(&mut self, ticks: u64) -> Result<Stretch, LiveError> {
        self.go(self.sim.tick().saturating_add(ticks), |_| ControlFlow::Continue(()), true)
    }

    /// Runs until `stop` returns [`ControlFlow::Break`], but at most for `limit`. `stop` is called after every tick.
    ///
    /// # Errors
    /// [`LiveError::Sim`] as [`Simulator::run_until`]. [`back`](Self::back) and [`seek`](Self::seek) make a failed run usable
    /// again.
    pub fn run_until(
        &mut self,
        limit: SimDuration,
        stop: impl FnMut(SimView<'_>) -> Stop,
    ) -> Result<Stretch, LiveError> {
        let ticks = self.sim.graph().timebase().ticks(limit).map_err(SimError::from)?;
        self.go(self.sim.tick().saturating_add(ticks), stop, true)
    }

    /// Goes back by `ticks` ticks, as [`seek`](Self::seek) does.
    ///
    /// # Errors
    /// As [`seek`](Self::seek).
    pub fn back(&mut self, ticks: u64) -> Result<(), LiveError> {
        let tick = self.sim.tick();
        self.seek(
            tick.checked_sub(ticks)
                .ok_or(LiveError::TooFarBack { asked: 0, earliest: self.earliest() })?,
        )
    }

    /// Goes to the end of a tick, back or forward, with the interventions of the log up to and at that tick. The
    /// recordings are then those of a run that has just reached the tick; a probe that keeps the last samples may hold fewer. Commands of
    /// other threads wait.
    ///
    /// # Errors
    /// [`LiveError::TooFarBack`] with the earliest tick; [`LiveError::Sim`] if the run fails on its way.
    pub fn seek(&mut self, tick: u64) -> Result<(), LiveError> {
        if tick < self.sim.tick() || self.sim.check_whole().is_err() {
            let earliest = self.earliest();
            let too_far = LiveError::TooFarBack { asked: tick, earliest };
            let Some((checkpoint, made)) = self.ring.at_or_before(tick) else {
                if tick >= self.sim.tick() {
                    self.sim.check_whole()?;
                }
                return Err(too_far);
            };
            self.sim.restore(&checkpoint)?;
            self.made = made;
        }
        self.go(tick, |_| ControlFlow::Continue(()), false)?;
        Ok(())
    }

    /// Marks this moment.
    ///
    /// # Errors
    /// As [`Simulator::checkpoint`].
    pub fn mark(&self) -> Result<Mark, LiveError> {
        let checkpoint = Arc::new(self.sim.checkpoint()?);
        Ok(Mark { checkpoint, log: self.made().to_vec(), run: self.run.clone() })
    }

    /// Returns to a mark, of this run or of another of the same graph. The log is then that of the mark, and nothing lies ahead.
    /// Recordings are deleted unless the mark is of the past of this run; they are then cut at its tick.
    ///
    /// # Errors
    /// As [`Simulator::restore`].
    pub fn return_to(&mut self, mark: &Mark) -> Result<(), LiveError> {
        let own = Arc::ptr_eq(&self.run, &mark.run);
        let past = own
            && self.made().starts_with(&mark.log)
            && self.made()[mark.log.len()..].iter().all(|next| next.tick >= mark.tick())
            && self.sim.tick() >= mark.tick();
        self.sim.restore(&mark.checkpoint)?;
        if !past {
            self.sim.clear_recordings();
        }
        match own {
            true => self.ring.keep_path(&self.log, &mark.log, mark.tick()),
            false => {
                self.ring.clear();
                self.run = mark.run.clone();
            }
        }
        self.log.clone_from(&mark.log);
        self.made = self.log.len();
        self.ring.save(&self.sim, self.made)?;
        Ok(())
    }

    /// Takes the interventions of a log as those that lie ahead, in place of others. They are checked at once and made at
    /// their ticks.
    ///
    /// # Errors
    /// [`LogError`] if an intervention is not possible there, or belongs to a tick before this one.
    pub fn follow(&mut self, log: &InterventionLog) -> Result<(), LiveError> {
        log.check_from(self.sim.tick(), self.sim.changes.clone(), self.sim.graph())?;
        self.log.truncate(self.made);
        self.log.extend_from_slice(log.entries());
        self.ring.forget_after(self.sim.tick());
        self.make_due()
    }

    /// Makes the logged interventions of this tick.
    fn make_due(&mut self) -> Result<(), LiveError> {
        while let Some(next) = self.log.get(self.made).filter(|n| n.tick <= self.sim.tick()) {
            let (number, tick) = (self.made + 1, next.tick);
            let impossible = |error| LogError::Impossible { number, tick, error };
            self.sim.intervene(&next.what).map_err(impossible)?;
            self.made += 1;
        }
        Ok(())
    }

    /// Makes the commands of other threads.
    fn obey(&mut self) {
        for what in self.inbox.take() {
            let tick = self.sim.tick();
            if let Err(LiveError::Intervention(error)) = self.intervene(what.clone()) {
                self.inbox.refuse(Refused { tick, what, error });
            }
        }
    }

    /// Runs to the end of tick `target`. The only loop of a live run.
    fn go(
        &mut self,
        target: u64,
        mut stop: impl FnMut(SimView<'_>) -> Stop,
        obeys: bool,
    ) -> Result<Stretch, LiveError> {
        let start = self.sim.tick();
        self.sim.check_whole()?;
        let ended = |sim: &Simulator, reason| Stretch { reason, ticks: sim.tick() - start };
        loop {
            self.ring.save_if_due(&self.sim, self.made)?;
            self.make_due()?;
            if obeys {
                self.obey();
            }
            let tick = self.sim.tick();
            if tick >= target {
                return Ok(ended(&self.sim, StopReason::TimeUp));
            }
            let next = self.log.get(self.made).map_or(target, |next| next.tick.min(target));
            let until = next.min(self.ring.next_due(tick));
            let (inbox, mut stopped) = (&self.inbox, None);
            let outcome = self.sim.run_ticks(until - tick, |view| {
                if let ControlFlow::Break(why) = stop(view) {
                    stopped = Some(why);
                    return ControlFlow::Break(why);
                }
                match obeys && inbox.has_some() {
                    true => ControlFlow::Break(StopReason::TimeUp),
                    false => ControlFlow::Continue(()),
                }
            });
            outcome.inspect_err(|error| self.sim.tell(error))?;
            if let Some(reason) = stopped {
                self.ring.save_if_due(&self.sim, self.made)?;
                self.make_due()?;
                return Ok(ended(&self.sim, reason));
            }
        }
    }
}
