//! `arrays.npz`: frames, module activity and spikes of the recorded episode, and the frames of others, in numpy's format.
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
//! | `episode_E_frames_t` | F | as `frames_t`, of another episode E, counted from 0; and so on for the other frames |

use std::collections::BTreeMap;

use ndarray::{Array, Array1, Array2, Dimension, Ix1, Ix2};
use serde_json::{Value, json};

use super::facts::{ModuleFacts, RunFacts};
use super::film::Film;
use super::trace::MAX_EPISODE_S;
use crate::files::npz::{NpzError, NpzReader, NpzWriter};
use crate::record::shell::base64;
use crate::robot::scene::SceneFrame;
use crate::task::TaskError;
use crate::task::execute::ActivityRecorder;

/// The arrays of a run.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Arrays {
    film: Film,
    /// Frames of other episodes, by their number.
    others: BTreeMap<usize, Film>,
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
pub(super) const ROUGHLY_S: f64 = 0.1;

/// Greatest number of values of all modules in the page, 1.3 characters each. Longer activity is thinned out.
const MAX_VALUES: usize = 900_000;
/// Greatest number of spikes in the page, roughly, 11 characters each.
const MAX_SPIKES: usize = 80_000;
/// Greatest number of numbers of all films in the page, 5.3 characters each.
const MAX_FILMED: usize = 420_000;

/// Reads an array of doubles.
pub(super) fn numbers(npz: &mut NpzReader<'_>, name: &str) -> Result<Array1<f64>, String> {
    let read = npz.read::<f64, Ix1>(name);
    read.map_err(|error| format!("{name} cannot be read ({error})"))
}

/// Reads an array of single or double precision as single precision.
pub(super) fn singles<D: Dimension>(
    npz: &mut NpzReader<'_>,
    name: &str,
) -> Result<Array<f32, D>, String> {
    let read = npz.read::<f32, D>(name).or_else(|error| {
        let double = npz.read::<f64, D>(name);
        double.map(|values| values.mapv(|v| v as f32)).map_err(|_| error)
    });
    read.map_err(|error| format!("{name} cannot be read ({error})"))
}

/// Maximum number of rows of a spike raster.
const MAX_ROWS: usize = 2_000;

/// Returns whether times are in ascending order and within the length of an episode.
pub(super) fn rising(times: &Array1<f64>) -> bool {
    times.iter().all(|t| (0.0..=MAX_EPISODE_S).contains(t))
        && times.iter().zip(times.iter().skip(1)).all(|(a, b)| a <= b)
}

fn fits(values: &Array2<f32>, names: &[String]) -> bool {
    values.ncols() == names.len() && values.iter().all(|v| v.is_finite())
}

impl Arrays {
    /// Copies the frames and the activity of an episode.
    pub fn of(frames: &[SceneFrame], activity: &ActivityRecorder) -> Self {
        let modules = activity.modules().iter().map(|module| {
            let columns = module.names.len();
            let rows = module.values.len() / columns.max(1);
            let value = |(row, column)| module.values[row * columns + column];
            (module.name.clone(), Array2::from_shape_fn((rows, columns), value))
        });
        Self {
            film: Film::of(frames),
            others: BTreeMap::new(),
            modules_t: activity.times_s().iter().copied().collect(),
            modules: modules.collect(),
            spikes_t: activity.spikes().iter().map(|s| s.0).collect(),
            spikes_row: activity.spikes().iter().map(|s| s.1).collect(),
            unread: Vec::new(),
        }
    }

