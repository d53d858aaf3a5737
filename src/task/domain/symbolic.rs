//! Domains written in code instead of learned: states and actions by name, without geometry.

use super::pose::Pose;
use crate::task::domain::{
    Domain, KindClusters, Operator, OperatorEvidence, Origin, Provenance, State,
};
use crate::task::error::TaskError;

/// A domain without poses, for planner graphs built in code.
///
/// States are those that are named, in the order in which they first are.
///
/// ```
/// use symbolt::task::SymbolicDomain;
/// let domain = SymbolicDomain::new()
///     .action("BOIL_WATER", ["KETTLE_FULL"], ["WATER_HOT"])
///     .action("BREW_TEA", ["WATER_HOT", "LEAVES_IN_POT"], ["TEA_READY"])
///     .state("LEAVES_IN_TIN")
///     .build()?;
/// assert_eq!(domain.states().len(), 5);
/// # Ok::<(), symbolt::task::TaskError>(())
/// ```
#[derive(Debug, Clone, Default)]
pub struct SymbolicDomain {
    states: Vec<String>,
    actions: Vec<Action>,
}

#[derive(Debug, Clone)]
struct Action {
    name: String,
    needs: Vec<String>,
    absent: Vec<String>,
    causes: Vec<String>,
}

impl SymbolicDomain {
    /// The paper's own domain (section II.E): a nut and a bolt are put into the jig and assembled.
    pub fn of_the_paper() -> Self {
        Self::new()
            .action("PUT_NUT_IN_JIG", ["NUT_ON_TABLE"], ["NUT_IN_JIG"])
            .action("PUT_BOLT_IN_JIG", ["BOLT_ON_TABLE"], ["BOLT_IN_JIG"])
            .action("ASSEMBLE", ["NUT_IN_JIG", "BOLT_IN_JIG"], ["BOLT_ASSEMBLED"])
    }

    /// Without states and actions.
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds a state that no action needs or causes yet.
    pub fn state(mut self, name: &str) -> Self {
        self.note(name);
        self
    }

    /// Adds an action: what it needs, and what it brings about (at least one state; by the first it is
    /// told from other actions).
    pub fn action<'n>(
        self,
        name: &str,
        needs: impl IntoIterator<Item = &'n str>,
        causes: impl IntoIterator<Item = &'n str>,
    ) -> Self {
        self.action_unless(name, needs, [], causes)
    }

    /// Adds an action that can be done only while some states are absent.
    pub fn action_unless<'n>(
        mut self,
        name: &str,
        needs: impl IntoIterator<Item = &'n str>,
        absent: impl IntoIterator<Item = &'n str>,
        causes: impl IntoIterator<Item = &'n str>,
    ) -> Self {
        let mut list = |names: &mut dyn Iterator<Item = &'n str>| -> Vec<String> {
            names
                .map(|name| {
                    self.note(name);
                    name.to_owned()
                })
                .collect()
        };
        let needs = list(&mut needs.into_iter());
        let absent = list(&mut absent.into_iter());
        let causes = list(&mut causes.into_iter());
        self.actions.push(Action { name: name.into(), needs, absent, causes });
        self
    }

    fn note(&mut self, name: &str) {
        if !self.states.iter().any(|s| s == name) {
            self.states.push(name.into());
        }
    }

    /// Checks the whole.
    ///
    /// # Errors
    /// As [`Domain::new`]; an action that causes nothing likewise.
    pub fn build(self) -> Result<Domain, TaskError> {
        const KIND: &str = "thing";
        let count = self.states.len();
        let mut operators = Vec::new();
        for Action { name, needs: preconditions, absent, causes: effects } in self.actions {
            let Some(to) = effects.first().cloned() else {
                let reason = format!("action `{name}` causes nothing");
                return Err(TaskError::BadDomain { reason });
            };
            operators.push(Operator {
                name,
                kind: KIND.into(),
                from: None,
                to,
                preconditions,
                effects,
                absent,
                removes: Vec::new(),
                evidence: OperatorEvidence {
                    instances: 0,
                    before: vec![0; count],
                    change: vec![0; count],
                },
            });
        }
        let states = self
            .states
            .into_iter()
            .map(|name| State {
                name,
                kind: KIND.into(),
                count: 0,
                distinct: 0,
                origin: Origin::Found,
                mean: Pose::at([0.0; 3]),
                covariance: [[0.0; 6]; 6],
            })
            .collect();
        let provenance = Provenance {
            symbolt: env!("CARGO_PKG_VERSION").into(),
            seed: 0,
            p: super::distance::PAPER_EXPONENT,
            threshold_m: None,
            demonstrations: 0,
            snapshots: 0,
            clusters: Vec::<KindClusters>::new(),
        };
        Domain::new(states, operators, None, provenance)
    }
}
