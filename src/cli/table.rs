//! Tables and lists at most 80 columns wide, broken between words only.

use std::fmt::{self, Write as _};

/// Number of columns that every terminal has.
const WIDTH: usize = 80;

/// Maximum number of rows that are listed cell by cell if they are too wide for a table.
const LISTED: usize = 12;

/// Joins the words of a text so that a table breaks no line between them.
pub(crate) fn unbroken(text: &str) -> String {
    text.replace(' ', "\u{a0}")
}

/// Breaks a text into lines of at most 80 columns. All lines but the first are indented.
pub(crate) fn wrapped(text: &str, indent: usize) -> String {
    let lines = lines(text, WIDTH.saturating_sub(indent));
    shown(&lines.join(&format!("\n{:indent$}", "")))
}

/// Formats a count with its noun: `1 nut`, `2 nuts`.
pub(crate) fn counted(number: usize, what: &str) -> String {
    if number == 1 { format!("1 {what}") } else { format!("{number} {what}s") }
}

/// Lists names after a title, broken between names.
pub(crate) fn listed(title: &str, names: &[String]) -> String {
    let names: Vec<String> = names.iter().map(|name| unbroken(name)).collect();
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
    heads: Vec<String>,
    right: Vec<bool>,
    rows: Vec<Vec<String>>,
}

impl Grid {
    /// Makes an empty table. A heading that begins with `>` aligns its column to the right.
    pub fn new(columns: &[&str]) -> Self {
        Self {
            heads: columns.iter().map(|c| c.trim_start_matches('>').to_owned()).collect(),
            right: columns.iter().map(|c| c.starts_with('>')).collect(),
            rows: Vec::new(),
        }
    }

    pub fn row(&mut self, cells: impl IntoIterator<Item = String>) {
        let mut row: Vec<String> = cells.into_iter().collect();
        row.resize(self.heads.len(), String::new());
        self.rows.push(row);
    }

