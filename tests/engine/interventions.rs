//! Changes of a run between ticks: clamps, silence, sources, noise; and recordings that are cut.

use std::sync::Arc;

use symbolt::neurons::{Ensemble, LifSpec, Population, PopulationPlan};
use symbolt::prelude::*;
use symbolt::sim::{
    EventSource, InputSpec, Intervention, Out, OutputSpec, Ranks, Real, Scalar, ScriptedWorld,
    SimError, Threads, Vector, WorldLink,
};

use crate::counter::{Counter, MS, build, start};
use crate::things::{lif, rate};
use crate::touched::Touched;

fn clamp(output: &str, values: &[Real]) -> Intervention {
    Intervention::Clamp { output: output.into(), values: values.to_vec() }
}

fn silence(at: &str) -> Intervention {
    Intervention::Silence { at: at.into() }
}

fn release(at: &str) -> Intervention {
    Intervention::Release { at: at.into() }
}

#[test]
fn a_clamp_overwrites_an_output_right_after_its_node() {
    // A chain of nodes without delay, and a counter with an ordinary and a registered output.
    let mut graph = GraphBuilder::new();
    let counter = graph.node("counter", Counter);
    let (now, later) = (counter.output::<Scalar>("now"), counter.output::<Scalar>("later"));
    let doubled = graph.add("doubled", Add::scalar());
    let [direct, filtered] = ["direct", "filtered"].map(|name| graph.add(name, Add::scalar()));
    graph.route(2.0 * &now >> &doubled.input);
    graph.connect(&later, &direct.input, Synapse::None);
    graph.connect(&later, &filtered.input, Synapse::delay_ms(1));
    let graph = build(graph);
    let mut sim = start(&graph);
    let seen = |sim: &mut Simulator| {
        sim.run_for(MS(1)).unwrap();
        [&now, &doubled.output, &later, &direct.output, &filtered.output]
            .map(|out| sim.value(out)[0])
    };
    assert_eq!(seen(&mut sim), [10.0, 20.0, 11.0, 10.0, 0.0]);
    assert_eq!(graph.name_of(&now).as_deref(), Some("counter.now"));
    sim.intervene(&clamp("counter.now", &[-1.0])).unwrap();
    sim.intervene(&clamp("counter.later", &[-5.0])).unwrap();
    // Readers in the same tick see the first at once. The second is registered: readers see it one tick later.
    assert_eq!(seen(&mut sim), [-1.0, -2.0, -5.0, 11.0, 11.0]);
    assert_eq!(seen(&mut sim), [-1.0, -2.0, -5.0, -5.0, -5.0]);
    sim.intervene(&silence("doubled")).unwrap();
    sim.intervene(&clamp("counter.now", &[7.0])).unwrap();
    assert_eq!(seen(&mut sim), [7.0, 0.0, -5.0, -5.0, -5.0]);
    sim.intervene(&release("counter")).unwrap();
    // The counter has counted on.
    assert_eq!(seen(&mut sim), [14.0, 0.0, 15.0, -5.0, -5.0]);
    sim.intervene(&release("doubled")).unwrap();
    assert_eq!(seen(&mut sim), [15.0, 30.0, 16.0, 15.0, 15.0]);
    sim.intervene(&silence("counter")).unwrap();
    sim.reset().unwrap();
    assert_eq!(seen(&mut sim), [10.0, 20.0, 11.0, 10.0, 0.0]);
}

