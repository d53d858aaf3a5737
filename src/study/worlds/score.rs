//! Scores what a learner found against the truth.

use std::collections::{BTreeMap, BTreeSet};

use super::Shown;
use super::truth::Need;

/// Counts behind a precision and a recall.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Rates {
    /// Number of things that were said.
    pub said: usize,
    /// Number of things that were said and are right.
    pub right: usize,
    /// Number of things that had to be found.
    pub due: usize,
    /// Number of things that had to be found and were.
    pub found: usize,
}

impl Rates {
    /// Returns the share of what was said that is right; 1 if nothing was said.
    pub fn precision(&self) -> f64 {
        share(self.right, self.said)
    }

    /// Returns the share of what had to be found that was found; 1 if nothing had to be found.
    pub fn recall(&self) -> f64 {
        share(self.found, self.due)
    }

    /// Returns the sums of the counts.
    #[must_use]
    pub fn plus(&self, other: &Self) -> Self {
        Self {
            said: self.said + other.said,
            right: self.right + other.right,
            due: self.due + other.due,
            found: self.found + other.found,
        }
    }
}

fn share(part: usize, whole: usize) -> f64 {
    if whole == 0 { 1.0 } else { part as f64 / whole as f64 }
}

/// The state that a learner gives an object.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SaidState {
    /// The learner's name of the state.
    pub state: String,
    /// Id of the reference object; `None` in the world frame.
    pub reference: Option<String>,
}

/// The score of learned states.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct StateScore {
    /// The true state of each learned state that has one. No two learned states have the same true state.
    pub names: BTreeMap<String, &'static str>,
    /// Learned states that stand for a true one, and true shown states that were learned.
    pub states: Rates,
    /// Poses that were given the right state, among the poses with a state and among all poses. Objects without true
    /// states are left out.
    pub poses: Rates,
    /// Number of poses with the right state but the wrong reference object. A state without a reference object counts
    /// as wrong if the true state has one and the other way round.
    pub wrong_references: usize,
}

/// Scores the states that a learner gives the objects of a recording, by demonstration, snapshot and object.
///
/// Learned names are free. Each learned state stands for the true state with which it shares most poses; pairs are made
/// in the order of the number of shared poses. States that occur in no pose are not counted.
pub fn score_states(shown: &Shown, said: &[Vec<Vec<Option<SaidState>>>]) -> StateScore {
    let truth = shown.states.iter().flatten().flatten();
    let pairs: Vec<_> = truth
        .zip(said.iter().flatten().flatten())
        .filter_map(|(truth, said)| Some((truth.as_ref()?, said.as_ref())))
        .collect();
    let mut shared: BTreeMap<(&str, &'static str), usize> = BTreeMap::new();
    for (truth, said) in &pairs {
        if let Some(said) = said {
            *shared.entry((&said.state, truth.state)).or_default() += 1;
        }
    }
    let learned: BTreeSet<&str> = shared.keys().map(|(said, _)| *said).collect();
    let due: BTreeSet<&str> = pairs.iter().map(|(truth, _)| truth.state).collect();
    let mut order: Vec<_> = shared.iter().collect();
    order.sort_by_key(|(names, count)| (usize::MAX - **count, **names));
    let mut score = StateScore::default();
    let mut taken = BTreeSet::new();
    for ((said, truth), _) in order {
        if !score.names.contains_key(*said) && taken.insert(*truth) {
            score.names.insert((*said).to_owned(), truth);
        }
    }
    let matched = score.names.len();
    score.states = Rates { said: learned.len(), right: matched, due: due.len(), found: matched };
    for (truth, said) in pairs {
        score.poses.due += 1;
        let Some(said) = said else { continue };
        score.poses.said += 1;
        if score.names.get(&said.state) == Some(&truth.state) {
            score.poses.right += 1;
            score.poses.found += 1;
            let wrong = said.reference.as_deref() != truth.reference.as_deref();
            score.wrong_references += usize::from(wrong);
        }
    }
    score
}

/// The score of the needs of one action.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct NeedScore {
    /// Precision of the required needs, and recall of required plus undecided needs.
    pub rates: Rates,
    /// Required needs that the world does not demand, not even indirectly.
    pub wrong: Vec<Need>,
    /// Needs that the world demands and that are neither required nor undecided.
    pub missed: Vec<Need>,
}

/// Scores the needs that a learner states for an action, in the true states' names.
///
/// A required need is right if it was met whenever the exploration found the action possible (`always`). A need that the
/// world demands is found if a required or undecided need says the same or more, see [`Need::says`].
pub fn score_needs(
    demanded: &[Need],
    always: &BTreeSet<Need>,
    required: &[Need],
    undecided: &[Need],
) -> NeedScore {
    let mut score = NeedScore::default();
    for need in required {
        score.rates.said += 1;
        if always.iter().any(|always| always.says(need)) {
            score.rates.right += 1;
        } else {
            score.wrong.push(*need);
        }
    }
    for need in demanded {
        score.rates.due += 1;
        if required.iter().chain(undecided).any(|said| said.says(need)) {
            score.rates.found += 1;
        } else {
            score.missed.push(*need);
        }
    }
    score
}

impl Need {
    /// Returns whether this need says the same as `other` or more.
    pub fn says(&self, other: &Self) -> bool {
        match (*self, *other) {
            (Self::Holds { state, at_least }, Self::Holds { state: other, at_least: fewer }) => {
                state == other && at_least >= fewer
            }
            (Self::Holds { state, at_least }, Self::Somewhere(other)) => {
                state == other && at_least > 0
            }
            (Self::Nowhere(state), Self::Clear(other)) => state == other,
            (one, other) => one == other,
        }
    }
}
