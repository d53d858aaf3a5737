//! `trace.jsonl`: every decision with its skill, every contact and release, and the end of every episode. Each line is
//! a JSON object.

use std::fmt::Write as _;

use serde::{Deserialize, Serialize};
use serde_json::json;

use crate::task::event::{Decided, Ended, EpisodeReport, Event, Observer, SkillReport, Touched};

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
    /// End of the episode.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub end: Option<End>,
}

/// An observer that collects the lines of one episode: decisions first, then contacts and releases, then the end.
#[derive(Debug, Clone, Default)]
pub struct Tracer {
    episode: usize,
    decisions: String,
    touches: String,
    end: String,
}

impl Tracer {
    /// Creates the trace of an episode with this number, counted from 0.
    pub fn new(episode: usize) -> Self {
        Self { episode, ..Self::default() }
    }

    /// Returns the lines collected so far.
    pub fn text(&self) -> String {
        [self.decisions.as_str(), &self.touches, &self.end].concat()
    }
}

impl Observer for Tracer {
    fn observe(&mut self, event: &Event<'_>) {
        let own = Line { episode: self.episode, ..Line::default() };
        match event {
            // A decision that the robot carries out is written when its skill is over.
            Event::Decided(decision) if !decision.begun => {
                put(&mut self.decisions, &Line { decision: Some((*decision).clone()), ..own });
            }
            Event::SkillEnded { decision: Some(decision), .. } => {
                put(&mut self.decisions, &Line { decision: Some((*decision).clone()), ..own });
            }
            Event::Touched(touch) => put(&mut self.touches, &Line { touch: Some(*touch), ..own }),
            Event::EpisodeEnded(report) => {
                // The episode may end while its last decision is carried out.
                let cut = report.decisions.last().filter(|d| d.begun && d.skill.is_none());
                if let Some(decision) = cut {
                    let line = Line { decision: Some(decision.clone()), ..own.clone() };
                    put(&mut self.decisions, &line);
                }
                let EpisodeReport { ended, solved, simulated_s, lost, .. } = report;
                let (ended, lost) = (ended.clone(), lost.clone());
                let end = End { ended, solved: *solved, simulated_s: *simulated_s, lost };
                put(&mut self.end, &Line { end: Some(end), ..own });
            }
            _ => {}
        }
    }
}

fn put(text: &mut String, line: &Line) {
    let _ = writeln!(text, "{}", json!(line));
}

/// Maximum simulated length of an episode, in seconds.
pub(super) const MAX_EPISODE_S: f64 = 200_000.0;
/// Maximum number of episodes in a run.
const MAX_EPISODES: usize = 100_000;

impl Line {
    /// Returns whether the episode's number and all times are in range.
    fn in_range(&self) -> bool {
        let moments = [
            self.decision.as_ref().map(|d| d.asked_s),
            self.decision.as_ref().map(|d| d.took_ms / 1e3),
            self.touch.as_ref().map(|t| t.t),
            self.end.as_ref().map(|e| e.simulated_s),
        ];
        self.episode < MAX_EPISODES
            && moments.iter().flatten().all(|s| (0.0..=MAX_EPISODE_S).contains(s))
    }
}

