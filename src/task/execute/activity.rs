//! Observers that record the planner graph's activity over an episode: the contents of its modules, and a
//! spike raster.
//!
//! While the graph decides, [`ActivityRecorder`] samples the modules every 2 ms and the spikes in every tick. While the robot
//! moves, it samples the modules every 40 ms and no spikes. [`ActivityFiles`] writes every tick of the modules to disk.

use std::collections::BTreeMap;
use std::io;
use std::path::Path;
use std::sync::Arc;

use crate::neurons::{LayerSaturation, Saturation};
use crate::record::RowFiles;
use crate::sim::{EventSource, Note, Real, SimView, is_within};
use crate::task::event::{Doing, Event, Observer};
use crate::task::planner::{Decider, Shows};

/// Ticks between two samples: while the graph decides, and while the robot moves.
const PERIODS: [u64; 2] = [2, 40];
/// Ticks between two looks for neurons that saturate while the graph decides.
const LOOK: u64 = 10;
/// Share of values beyond the radius from which a layer is said to saturate.
const SATURATED: f64 = 0.01;
/// Greatest number of neurons of one population in the raster.
const ROWS: usize = 12;
/// Greatest number of spikes kept for one episode, 16 bytes each.
const MAX_SPIKES: usize = 1_000_000;

/// The samples of one module.
#[derive(Debug, Clone, PartialEq)]
pub struct ModuleSamples {
    /// Name of the module.
    pub name: String,
    /// What it is called for people, and what it does.
    pub note: Note,
    /// Names of its numbers.
    pub names: Vec<String>,
    /// Kind of its numbers.
    pub shows: Shows,
    /// Values, row by row: one row for each of [`ActivityRecorder::times_s`], with one number for each name.
    pub values: Vec<Real>,
}

/// One population in the raster.
struct RasterRows {
    path: String,
    of: EventSource,
    /// Indices of the neurons shown, evenly spread over the population.
    neurons: Vec<usize>,
}

/// Records the activity of a planner graph over one episode. The default is the record of an episode without a planner: it
/// stays empty.
#[derive(Default)]
pub struct ActivityRecorder {
    planner: Option<Arc<dyn Decider>>,
    times_s: Vec<f64>,
    modules: Vec<ModuleSamples>,
    raster: Vec<RasterRows>,
    /// Simulated time in seconds, and row of the neuron.
    spikes: Vec<(f64, u32)>,
    saturation: Saturation,
}

impl ActivityRecorder {
    /// Creates an empty record for a planner's modules and its spiking populations, if it has any.
    pub fn new(planner: Arc<dyn Decider>) -> Self {
        let modules = planner.modules().iter().map(|module| ModuleSamples {
            name: module.name.into(),
            note: module.note.clone(),
            names: module.names.clone(),
            shows: module.shows,
            values: Vec::new(),
        });
        let raster = planner.graph().event_sources().map(|(path, of)| {
            let rows = ROWS.min(of.units);
            let neurons = (0..rows).map(|i| i * of.units / rows).collect();
            RasterRows { path: path.into(), of, neurons }
        });
        let (modules, raster) = (modules.collect(), raster.collect());
        let planner = Some(planner);
        Self { planner, modules, raster, ..Self::default() }
    }

