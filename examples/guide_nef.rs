//! The guide `docs/nef.md` as a program.
//!
//! `cargo run --example guide_nef`

use std::error::Error;
use std::f64::consts::TAU;
use std::ops::Range;

use symbolt::files::Overwrite;
use symbolt::neurons::{
    AdaptiveLif, BuiltLayer, L1, LearnedPorts, LearningRule, NonNegative, Target,
};
use symbolt::prelude::*;
use symbolt::sim::ProbeId;
use symbolt::spa::{Integrator, Multiply, Oscillator};

type Done = Result<(), Box<dyn Error>>;

const MS: fn(u64) -> SimDuration = SimDuration::from_millis;

/// Records a value through a low-pass of 20 ms.
fn watch(graph: &mut GraphBuilder, value: &Out<Vector>) -> ProbeId<Vector> {
    graph.probe(value, ProbeSpec::default().filtered(Synapse::lowpass_ms(20)))
}

/// Returns the mean of the first component over some ticks of 1 ms.
fn mean(sim: &Simulator, of: &ProbeId<Vector>, ticks: Range<usize>) -> f32 {
    let values = sim.samples(of).iter().map(|(_, value)| value[0]);
    let count = ticks.len();
    values.skip(ticks.start).take(count).sum::<f32>() / count as f32
}

fn tuning_curves() -> Done {
    let mut graph = GraphBuilder::new();
    let given = graph.add("given", Constant::scalar(0.5));
    let a = graph.add("a", Ensemble::new(1).identity("x"));
    graph.route(&given >> &a);
    let graph = graph.build(Timebase::default(), &PopulationPlan::lif(), Seed::new(1))?;

    let a = BuiltLayer::of(&graph, a.path())?.ensemble(0)?;
    println!("{} neurons", a.gains().len());
    let rates = a.response_curves(&[-1.0, 0.0, 1.0]);
    for neuron in 0..3 {
        let [low, middle, high] = [0, 1, 2].map(|at| rates[[at, neuron]]);
        println!("spiking neuron {neuron}: {low:.0} {middle:.0} {high:.0} Hz");
    }
    let error = a.error("x")?;
    println!("spiking error: {error:.3}");
    Ok(())
}

fn channel() -> Done {
    let mut graph = GraphBuilder::new();
    let given = graph.add("given", Constant::scalar(0.5));
    let a = graph.add("a", Ensemble::new(1).identity("x"));
    let b = graph.add("b", Ensemble::new(1).identity("x"));
    graph.route(&given >> &a);
    graph.route(&a.output("x") >> &b);
    let probe = watch(&mut graph, &b.output("x"));
    for (mode, plan) in [
        ("direct", PopulationPlan::direct()),
        ("rate", PopulationPlan::rate()),
        ("spiking", PopulationPlan::lif()),
    ] {
        let sim = graph.run(&plan, Seed::new(1), MS(400))?;
        println!("{mode} channel: {:.2}", mean(&sim, &probe, 300..400));
    }
    Ok(())
}

fn arithmetic() -> Done {
    let mut graph = GraphBuilder::new();
    let a = graph.add("a", Constant::scalar(0.8));
    let b = graph.add("b", Constant::scalar(-0.5));

    let sum = graph.add("sum", Ensemble::new(1).identity("x"));
    graph.route(&a + 0.5 * &b >> &sum);

    let pair = graph.add("pair", Ensemble::new(2).function("product", |x| x[0] * x[1]));
    graph.route(a.embed(0, 2) + b.embed(1, 2) >> &pair);

    let module = graph.add("module", Multiply::new());
    let precise = graph.add("precise", Ensemble::new(1).identity("x"));
    graph.route(&a >> &module.a);
    graph.route(&b >> &module.b);
    graph.route(&module >> &precise);

    let outputs = [sum.output("x"), pair.output("product"), precise.output("x")];
    let probes = outputs.map(|output| watch(&mut graph, &output));
    let sim = graph.run(&PopulationPlan::lif(), Seed::new(1), MS(400))?;
    let [sum, product, precise] = probes.map(|probe| mean(&sim, &probe, 200..400));
    println!("spiking sum: {sum:.2} products: {product:.2} {precise:.2}");
    Ok(())
}

