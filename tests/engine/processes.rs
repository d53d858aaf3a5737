//! Random processes and stimuli: statistics, spectra, interpolation, bits and faults.
//!
//! Runs are seeded, so a test passes always or never. The bounds on statistics are 5 standard errors, if not said
//! otherwise: another seed would fail one of them in about 2 million.

use std::path::Path;
use std::sync::Arc;

use ndarray::Ix1;
use symbolt::files::npz::NpzReader;
use symbolt::prelude::*;
use symbolt::sim::{
    EmitIo, Fingerprint, Graph, Interpolation, Kind, Node, NoiseDistribution, OutputSpec, PortDecl,
    ProbeId, Process, StepCx, WhiteNoise, WhiteSignal,
};

use crate::things;

fn ms(millis: u64) -> SimDuration {
    SimDuration::from_millis(millis)
}

fn us(micros: u64) -> Timebase {
    Timebase::new(SimDuration::from_micros(micros)).unwrap()
}

fn built<K: Kind, M: Module<Ports = Out<K>>>(
    time: Timebase,
    build: u64,
    module: M,
) -> (Arc<Graph>, ProbeId<K>) {
    let mut graph = GraphBuilder::new();
    let out = graph.add("process", module);
    let probe = graph.probe(&out, ProbeSpec::default());
    let graph = graph.build(time, &PopulationPlan::direct(), Seed::new(build));
    (Arc::new(graph.unwrap_or_else(|wrong| panic!("{wrong}"))), probe)
}

/// Runs a process and returns its rows, flat.
fn ran<M: Module<Ports = Out<Vector>>>(
    time: Timebase,
    ticks: u64,
    run: RunConfig,
    m: M,
) -> Vec<f64> {
    let (graph, probe) = built(time, 1, m);
    let mut sim = Simulator::new(graph, run).unwrap();
    sim.run_for(SimDuration::from_micros(time.tick().as_micros() * ticks)).unwrap();
    let values: Vec<f64> =
        sim.samples(&probe).iter().flat_map(|(_, v)| v.to_vec()).map(f64::from).collect();
    assert_eq!(values.len() % ticks as usize, 0);
    values
}

fn mean_and_variance(values: &[f64]) -> (f64, f64) {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    (mean, values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / n)
}

fn seeded(seed: u64) -> RunConfig {
    RunConfig::seeded(Seed::new(seed))
}

#[test]
fn white_noise_has_the_moments_that_it_should() {
    let n = 40_000.0f64;
    for (tick_us, unit) in [(1000, 1000.0), (250, 4000.0)] {
        let values = ran(us(tick_us), 4000, seeded(3), WhiteNoise::vector(10));
        let (mean, variance) = mean_and_variance(&values);
        assert_eq!(values.len(), 40_000);
        assert!(mean.abs() < 5.0 * (unit / n).sqrt(), "{mean}");
        assert!((variance / unit - 1.0).abs() < 5.0 * (2.0 / n).sqrt(), "{variance}");
        // Neither neighbours in time nor components are alike.
        let alike =
            |by: usize| values.windows(by + 1).map(|w| w[0] * w[by]).sum::<f64>() / n / variance;
        assert!(alike(1).abs() < 5.0 / n.sqrt() && alike(10).abs() < 5.0 / n.sqrt());
    }
    let spread = NoiseDistribution::Gaussian { mean: 0.5, sd: 2.0 };
    let values =
        ran(us(1000), 4000, seeded(3), WhiteNoise::vector(10).distribution(spread).unscaled());
    let (mean, variance) = mean_and_variance(&values);
    assert!(
        (mean - 0.5).abs() < 5.0 * 2.0 / n.sqrt()
            && (variance / 4.0 - 1.0).abs() < 5.0 * (2.0 / n).sqrt()
    );
    let even = NoiseDistribution::Uniform { low: -1.0, high: 3.0 };
    let values =
        ran(us(1000), 4000, seeded(3), WhiteNoise::vector(10).distribution(even).unscaled());
    let (mean, variance) = mean_and_variance(&values);
    assert!((mean - 1.0).abs() < 5.0 * (4.0 / 3.0 / n).sqrt(), "{mean}");
    // The fourth moment of a uniform distribution is 9 / 5 of the squared variance.
    assert!((variance / (4.0 / 3.0) - 1.0).abs() < 5.0 * (0.8 / n).sqrt(), "{variance}");
    assert!(values.iter().all(|v| (-1.0..=3.0).contains(v)));
    assert!(values.iter().any(|v| *v > 2.99) && values.iter().any(|v| *v < -0.99));
}

