//! Reads tables of text: comma, semicolon, tab, bar or spaces between fields, with or without comments.

use super::finish::fault;
use super::found::say;
use super::layout::{Finder, Layout, Turn};
use super::mapping::{Angle, TableMap, TimeUnit};
use super::rows::{Row, Rows, is_missing, number};
use super::streams::{Guess, Source, Streams};
use crate::logs::fits;
use crate::task::error::InputFault;
use csv::{ByteRecord, ReaderBuilder, Trim};

/// Greatest number of rows of a file.
pub(super) const MOST_ROWS: u64 = 20_000_000;
/// Greatest number of columns.
const MOST_COLUMNS: usize = 10_000;
/// Number of rows from which units and the decimal point are guessed.
pub(super) const LOOK: usize = 1_000;

/// How the text of a table is written.
pub(super) struct Text {
    pub delimiter: u8,
    pub comma: bool,
    pub header: Vec<String>,
    /// Whether each column counts the rows.
    counts: Vec<bool>,
    /// Number of records of the header.
    pub rows: usize,
    line: usize,
}

pub(super) fn reader(bytes: &[u8], delimiter: u8) -> csv::Reader<&[u8]> {
    let mut builder = ReaderBuilder::new();
    builder.has_headers(false).flexible(true).comment(Some(b'#')).delimiter(delimiter);
    builder.trim(Trim::Fields).from_reader(bytes)
}

pub(super) fn syntax(file: &str, error: &csv::Error) -> InputFault {
    InputFault {
        file: file.into(),
        line: error.position().map(|position| position.line() as usize),
        field: String::new(),
        problem: "the line cannot be split into fields".into(),
        expected: "fields of text".into(),
    }
}

/// Refuses a cell with a line break. Most often a quote has no end there, and the cell holds the rows behind it.
pub(super) fn one_line(file: &str, record: &ByteRecord) -> Result<(), InputFault> {
    if !record.as_slice().iter().any(|b| matches!(b, b'\n' | b'\r')) {
        return Ok(());
    }
    Err(InputFault {
        file: file.into(),
        line: record.position().map(|position| position.line() as usize),
        field: String::new(),
        problem: "a quoted cell goes on in the next line".into(),
        expected: "a quote at the end of each quoted cell, and cells without line breaks".into(),
    })
}

