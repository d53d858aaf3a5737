//! Reads HDF5 logs: poses over time in datasets that the mapping names, or that their names and shapes tell.

use std::collections::{BTreeMap, BTreeSet};

use hdf5_pure::{DType, File, Group};

use crate::logs::arrays::{Flat, Form, Layout, guess, is_session, sessions};
use crate::logs::{DatasetMap, PoseDatasets, UNSEEN, fits, words};
use crate::robot::Pose;
use crate::sim::{few, meant, nearest_first};
use crate::task::error::InputFault;
use crate::task::import::columns::{Field, recognise};
use crate::task::import::csv::angle_of;
use crate::task::import::finish::{fault, natural};
use crate::task::import::found::say;
use crate::task::import::mapping::{Angle, QuaternionOrder, Rotation};
use crate::task::import::orientation::orientation;
use crate::task::import::streams::{Reading, Signal, Streams};

/// Greatest number of groups and datasets, and of groups in groups.
const MOST_ENTRIES: usize = 100_000;
const DEEPEST: usize = 16;
/// Greatest number of numbers that are read from a file.
const MOST_NUMBERS: u64 = 100_000_000;
/// Numbers for each byte of a file that compression can explain.
const DENSEST: u64 = 200;
/// Number of times from which their unit is guessed.
const LOOK: usize = 1_000;

/// A log while it is read.
struct Arrays<'a> {
    file: &'a str,
    hdf5: File,
    /// The shapes of the datasets, by path.
    shapes: BTreeMap<String, Vec<u64>>,
    /// Numbers that may still be read.
    left: u64,
    /// The unit of angles that was guessed, and the dataset that tells it.
    angle: Option<(Angle, String)>,
}

/// A session: the group in which its datasets are, and its name.
struct Place {
    group: String,
    name: String,
}

impl Streams {
    /// Adds the datasets of an HDF5 log.
    ///
    /// # Errors
    /// [`InputFault`] with the dataset and the row of the first fault.
    pub(super) fn add_hdf5(&mut self, file: &str, bytes: &[u8]) -> Result<(), InputFault> {
        let broken = |error: hdf5_pure::Error| {
            let problem = format!("it cannot be read: {}", words(&error));
            fault(file, "", problem, "a whole HDF5 log, without soft links")
        };
        let hdf5 = File::from_bytes(bytes.to_vec()).map_err(broken)?;
        let mut shapes = BTreeMap::new();
        let mut entries = 0;
        walk(&hdf5.root(), "", 0, &mut entries, &mut shapes).map_err(broken)?;
        if entries > MOST_ENTRIES {
            let problem = "it has too many groups and datasets".to_owned();
            return Err(fault(file, "", problem, "at most 100,000"));
        }
        let left = MOST_NUMBERS.min((bytes.len() as u64).saturating_mul(DENSEST));
        let mut arrays = Arrays { file, hdf5, shapes, left, angle: None };
        let name = file.rsplit('/').next().unwrap_or(file);
        let of_file = |map: &&DatasetMap| map.files.is_empty() || fits(&map.files, name);
        let mut maps: Vec<DatasetMap> =
            self.mapping.datasets.iter().filter(of_file).cloned().collect();
        if maps.is_empty() {
            let found = arrays.guessed(self)?;
            say(&mut self.found.datasets, found.clone(), name);
            maps.push(found);
        }
        let mut used = BTreeSet::new();
        let mut sessions = 0;
        for map in &maps {
            for place in arrays.places(&map.group) {
                arrays.session(self, map, &place, &mut used)?;
                sessions += 1;
            }
        }
        if sessions == 0 {
            let group = maps.first().map_or("", |map| &map.group);
            let groups: BTreeSet<&str> =
                arrays.shapes.keys().filter_map(|path| Some(path.rsplit_once('/')?.0)).collect();
            let expected = format!("a pattern of groups, such as {}", nearest_first(group, groups));
            return Err(fault(file, group, "no group fits", expected));
        }
        arrays.tell_unused(self, &used);
        Ok(())
    }
}

