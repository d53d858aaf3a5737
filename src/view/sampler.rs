//! What a frame shows: plots with the samples since the last frame, the activity of all nodes, and spikes.
//!
//! A tick costs one comparison for each plot, and no allocation. A frame has the layout that docs/live.md states.

use super::command::Plotted;
use super::hub::Frame;
use crate::sim::{
    EventSource, Graph, GraphOutline, NodeOutline, OutputRef, Real, SimView, Simulator, cut,
    nearest_first,
};
use crate::spa::{OutputVocabulary, dot};

/// Greatest number of plots, of one window and of all.
const MOST_PLOTS: [usize; 2] = [16, 64];
/// Greatest number of samples of a plot in a frame, and of spikes.
const MOST_SAMPLES: [usize; 2] = [256, 4_096];
/// Number of samples of a plot that a frame should have.
const SAMPLES: u64 = 64;
/// Greatest number of neurons that a frame asks for spikes, and of values of an output that count for activity.
const MOST_ASKED: [usize; 2] = [4_096, 64];
/// Greatest number of characters of a name in a message.
const LONGEST: usize = 300;
/// Greatest number of activities in a frame.
const MOST_NODES: usize = 4_096;

/// Writes named numbers after a tick.
pub(super) type Read = dyn Fn(&SimView<'_>, &mut [Real]) + Send;

/// Named numbers that the program offers for plots.
pub(super) struct Reading {
    pub name: String,
    pub names: Vec<String>,
    pub read: Box<Read>,
}

/// What a plot reads.
enum Of {
    Values { of: OutputRef, from: usize },
    Similar { of: OutputRef, to: Vec<Vec<Real>> },
    Reading(usize),
    Spikes { of: EventSource, from: usize },
}

struct Plot {
    id: u32,
    window: u64,
    of: Of,
    /// Number of values of a sample, or of neurons.
    width: usize,
    ticks: Vec<u64>,
    /// Samples row by row; for spikes the neurons.
    values: Vec<Real>,
}

impl Plot {
    fn sample(&mut self, view: &SimView<'_>, readings: &[Reading]) {
        if matches!(self.of, Of::Spikes { .. }) || self.ticks.len() >= MOST_SAMPLES[0] {
            return;
        }
        let from = self.values.len();
        self.values.resize(from + self.width, 0.0);
        let out = &mut self.values[from..];
        match &self.of {
            Of::Values { of, from } => {
                out.copy_from_slice(&view.value_of(*of)[*from..][..self.width])
            }
            Of::Similar { of, to } => {
                let value = view.value_of(*of);
                out.iter_mut().zip(to).for_each(|(out, to)| *out = dot(value, to));
            }
            // The program may have taken it back.
            Of::Reading(index) => {
                if let Some(reading) = readings.get(*index) {
                    (reading.read)(view, out);
                }
            }
            // They come tick by tick.
            Of::Spikes { .. } => {}
        }
        self.ticks.push(view.tick());
    }
}

/// The numbers of a frame that the run does not hold.
#[derive(Default)]
pub(super) struct Standing {
    /// 0 stopped, 1 running, 2 over.
    pub mode: u8,
    /// Number of times that the run has gone back.
    pub epoch: u32,
    pub earliest: u64,
    /// Simulated seconds a second.
    pub speed: f32,
    pub logged: u32,
    pub ahead: u32,
    pub events: u32,
}

/// See the module.
pub(super) struct Sampler {
    plots: Vec<Plot>,
    next: u32,
    /// Samples are taken at ticks that this divides: a power of two.
    stride: u64,
    /// For each node its outputs.
    nodes: Vec<Vec<OutputRef>>,
    /// Layers with the values that a spike changes.
    layers: Vec<(EventSource, u64)>,
}

impl Sampler {
    pub fn new(graph: &Graph, outline: &GraphOutline) -> Self {
        let outputs = |node: &NodeOutline| {
            node.outputs.iter().filter_map(|output| graph.output(&output.name).ok()).collect()
        };
        let nodes = outline.nodes.iter().take(MOST_NODES).map(outputs).collect();
        let layers = graph.event_sources().map(|(path, of)| {
            let node = outline.nodes.iter().position(|node| node.path == path);
            let leaving = outline.edges.iter().filter(|edge| Some(edge.from) == node);
            let widths = leaving.map(|e| outline.nodes[e.from].outputs[e.output].width as u64);
            (of, widths.sum())
        });
        let layers = layers.collect();
        Self { plots: Vec::new(), next: 0, stride: 1, nodes, layers }
    }

    /// Adds a plot. Returns its number and the names of its values.
    pub fn plot(
        &mut self,
        window: u64,
        what: &Plotted,
        graph: &Graph,
        readings: &[Reading],
    ) -> Result<(u32, Vec<String>), String> {
        let [own, all] = MOST_PLOTS;
        if self.plots.len() >= all
            || self.plots.iter().filter(|plot| plot.window == window).count() >= own
        {
            return Err(format!("there can be {own} plots in a window, and {all} in all"));
        }
        let within = |name: &str, from: usize, count: usize, width: usize| match from
            .checked_add(count)
            .is_some_and(|end| end <= width)
        {
            true => Ok(()),
            false => Err(format!(
                "{name} has {width}; expected from + count, {from} + {count}, to be at most that"
            )),
        };
        // Its error has the most similar names.
        let output = |name: &str| {
            graph.output_at(name).map_err(|error| error.to_string())?;
            graph.output(name).map_err(|error| error.to_string())
        };
        let (of, names) = match what {
            Plotted::Values { output: name, from, count } => {
                let of = output(name)?;
                within(name, *from, *count, width(graph, name))?;
                let names = (*from..from + count).map(|index| index.to_string()).collect();
                (Of::Values { of, from: *from }, names)
            }
            Plotted::Similar { output: name, to } => {
                let of = output(name)?;
                let rows: Result<Vec<_>, _> =
                    to.iter().map(|text| pointer(graph, name, text)).collect();
                (Of::Similar { of, to: rows? }, to.clone())
            }
            Plotted::Reading { name } => {
                let index = readings.iter().position(|reading| reading.name == *name);
                let index = index.ok_or_else(|| {
                    let all = readings.iter().map(|reading| &*reading.name);
                    format!(
                        "there is no reading `{}`; there are: {}",
                        cut(name, LONGEST),
                        nearest_first(name, all)
                    )
                })?;
                (Of::Reading(index), readings[index].names.clone())
            }
            Plotted::Spikes { layer, from, count } => {
                let of = graph.event_sources().find(|(path, _)| path == layer);
                let (_, of) = of.ok_or_else(|| {
                    let all = graph.event_sources().map(|(path, _)| path);
                    let all = nearest_first(layer, all);
                    format!(
                        "the graph has no spiking layer `{}`; it has: {all}",
                        cut(layer, LONGEST)
                    )
                })?;
                within(layer, *from, *count, of.units)?;
                let names = (*from..from + count).map(|index| index.to_string()).collect();
                (Of::Spikes { of, from: *from }, names)
            }
        };
        let (width, rows) = match of {
            Of::Spikes { .. } => (1, MOST_SAMPLES[1]),
            _ => (names.len(), MOST_SAMPLES[0]),
        };
        self.next = self.next.wrapping_add(1);
        self.plots.push(Plot {
            id: self.next,
            window,
            width: names.len(),
            of,
            ticks: Vec::with_capacity(rows),
            values: Vec::with_capacity(rows * width),
        });
        Ok((self.next, names))
    }

    /// Removes a plot of a window. Returns whether there was one.
    pub fn unplot(&mut self, window: u64, id: u32) -> bool {
        let before = self.plots.len();
        self.plots.retain(|plot| plot.id != id || plot.window != window);
        self.plots.len() < before
    }

    /// Removes the plots of windows that are gone.
    pub fn keep(&mut self, open: &[u64]) {
        self.plots.retain(|plot| open.contains(&plot.window));
    }

    /// Forgets the samples that no frame has shown yet: the run has gone back.
    pub fn forget(&mut self) {
        self.plots.iter_mut().for_each(|plot| {
            plot.ticks.clear();
            plot.values.clear();
        });
    }

    /// Sets how far apart samples are if a frame comes after this number of ticks.
    pub fn space(&mut self, ticks: u64) {
        self.stride = (ticks / SAMPLES).max(1).next_power_of_two().min(1 << 40);
    }

    /// Takes the samples of a tick.
    pub fn tick(&mut self, view: &SimView<'_>, readings: &[Reading]) {
        let due = view.tick() & (self.stride - 1) == 0;
        for plot in &mut self.plots {
            if let Of::Spikes { of, from } = plot.of {
                for unit in from..from + plot.width {
                    if plot.ticks.len() < MOST_SAMPLES[1] && view.event(of, unit) {
                        plot.ticks.push(view.tick());
                        plot.values.push(unit as Real);
                    }
                }
            } else if due {
                plot.sample(view, readings);
            }
        }
    }

    /// Returns the frame of this moment, and forgets the samples that it shows.
    pub fn frame(
        &mut self,
        sim: &Simulator,
        standing: &Standing,
        readings: &[Reading],
        poses: &[Real],
    ) -> Frame {
        let view = SimView::of(sim);
        // The present values are always shown.
        for plot in &mut self.plots {
            if plot.ticks.last() != Some(&view.tick()) {
                plot.sample(&view, readings);
            }
        }
        let mut out = Vec::with_capacity(4_096);
        let [spikes, arrivals] = self.spikes(sim);
        let count = |count: usize| u16::try_from(count).unwrap_or(u16::MAX);
        out.extend([1, standing.mode]);
        // Each window is sent the number of its own plots.
        out.extend([0, 0]);
        out.extend(standing.epoch.to_le_bytes());
        let tick = view.tick();
        for number in [tick as f64, sim.time_s(), standing.earliest as f64] {
            out.extend(number.to_le_bytes());
        }
        for number in [standing.speed, spikes, arrivals] {
            out.extend(number.to_le_bytes());
        }
        for number in [standing.logged, standing.ahead, standing.events] {
            out.extend(number.to_le_bytes());
        }
        out.extend(count(self.nodes.len()).to_le_bytes());
        let poses = &poses[..poses.len().min(usize::from(u16::MAX))];
        out.extend(count(poses.len()).to_le_bytes());
        for outputs in &self.nodes {
            out.extend(activity(sim, outputs).to_le_bytes());
        }
        poses.iter().for_each(|value| out.extend(value.to_le_bytes()));
        let (head, mut ends) = (out.len(), Vec::with_capacity(self.plots.len()));
        for plot in &mut self.plots {
            let width = if matches!(plot.of, Of::Spikes { .. }) { 0 } else { plot.width };
            for number in [plot.id, plot.ticks.len() as u32, width as u32] {
                out.extend(number.to_le_bytes());
            }
            plot.ticks.iter().for_each(|tick| out.extend((*tick as f64).to_le_bytes()));
            plot.values.iter().for_each(|value| out.extend(value.to_le_bytes()));
            plot.ticks.clear();
            plot.values.clear();
            ends.push((plot.window, out.len()));
        }
        Frame::new(out, head, ends)
    }

    /// Returns the spikes and the synaptic events a second, estimated from the last tick of some neurons. Not a number if
    /// there are no neurons.
    fn spikes(&self, sim: &Simulator) -> [f32; 2] {
        let all: usize = self.layers.iter().map(|(of, _)| of.units).sum();
        if all == 0 {
            return [f32::NAN; 2];
        }
        let every = all.div_ceil(MOST_ASKED[0]).max(1);
        let (mut spikes, mut arrivals) = (0.0, 0.0);
        for (of, reach) in &self.layers {
            let fired = (0..of.units).step_by(every).filter(|unit| sim.event(*of, *unit)).count();
            spikes += (fired * every) as f64;
            arrivals += (fired * every) as f64 * *reach as f64;
        }
        let per_s = 1.0 / sim.graph().timebase().dt_s();
        [(spikes * per_s) as f32, (arrivals * per_s) as f32]
    }
}

/// Returns the root of the mean square of a node's values.
fn activity(sim: &Simulator, outputs: &[OutputRef]) -> f32 {
    let (mut sum, mut count) = (0.0, 0);
    for of in outputs {
        for value in sim.value_of(*of).iter().take(MOST_ASKED[1]) {
            sum += value * value;
            count += 1;
        }
    }
    if count == 0 { 0.0 } else { (sum / count as f32).sqrt() }
}

fn width(graph: &Graph, output: &str) -> usize {
    let found = graph.find_output(output);
    found.map_or(0, |(node, output)| graph.nodes[node].ports.outputs[output].width())
}

/// Returns the value of an expression over the vocabulary of an output. The error is a sentence.
pub(super) fn pointer(graph: &Graph, output: &str, text: &str) -> Result<Vec<Real>, String> {
    let name = cut(output, LONGEST);
    let vocabulary = OutputVocabulary::of(graph, output)
        .ok_or_else(|| format!("`{name}` carries no pointers of a vocabulary"))?;
    vocabulary.parse(text).map_err(|error| error.to_string())
}
