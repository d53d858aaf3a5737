//! Forward search as one graph of units.

use std::sync::Arc;

use super::agenda::agenda;
use super::control::{Control, Phase, Signal};
use super::memory::memory;
use super::relaxed::relaxed;
use crate::plan::goal_sets::costs::levels;
use crate::plan::goal_sets::motor::{Acting, act, load};
use crate::plan::goal_sets::race::{BAR, Turns, race, utilities};
use crate::plan::goal_sets::rules::Regression;
use crate::plan::goal_sets::senses::Senses;
use crate::plan::goal_sets::tree::Layout;
use crate::plan::goal_sets::wiring::{CALM_MS, Reach, Weight, Wiring, each, gather};
use crate::plan::strips::{GroundOperator, Grounded};
use crate::sim::{In, Module, Out, Real, Scope, Vector};

/// Weight of an operator that adds a goal.
const HELPS: Real = 0.4;
/// Weight of an operator that adds all that another one of the relaxed plan lacks.
const COMPLETES: Real = 0.15;
/// Weight of each fluent that an operator adds and the relaxed plan needs, beyond the first.
const SERVES: Real = 0.1;
/// Weight of each operator of the relaxed plan that needs what an operator deletes.
const THREATENS: Real = -0.2;
/// Weight of an operator outside the relaxed plan, where such are tried.
const STRAYS: Real = -0.5;
/// Weight of what an operator uses up for good.
const SPARES: Real = -0.5;
/// Phases in which the race becomes easier to win, and the weight of each.
const URGES: [(usize, Real); 3] =
    [(Phase::Settle as usize, 1.7), (Phase::Veto as usize, 1.7), (Phase::Race as usize, 3.7)];

/// What forward search knows of a problem.
#[derive(Debug, Clone)]
pub struct Progression {
    fluents: usize,
    operators: Vec<GroundOperator>,
    /// Pairs of goals of which the first comes first.
    pub(super) before: Vec<[usize; 2]>,
    /// Levels of cost.
    pub(super) levels: usize,
    /// What each operator uses up for good, from 0 to 1: see [`uses_up`].
    uses_up: Vec<Real>,
}

impl Progression {
    /// Finds the rules of a problem, of which `rules` are those of regression.
    pub fn new(problem: &Grounded, rules: &Regression) -> Self {
        let mut operators = problem.operators.clone();
        for (operator, seen) in operators.iter_mut().zip(&rules.operators) {
            // Nothing for operators that are in no plan.
            operator.adds.clone_from(&seen.adds);
        }
        let fluents = problem.fluents.len();
        Self {
            fluents,
            before: agenda(&problem.goal, rules),
            levels: rules.levels,
            uses_up: uses_up(fluents, &operators),
            operators,
        }
    }

    /// Returns about how many units a search with these slots has.
    pub(in crate::plan::goal_sets) fn units(problem: &Grounded, slots: usize) -> usize {
        let (fluents, operators) = (problem.fluents.len(), problem.operators.len());
        let adds: usize = problem.operators.iter().map(|o| o.adds.len()).sum();
        let rules = fluents.saturating_mul(26 + 2 * levels(problem));
        let rules = rules + operators.saturating_mul(17) + 3 * adds;
        rules.saturating_add(Layout::new(fluents, operators, slots).units())
    }

    pub(in crate::plan::goal_sets) fn size(&self) -> (usize, usize) {
        (self.fluents, self.operators.len())
    }

    pub(super) fn fluents(&self) -> usize {
        self.fluents
    }

    pub(super) fn operators(&self) -> usize {
        self.operators.len()
    }

    /// Returns links from fluents to operators.
    fn links(&self, part: fn(&GroundOperator) -> &Vec<usize>, weight: Real) -> Vec<Weight> {
        let rows = self.operators.iter().enumerate();
        rows.flat_map(|(a, o)| part(o).iter().map(move |f| (*f, a, weight))).collect()
    }

    pub(super) fn needs(&self, weight: Real) -> Vec<Weight> {
        self.links(|o| &o.preconditions, weight)
    }

    pub(super) fn adds(&self, weight: Real) -> Vec<Weight> {
        self.links(|o| &o.adds, weight)
    }