#[test]
fn the_noise_scale_turns_noise_off_and_leaves_means_and_signals() {
    let spread = NoiseDistribution::Uniform { low: 1.0, high: 2.0 };
    let noise = || WhiteNoise::vector(2).distribution(spread).unscaled();
    let quiet = ran(us(1000), 50, seeded(1).with_noise(0.0), noise());
    assert!(quiet.iter().all(|v| *v == 1.5));
    let (once, twice) = (
        ran(us(1000), 50, seeded(1), noise()),
        ran(us(1000), 50, seeded(1).with_noise(2.0), noise()),
    );
    assert!(once.iter().zip(&twice).all(|(a, b)| (2.0 * (a - 1.5) - (b - 1.5)).abs() < 1e-6));
    assert!(
        ran(us(1000), 50, seeded(1).with_noise(0.0), WhiteNoise::vector(1).integrated())
            .iter()
            .all(|v| *v == 0.0)
    );
    let signal = || WhiteSignal::vector(2, ms(100), 50.0);
    let loud = ran(us(1000), 50, seeded(1), signal());
    assert_eq!(ran(us(1000), 50, seeded(9).with_noise(0.0), signal()), loud);
    assert!(loud.iter().any(|v| v.abs() > 0.3));
}

#[test]
fn filtered_noise_has_the_variance_of_the_closed_form() {
    // 400 components after 300 ms: independent values of the steady state.
    for (tau, tick_us) in [(5, 1000), (20, 1000), (5, 500)] {
        let time = us(tick_us);
        let ticks = 300_000 / tick_us;
        let noise = WhiteNoise::vector(2000).filtered(Synapse::lowpass_ms(tau));
        let values = ran(time, ticks, seeded(4), noise);
        let (_, variance) = mean_and_variance(&values[values.len() - 2000..]);
        let a = (-time.dt_s() * 1000.0 / tau as f64).exp();
        let expected = (1.0 - a) / ((1.0 + a) * time.dt_s());
        let error = variance / expected - 1.0;
        assert!(error.abs() < 5.0 * (2.0 / 2000.0f64).sqrt(), "{tau} ms: {variance}, {expected}");
        // The tick itself counts: the first value has the variance of a first step.
        let (_, first) = mean_and_variance(&values[..2000]);
        let step = (1.0 - a) * (1.0 - a) / time.dt_s();
        assert!((first / step - 1.0).abs() < 5.0 * (2.0 / 2000.0f64).sqrt(), "{first}, {step}");
    }
    let a = (-0.2f64).exp();
    assert!(((1.0 - a) / ((1.0 + a) * 0.001) - 99.667995).abs() < 1e-6);
}

#[test]
fn brown_noise_spreads_alike_whatever_the_tick() {
    for tick_us in [1000, 250] {
        let ticks = 250_000 / tick_us;
        let values = ran(us(tick_us), ticks, seeded(5), WhiteNoise::vector(2000).integrated());
        for (quarter, seconds) in [(1, 0.0625), (4, 0.25)] {
            let end = values.len() / 4 * quarter;
            let (mean, variance) =
                mean_and_variance(&values[end / 2000 * 2000 - 2000..end / 2000 * 2000]);
            let wide = 5.0 * (2.0 / 2000.0f64).sqrt() + tick_us as f64 * 1e-6 / seconds;
            assert!(
                (variance / seconds - 1.0).abs() < wide,
                "{tick_us} us: {variance} at {seconds} s"
            );
            assert!(mean.abs() < 5.0 * (seconds / 2000.0).sqrt());
        }
    }
}

