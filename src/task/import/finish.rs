//! Turns what was read into streams in seconds and metres, in the world's axes.

use std::collections::{BTreeMap, HashMap, HashSet};

use super::columns::kind_of;
use super::mapping::{Handed, Length, Mapping, TimeUnit, Up};
use super::sessions::{joined, scattered};
use super::streams::{Dropped, Guess, Part, Sample, Signal, Source, Streams, Track};
use crate::logs::fits;
use crate::robot::Pose;
use crate::task::error::InputFault;

/// The parts of one demonstration, one after the other.
#[derive(Debug, Clone, Default)]
pub struct Session {
    /// Name of the session.
    pub name: String,
    /// Its parts in order.
    pub parts: Vec<Part>,
}

/// Streams in seconds and metres, with z up.
#[derive(Debug, Clone)]
pub struct Log {
    /// The sessions in the order of the files.
    pub sessions: Vec<Session>,
    /// What was guessed.
    pub guesses: Vec<Guess>,
    /// What was left out.
    pub dropped: Vec<Dropped>,
    /// Columns that were not used, by file.
    pub unused: Vec<(String, Vec<String>)>,
    /// The mapping with what was guessed for all files.
    pub mapping: Mapping,
    /// Number of rows that were read.
    pub rows: u64,
}

/// Greatest coordinate of a recording, in metres.
const FARTHEST: f64 = 1e6;

/// A fault in a file without a line. `field` names the column, the topic or the dataset.
pub(super) fn fault(
    file: &str,
    field: &str,
    problem: impl Into<String>,
    expected: impl Into<String>,
) -> InputFault {
    let (file, field) = (file.into(), field.into());
    InputFault { file, line: None, field, problem: problem.into(), expected: expected.into() }
}

/// Axes of the world in axes of the log: rows of an orthogonal matrix, each a column and a sign.
#[derive(Clone, Copy)]
struct Axes {
    from: [usize; 3],
    sign: [f64; 3],
    /// 1, or -1 for a reflection.
    determinant: f64,
}

impl Axes {
    fn of(up: Up, handed: Handed) -> Self {
        let (from, mut sign) = match up {
            Up::Z => ([0, 1, 2], [1.0, 1.0, 1.0]),
            Up::MinusZ => ([0, 1, 2], [1.0, -1.0, -1.0]),
            Up::Y => ([0, 2, 1], [1.0, -1.0, 1.0]),
            Up::MinusY => ([0, 2, 1], [1.0, 1.0, -1.0]),
            Up::X => ([1, 2, 0], [1.0, 1.0, 1.0]),
            Up::MinusX => ([1, 2, 0], [-1.0, 1.0, -1.0]),
        };
        // The reflection keeps the vertical.
        let determinant = if handed == Handed::Left { -1.0 } else { 1.0 };
        sign[1] *= determinant;
        Self { from, sign, determinant }
    }

    fn vector(&self, v: [f64; 3]) -> [f64; 3] {
        [0, 1, 2].map(|axis| self.sign[axis] * v[self.from[axis]])
    }

    /// Returns the rotation in the new axes. A rotation vector is an axial vector, so a reflection turns it round.
    fn rotation(&self, [x, y, z, w]: [f64; 4]) -> [f64; 4] {
        let [x, y, z] = self.vector([x, y, z]).map(|v| v * self.determinant);
        [x, y, z, w]
    }
}

/// Returns the median of some numbers.
pub(super) fn median(values: &mut [f64]) -> Option<f64> {
    let middle = values.len().checked_sub(1)? / 2;
    let (_, value, _) = values.select_nth_unstable_by(middle, f64::total_cmp);
    Some(*value)
}

/// Turns times of the files of one part into seconds.
struct Clock<'a> {
    sources: &'a [Source],
    units: &'a [TimeUnit],
    /// Times of the rows of tables to which others refer, by the index of the file.
    rows: &'a [(u32, Vec<f64>)],
}

