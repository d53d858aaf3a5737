//! The rows of a table: times, signals of the gripper and poses.

use std::collections::HashMap;

use csv::ByteRecord;

use super::csv::{LOOK, MOST_ROWS, Text, one_line, reader, syntax};
use super::layout::{Body, Layout, Turn};
use super::mapping::{Angle, Rotation, TimeUnit};
use super::orientation::orientation;
use super::sessions::Home;
use super::streams::{Part, Reading, Sample, Signal, Streams};
use crate::logs::UNSEEN;
use crate::task::error::InputFault;
use crate::task::recording::{FIT_NAME, unfit};

/// Greatest number of objects of a session.
const MOST_OBJECTS: usize = 2_000;

/// A place in a table.
pub(super) struct Row<'a> {
    pub file: &'a str,
    pub line: u64,
    pub header: &'a [String],
}

impl Row<'_> {
    fn fault(&self, column: usize, problem: String, expected: &str) -> InputFault {
        InputFault {
            file: self.file.into(),
            line: Some(self.line as usize),
            field: self.header.get(column).cloned().unwrap_or_default(),
            problem,
            expected: expected.into(),
        }
    }
}

/// Cells that mean that nothing was measured.
pub(super) fn is_missing(cell: &[u8]) -> bool {
    cell.is_empty()
        || ["nan", "na", "n/a", "null", "none", "-", "-nan", "nil"]
            .iter()
            .any(|word| cell.eq_ignore_ascii_case(word.as_bytes()))
}

/// Returns the number in a cell; `None` for a missing one.
pub(super) fn number(
    record: &ByteRecord,
    column: usize,
    comma: bool,
    row: &Row<'_>,
) -> Result<Option<f64>, InputFault> {
    let cell = record.get(column).unwrap_or_default().trim_ascii();
    if is_missing(cell) {
        return Ok(None);
    }
    let text = std::str::from_utf8(cell).unwrap_or("\u{fffd}");
    let parsed = match comma {
        true => text.replace(',', ".").parse::<f64>(),
        false => text.parse::<f64>(),
    };
    match parsed {
        Ok(value) if value.is_finite() => Ok(Some(value)),
        _ => {
            let shown: String = text.chars().take(40).collect();
            Err(row.fault(column, format!("it is `{shown}`"), "a number, or an empty cell"))
        }
    }
}

/// Returns the flag in a cell; `None` for a missing one.
fn flag(
    record: &ByteRecord,
    column: usize,
    comma: bool,
    row: &Row<'_>,
) -> Result<Option<bool>, InputFault> {
    let cell = record.get(column).unwrap_or_default().trim_ascii();
    for (words, value) in
        [(["true", "yes", "closed", "on"], true), (["false", "no", "open", "off"], false)]
    {
        if words.iter().any(|word| cell.eq_ignore_ascii_case(word.as_bytes())) {
            return Ok(Some(value));
        }
    }
    Ok(number(record, column, comma, row)?.map(|value| value > 0.5))
}

/// The times of a file, or of one object of it, since its clock last started.
#[derive(Clone, Copy, Default)]
struct Clock {
    first: f64,
    last: f64,
    count: u64,
    /// Number of the session of its last row, from 0.
    session: u64,
}

impl Clock {
    /// Returns whether a time goes back by more than half of the time that has passed.
    fn back(&self, t: f64) -> bool {
        self.count > 0 && self.last - t > 0.5 * (self.last - self.first)
    }

    /// Notes a row. `again`: the clock starts again with it.
    fn tick(&mut self, t: f64, again: bool, session: u64) {
        if self.count == 0 || again {
            *self = Self { first: t, last: t, count: 0, session };
        }
        (self.last, self.count, self.session) = (self.last.max(t), self.count + 1, session);
    }
}

/// The clocks of a file: one of its rows, and one of each object.
#[derive(Default)]
struct Clocks {
    rows: Clock,
    objects: HashMap<Vec<u8>, Clock>,
}

impl Clocks {
    /// Returns the number of the session of the next row, from 0. A session begins where the clock of the rows, after at
    /// least 20 of them, and that of the row's object go back. In a table that is sorted by object, only the first does.
    fn session(&mut self, object: &[u8], t: f64) -> u64 {
        let before = self.rows.session;
        let again = self.rows.count >= 20 && self.rows.back(t);
        let own = self.objects.get(object);
        let restart = again && own.is_some_and(|own| own.back(t));
        let session = match own {
            Some(own) if restart => own.session + 1,
            Some(own) if again => own.session,
            Some(own) => own.session.max(before),
            None if again => 0,
            None => before,
        };
        let changed = own.is_some_and(|own| own.session != session);
        self.rows.tick(t, restart, session);
        match self.objects.get_mut(object) {
            Some(own) => own.tick(t, changed, session),
            None => drop(
                self.objects
                    .insert(object.to_vec(), Clock { first: t, last: t, count: 1, session }),
            ),
        }
        session
    }
}

/// The rows of one file.
pub(super) struct Rows<'a> {
    pub layout: &'a Layout,
    pub text: &'a Text,
    pub file: &'a str,
    pub angle: Angle,
    pub source: u32,
    pub referred: bool,
    pub home: Home,
}

