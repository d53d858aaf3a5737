//! Tables and lists as wide as the terminal, broken between words only.

use std::fmt::{self, Write as _};
use std::sync::OnceLock;

use console::Term;
use symbolt::sim::plain;

/// Number of columns where there is no terminal, which every terminal has.
const USUAL: usize = 80;

/// Least and greatest number of columns of a table.
const COLUMNS: [usize; 2] = [40, 160];

/// Greatest number of columns of a paragraph: longer lines are hard to read.
const PROSE: usize = 100;

/// Returns the number of columns of a table: those of the terminal, or what the variable `COLUMNS` says.
fn columns() -> usize {
    static WIDTH: OnceLock<usize> = OnceLock::new();
    *WIDTH.get_or_init(|| {
        if cfg!(test) {
            return USUAL;
        }
        let given = std::env::var("COLUMNS").ok().and_then(|text| text.trim().parse().ok());
        let terminal = || Some(usize::from(Term::stdout().size_checked()?.1));
        let [least, most] = COLUMNS;
        given.filter(|given| *given > 0).or_else(terminal).unwrap_or(USUAL).clamp(least, most)
    })
}

/// Maximum number of rows that are listed cell by cell if they are too wide for a table.
const LISTED: usize = 12;

/// Joins the words of a text so that a table breaks no line between them.
pub(crate) fn unbroken(text: &str) -> String {
    text.replace(' ', "\u{a0}")
}

/// Breaks a text into lines. All lines but the first are indented.
pub(crate) fn wrapped(text: &str, indent: usize) -> String {
    let lines = lines(text, columns().min(PROSE).saturating_sub(indent));
    let lines: Vec<_> = lines.iter().map(|line| plain(line)).collect();
    shown(&lines.join(&format!("\n{:indent$}", "")))
}

/// Formats a count with its noun: `1 nut`, `2 nuts`.
pub(crate) fn counted(number: usize, what: &str) -> String {
    if number == 1 { format!("1 {what}") } else { format!("{number} {what}s") }
}

/// Makes a sentence of a remark: with a capital letter and a full stop.
pub(crate) fn note(remark: &impl ToString) -> String {
    let text = remark.to_string();
    let mut letters = text.chars();
    let first: String = letters.next().into_iter().flat_map(char::to_uppercase).collect();
    format!("{first}{}.", letters.as_str())
}

/// Lists names after a title, broken between names.
pub(crate) fn listed(title: &str, names: &[String]) -> String {
    let room = columns().min(PROSE).saturating_sub(length(title) + 1);
    let whole = |name: &String| if length(name) > room { name.clone() } else { unbroken(name) };
    let names: Vec<String> = names.iter().map(whole).collect();
    wrapped(&(unbroken(title) + &names.join(", ")), title.len())
}

/// Appends a title and, if it has rows, its table.
pub(crate) fn section(text: &mut String, title: &str, grid: &Grid) {
    let _ = match grid.is_empty() {
        true => writeln!(text, "{title}\n"),
        false => writeln!(text, "{title}:\n\n{grid}"),
    };
}

/// A Markdown table; columns of numbers are aligned to the right.
pub(crate) struct Grid {
    columns: Vec<Column>,
}

/// A column. Its cells are one text, because a table can have hundreds of thousands of rows.
#[derive(Clone)]
struct Column {
    head: String,
    right: bool,
    text: String,
    /// The end of each cell in `text`.
    ends: Vec<usize>,
}

impl Column {
    fn new(head: &str) -> Self {
        let right = head.starts_with('>');
        let head = head.trim_start_matches('>').to_owned();
        Self { head, right, text: String::new(), ends: Vec::new() }
    }

    fn push(&mut self, cell: &str) {
        self.text.push_str(cell);
        self.ends.push(self.text.len());
    }

    fn cell(&self, row: usize) -> &str {
        let from = row.checked_sub(1).map_or(0, |before| self.ends[before]);
        &self.text[from..self.ends[row]]
    }

    fn cells(&self) -> impl Iterator<Item = &str> {
        (0..self.ends.len()).map(|row| self.cell(row))
    }

    /// Returns the greatest length of the heading and the cells.
    fn widest(&self, head: fn(&str) -> usize, cell: fn(&str) -> usize) -> usize {
        self.cells().map(cell).fold(head(&self.head), usize::max)
    }
}

impl Grid {
    /// Makes an empty table. A heading that begins with `>` aligns its column to the right.
    pub fn new(columns: &[&str]) -> Self {
        Self { columns: columns.iter().map(|head| Column::new(head)).collect() }
    }

    pub fn row(&mut self, cells: impl IntoIterator<Item = String>) {
        let mut cells = cells.into_iter();
        for column in &mut self.columns {
            column.push(&plain(&cells.next().unwrap_or_default()));
        }
    }

    /// Leaves out the column with this heading.
    pub fn leave_out(&mut self, head: &str) {
        self.columns.retain(|column| column.head != head);
    }

