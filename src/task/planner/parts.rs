//! Groups of nodes in the planner graph.

use super::encode::{ABSENT, ActionSpace, Encoded, StateSpace, deep_absent};
use super::graph::RECOGNISED;
use crate::neurons::SelectRule;
use crate::sim::{
    Add, Constant, Fingerprint, In, InputSpec, Out, OutputSpec, Pointer, PointerRef, Real, Scope,
    Scratch, ScratchSpec, Space, Synapse, Vector,
};
use crate::spa::{
    AssociativeMemory, CleanupMemory, Linear, LinearMap, LinearPorts, PointerValue, Selection,
    Unbind, UnbindFixed, VocabError,
};
use crate::task::domain::Domain;

/// Finds the states that hold but must be absent. The node names `barred`, `forbidden` and `deep_absent` must
/// stay: each node's neurons are drawn from its name.
pub(super) struct Violated {
    deep: AssociativeMemory<ActionSpace, StateSpace>,
    unbind: UnbindFixed<StateSpace>,
    forbidden: CleanupMemory<StateSpace>,
}

impl Violated {
    /// Builds the group; `None` if no action requires a state to be absent.
    pub fn of(
        domain: &Domain,
        encoded: &Encoded,
        winner: SelectRule,
        every: SelectRule,
    ) -> Result<Option<Self>, VocabError> {
        let deep: Vec<(&str, String)> = domain
            .operators()
            .iter()
            .filter_map(|o| Some((&o.name[..], deep_absent(domain, o)?)))
            .collect();
        if deep.is_empty() {
            return Ok(None);
        }
        let names = domain.states().iter().map(|s| s.name.as_str());
        Ok(Some(Self {
            deep: AssociativeMemory::new(
                &encoded.actions,
                &encoded.states,
                deep.iter().map(|(name, deep)| (*name, deep.as_str())),
                winner,
            )?,
            unbind: UnbindFixed::new(&encoded.states, ABSENT)?,
            forbidden: CleanupMemory::new(&encoded.states, names, every)?,
        }))
    }

    /// Adds the nodes. The output has one number for each state: 1 if the state holds but must be absent for
    /// `action`.
    pub fn expand(
        self,
        scope: &mut Scope<'_>,
        action: &Out<Pointer<ActionSpace>>,
        present: &Out<Vector>,
        states: usize,
    ) -> Out<Vector> {
        let none = Synapse::None;
        let deep = scope.add("deep_absent", self.deep);
        let unbind = scope.add("unbind_absent", self.unbind);
        let forbidden = scope.add("forbidden", self.forbidden);
        // An item passes only if it is both forbidden and present.
        let both = SelectRule::Threshold { level: 1.0 + RECOGNISED };
        let violated = scope.add("barred", Selection::new(states, both));
        scope.connect(action, &deep.input, none);
        scope.connect(&deep.output, &unbind.input, none);
        scope.connect(&unbind.output, &forbidden.input, none);
        scope.connect(&forbidden.items, &violated.utilities, none);
        scope.connect(present, &violated.utilities, none);
        violated.items
    }
}

/// The stage that identifies the unbound preconditions.
pub(super) struct Required {
    pub input: Vec<In<Pointer<StateSpace>>>,
    pub items: Out<Vector>,
    pub output: Out<Pointer<StateSpace>>,
}

impl Required {
    /// Builds the stage without a cleanup: similarities are passed on unchanged.
    pub fn as_they_are<'p>(
        scope: &mut Scope<'_>,
        space: &Space<StateSpace>,
        keys: impl IntoIterator<Item = PointerRef<'p, StateSpace>>,
    ) -> Self {
        let raw = scope.add("required", Linear::similarities(space, keys));
        let pointer = scope.add("required_pointer", Add::pointer(space));
        Self { input: vec![raw.input, pointer.input], items: raw.output, output: pointer.output }
    }

    pub fn connect(&self, scope: &mut Scope<'_>, unbound: &Out<Pointer<StateSpace>>) {
        for input in &self.input {
            scope.connect(unbound, input, Synapse::None);
        }
    }
}

/// Unbinds PRECONDITION from a deep pointer by a layer of products.
pub(super) fn unbind_by_products(
    scope: &mut Scope<'_>,
    encoded: &Encoded,
    precondition: &PointerValue<StateSpace>,
    deep: &Out<Pointer<StateSpace>>,
) -> Out<Pointer<StateSpace>> {
    let role = Constant::pointer(encoded.states.space(), precondition);
    let role = scope.add("precondition", role);
    let unbind = scope.add("unbind", Unbind::new(&encoded.states));
    scope.connect(deep, &unbind.bound, Synapse::None);
    scope.connect(&role, &unbind.role, Synapse::None);
    unbind.output
}

/// Drops the last item, which stands for "no precondition", from the required states.
pub(super) fn states_required(scope: &mut Scope<'_>, states: usize) -> LinearPorts<Vector, Vector> {
    let (input, output) = (InputSpec::vector(states + 1), OutputSpec::vector(states));
    let head = Head { from: states + 1, to: states };
    scope.add("states_required", Linear::new(input, output, Box::new(head)))
}

/// A linear map to the first `to` numbers of a vector of `from`.
struct Head {
    from: usize,
    to: usize,
}

impl LinearMap for Head {
    fn input_width(&self) -> usize {
        self.from
    }

    fn output_width(&self) -> usize {
        self.to
    }

    fn scratch(&self) -> ScratchSpec {
        ScratchSpec::default()
    }

    fn fingerprint(&self, hash: &mut Fingerprint) {
        hash.text("head");
    }

    fn apply_into(&self, input: &[Real], out: &mut [Real], _scratch: &mut Scratch<'_>) {
        out.copy_from_slice(&input[..self.to]);
    }
}