impl Rows<'_> {
    /// Returns whether rows have times of their own, not numbers of other rows.
    fn text_clock(&self) -> bool {
        !self.layout.time.is_empty()
    }

    pub fn read(&self, bytes: &[u8], into: &mut Streams) -> Result<(), InputFault> {
        let header = &*self.text.header;
        let mut table = reader(bytes, self.text.delimiter);
        let mut record = ByteRecord::new();
        let mut count = 0u64;
        let (mut clocks, mut sessions, mut current) = (Clocks::default(), 0, 0);
        let mut at = None;
        let mut bodies: Vec<Option<usize>> = vec![None; self.layout.bodies.len()];
        let mut last_session: Vec<u8> = Vec::new();
        loop {
            let more =
                table.read_byte_record(&mut record).map_err(|error| syntax(self.file, &error))?;
            if !more {
                break;
            }
            count += 1;
            if count <= self.text.rows as u64 {
                continue;
            }
            one_line(self.file, &record)?;
            let line = record.position().map_or(0, csv::Position::line);
            let row = Row { file: self.file, line, header };
            if record.len() != header.len() {
                let problem = format!("the row has {} fields", record.len());
                let expected = format!("{} fields, as the header has", header.len());
                return Err(row.fault(usize::MAX, problem, &expected));
            }
            if count > MOST_ROWS {
                return Err(row.fault(
                    usize::MAX,
                    "the file has too many rows".into(),
                    "at most 20 million",
                ));
            }
            // Another session begins with another value of its column.
            let own = self.layout.session.map(|column| record.get(column).unwrap_or_default());
            if at.is_none() || own.is_some_and(|own| own != last_session) {
                last_session = own.unwrap_or_default().to_vec();
                let name = own.map(|own| name(own, self.layout.session, &row)).transpose()?;
                let part = into.part_of(&self.home, name.as_deref());
                into.parts[part].told |= own.is_some();
                at = Some(part);
                bodies.iter_mut().for_each(|body| *body = None);
            }
            let Some(t) = self.time(&record, &row)? else {
                into.drop_one("row without a time");
                continue;
            };
            // A clock that starts again begins another session.
            if self.layout.session.is_none() && self.text_clock() {
                let object = self.layout.id.and_then(|column| record.get(column));
                let session = clocks.session(object.unwrap_or_default(), t);
                if session > sessions {
                    into.note_reset(self.file, line);
                    sessions = session;
                }
                if session != current {
                    current = session;
                    let name = format!("{}-{}", self.home.session, session + 1);
                    at = Some(into.part_of(&self.home, (session > 0).then_some(&name)));
                    bodies.iter_mut().for_each(|body| *body = None);
                }
            }
            let Some(part) = at else { continue };
            let source = &mut into.sources[self.source as usize];
            source.rows += 1;
            if source.times.len() < LOOK {
                source.times.push(t);
            }
            self.signals(&record, &row, t, &mut into.parts[part])?;
            let id = match self.layout.id {
                Some(column) => {
                    Some(name(record.get(column).unwrap_or_default(), Some(column), &row)?)
                }
                None => None,
            };
            for (index, body) in self.layout.bodies.iter().enumerate() {
                let id = match (&*body.id, &id) {
                    ("*", Some(id)) => {
                        if into.mapping.ignores(id) {
                            continue;
                        }
                        bodies[index] = None;
                        id.as_str()
                    }
                    (id, _) => id,
                };
                let track = *bodies[index].get_or_insert_with(|| into.track(part, id));
                if track >= MOST_OBJECTS {
                    let problem =
                        format!("there are more than {MOST_OBJECTS} objects in one session");
                    let expected = "ids of objects, which are the same in many rows";
                    return Err(row.fault(self.layout.id.unwrap_or(usize::MAX), problem, expected));
                }
                let Some(sample) = self.sample(&record, &row, t, body, into)? else { continue };
                if let Some(last) = into.parts[part].tracks[track].samples.last()
                    && last.source == self.source
                    && let Some(factor) = switched(&last.position, &sample.position)
                {
                    let problem =
                        format!("the position of {id} is {factor} times that of its row before");
                    return Err(row.fault(body.position[0], problem, "one unit in the whole file"));
                }
                into.parts[part].tracks[track].samples.push(sample);
            }
            if let (Some(kind), Some(id)) = (self.layout.kind, &id)
                && !into.parts[part].kinds.contains_key(id)
            {
                let kind = name(record.get(kind).unwrap_or_default(), Some(kind), &row)?;
                into.parts[part].kinds.insert(id.clone(), kind);
            }
            if self.referred {
                let rows = &mut into.parts[part].row_times;
                match rows.last_mut() {
                    Some((source, times)) if *source == self.source => times.push(t),
                    _ => rows.push((self.source, vec![t])),
                }
            }
        }
        Ok(())
    }

    fn time(&self, record: &ByteRecord, row: &Row<'_>) -> Result<Option<f64>, InputFault> {
        // A date is no number.
        let number = |column| {
            number(record, column, self.text.comma, row).map_err(|fault| {
                let expected = "a number; a date has to be converted first, such as with \
                                `pandas.to_datetime(t).astype('int64')`";
                match fault.problem.contains(':') {
                    true => InputFault { expected: expected.into(), ..fault },
                    false => fault,
                }
            })
        };
        match &*self.layout.time {
            [] => number(0),
            [(column, _)] => number(*column),
            several => {
                let mut sum = 0.0;
                for (column, unit) in several {
                    let scale = unit.map_or(1.0, TimeUnit::seconds);
                    match number(*column)? {
                        Some(value) if *unit == Some(TimeUnit::Nanosecond) && value >= 1e9 => {
                            let problem = format!("it is {value}, beside another column of time");
                            let expected = "nanoseconds of less than a second, or --time COLUMN";
                            return Err(row.fault(*column, problem, expected));
                        }
                        Some(value) => sum += value * scale,
                        None => return Ok(None),
                    }
                }
                Ok(Some(sum))
            }
        }
    }

    fn signals(
        &self,
        record: &ByteRecord,
        row: &Row<'_>,
        t: f64,
        part: &mut Part,
    ) -> Result<(), InputFault> {
        let comma = self.text.comma;
        let mut add = |signal: Signal, value: f64| {
            part.signals.entry(signal).or_default().push(Reading { t, value, source: self.source });
        };
        if let Some(column) = self.layout.width
            && let Some(value) = number(record, column, comma, row)?
        {
            add(Signal::Width, value);
        }
        if let Some(column) = self.layout.grasp
            && let Some(value) = flag(record, column, comma, row)?
        {
            add(Signal::Grasp, value.into());
        }
        for (object, column) in &self.layout.contacts {
            let Some(value) = flag(record, *column, comma, row)? else { continue };
            let object = match (object.is_empty(), self.layout.id) {
                (true, Some(id)) => {
                    String::from_utf8_lossy(record.get(id).unwrap_or_default()).into_owned()
                }
                _ => object.clone(),
            };
            add(Signal::Contact(object), value.into());
        }
        Ok(())
    }

    fn sample(
        &self,
        record: &ByteRecord,
        row: &Row<'_>,
        t: f64,
        body: &Body,
        into: &mut Streams,
    ) -> Result<Option<Sample>, InputFault> {
        let comma = self.text.comma;
        let mut position = [0.0; 3];
        for (value, column) in position.iter_mut().zip(body.position) {
            match number(record, column, comma, row)? {
                Some(found) => *value = found,
                None => return Ok(None),
            }
        }
        let read = |columns: &[usize], values: &mut [f64]| -> Result<bool, InputFault> {
            for (value, column) in values.iter_mut().zip(columns) {
                match number(record, *column, comma, row)? {
                    Some(found) => *value = found,
                    None => return Ok(false),
                }
            }
            Ok(true)
        };
        let (columns, rotation): (&[usize], _) = match &body.turn {
            Turn::None => (&[], Rotation::Vector),
            Turn::Quaternion(columns) => (columns, Rotation::Vector),
            Turn::Three(columns, rotation) => (columns, *rotation),
            Turn::Matrix(columns) => (columns, Rotation::Vector),
        };
        let mut values = [0.0; 9];
        let values = &mut values[..columns.len()];
        let orientation = match columns.first() {
            Some(first) if read(columns, values)? => {
                let expected = match columns.len() {
                    4 => "a unit quaternion: are these its columns?",
                    _ => "a rotation matrix by rows",
                };
                let turn = orientation(values, rotation, self.angle)
                    .map_err(|problem| row.fault(*first, problem, expected))?;
                if turn[3].is_nan() {
                    into.drop_one("pose whose quaternion is zero");
                    return Ok(None);
                }
                turn
            }
            _ => UNSEEN,
        };
        let extent = &mut into.sources[self.source as usize].extent;
        for value in position {
            *extent = [extent[0].min(value), extent[1].max(value)];
        }
        Ok(Some(Sample { t, position, orientation, source: self.source }))
    }
}

/// Returns the factor of another unit of length by which all coordinates changed at once.
fn switched(before: &[f64; 3], after: &[f64; 3]) -> Option<f64> {
    let clear = |v: &f64| v.abs() > 0.02;
    if before.iter().filter(|v| clear(v)).count() < 2 {
        return None;
    }
    [1000.0, 100.0, 0.001, 0.01].into_iter().find(|factor| {
        let pairs = before.iter().zip(after).filter(|(before, _)| clear(before));
        pairs.into_iter().all(|(before, after)| (after / before / factor - 1.0).abs() < 0.25)
    })
}

/// Returns a name that a cell gives.
fn name(cell: &[u8], column: Option<usize>, row: &Row<'_>) -> Result<String, InputFault> {
    let text = String::from_utf8_lossy(cell.trim_ascii());
    match unfit(&text) {
        Some(problem) => Err(row.fault(column.unwrap_or(usize::MAX), problem, FIT_NAME)),
        None => Ok(text.into_owned()),
    }
}