#[test]
fn a_sense_that_is_released_is_sensed_again_at_once() {
    let mut graph = GraphBuilder::new();
    let link = WorldLink::new()
        .sense("seen", OutputSpec::scalar())
        .sense("other", OutputSpec::scalar())
        .command("heard", InputSpec::scalar());
    let world = graph.world("world", link);
    let (seen, other): (Out<Scalar>, Out<Scalar>) = (world.output("seen"), world.output("other"));
    let read = graph.add("read", Add::scalar());
    graph.connect(&seen, &read.input, Synapse::None);
    graph.connect(&read.output, &world.input("heard"), Synapse::None);
    let senses = (0..9).map(|n| vec![n as f32, 10.0 * n as f32]).collect();
    let config = RunConfig::default().in_world(ScriptedWorld::new(MS(5), senses, 1));
    let mut sim = Simulator::new(build(graph), config).unwrap();
    let at = |sim: &mut Simulator, ms| {
        sim.run_for(MS(ms)).unwrap();
        [sim.value(&seen)[0], sim.value(&other)[0], sim.value(&read.output)[0]]
    };
    assert_eq!(at(&mut sim, 6), [1.0, 10.0, 1.0]);
    sim.intervene(&clamp("world.seen", &[-3.0])).unwrap();
    assert_eq!(at(&mut sim, 1), [-3.0, 10.0, 1.0]);
    assert_eq!(at(&mut sim, 4), [-3.0, 20.0, -3.0]);
    sim.intervene(&release("world.seen")).unwrap();
    assert_eq!(at(&mut sim, 1), [2.0, 20.0, -3.0]);
    assert_eq!(at(&mut sim, 1), [2.0, 20.0, 2.0]);
}

#[test]
fn a_source_that_is_set_shows_through_when_its_clamp_is_released() {
    let mut graph = GraphBuilder::new();
    let goal = graph.add("goal", Constant::vector(&[1.0, 0.0]));
    let sum = graph.add("sum", Add::vector(2));
    graph.connect(&goal, &sum.input, Synapse::None);
    let mut sim = start(&build(graph));
    let seen = |sim: &mut Simulator| {
        sim.run_for(MS(1)).unwrap();
        sim.value(&sum.output).to_vec()
    };
    let set = |values: [Real; 2]| Intervention::Set {
        output: "goal.out".into(),
        values: values.to_vec(),
    };
    let mut sim_seen = Vec::new();
    for what in [set([2.0, 0.0]), silence("goal"), set([3.0, 1.0]), release("goal")] {
        sim.intervene(&what).unwrap();
        sim_seen.push(seen(&mut sim));
    }
    assert_eq!(sim_seen, [[2.0, 0.0], [0.0, 0.0], [0.0, 0.0], [3.0, 1.0]]);
    let refused =
        sim.intervene(&Intervention::Set { output: "sum.out".into(), values: vec![0.0; 2] });
    assert_eq!(
        refused.unwrap_err().to_string(),
        "`sum.out` is computed from inputs, so it can be clamped but not set; sources are: `goal.out`"
    );
}

/// Two populations in a row, with a probe of the spikes of the first and a recorded output of the second.
fn in_a_row(
    plan: &PopulationPlan,
    threads: usize,
) -> (Simulator, [Out<Vector>; 2], symbolt::sim::SpikeProbe) {
    let mut graph = GraphBuilder::new();
    let drive = graph.add("drive", Constant::vector(&[0.8]));
    let a = graph.add("a", Ensemble::new(1).neurons(50).copies(1).expose_neurons().identity("x"));
    let b = graph.add("b", Ensemble::new(1).neurons(50).identity("x"));
    graph.route(&drive >> &a);
    graph.route(&a.output("x") >> &b);
    let spikes = graph.probe_spikes("a");
    let outs = [a.output("x"), b.output("x")];
    let graph = Arc::new(graph.build(Timebase::default(), plan, Seed::new(1)).unwrap());
    let config = RunConfig::default().with_threads(Threads::Exactly(threads));
    (Simulator::new(graph, config).unwrap(), outs, spikes)
}

fn source(sim: &Simulator, path: &str) -> Option<EventSource> {
    sim.graph().event_sources().find(|(own, _)| own.starts_with(path)).map(|(_, source)| source)
}