    fn rows(&self) -> usize {
        self.columns.first().map_or(0, |column| column.ends.len())
    }

    pub fn is_empty(&self) -> bool {
        self.rows() == 0
    }

    /// Returns whether no cell has to be broken.
    pub fn fits(&self) -> bool {
        let widths = self.columns.iter().map(|c| c.widest(length, length));
        widths.sum::<usize>() + frame(self.columns.len()) <= columns()
    }

    /// Returns the columns' widths, or `None` if the longest words alone are too wide for one line.
    fn widths(&self) -> Option<Vec<usize>> {
        // A column of numbers is broken only if nothing else helps.
        let whole: fn(&str) -> usize = length;
        let numbers = |c: &Column| if c.right { whole } else { longest_word };
        let least = self.columns.iter().map(|c| c.widest(longest_word, numbers(c))).collect();
        self.spread(least).or_else(|| {
            self.spread(self.columns.iter().map(|c| c.widest(longest_word, longest_word)).collect())
        })
    }

    /// Widens the columns from their least widths until the line is full or no cell needs to be broken.
    fn spread(&self, mut widths: Vec<usize>) -> Option<Vec<usize>> {
        let room = columns().checked_sub(frame(widths.len()))?;
        let mut spare = room.checked_sub(widths.iter().sum())?;
        let wanted: Vec<usize> = self.columns.iter().map(|c| c.widest(length, length)).collect();
        // The column with the most lines gets the next character.
        while spare > 0 {
            let short = (0..widths.len()).filter(|c| widths[*c] < wanted[*c]);
            let lines = |column: &usize| wanted[*column] * USUAL / widths[*column].max(1);
            let Some(column) = short.max_by_key(lines) else { break };
            widths[column] += 1;
            spare -= 1;
        }
        Some(widths)
    }

    /// Splits a table into several tables, each with the rows' numbers; `None` if a single column is too wide.
    fn split(&self) -> Option<Vec<Self>> {
        let mut rows = Column::new(">#");
        (1..=self.rows()).for_each(|row| rows.push(&row.to_string()));
        let number = length(&self.rows().to_string());
        let mut parts = vec![Self { columns: vec![rows.clone()] }];
        let mut used = number;
        for column in &self.columns {
            let width = column
                .widest(longest_word, length)
                .min(columns().saturating_sub(frame(2) + number));
            if column.widest(longest_word, longest_word) > width {
                return None;
            }
            let part = parts.last_mut()?;
            if used + width + frame(part.columns.len() + 1) > columns() {
                parts.push(Self { columns: vec![rows.clone(), column.clone()] });
                used = number;
            } else {
                part.columns.push(column.clone());
            }
            used += width;
        }
        Some(parts)
    }

    /// Writes a row from the lines of its cells.
    fn write_row(
        &self,
        f: &mut fmt::Formatter<'_>,
        cells: &[Vec<String>],
        widths: &[usize],
    ) -> fmt::Result {
        for line in 0..cells.iter().map(Vec::len).max().unwrap_or(0) {
            f.write_str("|")?;
            for ((cell, width), column) in cells.iter().zip(widths).zip(&self.columns) {
                let text = shown(cell.get(line).map_or("", String::as_str));
                match column.right {
                    true => write!(f, " {text:>width$} |")?,
                    false => write!(f, " {text:<width$} |")?,
                }
            }
            writeln!(f)?;
        }
        Ok(())
    }

    /// Writes one line per cell: the heading and the value. A dash begins a row.
    fn write_list(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let width = self.columns.iter().map(|column| length(&column.head)).max().unwrap_or(0);
        for row in 0..self.rows() {
            for (number, column) in self.columns.iter().enumerate() {
                let dash = if number == 0 { "-" } else { " " };
                let line = format!("{dash} {:<width$}: ", column.head);
                // Blanks at the beginning of a line count.
                let line = unbroken(&line) + column.cell(row);
                writeln!(f, "{}", wrapped(&line, width + 4))?;
            }
        }
        Ok(())
    }
}

impl fmt::Display for Grid {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Some(widths) = self.widths() else {
            let parts = if self.rows() > LISTED { self.split() } else { None };
            let Some(parts) = parts else { return self.write_list(f) };
            let parts: Vec<String> = parts.iter().map(Self::to_string).collect();
            return f.write_str(&parts.join("\n"));
        };
        // Lines often break before the width of their column, so the table can be narrower.
        let used = |(column, width): (&Column, &usize)| {
            let cells = column.cells().chain([&*column.head]);
            cells.flat_map(|cell| lines(cell, *width)).map(|line| length(&line)).max().unwrap_or(0)
        };
        let used: Vec<usize> = self.columns.iter().zip(&widths).map(used).collect();
        let broken = |cell: fn(&Column, usize) -> &str, row: usize| -> Vec<Vec<String>> {
            let cells = self.columns.iter().map(|column| cell(column, row));
            cells.zip(&widths).map(|(cell, width)| lines(cell, *width)).collect()
        };
        self.write_row(f, &broken(|column, _| &column.head, 0), &used)?;
        for width in &used {
            write!(f, "|{:-<1$}", "", width + 2)?;
        }
        writeln!(f, "|")?;
        (0..self.rows()).try_for_each(|row| self.write_row(f, &broken(Column::cell, row), &used))
    }
}

