//! Recordings of long runs, written to disk in pieces so that memory stays bounded.

use std::fs::{File, OpenOptions};
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::Path;

use crate::files::npz::head;
use crate::sim::{Live, Real, Simulator};

/// Length of the head of a file, whatever the number of rows.
const HEAD: usize = 128;
/// Bytes of rows that a program computes itself before they are written.
const HELD: usize = 1 << 16;

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
        let file = OpenOptions::new().read(true).write(true).create_new(true).open(path)?;
        let mut own = Self { file, kind, width, each, rows: 0 };
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

    /// Keeps the first rows alone.
    fn shorten(&mut self, rows: u64) -> io::Result<()> {
        self.note(rows)?;
        self.rows = rows;
        self.file.set_len(HEAD as u64 + rows * self.each)
    }

    /// Reads a row of a file of times.
    fn time(&mut self, row: u64) -> io::Result<f64> {
        let mut number = [0; 8];
        self.file.seek(SeekFrom::Start(HEAD as u64 + row * self.each))?;
        self.file.read_exact(&mut number)?;
        Ok(f64::from_le_bytes(number))
    }
}

/// Two files of one probe or layer, with its name.
struct Pair {
    name: String,
    times: Growing,
    others: Growing,
}

impl Pair {
    /// Creates two files in a folder. The name of a file has `.` for `/`.
    fn create(
        folder: &Path,
        name: &str,
        [time, other]: [&str; 2],
        kind: &'static str,
        width: Option<usize>,
    ) -> io::Result<Self> {
        let file = |what: &str, kind, width| {
            let file = format!("{}.{what}.npy", name.replace('/', "."));
            Growing::create(&folder.join(file), kind, width)
        };
        let (times, others) = (file(time, "<f8", None)?, file(other, kind, width)?);
        Ok(Self { name: name.to_owned(), times, others })
    }

    /// Takes away the rows after a time.
    fn cut(&mut self, time_s: f64) -> io::Result<()> {
        let (mut low, mut high) = (0, self.times.rows);
        while low < high {
            let middle = low.midpoint(high);
            match self.times.time(middle)? > time_s {
                true => high = middle,
                false => low = middle + 1,
            }
        }
        self.times.shorten(low)?;
        self.others.shorten(low)
    }

    /// Appends so many rows, times and others.
    fn append(&mut self, times: &[u8], others: &[u8]) -> io::Result<u64> {
        self.times.append(times)?;
        self.others.append(others)?;
        Ok(times.len() as u64 / self.times.each)
    }
}

