//! Counts over many episodes.

use std::collections::BTreeMap;

use crate::study::statistics::Rate;
use crate::task::event::{Ended, EpisodeReport, SkillOutcome};

/// Counts over several episodes.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Tally {
    /// The number of episodes.
    pub episodes: usize,
    /// Episodes that the task's judge takes to be solved.
    pub solved: usize,
    /// Of these, the episodes with the minimum number of skills.
    pub minimum_steps: usize,
    /// Episodes that ended because the goal seemed to be met but was not.
    pub false_goals: usize,
    /// Successful grasps.
    pub picks: usize,
    /// Parts dropped while they were carried.
    pub drops: usize,
    /// Skills that failed, each followed by a new decision.
    pub replans: usize,
    /// How often each of these occurred, by action and outcome.
    pub failed_skills: BTreeMap<(String, String), usize>,
    /// How often a part entered no state.
    pub unexplained: usize,
    /// Episodes that ended with a part in no state.
    pub ended_unexplained: usize,
    /// Episodes that were perturbed.
    pub perturbed: usize,
    /// Simulated milliseconds of every decision, sorted.
    pub decision_ms: Vec<f64>,
    /// Physics steps.
    pub steps: u64,
    /// Simulated seconds.
    pub simulated_s: f64,
    /// The greatest slip in the gripper of a part that was placed, in metres.
    pub slip_m: f64,
    /// The episodes that failed, by index, and how they ended.
    pub failures: Vec<(usize, Ended)>,
}

impl Tally {
    /// Counts over `episodes`, each of which needs at least `min_skills` skills.
    pub fn of(episodes: &[EpisodeReport], min_skills: usize) -> Self {
        let mut tally = Self { episodes: episodes.len(), ..Self::default() };
        for (index, episode) in episodes.iter().enumerate() {
            tally.solved += usize::from(episode.solved);
            let minimal = episode.skills().count() <= min_skills;
            tally.minimum_steps += usize::from(episode.solved && minimal);
            tally.false_goals += usize::from(episode.false_goal());
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
            tally.perturbed += usize::from(episode.perturbed);
            tally.decision_ms.extend(episode.decisions.iter().map(|d| d.took_ms));
            tally.steps += episode.steps;
            tally.simulated_s += episode.simulated_s;
            let slips = episode.skills().map(|s| s.slip_m);
            tally.slip_m = slips.fold(tally.slip_m, f64::max);
            if !episode.solved {
                tally.failures.push((index, episode.ended.clone()));
            }
        }
        tally.decision_ms.sort_by(f64::total_cmp);
        tally
    }

    /// The quantile `share` (0 to 1) of the decisions' simulated milliseconds; `None` without decisions.
    pub fn decision_quantile(&self, share: f64) -> Option<f64> {
        let last = self.decision_ms.len().checked_sub(1)?;
        self.decision_ms.get((share * last as f64).round() as usize).copied()
    }

    /// The 95% interval of the rate of solved episodes.
    pub fn interval95(&self) -> [f64; 2] {
        Rate::new(self.solved as u64, self.episodes as u64).interval95()
    }
}
