//! The kitchen as a world: the motor, the sensor and what holds.

use super::Part;
use super::kitchen::Kitchen;
use super::symbols::Symbols;
use crate::plan::goal_sets::StripsWorld;
use crate::sim::{Real, Seed, SimDuration, World, WorldError, WorldSave};
use crate::spa::{VocabError, cosine_of_slices, dot};

/// Cosine from which the sensor recognises a pointer.
const RECOGNISED: Real = 0.3;
/// What the sensor shows while it is active.
const SHOWN: Real = 5.0;
/// Time for which the sensor shows that an action is ready, in milliseconds.
const SHOWN_MS: u64 = 50;
/// Time from then on after which it looks again, in milliseconds.
const DEAF_MS: u64 = 350;

/// An action that the sensor knows.
#[derive(Clone)]
struct Known {
    pointer: Vec<Real>,
    held_until: Vec<usize>,
}

/// The world of the stack planner.
///
/// Its commands are three pointers: what the motor is to do, the top of the push memory, and the goal. It shows two numbers:
/// whether the pushed action is ready, and whether the goal holds, as 0 or 5.
///
/// The motor does the action whose name is most similar to the first pointer, if no other name is more similar and the
/// similarity is at least 0.4 and has stayed the greatest for 5 ms. It is then locked for 100 ms.
#[derive(Clone)]
pub(super) struct StackWorld {
    inner: StripsWorld,
    actions: Vec<Known>,
    /// Pointers of all other names, which the motor cannot do.
    others: Vec<Vec<Real>>,
    goal: Vec<Real>,
    /// Part that is left out.
    without: Option<Part>,
    time: u64,
    /// Time at which the sensor last found an action ready.
    found: Option<u64>,
    commands: Vec<Real>,
    goal_seen: bool,
}

impl StackWorld {
    /// Makes the world of a kitchen. Without [`Part::Sensor`] every action that is recognised counts as ready.
    pub fn new(
        kitchen: &Kitchen,
        symbols: &Symbols,
        without: Option<Part>,
    ) -> Result<Self, VocabError> {
        let names = kitchen.names();
        let others = symbols.acts.names().iter().filter(|name| !names.contains(&name.as_str()));
        let others = others.map(|name| Ok(symbols.acts.get(name)?.to_vec()));
        let known = kitchen.actions.iter().map(|action| {
            let pointer = symbols.acts.get(&action.name)?.to_vec();
            Ok(Known { pointer, held_until: action.held_until.clone() })
        });
        Ok(Self {
            inner: kitchen.world(),
            actions: known.collect::<Result<_, VocabError>>()?,
            others: others.collect::<Result<_, VocabError>>()?,
            goal: symbols.base.get(kitchen.goal())?.to_vec(),
            without,
            time: 0,
            found: None,
            commands: vec![0.0; names.len()],
            goal_seen: false,
        })
    }

    /// The kitchen, with the actions that were begun.
    pub fn kitchen(&self) -> &StripsWorld {
        &self.inner
    }

    /// Returns whether some action that the sensor recognises in the pointer is ready.
    fn ready(&self, pushed: &[Real]) -> bool {
        let holds = self.inner.state();
        self.actions.iter().any(|known| {
            cosine_of_slices(&known.pointer, pushed) > RECOGNISED
                && (self.without == Some(Part::Sensor)
                    || known.held_until.iter().all(|fluent| holds.contains(fluent)))
        })
    }
}

impl World for StackWorld {
    fn period(&self) -> SimDuration {
        self.inner.period()
    }

    fn sense_width(&self) -> usize {
        2
    }

    fn command_width(&self) -> usize {
        3 * self.goal.len()
    }

    fn sense(&self, out: &mut [Real]) {
        let ready = self.found.is_some_and(|found| self.time < found + SHOWN_MS);
        let done = self.goal_seen && self.inner.reached();
        let shown = |active| if active { SHOWN } else { 0.0 };
        out.copy_from_slice(&[shown(ready), shown(done)]);
    }

    fn advance(&mut self, command: &[Real]) -> Result<(), WorldError> {
        let mut parts = command.chunks_exact(self.goal.len());
        let mut next = || parts.next().unwrap_or(&[]);
        let (motor, pushed, goal) = (next(), next(), next());
        let rival = self.others.iter().map(|other| dot(other, motor)).fold(Real::MIN, Real::max);
        for (command, known) in self.commands.iter_mut().zip(&self.actions) {
            let similarity = dot(&known.pointer, motor);
            *command = if similarity > rival { similarity } else { 0.0 };
        }
        self.inner.advance(&self.commands)?;
        self.time += 1;
        if self.found.is_none_or(|found| self.time > found + DEAF_MS) && self.ready(pushed) {
            self.found = Some(self.time);
        }
        self.goal_seen = cosine_of_slices(&self.goal, goal) > RECOGNISED;
        Ok(())
    }

    fn reset(&mut self, seed: Seed) -> Result<(), WorldError> {
        (self.time, self.found, self.goal_seen) = (0, None, false);
        self.inner.reset(seed)
    }

    fn save(&self) -> Result<WorldSave, WorldError> {
        let moment = (self.inner.save()?.0, self.time, self.found, self.goal_seen);
        serde_json::to_vec(&moment).map(WorldSave).map_err(|e| WorldError::new(e.to_string()))
    }

    fn restore(&mut self, saved: &WorldSave) -> Result<(), WorldError> {
        let (inner, time, found, goal_seen) = serde_json::from_slice(&saved.0)
            .map_err(|e| WorldError::new(format!("the save does not come from this world: {e}")))?;
        self.inner.restore(&WorldSave(inner))?;
        (self.time, self.found, self.goal_seen) = (time, found, goal_seen);
        Ok(())
    }
}
