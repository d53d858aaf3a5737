//! A page that shows a run of any graph: its modules with their connections, plots of what was recorded, and spikes.

use serde_json::{Value, json};

use super::TimeSeries;
use super::shell::{STYLE, base64, filled};
use crate::sim::{Real, Samples, Simulator, Spikes, Vector};

const PAGE: &str = include_str!("../../assets/graph/page.html");
/// The page's code. In this order the files form one JavaScript module. It shares the time axis with the page of a run of
/// a task.
const CODE: [&str; 13] = [
    include_str!("../../assets/report/data.js"),
    include_str!("../../assets/report/theme.js"),
    include_str!("../../assets/report/tables.js"),
    include_str!("../../assets/report/strips.js"),
    include_str!("../../assets/graph/names.js"),
    include_str!("../../assets/report/raster.js"),
    include_str!("../../assets/report/timeline.js"),
    include_str!("../../assets/report/export.js"),
    include_str!("../../assets/report/panels.js"),
    include_str!("../../assets/graph/layout.js"),
    include_str!("../../assets/graph/drawing.js"),
    include_str!("../../assets/graph/plots.js"),
    include_str!("../../assets/graph/main.js"),
];

/// Greatest number of components of an output that get a curve each.
const CURVES: usize = 12;
/// Greatest number of numbers of all plots, 5.3 characters each, and least number of samples of a plot that are kept.
const NUMBERS: usize = 250_000;
const LEAST_SAMPLES: usize = 200;
/// Greatest number of spikes of all layers, 11 characters each, and greatest number of neurons of a layer in its raster.
const SPIKES: usize = 120_000;
const NEURONS: usize = 100;
/// Number of intervals in which spikes are counted, and their least length in seconds.
const INTERVALS: (usize, f64) = (400, 5e-3);
/// Greatest numbers of nodes and of connections in the drawing.
const DRAWN: (usize, usize) = (6_000, 12_000);

/// A page in HTML that shows a run of any graph and opens offline.
///
/// It draws the modules, folded by the parts of their paths: a press opens one. Connections show their synapses and
/// weights. Below are the plots that you add, a plot of each recorded output, and the spikes and the spikes per second of each
/// layer whose spikes were recorded, all over one time axis with one moment. Each can be exported as SVG and CSV. An output
/// of more than 12 components is shown as its norm; add a chart of its similarities to see more. Long recordings are thinned
/// out, so that the page stays below 5 MB.
///
/// ```
/// use symbolt::prelude::*;
/// use symbolt::record::RunPage;
///
/// symbolt::vocabulary!(Parts = "parts": NUT, BOLT);
/// let parts = Parts::vocabulary(64, Seed::new(1))?;
/// let mut graph = GraphBuilder::new();
/// let seen = graph.add("seen", parts.stimulus([(0, "NUT"), (50, "BOLT")])?);
/// let state = graph.add("state", State::new(&parts));
/// graph.route(&seen >> &state);
/// let [ideal, decoded] =
///     [&seen, &state.output].map(|output| graph.probe(output, ProbeSpec::default()));
/// graph.probe_spikes("state/population");
/// let spiking = PopulationPlan::lif();
/// let sim = graph.run(&spiking, Seed::new(1), SimDuration::from_millis(100))?;
/// let [ideal, decoded] =
///     [ideal, decoded].map(|probe| parts.similarities(sim.samples(&probe), Parts::NAMES));
/// let page = RunPage::new("What is seen", &sim).against("state", &decoded?, &ideal?).html();
/// assert!(page.starts_with("<!doctype html>"));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[must_use = "`html` returns the page"]
pub struct RunPage<'s> {
    title: String,
    sim: &'s Simulator,
    plots: Vec<Plot<'s>>,
}

/// Curves under a title.
struct Plot<'s> {
    title: String,
    series: Shown<'s>,
    ideal: Option<&'s TimeSeries>,
}

/// Curves that were given, or that the page makes.
enum Shown<'s> {
    Given(&'s TimeSeries),
    Made(TimeSeries),
}

impl Shown<'_> {
    fn series(&self) -> &TimeSeries {
        match self {
            Self::Given(series) => series,
            Self::Made(series) => series,
        }
    }
}

impl<'s> RunPage<'s> {
    /// Starts a page on what `sim` has done so far.
    pub fn new(title: &str, sim: &'s Simulator) -> Self {
        Self { title: title.into(), sim, plots: Vec::new() }
    }

    /// Adds a chart under a title.
    pub fn chart(mut self, title: &str, series: &'s TimeSeries) -> Self {
        self.plots.push(Plot { title: title.into(), series: Shown::Given(series), ideal: None });
        self
    }

