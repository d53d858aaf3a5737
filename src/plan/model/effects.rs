//! Effects from the differences between the states before and after an action.

use std::collections::BTreeSet;

use super::Seen;
use super::vocabulary::Bound;
use crate::plan::strips::GroundAtom;

/// The effects of an action, as positions in its vocabulary.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(super) struct Effects {
    pub add: BTreeSet<usize>,
    pub delete: BTreeSet<usize>,
    /// Number of changes that no bound atom explains.
    pub unexplained: usize,
    /// Number of changes that several bound atoms explain.
    pub ambiguous: usize,
}

/// One kind of change, adding or deleting.
struct Changes {
    /// For each change, the bound atoms that explain it.
    explained: Vec<Vec<usize>>,
    unexplained: usize,
}

impl Changes {
    fn new(
        vocabulary: &[Bound],
        seen: &[Seen<'_>],
        possible: &[bool],
        changed: impl Fn(&Seen<'_>) -> Vec<GroundAtom>,
    ) -> Self {
        let mut changes = Self { explained: Vec::new(), unexplained: 0 };
        for step in seen {
            let changed = changed(step);
            if changed.is_empty() {
                continue;
            }
            let ground: Vec<(usize, GroundAtom)> = vocabulary
                .iter()
                .enumerate()
                .filter(|(index, _)| possible[*index])
                .map(|(index, bound)| (index, bound.ground(step.arguments)))
                .collect();
            for fact in changed {
                let by = ground.iter().filter(|(_, atom)| *atom == fact);
                let by: Vec<usize> = by.map(|(index, _)| *index).collect();
                match by.is_empty() {
                    true => changes.unexplained += 1,
                    false => changes.explained.push(by),
                }
            }
        }
        changes
    }

    /// Returns the atoms that explain all changes: those that alone explain one, and for each other change one of the
    /// atoms that explain most of the rest. Among equals the first in `preferred` wins, then the first in the
    /// vocabulary.
    fn explanation(&self, preferred: &BTreeSet<usize>) -> BTreeSet<usize> {
        let alone = self.explained.iter().filter(|by| by.len() == 1).map(|by| by[0]);
        let mut chosen: BTreeSet<usize> = alone.collect();
        loop {
            let open: Vec<&Vec<usize>> =
                self.explained.iter().filter(|by| by.iter().all(|i| !chosen.contains(i))).collect();
            let candidates: BTreeSet<usize> =
                open.iter().flat_map(|by| by.iter().copied()).collect();
            let worth = |index: &usize| {
                let explained = open.iter().filter(|by| by.contains(index)).count();
                (explained, preferred.contains(index), std::cmp::Reverse(*index))
            };
            match candidates.into_iter().max_by_key(worth) {
                Some(best) => chosen.insert(best),
                None => return chosen,
            };
        }
    }
}

/// Learns effects from all steps. An effect must hold after every step. If a call names one object twice, several atoms
/// explain a change. An atom that other steps confirm or that explains most changes is chosen.
pub(super) fn from_all_steps(
    vocabulary: &[Bound],
    seen: &[Seen<'_>],
    held: &BTreeSet<usize>,
) -> Effects {
    let mut possible = vec![true; vocabulary.len()];
    for step in seen {
        for (index, bound) in vocabulary.iter().enumerate() {
            possible[index] &= step.after.contains(&bound.ground(step.arguments));
        }
    }
    let adds = Changes::new(vocabulary, seen, &possible, |step| step.added());
    let add = adds.explanation(&BTreeSet::new());
    let mut possible = vec![true; vocabulary.len()];
    for step in seen {
        let added: Vec<GroundAtom> =
            add.iter().map(|index| vocabulary[*index].ground(step.arguments)).collect();
        for (index, bound) in vocabulary.iter().enumerate() {
            let atom = bound.ground(step.arguments);
            possible[index] &= !step.after.contains(&atom) || added.contains(&atom);
        }
    }
    let deletes = Changes::new(vocabulary, seen, &possible, |step| step.deleted());
    let delete = deletes.explanation(held);
    let several = |changes: &Changes| changes.explained.iter().filter(|by| by.len() > 1).count();
    Effects {
        unexplained: adds.unexplained + deletes.unexplained,
        ambiguous: several(&adds) + several(&deletes),
        add,
        delete,
    }
}

/// Learns effects as safe action model learning does: every bound atom that explains a change. The steps must not name
/// an object twice. An atom that did not hold after some step is not added, which matters for constants only.
pub(super) fn from_safe_steps(vocabulary: &[Bound], seen: &[Seen<'_>]) -> Effects {
    let mut effects = Effects::default();
    let mut never = BTreeSet::new();
    for step in seen {
        let (added, deleted) = (step.added(), step.deleted());
        for (index, bound) in vocabulary.iter().enumerate() {
            let atom = bound.ground(step.arguments);
            if added.contains(&atom) {
                effects.add.insert(index);
            }
            if deleted.contains(&atom) {
                effects.delete.insert(index);
            }
            if !step.after.contains(&atom) {
                never.insert(index);
            }
        }
    }
    effects.add.retain(|index| !never.contains(index));
    effects
}
