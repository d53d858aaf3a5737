//! The operands of expressions. `flow_ports!` makes ports one, and `flow_operators!` any other type.

use super::expression::{Flow, IntoFlow, Leaves, Level};
use super::kinds::FlowKind;
use super::operators::{flow_operators, flow_ports};
use crate::neurons::{BilinearPorts, EnsemblePorts, GatePorts, LearnedPorts};
use crate::sim::{Out, Pointer, PointerRef, Ports, Real, Scalar, Vector, VocabTag};
use crate::spa::modules::{MemoryPorts, SuperposePorts, UnbindPorts, WeighPorts};
use crate::spa::pointer::PointerValue;
use crate::spa::vocabulary::Name;

flow_ports!([A: FlowKind, K: FlowKind] Ports<A, K>, output: K, input: A);
flow_ports!([K: FlowKind] GatePorts<K>, output: K, input: K);
flow_ports!([A: FlowKind, B: FlowKind, K: FlowKind] BilinearPorts<A, B, K>, output: K);
flow_ports!([V: VocabTag] UnbindPorts<V>, output: Pointer<V>);
flow_ports!([K: FlowKind] WeighPorts<K>, output: K);
flow_ports!([K: FlowKind] SuperposePorts<K>, output: K);
flow_ports!([A: VocabTag, V: VocabTag] MemoryPorts<A, V>, output: Pointer<V>, input: Pointer<A>);
flow_ports!(@input [] EnsemblePorts, Vector);
flow_ports!(LearnedPorts, output: Vector);

flow_operators!([K: FlowKind,] Flow<K> => K);
flow_operators!(['o, K: FlowKind,] &'o Out<K> => K);
flow_operators!(@plain [K: FlowKind,] Out<K> => K);
flow_operators!(['o, V: VocabTag,] PointerRef<'o, V> => Pointer<V>);
flow_operators!(['o, V: VocabTag,] &'o PointerValue<V> => Pointer<V>);
flow_operators!([V: VocabTag,] PointerValue<V> => Pointer<V>);
flow_operators!([V: VocabTag,] Name<V> => Pointer<V>);

impl<K: FlowKind> IntoFlow for &Out<K> {
    type Kind = K;

    fn into_flow(self) -> Flow<K> {
        Flow::output(self)
    }
}

impl<K: FlowKind> IntoFlow for Out<K> {
    type Kind = K;

    fn into_flow(self) -> Flow<K> {
        Flow::output(&self)
    }
}

impl IntoFlow for Real {
    type Kind = Scalar;

    fn into_flow(self) -> Flow<Scalar> {
        Flow::number(self)
    }
}

impl<const N: usize> IntoFlow for [Real; N] {
    type Kind = Vector;

    fn into_flow(self) -> Flow<Vector> {
        Flow::vector(&self)
    }
}

impl<V: VocabTag> IntoFlow for PointerRef<'_, V> {
    type Kind = Pointer<V>;

    fn into_flow(self) -> Flow<Pointer<V>> {
        Flow::constant(&self, "pointer")
    }
}

impl<V: VocabTag> IntoFlow for &PointerRef<'_, V> {
    type Kind = Pointer<V>;

    fn into_flow(self) -> Flow<Pointer<V>> {
        (*self).into_flow()
    }
}

impl<V: VocabTag> IntoFlow for &PointerValue<V> {
    type Kind = Pointer<V>;

    fn into_flow(self) -> Flow<Pointer<V>> {
        Flow::constant(self, &format!("({})", self.expression()))
    }
}

impl<V: VocabTag> IntoFlow for PointerValue<V> {
    type Kind = Pointer<V>;

    fn into_flow(self) -> Flow<Pointer<V>> {
        (&self).into_flow()
    }
}

impl<V: VocabTag> IntoFlow for Name<V> {
    type Kind = Pointer<V>;

    fn into_flow(self) -> Flow<Pointer<V>> {
        let name = self.as_str();
        let none = (Vec::new(), Leaves::default());
        Flow::new(name, Level::Atom, none, move |cx, space| cx.named(space, name))
    }
}
