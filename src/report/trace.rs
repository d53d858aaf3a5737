//! `trace.jsonl`: every decision with its skill, every contact and release, and the end of every episode. Each line is
//! a JSON object.

use std::collections::{HashMap, VecDeque};
use std::fmt::Write as _;

use serde::{Deserialize, Serialize};
use serde_json::json;

use crate::robot::SkillReport;
use crate::task::event::{Decided, Displaced, Ended, EpisodeReport, Event, Observer, Touched};

/// How an episode ended.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct End {
    /// Reason why the episode ended.
    pub ended: Ended,
    /// Whether the task's judge counts the episode as solved.
    #[serde(rename = "assembled")]
    pub solved: bool,
    /// Simulated time of the end, in seconds.
    pub simulated_s: f64,
    /// Reason in words; empty in older traces.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub words: String,
    /// Ids of the parts that fell off the table.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub lost: Vec<String>,
}

/// A line of the trace: the number of an episode, and exactly one of the other fields.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Line {
    /// Number of the episode, counted from 0.
    pub episode: usize,
    /// Decision, with the skill that carried it out.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub decision: Option<Decided>,
    /// Finished skill. Only older traces have it on a line of its own; [`read`] moves it into its decision.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub skill: Option<SkillReport>,
    /// Contact of the fingers with a part, or release of a part.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub touch: Option<Touched>,
    /// Body that another hand than the robot's moved or took away.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub displaced: Option<Displaced>,
    /// End of the episode.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub end: Option<End>,
}

/// An observer that writes the lines of one episode when it ends: decisions first, then contacts and releases, then what another
/// hand changed, then the end.
#[derive(Debug, Clone, Default)]
pub struct Tracer {
    episode: usize,
    text: String,
}

impl Tracer {
    /// Creates the trace of an episode with this number, counted from 0.
    pub fn new(episode: usize) -> Self {
        Self { episode, ..Self::default() }
    }

    /// Returns the lines; none before the episode has ended.
    pub fn text(&self) -> &str {
        &self.text
    }

    fn put(&mut self, line: Line) {
        let _ = writeln!(self.text, "{}", json!(Line { episode: self.episode, ..line }));
    }
}

impl Observer for Tracer {
    fn observe(&mut self, event: &Event<'_>) {
        let Event::EpisodeEnded(report) = event else { return };
        let EpisodeReport { ended, ended_words, solved, simulated_s, lost, .. } = report;
        for decision in &report.decisions {
            self.put(Line { decision: Some(decision.clone()), ..Line::default() });
        }
        for touch in &report.touches {
            self.put(Line { touch: Some(*touch), ..Line::default() });
        }
        for displaced in &report.displaced {
            self.put(Line { displaced: Some(displaced.clone()), ..Line::default() });
        }
        let (ended, words, lost) = (ended.clone(), ended_words.clone(), lost.clone());
        let end = End { ended, words, solved: *solved, simulated_s: *simulated_s, lost };
        self.put(Line { end: Some(end), ..Line::default() });
    }
}

/// Maximum simulated length of an episode, in seconds.
pub(super) const MAX_EPISODE_S: f64 = 200_000.0;
/// Maximum number of episodes in a run.
const MAX_EPISODES: usize = 100_000;
/// Maximum length of a line, in bytes.
const MAX_LINE: usize = 1 << 20;
/// Maximum number of lines that are read.
const MAX_LINES: usize = 200_000;
/// Maximum number of state names in the decisions that are read.
const MAX_NAMES: usize = 2_000_000;

impl Line {
    /// Returns whether the episode's number and all times are in range.
    fn in_range(&self) -> bool {
        let moments = [
            self.decision.as_ref().map(|d| d.asked_s),
            self.decision.as_ref().map(|d| d.took_ms / 1e3),
            self.touch.as_ref().map(|t| t.t),
            self.displaced.as_ref().map(|displaced| displaced.t),
            self.end.as_ref().map(|e| e.simulated_s),
        ];
        self.episode < MAX_EPISODES
            && moments.iter().flatten().all(|s| (0.0..=MAX_EPISODE_S).contains(s))
    }
}

/// Reads the lines of a file up to the first damaged line. The second value says what is wrong with that line. Reads at
/// most 200,000 lines, whose decisions name at most 2,000,000 states; further lines are left out, and the second value
/// says so.
pub fn read(bytes: &[u8]) -> (Vec<Line>, Option<String>) {
    let mut lines: Vec<Line> = Vec::new();
    let mut open = OpenDecisions::default();
    let mut names = 0;
    for (index, line) in bytes.split(|b| *b == b'\n').enumerate() {
        if line.iter().all(u8::is_ascii_whitespace) {
            continue;
        }
        if lines.len() == MAX_LINES || names > MAX_NAMES {
            let problem = format!("only the first {} lines are shown", lines.len());
            return (lines, Some(problem));
        }
        let parsed = match line.len() {
            0..=MAX_LINE => serde_json::from_slice(line).map_err(|error| error.to_string()),
            long => Err(format!("it has {long} bytes; expected at most {MAX_LINE}")),
        };
        let in_range = |line: Line| match line.in_range() {
            true => Ok(line),
            false => Err("a time or the episode's number is out of range".to_owned()),
        };
        match parsed.and_then(in_range) {
            Ok(Line { episode, skill: Some(skill), .. }) => {
                open.close(&mut lines, episode, skill);
            }
            Ok(line) => {
                names += line.decision.as_ref().map_or(0, |decision| decision.holds.len());
                open.note(&line, lines.len());
                lines.push(line);
            }
            Err(error) => {
                let problem = format!(
                    "line {} is damaged ({error}); only the lines before it are shown",
                    index + 1
                );
                return (lines, Some(problem));
            }
        }
    }
    (lines, None)
}

/// The lines of decisions that were begun and have no skill yet, by episode and in the order of the file.
#[derive(Default)]
struct OpenDecisions(HashMap<usize, VecDeque<usize>>);

impl OpenDecisions {
    /// Notes a line that will have this index.
    fn note(&mut self, line: &Line, index: usize) {
        if line.decision.as_ref().is_some_and(|d| d.begun && d.skill.is_none()) {
            self.0.entry(line.episode).or_default().push_back(index);
        }
    }

    /// Moves a skill of an older trace into its decision: the episode's first decision that was begun and has no skill.
    fn close(&mut self, lines: &mut [Line], episode: usize, skill: SkillReport) {
        let index = self.0.get_mut(&episode).and_then(VecDeque::pop_front);
        let line = index.and_then(|index| lines.get_mut(index));
        if let Some(decision) = line.and_then(|line| line.decision.as_mut()) {
            decision.skill = Some(skill);
        }
    }
}

/// Returns a sentence on episodes without an end; `None` if all have one.
pub(super) fn unfinished(lines: &[Line], episodes: Option<usize>) -> Option<String> {
    let begun = lines.iter().map(|line| line.episode + 1).max().unwrap_or(0);
    let all = episodes.unwrap_or(begun).max(1);
    let ended: std::collections::BTreeSet<usize> =
        lines.iter().filter(|line| line.end.is_some()).map(|line| line.episode).collect();
    let ended = ended.iter().filter(|episode| **episode < all).count();
    (ended < all).then(|| format!("the end of {} of {all} episodes is missing", all - ended))
}
