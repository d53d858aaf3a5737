//! One case for every way in which a graph can be described wrongly, and what the message says.

#![allow(clippy::unwrap_used, clippy::expect_used)]

use symbolt::neurons::{PathPattern, Population, PopulationPlan};
use symbolt::sim::{
    Add, BuildError, BuildErrors, Constant, EmitIo, Fingerprint, Graph, GraphBuilder, In,
    InputSpec, Kind, LayerRequest, Node, NodePorts, Out, OutputSpec, Pointer, PointerRef, PortDecl,
    ProbeSpec, Scalar, Scope, Seed, SimDuration, StepCx, Synapse, Timebase, Vector, VocabTag,
    WorldLink,
};
use symbolt::spa::{Bind, Linear, Vocabulary, VocabularyBuilder};

struct Parts;
impl VocabTag for Parts {
    const NAME: &'static str = "parts";
}

fn parts(seed: u64) -> Vocabulary<Parts> {
    VocabularyBuilder::new(32, Seed::new(seed))
        .any_similarity()
        .pointer("NUT")
        .build()
        .expect("sound")
}

fn build(graph: GraphBuilder) -> Result<Graph, BuildErrors> {
    graph.build(Timebase::default(), &PopulationPlan::direct(), Seed::new(1))
}

fn faults(graph: GraphBuilder) -> Vec<BuildError> {
    build(graph).expect_err("the description is wrong").0
}

/// The only fault, and its text.
fn only(graph: GraphBuilder) -> (BuildError, String) {
    let mut all = faults(graph);
    assert_eq!(all.len(), 1, "{all:?}");
    let fault = all.remove(0);
    let text = fault.to_string();
    (fault, text)
}

/// A node of one input and one output.
struct Pass(usize);
impl Node for Pass {
    fn declare(&self, ports: &mut PortDecl) {
        ports.input("in", InputSpec::vector(self.0)).output("out", OutputSpec::vector(self.0));
    }

    fn fingerprint(&self, _hash: &mut Fingerprint) {}
    fn emit(&self, _cx: &StepCx<'_>, io: &mut EmitIo<'_>) {
        io.outputs.get_mut(0).copy_from_slice(io.inputs.get(0));
    }
}

fn pass(graph: &mut GraphBuilder, name: &str, width: usize) -> (In<Vector>, Out<Vector>) {
    let node = graph.node(name, Pass(width));
    (node.input("in"), node.output("out"))
}

#[test]
fn an_empty_graph() {
    assert_eq!(faults(GraphBuilder::new()), [BuildError::Empty]);
}

#[test]
fn two_nodes_of_one_path() {
    let mut graph = GraphBuilder::new();
    graph.add("a", Constant::scalar(1.0));
    graph.add("a", Constant::scalar(2.0));
    assert_eq!(only(graph).0, BuildError::DuplicatePath { path: "a".into() });
}

#[test]
fn names_that_paths_cannot_hold() {
    for name in ["", "a/b", "a b", "ü"] {
        let mut graph = GraphBuilder::new();
        graph.add(name, Constant::scalar(1.0));
        assert!(matches!(only(graph).0, BuildError::BadName { .. }), "{name}");
    }
}

#[test]
fn a_port_that_is_not_there_names_those_that_are() {
    let mut graph = GraphBuilder::new();
    let one = graph.add("one", Constant::vector(&[1.0]));
    let node = graph.node("node", Pass(1));
    graph.connect(&one, &node.input("inn"), Synapse::None);
    graph.connect(&one, &node.input("in"), Synapse::None);
    let (_, text) = only(graph);
    assert!(text.contains("`node` has no input `inn`") && text.contains("in: vector"), "{text}");
}

#[test]
fn a_port_of_another_kind() {
    let mut graph = GraphBuilder::new();
    let one = graph.add("one", Constant::vector(&[1.0]));
    let node = graph.node("node", Pass(1));
    graph.connect(&one, &node.input("in"), Synapse::None);
    graph.probe(&node.output::<Scalar>("out"), ProbeSpec::default());
    let (_, text) = only(graph);
    assert!(text.contains("no output `out` of kind scalar"), "{text}");
}

