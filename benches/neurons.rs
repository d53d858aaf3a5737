//! Spiking populations: a step of a neuron, banks with dense and with event-driven decoding, each module, and the build
//! and run of the standard networks over 300 simulated milliseconds. `graph/lif_bank` measures a bare loop over
//! voltages.

#![allow(clippy::unwrap_used, clippy::expect_used)]

use std::hint::black_box;
use std::sync::Arc;
use std::time::Duration;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use symbolt::neurons::{
    AdaptiveLif, AdaptiveLifRate, DrawnEncoders, Izhikevich, Layers, Lif, LifRate, LifSpec, Map,
    PoissonSpiking, Population, PopulationPlan, Product, RateOf, RectifiedLinear, RegularSpiking,
    Represent, SelectRule, Sigmoid, SolvedModel, SpikingRectifiedLinear, StochasticSpiking, Tanh,
    Tuning,
};
use symbolt::sim::Ports;
use symbolt::sim::{
    Constant, GraphBuilder, In, InputSpec, Kind, Module, OutputSpec, Pointer, RunConfig, Scope,
    Seed, SimDuration, Simulator, Synapse, Timebase, Vector, VocabTag,
};
use symbolt::spa::{
    AssociativeMemory, BasalGanglia, Bind, CleanupMemory, Gate, GoalBuffer, State, Unbind,
    Vocabulary, VocabularyBuilder,
};
use symbolt::study::standard::{Model, Standard};

struct Things;
impl VocabTag for Things {
    const NAME: &'static str = "things";
}

const DIM: usize = 256;
const TICKS: u64 = 50;

/// A module of a single layer.
struct Alone<F>(F);

impl<K: Kind, F: FnOnce(&mut Scope<'_>) -> Ports<K>> Module for Alone<F> {
    type Ports = Ports<K>;

    fn expand(self, scope: &mut Scope<'_>) -> Ports<K> {
        (self.0)(scope)
    }
}

type Plan = PopulationPlan;

fn lif() -> Plan {
    Plan::all(Population::Lif(LifSpec::default()))
}

fn rate() -> Plan {
    Plan::all(Population::Rate(LifSpec::default()))
}

/// Measures ticks of a graph. Elements are neurons times ticks.
fn ticks(c: &mut Criterion, name: &str, size: usize, graph: GraphBuilder, plan: &Plan) {
    let graph = graph.build(Timebase::default(), plan, Seed::new(1)).expect("builds");
    let neurons = SolvedModel::of(&graph).neurons() as u64;
    let mut sim = Simulator::new(Arc::new(graph), RunConfig::default()).expect("starts");
    sim.run_for(SimDuration::from_millis(100)).expect("runs");
    let mut group = c.benchmark_group("neurons");
    group.sample_size(20).measurement_time(Duration::from_secs(2));
    group.throughput(Throughput::Elements(neurons * TICKS));
    group.bench_function(BenchmarkId::new(name, size), |b| {
        b.iter(|| sim.run_for(SimDuration::from_millis(TICKS)).expect("runs"));
    });
}

