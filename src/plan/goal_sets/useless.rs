//! Operators that are in no plan: they can never be applied, or once they are, the goal is out of reach.

use super::mutex::Mutexes;
use crate::plan::strips::{GroundOperator, Grounded};

/// Greatest number of steps that the search takes. Operators that it does not come to count as useful.
const MAX_STEPS: usize = 400_000_000;

/// Returns for each operator whether it is in no plan from the start of the problem to its goal.
///
/// An operator can never be applied if its preconditions exclude each other, as in `(shake left left)` where one hand holds and
/// the other is empty. The goal is out of reach after an operator if it is out of reach even when nothing is made false
/// from then on, starting from all fluents that may hold together with the operator's effects. A box in a corner is such a case. Both
/// are sound: no plan is lost. Not all such operators are found.
///
/// Costs O(operators x (size of the problem)) at most.
pub(super) fn useless(problem: &Grounded, mutexes: &Mutexes) -> Vec<bool> {
    let operators = &problem.operators;
    let mut useless: Vec<bool> =
        operators.iter().map(|o| !mutexes.allow_all(&o.preconditions)).collect();
    let mut reach = Reach::new(problem);
    let mut steps = 0;
    for (place, operator) in operators.iter().enumerate() {
        if useless[place] {
            continue;
        }
        let GroundOperator { preconditions: needs, adds, deletes, .. } = operator;
        let after = |fluent: usize| {
            let fits = |other: &usize| !mutexes.excludes(*other, fluent);
            let kept = || !deletes.contains(&fluent) && needs.iter().all(fits);
            adds.contains(&fluent) || kept() && adds.iter().all(fits)
        };
        let after: Vec<bool> = (0..problem.fluents.len()).map(after).collect();
        steps += after.len();
        if problem.goal.iter().any(|goal| !after[*goal]) {
            useless[place] = !reach.goal(problem, &useless, after, &mut steps);
        }
        if steps > MAX_STEPS {
            break;
        }
    }
    useless
}

/// What can be reached if nothing is made false.
struct Reach {
    /// Operators that need each fluent.
    needed_by: Vec<Vec<usize>>,
    /// How many preconditions of each operator are missing.
    missing: Vec<usize>,
}

impl Reach {
    fn new(problem: &Grounded) -> Self {
        let mut needed_by = vec![Vec::new(); problem.fluents.len()];
        for (place, operator) in problem.operators.iter().enumerate() {
            operator.preconditions.iter().for_each(|need| needed_by[*need].push(place));
        }
        Self { needed_by, missing: Vec::new() }
    }

    /// Returns whether the goal is reached from the fluents that hold, without the operators that are left out.
    fn goal(
        &mut self,
        problem: &Grounded,
        left_out: &[bool],
        mut holds: Vec<bool>,
        steps: &mut usize,
    ) -> bool {
        let mut open = problem.goal.iter().filter(|goal| !holds[**goal]).count();
        self.missing.clear();
        self.missing.extend(problem.operators.iter().map(|o| o.preconditions.len()));
        let mut new: Vec<usize> = (0..holds.len()).filter(|fluent| holds[*fluent]).collect();
        let mut ready: Vec<usize> =
            (0..problem.operators.len()).filter(|place| self.missing[*place] == 0).collect();
        loop {
            while let Some(place) = ready.pop() {
                if left_out[place] {
                    continue;
                }
                *steps += problem.operators[place].adds.len();
                for fluent in &problem.operators[place].adds {
                    if !std::mem::replace(&mut holds[*fluent], true) {
                        new.push(*fluent);
                        open -= usize::from(problem.goal.contains(fluent));
                    }
                }
            }
            if open == 0 {
                return true;
            }
            let Some(fluent) = new.pop() else { return false };
            *steps += self.needed_by[fluent].len() + 1;
            for place in &self.needed_by[fluent] {
                self.missing[*place] -= 1;
                if self.missing[*place] == 0 {
                    ready.push(*place);
                }
            }
        }
    }
}