fn dynamics() -> Done {
    let slow = Synapse::lowpass_ms(100);
    let mut graph = GraphBuilder::new();

    let speed = graph.add("speed", Stimulus::steps_ms([(0, 1.0), (500, 0.0)]));
    let place = graph.add("place", Ensemble::new(1).identity("x"));
    graph.route((&place.output("x") + 0.1 * &speed >> &place).via(slow));

    let kick = graph.add("kick", Stimulus::steps_ms([(0, [1.0, 0.0]), (100, [0.0, 0.0])]));
    let point = graph.add("point", Ensemble::new(2).identity("x"));
    // 10 rad/s: tau times the speed is 1.
    let turned = point.output("x").transform([[1.0, -1.0], [1.0, 1.0]]);
    graph.route(&kick >> &point);
    graph.route((turned >> &point).via(slow));

    let step = |x: &[f32]| {
        let along = x[0] + 0.1 * 10.0 * (x[1] - x[0]);
        let across = x[1] + 0.1 * (-x[0] * x[2] - x[1]);
        [along, across, x[2] + 0.1 * (x[0] * x[1] - 8.0 / 3.0 * (x[2] + 28.0) - 28.0)]
    };
    let lorenz = Ensemble::new(3).neurons(1_000).radius(60.0);
    let lorenz = graph.add("lorenz", lorenz.function("step", step).identity("x"));
    graph.route((&lorenz.output("step") >> &lorenz).via(slow));

    let outputs = [place.output("x"), point.output("x"), lorenz.output("x")];
    let [place, point, lorenz] = outputs.map(|output| watch(&mut graph, &output));
    let sim = graph.run(&PopulationPlan::lif(), Seed::new(1), MS(3_000))?;
    println!("spiking integral: {:.2}", mean(&sim, &place, 800..1_000));
    let up = |of: &ProbeId<Vector>| {
        let values: Vec<f32> = sim.samples(of).iter().map(|(_, value)| value[0]).collect();
        values.windows(2).filter(|pair| pair[0] < 0.0 && pair[1] >= 0.0).count()
    };
    println!("spiking turns in 3 s: {}", up(&point));
    let x = sim.samples(&lorenz).iter().skip(1_000).map(|(_, value)| value[0]);
    let [low, high] = x.fold([0.0f32; 2], |[low, high], x| [low.min(x), high.max(x)]);
    println!("spiking Lorenz attractor, x: {low:.0} to {high:.0}");
    Ok(())
}

fn modules() -> Done {
    let mut graph = GraphBuilder::new();
    let speed = graph.add("speed", Stimulus::scalar(1.0).from(MS(500), &[0.0]));
    let place = graph.add("place", Integrator::scalar());
    let kick = graph.add("kick", Stimulus::steps_ms([(0, [1.0, 0.0]), (100, [0.0, 0.0])]));
    let clock = graph.add("clock", Oscillator::new(2.0));
    graph.route(&speed >> &place);
    graph.route(&kick >> &clock.input);
    let sim = graph.run(&PopulationPlan::direct(), Seed::new(1), MS(1_000))?;
    println!("direct integral: {:.2}", sim.value(&place.output)[0]);
    let point = sim.value(&clock.output);
    println!("direct radius: {:.1}", point[0].hypot(point[1]));
    Ok(())
}

fn inhibition() -> Done {
    let mut graph = GraphBuilder::new();
    let given = graph.add("given", Constant::scalar(0.8));
    let a = graph.add("a", Ensemble::new(1).neurons(100).expose_neurons().identity("x"));
    let stop = graph.add("stop", Stimulus::steps_ms([(300, 1.0)]));
    graph.route(&given >> &a);
    graph.route((stop.transform([[-2.5]; 100]) >> &a.encoded()).via(Synapse::lowpass_ms(5)));
    let probe = watch(&mut graph, &a.output("x"));
    let sim = graph.run(&PopulationPlan::lif(), Seed::new(1), MS(600))?;
    let [before, after] = [200..300, 500..600].map(|ticks| mean(&sim, &probe, ticks));
    println!("spiking before: {before:.2} inhibited: {after:.2}");
    Ok(())
}

fn adaptation() -> Done {
    let mut graph = GraphBuilder::new();
    let given = graph.add("given", Constant::scalar(0.5));
    let adaptive = AdaptiveLif { tau_n_s: 0.3, inc_n: 0.05, ..AdaptiveLif::default() };
    let a = graph.add("a", Ensemble::new(1).model(adaptive).identity("x"));
    graph.route(&given >> &a);
    let probe = watch(&mut graph, &a.output("x"));
    let sim = graph.run(&PopulationPlan::lif(), Seed::new(1), MS(1_000))?;
    let [early, late] = [50..100, 900..1_000].map(|ticks| mean(&sim, &probe, ticks));
    println!("spiking early: {early:.2} adapted: {late:.2}");
    Ok(())
}

