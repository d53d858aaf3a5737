//! One case for each fault of a graph description, with its message.

#![allow(clippy::unwrap_used, clippy::expect_used)]

use symbolt::neurons::{Ensemble, PathPattern, Population, PopulationPlan, SelectRule};
use symbolt::sim::{
    Add, BuildError, BuildErrors, Constant, EmitIo, Fingerprint, Graph, GraphBuilder, In,
    InputSpec, Kind, LayerRequest, Module, Node, NodePorts, Noise, Out, OutputSpec, Pointer,
    PointerRef, PortDecl, ProbeSpec, Scalar, Scope, Seed, SimDuration, StepCx, Synapse, Timebase,
    Vector, VocabTag, WorldLink,
};
use symbolt::spa::{Bind, CleanupMemory, Linear, Superpose, Unbind, Vocabulary, VocabularyBuilder};

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

/// Returns the only fault and its message.
fn only(graph: GraphBuilder) -> (BuildError, String) {
    let mut all = faults(graph);
    assert_eq!(all.len(), 1, "{all:?}");
    let fault = all.remove(0);
    let text = fault.to_string();
    (fault, text)
}

/// A node with one input and one output.
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
    let line = line!();
    graph.add("a", Constant::scalar(1.0));
    graph.add("a", Constant::scalar(2.0));
    let (fault, text) = only(graph);
    let [first, second] = [1, 2].map(|after| format!("tests/engine/wiring.rs:{}", line + after));
    let expected =
        format!("`a` is added twice, at {first} and at {second}; give one of them another name");
    assert_eq!(text, expected);
    assert_eq!(fault, BuildError::DuplicatePath { path: "a".into(), first, second });
}

/// A module whose nodes have the given names.
struct Group(&'static [&'static str]);
impl Module for Group {
    type Ports = ();
    fn expand(self, scope: &mut Scope<'_>) {
        for name in self.0 {
            scope.add(name, Constant::scalar(1.0));
        }
    }
}

#[test]
fn two_modules_of_one_name_are_one_fault_even_if_their_nodes_differ() {
    let duplicates = |graph: GraphBuilder| -> Vec<String> {
        let path = |fault: BuildError| match fault {
            BuildError::DuplicatePath { path, .. } => path,
            other => panic!("{other}"),
        };
        faults(graph).into_iter().map(path).collect()
    };
    // The nodes are `m/a` and `m/b`, so no two nodes have the same path.
    let mut graph = GraphBuilder::new();
    graph.add("m", Group(&["a"]));
    graph.add("m", Group(&["b"]));
    assert_eq!(duplicates(graph), ["m"]);
    // Equal modules are reported once, without their inner nodes.
    let mut graph = GraphBuilder::new();
    graph.add("m", Group(&["a", "b"]));
    graph.add("m", Group(&["a", "b"]));
    assert_eq!(duplicates(graph), ["m"]);
    // A module and a node, each way round.
    let mut graph = GraphBuilder::new();
    graph.add("m", Group(&["a"]));
    graph.node("m", WorldLink::new().sense("s", OutputSpec::scalar()));
    graph.node("n", WorldLink::new().sense("s", OutputSpec::scalar()));
    graph.add("n", Group(&["a"]));
    assert_eq!(duplicates(graph), ["m", "n"]);
    // Inside a module the full path is named.
    struct Outer;
    impl Module for Outer {
        type Ports = ();
        fn expand(self, scope: &mut Scope<'_>) {
            scope.add("m", Group(&["a"]));
            scope.add("m", Group(&["b"]));
        }
    }
    let mut graph = GraphBuilder::new();
    graph.add("outer", Outer);
    graph.add("m", Group(&["a"]));
    assert_eq!(duplicates(graph), ["outer/m"]);
    // Two nodes at the path of one module.
    struct Twice;
    impl Module for Twice {
        type Ports = ();
        fn expand(self, scope: &mut Scope<'_>) {
            scope.leaf(WorldLink::new().sense("s", OutputSpec::scalar()));
            scope.leaf(WorldLink::new().sense("s", OutputSpec::scalar()));
        }
    }
    let mut graph = GraphBuilder::new();
    graph.add("twice", Twice);
    assert_eq!(duplicates(graph), ["twice"]);
}

