//! Sessions: steps, plots, changes and the way back, with the bits of a run that nobody watches.

use std::ops::ControlFlow;

use serde_json::json;
use symbolt::prelude::*;
use symbolt::record::RecordingFiles;
use symbolt::sim::{
    Checkpoint, Intervention, InterventionLog, Live, LiveOptions, Signal, SimView, StopReason,
};
use symbolt::task::planner::{Part, Planner, PlannerSpec};
use symbolt::task::{ActionId, DomainBuilder};
use symbolt::view::{Driven, View};

use crate::model::{CHOICES, model};
use crate::window::{Window, parts, samples, served, served_by};

fn spiking() -> Simulator {
    model(&PopulationPlan::lif(), 64).unwrap()
}

/// The state of a run that nobody watches.
fn alone(ticks: u64) -> Checkpoint {
    let mut sim = spiking();
    sim.run_for(SimDuration::from_millis(ticks)).unwrap();
    sim.checkpoint().unwrap()
}

/// What the model has chosen.
fn choice(live: &Live) -> &'static str {
    let graph = live.sim().graph();
    let of = graph.output("rules.chosen").unwrap();
    let chosen = live.sim().value_of(of);
    CHOICES[(0..CHOICES.len()).max_by(|a, b| chosen[*a].total_cmp(&chosen[*b])).unwrap()]
}

#[test]
fn a_run_that_is_watched_has_the_same_bits_as_one_that_is_not() {
    let served = served(spiking());
    let mut window = served.window();
    let hello = &window.hello;
    assert!(hello["graph"]["nodes"].as_array().unwrap().len() > 5, "{hello}");
    assert_eq!(hello["pointers"]["memory.output"], json!(["NUT", "BOLT"]));
    assert_eq!(hello["events"], false);
    let similar = json!({ "similar": { "output": "memory.output", "to": ["NUT", "NUT * BOLT"] } });
    window.send(&json!({ "plot": { "key": 7, "what": similar } }));
    let plotted = window.answer("plotted");
    assert_eq!((&plotted["key"], &plotted["names"][1]), (&json!(7), &json!("NUT * BOLT")));
    let layer = hello_layer(&window.hello);
    let spikes = json!({ "spikes": { "layer": layer, "count": 20 } });
    window.send(&json!({ "plot": { "key": 8, "what": spikes } }));
    window.answer("plotted");
    let (ticks, neurons) = window.sampled(&json!({ "step": { "ticks": 50 } }), 50);
    assert!(ticks.len() > 5 && neurons.iter().all(|neuron| (0.0..20.0).contains(neuron)));
    // At full speed, then at a speed of a hundredth, then on.
    window.send(&json!({ "run": {} }));
    while window.frame().0.tick < 300.0 {}
    window.send(&json!({ "run": { "speed": 0.01 } }));
    window.send(&json!({ "pause": {} }));
    let stopped = loop {
        let (frame, _) = window.frame();
        if frame.mode == 0 {
            break frame.tick as u64;
        }
    };
    let end = stopped + 100;
    window.goes(&json!({ "seek": { "tick": end } }), end);
    let live = served.ended();
    assert_eq!(live.tick(), end);
    assert!(live.sim().checkpoint().unwrap() == alone(end));
    assert!(alone(end) != alone(end - 1), "states can be told apart");
}

fn hello_layer(hello: &serde_json::Value) -> String {
    let nodes = hello["graph"]["nodes"].as_array().unwrap();
    let layer = nodes.iter().find(|node| node["neurons"].as_u64() >= Some(20)).unwrap();
    layer["path"].as_str().unwrap().to_owned()
}

#[test]
fn stepping_back_and_on_gives_the_same_bits() {
    let served = served(spiking());
    let mut window = served.window();
    window.send(&json!({ "plot": { "key": 1, "what": { "values": { "output": "rules.chosen", "count": 3 } } } }));
    window.answer("plotted");
    let there = window.sampled(&json!({ "step": { "ticks": 170 } }), 170).1;
    let back = window.goes(&json!({ "back": { "ticks": 60 } }), 110);
    assert_ne!(there, samples(&back).1);
    assert_eq!(samples(&back).0, [110.0], "no sample of the run's future is left");
    let again = window.sampled(&json!({ "step": { "ticks": 60 } }), 170).1;
    let last = |values: &[f32]| values.last_chunk::<3>().unwrap().map(f32::to_bits);
    assert_eq!(last(&there), last(&again));
    // What lies ahead is made again, unless it is forgotten.
    window.send(&json!({ "do": { "silence": { "at": "memory" } } }));
    window.goes(&json!({ "back": { "ticks": 10 } }), 160);
    window.send(&json!({ "forget": {} }));
    window.goes(&json!({ "step": { "ticks": 10 } }), 170);
    assert!(served.ended().sim().checkpoint().unwrap() == alone(170));
}

