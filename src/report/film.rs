//! The frames of one episode: arm, fingers and parts over simulated time, in `arrays.npz` and in the page.

use ndarray::{Array1, Array2, Array3};
use serde_json::{Value, json};

use super::arrays::{ROUGHLY_S, kept, numbers, packed, rising, singles};
use crate::files::npz::{NpzError, NpzReader, NpzWriter};
use crate::robot::Pose;
use crate::robot::scene::SceneFrame;

/// Greatest number of numbers of a film in the page, 5.3 characters each. A longer film is thinned out.
const MAX_NUMBERS: usize = 300_000;

/// The frames of one episode.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Film {
    t: Array1<f64>,
    angles: Array2<f32>,
    fingers: Array2<f32>,
    parts: Array3<f32>,
}

impl Film {
    /// Copies the frames of an episode.
    pub fn of(frames: &[SceneFrame]) -> Self {
        let parts = frames.first().map_or(0, |frame| frame.parts.len());
        let count = frames.len();
        let at = |frame: usize, part: usize, number: usize| {
            let Some(pose) = frames[frame].parts.get(part) else { return f32::NAN };
            pose.position.iter().chain(&pose.orientation).nth(number).map_or(0.0, |v| *v as f32)
        };
        Self {
            t: frames.iter().map(|f| f.t).collect(),
            angles: Array2::from_shape_fn((count, 7), |(f, i)| frames[f].angles[i] as f32),
            fingers: Array2::from_shape_fn((count, 2), |(f, i)| frames[f].fingers[i] as f32),
            parts: Array3::from_shape_fn((count, parts, 7), |(f, p, i)| at(f, p, i)),
        }
    }

    /// Adds the arrays to a file. Their names begin with `prefix`.
    pub fn pack(&self, npz: &mut NpzWriter, prefix: &str) -> Result<(), NpzError> {
        npz.add(&format!("{prefix}frames_t"), &self.t)?;
        npz.add(&format!("{prefix}frames_angles"), &self.angles)?;
        npz.add(&format!("{prefix}frames_fingers"), &self.fingers)?;
        npz.add(&format!("{prefix}frames_parts"), &self.parts)?;
        Ok(())
    }

    /// Reads the arrays whose names begin with `prefix`.
    ///
    /// # Errors
    /// A sentence on what cannot be read, or does not fit together.
    pub fn read(npz: &mut NpzReader<'_>, prefix: &str) -> Result<Self, String> {
        let film = Self {
            t: numbers(npz, &format!("{prefix}frames_t"))?,
            angles: singles(npz, &format!("{prefix}frames_angles"))?,
            fingers: singles(npz, &format!("{prefix}frames_fingers"))?,
            parts: singles(npz, &format!("{prefix}frames_parts"))?,
        };
        let Self { t, angles, fingers, parts } = &film;
        let lengths = [angles.nrows(), fingers.nrows(), parts.dim().0];
        let widths = (angles.ncols(), fingers.ncols(), parts.dim().2);
        if t.is_empty() {
            return Err(format!("{prefix}frames_t is empty"));
        }
        if lengths != [t.len(); 3] || widths != (7, 2, 7) {
            let problem = "differ in length or have a wrong shape";
            return Err(format!("the arrays of {prefix}frames {problem}"));
        }
        Ok(film)
    }

    /// Checks times and numbers, and the number of parts if it is known.
    ///
    /// # Errors
    /// A sentence on what is wrong.
    pub fn check(&self, parts: Option<usize>) -> Result<(), String> {
        if self.t.is_empty() {
            return Ok(());
        }
        if !rising(&self.t) {
            return Err("frames_t is not an ascending list of times in an episode".into());
        }
        let own = self.parts.dim().1;
        if let Some(parts) = parts.filter(|parts| *parts != own) {
            let scene = format!("but the scene of run.json has {parts}");
            return Err(format!("the frames have {own} parts, {scene}"));
        }
        let numbers = self.angles.iter().chain(&self.fingers).chain(&self.parts);
        if !numbers.copied().all(f32::is_finite) {
            return Err("the frames have values that are not finite".into());
        }
        Ok(())
    }

    /// Checks that the frames end when an episode of `simulated_s` seconds ends.
    ///
    /// # Errors
    /// A sentence on both moments.
    pub fn lasts(&self, simulated_s: f64) -> Result<(), String> {
        let last = self.t.last().copied().unwrap_or(simulated_s);
        if (last - simulated_s).abs() <= ROUGHLY_S {
            return Ok(());
        }
        let than = format!("the recorded episode in trace.jsonl ends after {simulated_s:.2} s");
        Err(format!("its frames end after {last:.2} s, but {than}"))
    }

    /// Returns the number of frames.
    pub fn len(&self) -> usize {
        self.t.len()
    }

    /// Returns the simulated time of a frame, in seconds.
    pub fn time_s(&self, frame: usize) -> f64 {
        self.t[frame]
    }

    /// Returns the pose of a part or movable fixture in a frame; `None` if there is no such part.
    pub fn pose(&self, frame: usize, part: usize) -> Option<Pose> {
        let at = |i: usize| self.parts.get((frame, part, i)).map(|v| f64::from(*v));
        Some(Pose {
            position: [at(0)?, at(1)?, at(2)?],
            orientation: [at(3)?, at(4)?, at(5)?, at(6)?],
        })
    }

    /// Returns the number of numbers in the page.
    pub fn size(&self) -> usize {
        (self.t.len() * self.width()).min(MAX_NUMBERS)
    }

    fn width(&self) -> usize {
        10 + 7 * self.parts.dim().1
    }

    /// Returns the frames as the page reads them: base64 of little-endian single precision.
    pub fn into_page(self) -> Value {
        let parts = self.parts.dim().1;
        let step = (self.t.len() * self.width()).div_ceil(MAX_NUMBERS).max(1);
        let frames = kept(self.t.len(), step);
        let of = |width: usize, value: &dyn Fn(usize, usize) -> f32| {
            let all = frames.iter().flat_map(|f| (0..width).map(|i| value(*f, i)));
            packed(&mut { all })
        };
        json!({
            "count": frames.len(),
            "parts": parts,
            "t": of(1, &|f, _| self.t[f] as f32),
            "angles": of(7, &|f, i| self.angles[(f, i)]),
            "fingers": of(2, &|f, i| self.fingers[(f, i)]),
            "poses": of(7 * parts, &|f, i| self.parts[(f, i / 7, i % 7)]),
        })
    }
}