    /// Adds a chart of decoded values against the ideal ones, which are dashed, with the root mean square of the difference.
    /// A column of `decoded` is compared with the column of `ideal` that has its name, or else its place; each sample with
    /// the last ideal one until its time.
    pub fn against(mut self, title: &str, decoded: &'s TimeSeries, ideal: &'s TimeSeries) -> Self {
        let (title, series) = (title.into(), Shown::Given(decoded));
        self.plots.push(Plot { title, series, ideal: Some(ideal) });
        self
    }

    /// Returns the page.
    pub fn html(&self) -> String {
        let recordings = self.sim.recordings();
        let outputs: Vec<Plot<'_>> = recordings
            .values()
            .map(|(name, samples)| Plot {
                title: name.into(),
                series: Shown::Made(of_output(samples)),
                ideal: None,
            })
            .collect();
        let rates: Vec<Plot<'_>> = recordings
            .spikes()
            .filter(|(_, spikes)| spikes.neurons() > 0)
            .map(|(name, spikes)| Plot {
                title: name.into(),
                series: Shown::Made(spikes_per_second(&spikes, self.sim.time_s())),
                ideal: None,
            })
            .collect();
        let numbers = |plot: &Plot<'_>| {
            let columns = plot.series.series().columns().len();
            columns + plot.ideal.map_or(0, |ideal| ideal.columns().len())
        };
        let all = || self.plots.iter().chain(&outputs).chain(&rates);
        let most = (NUMBERS / all().map(numbers).sum::<usize>().max(1)).max(LEAST_SAMPLES);
        let plots = |of: &[Plot<'_>], kind: &str| -> Vec<Value> {
            of.iter().map(|plot| plot.to_page(kind, most)).collect()
        };
        let shown = [plots(&self.plots, "chart"), plots(&outputs, "output"), plots(&rates, "rate")];
        let shown: Vec<Value> = shown.into_iter().flatten().collect();
        let graph = self.sim.graph();
        let data = json!({
            "kind": "graph",
            "title": self.title,
            "simulated_s": self.sim.time_s(),
            "seed": graph.seed().value(),
            "graph": drawn(self.sim),
            "plots": shown,
            "spikes": rasters(recordings.spikes().collect()),
            "dot": graph.to_dot(),
        });
        filled(PAGE, &[("{{style}}", STYLE)], &data, &CODE.concat())
    }
}

impl Plot<'_> {
    /// Returns the plot for the page, with at most so many samples.
    fn to_page(&self, kind: &str, most: usize) -> Value {
        let series = self.series.series();
        json!({
            "title": self.title, "kind": kind, "curves": curves(series, most),
            "ideal": self.ideal.map(|ideal| curves(ideal, most)),
            "rms": self.ideal.and_then(|ideal| rms(series, ideal)),
        })
    }
}

/// Returns numbers as text that the page reads.
fn packed(values: impl Iterator<Item = Real>) -> String {
    base64(&values.flat_map(Real::to_le_bytes).collect::<Vec<u8>>())
}

/// Returns curves for the page. Of more than `most` samples every second, third, ... one is kept, and the last.
fn curves(series: &TimeSeries, most: usize) -> Value {
    let samples = series.times_s().len();
    let step = samples.div_ceil(most).max(1);
    let kept = |i: &usize| i.is_multiple_of(step) || i + 1 == samples;
    let rows: Vec<(f64, &[Real])> =
        series.rows().enumerate().filter(|(i, _)| kept(i)).map(|(_, row)| row).collect();
    // What is not a number cannot be drawn.
    let number = |v: &Real| if v.is_finite() { *v } else { 0.0 };
    json!({
        "names": series.columns(), "unit": series.unit(), "every": step,
        "t": packed(rows.iter().map(|(t, _)| *t as Real)),
        "values": packed(rows.iter().flat_map(|(_, row)| row.iter().map(number))),
    })
}

/// Returns the root mean square of the difference between decoded and ideal values; `None` if nothing can be compared.
fn rms(decoded: &TimeSeries, ideal: &TimeSeries) -> Option<f64> {
    let own = |(i, name): (usize, &String)| {
        let named = ideal.columns().iter().position(|other| other == name);
        named.or((i < ideal.columns().len()).then_some(i)).map(|j| (i, j))
    };
    let pairs: Vec<(usize, usize)> = decoded.columns().iter().enumerate().filter_map(own).collect();
    let targets: Vec<(f64, &[Real])> = ideal.rows().collect();
    let (mut sum, mut count) = (0.0, 0u64);
    for (t, row) in decoded.rows() {
        // Sample times are sums of ticks.
        let last = targets.partition_point(|(at, _)| *at <= t + 1e-9).checked_sub(1);
        let Some((_, target)) = last.map(|last| targets[last]) else { continue };
        for (i, j) in &pairs {
            sum += f64::from(row[*i] - target[*j]).powi(2);
            count += 1;
        }
    }
    (count > 0).then(|| (sum / count as f64).sqrt())
}

