//! `arrays.npz`: frames, module activity and spikes of the recorded episode, in numpy's format.
//!
//! | array | shape | contents |
//! |---|---|---|
//! | `frames_t` | F | simulated time of each frame, in seconds |
//! | `frames_angles` | F x 7 | joint angles, in radians |
//! | `frames_fingers` | F x 2 | distance of each finger from the middle of the gripper, in metres |
//! | `frames_parts` | F x parts x 7 | position in metres and orientation `[x, y, z, w]` of each part, in the scene's order |
//! | `modules_t` | S | simulated time of each sample, in seconds |
//! | `module_NAME` | S x columns | activity of the module `NAME`; `run.json` names its columns |
//! | `spikes_t` | N | simulated time of each spike, in seconds |
//! | `spikes_row` | N | row of the neuron that fired, counted over the populations of `run.json` |

use ndarray::{Array, Array1, Array2, Array3, Dimension, Ix1, Ix2, Ix3};
use serde_json::{Value, json};

use super::facts::{ModuleFacts, RunFacts};
use super::page::base64;
use super::trace::MAX_EPISODE_S;
use crate::files::npz::{NpzError, NpzReader, NpzWriter};
use crate::robot::scene::SceneFrame;
use crate::task::TaskError;
use crate::task::execute::ActivityRecorder;

/// The arrays of a run's recorded episode.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Arrays {
    frames_t: Array1<f64>,
    angles: Array2<f32>,
    fingers: Array2<f32>,
    parts: Array3<f32>,
    modules_t: Array1<f64>,
    modules: Vec<(String, Array2<f32>)>,
    spikes_t: Array1<f64>,
    spikes_row: Array1<u32>,
    /// Names of the modules in the file that could not be read.
    unread: Vec<String>,
}

const PREFIX: &str = "module_";

/// Greatest distance of the last frame and the last module sample from the episode's end, in seconds. It is greater
/// than the interval between frames or samples.
const ROUGHLY_S: f64 = 0.1;

type Frames = (Array1<f64>, Array2<f32>, Array2<f32>, Array3<f32>);

/// Reads an array of doubles.
fn numbers(npz: &mut NpzReader<'_>, name: &str) -> Result<Array1<f64>, String> {
    let read = npz.read::<f64, Ix1>(name);
    read.map_err(|error| format!("{name} cannot be read ({error})"))
}

/// Reads an array of single or double precision as single precision.
fn singles<D: Dimension>(npz: &mut NpzReader<'_>, name: &str) -> Result<Array<f32, D>, String> {
    let read = npz.read::<f32, D>(name).or_else(|error| {
        let double = npz.read::<f64, D>(name);
        double.map(|values| values.mapv(|v| v as f32)).map_err(|_| error)
    });
    read.map_err(|error| format!("{name} cannot be read ({error})"))
}

/// Maximum number of rows of a spike raster.
const MAX_ROWS: usize = 2_000;

/// Returns whether times are in ascending order and within the length of an episode.
fn rising(times: &Array1<f64>) -> bool {
    times.iter().all(|t| (0.0..=MAX_EPISODE_S).contains(t))
        && times.iter().zip(times.iter().skip(1)).all(|(a, b)| a <= b)
}

fn fits(values: &Array2<f32>, names: &[String]) -> bool {
    values.ncols() == names.len() && values.iter().all(|v| v.is_finite())
}

impl Arrays {
    /// Copies the frames and the activity of an episode.
    pub fn of(frames: &[SceneFrame], activity: &ActivityRecorder) -> Self {
        let parts = frames.first().map_or(0, |frame| frame.parts.len());
        let count = frames.len();
        let at = |frame: usize, part: usize, number: usize| {
            let Some(pose) = frames[frame].parts.get(part) else { return f32::NAN };
            pose.position.iter().chain(&pose.orientation).nth(number).map_or(0.0, |v| *v as f32)
        };
        let modules = activity.modules().iter().map(|module| {
            let columns = module.names.len();
            let rows = module.values.len() / columns.max(1);
            let value = |(row, column)| module.values[row * columns + column];
            (module.name.clone(), Array2::from_shape_fn((rows, columns), value))
        });
        Self {
            frames_t: frames.iter().map(|f| f.t).collect(),
            angles: Array2::from_shape_fn((count, 7), |(f, i)| frames[f].angles[i] as f32),
            fingers: Array2::from_shape_fn((count, 2), |(f, i)| frames[f].fingers[i] as f32),
            parts: Array3::from_shape_fn((count, parts, 7), |(f, p, i)| at(f, p, i)),
            modules_t: activity.times_s().iter().copied().collect(),
            modules: modules.collect(),
            spikes_t: activity.spikes().iter().map(|s| s.0).collect(),
            spikes_row: activity.spikes().iter().map(|s| s.1).collect(),
            unread: Vec::new(),
        }
    }

