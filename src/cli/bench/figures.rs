//! The figures of a network: what `bench` prints, and reads again to compare.

use std::ops::RangeInclusive;

use serde::{Deserialize, Serialize};
use serde_json::{Map, Value, json};
use symbolt::study::standard::{Limits, Measured, machine};

use super::BenchArgs;
use crate::cli::rank;
use crate::cli::table::Grid;

/// Greatest number of runs.
pub(super) const MOST_RUNS: usize = 1_000;

/// Times in seconds that a network can take.
const TIMES_S: RangeInclusive<f64> = 1e-9..=1e9;

/// Speed and quality of a network. Earlier programs printed less.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Figures {
    pub model: String,
    pub mode: String,
    pub neurons: usize,
    pub exchanged_values: usize,
    pub dimensions: usize,
    #[serde(default)]
    pub neurons_scale: Option<f64>,
    /// Threads that were asked for. A small network uses fewer.
    pub threads: usize,
    pub ranks: usize,
    pub build_s: f64,
    pub load_s: Option<f64>,
    pub wall_per_sim_s: f64,
    /// Those of all runs, in their order.
    #[serde(default)]
    pub wall_per_sim_s_of_runs: Vec<f64>,
    pub ns_per_neuron_step: f64,
    pub peak_rss_mb: Option<f64>,
    pub seed: u64,
    pub sim_s: f64,
    pub unbinding: String,
    pub choice: String,
    #[serde(default)]
    pub machine: Option<String>,
    /// Of the neurons, those whose ensembles are not passed over.
    #[serde(default)]
    pub visited_share: Option<f64>,
    #[serde(default)]
    pub bytes_per_neuron_step: Option<f64>,
    #[serde(default)]
    pub operations_per_neuron_step: Option<f64>,
    #[serde(default)]
    pub limit: Option<Limit>,
    pub quality: Map<String, Value>,
    /// Hash of the bits of all outputs of the first 300 ms.
    #[serde(default)]
    pub bits: Option<String>,
}

/// What bare loops of the same run say of the least time.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Limit {
    pub gb_per_s: f64,
    pub gop_per_s: f64,
    pub ns_per_neuron_step: f64,
    /// `memory` or `arithmetic`, whichever takes longer.
    pub by: String,
    /// The least time over the time of the median run.
    pub share: f64,
}

impl Figures {
    /// Makes the figures of some runs, which are not none. The bare loops run now.
    pub fn new(
        args: &BenchArgs,
        mut runs: Vec<Measured>,
        load_s: Option<f64>,
        peak_rss_mb: Option<f64>,
    ) -> Self {
        let wall = |run: &Measured| run.run_s / run.sim_s;
        let of_runs = runs.iter().map(wall).collect();
        runs.sort_by(|a, b| a.run_s.total_cmp(&b.run_s));
        let middle = runs.swap_remove(runs.len() / 2);
        // Several processes have their neurons in parts, and the memory of the machine together.
        let alone = rank::own().is_none() && middle.neurons > 0;
        let (limit, traffic) = match alone {
            true => (limit(&middle), Some(middle.traffic.over(middle.neurons as f64))),
            false => (None, None),
        };
        let quality = middle.quality.iter().map(|(name, value)| ((*name).into(), json!(value)));
        Self {
            model: args.model().into(),
            mode: args.mode.clone(),
            neurons: middle.neurons,
            exchanged_values: middle.exchanged_values,
            dimensions: args.dimensions,
            neurons_scale: Some(args.neurons_scale),
            threads: rayon::current_num_threads(),
            ranks: rank::own().map_or(1, |ranks| ranks.ranks()),
            build_s: middle.build_s,
            load_s,
            wall_per_sim_s: wall(&middle),
            wall_per_sim_s_of_runs: of_runs,
            ns_per_neuron_step: middle.ns_per_neuron_step,
            peak_rss_mb,
            seed: args.common.seed,
            sim_s: middle.sim_s,
            unbinding: args.unbinding().into(),
            choice: args.choice().into(),
            machine: Some(machine()),
            visited_share: traffic.map(|traffic| traffic.visited),
            bytes_per_neuron_step: traffic.map(|traffic| traffic.bytes()),
            operations_per_neuron_step: traffic.map(|traffic| traffic.operations),
            limit,
            quality: quality.collect(),
            bits: Some(format!("{:016x}", middle.bits)),
        }
    }

