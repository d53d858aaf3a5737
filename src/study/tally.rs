//! Counts over several episodes.

use std::collections::BTreeMap;

use crate::robot::SkillOutcome;
use crate::study::statistics::Rate;
use crate::task::event::{Ended, EpisodeReport, RecoveryKind};

/// Counts and measurements over several episodes.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Tally {
    /// Number of episodes.
    pub episodes: usize,
    /// Number of episodes that the robot ended because its goal was met, and that the task's judge counts as solved.
    pub succeeded: usize,
    /// Number of successful episodes with the minimum number of skills.
    pub minimum_steps: usize,
    /// Number of episodes that ended because the planner wrongly took the goal as met.
    pub false_goals: usize,
    /// Number of episodes that the judge counts as solved although the robot ended them for another reason.
    pub unclaimed: usize,
    /// Number of successful grasps.
    pub picks: usize,
    /// Number of parts that were dropped while carried.
    pub drops: usize,
    /// Number of failed skills, each followed by a new decision.
    pub replans: usize,
    /// Number of failed skills by learned action and outcome.
    pub failed_skills: BTreeMap<(String, String), usize>,
    /// Number of times that a part was newly found in no state.
    pub unexplained: usize,
    /// Number of episodes that ended with a part in no state.
    pub ended_unexplained: usize,
    /// Number of parts that fell off the table.
    pub lost: usize,
    /// Number of recoveries by their kind.
    pub recoveries: BTreeMap<String, usize>,
    /// Number of recoveries by what they do, in words, and their reason. The reasons name kinds of objects instead of objects.
    pub reasons: BTreeMap<(String, String), usize>,
    /// Number of perturbed episodes.
    pub perturbed: usize,
    /// Duration of every decision in simulated milliseconds, sorted.
    pub decision_ms: Vec<f64>,
    /// Number of physics steps.
    pub steps: u64,
    /// Simulated time, in seconds.
    pub simulated_s: f64,
    /// Greatest slip in the gripper of any part that was placed, in metres.
    pub slip_m: f64,
    /// Episodes without success: the episode's index, counted from 0, and how it ended.
    pub failures: Vec<(usize, Ended)>,
}

impl Tally {
    /// Returns the counts over `episodes`. `min_skills` is the minimum number of skills that solves an episode.
    pub fn of(episodes: &[EpisodeReport], min_skills: usize) -> Self {
        let mut tally = Self { episodes: episodes.len(), ..Self::default() };
        for (index, episode) in episodes.iter().enumerate() {
            let minimal = episode.skills().count() <= min_skills;
            tally.succeeded += usize::from(episode.succeeded());
            tally.minimum_steps += usize::from(episode.succeeded() && minimal);
            tally.false_goals += usize::from(episode.false_goal());
            tally.unclaimed += usize::from(episode.unclaimed());
            tally.picks += episode.picks();
            tally.drops += episode.drops();
            tally.replans += episode.replans();
            for (action, outcome) in episode.attempts().filter(|(_, o)| *o != SkillOutcome::Placed)
            {
                let key = (action.to_owned(), outcome.to_string());
                *tally.failed_skills.entry(key).or_default() += 1;
            }
            tally.unexplained += episode.unexplained;
            tally.ended_unexplained += usize::from(episode.in_no_state > 0);
            tally.lost += episode.lost.len();
            for recovery in episode.recoveries() {
                let kind = recovery.kind.name().to_owned();
                let object = match recovery.kind {
                    RecoveryKind::Part => "another part",
                    _ => "a part",
                };
                let reason = (recovery.kind.describe(object), without_numbers(&recovery.why));
                *tally.recoveries.entry(kind).or_default() += 1;
                *tally.reasons.entry(reason).or_default() += 1;
            }
            tally.perturbed += usize::from(episode.perturbed());
            tally.decision_ms.extend(episode.decisions.iter().map(|d| d.took_ms));
            tally.steps += episode.steps;
            tally.simulated_s += episode.simulated_s;
            let slips = episode.skills().map(|s| s.slip_m);
            tally.slip_m = slips.fold(tally.slip_m, f64::max);
            if !episode.succeeded() {
                tally.failures.push((index, episode.ended.clone()));
            }
        }
        tally.decision_ms.sort_by(f64::total_cmp);
        tally
    }

    /// Returns the quantile `share` (0 to 1) of the durations of decisions, in simulated milliseconds; `None` without
    /// decisions.
    pub fn decision_quantile(&self, share: f64) -> Option<f64> {
        let last = self.decision_ms.len().checked_sub(1)?;
        self.decision_ms.get((share * last as f64).round() as usize).copied()
    }

    /// Returns the number of episodes that neither the robot nor the judge takes as solved.
    pub fn unsolved(&self) -> usize {
        self.episodes - self.succeeded - self.false_goals - self.unclaimed
    }

    /// Returns the 95% interval of the rate of success.
    pub fn interval95(&self) -> [f64; 2] {
        Rate::new(self.succeeded as u64, self.episodes as u64).interval95()
    }
}

/// Removes the numbers from the ids of objects in a sentence: `nut_0 was dropped` becomes `nut was dropped`. Names with
/// capital letters are those of states and facts.
fn without_numbers(sentence: &str) -> String {
    let kind = |word: &str| match word.trim_end_matches(|c: char| c.is_ascii_digit()) {
        _ if word.contains(|c: char| c.is_uppercase()) => word.to_owned(),
        start if start.len() < word.len() => start.strip_suffix('_').unwrap_or(word).to_owned(),
        _ => word.to_owned(),
    };
    let mut text = String::new();
    for part in sentence.split_inclusive(|c: char| !c.is_alphanumeric() && c != '_') {
        let word = part.trim_end_matches(|c: char| !c.is_alphanumeric() && c != '_');
        text += &kind(word);
        text += &part[word.len()..];
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reasons_name_kinds_of_objects() {
        let cases = [
            ("nut_0 was dropped", "nut was dropped"),
            (
                "it lies where nut_12 is to be put; it failed 3 times",
                "it lies where nut is to be put; it failed 3 times",
            ),
            ("x_1, y_2_3: é_4", "x, y_2: é"),
            ("NUT_AT_START_2 does not hold", "NUT_AT_START_2 does not hold"),
        ];
        for (sentence, kinds) in cases {
            assert_eq!(without_numbers(sentence), kinds);
        }
    }
}