#[test]
fn a_branch_is_kept_and_returned_to_with_the_same_bits() {
    let served = served(spiking());
    let mut window = served.window();
    window.goes(&json!({ "step": { "ticks": 150 } }), 150);
    // Going back alone makes no branch.
    window.goes(&json!({ "back": { "ticks": 50 } }), 100);
    window.goes(&json!({ "step": { "ticks": 10 } }), 110);
    window.send(&json!({ "do": { "silence": { "at": "memory" } } }));
    let told = branches(&mut window, 1);
    assert_eq!(told["all"], json!([{ "id": 1, "parted": 110, "end": 150, "changes": 0 }]));
    window.goes(&json!({ "step": { "ticks": 60 } }), 170);
    window.send(&json!({ "branch": { "id": 1 } }));
    let told = branches(&mut window, 1);
    window.stands_at(150);
    assert_eq!((&told["turns"], &told["last"]), (&json!(1), &json!(1)));
    assert_eq!(told["all"], json!([{ "id": 1, "parted": 110, "end": 170, "changes": 1 }]));
    window.send(&json!({ "branch": { "id": 9 } }));
    assert_eq!(window.answer("refused"), json!("there is no branch 9"));
    // At most four are kept.
    for at in 1..=5_u64 {
        window.goes(&json!({ "step": { "ticks": 10 } }), 160);
        window.goes(&json!({ "back": { "ticks": 10 } }), 150);
        window.send(&json!({ "do": { "noise": { "scale": at as f64 } } }));
        let told = branches(&mut window, (at as usize + 1).min(4));
        assert_eq!(told["all"].as_array().unwrap().last().unwrap()["id"], json!(at + 1));
    }
    window.send(&json!({ "do": { "noise": { "scale": 1.0 } } }));
    window.goes(&json!({ "step": { "ticks": 1 } }), 151);
    let live = served.ended();
    assert_eq!(live.made().len(), 6);
    assert!(live.sim().checkpoint().unwrap() == alone(151));
}

/// Reads until so many branches are told.
fn branches(window: &mut Window, count: usize) -> serde_json::Value {
    loop {
        let told = window.answer("branches");
        if told["all"].as_array().map(Vec::len) == Some(count) {
            return told;
        }
    }
}

#[test]
fn a_memory_silenced_by_hand_gives_the_wrong_decision_and_its_file_repeats_it() {
    let log = {
        let served = served(spiking());
        let mut window = served.window();
        window.goes(&json!({ "step": { "ticks": 120 } }), 120);
        window.send(&json!({ "do": { "silence": { "at": "memory" } } }));
        window.goes(&json!({ "step": { "ticks": 280 } }), 400);
        window.send(&json!({ "log": {} }));
        let text = window.answer("saved").as_str().unwrap().to_owned();
        let live = served.ended();
        assert_eq!(choice(&live), "TAKE_BOLT");
        let log = InterventionLog::parse(&text).unwrap();
        assert_eq!(log, live.log());
        let mut repeated = Live::new(spiking(), LiveOptions::default()).unwrap();
        repeated.follow(&log).unwrap();
        repeated.step(400).unwrap();
        assert!(repeated.sim().checkpoint().unwrap() == live.sim().checkpoint().unwrap());
        log
    };
    let silence = Intervention::Silence { at: "memory".into() };
    assert_eq!(
        log.entries().iter().map(|entry| (entry.tick, &entry.what)).collect::<Vec<_>>(),
        [(120, &silence)]
    );
    let mut usual = Live::new(spiking(), LiveOptions::default()).unwrap();
    usual.step(400).unwrap();
    assert_eq!(choice(&usual), "TAKE_NUT");
}

