//! The goal agenda: which goals come before which.

use crate::plan::goal_sets::rules::{Regressed, Regression};

/// Returns pairs of goals of which the first comes first, each once.
///
/// A goal comes before another one if each operator that may achieve it deletes the other, or needs what excludes the other:
/// were the other achieved first, it would have to be undone. (Koehler and Hoffmann, "On reasonable and forced goal orderings
/// and their use in an agenda-driven planning algorithm", 2000.) By the time a goal is pursued, those before it hold. So
/// operators that conflict with these do not count, and further orders follow until there are none. Operators whose
/// preconditions exclude each other never count. Orders in a circle are dropped.
///
/// Costs O(rounds x (operators x goals + goals^3 / 64)), with as many rounds as the longest order.
pub(super) fn agenda(goals: &[usize], rules: &Regression) -> Vec<[usize; 2]> {
    // By positions among the goals.
    let adders: Vec<Vec<&Regressed>> = goals
        .iter()
        .map(|goal| {
            let adds = rules.operators.iter().filter(|o| o.adds.contains(goal));
            adds.filter(|o| rules.possible(o)).collect()
        })
        .collect();
    let conflicts = |operator: &Regressed| -> Vec<usize> {
        (0..goals.len()).filter(|g| operator.threatens.binary_search(&goals[*g]).is_ok()).collect()
    };
    let mut adders: Vec<Vec<Vec<usize>>> =
        adders.into_iter().map(|all| all.into_iter().map(conflicts).collect()).collect();
    let mut order = Order::new(goals.len());
    loop {
        let mut found = Order::new(goals.len());
        for (goal, adders) in adders.iter_mut().enumerate() {
            adders.retain(|conflicts| !conflicts.iter().any(|other| order.holds(*other, goal)));
            let mut counts = vec![0; goals.len()];
            adders.iter().flatten().for_each(|other| counts[*other] += 1);
            for (other, count) in counts.into_iter().enumerate() {
                if other != goal && count > 0 && count == adders.len() {
                    found.insert(goal, other);
                }
            }
        }
        found.merge(&order);
        let found = found.without_circles();
        if found == order {
            break;
        }
        order = found;
    }
    order.pairs().map(|[a, b]| [goals[a], goals[b]]).collect()
}

/// A relation among a few items, as rows of bits.
#[derive(Clone, PartialEq)]
struct Order {
    count: usize,
    rows: Vec<Vec<u64>>,
}

impl Order {
    fn new(count: usize) -> Self {
        Self { count, rows: vec![vec![0; count.div_ceil(64)]; count] }
    }

    fn holds(&self, a: usize, b: usize) -> bool {
        self.rows[a][b / 64] >> (b % 64) & 1 == 1
    }

    fn insert(&mut self, a: usize, b: usize) {
        self.rows[a][b / 64] |= 1 << (b % 64);
    }

    fn merge(&mut self, other: &Self) {
        for (row, other) in self.rows.iter_mut().zip(&other.rows) {
            row.iter_mut().zip(other).for_each(|(bits, more)| *bits |= more);
        }
    }

    fn pairs(&self) -> impl Iterator<Item = [usize; 2]> + '_ {
        let all = (0..self.count).flat_map(|a| (0..self.count).map(move |b| [a, b]));
        all.filter(|[a, b]| self.holds(*a, *b))
    }

    /// Returns the pairs of which the second does not lead back to the first.
    fn without_circles(&self) -> Self {
        let mut leads = self.clone();
        for middle in 0..self.count {
            let onward = leads.rows[middle].clone();
            for a in 0..self.count {
                if leads.holds(a, middle) {
                    leads.rows[a].iter_mut().zip(&onward).for_each(|(bits, more)| *bits |= more);
                }
            }
        }
        let mut kept = Self::new(self.count);
        for [a, b] in self.pairs().filter(|[a, b]| !leads.holds(*b, *a)) {
            kept.insert(a, b);
        }
        kept
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plan::goal_sets::mutex::Mutexes;

    /// Operators by what they add, need and threaten.
    fn rules(operators: &[[&[usize]; 3]]) -> Regression {
        let operators = operators.iter().map(|[adds, needs, threatens]| Regressed {
            adds: adds.to_vec(),
            preconditions: needs.to_vec(),
            threatens: threatens.to_vec(),
            serves: Vec::new(),
        });
        let operators = operators.collect();
        let mutexes = Mutexes::of(8, []);
        let (bars, heights) = (Vec::new(), Vec::new());
        Regression { fluents: 8, operators, mutexes, bars, heights, never: Vec::new(), levels: 16 }
    }

    #[test]
    fn an_order_leads_to_further_ones_and_circles_are_dropped() {
        // The only operator for 0 undoes 1. One for 1 undoes 2, and the other one undoes 0, which is there by then.
        let further = rules(&[[&[0], &[], &[1]], [&[1], &[], &[2]], [&[1], &[], &[0]]]);
        assert_eq!(agenda(&[0, 1, 2], &further), [[0, 1], [1, 2]]);
        // Without the first order there is no second.
        assert_eq!(agenda(&[1, 2], &further), [[0; 2]; 0]);
        let circle = rules(&[[&[0], &[], &[1]], [&[1], &[], &[0]], [&[2], &[], &[0]]]);
        assert_eq!(agenda(&[0, 1, 2], &circle), [[2, 0]]);
    }
}
