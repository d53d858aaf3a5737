//! What the modules of a planner graph hold, as numbers beside names: for traces and pictures.

use super::graph::PlanningPorts;
use crate::sim::{Out, Pointer, Real, SimView, Vector, VocabTag};
use crate::spa::{Vocabulary, dots, norm};
use crate::task::domain::Domain;
use crate::task::error::TaskError;
use crate::task::planner::encode::Encoded;

/// What a [`ModuleView`]'s numbers are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Shows {
    /// Cosines of the module's pointer with the pointers of the names, -1 to 1; of a pointer shorter than 1 its products
    /// with them, so that one that fades away goes to 0.
    Similarities,
    /// Activities of the module's items, 1 for a chosen one.
    Activities,
}

type Reads = dyn Fn(&SimView<'_>, &mut [Real]) + Send + Sync;

/// One module of a planner graph, to be looked at while it runs.
pub struct ModuleView {
    /// The module's name in the graph.
    pub name: &'static str,
    /// What stands beside its numbers, in their order.
    pub names: Vec<String>,
    /// What the numbers are.
    pub shows: Shows,
    reads: Box<Reads>,
}

impl ModuleView {
    /// The numbers after this tick, as many as there are names. Costs a product of names x dimensions.
    ///
    /// # Panics
    /// If `out` has another length.
    pub fn read(&self, view: &SimView<'_>, out: &mut [Real]) {
        assert_eq!(out.len(), self.names.len(), "a number a name");
        (self.reads)(view, out);
    }

    fn pointer<V: VocabTag>(
        name: &'static str,
        of: &Out<Pointer<V>>,
        vocabulary: &Vocabulary<V>,
        names: &[String],
    ) -> Result<Self, TaskError> {
        let mut rows = Vec::new();
        for item in names {
            rows.extend_from_slice(&vocabulary.get(item)?);
        }
        let of = of.clone();
        let reads = move |view: &SimView<'_>, out: &mut [Real]| {
            let pointer = view.value(&of);
            dots(&rows, &pointer, out);
            let length = norm(&pointer).max(1.0);
            out.iter_mut().for_each(|product| *product /= length);
        };
        let (names, shows) = (names.to_vec(), Shows::Similarities);
        Ok(Self { name, names, shows, reads: Box::new(reads) })
    }

    fn items(name: &'static str, of: &Out<Vector>, names: &[String]) -> Self {
        let of = of.clone();
        let reads = move |view: &SimView<'_>, out: &mut [Real]| {
            out.copy_from_slice(&view.value(&of)[..out.len()]);
        };
        Self { name, names: names.to_vec(), shows: Shows::Activities, reads: Box::new(reads) }
    }
}

/// The modules on the way of a decision, in its order.
pub(super) fn views(
    domain: &Domain,
    encoded: &Encoded,
    ports: &PlanningPorts,
) -> Result<Vec<ModuleView>, TaskError> {
    let states: Vec<String> = domain.states().iter().map(|s| s.name.clone()).collect();
    let actions: Vec<String> = domain.operators().iter().map(|o| o.name.clone()).collect();
    let [_, _, _, open, chosen] = &ports.watched;
    Ok(vec![
        ModuleView::pointer("goal_buffer", &ports.goal_buffer, &encoded.states, &states)?,
        ModuleView::pointer("cause", &ports.cause, &encoded.actions, &actions)?,
        ModuleView::pointer("unbind", &ports.unbound, &encoded.states, &states)?,
        ModuleView::pointer("required", &ports.preconditions, &encoded.states, &states)?,
        ModuleView::items("open", open, &states),
        ModuleView::items("chosen", chosen, &states),
        ModuleView::pointer("motor_gate", &ports.gated, &encoded.actions, &actions)?,
        ModuleView::pointer("motor", &ports.action, &encoded.actions, &actions)?,
    ])
}
