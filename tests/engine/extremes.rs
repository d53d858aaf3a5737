//! Every setting of neurons, synapses, processes, solvers and learning rules, with extreme values: it is refused with a
//! sentence, or what is built is finite and stays so.

use std::panic::{AssertUnwindSafe, catch_unwind};

use symbolt::neurons::{
    AdaptiveLif, AdaptiveLifRate, Bcm, BuiltLayer, Encoders, Izhikevich, L1, L2, LearningRule,
    LeastSquares, Lif, LifRate, NeuronModel, NoDecoders, Noisy, NonNegative, Oja, Pes,
    PoissonSpiking, RateOf, RectifiedLinear, RegularSpiking, Rls, Sigmoid, Solver,
    SpikingRectifiedLinear, Start, StochasticSpiking, Tanh, Target, Values, Voja,
};
use symbolt::prelude::*;
use symbolt::sim::{Add, NoiseDistribution, Real, SimError, WhiteNoise, WhiteSignal};

const EXTREMES: [f64; 20] = [
    0.0,
    -0.0,
    f64::NAN,
    f64::INFINITY,
    f64::NEG_INFINITY,
    f64::MAX,
    f64::MIN,
    1e300,
    1e150,
    1e38,
    -1e38,
    1e20,
    1e10,
    1.0,
    -1.0,
    1e-10,
    1e-38,
    1e-45,
    1e-310,
    5e-324,
];

/// What became of a graph.
#[derive(Debug, PartialEq)]
enum Outcome {
    Refused,
    Ran,
    /// It grew beyond single precision, and the run said where.
    Diverged,
}

/// Builds a graph and runs it for 20 ticks. Returns what became of it, and how many numbers of the ensemble `a` were read.
fn outcome(graph: &GraphBuilder, plan: &PopulationPlan) -> Result<(Outcome, usize), String> {
    let run = || {
        let built = match graph.build(Timebase::default(), plan, Seed::new(1)) {
            Ok(built) => built,
            Err(faults) => {
                let said = faults.to_string();
                let sentence =
                    ["expected", "use ", "cannot", "needs", "is not", "not usable", "fires"];
                return match sentence.iter().any(|word| said.contains(word)) {
                    true => Ok((Outcome::Refused, 0)),
                    false => Err(format!("no sentence: {said}")),
                };
            }
        };
        // What is built can be read back, and is finite.
        let mut read = 0;
        if *plan != PopulationPlan::direct() {
            let of = BuiltLayer::of(&built, "a").and_then(|layer| layer.ensemble(0));
            let of = of.map_err(|error| error.to_string())?;
            let decoders = of.decoders("x").map_err(|error| error.to_string())?;
            let (encoders, gains) = (of.encoders(), of.gains().iter().chain(of.biases()));
            let numbers = gains.chain(encoders.iter()).chain(decoders.iter());
            if let Some(wrong) = numbers.clone().find(|v| !v.is_finite()) {
                return Err(format!("{wrong} among gains, biases, encoders and decoders"));
            }
            read = numbers.count();
        }
        let mut sim =
            Simulator::new(built.into(), RunConfig::default()).map_err(|e| e.to_string())?;
        match sim.run_for(SimDuration::from_millis(20)) {
            Ok(_) => Ok((Outcome::Ran, read)),
            Err(SimError::NonFinite { .. }) => Ok((Outcome::Diverged, read)),
            // Weights that grow without bound.
            Err(SimError::Node { path, .. }) if path == "learned" => Ok((Outcome::Diverged, read)),
            Err(other) => Err(format!("the run: {other}")),
        }
    };
    let caught = catch_unwind(AssertUnwindSafe(run));
    caught.unwrap_or_else(|panic| {
        let said = panic.downcast_ref::<String>().cloned();
        Err(format!("a panic: {}", said.unwrap_or_else(|| "?".into())))
    })
}

/// How many cases were refused, ran and diverged, how many numbers of built ensembles were read, and the complaints.
#[derive(Default)]
struct Tally {
    counts: Counts,
    wrong: Vec<String>,
}

#[derive(Debug, Default, PartialEq)]
struct Counts {
    refused: usize,
    ran: usize,
    diverged: usize,
    read: usize,
}