#[test]
fn names_of_ports_that_could_not_be_found_are_refused() {
    struct Named(&'static str);
    impl Node for Named {
        fn declare(&self, ports: &mut PortDecl) {
            ports.output(self.0, OutputSpec::scalar());
        }
        fn fingerprint(&self, _hash: &mut Fingerprint) {}
    }
    struct Exposes;
    impl Module for Exposes {
        type Ports = ();
        fn expand(self, scope: &mut Scope<'_>) {
            let one = scope.add("one", Constant::scalar(1.0));
            scope.output("a.b", one);
        }
    }
    let bad = |graph: GraphBuilder| match only(graph) {
        (BuildError::BadPortName { node, port }, _) => (node, port),
        (other, _) => panic!("{other}"),
    };
    for name in ["x.y", "x/y", ""] {
        let mut graph = GraphBuilder::new();
        graph.node("node", Named(name));
        assert_eq!(bad(graph), ("node".into(), name.into()));
    }
    let mut graph = GraphBuilder::new();
    graph.add("module", Exposes);
    assert_eq!(bad(graph), ("module".into(), "a.b".into()));
    let mut graph = GraphBuilder::new();
    let point = graph.add("point", Ensemble::new(1).identity("x.y"));
    let zero = graph.add("zero", Constant::vector(&[0.0]));
    graph.connect(&zero, &point.input, Synapse::None);
    let faults = faults(graph);
    let refused = |fault: &BuildError| matches!(fault, BuildError::BadPortName { .. });
    assert!(!faults.is_empty() && faults.iter().all(refused), "{faults:?}");
}

#[test]
fn an_input_without_a_connection_is_named_as_in_the_port_struct() {
    let parts = parts(1);
    let nut = parts.get("NUT").expect("there");
    let mut graph = GraphBuilder::new();
    graph.add("bind", Bind::new(&parts));
    graph.add("unbind", Unbind::new(&parts));
    graph.add("nut", Constant::pointer(parts.space(), &nut));
    let texts: Vec<String> = faults(graph).iter().map(ToString::to_string).collect();
    let expected = ["bind.a", "bind.b", "unbind.bound", "unbind.role"].map(|port| {
        format!(
            "the input `{port}` is not connected; outputs that fit: `bind.output`, `nut.out`, `unbind.output`"
        )
    });
    assert_eq!(texts, expected);
}

#[test]
fn three_thousand_unconnected_modules_are_refused_at_once_in_ten_lines() {
    let mut graph = GraphBuilder::new();
    for number in 0..3_000 {
        graph.add(&format!("module_{number}"), Add::vector(2));
    }
    let began = std::time::Instant::now();
    let time = Timebase::default();
    let errors = graph.build(time, &PopulationPlan::direct(), Seed::new(1)).expect_err("no inputs");
    assert!(began.elapsed().as_secs_f64() < 5.0, "{:?}", began.elapsed());
    assert_eq!(errors.0.len(), 3_000);
    for message in [errors.to_string(), format!("{errors:?}")] {
        assert!(
            message.starts_with("the graph has 3000 faults:\n  - the input `module_0."),
            "{message}"
        );
        assert!(message.lines().count() <= 10 && message.len() <= 1_000, "{message}");
        assert!(message.ends_with(" more"), "{message}");
    }
}

#[test]
fn every_module_names_its_inputs_as_in_its_port_struct() {
    let parts = parts(1);
    let winner = SelectRule::WinnerTakeAll { level: 0.3 };
    let mut graph = GraphBuilder::new();
    graph.add("cleanup", CleanupMemory::new(&parts, ["NUT"], winner).expect("there"));
    graph.add("fixed", Linear::unbind(&parts, "NUT").expect("there"));
    graph.add("noise", Noise::scalar(0.1));
    graph.add("superpose", Superpose::new(&parts, &[1.0, 0.5]));
    let unfed: Vec<String> = faults(graph)
        .into_iter()
        .map(|fault| match fault {
            BuildError::Unfed { port, .. } => port,
            other => panic!("{other}"),
        })
        .collect();
    assert_eq!(
        unfed,
        [
            "cleanup.input",
            "fixed.input",
            "noise.input",
            "superpose.inputs[0]",
            "superpose.inputs[1]"
        ]
    );
}

#[test]
fn the_name_of_the_outermost_module_counts_and_every_modules_name_finds_the_output() {
    struct Outer(Vocabulary<Parts>);
    impl Module for Outer {
        type Ports = In<Pointer<Parts>>;
        fn expand(self, scope: &mut Scope<'_>) -> Self::Ports {
            let bind = scope.add("bind", Bind::new(&self.0));
            let value = self.0.get("NUT").expect("there");
            let nut = scope.add("nut", Constant::pointer(self.0.space(), &value));
            scope.connect(&nut, &bind.b, Synapse::None);
            scope.output("bound", bind.output);
            scope.input("given", bind.a)
        }
    }
    let mut graph = GraphBuilder::new();
    let given = graph.add("outer", Outer(parts(1)));
    let (fault, text) = only(graph);
    assert!(matches!(&fault, BuildError::Unfed { port, .. } if port == "outer.given"), "{text}");
    // The same in a handle of another builder.
    let mut graph = GraphBuilder::new();
    let own = parts(1);
    let nut = Constant::pointer(own.space(), &own.get("NUT").expect("there"));
    let nut = graph.add("nut", nut);
    graph.connect(&nut, &given, Synapse::None);
    let (_, text) = only(graph);
    assert!(text.contains("the input `outer.given` belongs to another"), "{text}");

    let mut graph = GraphBuilder::new();
    let nut = graph.add("nut", Constant::pointer(own.space(), &own.get("NUT").expect("there")));
    let given = graph.add("outer", Outer(own));
    graph.connect(&nut, &given, Synapse::None);
    let graph = build(graph).expect("sound");
    for name in ["outer.bound", "outer/bind.output", "outer/bind/back.out", "nut.out"] {
        assert!(graph.output(name).is_ok(), "{name}");
    }
    for name in ["outer/bind.bound", "outer.output", "bind.output"] {
        assert!(graph.output(name).is_err(), "{name}");
    }
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
    let expected =
        "the node `node` has no input `inn` of kind vector; its inputs are: `in: vector`";
    assert_eq!(text, expected);
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
    let (input, _) = pass(&mut graph, "node", 1);
    graph.connect(&foreign, &input, Synapse::None);
    // The input is not reported as unconnected.
    let (fault, text) = only(graph);
    assert!(matches!(fault, BuildError::ForeignHandle { direction: "output", .. }));
    assert!(text.starts_with("the output `one.out` belongs to another `GraphBuilder`"), "{text}");
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
    for part in ["`three.out` has width 3", "`node.in` takes width 2", "`sum.input`", "`two.out`"] {
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
    for part in ["seed 1", "seed 2", "`own.out`", "a node between", "`bind.a` takes pointers"] {
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
    assert!(text.contains("`bare/layer.out`") && text.contains("`sum.input`"), "{text}");
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

/// Checks that the node `map` reports its parameters with a message that contains `expected`, and that nothing is said of
/// its input, which is not connected.
fn refused(module: Linear<impl Kind, impl Kind>, expected: &str) {
    let mut graph = GraphBuilder::new();
    graph.add("map", module);
    let all = faults(graph);
    let [fault @ BuildError::Refused { node, .. }] = &all[..] else { panic!("{all:?}") };
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
    // Both nodes still have one number per pointer on their ports, so no other fault is reported.
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