#[test]
fn a_silenced_module_has_outputs_of_zero_and_no_spikes() {
    // Only neurons have spikes or rates; silence in exact maths is tested with the other interventions.
    for (name, plan) in [("rate", rate()), ("spiking", lif())] {
        let mut by_threads = Vec::new();
        for threads in 1..=3 {
            let (mut sim, [a, b], spikes) = in_a_row(&plan, threads);
            sim.run_for(MS(100)).unwrap();
            assert!(sim.value(&b)[0] > 0.3, "{name}");
            let before = sim.spikes(&spikes).count();
            sim.intervene(&silence("a")).unwrap();
            let of_b = source(&sim, "b");
            let (mut seen, mut seen_b) = (0, 0);
            for _ in 0..100 {
                sim.run_for(MS(1)).unwrap();
                let events = |of: Option<EventSource>| {
                    of.map_or(0, |of| (0..of.units).filter(|unit| sim.event(of, *unit)).count())
                };
                seen += events(source(&sim, "a"));
                seen_b += events(of_b);
                assert!(sim.value(&a).iter().all(|v| *v == 0.0));
            }
            assert_eq!((seen, sim.spikes(&spikes).count()), (0, before), "{name}");
            assert!(sim.value(&b)[0].abs() < 0.2, "{name}");
            if name == "spiking" {
                assert!(before > 100 && seen_b > 100, "the others fire: {before}, {seen_b}");
            }
            // What is restored says the same of the last tick.
            let saved = sim.checkpoint().unwrap();
            sim.intervene(&release("a")).unwrap();
            sim.run_for(MS(1)).unwrap();
            assert!(sim.value(&a)[0] != 0.0, "its output is its own at once");
            sim.restore(&saved).unwrap();
            let of = source(&sim, "a");
            assert!(of.is_none_or(|of| (0..of.units).all(|unit| !sim.event(of, unit))));
            sim.intervene(&release("a")).unwrap();
            sim.run_for(MS(100)).unwrap();
            assert!(sim.value(&b)[0] > 0.3, "{name}");
            assert_eq!(sim.spikes(&spikes).count() > before, name == "spiking");
            by_threads.push(serde_json::to_string(&sim.checkpoint().unwrap()).unwrap());
        }
        assert!(by_threads.iter().all(|state| *state == by_threads[0]), "{name}");
    }
}

#[test]
fn only_the_output_of_an_ensemble_may_be_silenced_and_its_neurons_fire_on() {
    let (mut sim, [a, _], spikes) = in_a_row(&lif(), 2);
    sim.intervene(&silence("a.x")).unwrap();
    sim.run_for(MS(100)).unwrap();
    assert_eq!(sim.value(&a)[0], 0.0);
    assert!(sim.spikes(&spikes).count() > 100);
}

#[test]
fn ranks_that_make_the_same_interventions_have_the_same_bits() {
    let run = |ranks: Option<Ranks>| {
        let spec = Population::Lif(LifSpec::default());
        let plan = PopulationPlan::all(spec);
        let plan = ranks.as_ref().map_or(plan.clone(), |ranks| plan.shared(ranks));
        let (mut sim, outs, spikes) = in_a_row(&plan, 1);
        let mut bits = Vec::new();
        for what in [silence("a"), clamp("b.x", &[0.5]), release("a"), release("b")] {
            sim.run_for(MS(20)).unwrap();
            sim.intervene(&what).unwrap();
            let saved = sim.checkpoint().unwrap();
            sim.restore(&saved).unwrap();
            bits.extend(outs.iter().map(|out| sim.value(out)[0].to_bits()));
        }
        sim.run_for(MS(20)).unwrap();
        let state = serde_json::to_string(&sim.checkpoint().unwrap()).unwrap();
        (bits, sim.spikes(&spikes).count(), state)
    };
    let alone = run(None);
    assert!(alone.1 > 100);
    let each = &run;
    let all: Vec<_> = std::thread::scope(|scope| {
        let group = Ranks::in_process(2).into_iter();
        let threads: Vec<_> = group.map(|ranks| scope.spawn(move || each(Some(ranks)))).collect();
        threads.into_iter().map(|thread| thread.join().unwrap()).collect()
    });
    assert!(all.iter().all(|own| (&own.0, own.1) == (&alone.0, alone.1)));
    assert!(all[0].2 == all[1].2);
}