impl Text {
    /// Finds out how a table is written from its first lines.
    fn of(
        bytes: &[u8],
        file: &str,
        table: &TableMap,
        guesses: &mut Vec<Guess>,
    ) -> Result<Self, InputFault> {
        let fault = |problem: &str, expected: &str| fault(file, "", problem, expected);
        let delimiter = match table.delimiter {
            Some(c) if !c.is_ascii() => {
                let expected = "one of , ; | and a tab or space";
                return Err(fault(&format!("the delimiter is `{c}`"), expected));
            }
            _ => delimiter(bytes, table),
        };
        let (comment, Some(_)) = first(bytes) else {
            return Err(fault("it has no rows", "a header and rows"));
        };
        let mut looked: Vec<ByteRecord> = Vec::new();
        for record in reader(bytes, delimiter).into_byte_records().take(LOOK) {
            let record = record.map_err(|error| syntax(file, &error))?;
            one_line(file, &record)?;
            looked.push(record);
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
        // The names may stand in the last comment before the rows.
        let names = reader(comment, delimiter).into_byte_records().next().and_then(Result::ok);
        let names = names.filter(|names| rows == 0 && names.len() == looked[0].len());
        if rows == 0 && names.is_none() || rows > looked.len() {
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
        if names.is_some() {
            let reason = "the rows have no names; the comment before them has as many fields";
            guesses.push(Guess {
                what: "header_rows".into(),
                value: "0".into(),
                reason: reason.into(),
                file: file.into(),
            });
        }
        let titles = || looked[..rows].iter().chain(&names);
        let columns = titles().map(ByteRecord::len).max().unwrap_or_default();
        if columns > MOST_COLUMNS {
            return Err(fault(&format!("it has {columns} columns"), "at most 10,000"));
        }
        let mut header = vec![String::new(); columns];
        for record in titles() {
            for (name, cell) in header.iter_mut().zip(record) {
                let cell = String::from_utf8_lossy(cell);
                if !name.is_empty() && !cell.is_empty() {
                    name.push('.');
                }
                name.push_str(&cell);
            }
        }
        let last = rows.checked_sub(1).and_then(|last| looked[last].position());
        let line = last.map_or(1, |position| position.line() as usize);
        let counts = (0..columns).map(|column| counts(&looked[rows..], column)).collect();
        Ok(Self { delimiter, comma, header, counts, rows, line })
    }
}

/// Returns the last comment before the first row, and that row.
fn first(bytes: &[u8]) -> (&[u8], Option<&[u8]>) {
    let mut comment: &[u8] = b"";
    for line in bytes.split(|b| *b == b'\n').map(<[u8]>::trim_ascii) {
        match line.split_first() {
            None => {}
            Some((b'#', text)) => comment = text.trim_ascii(),
            Some(_) => return (comment, Some(line)),
        }
    }
    (comment, None)
}

/// Returns the character between fields: that of the mapping, or the most frequent of the first row.
fn delimiter(bytes: &[u8], table: &TableMap) -> u8 {
    if let Some(c) = table.delimiter.filter(char::is_ascii) {
        return c as u8;
    }
    let first = first(bytes).1.unwrap_or_default();
    let count = |d: u8| first.iter().filter(|b| **b == d).count();
    let most = [b',', b';', b'\t', b'|'].into_iter().max_by_key(|d| (count(*d), *d == b','));
    // Words of a name stand between other delimiters.
    most.filter(|most| count(*most) > 0 || count(b' ') == 0).unwrap_or(b' ')
}

/// Returns a text with one space between the words of each line.
fn single_spaced(bytes: &[u8]) -> Vec<u8> {
    let mut text = Vec::with_capacity(bytes.len());
    for line in bytes.split(|b| *b == b'\n') {
        let words: Vec<&[u8]> =
            line.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty()).collect();
        text.extend(words.join(&b' '));
        text.push(b'\n');
    }
    text
}

/// Returns whether a column has one more on each row, for at least 20 rows.
fn counts(rows: &[ByteRecord], column: usize) -> bool {
    let number = |row: &ByteRecord| std::str::from_utf8(row.get(column)?).ok()?.parse::<u64>().ok();
    let next = |two: &[ByteRecord]| {
        number(&two[0])
            .and_then(|row| row.checked_add(1))
            .is_some_and(|row| number(&two[1]) == Some(row))
    };
    rows.len() >= 20 && rows.windows(2).all(next)
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

impl Streams {
    /// Adds the rows of a table of text. `file` is its name in errors; patterns are compared with the part behind the
    /// last `/`. Costs about 1 µs a row and body.
    ///
    /// A file has at most 20 million rows and 10,000 columns, a session at most 2,000 objects, and a name at most 200
    /// characters.
    ///
    /// The rows go to the session that a column names; else to that of the mapping's pattern of file names; else to that
    /// of the file's name without an ending such as `_robot` or `_objects`. A file whose name is such a word has the
    /// session of its folder. A clock that goes back begins another session. Sessions of the same name in several folders,
    /// or of the same value in several files, are one if only one of them has poses of objects, and else have the folder
    /// or the file before their names. Rows of a table without the column go to the session whose span of time holds them.
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
        let spaced = (delimiter(bytes, table) == b' ').then(|| single_spaced(bytes));
        let bytes = spaced.as_deref().unwrap_or(bytes);
        let text = Text::of(bytes, file, table, &mut guesses)?;
        let header = &*text.header;
        let (line, guesses_of) = (text.line, &mut guesses);
        let session = self.session.as_deref();
        let (counts, mapped) = (&*text.counts, &mapping);
        let finder = Finder {
            header,
            file,
            counts,
            line,
            mapping: mapped,
            table,
            session,
            guesses: guesses_of,
        };
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
                [_, _, ..] => Some(TimeUnit::Second),
                [] => None,
            }),
            frame: table.frame.or(mapping.frame),
            row_of: table.row_of.clone(),
            extent: [f64::INFINITY, f64::NEG_INFINITY],
            times: Vec::new(),
            rows: 0,
        });
        let turns = layout.bodies.iter().map(|body| body.turn);
        self.rotations.extend(turns.filter_map(|turn| match turn {
            Turn::Three(_, rotation) => Some(rotation),
            _ => None,
        }));
        if mapping.tables.is_empty() {
            let mut read = layout.described(header, &mapping);
            read.header_rows = (text.rows > 1).then_some(text.rows);
            say(&mut self.found.tables, read, name);
        }
        if let Some(column) = layout.session {
            self.session.get_or_insert_with(|| header[column].clone());
        }
        if !layout.unused.is_empty() {
            self.unused.push((file.into(), layout.unused.clone()));
        }
        for guess in guesses {
            self.note(guess);
        }
        let home = self.home(file)?;
        let referred = mapping.tables.iter().filter_map(|t| t.row_of.as_ref());
        let referred = referred.into_iter().any(|pattern| fits(pattern, name));
        let rows = Rows { layout: &layout, text: &text, file, angle, source, referred, home };
        rows.read(bytes, self)
    }

    /// Notes that the clock of a file starts again.
    pub(super) fn note_reset(&mut self, file: &str, line: u64) {
        let reason = format!("the time goes back at line {line}");
        self.note(Guess {
            what: "session".into(),
            value: "another".into(),
            reason,
            file: file.into(),
        });
    }

    /// Notes a guess, once for all files that give the same.
    pub(super) fn note(&mut self, guess: Guess) {
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

/// Returns the unit that angles have by the greatest of them, and that one.
pub(super) fn angle_of(angles: impl IntoIterator<Item = f64>) -> (Angle, f64) {
    let angles = angles.into_iter().filter(|angle| angle.is_finite());
    let greatest = angles.fold(0.0f64, |most, angle| most.max(angle.abs()));
    (if greatest > 6.4 { Angle::Degree } else { Angle::Radian }, greatest)
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
    let mut angles = Vec::new();
    for record in reader(bytes, text.delimiter).into_byte_records().skip(text.rows).take(LOOK) {
        let record = record.map_err(|error| syntax(file, &error))?;
        let line = record.position().map_or(0, csv::Position::line);
        let row = Row { file, line, header: &text.header };
        for column in &three {
            angles.extend(number(&record, *column, text.comma, &row)?);
        }
    }
    let (angle, greatest) = angle_of(angles);
    let reason = format!("the greatest angle of the first rows is {greatest:.1}");
    guesses.push(Guess {
        what: "angle".into(),
        value: angle.name().into(),
        reason,
        file: file.into(),
    });
    Ok(angle)
}