/// Returns the power of `values` at each whole number of cycles, by plain sums.
fn powers(values: &[f64]) -> Vec<f64> {
    let n = values.len();
    (0..=n / 2)
        .map(|k| {
            let (mut re, mut im) = (0.0, 0.0);
            for (at, v) in values.iter().enumerate() {
                let angle = 2.0 * std::f64::consts::PI * ((k * at) % n) as f64 / n as f64;
                re += v * angle.cos();
                im += v * angle.sin();
            }
            (re * re + im * im) / (n * n) as f64
        })
        .collect()
}

#[test]
fn a_white_signal_has_its_band_and_its_power() {
    let signal = || WhiteSignal::vector(100, SimDuration::from_secs(1), 10.0).rms(0.3);
    let values = ran(us(1000), 2000, seeded(1), signal());
    let of = |component: usize| -> Vec<f64> {
        values.iter().skip(component).step_by(100).copied().collect()
    };
    let (mut squares, mut firsts) = (0.0, Vec::new());
    for component in 0..100 {
        let wave = of(component);
        assert_eq!(wave[..1000], wave[1000..], "it repeats after 1 s");
        let power = powers(&wave[..1000]);
        assert!(power[1..=10].iter().all(|p| *p > 1e-9), "ten frequencies");
        let outside = power[0] + power[11..].iter().sum::<f64>();
        assert!(outside < 1e-12, "{outside:e}");
        squares += wave[..1000].iter().map(|v| v * v).sum::<f64>() / 1000.0 / 100.0;
        firsts.push(wave[0]);
    }
    // A squared root mean square varies by sqrt(2 / 20) from signal to signal.
    assert!((squares / 0.09 - 1.0).abs() < 5.0 * (0.1f64 / 100.0).sqrt(), "{squares}");
    let (mean, variance) = mean_and_variance(&firsts);
    assert!(
        mean.abs() < 5.0 * 0.03 && (variance / 0.09 - 1.0).abs() < 5.0 * (2.0f64 / 100.0).sqrt()
    );

    let near = ran(us(1000), 1000, seeded(1), signal().starting_near(0.1));
    assert!(near[..100].iter().all(|v| (v - 0.1).abs() < 0.02), "{:?}", &near[..5]);
    // Up to half the rate of the ticks, and an odd period is rounded up.
    let full = ran(us(1000), 8, seeded(1), WhiteSignal::vector(4000, ms(7), 500.0));
    let square = full.iter().map(|v| v * v).sum::<f64>() / full.len() as f64;
    assert!((square / 0.25 - 1.0).abs() < 0.05, "{square}");
}

#[test]
fn a_white_signal_belongs_to_the_graph_and_noise_to_the_run() {
    let first = |build: u64, run: u64, signal: WhiteSignal<Scalar>| {
        let (graph, probe) = built(Timebase::default(), build, signal);
        let mut sim = Simulator::new(graph, seeded(run)).unwrap();
        sim.run_for(ms(20)).unwrap();
        sim.samples(&probe).iter().map(|(_, v)| v[0]).collect::<Vec<f32>>()
    };
    let signal = || WhiteSignal::scalar(ms(100), 100.0);
    assert_eq!(first(1, 1, signal()), first(1, 2, signal()));
    assert_ne!(first(1, 1, signal()), first(2, 1, signal()));
    let own = || signal().seeded(Seed::new(5));
    assert_eq!(first(1, 1, own()), first(2, 1, own()));
    let noise = |run| ran(us(1000), 20, seeded(run), WhiteNoise::vector(1));
    assert_eq!(noise(1), noise(1));
    assert_ne!(noise(1), noise(2));
}