impl Tally {
    fn add(&mut self, case: &str, may_diverge: bool, found: Result<(Outcome, usize), String>) {
        let counts = &mut self.counts;
        match found {
            Ok((Outcome::Diverged, _)) if !may_diverge => {
                self.wrong.push(format!("{case}: it is not finite"));
            }
            Ok((outcome, read)) => {
                counts.read += read;
                match outcome {
                    Outcome::Refused => counts.refused += 1,
                    Outcome::Ran => counts.ran += 1,
                    Outcome::Diverged => counts.diverged += 1,
                }
            }
            Err(error) => self.wrong.push(format!("{case}: {error}")),
        }
    }

    /// Checks that nothing is wrong, and that exactly so many cases were built, refused and looked at.
    #[track_caller]
    fn check(self, cases: usize, expected: Counts) {
        assert!(self.wrong.is_empty(), "{} wrong:\n{}", self.wrong.len(), self.wrong.join("\n"));
        let Counts { refused, ran, diverged, .. } = self.counts;
        assert_eq!(refused + ran + diverged, cases);
        assert_eq!(self.counts, expected);
    }
}

fn spikes() -> PopulationPlan {
    PopulationPlan::lif()
}

/// An ensemble that is given 0.5 in each of its dimensions.
fn given(ensemble: Ensemble, dims: usize) -> GraphBuilder {
    let mut graph = GraphBuilder::new();
    let half = graph.add("half", Constant::vector(&vec![0.5; dims]));
    let a = graph.add("a", ensemble);
    graph.route(&half >> &a);
    graph
}

fn plain() -> Ensemble {
    Ensemble::new(1).neurons(20)
}

#[test]
fn neuron_models_are_refused_or_finite() {
    type Make = fn(f64) -> Box<dyn Fn(Ensemble) -> Ensemble>;
    fn of<M: NeuronModel + Clone>(model: M) -> Box<dyn Fn(Ensemble) -> Ensemble> {
        Box::new(move |ensemble| ensemble.model(model.clone()))
    }
    let models: Vec<(&str, Make)> = vec![
        ("lif tau_rc", |v| of(Lif { tau_rc_s: v, ..Lif::default() })),
        ("lif tau_ref", |v| of(Lif { tau_ref_s: v, ..Lif::default() })),
        ("lif amplitude", |v| of(Lif { amplitude: v, ..Lif::default() })),
        ("lif min_voltage", |v| of(Lif { min_voltage: v, ..Lif::default() })),
        ("rate tau_rc", |v| of(LifRate(Lif { tau_rc_s: v, ..Lif::default() }))),
        ("rate tau_ref", |v| of(LifRate(Lif { tau_ref_s: v, ..Lif::default() }))),
        ("rate amplitude", |v| of(LifRate(Lif { amplitude: v, ..Lif::default() }))),
        ("adaptive tau_n", |v| of(AdaptiveLif { tau_n_s: v, ..AdaptiveLif::default() })),
        ("adaptive inc_n", |v| of(AdaptiveLif { inc_n: v, ..AdaptiveLif::default() })),
        ("adaptive amplitude", |v| {
            let lif = Lif { amplitude: v, ..Lif::default() };
            of(AdaptiveLif { lif, ..AdaptiveLif::default() })
        }),
        ("adaptive rate tau_n", |v| {
            of(AdaptiveLifRate(AdaptiveLif { tau_n_s: v, ..AdaptiveLif::default() }))
        }),
        ("adaptive rate inc_n", |v| {
            of(AdaptiveLifRate(AdaptiveLif { inc_n: v, ..AdaptiveLif::default() }))
        }),
        ("izhikevich a", |v| of(Izhikevich { recovery_rate: v, ..Izhikevich::default() })),
        ("izhikevich b", |v| of(Izhikevich { coupling: v, ..Izhikevich::default() })),
        ("izhikevich c", |v| of(Izhikevich { reset_voltage: v, ..Izhikevich::default() })),
        ("izhikevich d", |v| of(Izhikevich { reset_recovery: v, ..Izhikevich::default() })),
        ("sigmoid", |v| of(Sigmoid { tau_ref_s: v })),
        ("tanh", |v| of(Tanh { tau_ref_s: v })),
        ("regular", |v| of(RegularSpiking::new(Sigmoid { tau_ref_s: v }))),
        ("stochastic", |v| of(StochasticSpiking::new(Tanh { tau_ref_s: v }))),
        ("poisson", |v| of(PoissonSpiking::new(LifRate(Lif { amplitude: v, ..Lif::default() })))),
        ("rate of", |v| of(RateOf::new(Lif { tau_rc_s: v, ..Lif::default() }))),
    ];
    let mut tally = Tally::default();
    for (name, make) in &models {
        for value in EXTREMES {
            let slow = plain().identity("x").max_rates(Values::between(60.0, 120.0));
            let graph = given(make(value)(slow), 1);
            tally.add(&format!("{name} {value:e}"), false, outcome(&graph, &spikes()));
        }
    }
    tally.check(
        models.len() * EXTREMES.len(),
        Counts { refused: 333, ran: 107, diverged: 0, read: 8560 },
    );
}

