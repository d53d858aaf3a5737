//! Recordings of long runs, written to disk in pieces so that memory stays bounded.

use std::fs::File;
use std::io::{self, BufWriter, Seek, SeekFrom, Write};
use std::path::Path;

use crate::sim::Simulator;

/// Length of the head of a file. Its blanks have room for any number of rows.
const HEAD: usize = 128;

/// A `.npy` file that grows by rows. Its head says how many are whole, so that it can be read while it grows, and if the
/// program is killed.
struct Growing {
    file: BufWriter<File>,
    /// Type of a number, such as `<f4`.
    kind: &'static str,
    /// Numbers of a row; `None` for a list of numbers.
    width: Option<usize>,
    rows: u64,
}

impl Growing {
    fn create(path: &Path, kind: &'static str, width: Option<usize>) -> io::Result<Self> {
        let file = BufWriter::new(File::create_new(path)?);
        let mut own = Self { file, kind, width, rows: 0 };
        own.note()?;
        Ok(own)
    }

    /// Writes the head, and returns to the end of the file.
    fn note(&mut self) -> io::Result<()> {
        self.file.flush()?;
        let shape = match self.width {
            Some(width) => format!("{:<20}, {width}", self.rows),
            None => format!("{:<20},", self.rows),
        };
        let kind = self.kind;
        let text = format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': ({shape}), }}");
        let mut head = b"\x93NUMPY\x01\x00".to_vec();
        head.extend(((HEAD - 10) as u16).to_le_bytes());
        head.extend(text.bytes());
        head.resize(HEAD - 1, b' ');
        head.push(b'\n');
        self.file.seek(SeekFrom::Start(0))?;
        self.file.write_all(&head)?;
        self.file.seek(SeekFrom::End(0))?;
        Ok(())
    }

    fn put(&mut self, row: impl IntoIterator<Item = [u8; 4]>) -> io::Result<()> {
        row.into_iter().try_for_each(|number| self.file.write_all(&number))?;
        self.rows += 1;
        Ok(())
    }

    fn put_time(&mut self, time_s: f64) -> io::Result<()> {
        self.file.write_all(&time_s.to_le_bytes())?;
        self.rows += 1;
        Ok(())
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
    values: Vec<[Growing; 2]>,
    /// Times and neurons of each recording of spikes.
    spikes: Vec<[Growing; 2]>,
}

impl RecordingFiles {
    /// Creates the files of a run's probes in a folder. They are empty until [`take`](Self::take).
    ///
    /// # Errors
    /// If the folder does not exist, or already has such a file.
    pub fn create(folder: &Path, sim: &Simulator) -> io::Result<Self> {
        let recordings = sim.recordings();
        let file = |name: &str, what: &str, kind, width| {
            let name = format!("{}.{what}.npy", name.replace('/', "."));
            Growing::create(&folder.join(name), kind, width)
        };
        let values = recordings.values().map(|(name, samples)| {
            let width = Some(samples.width());
            Ok([file(name, "time_s", "<f8", None)?, file(name, "values", "<f4", width)?])
        });
        let spikes = recordings.spikes().map(|(name, _)| {
            let times = file(name, "spike_time_s", "<f8", None)?;
            Ok([times, file(name, "spike_neuron", "<u4", None)?])
        });
        Ok(Self {
            values: values.collect::<io::Result<_>>()?,
            spikes: spikes.collect::<io::Result<_>>()?,
        })
    }

    /// Moves everything that was recorded since the last call from the run to the files. Call it often enough that a probe
    /// that keeps the last samples has not dropped any.
    ///
    /// # Errors
    /// If a file cannot be written, or if the run is of another graph. The recordings stay in memory then.
    pub fn take(&mut self, sim: &mut Simulator) -> io::Result<()> {
        let recordings = sim.recordings();
        let counts = (recordings.values().count(), recordings.spikes().count());
        if counts != (self.values.len(), self.spikes.len()) {
            return Err(io::Error::other("these files belong to a run with other probes"));
        }
        for ([times, rows], (_, samples)) in self.values.iter_mut().zip(recordings.values()) {
            for (time_s, row) in samples.iter() {
                rows.put(row.iter().map(|value| value.to_le_bytes()))?;
                times.put_time(time_s)?;
            }
        }
        for ([times, neurons], (_, spikes)) in self.spikes.iter_mut().zip(recordings.spikes()) {
            for (time_s, neuron) in spikes.iter() {
                neurons.put([(neuron as u32).to_le_bytes()])?;
                times.put_time(time_s)?;
            }
        }
        self.values.iter_mut().chain(&mut self.spikes).flatten().try_for_each(Growing::note)?;
        sim.clear_recordings();
        Ok(())
    }
}

impl std::fmt::Debug for RecordingFiles {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "RecordingFiles({} probes, {} layers)", self.values.len(), self.spikes.len())
    }
}
