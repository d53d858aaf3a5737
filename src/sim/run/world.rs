//! The world: a system outside the graph that runs in the same simulated time.

use std::any::Any;
use std::sync::Arc;

use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::sim::describe::builder::{GraphBuilder, Scope};
use crate::sim::describe::draft::Body;
use crate::sim::describe::fingerprint::Fingerprint;
use crate::sim::describe::handle::NodePorts;
use crate::sim::describe::kind::Kind;
use crate::sim::describe::node::Node;
use crate::sim::describe::port::{AnyInput, AnyOutput, InputSpec, OutputSpec, PortDecl};
use crate::sim::error::WorldError;
use crate::sim::real::Real;
use crate::sim::seed::Seed;
use crate::sim::time::SimDuration;

/// The saved state of a world. Only the world can interpret it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct WorldSave(pub Vec<u8>);

/// A system outside the graph that runs in the same simulated time, such as a physics scene.
///
/// A graph connects to its world through a [`WorldLink`]. At the end of each [`period`](World::period) the engine
/// calls [`advance`](World::advance) with the values of the link's inputs, and then [`sense`](World::sense). The
/// link's outputs hold the sensed values until the end of the next period. The first values are sensed at the start of
/// a run. Code that knows the type of a world can downcast it through [`Any`].
pub trait World: Send + Any {
    /// Returns the simulated time between two steps of the world, a whole number of ticks.
    fn period(&self) -> SimDuration;

    /// Returns the number of values that [`sense`](World::sense) writes.
    fn sense_width(&self) -> usize;

    /// Returns the number of values that [`advance`](World::advance) takes.
    fn command_width(&self) -> usize;

    /// Writes the values that the world shows at this moment to `out`, which has [`sense_width`](World::sense_width)
    /// numbers.
    fn sense(&self, out: &mut [Real]);

    /// Applies `command`, which has [`command_width`](World::command_width) numbers, and advances by one period.
    ///
    /// # Errors
    /// A [`WorldError`] ends the run.
    fn advance(&mut self, command: &[Real]) -> Result<(), WorldError>;

    /// Returns to the start. `seed` decides everything random in the world.
    ///
    /// # Errors
    /// A [`WorldError`] if the world cannot be set up.
    fn reset(&mut self, seed: Seed) -> Result<(), WorldError>;

    /// Lets somebody outside the run change the world between two ticks. What can be asked for is the world's own affair; the
    /// same wish at the same tick must have the same effect.
    ///
    /// # Errors
    /// A [`WorldError`] if the wish is refused; the world has not changed then. A world that does not override this method refuses all.
    fn intervene(&mut self, _wish: &Value) -> Result<(), WorldError> {
        Err(WorldError::new("this world cannot be changed from outside"))
    }

    /// Saves everything needed to continue from this moment.
    ///
    /// # Errors
    /// A [`WorldError`] if the world cannot be saved at this moment.
    fn save(&self) -> Result<WorldSave, WorldError>;

    /// Returns to a saved moment.
    ///
    /// # Errors
    /// A [`WorldError`] if `saved` does not come from a world of this type. The world then stands as before.
    fn restore(&mut self, saved: &WorldSave) -> Result<(), WorldError>;
}

/// The node through which a graph senses and commands its world.
///
/// Its outputs are the world's senses and its inputs are the world's commands. The values of the world are split among
/// these ports in the order in which the ports were added.
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
    /// Creates a link without ports.
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds an output for values that the world shows.
    pub fn sense<K: Kind>(mut self, name: &str, spec: OutputSpec<K>) -> Self {
        self.senses.push((name.into(), spec.registered().into()));
        self
    }

    /// Adds an input for values that the world receives. If it stays unconnected, the world receives zeros.
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

impl GraphBuilder {
    /// Adds the link to the world under `name`. A graph has at most one link.
    #[track_caller]
    pub fn world(&mut self, name: &str, link: WorldLink) -> NodePorts {
        self.root().world(name, link)
    }
}

impl Scope<'_> {
    /// Adds the link to the world. A graph has at most one link.
    #[track_caller]
    pub fn world(&mut self, name: &str, link: WorldLink) -> NodePorts {
        let mut ports = PortDecl::default();
        link.declare(&mut ports);
        self.push(name, Body::World(Arc::new(link)), ports)
    }
}

/// A world for tests and examples. It shows a fixed script, one entry per period, and records every command.
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
    /// Creates a world that shows `senses[0]` first and the next entry after each `period`. At the end of the script
    /// it keeps showing the last entry.
    ///
    /// Entries shorter than the first are padded with zeros. A world with an empty script has no senses.
    pub fn new(period: SimDuration, senses: Vec<Vec<Real>>, command_width: usize) -> Self {
        Self { period, senses, commands: Vec::new(), command_width, step: 0, fail_at: None }
    }

    /// Makes the world fail at step number `step`, counted from 0.
    pub fn failing_at(mut self, step: usize) -> Self {
        self.fail_at = Some(step);
        self
    }

    /// Returns all commands received so far, one per period.
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
        let broken = || WorldError::new("the save does not come from this scripted world");
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
