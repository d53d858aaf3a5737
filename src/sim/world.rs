//! The world beside the graph: stepped in the same simulated time, sensed and commanded by it.

use std::any::Any;

use serde::{Deserialize, Serialize};

use super::error::WorldError;
use super::fingerprint::Fingerprint;
use super::kind::Kind;
use super::node::{Node, Real};
use super::port::{AnyInput, AnyOutput, InputSpec, OutputSpec, PortDecl};
use super::seed::Seed;
use super::time::SimDuration;

/// A world's own account of its state, opaque to the engine.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct WorldSave(pub Vec<u8>);

/// Something outside the graph that lives in the same simulated time: a physics scene, a fake.
///
/// Every [`period`](World::period) the engine calls [`advance`](World::advance) with the values on
/// the link's inputs and then [`sense`](World::sense), whose values stand on the link's outputs
/// until the next period. Code that knows the type of its world can downcast it through [`Any`].
pub trait World: Send + Any {
    /// How often the world steps; a whole number of ticks.
    fn period(&self) -> SimDuration;

    /// How many numbers [`sense`](World::sense) writes.
    fn sense_width(&self) -> usize;

    /// How many numbers [`advance`](World::advance) takes.
    fn command_width(&self) -> usize;

    /// Writes what can be seen now.
    fn sense(&self, out: &mut [Real]);

    /// Advances by one period with `command` applied.
    ///
    /// # Errors
    /// A [`WorldError`] ends the run.
    fn advance(&mut self, command: &[Real]) -> Result<(), WorldError>;

    /// Starts afresh.
    ///
    /// # Errors
    /// A [`WorldError`] if the world cannot be set up.
    fn reset(&mut self, seed: Seed) -> Result<(), WorldError>;

    /// Everything needed to continue from here.
    ///
    /// # Errors
    /// A [`WorldError`] if the world cannot be saved as it is.
    fn save(&self) -> Result<WorldSave, WorldError>;

    /// Goes back to a saved moment.
    ///
    /// # Errors
    /// A [`WorldError`] if the save is not one of this world's.
    fn restore(&mut self, saved: &WorldSave) -> Result<(), WorldError>;
}

/// The node by which a graph sees and commands its world.
///
/// The world's sense values are its outputs, in the order in which they were added; the world's
/// command is its inputs, likewise.
///
/// ```
/// use symbolt::sim::{GraphBuilder, InputSpec, OutputSpec, Scalar, Vector, WorldLink};
/// let mut graph = GraphBuilder::new();
/// let world = graph.world(
///     "world",
///     WorldLink::new()
///         .sense("present", OutputSpec::vector(5))
///         .command("go", InputSpec::scalar()),
/// );
/// let present = world.output::<Vector>("present");
/// let go = world.input::<Scalar>("go");
/// ```
#[derive(Debug, Default)]
pub struct WorldLink {
    senses: Vec<(String, AnyOutput)>,
    commands: Vec<(String, AnyInput)>,
}

impl WorldLink {
    /// A link without ports.
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds values that the world shows.
    pub fn sense<K: Kind>(mut self, name: &str, spec: OutputSpec<K>) -> Self {
        self.senses.push((name.into(), spec.registered().into()));
        self
    }

    /// Adds values that the world is told. They may stay unfed and are zero then.
    pub fn command<K: Kind>(mut self, name: &str, spec: InputSpec<K>) -> Self {
        self.commands.push((name.into(), spec.at_advance().optional().into()));
        self
    }
}

impl Node for WorldLink {
    fn declare(&self, ports: &mut PortDecl) {
        for (name, spec) in &self.senses {
            ports.output(name, spec.clone());
        }
        for (name, spec) in &self.commands {
            ports.input(name, spec.clone());
        }
    }

    fn fingerprint(&self, _hash: &mut Fingerprint) {}
}

/// A world for tests and examples: it shows a fixed script, one entry a period (the last one
/// stays), and remembers every command it was given.
#[derive(Debug, Clone)]
pub struct ScriptedWorld {
    period: SimDuration,
    senses: Vec<Vec<Real>>,
    commands: Vec<Vec<Real>>,
    command_width: usize,
    step: usize,
    fail_at: Option<usize>,
}

impl ScriptedWorld {
    /// A world that shows `senses[0]` first and the next entry after each `period`.
    ///
    /// Entries shorter than the first are padded with zeros; an empty script shows nothing.
    pub fn new(period: SimDuration, senses: Vec<Vec<Real>>, command_width: usize) -> Self {
        Self { period, senses, commands: Vec::new(), command_width, step: 0, fail_at: None }
    }

    /// Makes the world fail when it is advanced for the `step`-th time (counted from 0).
    pub fn failing_at(mut self, step: usize) -> Self {
        self.fail_at = Some(step);
        self
    }

    /// The commands given so far.
    pub fn commands(&self) -> &[Vec<Real>] {
        &self.commands
    }
}

impl World for ScriptedWorld {
    fn period(&self) -> SimDuration {
        self.period
    }

    fn sense_width(&self) -> usize {
        self.senses.first().map_or(0, Vec::len)
    }

    fn command_width(&self) -> usize {
        self.command_width
    }

    fn sense(&self, out: &mut [Real]) {
        out.fill(0.0);
        if let Some(now) = self.senses.get(self.step).or(self.senses.last()) {
            for (o, v) in out.iter_mut().zip(now) {
                *o = *v;
            }
        }
    }

    fn advance(&mut self, command: &[Real]) -> Result<(), WorldError> {
        if self.fail_at == Some(self.step) {
            return Err(WorldError::new(format!("scripted failure at step {}", self.step)));
        }
        self.commands.push(command.to_vec());
        self.step += 1;
        Ok(())
    }

    fn reset(&mut self, _seed: Seed) -> Result<(), WorldError> {
        self.step = 0;
        self.commands.clear();
        Ok(())
    }

    fn save(&self) -> Result<WorldSave, WorldError> {
        let mut bytes = (self.step as u64).to_le_bytes().to_vec();
        for value in self.commands.iter().flatten() {
            bytes.extend_from_slice(&value.to_le_bytes());
        }
        Ok(WorldSave(bytes))
    }

    fn restore(&mut self, saved: &WorldSave) -> Result<(), WorldError> {
        let broken = || WorldError::new("not a save of this scripted world");
        let (step, rest) = saved.0.split_first_chunk::<8>().ok_or_else(broken)?;
        let step = u64::from_le_bytes(*step) as usize;
        let values: Vec<Real> =
            rest.chunks_exact(4).map(|b| Real::from_le_bytes([b[0], b[1], b[2], b[3]])).collect();
        if values.len() != step * self.command_width || rest.len() % 4 != 0 {
            return Err(broken());
        }
        self.step = step;
        self.commands = if self.command_width == 0 {
            vec![Vec::new(); step]
        } else {
            values.chunks_exact(self.command_width).map(<[Real]>::to_vec).collect()
        };
        Ok(())
    }
}