#[test]
fn settings_of_ensembles_are_refused_or_finite() {
    type Set = fn(f64) -> Ensemble;
    let settings: Vec<(&str, Set)> = vec![
        ("radius", |v| plain().identity("x").radius(v as Real)),
        ("size", |v| plain().identity("x").size(v as Real)),
        ("intercepts", |v| plain().identity("x").intercepts(v)),
        ("intercepts up to", |v| plain().identity("x").intercepts(Values::between(-1.0, v))),
        ("max_rates", |v| plain().identity("x").max_rates(v)),
        ("max_rates of rectified", |v| {
            plain().identity("x").model(SpikingRectifiedLinear).max_rates(v)
        }),
        ("max_rates of rates", |v| plain().identity("x").model(RectifiedLinear).max_rates(v)),
        ("gains", |v| plain().identity("x").gains_and_biases([v; 20], [2.0; 20])),
        ("biases", |v| plain().identity("x").gains_and_biases([2.0; 20], [v; 20])),
        ("encoders", |v| plain().identity("x").encoders(Encoders::choice([[v]]))),
        ("encoders as they are", |v| {
            plain().identity("x").encoders(Encoders::choice([[v], [-1.0]]).unscaled())
        }),
        ("evaluation points", |v| plain().identity("x").evaluation_points([[v], [0.5]])),
        ("evaluation count", |v| plain().identity("x").evaluation_count(v.min(1e4) as usize)),
        ("start", |v| plain().identity("x").start("voltages", Start::At(v as Real))),
        ("start up to", |v| {
            plain().identity("x").start("voltages", Start::Between(0.0, v as Real))
        }),
        ("samples", |v| plain().decode_as("x", Target::samples([[0.0], [0.5]], [[v], [1.0]]))),
        ("points of samples", |v| {
            plain().decode_as("x", Target::samples([[v], [0.5]], [[0.0], [1.0]]))
        }),
        ("neurons", |v| Ensemble::new(1).neurons(v as usize).identity("x")),
        ("dimensions", |v| Ensemble::new(v.min(1e9) as usize).neurons(20).identity("x")),
        ("copies", |v| plain().copies(v.min(1e3) as usize).identity("x")),
    ];
    let mut tally = Tally::default();
    for (name, set) in &settings {
        for value in EXTREMES {
            let dims = match *name {
                "copies" => (value.min(1e3) as usize).max(1),
                _ => 1,
            };
            let graph = given(set(value), dims);
            tally.add(&format!("{name} {value:e}"), false, outcome(&graph, &spikes()));
        }
    }
    tally.check(
        settings.len() * EXTREMES.len(),
        Counts { refused: 225, ran: 175, diverged: 0, read: 13_924 },
    );
}

#[test]
fn settings_of_a_plan_are_refused_or_finite() {
    type Set = fn(f64, &mut Tuning);
    let settings: Vec<(&str, Set)> = vec![
        ("max_rates[0]", |v, t| t.max_rates[0] = v),
        ("max_rates[1]", |v, t| t.max_rates[1] = v),
        ("intercepts[0]", |v, t| t.intercepts[0] = v),
        ("intercepts[1]", |v, t| t.intercepts[1] = v),
        ("per_function", |v, t| t.per_function = v as usize),
        ("distinct_ensembles", |v, t| t.distinct_ensembles = v as usize),
        ("item_spread", |v, t| t.item_spread = v),
        ("regularisation", |v, t| t.regularisation = v),
        ("scale", |v, t| t.scale = v),
    ];
    let mut tally = Tally::default();
    for (name, set) in &settings {
        for value in EXTREMES {
            let mut tuning = Tuning::default();
            set(value, &mut tuning);
            let plan = PopulationPlan::all(Population::Lif(LifSpec::tuned(tuning)));
            let graph = given(Ensemble::new(1).identity("x"), 1);
            tally.add(&format!("{name} {value:e}"), false, outcome(&graph, &plan));
        }
    }
    tally.check(
        settings.len() * EXTREMES.len(),
        Counts { refused: 127, ran: 53, diverged: 0, read: 20804 },
    );
}

