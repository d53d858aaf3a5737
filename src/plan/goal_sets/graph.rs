//! The planner as one graph of units.

use std::sync::Arc;

use super::choice::Choice;
use super::control::{Control, Phase, Signal};
use super::costs::{Wave, levels, reachable};
use super::memory::memory;
use super::motor::{Acting, act, load};
use super::rules::Regression;
use super::senses::Senses;
use super::tree::Layout;
use super::triples::{HEIGHTS, MOST_SETS, small};
use super::wiring::{QUICK_MS, Reach, Wiring, each, gather};
use crate::plan::strips::Grounded;
use crate::sim::{In, Module, Out, Scope, Vector};

/// The planner graph over a grounded problem: a [`Module`].
pub struct GoalSetGraph {
    rules: Arc<Regression>,
    slots: usize,
    ablated: Vec<String>,
}

/// Ports of a [`GoalSetGraph`].
pub struct GoalSetPorts {
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
    /// One number for each fluent: 1 if it is in the present goal set.
    pub goals: Out<Vector>,
    /// As many numbers for each fluent as there are levels: as many are 1 as it has levels of cost.
    pub costs: Out<Vector>,
    /// One number for each operator: its utility in the race.
    pub utilities: Out<Vector>,
    /// One number for each operator: 1 for the winner.
    pub winner: Out<Vector>,
    /// One number for each slot: 1 for the present one.
    pub slot: Out<Vector>,
    /// One number for each signal of the control.
    pub signals: Out<Vector>,
}

/// Returns the names of the phases, in the order of [`GoalSetPorts::phases`].
pub fn phase_names() -> Vec<String> {
    Phase::ALL.iter().map(|phase| format!("{phase:?}")).collect()
}

/// Returns the number of phases, and those in which it acts.
pub(super) fn acting_phases() -> (usize, Vec<usize>) {
    let acting = [Phase::Begin, Phase::Step, Phase::Fetch, Phase::Show, Phase::Next, Phase::Done];
    (Phase::ALL.len(), acting.map(|phase| phase as usize).to_vec())
}

impl Regression {
    /// Returns about how many units a graph of a problem has, with these slots.
    pub(super) fn units(problem: &Grounded, slots: usize) -> usize {
        let (fluents, operators) = (problem.fluents.len(), problem.operators.len());
        // Pairs of fluents are kept as a table while the planner is built.
        let table = fluents.saturating_mul(fluents) / 256;
        let rules = fluents.saturating_mul(3 * levels(problem) + 23) + operators.saturating_mul(18);
        let units_of_sets = match small(problem) {
            true => slots.saturating_mul(14).saturating_add(MOST_SETS),
            false => 0,
        };
        let slots = Layout::new(fluents, operators, slots).units();
        rules.saturating_add(table).saturating_add(slots).saturating_add(units_of_sets)
    }
}

impl GoalSetGraph {
    /// Makes a planner that remembers up to `slots` goal sets, at least two: one for the goal, one for each action.
    pub fn new(rules: Arc<Regression>, slots: usize) -> Self {
        Self { rules, slots: slots.max(2), ablated: Vec::new() }
    }

    /// Cuts the links from a group to the others, such as from `veto`. The name of another group has no effect.
    #[must_use]
    pub fn ablate(mut self, group: &str) -> Self {
        self.ablated.push(group.into());
        self
    }
}

impl Module for GoalSetGraph {
    type Ports = GoalSetPorts;

    fn expand(self, scope: &mut Scope<'_>) -> GoalSetPorts {
        let Self { rules, slots, ablated } = self;
        let fluents = rules.fluents;
        let w = &mut Wiring::new(scope, QUICK_MS, &ablated);
        let senses = Senses::new(w, fluents);
        let Senses { ready, busy, holds, goal } = &senses;
        let control = Control::new(w, ready, busy);
        let (phases, signals) = (&control.phases, &control.signals);

        let goals = w.latches("goals", fluents);
        let open = w.units("open", fluents);
        w.link(&goals, &open, each(fluents, 1.0));
        w.link(holds, &open, each(fluents, -1.3));
        w.link(&open, signals, gather(fluents, Signal::Open as usize, 1.0));

        let [needs, adds] = [rules.links(|o| &o.preconditions, 1.0), rules.links(|o| &o.adds, 1.0)];
        let resets = (phases, &[Phase::Start as usize][..]);
        let names = ["reached", "pending", "enabled"];
        let wave = Wave::new(w, names, (&needs, &adds), resets, (holds, rules.operators.len()));
        wave.tell(w, "unreached", &goals, signals, Signal::Unreached as usize);
        let costs = wave.count(w, &needs, resets, rules.levels);
        let told = [Signal::Beyond as usize, Signal::News as usize];
        let sizes = (holds, rules.operators.len());
        reachable(w, (&needs, &adds), resets, sizes, (&goals, signals), told);
        let choice = Choice::new(w, &rules, &control, (&goals, &open), &costs);
        let layout = Layout::new(fluents, rules.operators.len(), slots);
        let layout = layout.with_heights(if rules.heights.is_empty() { 0 } else { HEIGHTS });
        let memory = memory(w, &layout, &rules, &control, &goals, &choice);
        for (name, source, when) in [
            ("begin", goal, &[Phase::Start][..]),
            ("commit", &memory.child, &[Phase::Write][..]),
            ("recall", &memory.recalled, &[Phase::Read, Phase::Fetch][..]),
        ] {
            let when: Vec<usize> = when.iter().map(|phase| *phase as usize).collect();
            load(w, name, source, &goals, phases, &when);
        }
        // In Begin the present goal set holds, and the goals are those of the slot before.
        let acting = Acting {
            phases: &[
                (Phase::Show as usize, 1.0),
                (Phase::Fetch as usize, 1.0),
                (Phase::Begin as usize, 2.0),
            ],
            open: Signal::Open as usize,
            unready: Signal::Unready as usize,
        };
        let actions = act(w, (&needs, &adds), (phases, signals), &acting, holds, &memory.shown);

        let [ready, busy, holds, goal] = senses.inputs(w.scope);
        GoalSetPorts {
            reach: w.reach(),
            ready,
            busy,
            holds,
            goal,
            actions: w.scope.output("actions", actions.out),
            phases: control.phases.out,
            goals: goals.out,
            costs: costs.levels.out,
            utilities: choice.utilities.out,
            winner: choice.winner.out,
            slot: memory.slot.out,
            signals: control.signals.out,
        }
    }
}