#[test]
fn a_handle_of_another_builder() {
    let mut other = GraphBuilder::new();
    let foreign = other.add("one", Constant::vector(&[1.0]));
    let mut graph = GraphBuilder::new();
    let own = graph.add("one", Constant::vector(&[1.0]));
    let (input, _) = pass(&mut graph, "node", 1);
    graph.connect(&own, &input, Synapse::None);
    graph.connect(&foreign, &input, Synapse::None);
    assert!(matches!(only(graph).0, BuildError::ForeignHandle { direction: "output", .. }));
}

#[test]
fn widths_that_differ_name_both_ends_and_what_would_fit() {
    let mut graph = GraphBuilder::new();
    let three = graph.add("three", Constant::vector(&[1.0; 3]));
    graph.add("two", Constant::vector(&[1.0; 2]));
    let (input, _) = pass(&mut graph, "node", 2);
    let sum = graph.add("sum", Add::vector(3));
    graph.connect(&three, &sum.input, Synapse::None);
    graph.connect(&three, &input, Synapse::None);
    let (fault, text) = only(graph);
    assert!(matches!(fault, BuildError::WidthMismatch { from_width: 3, to_width: 2, .. }));
    for part in ["`three.out` has width 3", "`node.in` takes width 2", "`sum.in`", "`two.out`"] {
        assert!(text.contains(part), "{part} in {text}");
    }
}

#[test]
fn two_vocabularies_of_one_tag_name_both_and_the_way_across() {
    let (mine, yours) = (parts(1), parts(2));
    let mut graph = GraphBuilder::new();
    let bind = graph.add("bind", Bind::new(&mine));
    let nut = graph.add("nut", Constant::pointer(yours.space(), &yours.get("NUT").expect("there")));
    let own = graph.add("own", Constant::pointer(mine.space(), &mine.get("NUT").expect("there")));
    graph.connect(&nut, &bind.a, Synapse::None);
    graph.connect(&own, &bind.b, Synapse::None);
    let (_, text) = only(graph);
    for part in ["seed 1", "seed 2", "`own.out`", "a node between", "bind/left.in"] {
        assert!(text.contains(part), "{part} in {text}");
    }
}

#[test]
fn a_second_source_and_no_source() {
    let mut graph = GraphBuilder::new();
    let one = graph.add("one", Constant::vector(&[1.0]));
    let two = graph.add("two", Constant::vector(&[2.0]));
    let (input, _) = pass(&mut graph, "node", 1);
    graph.connect(&one, &input, Synapse::None);
    graph.connect(&two, &input, Synapse::lowpass_ms(5));
    pass(&mut graph, "hungry", 1);
    let all = faults(graph);
    assert_eq!(all.len(), 2, "{all:?}");
    let text = BuildErrors(all.clone()).to_string();
    assert!(matches!(&all[0], BuildError::Unfed { port, .. } if port == "hungry.in"));
    assert!(matches!(&all[1], BuildError::TooManySources { to, sources }
        if to == "node.in" && sources == &["one.out", "two.out"]));
    assert!(text.starts_with("the graph has 2 faults:") && text.contains("`one.out`"), "{text}");
}

#[test]
fn a_population_on_an_edge_without_a_synapse() {
    use symbolt::neurons::{Layers, Map};
    struct Bare;
    impl symbolt::sim::Module for Bare {
        type Ports = (In<Vector>, Out<Vector>);
        fn expand(self, scope: &mut Scope<'_>) -> Self::Ports {
            let layer = scope.map("layer", Map::each(1, |x| x * x));
            (layer.input, layer.output)
        }
    }
    let describe = |via: Synapse| {
        let mut graph = GraphBuilder::new();
        let one = graph.add("one", Constant::vector(&[1.0]));
        let (input, output) = graph.add("bare", Bare);
        let sum = graph.add("sum", Add::vector(1));
        graph.connect(&one, &input, Synapse::None);
        graph.connect(&output, &sum.input, via);
        graph
    };
    let (fault, text) = only(describe(Synapse::None));
    assert!(matches!(fault, BuildError::Unfiltered { .. }));
    assert!(text.contains("`bare/layer.out`") && text.contains("`sum.in`"), "{text}");
    assert!(build(describe(Synapse::lowpass_ms(5))).is_ok());
}