impl Clock<'_> {
    /// Returns a time of a file in seconds. In a table that refers to the rows of another, the time is a row's number.
    fn seconds(&self, t: f64, source: u32) -> Result<f64, InputFault> {
        let unit = |source: u32| self.units[source as usize].seconds();
        let own = &self.sources[source as usize];
        let Some(pattern) = &own.row_of else { return Ok(t * unit(source)) };
        let refused = |problem, expected| Err(fault(&own.file, "row_of", problem, expected));
        let fits = |(of, _): &&(u32, Vec<f64>)| fits(pattern, self.sources[*of as usize].short());
        let Some((of, times)) = self.rows.iter().find(fits) else {
            let problem = format!("its session has no table `{pattern}`");
            return refused(problem, "the table to whose rows it refers");
        };
        let row = (t >= 0.0 && t.fract() == 0.0).then(|| times.get(t as usize)).flatten();
        let Some(time) = row else {
            let file = self.sources[*of as usize].short();
            let problem = format!("a row is labelled {t}, and {file} has {} rows", times.len());
            return refused(problem, "the number of a row, from 0");
        };
        Ok(time * unit(*of))
    }
}

impl Streams {
    /// Applies units, axes and frames, guessing what the mapping does not say, and sorts the samples by time. Costs
    /// about n log n for the n samples of each object.
    ///
    /// # Errors
    /// [`InputFault`] if a unit cannot be told, if files disagree about it, if a row refers to no row, or if there are no
    /// poses.
    pub fn finish(mut self) -> Result<Log, InputFault> {
        if let (Some(name), None) = (&self.mapping.session, &self.session) {
            let file = self.sources.first().map_or("", |source| &source.file);
            let problem = "no table has such a column of the session".to_owned();
            let expected = "a column of a table; of bags and arrays, files and groups are sessions";
            return Err(fault(file, name, problem, expected));
        }
        self.mapping.session = self.session.take();
        let lengths = self.lengths()?;
        let times: Vec<TimeUnit> =
            (0..self.sources.len()).map(|index| self.time_unit(index)).collect();
        // The mapping says what is true of all tables; of the others it is guessed again.
        let clocks = self.sources.iter().zip(&times).filter(|(source, _)| source.row_of.is_none());
        if clocks.clone().any(|(source, _)| source.time.is_none()) {
            set_if_one(&mut self.mapping.time_unit, clocks.map(|(_, unit)| *unit));
        }
        set_if_one(&mut self.mapping.rotation, self.rotations.iter().copied());
        let up = self.mapping.up.unwrap_or(Up::Z);
        let handed = self.mapping.handed.unwrap_or(Handed::Right);
        let axes = Axes::of(up, handed);
        self.mapping.up.get_or_insert(up);
        self.mapping.handed.get_or_insert(handed);
        let rows = self.sources.iter().map(|source| source.rows).sum();
        let mut parts = joined(std::mem::take(&mut self.parts), |id| self.mapping.is_hand(id));
        for part in &mut parts {
            let row_times = std::mem::take(&mut part.row_times);
            let clock = Clock { sources: &self.sources, units: &times, rows: &row_times };
            for track in &mut part.tracks {
                for sample in &mut track.samples {
                    let source = &self.sources[sample.source as usize];
                    let unit = lengths[sample.source as usize].metres();
                    place(sample, unit, axes, source.frame.as_ref());
                    let beyond = |v: &&f64| v.is_nan() || v.abs() > FARTHEST;
                    if let Some(far) = sample.position.iter().find(beyond) {
                        let problem = format!("{} is at {far:e} m", track.id);
                        let expected = "coordinates of at most 1e6 m";
                        return Err(fault(&source.file, "", problem, expected));
                    }
                    sample.t = clock.seconds(sample.t, sample.source)?;
                }
            }
            for (signal, readings) in std::mem::take(&mut part.signals) {
                let placed: Vec<(f64, f64)> = (readings.iter())
                    .map(|r| Ok((clock.seconds(r.t, r.source)?, r.value)))
                    .collect::<Result<_, InputFault>>()?;
                let flags = || placed.iter().map(|(t, value)| (*t, *value > 0.5)).collect();
                match signal {
                    Signal::Width => part.width = placed,
                    Signal::Grasp => part.grasp = flags(),
                    Signal::Contact(object) => drop(part.contacts.insert(object, flags())),
                }
            }
        }
        let (mut parts, lost) = scattered(parts, |id| self.mapping.is_hand(id));
        if lost > 0 {
            let what = "value of a table without the session's column, at a time of no session or of several";
            self.dropped.push(Dropped { what: what.into(), count: lost });
        }
        let mut kinds = BTreeMap::new();
        for part in &mut parts {
            self.sort(part);
            self.name(part, &mut kinds);
        }
        let mut told = HashSet::new();
        for (id, kind) in kinds.iter().filter(|(id, kind)| id != kind) {
            if told.insert(kind) {
                self.guess("kinds", kind, format!("`{id}` without its number"));
            }
        }
        // A pattern could fit other ids.
        self.mapping.kinds.extend(kinds);
        if let Some(gap_s) = self.mapping.gap_s {
            parts = parts.into_iter().flat_map(|part| split(part, gap_s)).collect();
        }
        let seen = |part: &Part| part.tracks.iter().any(|track| !track.samples.is_empty());
        let mut empty = parts.iter().filter(|part| !seen(part));
        if let Some(first) = empty.next() {
            let what = format!("session in which no object has a pose, first `{}`", first.session);
            let count = 1 + empty.count() as u64;
            self.dropped.push(Dropped { what, count });
        }
        parts.retain(seen);
        if parts.is_empty() {
            let file = self.sources.first().map_or("", |source| &source.file);
            return Err(fault(file, "", "no object has a pose", "poses of objects"));
        }
        let mut sessions: Vec<Session> = Vec::new();
        let mut index: HashMap<String, usize> = HashMap::new();
        for part in parts {
            let at = *index.entry(part.session.clone()).or_insert(sessions.len());
            if at == sessions.len() {
                sessions.push(Session { name: part.session.clone(), parts: Vec::new() });
            }
            sessions[at].parts.push(part);
        }
        for session in &mut sessions {
            session.parts.sort_by(|a, b| natural(&a.part).cmp(&natural(&b.part)));
        }
        let Self { guesses, dropped, unused, mut mapping, found, .. } = self;
        found.write(&mut mapping);
        Ok(Log { sessions, guesses, dropped, unused, mapping, rows })
    }

