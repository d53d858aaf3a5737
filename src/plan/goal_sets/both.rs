//! Both searches as one planner: they run at once, and the first that finds a plan acts.

use std::sync::Arc;

use super::forward::{ForwardGraph, ForwardPorts, Progression, acting_phases as forward_acts};
use super::graph::{GoalSetGraph, GoalSetPorts, acting_phases as backward_acts};
use super::rules::Regression;
use super::senses::Senses;
use super::wiring::{Group, QUICK_MS, Reach, Wiring, each};
use crate::plan::strips::Grounded;
use crate::sim::{In, Module, Out, Scope, Synapse, Vector};

/// The directions in which a planner searches.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Directions {
    /// From the goal back, by regression.
    Backward,
    /// From what holds forward, along relaxed plans.
    Forward,
    /// Both at once.
    #[default]
    Both,
}

impl Directions {
    /// Returns the name, as experiments give it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Backward => "backward",
            Self::Forward => "forward",
            Self::Both => "both",
        }
    }
}

/// A planner that searches backward, forward or both ways: a [`Module`].
pub struct PlannerGraph {
    backward: Option<(Arc<Regression>, usize)>,
    forward: Option<(Arc<Progression>, usize)>,
    ablated: Vec<String>,
}

impl PlannerGraph {
    /// Makes a planner for a problem. The search backward remembers up to `slots[0]` goal sets, the one forward `slots[1]` states,
    /// each at least two. `rules` are those of the problem.
    ///
    /// Costs O(rounds x (operators x goals + goals³ / 64)), with as many rounds as goals that must follow one another.
    pub fn new(
        problem: &Grounded,
        rules: Arc<Regression>,
        directions: Directions,
        slots: [usize; 2],
    ) -> Self {
        let progression = || Arc::new(Progression::new(problem, &rules));
        let forward = (directions != Directions::Backward).then(|| (progression(), slots[1]));
        let backward = (directions != Directions::Forward).then_some((rules, slots[0]));
        Self { backward, forward, ablated: Vec::new() }
    }

    /// Cuts the links from a group to the others, by its path, such as `backward/veto` or `forward/wanted`. Another path has no
    /// effect.
    #[must_use]
    pub fn ablate(mut self, path: &str) -> Self {
        self.ablated.push(path.into());
        self
    }
}

/// Ports of a [`PlannerGraph`].
pub struct PlannerPorts {
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
    /// How many weights lead from each unit, by group.
    pub(super) reach: Reach,
    /// The search backward, if there is one.
    pub backward: Option<GoalSetPorts>,
    /// The search forward, if there is one.
    pub forward: Option<ForwardPorts>,
}

impl Module for PlannerGraph {
    type Ports = PlannerPorts;

    fn expand(self, scope: &mut Scope<'_>) -> PlannerPorts {
        let Self { backward, forward, ablated } = self;
        let sizes = backward.as_ref().map(|(rules, _)| (rules.fluents, rules.operators.len()));
        let sizes = sizes.or(forward.as_ref().map(|(rules, _)| rules.size()));
        let (fluents, operators) = sizes.unwrap_or((0, 0));
        let cut =
            |search: &'static str| ablated.iter().filter_map(move |path| path.strip_prefix(search));
        let backward = backward.map(|(rules, slots)| {
            let graph = GoalSetGraph::new(rules, slots);
            scope.add("backward", cut("backward/").fold(graph, GoalSetGraph::ablate))
        });
        let forward = forward.map(|(rules, slots)| {
            let graph = ForwardGraph::new(rules, slots);
            scope.add("forward", cut("forward/").fold(graph, ForwardGraph::ablate))
        });

        let w = &mut Wiring::new(scope, QUICK_MS, &[]);
        ["backward", "forward"].into_iter().for_each(|search| w.describe(search));
        let senses = Senses::new(w, fluents);
        let Senses { ready, busy, holds, goal } = &senses;
        let actions = w.sum("actions", operators);
        let searches = [
            backward
                .as_ref()
                .map(|p| ("backward", [&p.ready, &p.busy, &p.holds, &p.goal], &p.actions)),
            forward
                .as_ref()
                .map(|p| ("forward", [&p.ready, &p.busy, &p.holds, &p.goal], &p.actions)),
        ];
        // While one search acts, the other is not asked. If both find a plan at once, the one backward acts.
        let asked = searches.each_ref().map(|search| {
            search.as_ref().map(|(name, inputs, shown)| {
                let asked = w.sum(&format!("asked_{name}"), 1);
                w.link(ready, &asked, [(0, 0, 1.0)]);
                for (from, to) in [&asked, busy, holds, goal].into_iter().zip(inputs) {
                    w.scope.connect(&from.out, to, Synapse::None);
                }
                let shown = w.relay(&format!("shown_{name}"), shown, operators);
                w.link(&shown, &actions, each(operators, 1.0));
                asked
            })
        });
        if let ([Some(asked_backward), Some(asked_forward)], Some(b), Some(f)) =
            (&asked, &backward, &forward)
        {
            let acts = |w: &mut Wiring<'_, '_>,
                        name: &str,
                        phases: &Out<Vector>,
                        acting: &[usize],
                        count| {
                let phases = w.relay(&format!("{name}_phases"), phases, count);
                let acts = w.units(&format!("{name}_acts"), 1);
                w.link(&phases, &acts, acting.iter().map(|phase| (*phase, 0, 1.0)));
                acts
            };
            let (count, acting) = backward_acts();
            let backward_acts: Group = acts(w, "backward", &b.phases, &acting, count);
            let (count, acting) = forward_acts();
            let forward_acts = acts(w, "forward", &f.phases, &acting, count);
            w.link(&backward_acts, &forward_acts, [(0, 0, -2.0)]);
            w.link(&backward_acts, asked_forward, [(0, 0, -1.5)]);
            w.link(&forward_acts, asked_backward, [(0, 0, -1.5)]);
        }
        // Groups within a search are named by their paths.
        let mut reach = w.reach();
        for (name, inner) in [
            ("backward", backward.as_ref().map(|ports| &ports.reach)),
            ("forward", forward.as_ref().map(|ports| &ports.reach)),
        ] {
            let named = inner.into_iter().flatten();
            reach.extend(named.map(|(group, counts)| (format!("{name}/{group}"), counts.clone())));
        }
        let [ready, busy, holds, goal] = senses.inputs(w.scope);
        PlannerPorts {
            reach,
            ready,
            busy,
            holds,
            goal,
            actions: w.scope.output("actions", actions.out),
            backward,
            forward,
        }
    }
}
