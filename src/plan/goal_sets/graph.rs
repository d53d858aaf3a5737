//! The planner as one graph of units.

use std::sync::Arc;

use super::choice::Choice;
use super::control::{Control, Phase, Signal};
use super::costs::costs;
use super::memory::{Layout, Memory};
use super::rules::Regression;
use super::wiring::{Group, Wiring, each, gather, spread};
use crate::sim::{In, Module, Out, Real, Scope, Vector};

/// The planner graph over a grounded problem: a [`Module`].
pub struct GoalSetGraph {
    rules: Arc<Regression>,
    slots: usize,
    ablated: Vec<String>,
}

/// Ports of a [`GoalSetGraph`].
pub struct GoalSetPorts {
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
    /// Sixteen numbers for each fluent: as many are 1 as it has levels of cost.
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
        let w = &mut Wiring { scope, cut: &ablated };
        let ready = w.sum("ready", 1);
        let busy = w.sum("busy", 1);
        let holds = w.sum("holds", fluents);
        let goal = w.sum("goal", fluents);
        let control = Control::new(w, &ready, &busy);
        let (phases, signals) = (&control.phases, &control.signals);

        let goals = w.latches("goals", fluents);
        let open = w.units("open", fluents);
        w.link(&goals, &open, each(fluents, 1.0));
        w.link(&holds, &open, each(fluents, -1.3));
        w.link(&open, signals, gather(fluents, Signal::Open as usize, 1.0));

        let costs = costs(w, &rules, (phases, signals), &holds, &goals);
        let choice = Choice::new(w, &rules, &control, (&goals, &open), &costs);
        let layout = Layout::new(fluents, rules.operators.len(), slots);
        let memory = Memory::new(w, &layout, &rules, (phases, signals), &goals, &choice);
        for (name, source, when) in [
            ("begin", &goal, &[Phase::Start][..]),
            ("commit", &memory.child, &[Phase::Write][..]),
            ("recall", &memory.recalled, &[Phase::Read, Phase::Fetch][..]),
        ] {
            load(w, name, source, &goals, (phases, when));
        }
        let actions = act(w, &rules, (phases, signals), &holds, &memory.shown);

        let input = |scope: &mut Scope<'_>, name: &str, group: &Group| {
            scope.input(name, group.input.clone())
        };
        GoalSetPorts {
            ready: input(w.scope, "ready", &ready),
            busy: input(w.scope, "busy", &busy),
            holds: input(w.scope, "holds", &holds),
            goal: input(w.scope, "goal", &goal),
            actions: w.scope.output("actions", actions.out),
            phases: control.phases.out,
            goals: goals.out,
            costs: costs.out,
            utilities: choice.utilities.out,
            winner: choice.winner.out,
            slot: memory.slot.out,
            signals: control.signals.out,
        }
    }
}

/// Replaces the goal set by the beginning of a source in some phases.
fn load(
    w: &mut Wiring<'_, '_>,
    name: &str,
    source: &Group,
    goals: &Group,
    (phases, when): (&Group, &[Phase]),
) {
    let fluents = goals.count;
    let now = || when.iter().flat_map(|p| spread(*p as usize, fluents, 1.0)).collect::<Vec<_>>();
    let set = w.both(&format!("{name}_set"), fluents);
    w.link(source, &set, each(fluents, 1.0));
    w.link(phases, &set, now());
    w.link(&set, goals, each(fluents, 1.2));
    let reset = w.units(&format!("{name}_reset"), fluents);
    w.link(source, &reset, each(fluents, -1.3));
    w.link(phases, &reset, now());
    w.link(&reset, goals, each(fluents, -2.5));
}

/// Adds the motor units: the shown action, while its preconditions hold, its effects do not, and some goal is open. In
/// [`Phase::Begin`] the present goal set holds, and the goals are those of the slot before.
fn act(
    w: &mut Wiring<'_, '_>,
    rules: &Regression,
    (phases, signals): (&Group, &Group),
    holds: &Group,
    shown: &Group,
) -> Group {
    let operators = shown.count;
    let lacking = w.units("lacking", operators);
    w.link(holds, &lacking, rules.links(|o| &o.preconditions, -1.0));
    let counts = rules.operators.iter().map(|o| o.preconditions.len() as Real);
    w.bias(&lacking, &counts.collect::<Vec<_>>());
    // All that the operator adds holds: it is not done again, even if another goal was lost meanwhile.
    let done = w.units("done", operators);
    w.link(holds, &done, rules.links(|o| &o.adds, 1.0));
    let counts = rules.operators.iter().map(|o| 1.0 - o.adds.len() as Real);
    w.bias(&done, &counts.collect::<Vec<_>>());
    let acting = w.both("acting", 1);
    w.link(signals, &acting, [(Signal::Open as usize, 0, 1.0)]);
    w.link(
        phases,
        &acting,
        [
            (Phase::Show as usize, 0, 1.0),
            (Phase::Fetch as usize, 0, 1.0),
            (Phase::Begin as usize, 0, 2.0),
        ],
    );
    let motor = w.both("motor", operators);
    w.link(shown, &motor, each(operators, 1.0));
    w.link(&lacking, &motor, each(operators, -1.5));
    w.link(&done, &motor, each(operators, -1.5));
    w.link(&acting, &motor, spread(0, operators, 1.0));
    w.link(&motor, signals, gather(operators, Signal::Unready as usize, -1.3));
    motor
}
