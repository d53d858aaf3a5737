//! A page that shows a run of any graph: its modules, charts of what was recorded, spikes and connections.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use super::TimeSeries;
use crate::sim::{Samples, Simulator, Vector};

/// Greatest number of components of an output that get a curve each.
const CURVES: usize = 12;

const STYLE: &str = "body{font:15px/1.5 system-ui,sans-serif;max-width:62rem;margin:2rem auto;padding:0 1rem;color:#222}\
h1{font-size:1.5rem}h2{font-size:1.1rem;margin-top:2rem}table{border-collapse:collapse}\
th,td{text-align:left;padding:.2rem 1rem .2rem 0;border-bottom:1px solid #ddd}\
td.n,th.n{text-align:right}pre{overflow:auto;background:#f6f6f6;padding:.7rem}svg{max-width:100%;height:auto}";

/// A page in HTML that shows a run of any graph and opens offline.
///
/// It shows the modules with their connections and neurons, the charts that you add, a chart of each recorded output,
/// and a raster of each layer whose spikes were recorded. An output of more than 12 components is shown as its norm; add
/// a chart of its similarities to see more.
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
/// let probe = graph.probe(&state.output, ProbeSpec::default());
/// graph.probe_spikes("state/population");
/// let spiking = PopulationPlan::all(Population::Lif(LifSpec::default()));
/// let sim = graph.run(&spiking, Seed::new(1), SimDuration::from_millis(100))?;
/// let seen = parts.similarities(sim.samples(&probe), Parts::NAMES)?;
/// let page = RunPage::new("What is seen", &sim).chart("state", &seen).html();
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

    /// Adds a chart under a title.
    pub fn chart(mut self, title: &str, series: &TimeSeries) -> Self {
        self.charts.push(series.to_svg(title));
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
        page += "<h2>Modules</h2>\n";
        if let Some(drawing) = graph.to_svg() {
            let _ = writeln!(page, "<p>{drawing}</p>");
        }
        self.write_modules(&mut page);
        let recordings = self.sim.recordings();
        let outputs: Vec<String> =
            recordings.values().map(|(name, s)| of_output(name, s)).collect();
        if !self.charts.is_empty() || !outputs.is_empty() {
            page += "<h2>Over time</h2>\n";
        }
        for chart in self.charts.iter().chain(&outputs) {
            let _ = writeln!(page, "<p>{chart}</p>");
        }
        for (path, spikes) in recordings.spikes() {
            let _ = writeln!(
                page,
                "<p>{}</p>\n<p>{} neurons, {} spikes, {:.0} Hz on average.</p>",
                spikes.to_svg(&format!("Spikes of {path}")),
                spikes.neurons(),
                spikes.count(),
                spikes.mean_rate_hz(),
            );
        }
        let _ = writeln!(
            page,
            "<details><summary>All nodes, in the DOT language of Graphviz</summary><pre>{}</pre></details>\n</body></html>",
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
        *page += "<table><tr><th>name</th><th class=\"n\">nodes</th><th class=\"n\">spiking neurons</th></tr>\n";
        for (name, [nodes, neurons]) in modules {
            let name = escaped(&name);
            let _ = writeln!(
                page,
                "<tr><td>{name}</td><td class=\"n\">{nodes}</td><td class=\"n\">{neurons}</td></tr>"
            );
        }
        *page += "</table>\n";
    }
}

/// Draws a recorded output: its components, or its norm if there are many.
fn of_output(name: &str, samples: Samples<'_, Vector>) -> String {
    if samples.width() <= CURVES {
        return samples.series([""; 0]).to_svg(name);
    }
    let mut series = TimeSeries::new(vec!["norm".into()], ("norm", [0.0, 1.0]));
    for (time, value) in samples.iter() {
        series.push(time, [length(value)].into_iter());
    }
    series.to_svg(&format!("{name}, norm of {} components", samples.width()))
}

/// Returns the Euclidean norm, summed in double precision.
fn length(value: &[f32]) -> f32 {
    value.iter().map(|v| f64::from(*v).powi(2)).sum::<f64>().sqrt() as f32
}
