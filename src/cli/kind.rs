//! What a file is and which command takes it. Only the text itself is looked at, never the name of the file.

use std::path::Path;

use anyhow::Error;
use symbolt::files::{FileError, Limit, read_beginning, read_file};
use symbolt::neurons::SolvedModel;
use symbolt::task::tasks;

use super::end::BadArgument;

/// A kind of file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    Domain,
    Scene,
    Recording,
    Task,
    /// Settings of a task.
    Settings,
    /// What a log means.
    Mapping,
    PddlDomain,
    PddlProblem,
    /// A domain and a problem in one file.
    Pddl,
    Trajectory,
    /// Solved populations.
    Model,
    /// A table, or a log of another program that `import` reads.
    Log(&'static str),
    /// A file of a result folder, or what a command prints with `--json`.
    Result(&'static str),
    /// A kind that no command takes.
    Other(&'static str),
    /// JSON that is none of the other kinds.
    Json,
}

/// What `bench` takes to compare with.
pub(crate) const BENCHED: Kind = Kind::Result("what `bench --json` prints");

const PROGRAM: Kind = Kind::Other("a program");
const SCRIPT: Kind = Kind::Other("a script");
const UTF_16: Kind = Kind::Other("text in UTF-16, not UTF-8");

/// How a file begins by which its format is known: the offset, the bytes, and what it is.
const MAGIC: [(usize, &[u8], Kind); 25] = [
    (0, b"\x89HDF\r\n\x1a\n", Kind::Log("a log in HDF5")),
    (0, b"\x89MCAP", Kind::Log("a log in MCAP")),
    (0, b"#ROSBAG", Kind::Other("a bag of ROS 1 (convert it to MCAP)")),
    (0, b"SQLite format 3", Kind::Other("a database of SQLite (convert a bag to MCAP)")),
    (0, b"\x93NUMPY", Kind::Other("an array of NumPy")),
    (0, b"PK\x03\x04", Kind::Other("an archive (zip or npz)")),
    (0, b"PK\x05\x06", Kind::Other("an empty archive (zip)")),
    (0, b"\x1f\x8b", Kind::Other("an archive (gzip); unpack it first")),
    (0, b"\x28\xb5\x2f\xfd", Kind::Other("an archive (zstd); unpack it first")),
    (0, b"\xfd7zXZ", Kind::Other("an archive (xz); unpack it first")),
    (0, b"BZh", Kind::Other("an archive (bzip2); unpack it first")),
    (0, b"7z\xbc\xaf", Kind::Other("an archive (7z); unpack it first")),
    (257, b"ustar", Kind::Other("an archive (tar); unpack it first")),
    (0, b"PAR1", Kind::Other("a table in Parquet (convert it to CSV)")),
    (0, b"\x89PNG", Kind::Other("a picture (PNG)")),
    (0, b"\xff\xd8\xff", Kind::Other("a picture (JPEG)")),
    (0, b"GIF8", Kind::Other("a picture (GIF)")),
    (4, b"ftyp", Kind::Other("a film")),
    (0, b"%PDF", Kind::Other("a document (PDF)")),
    (0, b"\x7fELF", PROGRAM),
    (0, b"\xcf\xfa\xed\xfe", PROGRAM),
    (0, b"#!", SCRIPT),
    (0, b"\x80\x04\x95", Kind::Other("an object of Python (pickle)")),
    (0, b"\xff\xfe", UTF_16),
    (0, b"\xfe\xff", UTF_16),
];

/// Returns whether bytes are no text: they have a NUL, or neither are UTF-8 nor lack other control characters.
fn is_binary(bytes: &[u8]) -> bool {
    // The bytes may end within a character.
    let utf_8 = std::str::from_utf8(bytes).map_or_else(|e| e.error_len().is_none(), |_| true);
    let control = |b: &u8| matches!(b, 1..=8 | 14..=26 | 28..=31);
    bytes.contains(&0) || (!utf_8 && bytes.iter().any(control))
}

/// Formats that JSON files name, and their kinds.
const FORMATS: [(&str, Kind); 6] = [
    ("symbolt-domain", Kind::Domain),
    ("symbolt-task", Kind::Task),
    ("symbolt-import", Kind::Mapping),
    ("symbolt-run", Kind::Result("the settings and results of a run")),
    ("symbolt-trials", Kind::Result("a journal of trials")),
    ("symbolt-solved", Kind::Model),
];

/// Keys of JSON files without a format. All of them stand in the file.
const KEYS: [(&[&str], Kind); 7] = [
    (&["next_merge_m", "operators"], Kind::Result("what `learn --json` prints")),
    (&["cells", "question"], Kind::Result("the results of an experiment")),
    (&["episode", "decision"], Kind::Result("the trace of a run")),
    (&["status", "plan"], Kind::Result("what `plan --json` prints")),
    (&["model", "ns_per_neuron_step"], BENCHED),
    (&["demo", "state", "id"], Kind::Result("what `classify --json` prints")),
    (&["episodes", "assembled"], Kind::Result("what `run --json` prints")),
];

/// What a file is.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Found {
    pub kind: Kind,
    /// The first keys of a JSON object.
    pub keys: Vec<String>,
    /// The line in which the text ends inside of an object or a list.
    pub cut: Option<usize>,
}

impl Kind {
    /// Recognises a file by its bytes, or by the first of them.
    pub fn of(bytes: &[u8]) -> Found {
        let found = |kind| Found { kind, keys: Vec::new(), cut: None };
        if SolvedModel::recognises(bytes) {
            return found(Self::Model);
        }
        let magic = MAGIC
            .iter()
            .find(|(at, magic, _)| bytes.get(*at..).is_some_and(|rest| rest.starts_with(magic)));
        if let Some((_, _, kind)) = magic {
            return found(*kind);
        }
        let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
        let text = bytes.trim_ascii_start();
        match text.first() {
            None => found(Self::Other("empty")),
            Some(b'{') => Self::of_json(bytes),
            Some(b'[') => found(Self::Other(match text[1..].trim_ascii_start().first() {
                Some(b'a'..=b'z' | b'A'..=b'Z' | b'[') if text[1..].contains(&b'=') => {
                    "a text in TOML"
                }
                _ => "a list in JSON",
            })),
            Some(b'(' | b';') => Self::of_lists(bytes),
            Some(b'<') => found(Self::of_markup(text)),
            _ if is_binary(bytes) => found(Self::Other("a binary file")),
            _ => found(Self::of_lines(text)),
        }
    }

    fn of_json(bytes: &[u8]) -> Found {
        let head = Head::of(bytes);
        let has = |key: &str| head.keys.iter().any(|own| own == key);
        let rest = head.end.map_or(&b""[..], |end| bytes[end..].trim_ascii());
        // An object in each line.
        let lines = rest.first() == Some(&b'{');
        let open = match (head.end, lines) {
            (None, _) => true,
            (_, true) => {
                let last = rest.rsplit(|b| *b == b'\n').find(|line| !line.trim_ascii().is_empty());
                last.is_some_and(|last| Head::of(last).end.is_none())
            }
            _ => false,
        };
        let cut = open.then(|| 1 + bytes.trim_ascii_end().iter().filter(|b| **b == b'\n').count());
        let named = head.format.as_ref().and_then(|own| FORMATS.iter().find(|(f, _)| f == own));
        let single = rest.is_empty() && (!has("demo") || bytes.trim_ascii().contains(&b'\n'));
        let kind = match named {
            Some((_, kind)) => *kind,
            None if has("format") => Self::Json,
            None if has("objects") && single && cut.is_none() => Self::Scene,
            None if has("objects") || has("demo") && has("snapshot") => Self::Recording,
            None => {
                let known = KEYS.iter().find(|(keys, _)| keys.iter().all(|key| has(key)));
                known.map_or_else(|| Self::of_keys(&head.keys), |(_, kind)| *kind)
            }
        };
        Found { kind, keys: head.keys, cut }
    }

    /// Recognises the settings of a task by their first key.
    fn of_keys(keys: &[String]) -> Self {
        let tasks = tasks::all().unwrap_or_default();
        let first = keys.first();
        let known = |key: &String| tasks.iter().any(|task| task.settings().get(key).is_some());
        if first.is_some_and(known) { Self::Settings } else { Self::Json }
    }

    /// Recognises what is written in parentheses.
    fn of_lists(bytes: &[u8]) -> Found {
        let (mut depth, mut words, mut comment) = (0_usize, Vec::new(), false);
        let (mut has, mut word) = ([false; 3], Vec::new());
        for byte in bytes {
            match byte {
                b'\n' => comment = false,
                _ if comment => continue,
                b';' => comment = true,
                _ => {}
            }
            if byte.is_ascii_whitespace() || matches!(byte, b'(' | b')' | b';') {
                if !word.is_empty() && depth <= 2 && words.len() < 3 {
                    words.push(std::mem::take(&mut word));
                }
                word.clear();
                depth = match byte {
                    b'(' => depth + 1,
                    b')' => depth.saturating_sub(1),
                    _ => depth,
                };
                let is = |at: usize, name: &[u8]| {
                    words.get(at).is_some_and(|word: &Vec<u8>| word.eq_ignore_ascii_case(name))
                };
                has[0] |= is(0, b"define") && is(1, b"domain");
                has[1] |= is(0, b"define") && is(1, b"problem");
                has[2] |= [&b":trajectory"[..], b":objects", b":init", b":state"]
                    .iter()
                    .any(|name| is(0, name));
                if depth == 0 {
                    words.clear();
                }
            } else if word.len() < 20 {
                word.push(*byte);
            }
        }
        let kind = match has {
            [true, true, _] => Self::Pddl,
            [true, ..] => Self::PddlDomain,
            [_, true, _] => Self::PddlProblem,
            [.., true] => Self::Trajectory,
            _ if bytes.contains(&b'(') => Self::Other("text in parentheses, but no PDDL"),
            _ => Self::Other("text"),
        };
        let cut =
            (depth > 0).then(|| 1 + bytes.trim_ascii_end().iter().filter(|b| **b == b'\n').count());
        Found { kind, keys: Vec::new(), cut }
    }

    fn of_markup(text: &[u8]) -> Self {
        let start = String::from_utf8_lossy(&text[..text.len().min(2_000)]).to_lowercase();
        let known = [
            ("<!doctype html", "a page (HTML)"),
            ("<html", "a page (HTML)"),
            ("<svg", "a picture (SVG)"),
            ("<robot", "a robot (URDF)"),
            ("<sdf", "a world (SDF)"),
            ("<mujoco", "a world (MJCF)"),
        ];
        let known = known.iter().find(|(tag, _)| start.contains(tag));
        Self::Other(known.map_or("a text in XML", |(_, what)| what))
    }

    /// Recognises a table by lines of equally many cells.
    fn of_lines(text: &[u8]) -> Self {
        let mut lines = text.split(|b| *b == b'\n').filter(|line| !line.trim_ascii().is_empty());
        let (first, second) = (lines.next().unwrap_or(b""), lines.next());
        for separator in *b",;\t" {
            let cells = |line: &[u8]| line.iter().filter(|b| **b == separator).count();
            if cells(first) > 0 && second.is_none_or(|line| cells(line) == cells(first)) {
                return Self::Log("a table (CSV)");
            }
        }
        let key = first.iter().position(|b| *b == b':').unwrap_or(0);
        let yaml = key > 0
            && first[..key].iter().all(|b| b.is_ascii_alphanumeric() || *b == b'_')
            && matches!(first.get(key + 1), None | Some(b' ' | b'\r'));
        if yaml || first.starts_with(b"---") {
            Self::Other("a text in YAML")
        } else {
            Self::Other("text")
        }
    }

    /// Returns whether the file can be run.
    pub fn is_program(self) -> bool {
        [PROGRAM, SCRIPT].contains(&self)
    }

    /// Returns the kind in words, with its article.
    pub fn name(self) -> &'static str {
        match self {
            Self::Domain => "a learned domain",
            Self::Scene => "a scene",
            Self::Recording => "a recording",
            Self::Task => "a task file",
            Self::Settings => "the settings of a task",
            Self::Mapping => "a mapping for `import`",
            Self::PddlDomain => "a domain in PDDL",
            Self::PddlProblem => "a problem in PDDL",
            Self::Pddl => "a domain and a problem in PDDL",
            Self::Trajectory => "a trajectory in PDDL",
            Self::Model => "a model of solved populations",
            Self::Log(what) | Self::Result(what) | Self::Other(what) => what,
            Self::Json => "JSON of another program",
        }
    }

    /// Returns which command takes such a file, if any does.
    fn usage(self, file: &str) -> Option<String> {
        let usage = match self {
            Self::Domain => format!("plan {file} --scene SCENE"),
            Self::Scene => format!("plan DOMAIN --scene {file}"),
            Self::Recording => format!("learn {file}"),
            Self::Task => format!("run --task-file {file}"),
            Self::Settings => format!("run --config {file}"),
            Self::Mapping => format!("import LOG --map {file}"),
            Self::PddlDomain => format!("plan {file} PROBLEM"),
            Self::PddlProblem => format!("plan DOMAIN {file}"),
            Self::Pddl => format!("plan {file}"),
            Self::Trajectory => format!("learn-model DOMAIN {file}"),
            Self::Model => format!("bench NETWORK --load {file}"),
            Self::Log(_) => format!("import {file}"),
            _ if self == BENCHED => format!("bench NETWORK --compare {file}"),
            Self::Result(_) => {
                return Some("`symbolt report FOLDER` shows the folder of a run".into());
            }
            Self::Other(_) | Self::Json => return None,
        };
        Some(format!("`symbolt {usage}` takes it"))
    }
}

