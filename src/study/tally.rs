//! Many episodes counted.

use std::collections::BTreeMap;

use super::statistics::Rate;
use crate::task::execute::{Ended, EpisodeReport};
use crate::task::skill::SkillOutcome;

/// What happened in several episodes.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Tally {
    /// Episodes.
    pub episodes: usize,
    /// Those that the task's judge takes to be solved.
    pub assembled: usize,
    /// Those of them with no more skills than the least possible.
    pub minimum_steps: usize,
    /// Episodes that ended with the goal taken to be met that was not.
    pub false_goals: usize,
    /// Parts taken into the hand.
    pub picks: usize,
    /// Parts lost on the way.
    pub drops: usize,
    /// Skills that failed, each followed by a new decision.
    pub replans: usize,
    /// Which these were: an action, how its skill ended, and how often.
    pub failed_skills: BTreeMap<(String, String), usize>,
    /// Times that a part came to be in no state.
    pub strays: usize,
    /// Episodes at whose end a part was in no state.
    pub ended_with_strays: usize,
    /// Episodes in which another hand did something.
    pub meddled: usize,
    /// Simulated milliseconds of every decision, in rising order.
    pub decision_ms: Vec<f64>,
    /// Steps of the physics.
    pub steps: u64,
    /// Simulated seconds.
    pub simulated_s: f64,
    /// Greatest slip in the hand of a part that was placed, in metres.
    pub slip_m: f64,
    /// Episodes that failed: which, and how they ended.
    pub failures: Vec<(usize, Ended)>,
}

impl Tally {
    /// Counts episodes; `least` is the least number of skills that each needs.
    pub fn of(episodes: &[EpisodeReport], least: usize) -> Self {
        let mut tally = Self { episodes: episodes.len(), ..Self::default() };
        for (index, episode) in episodes.iter().enumerate() {
            tally.assembled += usize::from(episode.assembled);
            let short = episode.skills.len() <= least;
            tally.minimum_steps += usize::from(episode.assembled && short);
            tally.false_goals += usize::from(episode.false_goal());
            tally.picks += episode.picks();
            tally.drops += episode.drops();
            tally.replans += episode.replans();
            for (action, outcome) in episode.attempts().filter(|(_, o)| *o != SkillOutcome::Placed)
            {
                let key = (action.to_owned(), outcome.to_string());
                *tally.failed_skills.entry(key).or_default() += 1;
            }
            tally.strays += episode.strays;
            tally.ended_with_strays += usize::from(episode.in_no_state > 0);
            tally.meddled += usize::from(episode.perturbed);
            tally.decision_ms.extend(episode.decisions.iter().map(|d| d.took_ms));
            tally.steps += episode.steps;
            tally.simulated_s += episode.simulated_s;
            let slips = episode.skills.iter().map(|s| s.slip_m);
            tally.slip_m = slips.fold(tally.slip_m, f64::max);
            if !episode.assembled {
                tally.failures.push((index, episode.ended.clone()));
            }
        }
        tally.decision_ms.sort_by(f64::total_cmp);
        tally
    }

    /// Simulated milliseconds within which the share `share` of decisions was made; `None` without
    /// any.
    pub fn decision_quantile(&self, share: f64) -> Option<f64> {
        let last = self.decision_ms.len().checked_sub(1)?;
        self.decision_ms.get((share * last as f64).round() as usize).copied()
    }

    /// The 95% interval of the share assembled.
    pub fn interval95(&self) -> [f64; 2] {
        Rate::new(self.assembled as u64, self.episodes as u64).interval95()
    }
}
