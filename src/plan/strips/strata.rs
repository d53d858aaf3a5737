//! Strata of derived predicates: which of them are derived from which, and which from themselves.
//!
//! A derived predicate may need itself, by way of others or at once, but not its own opposite: then every state has one
//! least set of derived facts (Apt, Blair and Walker, "Towards a theory of declarative knowledge", 1988).

use super::formula::Derived;

/// The strata of a domain's rules.
pub(super) struct Strata<'d> {
    /// Name and number of arguments of each derived predicate, sorted.
    keys: Vec<(&'d str, usize)>,
    /// The stratum of each. Predicates of one stratum need each other; those of earlier ones need none of later ones.
    strata: Vec<usize>,
    /// Whether each needs itself.
    recursive: Vec<bool>,
    /// Names of predicates that need their own opposites, for which no state has a least set.
    pub opposed: Vec<&'d str>,
}

impl<'d> Strata<'d> {
    /// Finds the strata of rules. Costs O(n log n) for all literals of all conditions.
    pub fn new(rules: &'d [Derived]) -> Self {
        let mut keys: Vec<(&str, usize)> = rules.iter().map(key).collect();
        keys.sort_unstable();
        keys.dedup();
        let find = |key: (&str, usize)| keys.binary_search(&key).ok();
        // What each needs, and whether it needs the opposite.
        let mut needs: Vec<Vec<(usize, bool)>> = vec![Vec::new(); keys.len()];
        for rule in rules {
            let Some(own) = find(key(rule)) else { continue };
            rule.condition.signed_literals(true, &mut |literal, as_written| {
                let atom = &literal.atom;
                let needed = find((&atom.predicate, atom.arguments.len()));
                needs[own].extend(needed.map(|n| (n, literal.positive != as_written)));
            });
        }
        for needed in &mut needs {
            needed.sort_unstable();
            needed.dedup();
        }
        let strata = components(&needs);
        let within = |own: usize, other: usize| strata[own] == strata[other];
        let each = || (0..keys.len()).flat_map(|own| needs[own].iter().map(move |n| (own, *n)));
        let mut opposed: Vec<&str> = each()
            .filter(|(own, (needed, opposite))| *opposite && within(*own, *needed))
            .map(|(own, _)| keys[own].0)
            .collect();
        opposed.dedup();
        let mut recursive = vec![false; keys.len()];
        for (own, _) in each().filter(|(own, (needed, _))| within(*own, *needed)) {
            recursive[own] = true;
        }
        Self { keys, strata, recursive, opposed }
    }

    /// Returns the stratum of a derived predicate.
    pub fn stratum(&self, name: &str, arguments: usize) -> Option<usize> {
        self.keys.binary_search(&(name, arguments)).ok().map(|at| self.strata[at])
    }

    /// Returns the stratum of a predicate that needs itself.
    pub fn recursive(&self, name: &str, arguments: usize) -> Option<usize> {
        let at = self.keys.binary_search(&(name, arguments)).ok()?;
        self.recursive[at].then_some(self.strata[at])
    }
}

fn key(rule: &Derived) -> (&str, usize) {
    (&rule.predicate, rule.parameters.len())
}

/// Returns the strongly connected component of each node, numbered so that a node leads to none of a greater number (Tarjan,
/// "Depth-first search and linear graph algorithms", 1972). Without recursion, which long chains would overflow.
fn components(edges: &[Vec<(usize, bool)>]) -> Vec<usize> {
    const UNSEEN: usize = usize::MAX;
    let (mut seen, mut lowest) = (vec![UNSEEN; edges.len()], vec![UNSEEN; edges.len()]);
    let mut component = vec![UNSEEN; edges.len()];
    let (mut open, mut path, mut count, mut found) = (Vec::new(), Vec::new(), 0, 0);
    for root in 0..edges.len() {
        if seen[root] == UNSEEN {
            path.push((root, 0));
        }
        while let Some((node, at)) = path.pop() {
            if at == 0 {
                (seen[node], lowest[node]) = (count, count);
                count += 1;
                open.push(node);
            } else {
                // The edge before led into the tree or past it.
                let before = edges[node][at - 1].0;
                if component[before] == UNSEEN {
                    lowest[node] = lowest[node].min(lowest[before]);
                }
            }
            match edges[node].get(at) {
                Some((next, _)) => {
                    path.push((node, at + 1));
                    if seen[*next] == UNSEEN {
                        path.push((*next, 0));
                    }
                }
                None if lowest[node] == seen[node] => {
                    while let Some(last) = open.pop() {
                        component[last] = found;
                        if last == node {
                            break;
                        }
                    }
                    found += 1;
                }
                None => {}
            }
        }
    }
    component
}