#[test]
fn a_gate_that_is_opened_by_hand_acts_as_the_ablation_without_it_and_one_that_is_shut_does_not_act()
{
    let domain = DomainBuilder::of_the_paper().build().unwrap();
    let planner = |without| {
        let spec = PlannerSpec { without, ..PlannerSpec::default() };
        Planner::new(&domain, spec, Seed::new(1)).unwrap()
    };
    let world = domain.world(["NUT_ON_TABLE", "BOLT_ON_TABLE"]).unwrap();
    let goal = domain.state("BOLT_ASSEMBLED").unwrap();
    let within = SimDuration::from_millis(400);
    let (whole, ablated) = (planner(None), planner(Some(Part::Gate)));
    let [usual, wrong] =
        [&whole, &ablated].map(|planner| planner.first_shown(&world, goal, within).unwrap());
    let named = |shown: Option<(ActionId, f64)>| &*domain[shown.unwrap().0].name;
    assert_eq!((named(usual), named(wrong)), ("PUT_NUT_IN_JIG", "ASSEMBLE"));
    let start = || whole.simulator(&world, goal).unwrap();
    // The tick at which an action is first shown, and its number.
    let shown = |live: &mut Live| {
        let of = live.sim().graph().output("planner.actions").unwrap();
        for tick in 1..=400_u16 {
            live.step(1).unwrap();
            let first = live.sim().value_of(of).iter().position(|active| *active > 0.5);
            if let Some(action) = first {
                return Some((ActionId::new(action), f64::from(tick)));
            }
        }
        None
    };
    let outline = start().graph().outline();
    let gate = outline.nodes.iter().flat_map(|node| &node.outputs).map(|output| &output.name);
    let act = gate.into_iter().find(|name| name.ends_with("executive.act")).unwrap();
    let cases = [
        (json!({ "clamp": { "output": act, "values": [1.0] } }), wrong),
        (json!({ "silence": { "at": "planner/motor_gate" } }), None),
    ];
    for (by_hand, expected) in cases {
        let served = served(start());
        let mut window = served.window();
        window.send(&json!({ "do": by_hand }));
        window.goes(&json!({ "step": { "ticks": 400 } }), 400);
        let live = served.ended();
        let log = InterventionLog::parse(&live.log().to_string()).unwrap();
        let mut again = Live::new(start(), LiveOptions::default()).unwrap();
        again.follow(&log).unwrap();
        assert_eq!(shown(&mut again), expected, "{by_hand}");
        again.seek(400).unwrap();
        assert!(again.sim().checkpoint().unwrap() == live.sim().checkpoint().unwrap());
    }
}