/// Returns the width of the bars and blanks around the cells of a line.
fn frame(columns: usize) -> usize {
    3 * columns + 1
}

fn shown(text: &str) -> String {
    text.replace('\u{a0}', " ")
}

fn length(text: &str) -> usize {
    text.chars().count()
}

fn longest_word(text: &str) -> usize {
    text.split_ascii_whitespace().map(length).max().unwrap_or(0)
}

/// Breaks a text between words. Only a word that is longer than `width` makes a longer line.
fn lines(text: &str, width: usize) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split_ascii_whitespace() {
        match lines.last_mut() {
            Some(line) if length(line) + 1 + length(word) <= width => {
                line.push(' ');
                line.push_str(word);
            }
            _ => lines.push(word.to_owned()),
        }
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table(columns: &[&str], rows: &[&[&str]]) -> String {
        let mut grid = Grid::new(columns);
        for row in rows {
            grid.row(row.iter().map(|cell| (*cell).to_owned()));
        }
        grid.to_string()
    }

    #[test]
    fn a_narrow_table_is_markdown() {
        let text = table(&["state", ">poses"], &[&["NUT_AT_START", "3"], &["BOLT", "14"]]);
        let expected = "| state        | poses |\n\
                        |--------------|-------|\n\
                        | NUT_AT_START |     3 |\n\
                        | BOLT         |    14 |\n";
        assert_eq!(text, expected);
    }

    #[test]
    fn a_wide_table_breaks_its_lists_between_names() {
        let names = ["NUT_AT_NUT_POCKET", "BOLT_AT_BOLT_HOLE", "BOLT_AT_NUT_POCKET"];
        let list = names.map(|name| unbroken(&format!("{name} (5/5)"))).join(", ");
        let text = table(&["action", "needs", ">seen"], &[&["PUT_A_BOLT_SOMEWHERE", &list, "5"]]);
        assert!(text.lines().all(|line| line.chars().count() <= 80), "{text}");
        assert!(text.lines().count() > 3, "{text}");
        for name in names {
            assert!(text.contains(&format!("{name} (5/5)")), "{name} in {text}");
        }
        let widths: Vec<usize> = text.lines().map(str::len).collect();
        assert!(widths.windows(2).all(|w| w[0] == w[1]), "{text}");
    }

    #[test]
    fn a_table_that_fits_no_line_becomes_a_list() {
        let name = "A_NAME_OF_MORE_THAN_FORTY_CHARACTERS_IN_ALL";
        let text = table(&["action", "effects"], &[&[name, name], &[name, "B"]]);
        let expected =
            format!("- action : {name}\n  effects: {name}\n- action : {name}\n  effects: B\n");
        assert_eq!(text, expected);
    }

    #[test]
    fn a_long_table_that_fits_no_line_is_split() {
        let heads: Vec<String> = (0..9).map(|c| format!(">NUMBER_OF_COLUMN_{c}")).collect();
        let heads: Vec<&str> = heads.iter().map(String::as_str).collect();
        let mut grid = Grid::new(&heads);
        for row in 0..20 {
            grid.row((0..9).map(|column| (1000 * row + column).to_string()));
        }
        let text = grid.to_string();
        assert!(text.lines().all(|line| line.chars().count() <= 80), "{text}");
        assert_eq!(text.matches("|  # |").count(), 3, "{text}");
        assert_eq!(text.matches("| 20 |").count(), 3, "{text}");
        for cell in ["NUMBER_OF_COLUMN_0", "NUMBER_OF_COLUMN_8", " 19008 |", " 0 |"] {
            assert_eq!(text.matches(cell).count(), 1, "{cell} in {text}");
        }
        // With a word that fits nowhere it is a list.
        grid.row(["A".repeat(90)]);
        assert!(grid.to_string().starts_with("- NUMBER_OF_COLUMN_0: 0\n"));
    }

    #[test]
    fn numbers_are_broken_last() {
        let prose = "words ".repeat(30);
        let interval = "1.7454 to 2.3733";
        let text = table(&["about", ">95% interval"], &[&[&prose, interval]]);
        assert!(text.contains(interval), "{text}");
    }

    #[test]
    fn prose_is_broken_between_words_and_indented() {
        let text = wrapped(&"word ".repeat(40), 4);
        assert!(text.lines().all(|line| line.len() <= 80), "{text}");
        assert!(text.lines().skip(1).all(|line| line.starts_with("    word")), "{text}");
    }
}