    /// Packs the arrays into the bytes of a file.
    ///
    /// # Errors
    /// [`TaskError::Figure`] if packing fails.
    pub fn to_npz(&self) -> Result<Vec<u8>, TaskError> {
        self.pack().map_err(|error| TaskError::Figure { reason: error.to_string() })
    }

    fn pack(&self) -> Result<Vec<u8>, NpzError> {
        let mut npz = NpzWriter::new();
        npz.add("frames_t", &self.frames_t)?;
        npz.add("frames_angles", &self.angles)?;
        npz.add("frames_fingers", &self.fingers)?;
        npz.add("frames_parts", &self.parts)?;
        npz.add("modules_t", &self.modules_t)?;
        for (name, values) in &self.modules {
            npz.add(&format!("{PREFIX}{name}"), values)?;
        }
        npz.add("spikes_t", &self.spikes_t)?;
        npz.add("spikes_row", &self.spikes_row)?;
        npz.finish()
    }

    /// Reads the bytes of a file. Frames, modules or spikes that cannot be read are left out; the second value has a
    /// sentence on each of them. Numbers may be of single or double precision.
    ///
    /// # Errors
    /// A sentence on the reason if the bytes are not a file of arrays.
    pub fn from_npz(bytes: &[u8]) -> Result<(Self, Vec<String>), String> {
        let mut npz = NpzReader::new(bytes).map_err(|error| error.to_string())?;
        let (mut arrays, mut odd) = (Self::default(), Vec::new());
        match Self::read_frames(&mut npz) {
            Ok(frames) => {
                (arrays.frames_t, arrays.angles, arrays.fingers, arrays.parts) = frames;
            }
            Err(why) => odd.push(why),
        }
        match numbers(&mut npz, "modules_t") {
            Ok(times) => arrays.modules_t = times,
            Err(why) => odd.push(why),
        }
        for name in npz.names() {
            let Some(module) = name.strip_prefix(PREFIX) else { continue };
            let samples = arrays.modules_t.len();
            let values = singles::<Ix2>(&mut npz, &name).and_then(|values| match values.nrows() {
                rows if rows == samples => Ok(values),
                rows => Err(format!("{name} has {rows} rows, but modules_t has {samples}")),
            });
            match values {
                Ok(values) => arrays.modules.push((module.to_owned(), values)),
                Err(why) => {
                    arrays.unread.push(module.to_owned());
                    // Without times no module can be read, and that was reported above.
                    odd.extend((samples > 0).then_some(why));
                }
            }
        }
        let rows = npz.read::<u32, Ix1>("spikes_row");
        let rows = rows.map_err(|error| format!("spikes_row cannot be read ({error})"));
        match numbers(&mut npz, "spikes_t").and_then(|times| rows.map(|rows| (times, rows))) {
            Ok((times, rows)) if times.len() == rows.len() => {
                (arrays.spikes_t, arrays.spikes_row) = (times, rows);
            }
            Ok(_) => odd.push("spikes_t and spikes_row differ in length".into()),
            Err(why) => odd.push(why),
        }
        Ok((arrays, odd))
    }

    fn read_frames(npz: &mut NpzReader<'_>) -> Result<Frames, String> {
        let frames = (
            numbers(npz, "frames_t")?,
            singles::<Ix2>(npz, "frames_angles")?,
            singles::<Ix2>(npz, "frames_fingers")?,
            singles::<Ix3>(npz, "frames_parts")?,
        );
        let (times, angles, fingers, parts) = &frames;
        let lengths = [angles.nrows(), fingers.nrows(), parts.dim().0];
        let widths = (angles.ncols(), fingers.ncols(), parts.dim().2);
        if times.is_empty() {
            return Err("frames_t is empty".into());
        }
        if lengths != [times.len(); 3] || widths != (7, 2, 7) {
            return Err("the arrays of frames differ in length or have a wrong shape".into());
        }
        Ok(frames)
    }

    fn forget_frames(&mut self) {
        let Self { frames_t, angles, fingers, parts, .. } = Self::default();
        (self.frames_t, self.angles, self.fingers, self.parts) = (frames_t, angles, fingers, parts);
    }

    fn forget_activity(&mut self) {
        let Self { modules_t, modules, spikes_t, spikes_row, .. } = Self::default();
        (self.modules_t, self.modules) = (modules_t, modules);
        (self.spikes_t, self.spikes_row) = (spikes_t, spikes_row);
    }

