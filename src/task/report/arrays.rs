//! `arrays.npz`: frames of the filmed episode, what the modules held, spikes; numpy opens it.
//!
//! | array | shape | what |
//! |---|---|---|
//! | `frames_t` | F | simulated seconds |
//! | `frames_angles` | F x 7 | joint angles, radians |
//! | `frames_fingers` | F x 2 | distance of each finger from the middle, metres |
//! | `frames_parts` | F x parts x 7 | position in metres, orientation `[x, y, z, w]`; nuts first |
//! | `modules_t` | S | simulated seconds |
//! | `module_NAME` | S x names | as `run.json` says of the module |
//! | `spikes_t` | N | simulated seconds |
//! | `spikes_row` | N | the neuron's row, counted over the populations of `run.json` |

use std::io::Cursor;

use ndarray::{Array1, Array2, Array3};
use ndarray_npy::{NpzReader, NpzWriter};
use serde_json::{Value, json};

use super::facts::{ModuleFacts, RunFacts};
use super::page::base64;
use crate::task::error::TaskError;
use crate::task::execute::Thoughts;
use crate::task::scene::SceneFrame;

/// The arrays of a run's filmed episode.
#[derive(Debug, Clone, PartialEq)]
pub struct Arrays {
    frames_t: Array1<f64>,
    angles: Array2<f32>,
    fingers: Array2<f32>,
    parts: Array3<f32>,
    modules_t: Array1<f64>,
    modules: Vec<(String, Array2<f32>)>,
    spikes_t: Array1<f64>,
    spikes_row: Array1<u32>,
}

const PREFIX: &str = "module_";

/// The most rows of a raster.
const MOST_ROWS: usize = 2_000;

/// Whether these are moments of an episode.
fn rising(times: &Array1<f64>) -> bool {
    times.iter().all(|t| (0.0..200_000.0).contains(t))
        && times.iter().zip(times.iter().skip(1)).all(|(a, b)| a <= b)
}

fn fits(values: &Array2<f32>, names: &[String]) -> bool {
    values.ncols() == names.len() && values.iter().all(|v| v.is_finite())
}