#[test]
fn noise_of_a_node_is_scaled_between_ticks_and_stays_a_function_of_the_tick() {
    let mut graph = GraphBuilder::new();
    let zero = graph.add("zero", Constant::scalar(0.0));
    let [a, b] = ["a", "b"].map(|name| {
        let noise = graph.add(name, Noise::scalar(1.0));
        graph.connect(&zero, &noise.input, Synapse::None);
        noise.output
    });
    let probes = [&a, &b].map(|out| graph.probe(out, ProbeSpec::default()));
    let graph = build(graph);
    let run = |scales: &[(u64, Option<&str>, Real)]| {
        let mut sim = start(&graph);
        for (tick, at, scale) in scales {
            sim.run_for(MS(tick - sim.tick())).unwrap();
            let at = at.map(str::to_owned);
            sim.intervene(&Intervention::Noise { at, scale: *scale }).unwrap();
            // A checkpoint keeps it.
            let saved = serde_json::to_string(&sim.checkpoint().unwrap()).unwrap();
            sim.restore(&serde_json::from_str(&saved).unwrap()).unwrap();
        }
        sim.run_for(MS(30 - sim.tick())).unwrap();
        probes.map(|probe| sim.samples(&probe).iter().map(|(_, v)| v[0]).collect::<Vec<_>>())
    };
    let plain = run(&[]);
    assert!(plain.iter().all(|values| values.len() == 30 && values.iter().all(|v| *v != 0.0)));
    let [on_a, on_b] = run(&[(10, Some("a"), 0.0), (20, Some("a"), 1.0)]);
    assert_eq!((&on_a[..10], &on_a[20..]), (&plain[0][..10], &plain[0][20..]));
    assert!(on_a[10..20].iter().all(|v| *v == 0.0));
    assert_eq!(on_b, plain[1]);
    // The factor of the run multiplies that of the node.
    let [on_a, on_b] = run(&[(5, None, 0.5), (5, Some("a"), 4.0)]);
    let doubled: Vec<_> = plain[0][5..].iter().map(|v| 2.0 * v).collect();
    let halved: Vec<_> = plain[1][5..].iter().map(|v| 0.5 * v).collect();
    assert_eq!((&on_a[5..], &on_b[5..]), (&doubled[..], &halved[..]));
}

#[test]
fn restore_cuts_recordings_at_the_tick_of_the_checkpoint() {
    for mode in ["exact", "spiking"] {
        let model = Touched::new(8, mode);
        let last = model.probes[model.probes.len() - 1];
        let mut sim = model.start(2);
        sim.run_for(MS(31)).unwrap();
        let saved = sim.checkpoint().unwrap();
        let at_31 = model.bits(&sim);
        let ms = |sim: &Simulator| -> Vec<u64> {
            sim.samples(&last).iter().map(|(t, _)| (1e3 * t).round() as u64).collect()
        };
        assert_eq!(ms(&sim), [18, 21, 24, 27, 30]);
        sim.run_for(MS(9)).unwrap();
        let at_40 = model.bits(&sim);
        sim.restore(&saved).unwrap();
        assert!(model.bits(&sim) == at_31, "{mode}");
        // Of the last five samples, those that are left and not of the future.
        assert_eq!(ms(&sim), [27, 30]);
        sim.run_for(MS(9)).unwrap();
        assert!(model.bits(&sim) == at_40, "{mode}");
        assert_eq!(sim.samples(&last).len(), 5);
        sim.run_for(MS(60)).unwrap();
        assert_eq!(ms(&sim), [87, 90, 93, 96, 99]);
        // Not this run's past.
        let later = sim.checkpoint().unwrap();
        sim.restore(&saved).unwrap();
        assert_eq!(sim.samples(&model.probes[0]).len(), 31);
        sim.restore(&later).unwrap();
        assert!(sim.samples(&model.probes[0]).is_empty() && sim.samples(&last).is_empty());
        sim.run_for(MS(5)).unwrap();
        assert_eq!(sim.samples(&model.probes[0]).len(), 5);
        assert_eq!(sim.samples(&model.counted).get(0).map(|(t, _)| t), Some(0.101));
    }
}