#[test]
fn solvers_are_refused_or_finite() {
    type Set = fn(f64) -> Ensemble;
    fn with(solver: impl Solver) -> Ensemble {
        plain().identity("x").solver(solver)
    }
    let settings: Vec<(&str, Set)> = vec![
        ("l2", |v| with(L2 { regularisation: v })),
        ("least squares", |v| with(LeastSquares { cutoff: v })),
        ("added", |v| with(Noisy::added(v))),
        ("multiplied", |v| with(Noisy::multiplied(v))),
        ("l1", |v| with(L1 { l1: v, ..L1::default() })),
        ("l1 squares", |v| with(L1 { l2: v, ..L1::default() })),
        ("l1 sweeps", |v| with(L1 { sweeps: v as usize, ..L1::default() })),
        ("non-negative", |v| with(NonNegative { regularisation: v })),
        ("none", |_| with(NoDecoders)),
        // Solvers that must cope with targets as great as numbers go.
        ("great targets", |v| {
            let target = Target::samples([[0.0], [0.5]], [[v], [1.0]]);
            plain().decode_as("x", target.solver(L1::default()))
        }),
        ("great targets, not negative", |v| {
            let target = Target::samples([[0.0], [0.5]], [[v], [1.0]]);
            plain().decode_as("x", target.solver(NonNegative::default()))
        }),
    ];
    let mut tally = Tally::default();
    for (name, set) in &settings {
        for value in EXTREMES {
            let graph = given(set(value), 1);
            // What is decoded from spikes is greater than its targets for a moment.
            let great = name.starts_with("great");
            tally.add(&format!("{name} {value:e}"), great, outcome(&graph, &spikes()));
        }
    }
    tally.check(
        settings.len() * EXTREMES.len(),
        Counts { refused: 73, ran: 146, diverged: 1, read: 11760 },
    );
}

#[test]
fn learning_rules_are_refused_or_finite() {
    type Set = fn(f64, Learned) -> Learned;
    fn with(learned: Learned, rule: impl LearningRule) -> Learned {
        learned.rule(rule)
    }
    let settings: Vec<(&str, Set)> = vec![
        ("pes", |v, l| with(l, Pes::new(v).toward_target())),
        ("rls", |v, l| with(l, Rls::new(v).toward_target())),
        ("voja", |v, l| with(l, Voja::new(v))),
        ("voja radius", |v, l| with(l, Voja::new(0.01).radius(v))),
        ("oja", |v, l| with(l, Oja::new(v))),
        ("oja beta", |v, l| with(l, Oja::default().beta(v))),
        ("bcm", |v, l| with(l, Bcm::new(v))),
        ("weights", |v, l| l.weights(Weights::rows([[v, 0.0], [0.0, v]]))),
        ("drawn weights", |v, l| l.weights(Weights::uniform(-1.0, v, Seed::new(1)))),
    ];
    let mut tally = Tally::default();
    for (name, set) in &settings {
        for value in EXTREMES {
            let mut graph = GraphBuilder::new();
            let pre = graph.add("pre", Constant::vector(&[100.0, 50.0]));
            let post = graph.add("post", Constant::vector(&[80.0, 20.0]));
            let learned = set(value, Learned::new(&pre, 2).post(&post));
            let learned = graph.add("learned", learned);
            if ["pes", "rls"].contains(name) {
                let target = graph.add("target", Constant::vector(&[1.0, -1.0]));
                graph.route(&target >> &learned.target());
            }
            // A rate that is far too great makes weights grow without bound, which the run reports.
            let found = outcome(&graph, &PopulationPlan::direct());
            tally.add(&format!("{name} {value:e}"), true, found);
        }
    }
    tally.check(
        settings.len() * EXTREMES.len(),
        Counts { refused: 54, ran: 86, diverged: 40, read: 0 },
    );
}