/// The keys of a JSON object at the beginning of a text, which may be cut or faulty further on.
#[derive(Default)]
struct Head {
    keys: Vec<String>,
    /// The text of the key `format`.
    format: Option<String>,
    /// Where the object ends.
    end: Option<usize>,
}

/// Greatest number of keys that are kept, and of their bytes.
const MOST_KEYS: [usize; 2] = [100, 100];

impl Head {
    fn of(bytes: &[u8]) -> Self {
        let (mut head, mut depth, mut at) = (Self::default(), 0_i64, 0);
        // The key whose value comes next.
        let mut key: Option<String> = None;
        while let Some(byte) = bytes.get(at) {
            match byte {
                b'"' => {
                    let start = at + 1;
                    at = start;
                    while bytes.get(at).is_some_and(|b| *b != b'"') {
                        at += if bytes[at] == b'\\' { 2 } else { 1 };
                    }
                    let Some(text) = bytes.get(start..at).filter(|_| at < bytes.len()) else {
                        break;
                    };
                    if depth == 1 {
                        let text = String::from_utf8_lossy(&text[..text.len().min(MOST_KEYS[1])]);
                        let next = bytes[at + 1..].trim_ascii_start().first();
                        match &key {
                            None if next == Some(&b':') => key = Some(text.into_owned()),
                            Some(key) if key == "format" => head.format = Some(text.into_owned()),
                            _ => {}
                        }
                    }
                }
                b'{' | b'[' => depth += 1,
                b'}' | b']' => depth -= 1,
                _ => {}
            }
            if depth <= 1 && matches!(byte, b',' | b'}') && head.keys.len() < MOST_KEYS[0] {
                head.keys.extend(key.take());
            }
            at += 1;
            if depth == 0 && matches!(byte, b'}' | b']') {
                head.end = Some(at);
                return head;
            }
        }
        head.keys.extend(key);
        head
    }
}

