//! What the planner graph's modules held over an episode, and when some of its neurons spiked.
//!
//! While the graph decides, modules are looked at every 2 ms and spikes in every tick; while the robot moves, modules
//! every 40 ms and spikes not at all: nothing is decided then, and neurons go on firing.

use super::{AssemblyWorld, Doing};
use crate::sim::{EventSource, Real, SimView};
use crate::task::planner::{Planner, Shows};

/// Ticks between two looks while the graph decides, and while the robot moves.
const EVERY: [u64; 2] = [2, 40];
/// Neurons of a population whose spikes are kept.
const NEURONS: usize = 12;
/// Spikes after which no more are kept, of the whole episode: 16 bytes each.
const MOST_SPIKES: usize = 1_000_000;

/// The samples of one module, and what they are.
#[derive(Debug, Clone, PartialEq)]
pub struct ModuleSamples {
    /// The module's name.
    pub name: String,
    /// The names beside its numbers.
    pub names: Vec<String>,
    /// What the numbers are.
    pub shows: Shows,
    /// A row of as many numbers as names for each of [`Thoughts::times_s`].
    pub values: Vec<Real>,
}

/// One population of the raster.
struct Heard {
    path: String,
    of: EventSource,
    /// Which of its neurons, evenly spread over it.
    neurons: Vec<usize>,
}

/// A record of one episode's thinking.
#[derive(Default)]
pub struct Thoughts {
    times_s: Vec<f64>,
    modules: Vec<ModuleSamples>,
    heard: Vec<Heard>,
    /// Simulated seconds, and the neuron's row.
    spikes: Vec<(f64, u32)>,
}

impl Thoughts {
    /// An empty record of a planner's modules and, where it has such, its spiking populations.
    pub fn of(planner: &Planner) -> Self {
        let modules = planner.modules().iter().map(|module| ModuleSamples {
            name: module.name.into(),
            names: module.names.clone(),
            shows: module.shows,
            values: Vec::new(),
        });
        let heard = planner.graph().event_sources().map(|(path, of)| {
            let few = NEURONS.min(of.units);
            let neurons = (0..few).map(|i| i * of.units / few).collect();
            Heard { path: path.into(), of, neurons }
        });
        Self { modules: modules.collect(), heard: heard.collect(), ..Self::default() }
    }

    /// Looks at the graph after a tick.
    pub fn watch(&mut self, planner: &Planner, view: &SimView<'_>, world: &AssemblyWorld) {
        let deciding = world.doing() == Doing::Deciding;
        let now = view.time().as_millis_f64() / 1e3;
        if deciding {
            let mut row = 0;
            for heard in &self.heard {
                for neuron in &heard.neurons {
                    if self.spikes.len() < MOST_SPIKES && view.event(heard.of, *neuron) {
                        self.spikes.push((now, row));
                    }
                    row += 1;
                }
            }
        }
        let [often, seldom] = EVERY;
        if !view.tick().is_multiple_of(if deciding { often } else { seldom }) {
            return;
        }
        self.times_s.push(now);
        for (rows, module) in self.modules.iter_mut().zip(planner.modules()) {
            let from = rows.values.len();
            rows.values.resize(from + rows.names.len(), 0.0);
            module.read(view, &mut rows.values[from..]);
        }
    }

    /// When the modules were looked at, in simulated seconds.
    pub fn times_s(&self) -> &[f64] {
        &self.times_s
    }

    /// The modules, in the order of a decision.
    pub fn modules(&self) -> &[ModuleSamples] {
        &self.modules
    }

    /// The populations of the raster by path, with how many of their neurons it has, and of how many.
    pub fn populations(&self) -> impl Iterator<Item = (&str, usize, usize)> {
        self.heard.iter().map(|h| (h.path.as_str(), h.neurons.len(), h.of.units))
    }

    /// Every spike: simulated seconds, and the neuron's row, counted over all populations.
    pub fn spikes(&self) -> &[(f64, u32)] {
        &self.spikes
    }
}