    pub fn to_json(&self) -> Value {
        json!(self)
    }

    /// Says why figures that were read cannot be those of a network; `None` if they can.
    pub fn fault(&self) -> Option<String> {
        let runs = &self.wall_per_sim_s_of_runs;
        if runs.len() > MOST_RUNS {
            return Some(format!(
                "it has the times of {} runs; expected at most {MOST_RUNS}",
                runs.len()
            ));
        }
        let times = [self.wall_per_sim_s, self.build_s];
        if let Some(time) = runs.iter().chain(&times).find(|time| !TIMES_S.contains(*time)) {
            let [least, most] = [TIMES_S.start(), TIMES_S.end()];
            return Some(format!("it has a time of {time:e} s; expected {least:e} to {most:e}"));
        }
        let numbers = self.quality.values().all(|value| value.is_number() || value.is_null());
        (!numbers).then(|| "in its `quality` is something other than numbers".into())
    }

    pub fn table(&self) -> Grid {
        let mut grid = Grid::new(&[&format!("{} in {}", self.model, self.mode), ">value"]);
        let mut row = |name: &str, value: String| grid.row([name.to_owned(), value]);
        row("neurons", self.neurons.to_string());
        row("build time, s", format!("{:.2}", self.build_s));
        if let Some(load_s) = self.load_s {
            row("load time from a file, s", format!("{load_s:.2}"));
        }
        row("simulated time, s", self.sim_s.to_string());
        row("run time, s", format!("{:.3}", self.wall_per_sim_s * self.sim_s));
        row("ns per neuron and step", format!("{:.2}", self.ns_per_neuron_step));
        let traffic = [
            ("bytes per neuron and step", self.bytes_per_neuron_step),
            ("operations per neuron and step", self.operations_per_neuron_step),
            ("neurons not passed over, %", self.visited_share.map(|share| 100.0 * share)),
        ];
        for (name, value) in traffic {
            if let Some(value) = value {
                row(name, format!("{value:.1}"));
            }
        }
        if let Some(limit) = &self.limit {
            row("memory of the machine, GB/s", format!("{:.1}", limit.gb_per_s));
            row("arithmetic of the machine, 10^9/s", format!("{:.1}", limit.gop_per_s));
            let name = format!("share of its limit ({}), %", limit.by);
            row(&name, format!("{:.0}", 100.0 * limit.share));
        }
        if let Some(mb) = self.peak_rss_mb {
            row("peak memory of the build, MB", format!("{mb:.0}"));
        }
        for (name, value) in &self.quality {
            row(&name.replace('_', " "), shown(value, 4));
        }
        grid
    }
}

/// Returns a figure of quality as a table shows it, with so many digits after the point.
pub(super) fn shown(value: &Value, digits: usize) -> String {
    value.as_f64().map_or_else(|| "never".into(), |value| format!("{value:.digits$}"))
}

/// Measures the machine as a run used it.
fn limit(run: &Measured) -> Option<Limit> {
    let limits = Limits::of(run);
    let bound = limits.bound(run)?;
    Some(Limit {
        gb_per_s: limits.bytes_per_s / 1e9,
        gop_per_s: limits.operations_per_s / 1e9,
        ns_per_neuron_step: bound.ns_per_neuron_step,
        by: if bound.by_memory { "memory" } else { "arithmetic" }.into(),
        share: bound.ns_per_neuron_step / run.ns_per_neuron_step,
    })
}
