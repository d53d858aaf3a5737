//! Reads tables of text: comma, semicolon, tab or bar between fields, with or without comments.

use csv::{ByteRecord, ReaderBuilder, Trim};
use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};

use super::layout::{Body, Finder, Layout, Turn};
use super::mapping::{Angle, Rotation, TableMap};
use super::pattern::Pattern;
use super::streams::{Guess, Sample, Source, Streams};
use crate::robot::pose::quaternion_array;
use crate::task::error::InputFault;
use crate::task::recording::MAX_NAME;

/// Greatest number of rows of a file.
const MOST_ROWS: u64 = 20_000_000;
/// Greatest number of columns.
const MOST_COLUMNS: usize = 10_000;
/// Number of rows from which units and the decimal point are guessed.
const LOOK: usize = 1_000;

/// A place in a table.
struct Row<'a> {
    file: &'a str,
    line: u64,
    header: &'a [String],
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
fn is_missing(cell: &[u8]) -> bool {
    cell.is_empty()
        || ["nan", "na", "n/a", "null", "none", "-", "-nan", "nil"]
            .iter()
            .any(|word| cell.eq_ignore_ascii_case(word.as_bytes()))
}

/// Returns the number in a cell; `None` for a missing one.
fn number(
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

/// How the text of a table is written.
struct Text {
    delimiter: u8,
    comma: bool,
    header: Vec<String>,
    /// Number of records of the header.
    rows: usize,
    line: usize,
}

fn reader(bytes: &[u8], delimiter: u8) -> csv::Reader<&[u8]> {
    let mut builder = ReaderBuilder::new();
    builder.has_headers(false).flexible(true).comment(Some(b'#')).delimiter(delimiter);
    builder.trim(Trim::Fields).from_reader(bytes)
}

fn syntax(file: &str, error: &csv::Error) -> InputFault {
    InputFault {
        file: file.into(),
        line: error.position().map(|position| position.line() as usize),
        field: String::new(),
        problem: "the line cannot be split into fields".into(),
        expected: "fields of text".into(),
    }
}

impl Text {
    /// Finds out how a table is written from its first lines.
    fn of(
        bytes: &[u8],
        file: &str,
        table: &TableMap,
        guesses: &mut Vec<Guess>,
    ) -> Result<Self, InputFault> {
        let fault = |problem: &str, expected: &str| InputFault {
            file: file.into(),
            line: None,
            field: String::new(),
            problem: problem.into(),
            expected: expected.into(),
        };
        let first = bytes.split(|b| *b == b'\n').map(<[u8]>::trim_ascii);
        let first = first.filter(|line| !line.is_empty() && line[0] != b'#').take(1).next();
        let Some(first) = first else {
            return Err(fault("it has no rows", "a header and rows"));
        };
        let delimiter = match table.delimiter {
            Some(c) if c.is_ascii() => c as u8,
            Some(c) => {
                return Err(fault(&format!("the delimiter is `{c}`"), "one of , ; | and a tab"));
            }
            None => {
                let count = |d: &u8| first.iter().filter(|b| *b == d).count();
                [b',', b';', b'\t', b'|']
                    .into_iter()
                    .max_by_key(|d| (count(d), *d == b','))
                    .unwrap_or(b',')
            }
        };
        let mut looked: Vec<ByteRecord> = Vec::new();
        for record in reader(bytes, delimiter).into_byte_records().take(LOOK) {
            looked.push(record.map_err(|error| syntax(file, &error))?);
        }
        let comma = delimiter != b',' && decimal_comma(&looked);
        if comma {
            let reason =
                "cells have one comma and no point, and another character stands between fields";
            guesses.push(Guess {
                what: "decimal".into(),
                value: ",".into(),
                reason: reason.into(),
                file: file.into(),
            });
        }
        let numeric = |cell: &[u8]| {
            let text = std::str::from_utf8(cell.trim_ascii()).unwrap_or("?");
            is_missing(cell.trim_ascii()) || text.replace(',', ".").parse::<f64>().is_ok()
        };
        // Rows of names stand before the first row in which most cells are numbers.
        let named = |record: &ByteRecord| {
            let cells = record.iter().filter(|cell| !cell.is_empty()).count();
            let numbers = record.iter().filter(|cell| !cell.is_empty() && numeric(cell)).count();
            numbers * 3 < cells.max(1)
        };
        let rows = match table.header_rows {
            Some(rows) => rows,
            // A table of names has rows that are names, too: only alike rows of several can be told.
            None => looked
                .iter()
                .take(3)
                .take_while(|record| named(record))
                .count()
                .min(if looked.len() > 1 { 3 } else { 1 }),
        };
        if rows == 0 || rows > looked.len() {
            return Err(fault("it has no row of names", "names of the columns in the first row"));
        }
        if rows > 1 && table.header_rows.is_none() {
            let reason = "so many rows have no numbers; their names are joined by a dot";
            guesses.push(Guess {
                what: "header_rows".into(),
                value: rows.to_string(),
                reason: reason.into(),
                file: file.into(),
            });
        }
        let columns = looked[..rows].iter().map(ByteRecord::len).max().unwrap_or_default();
        if columns > MOST_COLUMNS {
            return Err(fault(&format!("it has {columns} columns"), "at most 10,000"));
        }
        let mut header = vec![String::new(); columns];
        for record in &looked[..rows] {
            for (name, cell) in header.iter_mut().zip(record) {
                let cell = String::from_utf8_lossy(cell);
                if !name.is_empty() && !cell.is_empty() {
                    name.push('.');
                }
                name.push_str(&cell);
            }
        }
        let line = looked[rows - 1].position().map_or(1, |p| p.line() as usize);
        Ok(Self { delimiter, comma, header, rows, line })
    }
}

/// Returns whether numbers are written with a decimal comma.
fn decimal_comma(records: &[ByteRecord]) -> bool {
    let (mut commas, mut points) = (0, 0);
    for cell in records.iter().flat_map(ByteRecord::iter) {
        let digits = cell.iter().filter(|b| b.is_ascii_digit()).count();
        let number = cell.iter().all(|b| b.is_ascii_digit() || b",.-+eE".contains(b));
        if digits > 0 && number {
            commas += usize::from(cell.iter().filter(|b| **b == b',').count() == 1);
            points += usize::from(cell.contains(&b'.'));
        }
    }
    commas > 0 && points == 0
}

/// Where a file belongs: its session and part.
fn place(streams: &Streams, name: &str) -> Option<(String, String)> {
    let pattern = streams.mapping.sessions.as_ref()?;
    let found = Pattern::captured(pattern, name)?;
    let value = |key: &str| found.iter().find(|(k, _)| k == key).map(|(_, v)| (*v).to_owned());
    Some((value("session")?, value("part").unwrap_or_default()))
}

/// Words at the end of file names that say what a table holds, not which session it is of.
const ROLES: [&str; 14] = [
    "objects", "object", "robot", "poses", "pose", "gripper", "hand", "parts", "tracking", "arm",
    "ee", "camera", "tf", "contacts",
];

/// Returns the session that a file's name gives without a pattern.
fn session_of(name: &str) -> &str {
    let stem = name.rsplit_once('.').map_or(name, |(stem, _)| stem);
    match stem.rsplit_once(['_', '-', '.']) {
        Some((session, role)) if ROLES.contains(&role.to_ascii_lowercase().as_str()) => session,
        _ if ROLES.contains(&stem.to_ascii_lowercase().as_str()) => "",
        _ => stem,
    }
}

impl Streams {
    /// Adds the rows of a table of text. `file` is its name in errors; patterns are compared with the part behind the
    /// last `/`. Costs about 1 µs a row and body.
    ///
    /// # Errors
    /// [`InputFault`] with the line and the column of the first fault.
    pub fn add_csv(&mut self, file: &str, bytes: &[u8]) -> Result<(), InputFault> {
        let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
        let name = file.rsplit('/').next().unwrap_or(file);
        let mapping = self.mapping.clone();
        let unmapped = TableMap::default();
        let table = mapping.table(name).unwrap_or(&unmapped);
        let mut guesses = Vec::new();
        let text = Text::of(bytes, file, table, &mut guesses)?;
        let header = &*text.header;
        let (line, guesses_of) = (text.line, &mut guesses);
        let finder = Finder { header, file, line, mapping: &mapping, table, guesses: guesses_of };
        let layout = finder.find()?;
        let angle = match mapping.angle.or(layout.angle) {
            Some(angle) => angle,
            None => guess_angle(bytes, &text, &layout, file, &mut guesses)?,
        };
        if let Some(length) = layout.length.filter(|_| table.length.or(mapping.length).is_none()) {
            let reason = "columns have it in their names".to_owned();
            guesses.push(Guess {
                what: "length".into(),
                value: length.name().into(),
                reason,
                file: file.into(),
            });
        }
        let source = self.sources.len() as u32;
        self.sources.push(Source {
            file: file.into(),
            length: table.length.or(mapping.length).or(layout.length),
            time: mapping.time_unit.or_else(|| match &*layout.time {
                [(_, unit)] => *unit,
                // Seconds and nanoseconds are added up in seconds.
                [_, _, ..] => Some(super::mapping::TimeUnit::Second),
                [] => None,
            }),
            frame: table.frame.or(mapping.frame),
            row_of: table.row_of.clone(),
            extent: [f64::INFINITY, f64::NEG_INFINITY],
            times: Vec::new(),
            rows: 0,
        });
        if mapping.tables.is_empty() {
            let mut read = layout.described(header, &mapping);
            read.header_rows = (text.rows > 1).then_some(text.rows);
            match self.tables.iter_mut().find(|(table, _)| *table == read) {
                Some((_, files)) => files.push(name.to_owned()),
                None => self.tables.push((read, vec![name.to_owned()])),
            }
            if mapping.session.is_none()
                && let Some(column) = layout.session
            {
                self.mapping.session = Some(header[column].clone());
            }
        }
        if !layout.unused.is_empty() {
            self.unused.push((file.into(), layout.unused.clone()));
        }
        for guess in guesses {
            self.note(guess);
        }
        let (session, part) = match place(self, name) {
            Some(place) => place,
            None if mapping.sessions.is_some() => {
                let problem =
                    "its name does not fit the pattern of `sessions` in the mapping".to_owned();
                return Err(InputFault {
                    file: file.into(),
                    line: None,
                    field: String::new(),
                    problem,
                    expected: mapping.sessions.unwrap_or_default(),
                });
            }
            None => (session_of(name).to_owned(), String::new()),
        };
        let referred = mapping.tables.iter().filter_map(|t| t.row_of.as_ref());
        let referred = referred.into_iter().any(|pattern| Pattern::fits(pattern, name));
        let rows =
            Rows { layout: &layout, text: &text, file, angle, source, referred, session, part };
        rows.read(bytes, self)
    }

    /// Notes that the clock of a file starts again.
    fn note_reset(&mut self, file: &str, line: u64) {
        let reason = format!("the time goes back at line {line}");
        self.note(Guess {
            what: "session".into(),
            value: "another".into(),
            reason,
            file: file.into(),
        });
    }

    /// Notes a guess, once for all files that give the same.
    fn note(&mut self, guess: Guess) {
        let same = |g: &&mut Guess| {
            g.what == guess.what && g.value == guess.value && g.reason == guess.reason
        };
        match self.guesses.iter_mut().find(same) {
            Some(known) if known.file != guess.file => known.file.clear(),
            Some(_) => {}
            None => self.guesses.push(guess),
        }
    }
}

/// Guesses the unit of angles from the greatest one.
fn guess_angle(
    bytes: &[u8],
    text: &Text,
    layout: &Layout,
    file: &str,
    guesses: &mut Vec<Guess>,
) -> Result<Angle, InputFault> {
    let three: Vec<usize> = (layout.bodies.iter())
        .filter_map(
            |body| if let Turn::Three(columns, _) = body.turn { Some(columns) } else { None },
        )
        .flatten()
        .collect();
    if three.is_empty() {
        return Ok(Angle::Radian);
    }
    let mut greatest = 0.0f64;
    for record in reader(bytes, text.delimiter).into_byte_records().skip(text.rows).take(LOOK) {
        let record = record.map_err(|error| syntax(file, &error))?;
        let line = record.position().map_or(0, csv::Position::line);
        let row = Row { file, line, header: &text.header };
        for column in &three {
            greatest =
                greatest.max(number(&record, *column, text.comma, &row)?.unwrap_or(0.0).abs());
        }
    }
    let angle = if greatest > 6.4 { Angle::Degree } else { Angle::Radian };
    let reason = format!("the greatest angle of the first rows is {greatest:.1}");
    guesses.push(Guess {
        what: "angle".into(),
        value: angle.name().into(),
        reason,
        file: file.into(),
    });
    Ok(angle)
}

/// The times of a file so far.
#[derive(Default)]
struct Clock {
    first: f64,
    last: f64,
    count: u64,
}

impl Clock {
    /// Returns whether a time goes back by more than half of the time that has passed, after at least 20 rows.
    fn again(&self, t: f64) -> bool {
        self.count >= 20 && self.last - t > 0.5 * (self.last - self.first)
    }

    fn tick(&mut self, t: f64) {
        if self.count == 0 || self.again(t) {
            *self = Self { first: t, last: t, count: 0 };
        }
        (self.last, self.count) = (self.last.max(t), self.count + 1);
    }
}

/// The rows of one file.
struct Rows<'a> {
    layout: &'a Layout,
    text: &'a Text,
    file: &'a str,
    angle: Angle,
    source: u32,
    referred: bool,
    session: String,
    part: String,
}

