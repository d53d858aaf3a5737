//! Interventions from other threads.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};

use thiserror::Error;

use crate::sim::run::intervention::{Intervention, InterventionError};

/// Greatest number of commands that wait, and of refusals that are kept.
const MOST: usize = 1_024;
/// Greatest number of commands that are made between two ticks.
const MOST_A_TICK: usize = 64;

/// Sends interventions to a [`Live`](super::Live) run, from any thread.
#[derive(Debug, Clone)]
pub struct Commands {
    sender: SyncSender<Intervention>,
    waiting: Arc<AtomicUsize>,
}

/// Why a command was not taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum CommandError {
    /// Too many commands wait for the next tick.
    #[error("{MOST} commands wait already; send again when the run has gone on")]
    Full,
    /// The run has ended.
    #[error("the run has ended")]
    Ended,
}

impl Commands {
    /// Sends an intervention, to be made before the next tick. Never waits.
    ///
    /// # Errors
    /// A [`CommandError`]. Whether the intervention is possible is found when it is made:
    /// [`Live::take_refused`](super::Live::take_refused).
    pub fn send(&self, what: Intervention) -> Result<(), CommandError> {
        // Counted first: the run looks at the count, then takes as many as there are.
        self.waiting.fetch_add(1, Ordering::AcqRel);
        self.sender.try_send(what).map_err(|error| {
            self.waiting.fetch_sub(1, Ordering::AcqRel);
            match error {
                TrySendError::Full(_) => CommandError::Full,
                TrySendError::Disconnected(_) => CommandError::Ended,
            }
        })
    }
}

/// A command that was not possible.
#[derive(Debug, Clone, PartialEq)]
pub struct Refused {
    /// Number of ticks completed when it was due.
    pub tick: u64,
    /// The command.
    pub what: Intervention,
    /// Why it is not possible.
    pub error: InterventionError,
}

/// The end at which commands arrive.
pub(super) struct Inbox {
    commands: Commands,
    receiver: Receiver<Intervention>,
    refused: Vec<Refused>,
}

impl Inbox {
    pub fn new() -> Self {
        let (sender, receiver) = sync_channel(MOST);
        let commands = Commands { sender, waiting: Arc::default() };
        Self { commands, receiver, refused: Vec::new() }
    }

    pub fn commands(&self) -> Commands {
        self.commands.clone()
    }

    /// Returns whether commands wait. Costs a load; called after every tick.
    pub fn has_some(&self) -> bool {
        self.commands.waiting.load(Ordering::Acquire) > 0
    }

    /// Takes the commands that wait, but no more than a tick has time for: a sender may never stop.
    pub fn take(&mut self) -> Vec<Intervention> {
        let all: Vec<_> = self.receiver.try_iter().take(MOST_A_TICK).collect();
        self.commands.waiting.fetch_sub(all.len(), Ordering::AcqRel);
        all
    }

    pub fn refuse(&mut self, refused: Refused) {
        if self.refused.len() < MOST {
            self.refused.push(refused);
        }
    }

    pub fn take_refused(&mut self) -> Vec<Refused> {
        std::mem::take(&mut self.refused)
    }
}