    /// Returns pairs of a fluent and an operator that adds it. Of one fluent, those that use up least come first.
    pub(super) fn supports(&self) -> Vec<(usize, usize)> {
        let all = self.operators.iter().enumerate();
        let mut pairs: Vec<(usize, usize)> =
            all.flat_map(|(a, o)| o.adds.iter().map(move |f| (*f, a))).collect();
        pairs.sort_by(|(f, a), (g, b)| {
            f.cmp(g).then(self.uses_up[*a].total_cmp(&self.uses_up[*b])).then(a.cmp(b))
        });
        pairs
    }

    /// Returns links from fluents to operators that delete and do not add them.
    pub(super) fn deletes(&self, weight: Real) -> Vec<Weight> {
        let mut links = self.links(|o| &o.deletes, weight);
        links.retain(|(f, a, _)| !self.operators[*a].adds.contains(f));
        links
    }
}

/// Returns what each operator uses up for good, relative to the one that uses up most.
///
/// Of the fluents that it deletes and no operator adds, each counts as much as others depend on it: by the sum over the operators
/// that need it, and over what these add, of one over the number of operators that add that. What serves only those who can be
/// served otherwise counts little.
fn uses_up(fluents: usize, operators: &[GroundOperator]) -> Vec<Real> {
    let mut adders = vec![0; fluents];
    operators.iter().flat_map(|o| &o.adds).for_each(|f| adders[*f] += 1);
    let mut needed = vec![0.0; fluents];
    for operator in operators {
        let depends: Real = operator.adds.iter().map(|f| 1.0 / adders[*f] as Real).sum();
        let lost = operator.preconditions.iter().filter(|f| adders[**f] == 0);
        lost.for_each(|f| needed[*f] += depends);
    }
    let used = operators.iter().map(|o| o.deletes.iter().map(|f| needed[*f]).sum());
    let used: Vec<Real> = used.collect();
    let most = used.iter().fold(1.0, |most: Real, used| most.max(*used));
    used.into_iter().map(|used| used / most).collect()
}

/// Forward search over a grounded problem: a [`Module`].
pub struct ForwardGraph {
    rules: Arc<Progression>,
    slots: usize,
    ablated: Vec<String>,
}

/// Ports of a [`ForwardGraph`].
pub struct ForwardPorts {
    /// How many weights lead from each unit, by group.
    pub(in crate::plan::goal_sets) reach: Reach,
    /// 1 while the goal is to be reached; 0 forgets it. One number.
    pub ready: In<Vector>,
    /// 1 while the shown action is carried out, however long it takes. One number.
    pub busy: In<Vector>,
    /// One number for each fluent: 1 if it holds.
    pub holds: In<Vector>,
    /// One number for each fluent: 1 if it is a goal.
    pub goal: In<Vector>,
    /// One number for each operator: 1 for the action to do.
    pub actions: Out<Vector>,
    /// One number for each phase: 1 for the present one.
    pub phases: Out<Vector>,
    /// One number for each fluent: 1 if it is in the present state.
    pub state: Out<Vector>,
    /// One number for each operator: 1 for those of the relaxed plan.
    pub used: Out<Vector>,
    /// One number for each operator: 1 for the winner.
    pub winner: Out<Vector>,
    /// One number for each slot: 1 for the present one.
    pub slot: Out<Vector>,
}

/// Returns the number of phases, and those in which it acts.
pub(in crate::plan::goal_sets) fn acting_phases() -> (usize, Vec<usize>) {
    use Phase::{Done, Fetch, Mark, Next, Rest, Show, Step, Up};
    let acting = [Mark, Up, Rest, Step, Fetch, Show, Next, Done];
    (Phase::ALL.len(), acting.map(|phase| phase as usize).to_vec())
}

impl ForwardGraph {
    /// Makes a search that remembers up to `slots` states, at least two.
    pub fn new(rules: Arc<Progression>, slots: usize) -> Self {
        Self { rules, slots: slots.max(2), ablated: Vec::new() }
    }

    /// Cuts the links from a group to the others, such as from `wanted`. The name of another group has no effect.
    #[must_use]
    pub fn ablate(mut self, group: &str) -> Self {
        self.ablated.push(group.into());
        self
    }
}

impl Module for ForwardGraph {
    type Ports = ForwardPorts;