    fn guess(&mut self, what: &str, value: &str, reason: String) {
        let (what, value) = (what.to_owned(), value.to_owned());
        self.guesses.push(Guess { what, value, reason, file: String::new() });
    }

    /// Returns the unit of positions of each file.
    fn lengths(&mut self) -> Result<Vec<Length>, InputFault> {
        let size = |source: &Source| source.extent[0].abs().max(source.extent[1].abs());
        let told = |source: &Source| match size(source) {
            size if size <= 10.0 => Some(Length::Metre),
            size if (100.0..=20_000.0).contains(&size) => Some(Length::Millimetre),
            _ => None,
        };
        let unknown: Vec<&Source> =
            self.sources.iter().filter(|s| s.length.is_none() && s.extent[0].is_finite()).collect();
        let mut decided: Option<(Length, &Source)> = None;
        for source in &unknown {
            let Some(length) = told(source) else { continue };
            match decided {
                Some((before, other)) if before != length => {
                    let problem = format!(
                        "its greatest coordinate is {}, that of {} is {}",
                        size(source),
                        other.file,
                        size(other)
                    );
                    let expected =
                        "one unit in all files, or `length` for each table in the mapping";
                    return Err(fault(&source.file, "", problem, expected));
                }
                Some(_) => {}
                None => decided = Some((length, source)),
            }
        }
        if decided.is_none()
            && let Some(source) = unknown.first()
        {
            let problem =
                format!("its greatest coordinate is {}, which tells no unit", size(source));
            let expected = "--length m, mm, cm or inch, or `length` in the mapping";
            return Err(fault(&source.file, "", problem, expected));
        }
        let size = decided.map(|(_, source)| size(source));
        let length = decided.map(|(length, _)| length);
        if let (Some(length), Some(size)) = (length, size) {
            let reason = format!("the greatest coordinate is {size:.3}");
            self.guess("length", length.name(), reason);
            // The mapping says what is true of all files.
            set_if_one(
                &mut self.mapping.length,
                std::iter::once(length).chain(self.sources.iter().filter_map(|s| s.length)),
            );
        }
        let own = |source: &Source| source.length.or(length).unwrap_or(Length::Metre);
        Ok(self.sources.iter().map(own).collect())
    }

