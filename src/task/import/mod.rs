//! From logs to recordings: reads continuous streams of poses, finds the moments at which objects were grasped and
//! released, and takes snapshots there.
//!
//! ```
//! use symbolt::task::import::{Mapping, Streams};
//!
//! // A cup rests, is lifted onto a shelf in one second, and rests again.
//! let mut log = String::from("time,id,x,y,z\n");
//! for tick in 0..200 {
//!     let t = f64::from(tick) * 0.02;
//!     let lifted = (t - 1.5).clamp(0.0, 1.0) * 0.3;
//!     log += &format!("{t:.3},cup_0,0.5,0.1,{:.4}\n{t:.3},shelf_0,0.5,0.4,0.3\n", 0.02 + lifted);
//! }
//! let mut streams = Streams::new(Mapping::unknown());
//! streams.add_csv("kitchen.csv", log.as_bytes())?;
//! let imported = streams.finish()?.import();
//! let events: Vec<_> = imported.moments.iter().map(|m| (&*m.object, (m.t * 10.0).round() / 10.0)).collect();
//! assert_eq!(events, [("cup_0", 1.5), ("cup_0", 2.5)]);
//! assert_eq!(imported.recording.snapshot_count(), 4);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! [`Streams`] collects the rows of all files. [`Streams::finish`] applies units, axes and frames, and
//! [`Log::import`] finds the moments. What the [`Mapping`] does not say is guessed; each [`Guess`] has its reason.

mod carry;
mod columns;
mod csv;
mod finish;
mod found;
mod layout;
mod logs;
mod mapping;
mod moments;
mod motion;
mod orientation;
mod rows;
mod sessions;
mod signals;
mod streams;

pub use crate::logs::{DatasetMap, PoseDatasets, Take, TopicMap, fits};
pub use finish::{Log, Session};
pub use mapping::{
    Angle, FORMAT, Handed, Length, Mapping, PoseColumns, QuaternionOrder, Rotation, TableMap,
    TimeUnit, UnknownName, Up, VERSION,
};
pub use moments::{Imported, Moment, Seen};
pub use streams::{Dropped, Guess, Part, Sample, Streams, Track};