#[test]
fn checkpoints_resets_and_threads_keep_the_bits() {
    let things = things::vocabulary(128);
    let mut graph = GraphBuilder::new();
    let pointer = WhiteNoise::pointer(things.space()).filtered(Synapse::alpha_ms(5));
    let noise = graph.add("filtered", pointer);
    let state = graph.add("state", State::new(&things));
    graph.route(0.01 * &noise >> &state);
    let brown = graph.add("brown", WhiteNoise::scalar().integrated());
    let white = graph.add("white", WhiteNoise::scalar());
    let wave = graph.add("wave", WhiteSignal::pointer(things.space(), ms(60), 100.0));
    let pointers = [things.get("A").unwrap(), things.get("B").unwrap()];
    let shown = graph.add("shown", Stimulus::pointers(things.space(), &pointers, ms(7)));
    let probes = [
        graph.probe(&state.output, ProbeSpec::default()),
        graph.probe(&noise, ProbeSpec::default()),
        graph.probe(&wave, ProbeSpec::default()),
        graph.probe(&shown, ProbeSpec::default()),
    ];
    let numbers =
        [graph.probe(&brown, ProbeSpec::default()), graph.probe(&white, ProbeSpec::default())];
    let plan = PopulationPlan::lif();
    let graph = Arc::new(graph.build(Timebase::default(), &plan, Seed::new(1)).unwrap());
    let all = |sim: &Simulator| -> Vec<Vec<f32>> {
        let pointers =
            probes.iter().map(|p| sim.samples(p).iter().flat_map(|(_, v)| v.to_vec()).collect());
        let numbers = numbers.iter().map(|p| sim.samples(p).iter().map(|(_, v)| v[0]).collect());
        pointers.chain(numbers).collect()
    };
    let mut sim = Simulator::new(graph.clone(), seeded(7)).unwrap();
    sim.run_for(ms(40)).unwrap();
    let (saved, start) = (sim.checkpoint().unwrap(), all(&sim));
    sim.clear_recordings();
    sim.run_for(ms(40)).unwrap();
    let went_on = all(&sim);
    let mut other = Simulator::new(graph, seeded(8).with_threads(Threads::Exactly(2))).unwrap();
    other.run_for(ms(3)).unwrap();
    other.restore(&saved).unwrap();
    other.run_for(ms(40)).unwrap();
    assert_eq!(all(&other), went_on);
    assert_eq!((went_on.len(), went_on[5].len()), (6, 40));
    assert!(went_on.iter().all(|values| values.iter().any(|v| *v != values[0])));
    sim.reset().unwrap();
    sim.run_for(ms(40)).unwrap();
    assert_eq!(all(&sim), start);
}

#[test]
fn interpolations_are_those_of_nengo() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/conformance");
    let bytes = std::fs::read(folder.join("interpolations.npz")).unwrap();
    let mut npz = NpzReader::new(&bytes).unwrap();
    let mut read = |key: &str| npz.read::<f64, Ix1>(key).unwrap().to_vec();
    let (times, values) = (read("times"), read("values"));
    let describe = |interpolation, from: usize| {
        let mut stimulus = Stimulus::vector(&[values[0] as f32, 1.0]);
        for (time, value) in times.iter().zip(&values).skip(from) {
            let time = SimDuration::from_secs_f64(*time).unwrap();
            stimulus = stimulus.from(time, &[*value as f32, 1.0]);
        }
        stimulus.interpolate(interpolation)
    };
    let rules = [
        ("linear", Interpolation::Linear),
        ("nearest", Interpolation::Nearest),
        ("cubic", Interpolation::Cubic),
    ];
    for (name, rule) in rules {
        // The first value counts as one at 0 ms, given or not.
        for from in [0, 1] {
            let ours = ran(us(1000), 250, seeded(1), describe(rule, from));
            // Ours are values at the starts of ticks, theirs at the ends.
            for (at, theirs) in read(name).iter().enumerate() {
                let error = ours[2 * (at + 1)] - theirs;
                assert!(error.abs() < 1e-6, "{name} at {at}: {error}");
            }
            assert!(ours[2 * 195..].iter().step_by(2).all(|v| (v - 0.3).abs() < 1e-7));
            assert!(ours.iter().skip(1).step_by(2).all(|v| (v - 1.0).abs() < 1e-6));
        }
    }
    let held = ran(us(1000), 250, seeded(1), describe(Interpolation::Hold, 1));
    assert_eq!((held[2 * 49], held[2 * 50], held[2 * 79], held[2 * 80]), (0.25, 1.0, 1.0, -1.0));
}