/// Returns the curves of a recorded output: its components, or its norm if there are many.
fn of_output(samples: Samples<'_, Vector>) -> TimeSeries {
    if samples.width() <= CURVES {
        return samples.series([""; 0]);
    }
    let name = format!("norm of {} components", samples.width());
    let mut series = TimeSeries::new(vec![name], ("norm", [0.0, 1.0]));
    for (time, value) in samples.iter() {
        series.push(time, [length(value)].into_iter());
    }
    series
}

/// Returns the Euclidean norm, summed in double precision.
fn length(value: &[f32]) -> f32 {
    value.iter().map(|v| f64::from(*v).powi(2)).sum::<f64>().sqrt() as f32
}

/// Returns the spikes per second of a neuron on average, in intervals of at least 5 ms.
fn spikes_per_second(spikes: &Spikes<'_>, until_s: f64) -> TimeSeries {
    let (most, least_s) = INTERVALS;
    let count = ((until_s / least_s) as usize).clamp(1, most);
    let width_s = until_s / count as f64;
    let mut counts = vec![0u32; count];
    for (time, _) in spikes.iter() {
        // A spike is stamped with the end of its tick.
        let at = ((time / width_s - 1e-6).max(0.0) as usize).min(count - 1);
        counts[at] += 1;
    }
    let columns = vec!["mean of all neurons".to_owned()];
    let mut series = TimeSeries::new(columns, ("spikes per second", [0.0, 1.0]));
    let per_neuron = 1.0 / (spikes.neurons().max(1) as f64 * width_s);
    for (i, count) in counts.into_iter().enumerate() {
        let rate = (f64::from(count) * per_neuron) as Real;
        series.push((i + 1) as f64 * width_s, [rate].into_iter());
    }
    series
}

/// Returns the spikes of all layers for the page: of a large layer those of evenly spaced neurons.
fn rasters(layers: Vec<(&str, Spikes<'_>)>) -> Value {
    let layers: Vec<_> = layers.into_iter().filter(|(_, spikes)| spikes.neurons() > 0).collect();
    let step = |spikes: &Spikes<'_>| spikes.neurons().div_ceil(NEURONS).max(1);
    let steps: Vec<usize> = layers.iter().map(|(_, spikes)| step(spikes)).collect();
    let shown = |of: &Spikes<'_>, step: usize| {
        of.iter().filter(move |(_, n)| n.is_multiple_of(step)).count()
    };
    let all: usize =
        layers.iter().zip(&steps).map(|((_, spikes), step)| shown(spikes, *step)).sum();
    let more = all.div_ceil(SPIKES).max(1);
    let (mut first, mut all) = (0usize, Vec::new());
    let populations: Vec<Value> = layers
        .iter()
        .zip(steps)
        .map(|((path, spikes), step)| {
            let step = step * more;
            let rows = spikes.neurons().div_ceil(step);
            let own = spikes.iter().filter(|(_, neuron)| neuron.is_multiple_of(step));
            all.extend(own.map(|(t, neuron)| (t as Real, (first + neuron / step) as Real)));
            first += rows;
            json!({
                "path": path, "rows": rows, "neurons": spikes.neurons(), "every": step,
                "rate_hz": spikes.mean_rate_hz(), "spikes": spikes.count(),
            })
        })
        .collect();
    all.sort_by(|a, b| a.0.total_cmp(&b.0));
    json!({
        "populations": populations,
        "t": packed(all.iter().map(|(t, _)| *t)),
        "row": packed(all.iter().map(|(_, row)| *row)),
    })
}

/// Returns the graph for the page, without the connections if there are too many for a drawing.
fn drawn(sim: &Simulator) -> Value {
    let mut outline = sim.graph().outline();
    let connections = outline.edges.len();
    if outline.nodes.len() > DRAWN.0 || connections > DRAWN.1 {
        outline.edges.clear();
    }
    json!({
        "nodes": outline.nodes, "edges": outline.edges, "connections": connections,
        "notes": outline.notes,
    })
}