#[test]
fn synapses_and_processes_are_refused_or_finite() {
    const TIMES: [u64; 8] =
        [0, 1, 999, 1_000, 1_000_000, 1_000_000_000_000, u64::MAX / 2, u64::MAX];
    type Of = fn(SimDuration) -> Synapse;
    let synapses: Vec<(&str, Of)> = vec![
        ("low-pass", Synapse::lowpass),
        ("alpha", |tau| Synapse::Alpha { tau }),
        ("rise", |rise| Synapse::DoubleExponential { rise, decay: SimDuration::from_millis(5) }),
        ("decay", |decay| Synapse::DoubleExponential { rise: SimDuration::from_millis(5), decay }),
        ("triangle", |length| Synapse::Triangle { length }),
        ("delay", |length| Synapse::Delay { length }),
    ];
    let filtered = |synapse| {
        let mut graph = GraphBuilder::new();
        let one = graph.add("one", Constant::scalar(1.0));
        let sum = graph.add("sum", Add::scalar());
        graph.connect(&one, &sum.input, synapse);
        graph.probe(&one, ProbeSpec::default().filtered(synapse));
        graph
    };
    let mut tally = Tally::default();
    for (name, of) in &synapses {
        for micros in TIMES {
            let graph = filtered(of(SimDuration::from_micros(micros)));
            let found = outcome(&graph, &PopulationPlan::direct());
            tally.add(&format!("{name} {micros} us"), false, found);
        }
    }
    type Linear = fn(f64) -> Synapse;
    let linear: [(&str, Linear); 4] = [
        ("numerator", |v| Synapse::linear(&[v], &[0.1, 1.0])),
        ("leading", |v| Synapse::linear(&[1.0], &[v, 1.0])),
        ("last", |v| Synapse::linear(&[1.0], &[0.1, v])),
        ("with a zero", |v| Synapse::linear(&[v, 1.0], &[0.1, 0.2, 1.0])),
    ];
    for (name, of) in linear {
        for value in EXTREMES {
            let found = outcome(&filtered(of(value)), &PopulationPlan::direct());
            // An unstable filter grows, which the run reports.
            tally.add(&format!("linear {name} {value:e}"), true, found);
        }
    }
    type Adds = fn(f64, &mut GraphBuilder);
    let processes: Vec<(&str, Adds)> = vec![
        ("mean", |v, graph| {
            let distribution = NoiseDistribution::Gaussian { mean: v as Real, sd: 1.0 };
            graph.add("it", WhiteNoise::scalar().distribution(distribution));
        }),
        ("sd", |v, graph| {
            let distribution = NoiseDistribution::Gaussian { mean: 0.0, sd: v as Real };
            graph.add("it", WhiteNoise::scalar().distribution(distribution).unscaled());
        }),
        ("uniform", |v, graph| {
            let distribution = NoiseDistribution::Uniform { low: -1.0, high: v as Real };
            graph.add("it", WhiteNoise::scalar().distribution(distribution).integrated());
        }),
        ("rms", |v, graph| {
            let signal = WhiteSignal::scalar(SimDuration::from_millis(100), 50.0);
            graph.add("it", signal.rms(v as Real));
        }),
        ("start of a signal", |v, graph| {
            let signal = WhiteSignal::scalar(SimDuration::from_millis(100), 50.0);
            graph.add("it", signal.starting_near(v as Real));
        }),
        ("limit", |v, graph| {
            graph.add("it", WhiteSignal::scalar(SimDuration::from_millis(100), v));
        }),
        ("noise", |v, graph| {
            let one = graph.add("one", Constant::scalar(1.0));
            let it = graph.add("it", symbolt::sim::Noise::scalar(v as Real).white());
            graph.connect(&one, &it.input, Synapse::None);
        }),
        ("value", |v, graph| {
            graph.add("it", Stimulus::scalar(v as Real).from(SimDuration::from_millis(5), &[1.0]));
        }),
    ];
    for (name, add) in &processes {
        for value in EXTREMES {
            let mut graph = GraphBuilder::new();
            add(value, &mut graph);
            // Noise as great as numbers go leaves their range, which the run reports.
            let found = outcome(&graph, &PopulationPlan::direct());
            tally.add(&format!("process {name} {value:e}"), true, found);
        }
    }
    let cases = synapses.len() * TIMES.len() + (4 + processes.len()) * EXTREMES.len();
    tally.check(cases, Counts { refused: 119, ran: 162, diverged: 7, read: 0 });
}