    fn expand(self, scope: &mut Scope<'_>) -> ForwardPorts {
        let Self { rules, slots, ablated } = self;
        let (fluents, operators) = (rules.fluents(), rules.operators());
        let w = &mut Wiring::new(scope, CALM_MS, &ablated);
        let senses = Senses::new(w, fluents);
        let Senses { ready, busy, holds, goal } = &senses;
        let control = Control::new(w, ready, busy);
        let (phases, signals) = (&control.phases, &control.signals);

        let state = w.latches("state", fluents);
        let open = w.units("open", fluents);
        w.link(&state, &open, each(fluents, 1.0));
        w.link(holds, &open, each(fluents, -1.5));
        w.link(&open, signals, gather(fluents, Signal::Open as usize, 1.0));

        let plan = relaxed(w, &rules, (phases, signals), &state, goal);

        // Operators that can be applied, and lead to no visited state: those of the relaxed plan, and where these lead nowhere, all that
        // achieve something.
        let lacks = w.units("lacks", operators);
        w.link(&plan.absent, &lacks, rules.needs(1.0));
        let eligible = w.units("eligible", operators);
        w.link(&plan.used, &eligible, each(operators, 1.0));
        let strays = w.units("strays", operators);
        let useful = (0..operators).filter(|a| !rules.operators[*a].adds.is_empty());
        w.link(&control.wide, &strays, useful.map(|a| (0, a, 1.0)).collect::<Vec<_>>());
        w.link(&plan.used, &strays, each(operators, -1.5));
        w.link(&strays, &eligible, each(operators, 1.0));
        w.link(&lacks, &eligible, each(operators, -1.5));
        w.link(&eligible, signals, gather(operators, Signal::Eligible as usize, 1.0));
        let barred = w.tonic("barred", operators);
        w.link(&eligible, &barred, each(operators, -1.3));

        let race_phase = Phase::Race as usize;
        let growing = (phases, &control.elapsed, &control.restless);
        let mut bias: Vec<Real> =
            rules.uses_up.iter().map(|used| -0.7 - SERVES + SPARES * used).collect();
        // Its own need of what it deletes is no threat.
        for (f, a, _) in rules.deletes(1.0) {
            if rules.operators[a].preconditions.contains(&f) {
                bias[a] -= THREATENS;
            }
        }
        let utilities = utilities(w, growing, (race_phase, &URGES), &bias);
        w.link(&barred, &utilities, each(operators, BAR));
        w.link(&plan.wanted, &utilities, rules.adds(HELPS));
        w.link(&plan.needed, &utilities, rules.adds(SERVES));
        w.link(&plan.last, &utilities, rules.adds(COMPLETES));
        w.link(&plan.claims, &utilities, rules.deletes(THREATENS));
        w.link(&strays, &utilities, each(operators, STRAYS));
        let turns = Turns {
            race: race_phase,
            check: Phase::Check as usize,
            clear: &[Phase::Settle as usize, Phase::Start as usize, Phase::Back as usize],
            told: [Signal::Won as usize, Signal::Double as usize],
        };
        let winner = race(w, (phases, signals), &turns, &utilities);
        let layout = Layout::new(fluents, operators, slots);
        let tree = memory(w, &layout, &rules, (phases, signals), &state, &winner);
        for tabu in &tree.tabu {
            w.link(tabu, &eligible, each(operators, -1.5));
        }
        for (name, source, when) in [
            ("begin", holds, &[Phase::Start as usize][..]),
            ("commit", &tree.child, &[Phase::Write as usize][..]),
            ("recall", &tree.recalled, &[Phase::Read as usize, Phase::Fetch as usize][..]),
        ] {
            load(w, name, source, &state, phases, when);
        }
        let acting = Acting {
            phases: &[(Phase::Show as usize, 1.0), (Phase::Fetch as usize, 1.0)],
            open: Signal::Open as usize,
            unready: Signal::Unready as usize,
        };
        let links = [rules.needs(1.0), rules.adds(1.0)];
        let actions =
            act(w, (&links[0], &links[1]), (phases, signals), &acting, holds, &tree.shown);

        let [ready, busy, holds, goal] = senses.inputs(w.scope);
        ForwardPorts {
            reach: w.reach(),
            ready,
            busy,
            holds,
            goal,
            actions: w.scope.output("actions", actions.out),
            phases: control.phases.out,
            state: state.out,
            used: plan.used.out,
            winner: winner.out,
            slot: tree.slot.out,
        }
    }
}
