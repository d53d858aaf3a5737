//! `trace.jsonl`: every decision, skill, touch and end of every episode, one JSON object a line.

use std::fmt::Write as _;

use serde::{Deserialize, Serialize};
use serde_json::json;

use crate::task::execute::{Decided, Ended, EpisodeReport, Touched};
use crate::task::skill::SkillReport;

/// How an episode ended.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct End {
    /// What the planner or the clock said.
    pub ended: Ended,
    /// Whether the scene was assembled.
    pub assembled: bool,
    /// Simulated seconds.
    pub simulated_s: f64,
}

/// A line: an episode, counted from 0, and one of the others.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Line {
    /// Which episode.
    pub episode: usize,
    /// A decision.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub decision: Option<Decided>,
    /// A skill that is over.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub skill: Option<SkillReport>,
    /// The fingers touch or leave a part.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub touch: Option<Touched>,
    /// The episode's end.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub end: Option<End>,
}

/// The text of the file for these episodes.
pub fn write<'e>(episodes: impl Iterator<Item = &'e EpisodeReport>) -> String {
    let mut text = String::new();
    let mut line = |line: Line| {
        let _ = writeln!(text, "{}", json!(line));
    };
    for (episode, report) in episodes.enumerate() {
        let own = Line { episode, ..Line::default() };
        for decision in &report.decisions {
            line(Line { decision: Some(decision.clone()), ..own.clone() });
        }
        for skill in &report.skills {
            line(Line { skill: Some(*skill), ..own.clone() });
        }
        for touch in &report.touches {
            line(Line { touch: Some(*touch), ..own.clone() });
        }
        let EpisodeReport { ended, assembled, simulated_s, .. } = report;
        let end = End { ended: ended.clone(), assembled: *assembled, simulated_s: *simulated_s };
        line(Line { end: Some(end), ..own });
    }
    text
}

/// Simulated seconds that an episode can last.
pub(super) const LONGEST_S: f64 = 200_000.0;
/// Episodes that a run can have.
const MAX_EPISODES: usize = 100_000;

impl Line {
    /// Whether it is of an episode that can be and its moments are some of one.
    fn timely(&self) -> bool {
        let moments = [
            self.decision.as_ref().map(|d| d.asked_s),
            self.decision.as_ref().map(|d| d.took_ms / 1e3),
            self.touch.as_ref().map(|t| t.t),
            self.end.as_ref().map(|e| e.simulated_s),
        ];
        self.episode < MAX_EPISODES
            && moments.iter().flatten().all(|s| (0.0..=LONGEST_S).contains(s))
    }
}

/// The lines of a file up to the first that is none, and what is wrong with that.
pub fn read(bytes: &[u8]) -> (Vec<Line>, Option<String>) {
    let mut lines: Vec<Line> = Vec::new();
    for (index, line) in bytes.split(|b| *b == b'\n').enumerate() {
        if line.iter().all(u8::is_ascii_whitespace) {
            continue;
        }
        let parsed = serde_json::from_slice(line).map_err(|error| error.to_string());
        let timely = |line: Line| {
            if line.timely() {
                Ok(line)
            } else {
                Err("a moment or a number that no episode has".to_owned())
            }
        };
        match parsed.and_then(timely) {
            Ok(line) => lines.push(line),
            Err(error) => {
                let problem =
                    format!("line {} is damaged ({error}); those before it are shown", index + 1);
                return (lines, Some(problem));
            }
        }
    }
    (lines, None)
}

/// A sentence on episodes that have no end.
pub(super) fn unfinished(lines: &[Line], episodes: Option<usize>) -> Option<String> {
    let begun = lines.iter().map(|line| line.episode + 1).max().unwrap_or(0);
    let all = episodes.unwrap_or(begun).max(1);
    let ended: std::collections::BTreeSet<usize> =
        lines.iter().filter(|line| line.end.is_some()).map(|line| line.episode).collect();
    let ended = ended.iter().filter(|episode| **episode < all).count();
    (ended < all).then(|| format!("{} of {all} episodes have no end in it", all - ended))
}