/// Returns a graph with a layer whose input is a constant vector.
fn vector_layer(layer: impl FnOnce(&mut Scope<'_>) -> Ports<Vector>, width: usize) -> GraphBuilder {
    let mut graph = GraphBuilder::new();
    let values: Vec<f32> = (0..width).map(|i| (i as f32).sin()).collect();
    let given = graph.add("given", Constant::vector(&values));
    let layer = graph.add("layer", Alone(layer));
    graph.connect(&given, &layer.input, Synapse::None);
    graph
}

fn layers(c: &mut Criterion) {
    let lif_model = Lif::default();
    let mut group = c.benchmark_group("neurons");
    group.throughput(Throughput::Elements(1_000));
    group.bench_function("lif_step_exact/1000", |b| {
        let (mut v, mut r) = (vec![0.0; 1_000], vec![0.0; 1_000]);
        b.iter(|| {
            let spikes = v.iter_mut().zip(&mut r);
            spikes
                .filter_map(|(v, r)| {
                    lif_model.step_exactly(0.001, black_box(3.0), v, r).then_some(())
                })
                .count()
        });
    });
    group.finish();
    // Each ensemble represents one number: encoding costs little and decoding is dense.
    let width = 500;
    let scalars = || vector_layer(|s| s.map("map", Map::each(500, |x| x)), width);
    ticks(c, "decode_dense_one_dimension", width * 100, scalars(), &lif());
    ticks(c, "decode_dense_rates", width * 100, scalars(), &rate());
    // Each ensemble represents sixteen dimensions: encoding multiplies by a matrix or transforms, and decoding adds only
    // the neurons that fire.
    for (name, encoders) in [
        ("encode_16_decode_by_events", DrawnEncoders::Sphere),
        ("encode_16_by_transforms_decode_by_events", DrawnEncoders::Hadamard),
    ] {
        let things = vocabulary();
        let (input, output) =
            (InputSpec::pointer(things.space()), OutputSpec::pointer(things.space()));
        let mut graph = GraphBuilder::new();
        let layer = graph.add(
            "layer",
            Alone(|scope: &mut Scope<'_>| -> Ports<Pointer<Things>> {
                scope.represent("represent", Represent::new(input, output, 1.0))
            }),
        );
        give(&mut graph, &things, "A", &layer.input);
        let plan = Plan::all(
            Population::Lif(LifSpec::default()).tuned(|usual| Tuning { encoders, ..usual }),
        );
        ticks(c, name, DIM * 50, graph, &plan);
    }
    // Products without the transforms of a binding.
    let mut graph = GraphBuilder::new();
    let values: Vec<f32> = (0..width).map(|i| (i as f32).cos()).collect();
    let given = graph.add("given", Constant::vector(&values));
    struct Products(usize);
    impl Module for Products {
        type Ports = symbolt::neurons::BilinearPorts<symbolt::sim::Vector>;
        fn expand(self, scope: &mut Scope<'_>) -> Self::Ports {
            scope.product("products", Product::new(self.0))
        }
    }
    let products = graph.add("products", Products(width));
    graph.connect(&given, &products.a, Synapse::None);
    graph.connect(&given, &products.b, Synapse::None);
    ticks(c, "products", width * 200, graph, &lif());
}

/// The same layer of 50,000 neurons in every model.
fn models(c: &mut Criterion) {
    let of = |model: Population| Plan::all(model);
    let poisson = PoissonSpiking::new(LifRate::default());
    let stochastic = StochasticSpiking::new(LifRate::default());
    let slow = Tuning { max_rates: [60.0, 120.0], ..Tuning::default() };
    let plans = [
        ("model_lif", lif()),
        ("model_lif_rate", rate()),
        ("model_adaptive_lif", of(Population::neurons(AdaptiveLif::default()))),
        ("model_adaptive_lif_rate", of(Population::neurons(AdaptiveLifRate::default()))),
        ("model_izhikevich", of(Population::neurons(Izhikevich::default()).tuned(|_| slow))),
        ("model_rectified_linear", of(Population::neurons(RectifiedLinear))),
        ("model_spiking_rectified", of(Population::neurons(SpikingRectifiedLinear))),
        ("model_sigmoid", of(Population::neurons(Sigmoid::default()))),
        ("model_tanh", of(Population::neurons(Tanh::default()))),
        ("model_regular", of(Population::neurons(RegularSpiking::new(LifRate::default())))),
        ("model_stochastic", of(Population::neurons(stochastic))),
        ("model_poisson", of(Population::neurons(poisson))),
        ("model_rate_of_lif", of(Population::neurons(RateOf::new(Lif::default())))),
    ];
    for (name, plan) in plans {
        let graph = vector_layer(|s| s.map("map", Map::each(500, |x| x)), 500);
        ticks(c, name, 50_000, graph, &plan);
    }
}

fn vocabulary() -> Vocabulary<Things> {
    VocabularyBuilder::new(DIM, Seed::new(1)).pointers(["A", "B", "C"]).build().expect("room")
}

