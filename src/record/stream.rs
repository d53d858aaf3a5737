//! Recordings of long runs, written to disk in pieces so that memory stays bounded.

use std::fs::File;
use std::io::{self, Seek, SeekFrom, Write};
use std::path::Path;

use crate::files::npz::head;
use crate::sim::Simulator;

/// Length of the head of a file, whatever the number of rows.
const HEAD: usize = 128;

/// A `.npy` file that grows by rows. Its head says how many are whole, so that it can be read while it grows, and if the
/// program is killed.
struct Growing {
    file: File,
    /// Type of a number, such as `<f4`.
    kind: &'static str,
    /// Numbers of a row; `None` for a list of numbers.
    width: Option<usize>,
    /// Bytes of a row.
    each: u64,
    /// Rows that are whole.
    rows: u64,
}

impl Growing {
    fn create(path: &Path, kind: &'static str, width: Option<usize>) -> io::Result<Self> {
        let number = if kind == "<f8" { 8 } else { 4 };
        let each = number * width.unwrap_or(1) as u64;
        let mut own = Self { file: File::create_new(path)?, kind, width, each, rows: 0 };
        own.note(0)?;
        Ok(own)
    }

    /// Writes bytes behind the rows that are whole. They are rows of the file from [`note`](Self::note) on.
    fn append(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.file.seek(SeekFrom::Start(HEAD as u64 + self.rows * self.each))?;
        self.file.write_all(bytes)
    }

    /// Writes the head of a file of so many rows.
    fn note(&mut self, rows: u64) -> io::Result<()> {
        let shape = match self.width {
            Some(width) => format!("{rows:<20}, {width}"),
            None => format!("{rows:<20},"),
        };
        self.file.seek(SeekFrom::Start(0))?;
        self.file.write_all(&head(self.kind, &shape))
    }
}

/// Two files of one probe or layer, with its name.
struct Pair {
    name: String,
    times: Growing,
    others: Growing,
}

impl Pair {
    /// Appends so many rows, times and others.
    fn append(&mut self, times: &[u8], others: &[u8]) -> io::Result<u64> {
        self.times.append(times)?;
        self.others.append(others)?;
        Ok(times.len() as u64 / self.times.each)
    }
}

/// A folder of `.npy` files that grow with a run: everything that its probes record, under the names of
/// [`Recordings::to_npz`](super::Recordings::to_npz), with `.` for `/`.
///
/// [`take`](Self::take) moves the recordings from memory to the files, so memory holds only those since the last call. A file can
/// be read at any time, and after the program was killed: it then has the rows of the last call.
///
/// ```
/// use symbolt::prelude::*;
/// use symbolt::record::RecordingFiles;
///
/// let mut graph = GraphBuilder::new();
/// graph.add("one", Constant::scalar(1.0));
/// graph.probe_at::<Scalar>("one", ProbeSpec::default());
/// let mut sim = graph.start(&PopulationPlan::direct(), Seed::new(1))?;
/// # let folder = tempfile::tempdir()?;
/// # let folder = folder.path();
/// let mut files = RecordingFiles::create(folder, &sim)?;
/// for _ in 0..10 {
///     sim.run_for(SimDuration::from_millis(1_000))?;
///     files.take(&mut sim)?;
/// }
/// let values = std::fs::metadata(folder.join("one.out.values.npy"))?;
/// assert_eq!(values.len(), 128 + 4 * 10_000);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct RecordingFiles {
    /// Times and values of each probe.
    values: Vec<Pair>,
    /// Times and neurons of each recording of spikes.
    spikes: Vec<Pair>,
}

impl RecordingFiles {
    /// Creates the files of a run's probes in a folder. They are empty until [`take`](Self::take).
    ///
    /// # Errors
    /// If the folder does not exist, or already has such a file.
    pub fn create(folder: &Path, sim: &Simulator) -> io::Result<Self> {
        let recordings = sim.recordings();
        let pair = |name: &str, [time, other]: [&str; 2], kind, width| {
            let file = |what: &str, kind, width| {
                let file = format!("{}.{what}.npy", name.replace('/', "."));
                Growing::create(&folder.join(file), kind, width)
            };
            let (times, others) = (file(time, "<f8", None)?, file(other, kind, width)?);
            Ok(Pair { name: name.to_owned(), times, others })
        };
        let values = recordings
            .values()
            .map(|(name, samples)| pair(name, ["time_s", "values"], "<f4", Some(samples.width())));
        let spikes = recordings
            .spikes()
            .map(|(name, _)| pair(name, ["spike_time_s", "spike_neuron"], "<u4", None));
        Ok(Self {
            values: values.collect::<io::Result<_>>()?,
            spikes: spikes.collect::<io::Result<_>>()?,
        })
    }

    /// Moves everything that was recorded since the last call from the run to the files. Call it often enough that a probe
    /// that keeps the last samples has not dropped any.
    ///
    /// # Errors
    /// If a file cannot be written, or if the run has other probes than that of [`create`](Self::create). The recordings stay in
    /// memory then, and the next call writes them.
    pub fn take(&mut self, sim: &mut Simulator) -> io::Result<()> {
        let recordings = sim.recordings();
        let values = recordings.values().map(|(name, samples)| (name, Some(samples.width())));
        let spikes = recordings.spikes().map(|(name, _)| (name, None));
        let own = self.values.iter().chain(&self.spikes);
        if !values.chain(spikes).eq(own.map(|pair| (pair.name.as_str(), pair.others.width))) {
            return Err(io::Error::other("these files belong to a run with other probes"));
        }
        let mut added = Vec::new();
        for (pair, (_, samples)) in self.values.iter_mut().zip(recordings.values()) {
            let times: Vec<u8> =
                samples.iter().flat_map(|(time_s, _)| time_s.to_le_bytes()).collect();
            let rows = samples.iter().flat_map(|(_, row)| row);
            let rows: Vec<u8> = rows.flat_map(|value| value.to_le_bytes()).collect();
            added.push(pair.append(&times, &rows)?);
        }
        for (pair, (_, spikes)) in self.spikes.iter_mut().zip(recordings.spikes()) {
            let times: Vec<u8> =
                spikes.iter().flat_map(|(time_s, _)| time_s.to_le_bytes()).collect();
            let neurons = spikes.iter().flat_map(|(_, neuron)| (neuron as u32).to_le_bytes());
            added.push(pair.append(&times, &neurons.collect::<Vec<u8>>())?);
        }
        // All rows are written before any head counts them.
        for (pair, added) in self.values.iter_mut().chain(&mut self.spikes).zip(&added) {
            for file in [&mut pair.times, &mut pair.others] {
                file.note(file.rows + added)?;
            }
        }
        for (pair, added) in self.values.iter_mut().chain(&mut self.spikes).zip(&added) {
            pair.times.rows += added;
            pair.others.rows += added;
        }
        sim.clear_recordings();
        Ok(())
    }
}

impl std::fmt::Debug for RecordingFiles {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "RecordingFiles({} probes, {} layers)", self.values.len(), self.spikes.len())
    }
}
