//! Named numbers for the contents of the planner graph's modules, for traces and pictures.

use super::encode::Encoded;
use super::graph::PlanningPorts;
use crate::sim::{Graph, Kind, Note, Out, Pointer, Real, SimView, Vector, VocabTag};
use crate::spa::{Vocabulary, dots, norm};
use crate::task::error::TaskError;
use crate::task::propositional::Domain;

/// Kind of numbers that a [`ModuleView`] shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Shows {
    /// Cosines of the module's pointer with the named pointers, -1 to 1. A pointer shorter than 1 is not normalised:
    /// the numbers are then its dot products, so they go to 0 as the pointer fades.
    Similarities,
    /// Activities of the module's items: 1 for a chosen item.
    Activities,
}

type Reads = dyn Fn(&SimView<'_>, &mut [Real]) + Send + Sync;

/// A view of one module of a planner graph, for reading it while the graph runs.
pub struct ModuleView {
    /// Name for scripts and files.
    pub name: &'static str,
    /// What the module is called for people, and what it does.
    pub note: Note,
    /// Names of the numbers, in order.
    pub names: Vec<String>,
    /// Kind of the numbers.
    pub shows: Shows,
    reads: Box<Reads>,
}

impl ModuleView {
    /// Writes the numbers after this tick to `out`, one for each name. For similarities, this costs one multiplication
    /// for each name and dimension.
    ///
    /// # Panics
    /// If `out` does not have one number for each name.
    pub fn read(&self, view: &SimView<'_>, out: &mut [Real]) {
        assert_eq!(out.len(), self.names.len(), "`out` must have one number for each name");
        (self.reads)(view, out);
    }

    fn pointer<V: VocabTag>(
        graph: &Graph,
        name: &'static str,
        of: &Out<Pointer<V>>,
        vocabulary: &Vocabulary<V>,
        names: &[String],
    ) -> Result<Self, TaskError> {
        let mut rows = Vec::new();
        for item in names {
            rows.extend_from_slice(&vocabulary.get(item)?);
        }
        let (note, of) = (note(graph, name, of), of.clone());
        let reads = move |view: &SimView<'_>, out: &mut [Real]| {
            let pointer = view.value(&of);
            dots(&rows, &pointer, out);
            let length = norm(&pointer).max(1.0);
            out.iter_mut().for_each(|product| *product /= length);
        };
        let (names, shows) = (names.to_vec(), Shows::Similarities);
        Ok(Self { name, note, names, shows, reads: Box::new(reads) })
    }

    /// A view of items.
    pub(in crate::task::planner) fn items(
        graph: &Graph,
        name: &'static str,
        of: &Out<Vector>,
        names: &[String],
    ) -> Self {
        Self::activities(graph, name, of, names, |values, out| {
            out.copy_from_slice(&values[..out.len()])
        })
    }

    /// A view of rows of items: for each name, the mean activity of its row.
    pub(in crate::task::planner) fn rows(
        graph: &Graph,
        name: &'static str,
        of: &Out<Vector>,
        names: &[String],
    ) -> Self {
        Self::activities(graph, name, of, names, |values, out| {
            let width = (values.len() / out.len().max(1)).max(1);
            for (mean, row) in out.iter_mut().zip(values.chunks(width)) {
                *mean = row.iter().sum::<Real>() / width as Real;
            }
        })
    }

    fn activities(
        graph: &Graph,
        name: &'static str,
        of: &Out<Vector>,
        names: &[String],
        read: fn(&[Real], &mut [Real]),
    ) -> Self {
        let (note, of) = (note(graph, name, of), of.clone());
        let reads = move |view: &SimView<'_>, out: &mut [Real]| read(view.value(&of), out);
        let (names, shows) = (names.to_vec(), Shows::Activities);
        Self { name, note, names, shows, reads: Box::new(reads) }
    }
}

/// Returns what the module of an output is called; the name for scripts if nobody has said so.
fn note<K: Kind>(graph: &Graph, name: &str, of: &Out<K>) -> Note {
    let known = graph.note_of(of).cloned();
    known.unwrap_or_else(|| Note { name: name.into(), meaning: String::new() })
}

/// Returns the views of the modules, in the order of a decision.
pub(in crate::task::planner) fn views(
    domain: &Domain,
    encoded: &Encoded,
    ports: &PlanningPorts,
    graph: &Graph,
) -> Result<Vec<ModuleView>, TaskError> {
    let states: Vec<String> = domain.states().iter().map(|s| s.name.clone()).collect();
    let actions: Vec<String> = domain.operators().iter().map(|o| o.name.clone()).collect();
    let [_, _, _, open, chosen] = &ports.watched;
    Ok(vec![
        ModuleView::pointer(graph, "goal_buffer", &ports.goal_buffer, &encoded.states, &states)?,
        ModuleView::pointer(graph, "cause", &ports.cause, &encoded.actions, &actions)?,
        ModuleView::pointer(graph, "unbind", &ports.unbound, &encoded.states, &states)?,
        ModuleView::pointer(graph, "required", &ports.preconditions, &encoded.states, &states)?,
        ModuleView::items(graph, "open", open, &states),
        ModuleView::items(graph, "chosen", chosen, &states),
        ModuleView::pointer(graph, "motor_gate", &ports.gated, &encoded.actions, &actions)?,
        ModuleView::pointer(graph, "motor", &ports.action, &encoded.actions, &actions)?,
    ])
}