#[test]
fn a_loop_without_a_synapse_prints_its_whole_path() {
    let describe = |via: Synapse| {
        let mut graph = GraphBuilder::new();
        let a = graph.add("a", Add::vector(1));
        let (b_in, b_out) = pass(&mut graph, "b", 1);
        let (c_in, c_out) = pass(&mut graph, "c", 1);
        graph.connect(&a.output, &b_in, Synapse::None);
        graph.connect(&b_out, &c_in, Synapse::None);
        graph.connect(&c_out, &a.input, via);
        let one = graph.add("one", Constant::vector(&[1.0]));
        graph.connect(&one, &a.input, Synapse::None);
        graph
    };
    let (fault, text) = only(describe(Synapse::None));
    let BuildError::AlgebraicLoop { path } = fault else { panic!("{text}") };
    assert_eq!(path.len(), 4);
    assert_eq!(path.first(), path.last());
    let joined = path.join(" ");
    assert!(["a b c a", "b c a b", "c a b c"].contains(&joined.as_str()), "{joined}");
    assert!(build(describe(Synapse::lowpass_ms(5))).is_ok());
}

#[test]
fn two_loops_are_told_both_and_a_node_behind_them_is_not_blamed() {
    let mut graph = GraphBuilder::new();
    for name in ["a", "b"] {
        let (input, output) = pass(&mut graph, name, 1);
        graph.connect(&output, &input, Synapse::None);
        let (after, _) = pass(&mut graph, &format!("{name}_after"), 1);
        graph.connect(&output, &after, Synapse::None);
    }
    let loops: Vec<BuildError> = faults(graph);
    let expected = ["a", "b"].map(|n| BuildError::AlgebraicLoop { path: vec![n.into(), n.into()] });
    assert_eq!(loops, expected);
}

#[test]
fn time_constants_and_periods_that_cannot_be_counted() {
    let mut graph = GraphBuilder::new();
    let one = graph.add("one", Constant::vector(&[1.0]));
    let (input, output) = pass(&mut graph, "node", 1);
    graph.connect(&one, &input, Synapse::lowpass(SimDuration::ZERO));
    graph.probe(&output, ProbeSpec::every(SimDuration::from_micros(1_500)));
    graph.probe(&output, ProbeSpec::default().last(0));
    let all = faults(graph);
    assert_eq!(all.len(), 3, "{all:?}");
    assert!(matches!(all[0], BuildError::BadSynapse { .. }));
    assert!(all[1..].iter().all(|f| matches!(f, BuildError::BadProbe { .. })));
}

/// The only fault besides the missing source is the node `map`'s own, whose text says this.
fn refused(module: Linear<impl Kind, impl Kind>, expected: &str) {
    let mut graph = GraphBuilder::new();
    graph.add("map", module);
    let all = faults(graph);
    let [fault @ BuildError::Refused { node, .. }, BuildError::Unfed { .. }] = &all[..] else {
        panic!("{all:?}")
    };
    let text = fault.to_string();
    assert!(node == "map" && text.contains("`map`") && text.contains(expected), "{text}");
}

#[test]
fn pointers_of_another_dimension_than_the_space() {
    let parts = parts(1);
    let (nut, long) = (parts.get("NUT").expect("there"), [1.0; 64]);
    let keys = || [nut, PointerRef::from_raw(&long)];
    let expected = "pointer 2 has 64 dimensions; expected 32";
    refused(Linear::similarities(parts.space(), keys()), expected);
    refused(Linear::combination(parts.space(), keys()), expected);
    // Both nodes still have a port number for each pointer, so that nothing else is reported.
    let mut graph = GraphBuilder::new();
    let similar = graph.add("similar", Linear::similarities(parts.space(), keys()));
    let recalled = graph.add("recalled", Linear::combination(parts.space(), keys()));
    let given = graph.add("given", Constant::pointer(parts.space(), &nut));
    graph.connect(&given, &similar.input, Synapse::None);
    graph.connect(&similar.output, &recalled.input, Synapse::None);
    let all = faults(graph);
    assert_eq!(all.len(), 2, "{all:?}");
    assert!(all.iter().all(|f| matches!(f, BuildError::Refused { .. })));
}

