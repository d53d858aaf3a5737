//! The world of a planner that is asked without a scene: it senses what it is told, and does nothing.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use super::decider::{Decider, PlannerInput};
use crate::sim::{Real, Seed, SimDuration, World, WorldError, WorldSave};

/// A board with what a planner senses. Clones share it, so one can be written on while a simulator reads the other.
#[derive(Clone)]
pub(super) struct Board {
    period: SimDuration,
    senses: Arc<Mutex<Vec<Real>>>,
    commands: usize,
}

impl Board {
    /// Makes the empty board of a planner.
    pub fn new(planner: &dyn Decider) -> Self {
        let senses = Arc::new(Mutex::new(vec![0.0; planner.sense_width()]));
        let (period, commands) = (planner.graph().timebase().tick(), planner.command_width());
        Self { period, senses, commands }
    }

    /// Writes what the planner senses from the next tick on.
    pub fn write(&self, planner: &dyn Decider, input: &PlannerInput<'_>) {
        planner.sense(input, &mut self.senses());
    }

    fn senses(&self) -> MutexGuard<'_, Vec<Real>> {
        self.senses.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl World for Board {
    fn period(&self) -> SimDuration {
        self.period
    }

    fn sense_width(&self) -> usize {
        self.senses().len()
    }

    fn command_width(&self) -> usize {
        self.commands
    }

    fn sense(&self, out: &mut [Real]) {
        out.copy_from_slice(&self.senses());
    }

    fn advance(&mut self, _command: &[Real]) -> Result<(), WorldError> {
        Ok(())
    }

    fn reset(&mut self, _seed: Seed) -> Result<(), WorldError> {
        Ok(())
    }

    fn save(&self) -> Result<WorldSave, WorldError> {
        Ok(WorldSave(self.senses().iter().flat_map(|sense| sense.to_le_bytes()).collect()))
    }

    fn restore(&mut self, saved: &WorldSave) -> Result<(), WorldError> {
        if *saved == self.save()? {
            return Ok(());
        }
        let reason = "the checkpoint belongs to another world state or goal; expected those of this simulator";
        Err(WorldError::new(reason))
    }
}