    /// Returns the unit of time of a file.
    fn time_unit(&mut self, index: usize) -> TimeUnit {
        let source = &self.sources[index];
        if let Some(unit) = source.time {
            return unit;
        }
        let mut steps: Vec<f64> =
            source.times.windows(2).map(|t| t[1] - t[0]).filter(|step| *step > 0.0).collect();
        let Some(step) = median(&mut steps) else { return TimeUnit::Second };
        let whole = source.times.iter().all(|t| t.fract() == 0.0);
        let unit = match step {
            step if step < 5.0 || !whole && step < 60.0 => TimeUnit::Second,
            step if step < 5e3 => TimeUnit::Millisecond,
            step if step < 1e6 => TimeUnit::Microsecond,
            _ => TimeUnit::Nanosecond,
        };
        if source.row_of.is_none() {
            let reason = format!("the time between rows is {step:.4}");
            if !self.guesses.iter().any(|g| g.what == "time_unit" && g.value == unit.name()) {
                self.guess("time_unit", unit.name(), reason);
            }
        }
        unit
    }

    /// Sorts the samples of a part by time and leaves out those that repeat a time.
    fn sort(&mut self, part: &mut Part) {
        let mut repeated = 0;
        for track in &mut part.tracks {
            track.samples.sort_by(|a, b| a.t.total_cmp(&b.t));
            let before = track.samples.len();
            track.samples.dedup_by(|next, kept| next.t == kept.t);
            repeated += before - track.samples.len();
            // A quaternion and its negative are the same rotation.
            let mut last = [0.0; 4];
            for sample in track.samples.iter_mut().filter(|sample| sample.oriented()) {
                let q = sample.orientation;
                if q.iter().zip(last).map(|(a, b)| a * b).sum::<f64>() < 0.0 {
                    sample.orientation = q.map(|v| -v);
                }
                last = sample.orientation;
            }
        }
        part.width.sort_by(|a, b| a.0.total_cmp(&b.0));
        part.grasp.sort_by(|a, b| a.0.total_cmp(&b.0));
        part.contacts.values_mut().for_each(|flags| flags.sort_by(|a, b| a.0.total_cmp(&b.0)));
        for _ in 0..repeated {
            self.drop_one("pose that repeats a time of its object");
        }
    }

    /// Gives the objects of a part their kinds, and finds the hand. `guessed` are the kinds so far, by id.
    fn name(&mut self, part: &mut Part, guessed: &mut BTreeMap<String, String>) {
        for track in &mut part.tracks {
            let known = guessed.get(&*track.id).map(String::as_str);
            let given = known.or_else(|| self.mapping.kind(&track.id));
            let logged = part.kinds.get(&*track.id).map(String::as_str);
            if let Some(kind) = given.or(logged) {
                track.kind = kind.into();
                continue;
            }
            let kind = kind_of(&track.id).to_owned();
            track.kind = kind.as_str().into();
            guessed.insert(track.id.to_string(), kind);
        }
        if let Some(hand) = part.tracks.iter().position(|track| self.mapping.is_hand(&track.id)) {
            let hand = part.tracks.remove(hand);
            if self.mapping.hand.is_none() {
                self.guess("hand", &hand.id, "its name is that of a hand".into());
                self.mapping.hand = Some(hand.id.to_string());
            }
            part.hand = Some(hand);
        }
    }
}

/// Sets what is not set if all values are the same.
fn set_if_one<T: PartialEq>(to: &mut Option<T>, mut values: impl Iterator<Item = T>) {
    if to.is_none()
        && let Some(first) = values.next()
        && values.all(|value| value == first)
    {
        *to = Some(first);
    }
}

/// Returns a name without the number at its end, and that number, so that names sort by their numbers.
pub(super) fn natural(name: &str) -> (&str, u64) {
    let stem = name.trim_end_matches(|c: char| c.is_ascii_digit());
    (stem, name[stem.len()..].parse().unwrap_or(0))
}