    /// Keeps the frames and the activity only if they end when an episode of `simulated_s` seconds ends. The second
    /// value has a sentence on what was left out.
    pub fn lasting(mut self, simulated_s: f64) -> (Self, Vec<String>) {
        let mut odd = Vec::new();
        let mut other = |what: &str, times: &Array1<f64>| {
            let last = times.last().copied().unwrap_or(simulated_s);
            let differs = (last - simulated_s).abs() > ROUGHLY_S;
            if differs {
                let than =
                    format!("the recorded episode in trace.jsonl ends after {simulated_s:.2} s");
                odd.push(format!("its {what} end after {last:.2} s, but {than}"));
            }
            differs
        };
        let [frames, activity] =
            [other("frames", &self.frames_t), other("modules", &self.modules_t)];
        if frames {
            self.forget_frames();
        }
        if activity {
            self.forget_activity();
        }
        (self, odd)
    }

    /// Keeps the frames, modules and spikes that fit `facts`. `parts` is the number of parts in the scene, `None` if
    /// unknown. The second value has a sentence on each array that was left out.
    pub fn fitting(mut self, facts: &RunFacts, parts: Option<usize>) -> (Self, Vec<String>) {
        let mut odd = Vec::new();
        if let Err(why) = self.check_frames(parts) {
            odd.push(why);
            self.forget_frames();
        }
        if !rising(&self.modules_t) {
            odd.push("modules_t is not an ascending list of times in an episode".into());
            (self.modules_t, self.modules) = Default::default();
        } else {
            let of = |name: &str| self.modules.iter().find(|(own, _)| own == name);
            for ModuleFacts { name, names, .. } in &facts.modules {
                odd.extend(match of(name) {
                    None if self.unread.contains(name) => None,
                    None => Some(format!("the module {name} is missing")),
                    Some((_, values)) if !fits(values, names) => {
                        let columns =
                            "other columns than run.json lists, or values that are not finite";
                        Some(format!("the module {name} has {columns}"))
                    }
                    Some(_) => None,
                });
            }
            let known = |name: &str| facts.modules.iter().find(|module| module.name == name);
            self.modules
                .retain(|(name, values)| known(name).is_some_and(|m| fits(values, &m.names)));
        }
        let rows = facts.populations.iter().fold(0usize, |all, p| all.saturating_add(p.rows));
        let other = rows > MAX_ROWS || self.spikes_row.iter().any(|row| *row as usize >= rows);
        if other || !rising(&self.spikes_t) {
            odd.push(match other {
                true => "the spikes do not fit the populations in run.json".into(),
                false => "spikes_t is not an ascending list of times in an episode".into(),
            });
            (self.spikes_t, self.spikes_row) = Default::default();
        }
        (self, odd)
    }

    fn check_frames(&self, parts: Option<usize>) -> Result<(), String> {
        if self.frames_t.is_empty() {
            return Ok(());
        }
        if !rising(&self.frames_t) {
            return Err("frames_t is not an ascending list of times in an episode".into());
        }
        let own = self.parts.dim().1;
        if let Some(parts) = parts.filter(|parts| *parts != own) {
            return Err(format!(
                "the frames have {own} parts, but the scene of run.json has {parts}"
            ));
        }
        let frames = self.angles.iter().chain(&self.fingers).chain(&self.parts);
        if !frames.copied().all(f32::is_finite) {
            return Err("the frames have values that are not finite".into());
        }
        Ok(())
    }

    /// Returns the arrays as the page reads them: base64 of little-endian single precision. A module's values are one
    /// byte each, in steps of 1/127 of the module's greatest absolute value (at least 1).
    pub(super) fn into_page(self) -> Value {
        let singles = |values: &mut dyn Iterator<Item = f32>| -> String {
            base64(&values.flat_map(f32::to_le_bytes).collect::<Vec<u8>>())
        };
        let packed = |values: &Array2<f32>| {
            let most = values.iter().fold(1.0f32, |most, v| most.max(v.abs()));
            let steps = 127.0 / most;
            let byte = |v: &f32| ((v * steps).round().clamp(-127.0, 127.0) as i8).to_le_bytes()[0];
            (steps, base64(&values.iter().map(byte).collect::<Vec<u8>>()))
        };
        // Each array is dropped when its text is done, because both together could fill the memory.
        let modules: Vec<Value> = (self.modules.into_iter())
            .map(|(name, values)| {
                let (steps, values) = packed(&values);
                json!({"name": name, "steps": steps, "values": values})
            })
            .collect();
        let (frames, parts) = (self.frames_t.len(), self.parts.dim().1);
        json!({
            "frames": {
                "count": frames,
                "parts": parts,
                "t": singles(&mut self.frames_t.into_iter().map(|t| t as f32)),
                "angles": singles(&mut self.angles.into_iter()),
                "fingers": singles(&mut self.fingers.into_iter()),
                "poses": singles(&mut self.parts.into_iter()),
            },
            "modules": {
                "t": singles(&mut self.modules_t.into_iter().map(|t| t as f32)),
                "of": modules,
            },
            "spikes": {
                "t": singles(&mut self.spikes_t.into_iter().map(|t| t as f32)),
                "row": singles(&mut self.spikes_row.into_iter().map(|row| row as f32)),
            },
        })
    }
}