/// Makes rows that were appended to all pairs rows of their files.
fn note(pairs: &mut [&mut Pair], added: &[u64]) -> io::Result<()> {
    // All rows are written before any head counts them.
    for (pair, added) in pairs.iter_mut().zip(added) {
        for file in [&mut pair.times, &mut pair.others] {
            file.note(file.rows + added)?;
        }
    }
    for (pair, added) in pairs.iter_mut().zip(added) {
        pair.times.rows += added;
        pair.others.rows += added;
    }
    Ok(())
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
        let values = recordings.values().map(|(name, samples)| {
            Pair::create(folder, name, ["time_s", "values"], "<f4", Some(samples.width()))
        });
        let spikes = recordings.spikes().map(|(name, _)| {
            Pair::create(folder, name, ["spike_time_s", "spike_neuron"], "<u4", None)
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
    /// If a file cannot be written, or if the run has other probes than that of [`create`](Self::create). The recordings stay in
    /// memory then, and the next call writes them.
    pub fn take(&mut self, sim: &mut Simulator) -> io::Result<()> {
        self.write(sim)?;
        sim.clear_recordings();
        Ok(())
    }

    /// Moves the recordings of a live run to the files, as [`take`](Self::take) does. Call it before the run goes back, and
    /// [`cut`](Self::cut) afterwards.
    ///
    /// # Errors
    /// As [`take`](Self::take).
    pub fn take_live(&mut self, live: &mut Live) -> io::Result<()> {
        self.write(live.sim())?;
        live.clear_recordings();
        Ok(())
    }

    /// Takes away what was recorded after a time, in seconds: the run has gone back to it. What the run has recorded on its way there
    /// is in the files already, so delete it from memory: [`Live::clear_recordings`].
    ///
    /// # Errors
    /// If a file cannot be read or written.
    pub fn cut(&mut self, time_s: f64) -> io::Result<()> {
        self.values.iter_mut().chain(&mut self.spikes).try_for_each(|pair| pair.cut(time_s))
    }

    fn write(&mut self, sim: &Simulator) -> io::Result<()> {
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
        let mut all: Vec<&mut Pair> = self.values.iter_mut().chain(&mut self.spikes).collect();
        note(&mut all, &added)
    }
}

/// A folder of `.npy` files like those of [`RecordingFiles`], of numbers that a program computes after a tick. Each list of
/// numbers has a name and two files, `NAME.time_s.npy` and `NAME.values.npy`.
pub struct RowFiles {
    all: Vec<(Pair, usize)>,
    times: Vec<u8>,
    /// Rows that are not written yet, for each pair.
    held: Vec<Vec<u8>>,
    last_s: f64,
}

impl RowFiles {
    /// Creates the files of lists, each with its name and its number of numbers.
    ///
    /// # Errors
    /// If the folder does not exist, or already has such a file.
    pub fn create<'n>(
        folder: &Path,
        lists: impl IntoIterator<Item = (&'n str, usize)>,
    ) -> io::Result<Self> {
        let pair = |(name, width): (&str, usize)| {
            let pair = Pair::create(folder, name, ["time_s", "values"], "<f4", Some(width))?;
            Ok((pair, width))
        };
        let all: Vec<_> = lists.into_iter().map(pair).collect::<io::Result<_>>()?;
        let held = vec![Vec::new(); all.len()];
        Ok(Self { all, times: Vec::new(), held, last_s: f64::NEG_INFINITY })
    }

    /// Appends a row to each list: `rows` has the numbers of all lists, one behind the other. If the time is not after the last
    /// one, the run has gone back, and later rows are taken away. About 64 kB of a list wait in memory.
    ///
    /// # Errors
    /// If a file cannot be written.
    ///
    /// # Panics
    /// If `rows` has fewer numbers than the lists.
    pub fn push(&mut self, time_s: f64, rows: &[Real]) -> io::Result<()> {
        if time_s <= self.last_s {
            self.cut(time_s.next_down())?;
        }
        self.last_s = time_s;
        self.times.extend(time_s.to_le_bytes());
        let mut rows = rows;
        for ((_, width), held) in self.all.iter().zip(&mut self.held) {
            let (own, rest) = rows.split_at(*width);
            held.extend(own.iter().flat_map(|value| value.to_le_bytes()));
            rows = rest;
        }
        match self.held.iter().any(|held| held.len() >= HELD) || self.times.len() >= HELD {
            true => self.flush(),
            false => Ok(()),
        }
    }

    /// Takes away the rows after a time, in seconds.
    ///
    /// # Errors
    /// If a file cannot be read or written.
    pub fn cut(&mut self, time_s: f64) -> io::Result<()> {
        self.flush()?;
        self.last_s = self.last_s.min(time_s);
        self.all.iter_mut().try_for_each(|(pair, _)| pair.cut(time_s))
    }

    /// Writes all rows that wait. Until then a file ends with the rows before.
    ///
    /// # Errors
    /// If a file cannot be written. The rows wait for the next call then.
    pub fn flush(&mut self) -> io::Result<()> {
        let mut added = Vec::new();
        for ((pair, _), held) in self.all.iter_mut().zip(&self.held) {
            added.push(pair.append(&self.times, held)?);
        }
        let mut pairs: Vec<&mut Pair> = self.all.iter_mut().map(|(pair, _)| pair).collect();
        note(&mut pairs, &added)?;
        self.times.clear();
        self.held.iter_mut().for_each(Vec::clear);
        Ok(())
    }
}

impl std::fmt::Debug for RowFiles {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "RowFiles({} lists)", self.all.len())
    }
}

impl std::fmt::Debug for RecordingFiles {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "RecordingFiles({} probes, {} layers)", self.values.len(), self.spikes.len())
    }
}