    fn sample(&mut self, view: &SimView<'_>, doing: Doing<'_>) {
        let Some(planner) = &self.planner else { return };
        let deciding = doing == Doing::Deciding;
        let now = view.time().as_millis_f64() / 1e3;
        if deciding {
            let mut row = 0;
            for rows in &self.raster {
                for neuron in &rows.neurons {
                    if self.spikes.len() < MAX_SPIKES && view.event(rows.of, *neuron) {
                        self.spikes.push((now, row));
                    }
                    row += 1;
                }
            }
        }
        if deciding && view.tick().is_multiple_of(LOOK) {
            self.saturation.look(view);
        }
        let [often, seldom] = PERIODS;
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

    /// Returns the sample times of the modules, in simulated seconds.
    pub fn times_s(&self) -> &[f64] {
        &self.times_s
    }

    /// Returns the modules' samples, in the order of a decision.
    pub fn modules(&self) -> &[ModuleSamples] {
        &self.modules
    }

    /// Returns the populations in the raster: path, number of neurons shown, total number of neurons.
    pub fn populations(&self) -> impl Iterator<Item = (&str, usize, usize)> {
        self.raster.iter().map(|h| (h.path.as_str(), h.neurons.len(), h.of.units))
    }

    /// Returns what the populations in the raster and the modules around them are called for people, by path.
    pub fn notes(&self) -> BTreeMap<String, Note> {
        let Some(planner) = &self.planner else { return BTreeMap::new() };
        let mut notes = planner.graph().outline().notes;
        notes.retain(|path, _| self.raster.iter().any(|rows| is_within(&rows.path, path)));
        notes
    }

    /// Returns the layers that were to represent values beyond their radius during decisions, in more than one of a hundred
    /// cases, where exact maths has no such limit.
    pub fn saturated(&self) -> impl Iterator<Item = &LayerSaturation> {
        self.saturation.layers().filter(|layer| layer.share() > SATURATED)
    }

    /// Returns every recorded spike: simulated time in seconds, and row of the neuron, counted over all
    /// populations.
    pub fn spikes(&self) -> &[(f64, u32)] {
        &self.spikes
    }
}

impl Observer for ActivityRecorder {
    fn observe(&mut self, event: &Event<'_>) {
        if let Event::Ticked { view, doing } = event {
            self.sample(view, *doing);
        }
    }
}

/// Writes what the modules of a planner graph show to `.npy` files that grow, in every tick ([`RowFiles`]), so that memory stays
/// bounded however long the episode is. `columns.json` has the names of the numbers of each module.
///
/// If the run goes back, the files do so with the next tick. If it then goes to a branch that it had left, whose rows are gone, they
/// end there, with a fault. A graph over a problem that was compiled anew is not written.
pub struct ActivityFiles {
    planner: Arc<dyn Decider>,
    files: RowFiles,
    /// The tick of the last row.
    last: Option<u64>,
    row: Vec<Real>,
    fault: Option<io::Error>,
}

impl ActivityFiles {
    /// Creates the files in a folder.
    ///
    /// # Errors
    /// If the folder does not exist, or already has such a file.
    pub fn create(folder: &Path, planner: Arc<dyn Decider>) -> io::Result<Self> {
        let modules = planner.modules();
        let columns: serde_json::Map<String, serde_json::Value> =
            modules.iter().map(|m| (m.name.into(), m.names.clone().into())).collect();
        let lists = modules.iter().map(|module| (module.name, module.names.len()));
        let files = RowFiles::create(folder, lists)?;
        let text = format!("{:#}\n", serde_json::Value::Object(columns));
        std::fs::write(folder.join("columns.json"), text)?;
        let row = vec![0.0; modules.iter().map(|module| module.names.len()).sum()];
        Ok(Self { planner, files, last: None, row, fault: None })
    }

    /// Writes what waits, and ends the files at a time in seconds: a run that has gone back may end before the last row.
    ///
    /// # Errors
    /// Why a file could not be written to its end.
    pub fn finish(mut self, time_s: f64) -> io::Result<()> {
        match self.fault.take() {
            Some(fault) => Err(fault),
            None => self.files.cut(time_s),
        }
    }

    /// Returns why the files could not be written, if they could not. Nothing more is written then.
    pub fn fault(&self) -> Option<&io::Error> {
        self.fault.as_ref()
    }

    fn sample(&mut self, view: &SimView<'_>) -> io::Result<()> {
        let last = self.last.replace(view.tick());
        if last.is_some_and(|last| view.tick() > last + 1) {
            self.files.flush()?;
            return Err(io::Error::other(
                "the run went to another branch, of which the rows are gone",
            ));
        }
        let mut from = 0;
        for module in self.planner.modules() {
            let to = from + module.names.len();
            module.read(view, &mut self.row[from..to]);
            from = to;
        }
        self.files.push(view.time().as_millis_f64() / 1e3, &self.row)
    }
}

impl Observer for ActivityFiles {
    fn observe(&mut self, event: &Event<'_>) {
        if let Event::Ticked { view, .. } = event
            && self.fault.is_none()
        {
            self.fault = self.sample(view).err();
        }
    }
}