impl Rows<'_> {
    /// Returns whether rows have times of their own, not numbers of other rows.
    fn text_clock(&self) -> bool {
        !self.layout.time.is_empty()
    }

    fn read(&self, bytes: &[u8], into: &mut Streams) -> Result<(), InputFault> {
        let header = &*self.text.header;
        let mut csv = reader(bytes, self.text.delimiter);
        let mut record = ByteRecord::new();
        let mut count = 0u64;
        let (mut clock, mut resets) = (Clock::default(), 0);
        let mut at = None;
        let mut bodies: Vec<Option<usize>> = vec![None; self.layout.bodies.len()];
        let mut last_session: Vec<u8> = Vec::new();
        loop {
            let more =
                csv.read_byte_record(&mut record).map_err(|error| syntax(self.file, &error))?;
            if !more {
                break;
            }
            count += 1;
            if count <= self.text.rows as u64 {
                continue;
            }
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
                let name = match own {
                    Some(own) => name(own, self.layout.session, &row)?,
                    None => self.session.clone(),
                };
                at = Some(into.part(&name, &self.part));
                bodies.iter_mut().for_each(|body| *body = None);
            }
            let Some(t) = self.time(&record, &row)? else {
                into.drop_one("row without a time");
                continue;
            };
            // A clock that starts again begins another session.
            if self.layout.session.is_none() && self.text_clock() {
                if clock.again(t) {
                    into.note_reset(self.file, line);
                    resets += 1;
                    at = Some(into.part(&format!("{}-{}", self.session, resets + 1), &self.part));
                    bodies.iter_mut().for_each(|body| *body = None);
                }
                clock.tick(t);
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
                let short = self.file.rsplit('/').next().unwrap_or(self.file);
                let rows = &mut into.parts[part].row_times;
                match rows.iter_mut().find(|(file, _)| file == short) {
                    Some((_, times)) => times.push(t),
                    None => rows.push((short.to_owned(), vec![t])),
                }
            }
        }
        Ok(())
    }

    fn time(&self, record: &ByteRecord, row: &Row<'_>) -> Result<Option<f64>, InputFault> {
        match &*self.layout.time {
            [] => number(record, 0, self.text.comma, row),
            [(column, _)] => number(record, *column, self.text.comma, row),
            several => {
                let mut sum = 0.0;
                for (column, unit) in several {
                    let scale = unit.map_or(1.0, super::mapping::TimeUnit::seconds);
                    match number(record, *column, self.text.comma, row)? {
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
        part: &mut super::streams::Part,
    ) -> Result<(), InputFault> {
        let comma = self.text.comma;
        if let Some(column) = self.layout.width
            && let Some(value) = number(record, column, comma, row)?
        {
            part.width.push((t, value));
            part.signal_source = Some(self.source);
        }
        if let Some(column) = self.layout.grasp
            && let Some(value) = flag(record, column, comma, row)?
        {
            part.grasp.push((t, value));
            part.signal_source = Some(self.source);
        }
        for (object, column) in &self.layout.contacts {
            let Some(value) = flag(record, *column, comma, row)? else { continue };
            let object = match (object.is_empty(), self.layout.id) {
                (true, Some(id)) => {
                    String::from_utf8_lossy(record.get(id).unwrap_or_default()).into_owned()
                }
                _ => object.clone(),
            };
            part.contacts.entry(object).or_default().push((t, value));
            part.signal_source = Some(self.source);
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
        let orientation = match &body.turn {
            Turn::None => Sample::UNSEEN,
            Turn::Quaternion(columns) => {
                let mut q = [0.0; 4];
                match read(columns, &mut q)? {
                    false => Sample::UNSEEN,
                    true => {
                        let norm = q.iter().map(|v| v * v).sum::<f64>().sqrt();
                        if norm < 1e-6 {
                            into.drop_one("pose whose quaternion is zero");
                            return Ok(None);
                        }
                        if !(0.9..1.1).contains(&norm) {
                            let problem = format!("the quaternion has the norm {norm:.3}");
                            return Err(row.fault(
                                columns[0],
                                problem,
                                "a unit quaternion: are these its columns?",
                            ));
                        }
                        q.map(|v| v / norm)
                    }
                }
            }
            Turn::Three(columns, rotation) => {
                let mut v = [0.0; 3];
                match read(columns, &mut v)? {
                    false => Sample::UNSEEN,
                    true => {
                        let scale =
                            if self.angle == Angle::Degree { 1f64.to_radians() } else { 1.0 };
                        let [a, b, c] = v.map(|v| v * scale);
                        quaternion_array(&match rotation {
                            Rotation::Euler => UnitQuaternion::from_euler_angles(a, b, c),
                            Rotation::Vector => {
                                UnitQuaternion::from_scaled_axis(Vector3::new(a, b, c))
                            }
                        })
                    }
                }
            }
            Turn::Matrix(columns) => {
                let mut m = [0.0; 9];
                match read(columns, &mut m)? {
                    false => Sample::UNSEEN,
                    true => {
                        let matrix = Matrix3::from_row_slice(&m);
                        if !((matrix * matrix.transpose() - Matrix3::identity()).norm() < 0.2
                            && matrix.determinant() > 0.0)
                        {
                            let problem = "the nine numbers are not a rotation".to_owned();
                            return Err(row.fault(
                                columns[0],
                                problem,
                                "a rotation matrix by rows",
                            ));
                        }
                        quaternion_array(&UnitQuaternion::from_rotation_matrix(
                            &Rotation3::from_matrix_unchecked(matrix),
                        ))
                    }
                }
            }
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
    let length = text.chars().count();
    if length == 0 || length > MAX_NAME {
        let problem = format!("the name has {length} characters");
        return Err(row.fault(column.unwrap_or(usize::MAX), problem, "1 to 200 characters"));
    }
    Ok(text.into_owned())
}