    pub fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }

    /// Returns whether no cell has to be broken.
    pub fn fits(&self) -> bool {
        let columns = 0..self.heads.len();
        columns.map(|c| self.widest(c, length, length)).sum::<usize>() + frame(self.heads.len())
            <= WIDTH
    }

    /// Returns the greatest length of a column's heading and cells.
    fn widest(&self, column: usize, head: fn(&str) -> usize, cell: fn(&str) -> usize) -> usize {
        let cells = self.rows.iter().map(|row| cell(&row[column]));
        cells.fold(head(&self.heads[column]), usize::max)
    }

    /// Returns the columns' widths, or `None` if the longest words alone are too wide for one line.
    fn widths(&self) -> Option<Vec<usize>> {
        let columns = 0..self.heads.len();
        // A column of numbers is broken only if nothing else helps.
        let whole: fn(&str) -> usize = length;
        let numbers = |c: usize| if self.right[c] { whole } else { longest_word };
        let least = columns.clone().map(|c| self.widest(c, longest_word, numbers(c))).collect();
        self.spread(least).or_else(|| {
            self.spread(columns.map(|c| self.widest(c, longest_word, longest_word)).collect())
        })
    }

    /// Widens the columns from their least widths until the line is full or no cell needs to be broken.
    fn spread(&self, mut widths: Vec<usize>) -> Option<Vec<usize>> {
        let room = WIDTH.checked_sub(frame(widths.len()))?;
        let mut spare = room.checked_sub(widths.iter().sum())?;
        let wanted = |c: usize| self.widest(c, length, length);
        let wanted: Vec<usize> = (0..widths.len()).map(wanted).collect();
        // The column with the most lines gets the next character.
        while spare > 0 {
            let short = (0..widths.len()).filter(|c| widths[*c] < wanted[*c]);
            let lines = |column: &usize| wanted[*column] * WIDTH / widths[*column].max(1);
            let Some(column) = short.max_by_key(lines) else { break };
            widths[column] += 1;
            spare -= 1;
        }
        Some(widths)
    }

    /// Splits a table into several tables, each with the rows' numbers; `None` if a single column is too wide.
    fn split(&self) -> Option<Vec<Self>> {
        let number = self.rows.len().to_string().len();
        let mut groups: Vec<Vec<usize>> = vec![Vec::new()];
        let mut used = number;
        for column in 0..self.heads.len() {
            let width = self.widest(column, longest_word, length).min(WIDTH - frame(2) - number);
            if self.widest(column, longest_word, longest_word) > width {
                return None;
            }
            let group = groups.last_mut()?;
            if used + width + frame(group.len() + 2) > WIDTH {
                groups.push(vec![column]);
                used = number;
            } else {
                group.push(column);
            }
            used += width;
        }
        let part = |group: &Vec<usize>| {
            let cells = |row: &[String]| group.iter().map(|c| row[*c].clone()).collect::<Vec<_>>();
            let number = |(index, row): (usize, &Vec<String>)| {
                [vec![(index + 1).to_string()], cells(row)].concat()
            };
            Self {
                heads: [vec!["#".to_owned()], cells(&self.heads)].concat(),
                right: std::iter::once(true).chain(group.iter().map(|c| self.right[*c])).collect(),
                rows: self.rows.iter().enumerate().map(number).collect(),
            }
        };
        Some(groups.iter().map(part).collect())
    }

    fn write_row(
        &self,
        f: &mut fmt::Formatter<'_>,
        cells: &[Vec<String>],
        widths: &[usize],
    ) -> fmt::Result {
        for line in 0..cells.iter().map(Vec::len).max().unwrap_or(0) {
            f.write_str("|")?;
            for ((cell, width), right) in cells.iter().zip(widths).zip(&self.right) {
                let text = shown(cell.get(line).map_or("", String::as_str));
                match right {
                    true => write!(f, " {text:>width$} |")?,
                    false => write!(f, " {text:<width$} |")?,
                }
            }
            writeln!(f)?;
        }
        Ok(())
    }

    /// Writes one line per cell: the heading and the value.
    fn write_list(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let width = self.heads.iter().map(|head| length(head)).max().unwrap_or(0);
        for (index, row) in self.rows.iter().enumerate() {
            if index > 0 {
                writeln!(f)?;
            }
            for (head, cell) in self.heads.iter().zip(row) {
                let line = unbroken(&format!("{head:<width$}: ")) + cell;
                writeln!(f, "{}", wrapped(&line, width + 2))?;
            }
        }
        Ok(())
    }
}

impl fmt::Display for Grid {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Some(widths) = self.widths() else {
            let parts = if self.rows.len() > LISTED { self.split() } else { None };
            let Some(parts) = parts else { return self.write_list(f) };
            let parts: Vec<String> = parts.iter().map(Self::to_string).collect();
            return f.write_str(&parts.join("\n"));
        };
        let broken = |row: &[String]| -> Vec<Vec<String>> {
            row.iter().zip(&widths).map(|(cell, width)| lines(cell, *width)).collect()
        };
        let head = broken(&self.heads);
        let rows: Vec<Vec<Vec<String>>> = self.rows.iter().map(|row| broken(row)).collect();
        // Lines often break before the width of their column, so the table can be narrower.
        let used = |column: usize| {
            let cells = rows.iter().chain([&head]).flat_map(|row| &row[column]);
            cells.map(|line| length(line)).max().unwrap_or(0)
        };
        let widths: Vec<usize> = (0..widths.len()).map(used).collect();
        self.write_row(f, &head, &widths)?;
        for width in &widths {
            write!(f, "|{:-<1$}", "", width + 2)?;
        }
        writeln!(f, "|")?;
        rows.iter().try_for_each(|row| self.write_row(f, row, &widths))
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
        let expected = format!("action : {name}\neffects: {name}\n\naction : {name}\neffects: B\n");
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
        assert!(grid.to_string().starts_with("NUMBER_OF_COLUMN_0: 0\n"));
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