fn place(sample: &mut Sample, unit_m: f64, axes: Axes, frame: Option<&Pose>) {
    sample.position = axes.vector(sample.position.map(|v| v * unit_m));
    if sample.oriented() {
        sample.orientation = axes.rotation(sample.orientation);
    }
    if let Some(frame) = frame {
        let own = Pose { position: sample.position, orientation: sample.orientation };
        Pose { position: sample.position, orientation: sample.orientation } = frame.after(&own);
    }
}

/// Splits a part into sessions where no stream has a sample for longer than `gap_s`.
fn split(part: Part, gap_s: f64) -> Vec<Part> {
    let mut times: Vec<f64> =
        part.tracks.iter().flat_map(|track| track.samples.iter().map(|s| s.t)).collect();
    times.sort_by(f64::total_cmp);
    let gaps = times.windows(2).filter(|t| t[1] - t[0] > gap_s);
    let mut cuts: Vec<f64> = gaps.map(|t| (t[0] + t[1]) / 2.0).collect();
    if cuts.is_empty() {
        return vec![part];
    }
    cuts.insert(0, f64::NEG_INFINITY);
    cuts.push(f64::INFINITY);
    let inside = |t: f64, cut: &[f64]| t > cut[0] && t <= cut[1];
    let cut_track = |track: &Track, cut: &[f64]| Track {
        samples: track.samples.iter().filter(|s| inside(s.t, cut)).copied().collect(),
        ..track.clone()
    };
    let flags = |flags: &[(f64, bool)], cut: &[f64]| -> Vec<(f64, bool)> {
        flags.iter().filter(|(t, _)| inside(*t, cut)).copied().collect()
    };
    let own = |(number, cut): (usize, &[f64])| Part {
        session: format!("{}-{}", part.session, number + 1),
        part: part.part.clone(),
        tracks: part.tracks.iter().map(|track| cut_track(track, cut)).collect(),
        hand: part.hand.as_ref().map(|hand| cut_track(hand, cut)),
        width: part.width.iter().filter(|(t, _)| inside(*t, cut)).copied().collect(),
        grasp: flags(&part.grasp, cut),
        contacts: part
            .contacts
            .iter()
            .map(|(id, f)| (id.clone(), flags(f, cut)))
            .collect::<BTreeMap<_, _>>(),
        ..Part::default()
    };
    cuts.windows(2).enumerate().map(own).collect()
}

#[cfg(test)]
mod tests {
    use nalgebra::{Quaternion, UnitQuaternion, Vector3};

    use super::*;
    use crate::robot::pose::quaternion_array;

    #[test]
    fn names_sort_by_the_numbers_at_their_ends() {
        let mut names = ["p10", "p2", "10", "9", "a"];
        names.sort_by_key(|name| natural(name));
        assert_eq!(names, ["9", "10", "a", "p2", "p10"]);
    }

    #[test]
    fn axes_turn_up_to_z_and_reflect_left_hands() {
        for up in Up::ALL.iter().copied() {
            for handed in Handed::ALL.iter().copied() {
                let axes = Axes::of(up, handed);
                let sign = if up.name().starts_with('-') { -1.0 } else { 1.0 };
                let mut above = [0.0; 3];
                above["xyz".find(up.name().trim_start_matches('-')).unwrap_or(9)] = sign;
                assert_eq!(axes.vector(above), [0.0, 0.0, 1.0], "{up:?} {handed:?}");
                let columns = [[1., 0., 0.], [0., 1., 0.], [0., 0., 1.]]
                    .map(|e| Vector3::from(axes.vector(e)));
                let determinant = columns[0].cross(&columns[1]).dot(&columns[2]);
                assert_eq!(determinant, axes.determinant, "{up:?} {handed:?}");
                // R' = B R B^T, whatever the axes.
                let turn = UnitQuaternion::from_scaled_axis(Vector3::new(0.3, -0.5, 0.9));
                let v = [0.2, 0.7, -0.4];
                let one = Vector3::from(axes.vector((turn * Vector3::from(v)).into()));
                let [x, y, z, w] = axes.rotation(quaternion_array(&turn));
                let own = UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z));
                let other = own * Vector3::from(axes.vector(v));
                assert!((one - other).norm() < 1e-12, "{up:?} {handed:?}");
            }
        }
    }
}
