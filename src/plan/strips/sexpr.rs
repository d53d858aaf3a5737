//! Lists in parentheses with the place of every word, and the errors that name a place.

use std::borrow::Cow;
use std::cell::RefCell;
use std::collections::HashSet;

use thiserror::Error;

use crate::sim::{cut, is_plain};

/// Greatest length of a text, in bytes: 64 MiB.
const MAX_BYTES: usize = 64 << 20;

/// Greatest number of words and parentheses in a text.
const MAX_NODES: usize = 3_000_000;

/// Greatest number of lists inside each other.
const MAX_DEPTH: usize = 64;

/// A fault in a PDDL file or trajectory: where it is, what was found and what was expected.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("{file}, line {line}, column {column}: {problem}; expected {expected}")]
pub struct PddlFault {
    /// Name of the file, or another name for the source of the text.
    pub file: String,
    /// Line, counted from 1.
    pub line: usize,
    /// Column in characters, counted from 1.
    pub column: usize,
    /// What was found.
    pub problem: String,
    /// What was expected instead.
    pub expected: String,
}

/// A place in a text.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Place {
    pub line: usize,
    pub column: usize,
}

/// A word or a list.
#[derive(Debug, Clone)]
pub(super) struct Node {
    pub place: Place,
    pub content: Content,
}

/// Content of a node. Words are in lower case.
#[derive(Debug, Clone)]
pub(super) enum Content {
    Word(String),
    List(Vec<Node>),
}

impl Node {
    pub fn word(&self) -> Option<&str> {
        match &self.content {
            Content::Word(word) => Some(word),
            Content::List(_) => None,
        }
    }

    pub fn list(&self) -> Option<&[Node]> {
        match &self.content {
            Content::List(nodes) => Some(nodes),
            Content::Word(_) => None,
        }
    }

    /// Returns the first word of a list.
    pub fn head(&self) -> Option<&str> {
        self.list()?.first()?.word()
    }

    /// Describes the node for an error message: a word, or the beginning of a list.
    pub fn shown(&self) -> String {
        match &self.content {
            Content::Word(word) => format!("`{}`", short(word)),
            Content::List(nodes) if nodes.is_empty() => "`()`".into(),
            Content::List(_) => match self.head() {
                Some(head) => format!("`({} ...)`", short(head)),
                None => "`((...`".into(),
            },
        }
    }
}

pub(super) fn short(word: &str) -> String {
    cut(word, 60).into_owned()
}

/// Greatest number of warnings about a text.
const MAX_WARNINGS: usize = 20;

/// Warnings about a text.
#[derive(Debug, Default)]
pub(super) struct Notes(RefCell<(Vec<String>, HashSet<String>)>);

impl Notes {
    /// Returns the warnings, in the order in which they were found.
    pub fn into_warnings(self) -> Vec<String> {
        let (mut warnings, said) = self.0.into_inner();
        let left_out = said.len() - warnings.len();
        if left_out > 0 {
            warnings.push(format!("and {left_out} further warnings"));
        }
        warnings
    }
}

/// A text that is being read, for its errors and warnings.
#[derive(Debug, Clone, Copy)]
pub(super) struct Source<'a> {
    pub file: &'a str,
    pub notes: &'a Notes,
}