/// A file that a command was given, and the kinds that it may be of.
#[derive(Clone, Copy)]
pub(crate) struct Given<'a> {
    pub path: &'a Path,
    pub takes: &'a [Kind],
}

/// Reads a file of a command with `parse`. If that fails and the file is of a kind that the command does not take, the
/// error says of which, and which command takes it. `others` are the other files of the command, which may be swapped
/// with this one.
///
/// # Errors
/// [`BadArgument`] for a file of another kind; otherwise the error of reading, or that of `parse`.
pub(crate) fn parsed<T, E: Into<Error>>(
    given: Given<'_>,
    limit: Limit,
    others: &[Given<'_>],
    parse: impl FnOnce(&[u8], &str) -> Result<T, E>,
) -> Result<T, Error> {
    let bytes = given.read(limit, others)?;
    given.parsed(&bytes, others, parse)
}

/// Returns the first bytes of a file.
pub(crate) fn beginning(path: &Path) -> Option<Vec<u8>> {
    read_beginning(path, 1 << 16).ok()
}

/// Says what a folder has that was probably meant.
fn of_folder(given: Given<'_>) -> Option<BadArgument> {
    let files = [
        (Kind::Domain, "domain.json"),
        (Kind::Recording, "recording.jsonl"),
        (Kind::Scene, "scene.json"),
        (Kind::PddlDomain, "domain.pddl"),
        (Kind::PddlProblem, "problem.pddl"),
    ];
    let folder = given.path;
    let meant = files.iter().find(|(kind, name)| given.fits(*kind) && folder.join(name).is_file());
    meant.map(|(kind, name)| {
        let (own, file) = (folder.display(), folder.join(name));
        BadArgument(format!("{own} is a folder; {} in it is {}", kind.name(), file.display()))
    })
}

impl Given<'_> {
    fn fits(self, kind: Kind) -> bool {
        self.takes
            .iter()
            .any(|own| *own == kind || matches!((own, kind), (Kind::Log(_), Kind::Log(_))))
    }

    fn fits_pddl(self) -> bool {
        [Kind::PddlDomain, Kind::PddlProblem, Kind::Trajectory].iter().any(|kind| self.fits(*kind))
    }

    /// Reads the file. See [`parsed`].
    pub fn read(self, limit: Limit, others: &[Given<'_>]) -> Result<Vec<u8>, Error> {
        read_file(self.path, limit).map_err(|error| {
            let other = match &error {
                _ if self.path.is_dir() => of_folder(self),
                FileError::TooLarge { .. } => beginning(self.path)
                    .map(|start| Kind::of(&start).kind)
                    .filter(|kind| !self.fits(*kind))
                    .map(|kind| self.other(kind, others)),
                _ => None,
            };
            other.map_or_else(|| error.into(), Error::from)
        })
    }

    /// Parses the bytes of the file. See [`parsed`].
    pub fn parsed<T, E: Into<Error>>(
        self,
        bytes: &[u8],
        others: &[Given<'_>],
        parse: impl FnOnce(&[u8], &str) -> Result<T, E>,
    ) -> Result<T, Error> {
        parse(bytes, &self.path.display().to_string()).map_err(|error| {
            let Found { kind, cut, .. } = Kind::of(bytes);
            // A scene may say of which demonstration it is, so that it is a recording of one line.
            let one = kind == Kind::Recording && !bytes.trim_ascii().contains(&b'\n');
            match (cut, self.fits(kind) || one && self.fits(Kind::Scene)) {
                // The reader of PDDL tells the place where the list begins.
                (Some(line), true) if bytes.trim_ascii_start().first() == Some(&b'{') => {
                    let (file, what) = (self.path.display(), kind.name());
                    let problem = format!(
                        "{file}, line {line}: {what} that is cut off here, before its last bracket"
                    );
                    BadArgument(problem).into()
                }
                // PDDL may be in UTF-16.
                _ if kind == UTF_16 && self.fits_pddl() => error.into(),
                // The fault says more of JSON that may be of the right kind.
                (_, false) if kind != Kind::Json || cut.is_some() => {
                    self.other(kind, others).into()
                }
                _ => error.into(),
            }
        })
    }

    /// Says that the file is of another kind.
    fn other(self, kind: Kind, others: &[Given<'_>]) -> BadArgument {
        let file = self.path.display().to_string();
        let mut takes: Vec<&str> = self.takes.iter().map(|kind| kind.name()).collect();
        takes.dedup();
        let wanted = match &takes[..] {
            [rest @ .., last] if !rest.is_empty() => format!("{} or {last}", rest.join(", ")),
            takes => takes.concat(),
        };
        for other in others.iter().filter(|other| other.fits(kind)) {
            let second = other.path.display();
            let found = beginning(other.path).map(|start| Kind::of(&start).kind);
            if let Some(found) = found.filter(|found| self.fits(*found)) {
                let [own, its] = [kind, found].map(|kind| kind.name().trim_end_matches(" in PDDL"));
                return BadArgument(format!(
                    "the first file, {file}, is {own} and the second, {second}, {its}; swap them"
                ));
            }
        }
        let name = if file == "-" { "standard input" } else { &*file };
        let usage = kind.usage(&file).map_or_else(String::new, |usage| format!("; {usage}"));
        BadArgument(format!("{name} is {}; expected {wanted}{usage}", kind.name()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_are_recognised_by_what_they_hold() {
        let cases: [(&[u8], Kind); 28] = [
            (b"", Kind::Other("empty")),
            (b" \n", Kind::Other("empty")),
            (b"{\"format\": \"symbolt-domain\", \"version\": 3}", Kind::Domain),
            (
                b"{\"version\": 3, \"states\": [{\"format\": 1}], \"format\":\"symbolt-task\"}",
                Kind::Task,
            ),
            (b"{\"format\": \"symbolt-import\"}", Kind::Mapping),
            (b"\xef\xbb\xbf{\"objects\": []}", Kind::Scene),
            (b"{\"demo\": 0,\n \"objects\": []}", Kind::Scene),
            (b"{\"demo\": 0, \"objects\": []}", Kind::Recording),
            (b"{\"demo\": 0, \"objects\": []}\n{\"demo\": 0}", Kind::Recording),
            (b"{\"nuts\": 1}", Kind::Settings),
            (b"{\"a\": \"format\"}", Kind::Json),
            (b"{\"\\\"format\": \"symbolt-domain\"}", Kind::Json),
            (b"[1, 2]", Kind::Other("a list in JSON")),
            (b"[package]\nname = 1", Kind::Other("a text in TOML")),
            (b"; one\n(DEFINE (Domain d))", Kind::PddlDomain),
            (b"(define ; (domain\n (problem p) (:domain d))", Kind::PddlProblem),
            (b"(define (problem p)) (define\n(domain d))", Kind::Pddl),
            (b"(:trajectory (:objects a) (:init))", Kind::Trajectory),
            (b"(move a b)", Kind::Other("text in parentheses, but no PDDL")),
            (b"t,x,y\n0,1,2\n", Kind::Log("a table (CSV)")),
            (b"t;x\r\n0;1\r\n", Kind::Log("a table (CSV)")),
            (b"<?xml version='1'?><robot name='a'>", Kind::Other("a robot (URDF)")),
            (b"name: a\nparts:\n", Kind::Other("a text in YAML")),
            (b"Dear all,\nhow are you", Kind::Other("text")),
            (b"a\0b", Kind::Other("a binary file")),
            (b"R\xc5\xb5\xbf\xa3\x17J", Kind::Other("a binary file")),
            (b"t,x,y\n0,1,2\n\x1a", Kind::Log("a table (CSV)")),
            (b"caf\xe9\x1b[1m au lait", Kind::Other("text")),
        ];
        for (bytes, kind) in cases {
            assert_eq!(Kind::of(bytes).kind, kind, "{}", String::from_utf8_lossy(bytes));
        }
    }

    #[test]
    fn a_text_that_is_cut_ends_in_a_line() {
        let cut = |text: &str| Kind::of(text.as_bytes()).cut;
        assert_eq!(cut("{\"format\": \"symbolt-domain\",\n\"states\": [{\"name\":\"}"), Some(2));
        assert_eq!(cut("{\"demo\": 0}\n{\"demo\": 1}\n{\"dem"), Some(3));
        assert_eq!(cut("(define (domain d)\n(:action"), Some(2));
        for whole in [
            "{}",
            "{\"a\": \"{\"}\n",
            "{\"demo\": 0}\n{\"demo\": 1}\n\n",
            "(define (domain d)) ; (",
        ] {
            assert_eq!(cut(whole), None, "{whole}");
        }
    }
}
