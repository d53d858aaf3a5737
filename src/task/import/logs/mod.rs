//! Logs that are not tables of text, each told by its first bytes: messages of robots (MCAP) and arrays (HDF5).

#[cfg(feature = "mcap")]
mod feed;
#[cfg(feature = "hdf5")]
mod hdf5;
#[cfg(any(feature = "mcap", feature = "hdf5"))]
mod sink;

use super::finish::fault;
use super::streams::Streams;
use crate::task::error::InputFault;

/// First bytes of an MCAP log.
const MCAP: &[u8] = b"\x89MCAP0\r\n";
/// Bytes of an HDF5 log, at its beginning or behind a block of 512 bytes or a doubling of it.
const HDF5: &[u8] = b"\x89HDF\r\n\x1a\n";
/// Logs that are not read: first bytes, what it is, and what to do.
const OTHERS: [(&[u8], &str, &str); 3] = [
    (b"#ROSBAG V", "a bag of ROS 1", "an MCAP log, as `mcap convert` makes one"),
    (b"SQLite format 3\0", "a bag in SQLite", "an MCAP log, as `ros2 bag convert` makes one"),
    (b"PK\x03\x04", "an archive", "a CSV, MCAP or HDF5 log"),
];

fn is_hdf5(bytes: &[u8]) -> bool {
    let starts = std::iter::once(0).chain((9..24).map(|power| 1usize << power));
    starts.into_iter().any(|at| bytes.get(at..).is_some_and(|rest| rest.starts_with(HDF5)))
}

impl Streams {
    /// Adds the rows of a log, whose first bytes say what it is: MCAP or HDF5, or else a table of text, as in
    /// [`Streams::add_csv`]. `file` is its name in errors. MCAP and HDF5 need the features `mcap` and `hdf5`.
    ///
    /// # Errors
    /// [`InputFault`] with the place of the first fault, or if this build does not read such logs.
    pub fn add(&mut self, file: &str, bytes: &[u8]) -> Result<(), InputFault> {
        let unbuilt = |what: &str, feature: &str| {
            let expected = format!("a CSV log, or a build with `--features {feature}`");
            fault(file, "", format!("it is {what} log, which this build does not read"), expected)
        };
        if bytes.starts_with(MCAP) {
            #[cfg(feature = "mcap")]
            return self.add_mcap(file, bytes);
            #[cfg(not(feature = "mcap"))]
            return Err(unbuilt("an MCAP", "mcap"));
        }
        if is_hdf5(bytes) {
            #[cfg(feature = "hdf5")]
            return self.add_hdf5(file, bytes);
            #[cfg(not(feature = "hdf5"))]
            return Err(unbuilt("an HDF5", "hdf5"));
        }
        #[cfg(all(feature = "mcap", feature = "hdf5"))]
        let _ = unbuilt;
        let other = OTHERS.iter().find(|(start, ..)| bytes.starts_with(start));
        match other {
            Some((_, what, expected)) => {
                Err(fault(file, "", format!("it is {what}, which is not read"), *expected))
            }
            None => self.add_csv(file, bytes),
        }
    }
}