    /// Adds the frames of another episode, whose number is counted from 0.
    pub fn with_episode(mut self, number: usize, frames: &[SceneFrame]) -> Self {
        self.others.insert(number, Film::of(frames));
        self
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
        self.film.pack(&mut npz, "")?;
        for (number, film) in &self.others {
            film.pack(&mut npz, &format!("episode_{number}_"))?;
        }
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
        match Film::read(&mut npz, "") {
            Ok(film) => arrays.film = film,
            Err(why) => odd.push(why),
        }
        for name in npz.names() {
            let other = name.strip_suffix("frames_t").filter(|prefix| !prefix.is_empty());
            let Some(prefix) = other else { continue };
            let number = prefix.strip_prefix("episode_").and_then(|p| p.strip_suffix('_'));
            let Some(number) = number.and_then(|n| n.parse().ok()) else { continue };
            match Film::read(&mut npz, prefix) {
                Ok(film) => drop(arrays.others.insert(number, film)),
                Err(why) => odd.push(why),
            }
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

    fn forget_activity(&mut self) {
        let Self { modules_t, modules, spikes_t, spikes_row, .. } = Self::default();
        (self.modules_t, self.modules) = (modules_t, modules);
        (self.spikes_t, self.spikes_row) = (spikes_t, spikes_row);
    }

    /// Keeps the frames only if they end when an episode of `simulated_s` seconds ends, and the activity unless it ends later,
    /// or earlier without frames that fit. The second value has a sentence on what was left out.
    pub fn lasting(mut self, simulated_s: f64) -> (Self, Vec<String>) {
        let mut odd = Vec::new();
        let mut fits = self.film.len() > 0;
        if let Err(why) = self.film.lasts(simulated_s) {
            odd.push(why);
            fits = false;
            self.film = Film::default();
        }
        let last = self.modules_t.last().copied().unwrap_or(simulated_s);
        let late = last - simulated_s;
        // The network of a problem that is compiled anew is not recorded, so the activity may end before the frames do.
        if late > ROUGHLY_S || (late < -ROUGHLY_S && !fits) {
            let than = format!("the recorded episode in trace.jsonl ends after {simulated_s:.2} s");
            odd.push(format!("its modules end after {last:.2} s, but {than}"));
            self.forget_activity();
        }
        (self, odd)
    }

    /// Keeps the frames, modules and spikes that fit `facts`. `parts` is the number of parts in the scene, `None` if
    /// unknown. The second value has a sentence on each array that was left out.
    pub fn fitting(mut self, facts: &RunFacts, parts: Option<usize>) -> (Self, Vec<String>) {
        let mut odd = Vec::new();
        if let Err(why) = self.film.check(parts) {
            odd.push(why);
            self.film = Film::default();
        }
        self.others.retain(|number, film| match film.check(parts) {
            Ok(()) => true,
            Err(why) => {
                odd.push(format!("episode {}: {why}", number + 1));
                false
            }
        });
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

    /// Takes the films out: that of the recorded episode first, then others as long as there is room in a page, the
    /// episodes in `first` before the rest.
    pub(super) fn take_films(&mut self, first: &[usize]) -> (Film, Vec<(usize, Film)>) {
        let film = std::mem::take(&mut self.film);
        let mut others: Vec<(usize, Film)> = std::mem::take(&mut self.others).into_iter().collect();
        others.sort_by_key(|(number, _)| (!first.contains(number), *number));
        let mut left = MAX_FILMED.saturating_sub(film.size());
        others.retain(|(_, film)| {
            let fits = film.size() <= left;
            left -= if fits { film.size() } else { 0 };
            fits
        });
        (film, others)
    }

    /// Returns the activity as the page reads it: times and spikes as base64 of little-endian single precision. A
    /// module's values are one byte each, in steps of 1/127 of the module's greatest absolute value (at least 1). Samples
    /// between two that are the same are left out.
    pub(super) fn into_page(self) -> Value {
        let bytes = |values: &Array2<f32>| {
            let most = values.iter().fold(1.0f32, |most, v| most.max(v.abs()));
            let steps = 127.0 / most;
            let byte = |v: &f32| ((v * steps).round().clamp(-127.0, 127.0) as i8).to_le_bytes()[0];
            (steps, values.iter().map(byte).collect::<Vec<u8>>())
        };
        let samples = self.modules_t.len();
        let modules: Vec<(String, usize, f32, Vec<u8>)> = (self.modules.into_iter())
            .map(|(name, values)| {
                let (steps, packed) = bytes(&values);
                (name, values.ncols(), steps, packed)
            })
            .collect();
        let same = |a: usize, b: usize| {
            modules.iter().all(|(_, columns, _, all)| {
                let row = |i: usize| &all[i * columns..(i + 1) * columns];
                row(a) == row(b)
            })
        };
        // Of samples that are alike, the first and the last are enough. On both sides of a gap there is a sample.
        let gap = |i: usize| {
            i > 0 && i < samples && self.modules_t[i] - self.modules_t[i - 1] > ROUGHLY_S
        };
        let beside = |i: usize| i == 0 || i + 1 == samples || gap(i) || gap(i + 1);
        let mut rows: Vec<usize> =
            (0..samples).filter(|i| beside(*i) || !same(i - 1, *i) || !same(*i, i + 1)).collect();
        let width: usize = modules.iter().map(|(_, columns, ..)| columns).sum();
        let step = (rows.len() * width).div_ceil(MAX_VALUES).max(1);
        rows = (rows.iter().enumerate())
            .filter(|(number, i)| number.is_multiple_of(step) || beside(**i))
            .map(|(_, i)| *i)
            .collect();
        let gaps: Vec<usize> = (0..rows.len()).filter(|number| gap(rows[*number])).collect();
        let modules: Vec<Value> = (modules.into_iter())
            .map(|(name, columns, steps, all)| {
                let values = rows.iter().flat_map(|i| &all[i * columns..(i + 1) * columns]);
                let values = base64(&values.copied().collect::<Vec<u8>>());
                json!({"name": name, "steps": steps, "values": values})
            })
            .collect();
        // Of very many spikes those of some rows are left.
        let every = (self.spikes_row.len().div_ceil(MAX_SPIKES).max(1)) as u32;
        let spikes = || {
            let all = self.spikes_t.iter().zip(&self.spikes_row);
            all.filter(move |(_, row)| row.is_multiple_of(every))
        };
        json!({
            "modules": {
                "t": packed(&mut rows.iter().map(|i| self.modules_t[*i] as f32)),
                "of": modules,
                "gaps": gaps,
            },
            "spikes": {
                "t": packed(&mut spikes().map(|(t, _)| *t as f32)),
                "row": packed(&mut spikes().map(|(_, row)| *row as f32)),
            },
        })
    }
}

/// Returns the indices of every `step`-th of `count` things, and of the last.
pub(super) fn kept(count: usize, step: usize) -> Vec<usize> {
    (0..count).filter(|i| i.is_multiple_of(step) || i + 1 == count).collect()
}

/// Returns numbers as the page reads them: base64 of little-endian single precision.
pub(super) fn packed(values: &mut dyn Iterator<Item = f32>) -> String {
    base64(&values.flat_map(f32::to_le_bytes).collect::<Vec<u8>>())
}