#[test]
fn a_run_that_can_go_back_less_far_than_to_its_start_says_so() {
    let mut view = View::bind().unwrap();
    let (port, token) = parts(view.address());
    let room = 3 * spiking().checkpoint().unwrap().bytes();
    let run = std::thread::spawn(move || {
        let options = LiveOptions { memory_bytes: room, spacing_ticks: 10 };
        let mut live = Live::new(spiking(), options).unwrap();
        let stop = |_: SimView<'_>| ControlFlow::Continue(());
        // A branch begins later than its run, and so does what it can go back to.
        live.step(100).unwrap();
        let mark = live.mark().unwrap();
        let config = RunConfig::seeded(Seed::new(1));
        let mut branch = live.branch(&mark, config, options).unwrap();
        assert_eq!(view.drive(&mut branch, stop).unwrap(), Driven::Ended);
        branch.memory_bytes()
    });
    let mut window = Window::opened(port, &token);
    window.send(&json!({ "step": { "ticks": 300 } }));
    assert_eq!(window.stands_at(400).0.earliest, 100.0);
    window.send(&json!({ "back": { "ticks": 350 } }));
    let said = window.answer("refused");
    let expected = "the run can go back to tick 100 at the earliest, not to tick 50";
    assert_eq!(said, json!(expected));
    window.goes(&json!({ "seek": { "tick": 100 } }), 100);
    window.send(&json!({ "end": {} }));
    assert!(run.join().unwrap() <= room);
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_under_the_log_is_told_at_once_and_the_run_goes_on() {
    let mut view = View::bind().unwrap().with_log(std::path::Path::new("/dev/full")).unwrap();
    let (port, token) = parts(view.address());
    let run = std::thread::spawn(move || {
        let live = view.serve(Live::new(spiking(), LiveOptions::default()).unwrap()).unwrap();
        (live.tick(), view.log_fault().map(|fault| fault.kind()))
    });
    let mut window = Window::opened(port, &token);
    assert_eq!(window.answer("standing")["faults"], json!([]));
    window.send(&json!({ "do": { "silence": { "at": "memory" } } }));
    let faults = loop {
        let told = window.answer("standing")["faults"].clone();
        if told != json!([]) {
            break told;
        }
    };
    let said = faults[0].as_str().unwrap();
    assert!(said.starts_with("the log can no longer be written: No space left"), "{said}");
    window.goes(&json!({ "step": { "ticks": 20 } }), 20);
    window.send(&json!({ "end": {} }));
    assert_eq!(run.join().unwrap(), (20, Some(std::io::ErrorKind::StorageFull)));
}

#[test]
fn what_probes_record_is_streamed_and_goes_back_with_the_run() {
    let recorded = || {
        let mut graph = GraphBuilder::new();
        let wave = |time: f64, out: &mut [f32]| out[0] = (60.0 * time).sin() as f32;
        let wave = graph.add("wave", Signal::vector(1, wave));
        let layer = graph.add("layer", Ensemble::new(1).identity("x"));
        graph.connect(&wave, &layer.input, Synapse::lowpass_ms(5));
        graph.probe(&layer.output("x"), ProbeSpec::default());
        graph.probe_spikes("layer");
        let plan = PopulationPlan::lif();
        graph.start(&plan, Seed::new(1)).unwrap()
    };
    let folder = tempfile::tempdir().unwrap();
    let [one, two] = ["one", "two"].map(|name| folder.path().join(name));
    [&one, &two].iter().for_each(|folder| std::fs::create_dir(folder).unwrap());
    let sim = recorded();
    let view = View::bind().unwrap().with_recordings(RecordingFiles::create(&one, &sim).unwrap());
    let served = served_by(view, sim);
    let mut window = served.window();
    window.goes(&json!({ "step": { "ticks": 1_500 } }), 1_500);
    window.goes(&json!({ "back": { "ticks": 700 } }), 800);
    window.goes(&json!({ "step": { "ticks": 30 } }), 830);
    window.goes(&json!({ "back": { "ticks": 10 } }), 820);
    window.goes(&json!({ "step": { "ticks": 1_300 } }), 2_120);
    let live = served.ended();
    let kept = live.sim().recordings().values().map(|(_, samples)| samples.len()).sum::<usize>();
    assert_eq!(kept, 0, "memory is free");
    let mut alone = recorded();
    let mut files = RecordingFiles::create(&two, &alone).unwrap();
    alone.run_for(SimDuration::from_millis(2_120)).unwrap();
    files.take(&mut alone).unwrap();
    let read = |folder: &std::path::Path| {
        let files = std::fs::read_dir(folder).unwrap().map(|file| file.unwrap().path());
        let mut files: Vec<_> = files.collect();
        files.sort();
        files.iter().map(|file| std::fs::read(file).unwrap()).collect::<Vec<_>>()
    };
    let (watched, alone) = (read(&one), read(&two));
    assert_eq!(watched.len(), 4);
    assert!(watched.iter().all(|file| file.len() > 1_000));
    assert!(watched == alone);
}

#[test]
fn a_goal_is_typed_as_an_expression_and_noise_and_releases_are_logged() {
    let served = served(spiking());
    let mut window = served.window();
    window.goes(&json!({ "step": { "ticks": 200 } }), 200);
    window.send(
        &json!({ "point": { "output": "request.out", "to": "BOLT - 0.5 * NUT", "how": "set" } }),
    );
    window.send(&json!({ "point": { "output": "vision.out", "to": "0", "how": "clamp" } }));
    window.send(&json!({ "do": { "noise": { "scale": 0.5 } } }));
    window.goes(&json!({ "step": { "ticks": 100 } }), 300);
    window.send(&json!({ "do": { "release": { "at": "vision" } } }));
    window.goes(&json!({ "step": { "ticks": 1 } }), 301);
    let live = served.ended();
    let names: Vec<String> = live.made().iter().map(|entry| format!("{:?}", entry.what)).collect();
    let kinds: Vec<&str> =
        names.iter().map(|name| name.split([' ', '{']).next().unwrap()).collect();
    assert_eq!(kinds, ["Set", "Clamp", "Noise", "Release"]);
    let memory = live.sim().value_of(live.sim().graph().output("memory.output").unwrap());
    let vocabulary =
        symbolt::spa::OutputVocabulary::of(live.sim().graph(), "memory.output").unwrap();
    let bolt = symbolt::spa::dot(memory, &vocabulary.parse("BOLT").unwrap());
    assert!(bolt > 0.3, "the memory has taken up the typed goal: {bolt}");
}

#[test]
fn a_step_ends_where_another_graph_begins() {
    let mut view = View::bind().unwrap();
    let (port, token) = parts(view.address());
    let run = std::thread::spawn(move || {
        let live = || Live::new(spiking(), LiveOptions::default()).unwrap();
        let stop = |view: SimView<'_>| match view.tick() >= 5 {
            true => ControlFlow::Break(StopReason::Condition("compiled anew")),
            false => ControlFlow::Continue(()),
        };
        assert!(matches!(view.drive(&mut live(), stop).unwrap(), Driven::Stopped(_)));
        let mut second = live();
        let going = |_: SimView<'_>| ControlFlow::Continue(());
        assert_eq!(view.drive(&mut second, going).unwrap(), Driven::Ended);
        second.tick()
    });
    let mut window = Window::opened(port, &token);
    window.send(&json!({ "step": { "ticks": 1_000 } }));
    window.answer("hello");
    window.stands_at(0);
    window.send(&json!({ "end": {} }));
    assert_eq!(run.join().unwrap(), 0);
}