impl Source<'_> {
    /// Builds the error for a place.
    pub fn fault(
        &self,
        place: Place,
        problem: impl Into<String>,
        expected: impl Into<String>,
    ) -> PddlFault {
        PddlFault {
            file: self.file.to_owned(),
            line: place.line,
            column: place.column,
            problem: problem.into(),
            expected: expected.into(),
        }
    }

    /// Warns about a place. The same is said once.
    pub fn warn(&self, place: Place, what: impl Into<String>) {
        let what = what.into();
        let (warnings, said) = &mut *self.notes.0.borrow_mut();
        if said.len() < MAX_WARNINGS && !said.contains(&what) {
            let Place { line, column } = place;
            warnings.push(format!("{}, line {line}, column {column}: {what}", self.file));
        }
        said.insert(what);
    }

    /// Warns of sections that are there twice and are read as one.
    pub fn warn_of_repeated(&self, sections: &[Node], names: &[&str]) {
        for name in names {
            if let Some(again) = sections.iter().filter(|s| s.head() == Some(*name)).nth(1) {
                self.warn(again.place, format!("a second `({name} ...)`; both are read as one"));
            }
        }
    }

    /// Returns the text, which may be in Latin-1 or UTF-16.
    fn decoded<'b>(&self, bytes: &'b [u8]) -> Cow<'b, str> {
        let start = Place { line: 1, column: 1 };
        let wide = match bytes {
            [0xff, 0xfe, rest @ ..] => Some((rest, u16::from_le_bytes as fn([u8; 2]) -> u16)),
            [0xfe, 0xff, rest @ ..] => Some((rest, u16::from_be_bytes as fn([u8; 2]) -> u16)),
            _ => None,
        };
        if let Some((rest, number)) = wide {
            self.warn(start, "the text is UTF-16, not UTF-8");
            let units = rest.as_chunks::<2>().0.iter().map(|pair| number(*pair));
            let read = char::decode_utf16(units);
            return read
                .map(|c| c.unwrap_or(char::REPLACEMENT_CHARACTER))
                .collect::<String>()
                .into();
        }
        match std::str::from_utf8(bytes) {
            Ok(text) => Cow::Borrowed(text),
            Err(error) => {
                let good = String::from_utf8_lossy(&bytes[..error.valid_up_to()]);
                let what = "a byte is no character of UTF-8; the text is read as Latin-1";
                self.warn(after(start, &good), what);
                bytes.iter().map(|byte| char::from(*byte)).collect::<String>().into()
            }
        }
    }

    /// Reads all lists of a text. Comments begin with `;` and end with the line.
    pub fn nodes(&self, bytes: &[u8]) -> Result<Vec<Node>, PddlFault> {
        let start = Place { line: 1, column: 1 };
        if bytes.len() > MAX_BYTES {
            let problem = format!("the text has {} bytes", bytes.len());
            return Err(self.fault(start, problem, format!("at most {MAX_BYTES} bytes")));
        }
        let text = self.decoded(bytes);
        // Some editors begin a text with a byte order mark.
        let text = text.strip_prefix('\u{feff}').unwrap_or(&text);
        let mut open: Vec<(Place, Vec<Node>)> = Vec::new();
        let mut done = Vec::new();
        let mut count = 0;
        for (place, word) in (Words { rest: text, place: start }) {
            let whole = word;
            let word = word.trim_end_matches(',');
            if word != whole {
                self.warn(place, format!("the comma in `{}` is ignored", short(whole)));
            }
            if word.is_empty() {
                continue;
            }
            // A word is several if it has no space before a question mark.
            let inner = word.match_indices('?').map(|(at, _)| at).filter(|at| *at > 0);
            let inner: Vec<usize> = inner.take(MAX_NODES).collect();
            count += 1 + inner.len();
            if count > MAX_NODES {
                let expected = format!("at most {MAX_NODES}, or several files");
                return Err(self.fault(
                    place,
                    "the text has too many words and parentheses",
                    expected,
                ));
            }
            let node = match word {
                "(" => {
                    if open.len() == MAX_DEPTH {
                        let problem = format!("lists are nested more than {MAX_DEPTH} deep");
                        return Err(self.fault(place, problem, "a shallower list"));
                    }
                    open.push((place, Vec::new()));
                    continue;
                }
                ")" => match open.pop() {
                    Some((place, nodes)) => Node { place, content: Content::List(nodes) },
                    None => {
                        return Err(self.fault(place, "`)` closes no list", "`(` before it"));
                    }
                },
                // Names are printed, and a terminal obeys control characters.
                word if !is_plain(word) => {
                    let problem = format!("the word {word:?} has a control character");
                    return Err(self.fault(place, short(&problem), "letters, digits and signs"));
                }
                word if !inner.is_empty() => {
                    self.warn(place, format!("a space is missing before `?` in `{}`", short(word)));
                    let ends = inner.iter().copied().chain([word.len()]);
                    let mut place = place;
                    for (from, to) in [0].into_iter().chain(inner.iter().copied()).zip(ends) {
                        let part = word[from..to].trim_end_matches(',');
                        let content = Content::Word(part.to_lowercase());
                        let node = Node { place, content };
                        open.last_mut().map_or(&mut done, |(_, nodes)| nodes).push(node);
                        place = after(place, &word[from..to]);
                    }
                    continue;
                }
                word => Node { place, content: Content::Word(word.to_lowercase()) },
            };
            match open.last_mut() {
                Some((_, nodes)) => nodes.push(node),
                None => done.push(node),
            }
        }
        match open.pop() {
            Some((place, _)) => Err(self.fault(place, "this list is not closed", "`)`")),
            None => Ok(done),
        }
    }
}

/// Returns the place after a text that begins at `place`.
fn after(place: Place, text: &str) -> Place {
    let lines = text.matches('\n').count();
    let last = text.rsplit('\n').next().unwrap_or("").chars().count();
    let column = if lines == 0 { place.column + last } else { last + 1 };
    Place { line: place.line + lines, column }
}

/// The parentheses and words of a text.
struct Words<'a> {
    rest: &'a str,
    place: Place,
}

impl<'a> Words<'a> {
    fn take(&mut self, bytes: usize) -> &'a str {
        let (taken, rest) = self.rest.split_at(bytes);
        self.rest = rest;
        self.place = after(self.place, taken);
        taken
    }
}

impl<'a> Iterator for Words<'a> {
    type Item = (Place, &'a str);

    fn next(&mut self) -> Option<Self::Item> {
        loop {
            let blank = self.rest.find(|c: char| !c.is_whitespace()).unwrap_or(self.rest.len());
            self.take(blank);
            let first = self.rest.chars().next()?;
            let place = self.place;
            if first == ';' {
                let line = self.rest.find('\n').unwrap_or(self.rest.len());
                self.take(line);
                continue;
            }
            if first == '(' || first == ')' {
                return Some((place, self.take(1)));
            }
            let ends = |c: char| c.is_whitespace() || matches!(c, '(' | ')' | ';');
            let word = self.rest.find(ends).unwrap_or(self.rest.len());
            return Some((place, self.take(word)));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<Vec<Node>, PddlFault> {
        Source { file: "x.pddl", notes: &Notes::default() }.nodes(text.as_bytes())
    }

    #[test]
    fn words_lists_and_comments_have_their_places() {
        let nodes = read("\u{feff}(A ; not this (\n  (b?c)) d").expect("sound");
        assert_eq!(nodes.len(), 2);
        assert_eq!(nodes[0].head(), Some("a"));
        let inner = &nodes[0].list().expect("a list")[1];
        assert_eq!((inner.place.line, inner.place.column), (2, 3));
        assert_eq!(nodes[1].word(), Some("d"));
        assert_eq!(nodes[1].place, Place { line: 2, column: 10 });
    }
}