fn solvers() -> Done {
    let square = || Target::function(1, |x, out| out[0] = x[0] * x[0]);
    let mut graph = GraphBuilder::new();
    let given = graph.add("given", Constant::scalar(0.5));
    let sparse = L1 { l1: 1e-3, ..L1::default() };
    let a = Ensemble::new(1)
        .decode_as("default", square())
        .decode_as("sparse", square().solver(sparse))
        .decode_as("positive", square().solver(NonNegative::default()));
    let a = graph.add("a", a);
    graph.route(&given >> &a);
    let graph = graph.build(Timebase::default(), &PopulationPlan::lif(), Seed::new(1))?;
    let a = BuiltLayer::of(&graph, "a")?.ensemble(0)?;
    for name in ["default", "sparse", "positive"] {
        let used = a.decoders(name)?.iter().filter(|decoder| **decoder != 0.0).count();
        let error = a.error(name)?;
        println!("spiking {name}: error {error:.3} with {used} neurons");
    }
    Ok(())
}

/// Runs a learned channel for two seconds. Returns the run, the connection and the error in the last second.
fn lesson(
    rule: impl LearningRule,
    weights: Weights,
) -> Result<(Simulator, LearnedPorts, f32), Box<dyn Error>> {
    let mut graph = GraphBuilder::new();
    let given = graph.add("given", Signal::of(|t| (TAU * t).sin()));
    let pre = graph.add("pre", Ensemble::new(1).neurons(100).expose_neurons().identity("x"));
    let post = graph.add("post", Ensemble::new(1).identity("x"));
    let learned = Learned::new(&pre.neurons(), 1).rule(rule).weights(weights);
    let learned = graph.add("learned", learned);
    graph.route(&given >> &pre);
    graph.route(&learned >> &post);
    graph.route(&post.output("x") - &pre.output("x") >> &learned.error());
    let probes = [&pre, &post].map(|end| watch(&mut graph, &end.output("x")));
    let sim = graph.run(&PopulationPlan::lif(), Seed::new(1), MS(2_000))?;
    let [pre, post] = probes.map(|probe| {
        let last = sim.samples(&probe).iter().skip(1_000);
        last.map(|(_, value)| value[0]).collect::<Vec<f32>>()
    });
    let squares = pre.iter().zip(&post).map(|(pre, post)| (pre - post).powi(2));
    let error = (squares.sum::<f32>() / 1_000.0).sqrt();
    Ok((sim, learned, error))
}

fn learning() -> Done {
    let (.., none) = lesson(Pes::new(0.0), Weights::zero())?;
    println!("spiking not learned: {none:.2}");
    let (.., pes) = lesson(Pes::new(1e-3), Weights::zero())?;
    println!("spiking Pes: {pes:.2}");
    let (sim, learned, rls) = lesson(Rls::new(1e-3), Weights::zero())?;
    println!("spiking Rls: {rls:.2}");

    // Weights outlive the run. With a rate of 0 they stay as they are.
    let file = std::env::temp_dir().join(format!("channel-{}.npz", std::process::id()));
    learned.save(&sim, &file, Overwrite::Allowed)?;
    let (.., saved) = lesson(Pes::new(0.0), Weights::read(&file)?)?;
    println!("spiking saved: {saved:.2}");
    std::fs::remove_file(file)?;
    Ok(())
}

fn association() -> Done {
    let keys = [[1.0, 0.0, 0.0, 0.0], [0.0, 0.6, 0.0, 0.8]];
    let mut graph = GraphBuilder::new();
    let key = graph.add("key", Stimulus::vectors(&keys, MS(500)));
    let value = graph.add("value", Stimulus::vectors(&[[0.7], [-0.4]], MS(500)));
    let learning = graph.add("learning", Stimulus::scalar(1.0).from(MS(1_000), &[0.0]));
    let memory = Ensemble::new(1).neurons(200).intercepts(0.3).expose_neurons();
    let memory = graph.add("memory", memory);
    let encoders = Learned::encoders(4, &memory.neurons())
        .weights(Weights::directions(Seed::new(1)))
        .rule(Voja::new(0.05))
        .switched();
    let encoders = graph.add("encoders", encoders);
    let recall = Learned::new(&memory.neurons(), 1).rule(Pes::new(3e-4)).switched();
    let recall = graph.add("recall", recall);
    graph.route(&key >> &encoders.input());
    graph.route(&encoders >> &memory.encoded());
    graph.route(&recall - &value >> &recall.error());
    graph.route(&learning >> &encoders.learning());
    graph.route(&learning >> &recall.learning());
    let probe = watch(&mut graph, &recall.output);
    let sim = graph.run(&PopulationPlan::lif(), Seed::new(1), MS(2_000))?;
    let [first, second] = [1_200..1_500, 1_700..2_000].map(|ticks| mean(&sim, &probe, ticks));
    println!("spiking recall: {first:.2} and {second:.2}");
    Ok(())
}

pub(crate) fn main() -> Done {
    tuning_curves()?;
    channel()?;
    arithmetic()?;
    dynamics()?;
    modules()?;
    inhibition()?;
    adaptation()?;
    solvers()?;
    learning()?;
    association()
}