#[test]
fn a_checkpoint_keeps_what_is_in_force_and_one_that_is_forged_is_refused() {
    let model = Touched::new(2, "spiking");
    let mut sim = model.start(1);
    let plain = serde_json::to_value(sim.checkpoint().unwrap()).unwrap();
    assert!(plain.get("changes").is_none(), "a run without changes is written as before");
    for what in [silence("cells"), clamp("goal.out", &[0.1, 0.2])] {
        sim.intervene(&what).unwrap();
    }
    sim.intervene(&Intervention::Set { output: "hiss.out".into(), values: vec![1.0, 2.0] })
        .unwrap();
    sim.intervene(&Intervention::Noise { at: Some("m0".into()), scale: 2.0 }).unwrap();
    sim.run_for(MS(10)).unwrap();
    let saved = sim.checkpoint().unwrap();
    sim.run_for(MS(10)).unwrap();
    let expected = sim.checkpoint().unwrap();
    let value = serde_json::to_value(&saved).unwrap();
    let mut other = model.start(3);
    other.restore(&serde_json::from_value(value.clone()).unwrap()).unwrap();
    other.run_for(MS(10)).unwrap();
    assert!(other.checkpoint().unwrap() == expected);
    // Without what is in force, the bits are others.
    let mut bare = value.clone();
    bare.as_object_mut().unwrap().remove("changes");
    other.restore(&serde_json::from_value(bare).unwrap()).unwrap();
    other.run_for(MS(10)).unwrap();
    assert!(other.checkpoint().unwrap() != expected);
    let forge = |list: &str, entry: usize, key: &str, to: serde_json::Value| {
        let mut forged = value.clone();
        forged["changes"][list][entry][key] = to;
        forged
    };
    let mut out_of_range = value.clone();
    out_of_range["changes"]["silent"][0] = 4_000_000_000u32.into();
    let mut noise = value.clone();
    noise["changes"]["noise"][0][1] = (-1.0).into();
    let forged = [
        forge("held", 0, "node", 4_000_000_000u32.into()),
        forge("held", 0, "output", 99.into()),
        forge("set", 0, "values", vec![1.0, 2.0, 3.0].into()),
        forge("set", 0, "values", vec![1e39, 2.0].into()),
        out_of_range,
        noise,
    ];
    for forged in forged {
        let forged = serde_json::from_value(forged).unwrap();
        assert_eq!(other.restore(&forged), Err(SimError::ForeignCheckpoint));
    }
}

#[test]
fn places_are_found_by_node_module_and_the_names_that_modules_give() {
    struct Pair;
    impl Module for Pair {
        type Ports = Out<Scalar>;
        fn expand(self, scope: &mut Scope<'_>) -> Out<Scalar> {
            let inner = scope.add("inner", Constant::scalar(2.0));
            scope.add("spare", Constant::scalar(3.0));
            scope.output("output", inner)
        }
    }
    let mut graph = GraphBuilder::new();
    let pair = graph.add("pair", Pair);
    let beside = graph.add("pair-2", Constant::scalar(4.0));
    let mut sim = start(&build(graph));
    let seen = |sim: &mut Simulator| {
        sim.run_for(MS(1)).unwrap();
        [&pair, &beside].map(|out| sim.value(out)[0])
    };
    for at in ["pair.output", "pair/inner.out", "pair/inner", "pair"] {
        sim.intervene(&silence(at)).unwrap();
        assert_eq!(seen(&mut sim), [0.0, 4.0], "{at}");
        sim.intervene(&release("pair")).unwrap();
        assert_eq!(seen(&mut sim), [2.0, 4.0], "{at}");
    }
    let refused =
        |sim: &mut Simulator, what: Intervention| sim.intervene(&what).unwrap_err().to_string();
    assert_eq!(
        refused(&mut sim, silence("pair/iner")),
        "the graph has no output, node or module `pair/iner`; the most similar: `pair/inner`, `pair/spare`, \
         `pair`, `pair-2`, `pair/inner.out`, `pair-2.out`, `pair.output`, `pair/spare.out`"
    );
    assert_eq!(
        refused(&mut sim, clamp("pair", &[1.0])),
        "the graph has no output `pair`; the most similar: `pair-2.out`, `pair.output`, `pair/inner.out`, \
         `pair/spare.out`"
    );
    for at in ["", "/", "pair/", ".out", "pai"] {
        assert!(refused(&mut sim, silence(at)).starts_with("the graph has no"), "{at}");
    }
    assert_eq!(
        refused(&mut sim, release("pair")),
        "nothing is clamped or silenced at `pair`; held are: none"
    );
    assert!(refused(&mut sim, clamp("pair.output", &[Real::NAN])).contains("is NaN"));
    assert!(
        refused(&mut sim, Intervention::Noise { at: None, scale: Real::INFINITY }).contains("inf")
    );
}