#[test]
fn a_matrix_whose_last_row_is_not_whole() {
    let expected = "7 numbers are not whole rows of 4; expected a multiple of 4";
    refused(Linear::rows(4, vec![1.0; 7]), expected);
    refused(Linear::weighted_rows(4, vec![1.0; 7]), expected);
    let mut graph = GraphBuilder::new();
    let given = graph.add("given", Constant::vector(&[1.0; 4]));
    let rows = graph.add("rows", Linear::rows(4, vec![1.0; 8]));
    let weighted = graph.add("weighted", Linear::weighted_rows(4, vec![1.0; 8]));
    graph.connect(&given, &rows.input, Synapse::None);
    graph.connect(&rows.output, &weighted.input, Synapse::None);
    build(graph).expect("whole rows");
}

#[test]
fn a_node_that_refuses_its_own_parameters() {
    let mut graph = GraphBuilder::new();
    graph.add("none", Constant::vector(&[]));
    graph.add("nan", Constant::vector(&[f32::NAN]));
    let space = parts(1).space().clone();
    graph.add("short", Constant::<Pointer<Parts>>::pointer(&space, &PointerRef::from_raw(&[1.0])));
    let all = faults(graph);
    assert_eq!(all.len(), 3, "{all:?}");
    assert!(all.iter().all(|f| matches!(f, BuildError::Refused { .. })));
}

#[test]
fn a_second_world() {
    let mut graph = GraphBuilder::new();
    graph.world("a", WorldLink::new().sense("s", OutputSpec::scalar()));
    graph.world("b", WorldLink::new().sense("s", OutputSpec::scalar()));
    assert!(matches!(only(graph).0, BuildError::SecondWorld { .. }));
}

#[test]
fn a_plan_that_names_no_layer_and_a_layer_that_nobody_knows() {
    struct Strange;
    impl LayerRequest for Strange {
        fn declare(&self, ports: &mut PortDecl) {
            ports.output("out", OutputSpec::scalar());
        }
    }
    struct Odd;
    impl symbolt::sim::Module for Odd {
        type Ports = NodePorts;
        fn expand(self, scope: &mut Scope<'_>) -> NodePorts {
            scope.layer("strange", Strange)
        }
    }
    let mut graph = GraphBuilder::new();
    graph.add("odd", Odd);
    let pattern: PathPattern = "planner/**".parse().expect("a sound pattern");
    let plan = PopulationPlan::direct().with(pattern, Population::Direct);
    let all = graph.build(Timebase::default(), &plan, Seed::new(1)).expect_err("two faults").0;
    assert_eq!(all.len(), 2, "{all:?}");
    let text = BuildErrors(all).to_string();
    assert!(text.contains("`planner/**`: the pattern matches no layer"), "{text}");
    assert!(text.contains("`odd/strange`"), "{text}");
}

#[test]
fn everything_wrong_is_said_at_once() {
    let mut graph = GraphBuilder::new();
    graph.add("a", Constant::scalar(1.0));
    graph.add("a", Constant::vector(&[]));
    let (input, output) = pass(&mut graph, "loop", 2);
    graph.connect(&output, &input, Synapse::None);
    pass(&mut graph, "hungry", 2);
    let all = faults(graph);
    let has = |wanted: fn(&BuildError) -> bool| all.iter().any(wanted);
    assert!(has(|f| matches!(f, BuildError::DuplicatePath { .. })));
    assert!(has(|f| matches!(f, BuildError::Refused { .. })));
    assert!(has(|f| matches!(f, BuildError::AlgebraicLoop { .. })));
    assert!(has(|f| matches!(f, BuildError::Unfed { .. })));
    assert_eq!(all.len(), 4, "{all:?}");
}
