//! Puts poses and signals of a log into the streams, as the rows of a table are.

use crate::robot::Pose;
use crate::task::error::InputFault;
use crate::task::import::csv::MOST_ROWS;
use crate::task::import::finish::fault;
use crate::task::import::mapping::TimeUnit;
use crate::task::import::streams::{Guess, Sample, Source, Streams};
use crate::task::recording::{FIT_NAME, unfit};

impl Streams {
    /// Notes a guess, once for all files that give the same.
    pub(super) fn suppose(&mut self, file: &str, what: &str, value: &str, reason: String) {
        let (what, value, file) = (what.into(), value.into(), file.into());
        self.note(Guess { what, value, reason, file });
    }

    /// Adds a source of poses in seconds.
    pub(super) fn source(&mut self, file: &str, frame: Option<Pose>) -> u32 {
        self.sources.push(Source {
            file: file.into(),
            length: self.mapping.length,
            time: Some(TimeUnit::Second),
            frame: frame.or(self.mapping.frame),
            row_of: None,
            extent: [f64::INFINITY, f64::NEG_INFINITY],
            times: Vec::new(),
            rows: 0,
        });
        self.sources.len() as u32 - 1
    }

    /// Returns the track of an object in a part. `field` is where its name stands.
    ///
    /// # Errors
    /// [`InputFault`] if the name is empty or too long.
    pub(super) fn named_track(
        &mut self,
        part: usize,
        id: &str,
        file: &str,
        field: &str,
    ) -> Result<usize, InputFault> {
        if let Some(problem) = unfit(id) {
            return Err(fault(file, field, format!("the name of an object: {problem}"), FIT_NAME));
        }
        Ok(self.track(part, id))
    }

    /// Adds a pose at a time in seconds.
    ///
    /// # Errors
    /// [`InputFault`] if there are too many.
    pub(super) fn push(
        &mut self,
        [part, track]: [usize; 2],
        source: u32,
        t: f64,
        pose: &Pose,
    ) -> Result<(), InputFault> {
        let own = &mut self.sources[source as usize];
        own.rows += 1;
        if own.rows > MOST_ROWS {
            return Err(fault(&own.file, "", "it has too many poses", "at most 20 million"));
        }
        for value in pose.position {
            own.extent = [own.extent[0].min(value), own.extent[1].max(value)];
        }
        let Pose { position, orientation } = *pose;
        self.parts[part].tracks[track].samples.push(Sample { t, position, orientation, source });
        Ok(())
    }
}