impl Arrays {
    /// Frames and thoughts of an episode. Costs a copy.
    pub fn of(frames: &[SceneFrame], thoughts: &Thoughts) -> Self {
        let parts = frames.first().map_or(0, |frame| frame.parts.len());
        let count = frames.len();
        let at = |frame: usize, part: usize, number: usize| {
            let Some(pose) = frames[frame].parts.get(part) else { return f32::NAN };
            pose.position.iter().chain(&pose.orientation).nth(number).map_or(0.0, |v| *v as f32)
        };
        let modules = thoughts.modules().iter().map(|module| {
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
            modules_t: thoughts.times_s().iter().copied().collect(),
            modules: modules.collect(),
            spikes_t: thoughts.spikes().iter().map(|s| s.0).collect(),
            spikes_row: thoughts.spikes().iter().map(|s| s.1).collect(),
        }
    }

    /// The bytes of the file.
    ///
    /// # Errors
    /// [`TaskError::Figure`] if they cannot be packed.
    pub fn to_npz(&self) -> Result<Vec<u8>, TaskError> {
        self.pack().map_err(|error| TaskError::Figure { reason: error.to_string() })
    }

    fn pack(&self) -> Result<Vec<u8>, ndarray_npy::WriteNpzError> {
        let mut bytes = Vec::new();
        let mut npz = NpzWriter::new_compressed(Cursor::new(&mut bytes));
        npz.add_array("frames_t", &self.frames_t)?;
        npz.add_array("frames_angles", &self.angles)?;
        npz.add_array("frames_fingers", &self.fingers)?;
        npz.add_array("frames_parts", &self.parts)?;
        npz.add_array("modules_t", &self.modules_t)?;
        for (name, values) in &self.modules {
            npz.add_array(format!("{PREFIX}{name}"), values)?;
        }
        npz.add_array("spikes_t", &self.spikes_t)?;
        npz.add_array("spikes_row", &self.spikes_row)?;
        npz.finish()?;
        Ok(bytes)
    }

    /// Reads the bytes of a file; a sentence on what is wrong with them if they are not such arrays.
    ///
    /// # Errors
    /// That sentence.
    pub fn from_npz(bytes: &[u8]) -> Result<Self, String> {
        let arrays = Self::unpack(bytes).map_err(|error| format!("it is damaged ({error})"))?;
        let frames = arrays.frames_t.len();
        let lengths = [arrays.angles.nrows(), arrays.fingers.nrows(), arrays.parts.dim().0];
        let widths = (arrays.angles.ncols(), arrays.fingers.ncols(), arrays.parts.dim().2);
        if lengths != [frames; 3] || widths != (7, 2, 7) {
            return Err("its arrays of frames do not belong together".into());
        }
        let samples = arrays.modules_t.len();
        if arrays.modules.iter().any(|(_, values)| values.nrows() != samples) {
            return Err("its arrays of modules do not belong together".into());
        }
        if arrays.spikes_t.len() != arrays.spikes_row.len() {
            return Err("its arrays of spikes do not belong together".into());
        }
        Ok(arrays)
    }

    fn unpack(bytes: &[u8]) -> Result<Self, ndarray_npy::ReadNpzError> {
        let mut npz = NpzReader::new(Cursor::new(bytes))?;
        let mut modules = Vec::new();
        for name in npz.names()? {
            if let Some(module) = name.strip_prefix(PREFIX) {
                modules.push((module.to_owned(), npz.by_name(&name)?));
            }
        }
        Ok(Self {
            frames_t: npz.by_name("frames_t")?,
            angles: npz.by_name("frames_angles")?,
            fingers: npz.by_name("frames_fingers")?,
            parts: npz.by_name("frames_parts")?,
            modules_t: npz.by_name("modules_t")?,
            modules,
            spikes_t: npz.by_name("spikes_t")?,
            spikes_row: npz.by_name("spikes_row")?,
        })
    }

    /// What of these can be the arrays of that run, and a sentence on each part that cannot.
    pub fn fitting(mut self, facts: &RunFacts) -> (Self, Vec<String>) {
        let mut odd = Vec::new();
        if let Err(why) = self.check_frames(facts) {
            odd.push(why);
            self.frames_t = Array1::default(0);
            self.angles = Array2::default((0, 7));
            self.fingers = Array2::default((0, 2));
            self.parts = Array3::default((0, 0, 7));
        }
        if !rising(&self.modules_t) {
            odd.push("its times of modules are not rising moments of an episode".into());
            self.modules_t = Array1::default(0);
            self.modules.clear();
        } else {
            let of = |name: &str| self.modules.iter().find(|(own, _)| own == name);
            for ModuleFacts { name, names, .. } in &facts.modules {
                odd.extend(match of(name) {
                    None => Some(format!("it has nothing of the module {name}")),
                    Some((_, values)) if !fits(values, names) => {
                        Some(format!("what it has of the module {name} is not what run.json says"))
                    }
                    Some(_) => None,
                });
            }
            let known = |name: &str| facts.modules.iter().find(|module| module.name == name);
            self.modules
                .retain(|(name, values)| known(name).is_some_and(|m| fits(values, &m.names)));
        }
        let rows: usize = facts.populations.iter().map(|p| p.rows).sum();
        let other = rows > MOST_ROWS || self.spikes_row.iter().any(|row| *row as usize >= rows);
        if other || !rising(&self.spikes_t) {
            odd.push(match other {
                true => "its spikes are not of the populations of run.json".into(),
                false => "its times of spikes are not rising moments of an episode".into(),
            });
            self.spikes_t = Array1::default(0);
            self.spikes_row = Array1::default(0);
        }
        (self, odd)
    }

    fn check_frames(&self, facts: &RunFacts) -> Result<(), String> {
        if self.frames_t.is_empty() {
            return Err("it has no frames".into());
        }
        if !rising(&self.frames_t) {
            return Err("its times of frames are not rising moments of an episode".into());
        }
        let parts = facts.scene.nuts + facts.scene.bolts;
        if self.parts.dim().1 != parts {
            return Err(format!("it has {} parts; run.json has {parts}", self.parts.dim().1));
        }
        let frames = self.angles.iter().chain(&self.fingers).chain(&self.parts);
        if !frames.copied().all(f32::is_finite) {
            return Err("its frames have numbers that are none".into());
        }
        Ok(())
    }

    /// What the page needs: numbers as base64 of little-endian single precision, modules' numbers as a byte each, in
    /// steps of a 127th of the module's greatest.
    pub(super) fn to_page(&self) -> Value {
        let singles = |values: &mut dyn Iterator<Item = f32>| -> String {
            base64(&values.flat_map(f32::to_le_bytes).collect::<Vec<u8>>())
        };
        let packed = |values: &Array2<f32>| {
            let most = values.iter().fold(1.0f32, |most, v| most.max(v.abs()));
            let steps = 127.0 / most;
            let byte = |v: &f32| ((v * steps).round().clamp(-127.0, 127.0) as i8).to_le_bytes()[0];
            (steps, base64(&values.iter().map(byte).collect::<Vec<u8>>()))
        };
        let modules: Vec<Value> = self
            .modules
            .iter()
            .map(|(name, values)| {
                let (steps, values) = packed(values);
                json!({"name": name, "steps": steps, "values": values})
            })
            .collect();
        json!({
            "frames": {
                "count": self.frames_t.len(),
                "parts": self.parts.dim().1,
                "t": singles(&mut self.frames_t.iter().map(|t| *t as f32)),
                "angles": singles(&mut self.angles.iter().copied()),
                "fingers": singles(&mut self.fingers.iter().copied()),
                "poses": singles(&mut self.parts.iter().copied()),
            },
            "modules": {
                "t": singles(&mut self.modules_t.iter().map(|t| *t as f32)),
                "of": modules,
            },
            "spikes": {
                "t": singles(&mut self.spikes_t.iter().map(|t| *t as f32)),
                "row": singles(&mut self.spikes_row.iter().map(|row| *row as f32)),
            },
        })
    }
}