#[test]
fn rows_and_repetitions_begin_again() {
    let rows = [[1.0, 10.0], [2.0, 20.0], [3.0, 30.0]];
    let shown = ran(us(1000), 1000, seeded(1), Stimulus::vectors(&rows, ms(100)));
    for tick in 0..1000 {
        let row = rows[tick / 100 % 3];
        assert_eq!(shown[2 * tick..2 * tick + 2], row.map(f64::from), "tick {tick}");
    }
    let ramp = Stimulus::vector(&[0.0])
        .from(ms(10), &[1.0])
        .from(ms(20), &[0.0])
        .interpolate(Interpolation::Linear)
        .repeat(ms(25));
    let ramp = ran(us(1000), 100, seeded(1), ramp);
    assert_eq!(ramp.len(), 100);
    for (tick, shown) in ramp.iter().enumerate() {
        let at = tick % 25;
        let expected = if at <= 20 { 1.0 - (at as f64 - 10.0).abs() / 10.0 } else { 0.0 };
        assert!((shown - expected).abs() < 1e-6, "tick {tick}");
    }
}

#[test]
fn bad_processes_have_a_sentence() {
    type Adds = Box<dyn Fn(&mut GraphBuilder)>;
    let all: Vec<(Adds, &str)> = vec![
        (
            Box::new(|graph| {
                let spread = NoiseDistribution::Gaussian { mean: 0.0, sd: -1.0 };
                graph.add("it", WhiteNoise::scalar().distribution(spread));
            }),
            "Gaussian { mean: 0.0, sd: -1.0 } cannot be drawn from",
        ),
        (
            Box::new(|graph| {
                let spread = NoiseDistribution::Uniform { low: 1.0, high: 0.0 };
                graph.add("it", WhiteNoise::scalar().distribution(spread));
            }),
            "Uniform { low: 1.0, high: 0.0 } cannot be drawn from",
        ),
        (
            Box::new(|graph| {
                graph.add("it", WhiteNoise::scalar().filtered(Synapse::alpha_ms(0)));
            }),
            "its noise has a time constant of zero",
        ),
        (
            Box::new(|graph| {
                graph.add("it", WhiteSignal::scalar(ms(100), 5.0));
            }),
            "use a limit from 10 Hz to 500 Hz",
        ),
        (
            Box::new(|graph| {
                graph.add("it", WhiteSignal::scalar(ms(100), 501.0));
            }),
            "use a limit from 10 Hz to 500 Hz",
        ),
        (
            Box::new(|graph| {
                graph.add("it", WhiteSignal::scalar(ms(100), f64::NAN));
            }),
            "frequencies up to NaN Hz",
        ),
        (
            Box::new(|graph| {
                graph.add("it", WhiteSignal::scalar(ms(0), 10.0));
            }),
            "a period of 0 ms is not usable",
        ),
        (
            Box::new(|graph| {
                graph.add("it", WhiteSignal::scalar(SimDuration::from_secs(1_000_000_000), 10.0));
            }),
            "use a shorter one",
        ),
        (
            Box::new(|graph| {
                graph.add("it", WhiteSignal::scalar(ms(100), 50.0).rms(f32::INFINITY));
            }),
            "a root mean square of inf",
        ),
        (
            Box::new(|graph| {
                graph.add(
                    "it",
                    Stimulus::scalar(0.0).from(ms(5), &[1.0]).interpolate(Interpolation::Cubic),
                );
            }),
            "a cubic interpolation of 2 values",
        ),
        (
            Box::new(|graph| {
                graph.add("it", Stimulus::scalar(0.0).from(ms(5), &[1.0]).repeat(ms(5)));
            }),
            "it begins again after 5 ms",
        ),
        (
            Box::new(|graph| {
                graph.add("it", Stimulus::scalars(&[], ms(5)));
            }),
            "no values; give at least one",
        ),
        (
            Box::new(|graph| {
                graph.add("it", Stimulus::vectors(&[vec![1.0, 2.0], vec![1.0]], ms(5)));
            }),
            "a value has 1 numbers; expected 2",
        ),
    ];
    assert_eq!(all.len(), 13);
    for (add, expected) in all {
        let mut graph = GraphBuilder::new();
        add(&mut graph);
        let built = graph.build(Timebase::default(), &PopulationPlan::direct(), Seed::new(1));
        let error = built.expect_err(expected);
        assert_eq!(error.0.len(), 1, "{error}");
        let text = error.0[0].to_string();
        assert!(text.starts_with("`it`: ") && text.contains(expected), "{text}");
    }
}