/// Reads the lines of a file up to the first damaged line. The second value says what is wrong with that line.
pub fn read(bytes: &[u8]) -> (Vec<Line>, Option<String>) {
    let mut lines: Vec<Line> = Vec::new();
    for (index, line) in bytes.split(|b| *b == b'\n').enumerate() {
        if line.iter().all(u8::is_ascii_whitespace) {
            continue;
        }
        let parsed = serde_json::from_slice(line).map_err(|error| error.to_string());
        let in_range = |line: Line| match line.in_range() {
            true => Ok(line),
            false => Err("a time or the episode's number is out of range".to_owned()),
        };
        match parsed.and_then(in_range) {
            Ok(Line { episode, skill: Some(skill), .. }) => own_skill(&mut lines, episode, skill),
            Ok(line) => lines.push(line),
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

/// Moves a skill of an older trace into its decision: the episode's first decision that was begun and has no skill.
fn own_skill(lines: &mut [Line], episode: usize, skill: SkillReport) {
    let own = lines.iter_mut().filter(|line| line.episode == episode);
    let open = |decision: &&mut Decided| decision.begun && decision.skill.is_none();
    if let Some(decision) = own.filter_map(|line| line.decision.as_mut()).find(open) {
        decision.skill = Some(skill);
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::task::event::{Recovery, RecoveryKind, SkillOutcome};

    /// Two episodes in the older format, with skills on lines of their own.
    const OLD: &str = r#"{"episode":0,"decision":{"asked_s":0.0,"took_ms":3.0,"holds":["A"],"action":"PUT","begun":false}}
{"episode":0,"decision":{"asked_s":1.0,"took_ms":3.0,"holds":["A"],"action":"PUT","begun":true}}
{"episode":0,"decision":{"asked_s":2.0,"took_ms":3.0,"holds":["A"],"action":"PUT","begun":true}}
{"episode":0,"skill":{"part":1,"outcome":"dropped","picked":true,"slip_m":0.001}}
{"episode":0,"skill":{"part":0,"outcome":"placed","picked":true,"slip_m":0.0}}
{"episode":1,"decision":{"asked_s":1.0,"took_ms":3.0,"holds":["A"],"action":"PUT","begun":true}}
{"episode":1,"skill":{"part":7,"outcome":"timed out","picked":false,"slip_m":0.0}}
"#;

    #[test]
    fn skills_of_an_older_trace_are_moved_into_their_decisions() {
        let (lines, problem) = read(OLD.as_bytes());
        assert_eq!(problem, None);
        let outcomes: Vec<Option<SkillOutcome>> =
            lines.iter().map(|l| l.decision.as_ref().and_then(Decided::outcome)).collect();
        let [dropped, placed, late] =
            [SkillOutcome::Dropped, SkillOutcome::Placed, SkillOutcome::TimedOut].map(Some);
        assert_eq!(outcomes, [None, dropped, placed, late]);
    }

    #[test]
    fn a_written_trace_reads_back_as_it_was_observed() {
        let skill =
            SkillReport { part: 1, outcome: SkillOutcome::Placed, picked: true, slip_m: 0.5e-3 };
        let recovery = || {
            Some(Recovery {
                kind: RecoveryKind::Clear,
                object: "block_0".into(),
                why: "it lies where block_1 is to be put".into(),
                attempt: 2,
            })
        };
        let decided = |begun, skill| Decided {
            in_no_state: Vec::new(),
            asked_s: 1.0,
            took_ms: 12.0,
            holds: vec!["A".into()],
            action: Some("PUT".into()),
            begun,
            skill,
            chosen: None,
            recovery: recovery(),
        };
        let touch = Touched { t: 1.5, part: 1, contact: true };
        let decisions = [decided(false, None), decided(true, Some(skill)), decided(true, None)];
        let report = EpisodeReport {
            ended: Ended::GaveUp,
            solved: false,
            decisions: decisions.to_vec(),
            touches: vec![touch],
            in_no_state: 0,
            unexplained: 0,
            lost: vec!["block_3".into()],
            perturbed: false,
            steps: 10,
            simulated_s: 2.0,
        };
        let mut tracer = Tracer::new(3);
        tracer.observe(&Event::Decided(&decisions[0]));
        // A decision that is carried out has no skill at first. Its line is written when the skill is over.
        tracer.observe(&Event::Decided(&decided(true, None)));
        tracer.observe(&Event::Touched(touch));
        let decision = Some(&decisions[1]);
        tracer.observe(&Event::SkillEnded { time_s: 2.0, report: &skill, decision });
        // The episode ends while this decision is carried out.
        tracer.observe(&Event::Decided(&decisions[2]));
        tracer.observe(&Event::EpisodeEnded(&report));
        let (lines, problem) = read(tracer.text().as_bytes());
        assert_eq!((lines.len(), problem), (5, None));
        assert!(lines.iter().all(|l| l.episode == 3 && l.skill.is_none()));
        let read: Vec<Decided> = lines.iter().filter_map(|l| l.decision.clone()).collect();
        assert_eq!(read, decisions);
        assert_eq!(lines[3].touch, Some(touch));
        let end = lines[4].end.as_ref().map(|e| (e.simulated_s, e.lost.len()));
        assert_eq!(end, Some((2.0, 1)));
    }
}