#[test]
fn a_read_only_run_starts_with_its_first_window_and_is_over_without_one() {
    let mut view = View::bind_read_only().unwrap();
    let (port, token) = parts(view.address());
    let (tell, told) = std::sync::mpsc::channel();
    let run = std::thread::spawn(move || {
        let mut live = Live::new(spiking(), LiveOptions::default()).unwrap();
        let stop = |view: SimView<'_>| match view.tick() >= 20 {
            true => ControlFlow::Break(StopReason::Condition("done")),
            false => ControlFlow::Continue(()),
        };
        assert!(matches!(view.drive(&mut live, stop).unwrap(), Driven::Stopped(_)));
        tell.send(live.tick()).unwrap();
        view.hold(&mut live, "done").unwrap()
    });
    std::thread::sleep(std::time::Duration::from_millis(300));
    assert!(told.try_recv().is_err(), "nobody looks yet");
    let mut window = Window::opened(port, &token);
    assert_eq!(told.recv().unwrap(), 20);
    while window.frame().0.mode != 2 {}
    assert!(!run.is_finished(), "a window is open");
    drop(window);
    assert_eq!(run.join().unwrap(), Driven::Ended);
}

#[test]
fn ten_windows_watch_and_the_eleventh_is_told_why_not() {
    let served = served(spiking());
    let mut windows: Vec<_> = (0..10).map(|_| served.window()).collect();
    for (key, window) in windows.iter_mut().enumerate() {
        let what = json!({ "values": { "output": "memory.output", "count": key + 1 } });
        window.send(&json!({ "plot": { "key": key, "what": what } }));
        window.answer("plotted");
    }
    let mut eleventh = served.unknown();
    eleventh.send(&json!({ "token": served.token }));
    assert_eq!(eleventh.closed(), "ten windows are open already");
    windows[0].send(&json!({ "step": { "ticks": 30 } }));
    for (key, window) in windows.iter_mut().enumerate() {
        // Each is sent its own plot alone.
        let (_, bytes) = window.stands_at(30);
        assert_eq!(bytes[2..4], [1, 0]);
        let (ticks, values) = samples(&bytes);
        assert!(!ticks.is_empty() && values.len() == ticks.len() * (key + 1));
    }
    windows.pop();
    drop(eleventh);
    std::thread::sleep(std::time::Duration::from_millis(300));
    served.window().stands_at(30);
    windows.pop();
    std::thread::sleep(std::time::Duration::from_millis(300));
    assert_eq!(served.ended().tick(), 30);
}

#[test]
fn a_window_that_does_not_read_costs_the_run_nothing() {
    let served = served(spiking());
    let mut stalled = served.window();
    for key in 0..16 {
        let what = json!({ "values": { "output": "memory.output", "count": 64 } });
        stalled.send(&json!({ "plot": { "key": key, "what": what } }));
    }
    // From here on it reads nothing.
    let mut window = served.window();
    window.send(&json!({ "run": {} }));
    let mut seen = 0;
    let mut frames = 0;
    while seen < 3_000 {
        let (frame, _) = window.frame();
        seen = frame.tick as u64;
        frames += 1;
    }
    assert!(frames > 3, "{frames} frames");
    window.send(&json!({ "pause": {} }));
    drop(stalled);
    let live = served.ended();
    assert!(live.sim().checkpoint().unwrap() == alone(live.tick()));
}
