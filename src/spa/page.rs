//! A page that shows a run of any graph: its modules, charts of what was recorded, spikes and connections.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use super::similarities::Similarities;
use crate::sim::{Simulator, Spikes};

/// Greatest number of components of an output that get a chart. Wider ones, such as pointers, are left to
/// [`RunPage::similarities`].
const CURVES: usize = 12;
/// Greatest number of neurons of a raster; of larger layers it shows evenly spaced ones.
const NEURONS: usize = 100;
/// Width of a raster and height of one of its rows, in pixels.
const RASTER: (usize, usize) = (720, 3);

const STYLE: &str = "body{font:15px/1.5 system-ui,sans-serif;max-width:62rem;margin:2rem auto;padding:0 1rem;color:#222}\
h1{font-size:1.5rem}h2{font-size:1.1rem;margin-top:2rem}table{border-collapse:collapse}\
th,td{text-align:left;padding:.2rem 1rem .2rem 0;border-bottom:1px solid #ddd}\
td.n,th.n{text-align:right}pre{overflow:auto;background:#f6f6f6;padding:.7rem}svg{max-width:100%;height:auto}";

/// A page in HTML that shows a run of any graph and opens offline.
///
/// It has the modules with their neurons, a chart for each [`Similarities`] that you add and for each recorded output of
/// at most 12 components, a raster of each layer whose spikes were recorded, and the graph in the DOT language.
///
/// ```
/// use symbolt::prelude::*;
/// use symbolt::spa::RunPage;
///
/// symbolt::vocabulary!(Parts = "parts": NUT, BOLT);
/// let parts = Parts::vocabulary(64, Seed::new(1))?;
/// let mut graph = GraphBuilder::new();
/// let seen = graph.add("seen", parts.stimulus([(0, "NUT"), (50, "BOLT")])?);
/// let state = graph.add("state", State::new(&parts));
/// graph.route(&seen >> &state);
/// let probe = graph.probe(&state.output, ProbeSpec::default());
/// graph.probe_spikes("state/population");
/// let spiking = PopulationPlan::all(Population::Lif(LifSpec::default()));
/// let sim = graph.run(&spiking, Seed::new(1), SimDuration::from_millis(100))?;
/// let seen = parts.similarities(sim.samples(&probe), Parts::NAMES)?;
/// let page = RunPage::new("What is seen", &sim).similarities("state", &seen).html();
/// assert!(page.starts_with("<!DOCTYPE html>"));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[must_use = "`html` returns the page"]
pub struct RunPage<'s> {
    title: String,
    sim: &'s Simulator,
    charts: Vec<String>,
}

/// Text as HTML shows it.
fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

impl<'s> RunPage<'s> {
    /// Starts a page on what `sim` has done so far.
    pub fn new(title: &str, sim: &'s Simulator) -> Self {
        Self { title: title.into(), sim, charts: Vec::new() }
    }

    /// Adds a chart of similarities under a title.
    pub fn similarities(mut self, title: &str, similarities: &Similarities) -> Self {
        self.charts.push(similarities.to_svg(title));
        self
    }

    /// Returns the page.
    pub fn html(&self) -> String {
        let title = escaped(&self.title);
        let mut page = format!(
            "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>{title}</title>\
             <style>{STYLE}</style></head><body>\n<h1>{title}</h1>\n"
        );
        let graph = self.sim.graph();
        let _ = writeln!(
            page,
            "<p>{:.0} simulated ms, {} nodes, {} connections, build seed {}.</p>",
            1e3 * self.sim.time_s(),
            graph.node_count(),
            graph.edge_count(),
            graph.seed().value()
        );
        self.write_modules(&mut page);
        let outputs = self.outputs();
        if !self.charts.is_empty() || !outputs.is_empty() {
            page += "<h2>Over time</h2>\n";
        }
        for chart in self.charts.iter().chain(&outputs) {
            let _ = writeln!(page, "<p>{chart}</p>");
        }
        for (path, spikes) in self.sim.recordings().spikes() {
            let (path, rate) = (escaped(path), spikes.mean_rate_hz());
            let _ = writeln!(
                page,
                "<h2>Spikes of {path}</h2>\n<p>{} neurons, {} spikes, {rate:.0} Hz on average.</p>\n<p>{}</p>",
                spikes.neurons(),
                spikes.count(),
                raster(spikes, self.sim.time_s())
            );
        }
        let _ = writeln!(
            page,
            "<h2>Graph</h2>\n<details><summary>In the DOT language of Graphviz</summary><pre>{}</pre></details>\n</body></html>",
            escaped(&graph.to_dot())
        );
        page
    }

    /// Writes the table of modules.
    fn write_modules(&self, page: &mut String) {
        let graph = self.sim.graph();
        let module = |path: &str| path.split('/').next().unwrap_or_default().to_owned();
        let mut modules: BTreeMap<String, [usize; 2]> = BTreeMap::new();
        for path in graph.paths() {
            modules.entry(module(path)).or_default()[0] += 1;
        }
        for (path, source) in graph.event_sources() {
            modules.entry(module(path)).or_default()[1] += source.units;
        }
        *page += "<h2>Modules</h2>\n<table><tr><th>name</th><th class=\"n\">nodes</th><th class=\"n\">spiking neurons</th></tr>\n";
        for (name, [nodes, neurons]) in modules {
            let name = escaped(&name);
            let _ = writeln!(
                page,
                "<tr><td>{name}</td><td class=\"n\">{nodes}</td><td class=\"n\">{neurons}</td></tr>"
            );
        }
        *page += "</table>\n";
    }

    /// Returns charts of the recorded outputs that have few components.
    fn outputs(&self) -> Vec<String> {
        let recordings = self.sim.recordings();
        let narrow = recordings.values().filter(|output| (1..=CURVES).contains(&output.width));
        narrow
            .map(|output| {
                let columns = match output.width {
                    1 => vec![output.name.to_owned()],
                    width => (0..width).map(|i| format!("{}[{i}]", output.name)).collect(),
                };
                Similarities::of_values(columns, output.times_s, output.values).chart(
                    output.name,
                    "value",
                    0.0..1e-3,
                )
            })
            .collect()
    }
}

/// Draws spikes as SVG: time to the right, one row per neuron.
fn raster(spikes: Spikes<'_>, end_s: f64) -> String {
    let (width, row) = RASTER;
    let step = spikes.neurons().div_ceil(NEURONS).max(1);
    let height = row * spikes.neurons().div_ceil(step);
    let (mut path, mut drawn) = (String::new(), vec![false; width * NEURONS]);
    for (time, neuron) in spikes.iter().filter(|(_, neuron)| neuron.is_multiple_of(step)) {
        let x = ((time / end_s.max(1e-9) * width as f64) as usize).min(width - 1);
        // One mark per pixel, so that long runs do not make long pages.
        let mark = &mut drawn[neuron / step * width + x];
        if !std::mem::replace(mark, true) {
            let _ = write!(path, "M{x}.5 {}v{row}", neuron / step * row);
        }
    }
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" viewBox=\"0 0 {width} {height}\">\
         <rect width=\"{width}\" height=\"{height}\" fill=\"#fafafa\"/><path d=\"{path}\" stroke=\"#0072b2\"/></svg>"
    )
}