/// Notes the shapes of all datasets in a group.
fn walk(
    group: &Group,
    path: &str,
    depth: usize,
    entries: &mut usize,
    shapes: &mut BTreeMap<String, Vec<u64>>,
) -> Result<(), hdf5_pure::Error> {
    let inside = |name: &str| match path {
        "" => name.to_owned(),
        path => format!("{path}/{name}"),
    };
    for (name, dataset) in group.iter_datasets()? {
        *entries += 1;
        if *entries > MOST_ENTRIES {
            return Ok(());
        }
        shapes.insert(inside(&name), dataset.shape()?);
    }
    if depth < DEEPEST {
        for (name, own) in group.iter_groups()? {
            *entries += 1;
            if *entries > MOST_ENTRIES {
                return Ok(());
            }
            walk(&own, &inside(&name), depth + 1, entries, shapes)?;
        }
    }
    Ok(())
}

/// Returns what a dataset with one number for each row holds, as a column of its name would.
fn flat(name: &str) -> Option<Flat> {
    match recognise(name)?.field {
        Field::Time => Some(Flat::Time),
        Field::Width => Some(Flat::Width),
        Field::Grasp => Some(Flat::Grasp),
        _ => None,
    }
}

impl Arrays<'_> {
    /// Returns the sessions whose groups fit a pattern, by the numbers in their names.
    fn places(&self, pattern: &str) -> Vec<Place> {
        if pattern.is_empty() {
            return vec![Place { group: String::new(), name: String::new() }];
        }
        let pattern = pattern.trim_matches('/');
        let depth = pattern.matches('/').count();
        let own = |path: &String| {
            let ends = path.match_indices('/').map(|(at, _)| at).nth(depth);
            let group = &path[..ends?];
            fits(pattern, group).then(|| group.to_owned())
        };
        let mut groups: Vec<String> = self.shapes.keys().filter_map(own).collect();
        groups.dedup();
        groups.sort_by(|a, b| natural(a).cmp(&natural(b)));
        groups.dedup();
        let place = |group: String| {
            let name = group.rsplit('/').next().unwrap_or_default().to_owned();
            Place { group, name }
        };
        groups.into_iter().map(place).collect()
    }

    /// Finds what the datasets hold by their names and shapes.
    fn guessed(&self, into: &mut Streams) -> Result<DatasetMap, InputFault> {
        let group = sessions(self.shapes.keys());
        let mut map = DatasetMap { group: group.clone(), ..DatasetMap::default() };
        for place in self.places(&group) {
            let prefix = if place.group.is_empty() { String::new() } else { place.group + "/" };
            let own = self
                .shapes
                .iter()
                .filter_map(|(path, shape)| Some((path.strip_prefix(&prefix)?, shape.as_slice())));
            let own: BTreeMap<&str, &[u64]> =
                own.filter(|(path, _)| !into.mapping.ignores(path)).collect();
            guess(&own, &mut map, flat);
        }
        if map.objects.is_empty() {
            let known = few(self.shapes.iter().map(|(path, s)| format!("{path} {s:?}")));
            let problem = format!("no positions are recognised among {known}");
            let expected =
                "datasets such as obs/cup_pos of times × 3, or `datasets` in the mapping";
            return Err(fault(self.file, "", problem, expected));
        }
        if !group.is_empty() {
            let reason = "its groups have numbers".to_owned();
            into.suppose(self.file, "sessions", &group, reason);
        }
        for (id, own) in &map.objects {
            let turn = own.rotation.as_ref().map_or(String::new(), |r| format!(" and {r}"));
            let reason = "of the name and the shape of the dataset".to_owned();
            into.suppose(
                self.file,
                &format!("object {id}"),
                &format!("{}{turn}", own.position),
                reason,
            );
        }
        for (what, dataset) in [("time", &map.time), ("width", &map.width), ("grasp", &map.grasp)] {
            if let Some(dataset) = dataset {
                let reason = "of the name of the dataset".to_owned();
                into.suppose(self.file, what, dataset, reason);
            }
        }
        Ok(map)
    }

    /// Reads a dataset of a session whose rows are as many as those of `like`.
    fn read(
        &mut self,
        path: &str,
        rows: Option<(u64, &str)>,
    ) -> Result<(Vec<u64>, Vec<f64>), InputFault> {
        let refuse = |problem: String, expected: &str| fault(self.file, path, problem, expected);
        let Some(shape) = self.shapes.get(path).cloned() else {
            let known = || self.shapes.keys().map(String::as_str);
            let expected =
                format!("one of: {}{}", nearest_first(path, known()), meant(path, known()));
            return Err(refuse("there is no such dataset".into(), &expected));
        };
        if let (Some((rows, other)), Some(own)) = (rows, shape.first())
            && rows != *own
        {
            let problem = format!("it has {own} rows, and `{other}` has {rows}");
            return Err(refuse(problem, "as many rows in all datasets of a session"));
        }
        let count = shape.iter().try_fold(1u64, |product, size| product.checked_mul(*size));
        let Some(left) = count.and_then(|count| self.left.checked_sub(count)) else {
            let problem = format!("its shape is {shape:?}, and the file has not so many numbers");
            return Err(refuse(
                problem,
                "at most 100 million numbers, and 200 for each byte of the file",
            ));
        };
        let broken = |error: hdf5_pure::Error| {
            refuse(format!("it cannot be read: {}", words(&error)), "numbers, in whole chunks")
        };
        let dataset = self.hdf5.dataset(path).map_err(broken)?;
        // A chunk is opened whole, however little of it the dataset has.
        if let Some(chunk) = dataset.chunk_shape().map_err(broken)? {
            let count = chunk.iter().try_fold(1u64, |product, size| product.checked_mul(*size));
            if count.is_none_or(|count| count > self.left) {
                let problem = format!("its chunks have the shape {chunk:?}");
                return Err(refuse(problem, "chunks of as many numbers as the file can hold"));
            }
        }
        let values = match dataset.dtype().map_err(broken)? {
            // Flags of Python are an enumeration of bytes.
            DType::Enum(_) if dataset.element_size().map_err(broken)? == 1 => {
                let raw = dataset.read_raw().map_err(broken)?;
                raw.into_iter().map(f64::from).collect()
            }
            _ => dataset.read_f64().map_err(broken)?,
        };
        if count != Some(values.len() as u64) {
            let problem = format!("it has {} numbers and the shape {shape:?}", values.len());
            return Err(refuse(problem, "as many numbers as its shape says"));
        }
        self.left = left;
        Ok((shape, values))
    }

    /// Puts a session into the streams.
    fn session(
        &mut self,
        into: &mut Streams,
        map: &DatasetMap,
        place: &Place,
        used: &mut BTreeSet<String>,
    ) -> Result<(), InputFault> {
        let inside = |dataset: &str| match &*place.group {
            "" => dataset.trim_matches('/').to_owned(),
            group => format!("{group}/{}", dataset.trim_matches('/')),
        };
        let signals = map.width.iter().chain(&map.grasp);
        let first = map.objects.values().map(|own| &own.position).chain(signals);
        let first = first.map(|own| inside(own)).find(|path| self.shapes.contains_key(path));
        let (times, like) = match (&map.time, into.mapping.rate_hz) {
            (Some(time), _) => {
                let path = inside(time);
                let (shape, times) = self.read(&path, None)?;
                if shape.iter().skip(1).any(|size| *size != 1) || shape.is_empty() {
                    let problem = format!("its shape is {shape:?}");
                    return Err(fault(self.file, &path, problem, "one time for each row"));
                }
                used.insert(path.clone());
                (times, path)
            }
            (None, Some(rate)) => {
                let Some(path) = first else {
                    let own = map.objects.values().next().map_or("", |own| &own.position);
                    return self.read(&inside(own), None).map(|_| ());
                };
                let rows = self.shapes[&path].first().copied().unwrap_or(0);
                if rows > self.left {
                    let problem = format!("it has {rows} rows");
                    return Err(fault(self.file, &path, problem, "at most 100 million numbers"));
                }
                ((0..rows).map(|row| row as f64 / rate).collect(), path)
            }
            (None, None) => {
                let problem = "it has no dataset of times";
                let expected = "`time` or `rate_hz` in the mapping, or --rate HZ";
                return Err(fault(self.file, "", problem, expected));
            }
        };
        let home = into.home(self.file)?;
        let group = Some(&*place.name).filter(|name| !name.is_empty());
        let part = into.part_of(&home, group);
        into.parts[part].told |= group.is_some();
        let source = into.source(self.file, None);
        let own = &mut into.sources[source as usize];
        own.time = if map.time.is_some() { into.mapping.time_unit } else { own.time };
        own.times = times.iter().copied().filter(|t| t.is_finite()).take(LOOK).collect();
        let rows = (times.len() as u64, &*like);
        for (id, own) in &map.objects {
            let position = inside(&own.position);
            if !self.shapes.contains_key(&position) && map.objects.len() > 1 {
                into.drop_one(&format!("dataset `{}`, which some session has not", own.position));
                continue;
            }
            let rotation = own.rotation.as_deref().map(inside);
            let own = PoseDatasets { position, rotation };
            self.object(into, [part, source as usize], id, &own, &times, rows)?;
            used.insert(own.position);
            used.extend(own.rotation);
        }
        for (dataset, flag) in [(&map.width, false), (&map.grasp, true)] {
            let Some(path) = dataset.as_deref().map(inside) else { continue };
            let (shape, values) = self.read(&path, Some(rows))?;
            let size = shape.iter().skip(1).product::<u64>();
            if shape.is_empty() || !(1..=8).contains(&size) || flag && size != 1 {
                let problem = format!("its shape is {shape:?}");
                return Err(fault(
                    self.file,
                    &path,
                    problem,
                    "a number for each row, or one for each finger",
                ));
            }
            let signal = if flag { Signal::Grasp } else { Signal::Width };
            let own = into.parts[part].signals.entry(signal).or_default();
            for (t, row) in times.iter().zip(values.chunks_exact(size as usize)) {
                let sum = row.iter().map(|v| if size > 1 { v.abs() } else { *v }).sum::<f64>();
                if t.is_finite() && sum.is_finite() {
                    own.push(Reading { t: *t, value: sum, source });
                }
            }
            used.insert(path);
        }
        Ok(())
    }

    /// Says how the three numbers of rotations are read, and returns that and their unit.
    fn three(
        &mut self,
        into: &mut Streams,
        path: &str,
        values: &[f64],
    ) -> Result<(Rotation, Angle), InputFault> {
        let rotation = into.mapping.rotation.unwrap_or(Rotation::Vector);
        into.rotations.push(rotation);
        if into.mapping.rotation.is_none() {
            let reason = "rotations have three numbers; `rotation` says otherwise".to_owned();
            into.suppose(self.file, "rotation", rotation.name(), reason);
        }
        if let Some(angle) = into.mapping.angle {
            return Ok((rotation, angle));
        }
        let (angle, greatest) = angle_of(values.iter().copied());
        match &self.angle {
            _ if greatest == 0.0 => {}
            None => {
                let reason = format!("the greatest angle of {path} is {greatest:.1}");
                into.suppose(self.file, "angle", angle.name(), reason);
                self.angle = Some((angle, path.to_owned()));
            }
            Some((known, other)) if *known != angle => {
                let problem = format!(
                    "its greatest angle is {greatest:.1}, so that it seems to be in {}, and `{other}` in {}",
                    angle.name(),
                    known.name()
                );
                let expected = "`angle` in the mapping, or --angle rad or deg";
                return Err(fault(self.file, path, problem, expected));
            }
            Some(_) => {}
        }
        Ok((rotation, angle))
    }

    /// Puts the poses of an object, or of several, into their tracks.
    fn object(
        &mut self,
        into: &mut Streams,
        [part, source]: [usize; 2],
        id: &str,
        own: &PoseDatasets,
        times: &[f64],
        rows: (u64, &str),
    ) -> Result<(), InputFault> {
        let (shape, values) = self.read(&own.position, Some(rows))?;
        let Some(layout) = Layout::of(&shape) else {
            let problem = format!("its shape is {shape:?}");
            let expected = "times × 3, times × 7, times × 4 × 4, or times × objects × one of these";
            return Err(fault(self.file, &own.position, problem, expected));
        };
        let turns = match &own.rotation {
            None => None,
            Some(path) => {
                let (turned, values) = self.read(path, Some(rows))?;
                let Some(size) = layout.turns(&shape, &turned) else {
                    let problem = format!(
                        "its shape is {turned:?}, and that of `{}` is {shape:?}",
                        own.position
                    );
                    let expected = "four, three or nine numbers for each position";
                    return Err(fault(self.file, path, problem, expected));
                };
                Some((path, size, values))
            }
        };
        let (rotation, angle) = match &turns {
            Some((path, 3, values)) => self.three(into, path, values)?,
            _ => (Rotation::Vector, Angle::Radian),
        };
        let count = layout.objects;
        if count > 1_000 {
            let problem = format!("it has {count} objects");
            return Err(fault(self.file, &own.position, problem, "at most 1,000"));
        }
        let mut tracks = Vec::new();
        for number in 0..count {
            let id = match (count, id.contains('*')) {
                (1, false) => id.to_owned(),
                (_, true) => id.replace('*', &number.to_string()),
                (_, false) => format!("{id}_{number}"),
            };
            let left = into.mapping.ignores(&id);
            tracks.push(match left {
                true => None,
                false => Some(into.named_track(part, &id, self.file, &own.position)?),
            });
        }
        let four = turns.as_ref().map_or(layout.form == Form::Pose, |(_, size, _)| *size == 4);
        if four && into.mapping.quaternion.is_none() {
            let reason = "most logs of arrays put the real part last; `quaternion` says otherwise";
            into.suppose(self.file, "quaternion", "xyzw", reason.into());
        }
        for (row, t) in times.iter().enumerate() {
            for (number, track) in tracks.iter().enumerate() {
                let Some(track) = track else { continue };
                let at = (row * count + number) * layout.size;
                let Some(values) = values.get(at..at + layout.size) else { continue };
                let (position, inner) = layout.form.split(values);
                if !(t.is_finite() && position.iter().all(|v| v.is_finite())) {
                    into.drop_one("pose that is not a number");
                    continue;
                }
                layout.form.check(values).map_err(|problem| {
                    let problem = format!("row {row}: {problem}");
                    let expected = "the last row 0, 0, 0, 1, and the position in the last column";
                    fault(self.file, &own.position, problem, expected)
                })?;
                let (field, mut turn) = match &turns {
                    None => (&own.position, inner),
                    Some((path, size, values)) => {
                        let at = (row * count + number) * size;
                        (*path, values.get(at..at + size).unwrap_or_default().to_vec())
                    }
                };
                if let (&[w, x, y, z], Some(QuaternionOrder::Wxyz)) =
                    (&*turn, into.mapping.quaternion)
                {
                    turn = vec![x, y, z, w];
                }
                let seen = turn.iter().all(|v| v.is_finite()) && !turn.is_empty();
                let orientation = match seen {
                    false => UNSEEN,
                    true => orientation(&turn, rotation, angle).map_err(|problem| {
                        let problem = format!("row {row}: {problem}");
                        fault(self.file, field, problem, "a rotation in each row")
                    })?,
                };
                let pose = Pose { position, orientation };
                into.push([part, *track], source as u32, *t, &pose)?;
            }
        }
        Ok(())
    }

    /// Notes the datasets that are not used, those of several sessions once.
    fn tell_unused(&self, into: &mut Streams, used: &BTreeSet<String>) {
        let mut unused: Vec<String> = Vec::new();
        for path in self.shapes.keys().filter(|path| !used.contains(*path)) {
            let plain: Vec<String> = path
                .split('/')
                .map(|name| match is_session(name) {
                    true => format!("{}*", natural(name).0),
                    false => name.to_owned(),
                })
                .collect();
            let plain = plain.join("/");
            if !unused.contains(&plain) && unused.len() < 200 {
                unused.push(plain);
            }
        }
        if !unused.is_empty() {
            into.unused.push((self.file.into(), unused));
        }
    }
}