/// A process of one's own: the number of ticks in a second, known before the first tick.
struct TicksPerSecond;

struct Told(f32);

impl Process for TicksPerSecond {
    fn declare(&self, ports: &mut PortDecl) {
        ports.output("out", OutputSpec::scalar());
    }

    fn make(&self, time: Timebase, _seed: Seed) -> Result<Box<dyn Node>, String> {
        Ok(Box::new(Told((1.0 / time.dt_s()) as f32)))
    }
}

impl Node for Told {
    fn declare(&self, ports: &mut PortDecl) {
        TicksPerSecond.declare(ports);
    }

    fn fingerprint(&self, hash: &mut Fingerprint) {
        hash.reals(&[self.0]);
    }

    fn emit(&self, _cx: &StepCx<'_>, io: &mut EmitIo<'_>) {
        io.outputs.set(0, self.0);
    }
}

impl Module for TicksPerSecond {
    type Ports = Out<Scalar>;

    fn expand(self, scope: &mut Scope<'_>) -> Out<Scalar> {
        let inner = scope.process(self).output("out");
        scope.output("rate", inner)
    }
}

#[test]
fn a_process_of_ones_own_knows_the_tick_and_keeps_its_names() {
    let mut graph = GraphBuilder::new();
    let rate = graph.add("clock", TicksPerSecond);
    for (tick_us, expected) in [(1000, 1000.0), (500, 2000.0)] {
        let built = graph.build(us(tick_us), &PopulationPlan::direct(), Seed::new(1)).unwrap();
        assert!(built.output("clock.rate").is_ok());
        let mut sim = Simulator::new(Arc::new(built), RunConfig::default()).unwrap();
        sim.run_for(ms(1)).unwrap();
        assert_eq!(*sim.value(&rate), [expected]);
    }
}

#[test]
fn closures_that_return_numbers_are_as_wide_as_what_they_return() {
    let mut graph = GraphBuilder::new();
    let one = graph.add("one", Signal::of(|t| 2.0 * t));
    let two = graph.add("two", Signal::of(|t| [t as f32, -1.0]));
    let four = graph.add("four", Signal::of(|t| [[t, 1.0], [2.0, 3.0]]));
    let steps = graph.add("steps", Stimulus::steps_ms([(2, 1.0), (4, 2.0)]));
    let pairs = graph.add("pairs", Stimulus::steps_ms([(0, [1.0, 2.0]), (3, [3.0, 4.0])]));
    let mut seen = Vec::new();
    let mut sim = graph.start(&PopulationPlan::direct(), Seed::new(1)).expect("builds");
    for tick in 0..5 {
        sim.run_for(ms(1)).expect("runs");
        let now = tick as f32 * 1e-3;
        let close = |found: &[f32], wanted: &[f32]| {
            let off = found.iter().zip(wanted).all(|(a, b)| (a - b).abs() < 1e-6);
            assert!(found.len() == wanted.len() && off, "{found:?} {wanted:?}");
        };
        close(sim.value(&one), &[2.0 * now]);
        close(sim.value(&two), &[now, -1.0]);
        close(sim.value(&four), &[now, 1.0, 2.0, 3.0]);
        seen.push((sim.value(&steps)[0], sim.value(&pairs).to_vec()));
    }
    let steps: Vec<f32> = seen.iter().map(|(step, _)| *step).collect();
    assert_eq!(steps, [0.0, 0.0, 1.0, 1.0, 2.0]);
    assert_eq!((&seen[2].1[..], &seen[3].1[..]), (&[1.0, 2.0][..], &[3.0, 4.0][..]));
    // Times that do not increase are told.
    let mut graph = GraphBuilder::new();
    graph.add("steps", Stimulus::steps_ms([(2, 1.0), (2, 2.0)]));
    let error = graph.start(&PopulationPlan::direct(), Seed::new(1)).err().expect("refused");
    assert!(error.to_string().contains("times of a stimulus must increase"), "{error}");
}