fn give(
    graph: &mut GraphBuilder,
    things: &Vocabulary<Things>,
    name: &str,
    to: &In<Pointer<Things>>,
) {
    let value = things.get(name).expect("there");
    let given = graph.add(&format!("given_{name}"), Constant::pointer(things.space(), &value));
    graph.connect(&given, to, Synapse::None);
}

fn modules(c: &mut Criterion) {
    let things = vocabulary();
    let one = |describe: &dyn Fn(&mut GraphBuilder)| {
        let mut graph = GraphBuilder::new();
        describe(&mut graph);
        graph
    };
    let winner = SelectRule::WinnerTakeAll { level: 0.5 };
    let state = one(&|graph| {
        let module = graph.add("state", State::new(&things).recurrent(symbolt::spa::RECURRENT));
        give(graph, &things, "A", &module.input);
    });
    let buffer = one(&|graph| {
        let module = graph.add("goal", GoalBuffer::new(&things));
        let open = graph.add("open", Constant::scalar(1.0));
        graph.connect(&open, &module.open, Synapse::None);
        give(graph, &things, "A", &module.input);
    });
    let gate = one(&|graph| {
        let module = graph.add("gate", Gate::new(&things));
        let open = graph.add("open", Constant::scalar(1.0));
        graph.connect(&open, &module.open, Synapse::None);
        give(graph, &things, "A", &module.input);
    });
    let bind = one(&|graph| {
        let module = graph.add("bind", Bind::new(&things));
        give(graph, &things, "A", &module.a);
        give(graph, &things, "B", &module.b);
    });
    let unbind = one(&|graph| {
        let module = graph.add("unbind", Unbind::new(&things));
        give(graph, &things, "A", &module.bound);
        give(graph, &things, "B", &module.role);
    });
    let cleanup = one(&|graph| {
        let memory = CleanupMemory::new(&things, ["A", "B", "C"], winner).expect("sound");
        let module = graph.add("cleanup", memory);
        give(graph, &things, "A", &module.input);
    });
    let associative = one(&|graph| {
        let pairs = [("A", "B"), ("B", "C"), ("C", "A")];
        let memory = AssociativeMemory::new(&things, &things, pairs, winner).expect("sound");
        let module = graph.add("associative", memory);
        give(graph, &things, "A", &module.input);
    });
    let selection = one(&|graph| {
        let module = graph.add("selection", BasalGanglia::new(10));
        let utilities: Vec<f32> = (0..10).map(|i| if i == 3 { 0.8 } else { 0.3 }).collect();
        let given = graph.add("given", Constant::vector(&utilities));
        graph.connect(&given, &module.utilities, Synapse::None);
    });
    for (name, graph) in [
        ("module_state", state),
        ("module_goal_buffer", buffer),
        ("module_gate", gate),
        ("module_bind", bind),
        ("module_unbind", unbind),
        ("module_cleanup", cleanup),
        ("module_associative", associative),
        ("module_basal_ganglia", selection),
    ] {
        ticks(c, name, DIM, graph, &lif());
    }
}

fn standard(c: &mut Criterion) {
    let mut group = c.benchmark_group("neurons");
    group.sample_size(10).measurement_time(Duration::from_secs(5));
    for (name, model) in Model::ALL {
        let spec = Standard { sim_ms: 300, ..Standard::default() };
        let built = spec.build(model).expect("builds");
        let neurons = built.solved().neurons() as u64;
        // Elements are neurons times ticks.
        group.throughput(Throughput::Elements(300 * neurons));
        group.bench_function(BenchmarkId::new("run_300_ms", name), |b| {
            b.iter(|| black_box(built.run()).expect("runs"));
        });
        group.throughput(Throughput::Elements(neurons));
        group.bench_function(BenchmarkId::new("build", name), |b| {
            b.iter(|| black_box(spec.build(model)).expect("builds"));
        });
    }
    group.finish();
}

criterion_group!(benches, layers, models, modules, standard);
criterion_main!(benches);
