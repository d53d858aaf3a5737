//! Everything that a run recorded, for files: numpy archives and CSV.

use std::fmt::Write as _;

use ndarray::{ArrayView1, ArrayView2};

use crate::files::npz::{NpzError, NpzWriter};
use crate::sim::{Real, Samples, Simulator, Spikes, Vector};

/// Everything that the probes of a run have recorded, by the names of the outputs and layers.
///
/// ```
/// use symbolt::files::{Overwrite, write_atomic};
/// use symbolt::prelude::*;
///
/// symbolt::vocabulary!(Parts = "parts": NUT);
/// let parts = Parts::vocabulary(32, Seed::new(1))?;
/// let mut graph = GraphBuilder::new();
/// let seen = graph.add("seen", parts.stimulus([(0, "NUT")])?);
/// let state = graph.add("state", State::new(&parts));
/// graph.route(&seen >> &state);
/// graph.probe_at::<Pointer<Parts>>("state", ProbeSpec::every(SimDuration::from_millis(10)));
/// graph.probe_spikes("state/population");
/// let spiking = PopulationPlan::lif();
/// let sim = graph.run(&spiking, Seed::new(1), SimDuration::from_millis(100))?;
/// let recordings = sim.recordings();
/// assert!(recordings.values_csv().starts_with("time_s,state.output[0],state.output[1]"));
/// assert!(recordings.spikes_csv().lines().count() > 100);
/// # let folder = tempfile::tempdir()?;
/// # let path = folder.path().join("run.npz");
/// write_atomic(&path, recordings.to_npz()?, Overwrite::Never)?;
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct Recordings<'a> {
    values: Vec<(String, Samples<'a, Vector>)>,
    spikes: Vec<(String, Spikes<'a>)>,
}

impl Simulator {
    /// Returns everything that the probes have recorded.
    pub fn recordings(&self) -> Recordings<'_> {
        let (values, spikes) = self.recorded();
        Recordings { values, spikes }
    }
}

impl<'a> Recordings<'a> {
    /// Returns the names of the recorded outputs with their samples, in the order of their probes. The samples of any
    /// kind of output are vectors here. The second probe of an output has `-2` behind its name, and so on.
    pub fn values(&self) -> impl Iterator<Item = (&str, Samples<'a, Vector>)> {
        self.values.iter().map(|(name, samples)| (name.as_str(), *samples))
    }

    /// Returns the paths of the layers whose spikes were recorded, with their spikes.
    pub fn spikes(&self) -> impl Iterator<Item = (&str, Spikes<'_>)> {
        self.spikes.iter().map(|(name, spikes)| (name.as_str(), *spikes))
    }

    /// Returns all values as a table in CSV: one row per time at which anything was sampled, one column per component.
    /// A column is empty at times at which its output was not sampled.
    pub fn values_csv(&self) -> String {
        let mut table = String::from("time_s");
        for (name, samples) in self.values() {
            for i in 0..samples.width() {
                let column =
                    if samples.width() == 1 { name.into() } else { format!("{name}[{i}]") };
                table += &format!(",{column}");
            }
        }
        table.push('\n');
        let times = |samples: Samples<'a, Vector>| samples.iter().map(|(time, _)| time);
        let mut all: Vec<f64> = self.values().flat_map(|(_, samples)| times(samples)).collect();
        all.sort_unstable_by(f64::total_cmp);
        all.dedup();
        let mut at = vec![0; self.values.len()];
        for time in all {
            let _ = write!(table, "{time}");
            for ((_, samples), at) in self.values().zip(&mut at) {
                let row = samples.get(*at).filter(|sample| sample.0 == time).map(|(_, row)| row);
                *at += usize::from(row.is_some());
                for i in 0..samples.width() {
                    table.push(',');
                    if let Some(row) = row {
                        let _ = write!(table, "{}", row[i]);
                    }
                }
            }
            table.push('\n');
        }
        table
    }

    /// Returns all spikes as a table in CSV, layer by layer: time in seconds, path of the layer, index of the neuron.
    pub fn spikes_csv(&self) -> String {
        let mut table = String::from("time_s,layer,neuron\n");
        for (name, spikes) in &self.spikes {
            for (time, neuron) in spikes.iter() {
                let _ = writeln!(table, "{time},{name},{neuron}");
            }
        }
        table
    }

    /// Returns a numpy archive. An output called `x` has the arrays `x.time_s` (samples) and `x.values` (samples x
    /// components); a layer called `y` has `y.spike_time_s` and `y.spike_neuron`, one number per spike.
    ///
    /// # Errors
    /// [`NpzError`] if the archive is too large for its format.
    pub fn to_npz(&self) -> Result<Vec<u8>, NpzError> {
        let mut archive = NpzWriter::new();
        for (name, samples) in self.values() {
            let times_s: Vec<f64> = samples.iter().map(|(time, _)| time).collect();
            let values: Vec<Real> = samples.iter().flat_map(|(_, row)| row).copied().collect();
            archive.add(&format!("{name}.time_s"), &ArrayView1::from(&times_s))?;
            if let Ok(values) = ArrayView2::from_shape((times_s.len(), samples.width()), &values) {
                archive.add(&format!("{name}.values"), &values)?;
            }
        }
        for (name, spikes) in &self.spikes {
            let (times, neurons): (Vec<f64>, Vec<u32>) =
                spikes.iter().map(|(time, neuron)| (time, neuron as u32)).unzip();
            archive.add(&format!("{name}.spike_time_s"), &ArrayView1::from(&times))?;
            archive.add(&format!("{name}.spike_neuron"), &ArrayView1::from(&neurons))?;
        }
        archive.finish()
    }
}
