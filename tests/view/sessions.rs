//! Sessions: steps, plots, changes and the way back, with the bits of a run that nobody watches.

use std::ops::ControlFlow;

use serde_json::json;
use symbolt::prelude::*;
use symbolt::sim::{
    Checkpoint, Intervention, InterventionLog, Live, LiveOptions, SimView, StopReason,
};
use symbolt::view::{Driven, View};

use crate::model::{CHOICES, model};
use crate::window::{Window, parts, samples, served};

fn spiking() -> Simulator {
    model(&PopulationPlan::all(Population::Lif(LifSpec::default())), 64).unwrap()
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
    let bytes = window.goes(&json!({ "step": { "ticks": 50 } }), 50);
    let (ticks, neurons) = samples(&bytes);
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
    let there = window.goes(&json!({ "step": { "ticks": 170 } }), 170);
    let back = window.goes(&json!({ "back": { "ticks": 60 } }), 110);
    assert_ne!(samples(&there).1, samples(&back).1);
    assert_eq!(samples(&back).0, [110.0], "no sample of the run's future is left");
    let again = window.goes(&json!({ "step": { "ticks": 60 } }), 170);
    let last = |bytes: &[u8]| samples(bytes).1.last_chunk::<3>().unwrap().map(f32::to_bits);
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
    let mut eleventh = served.unknown();
    eleventh.send(&json!({ "token": served.token }));
    assert_eq!(eleventh.closed(), "ten windows are open already");
    windows[0].goes(&json!({ "step": { "ticks": 30 } }), 30);
    for window in &mut windows[1..] {
        window.stands_at(30);
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
