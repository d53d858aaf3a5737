//! Live runs: going back and on, branches, logs, commands, and bounded memory.

use std::ops::ControlFlow;

use rand::RngExt;
use symbolt::prelude::*;
use symbolt::sim::{
    CommandError, Intervention, InterventionError, InterventionLog, Live, LiveError, LiveOptions,
    LogError, Logged, SimError, StopReason,
};

use crate::counter::{Counter, MS, build, start};
use crate::touched::Touched;

fn silence(at: &str) -> Intervention {
    Intervention::Silence { at: at.into() }
}

fn release(at: &str) -> Intervention {
    Intervention::Release { at: at.into() }
}

/// Few checkpoints, at short distances.
fn tight() -> LiveOptions {
    LiveOptions { memory_bytes: 400_000, spacing_ticks: 7 }
}

/// Runs a model straight on, with interventions drawn at random. Returns the run.
fn straight(model: &Touched, seed: u64) -> Live {
    let rng = &mut Seed::new(seed).rng();
    let mut live = Live::new(model.start(1), tight()).unwrap();
    for _ in 0..6 {
        live.step(rng.random_range(0..25)).unwrap();
        for _ in 0..3 {
            match live.intervene(model.intervention(rng)) {
                Ok(()) | Err(LiveError::Intervention(InterventionError::NothingHeld { .. })) => {}
                Err(error) => panic!("{error}"),
            }
        }
    }
    live.step(20).unwrap();
    live
}

#[test]
fn back_and_on_has_the_bits_of_straight_on() {
    let mut made = 0;
    for seed in 0..12 {
        let mode = ["exact", "rate", "spiking"][seed as usize % 3];
        let model = Touched::new(seed, mode);
        let expected = straight(&model, seed);
        let end = expected.tick();
        let log = expected.log();
        made += log.entries().len();
        // From the text of its log, on other threads, with leaps back and forth.
        let text = log.to_string();
        let read = InterventionLog::parse(&text).unwrap();
        assert_eq!(read, log);
        let mut live = Live::new(model.start(1 + seed as usize % 3), tight()).unwrap();
        live.follow(&read).unwrap();
        let rng = &mut Seed::new(seed + 100).rng();
        for _ in 0..8 {
            live.seek(rng.random_range(0..end + 1)).unwrap();
        }
        live.seek(end).unwrap();
        assert_eq!(live.log(), log, "{seed}");
        assert!(live.ahead().is_empty());
        assert!(model.bits(live.sim()) == model.bits(expected.sim()), "{mode}, {seed}");
        // Nothing was watched or kept here.
        let mut sim = model.start(1);
        for Logged { tick, what } in log.entries() {
            sim.run_for(MS(tick - sim.tick())).unwrap();
            sim.intervene(what).unwrap();
        }
        sim.run_for(MS(end - sim.tick())).unwrap();
        assert!(model.bits(&sim) == model.bits(expected.sim()), "{mode}, {seed}, unwatched");
    }
    assert!(made > 60, "{made} interventions");
}

#[test]
fn a_log_that_lacks_a_line_or_shifts_it_gives_other_bits() {
    let model = Touched::new(2, "spiking");
    let mut live = Live::new(model.start(1), tight()).unwrap();
    live.step(30).unwrap();
    live.intervene(silence("cells")).unwrap();
    live.step(30).unwrap();
    live.intervene(release("cells")).unwrap();
    live.step(30).unwrap();
    let log = live.log();
    let bits = |entries: Vec<Logged>| {
        let mut live = Live::new(model.start(1), tight()).unwrap();
        live.follow(&InterventionLog::new(entries).unwrap()).unwrap();
        live.seek(90).unwrap();
        model.bits(live.sim())
    };
    let whole = log.entries().to_vec();
    assert!(bits(whole.clone()) == model.bits(live.sim()));
    let mut late = whole.clone();
    late[1].tick += 1;
    assert!(bits(late) != bits(whole.clone()));
    assert!(bits(whole[..1].to_vec()) != bits(whole));
}

#[test]
fn a_new_intervention_takes_the_place_of_those_ahead() {
    let model = Touched::new(1, "exact");
    let mut live = Live::new(model.start(1), tight()).unwrap();
    live.step(20).unwrap();
    live.intervene(silence("goal")).unwrap();
    live.step(20).unwrap();
    live.intervene(silence("hiss")).unwrap();
    live.step(20).unwrap();
    live.back(30).unwrap();
    assert_eq!((live.tick(), live.log().entries().len(), live.ahead().len()), (30, 1, 1));
    live.intervene(silence("wave")).unwrap();
    assert_eq!((live.log().entries().len(), live.ahead().len()), (2, 0));
    live.step(40).unwrap();
    let mut fresh = Live::new(model.start(2), tight()).unwrap();
    fresh.follow(&live.log()).unwrap();
    fresh.seek(70).unwrap();
    assert!(model.bits(fresh.sim()) == model.bits(live.sim()));
    // An intervention at the tick to which a run goes back is in force there.
    live.seek(30).unwrap();
    assert_eq!(live.log().entries().len(), 2);
}

#[test]
fn a_mark_of_one_run_is_not_reached_on_the_path_of_another() {
    let model = Touched::new(3, "exact");
    let mut live = Live::new(model.start(1), tight()).unwrap();
    live.step(10).unwrap();
    let (own, state) = (live.mark().unwrap(), live.sim().checkpoint().unwrap());
    let mut other = model.start(1);
    other.intervene(&silence("goal")).unwrap();
    let mut other = Live::new(other, tight()).unwrap();
    other.step(5).unwrap();
    let foreign = other.mark().unwrap();
    live.return_to(&foreign).unwrap();
    live.step(15).unwrap();
    live.return_to(&own).unwrap();
    // What was passed on the other path is no past of this one.
    assert_eq!(live.earliest(), 10);
    assert_eq!(live.seek(7).unwrap_err(), LiveError::TooFarBack { asked: 7, earliest: 10 });
    assert!(live.sim().checkpoint().unwrap() == state);
}

#[test]
fn branches_go_on_independently() {
    for mode in ["exact", "rate", "spiking"] {
        let model = Touched::new(4, mode);
        let mut live = Live::new(model.start(2), tight()).unwrap();
        live.step(25).unwrap();
        live.intervene(silence("goal")).unwrap();
        live.step(8).unwrap();
        let mark = live.mark().unwrap();
        assert_eq!((mark.tick(), mark.log().len()), (33, 1));
        let mut branch = live.branch(&mark, model.config(1), tight()).unwrap();
        assert_eq!((branch.tick(), branch.earliest()), (33, 33));
        let state = |live: &Live| live.sim().checkpoint().unwrap();
        live.step(10).unwrap();
        branch.intervene(silence("cells")).unwrap();
        branch.step(10).unwrap();
        assert!(state(&live) != state(&branch), "{mode}");
        let (live_at, branch_at) = (state(&live), state(&branch));
        live.step(10).unwrap();
        // Each has the bits of a run that follows its log.
        for (log, expected) in [(live.log(), live_at), (branch.log(), branch_at.clone())] {
            let mut fresh = Live::new(model.start(1), tight()).unwrap();
            fresh.follow(&log).unwrap();
            fresh.seek(43).unwrap();
            assert!(state(&fresh) == expected, "{mode}");
        }
        assert_eq!(branch.log().entries().len(), 2);
        branch.step(10).unwrap();
        branch.back(10).unwrap();
        assert!(state(&branch) == branch_at);
        let refused = branch.seek(32).unwrap_err();
        assert_eq!(refused, LiveError::TooFarBack { asked: 32, earliest: 33 });
        // A mark may be returned to from another path, and from another run.
        let other = branch.mark().unwrap();
        branch.return_to(&mark).unwrap();
        branch.step(10).unwrap();
        live.return_to(&other).unwrap();
        assert!(state(&live) == branch_at);
        live.return_to(&mark).unwrap();
        live.step(10).unwrap();
        assert!(state(&live) == state(&branch));
        assert_eq!(live.log(), branch.log());
    }
}

#[test]
fn rewound_searches_leave_no_trace() {
    let model = Touched::new(5, "spiking");
    let mut live = Live::new(model.start(1), tight()).unwrap();
    live.intervene(silence("wave")).unwrap();
    live.step(40).unwrap();
    let mark = live.mark().unwrap();
    for at in ["goal", "hiss", "cells", "post"] {
        live.return_to(&mark).unwrap();
        live.intervene(silence(at)).unwrap();
        live.step(15).unwrap();
    }
    live.return_to(&mark).unwrap();
    assert_eq!(live.log().entries().len(), 1);
    live.step(15).unwrap();
    let mut fresh = model.start(1);
    fresh.intervene(&silence("wave")).unwrap();
    fresh.run_for(MS(55)).unwrap();
    assert!(model.bits(live.sim()) == model.bits(&fresh));
}

#[test]
fn the_memory_of_checkpoints_is_bounded_and_reaches_back_to_the_start() {
    let model = Touched::new(3, "spiking");
    let one = model.start(1).checkpoint().unwrap().bytes();
    let most = 12 * one;
    let options = LiveOptions { memory_bytes: most, spacing_ticks: 4 };
    let mut live = Live::new(model.start(1), options).unwrap();
    let (mut at_100, mut at_1990) = (None, None);
    for tick in 1..=2_000 {
        live.step(1).unwrap();
        assert!(live.memory_bytes() <= most && live.memory_bytes() > 0);
        if tick == 100 {
            at_100 = live.sim().checkpoint().ok();
        }
        if tick == 1_990 {
            at_1990 = live.sim().checkpoint().ok();
        }
    }
    // Nearly full, and the distance between checkpoints grows with their age: 2,000 ticks are 500 spacings.
    assert!(live.memory_bytes() > most * 2 / 3);
    assert_eq!(live.earliest(), 0);
    live.seek(1_990).unwrap();
    assert!(live.sim().checkpoint().ok() == at_1990);
    live.seek(100).unwrap();
    assert!(live.sim().checkpoint().ok() == at_100);
    assert!(live.memory_bytes() <= most);
}

#[test]
fn a_ring_without_room_says_how_far_back_it_reaches() {
    let model = Touched::new(3, "exact");
    let options = LiveOptions { memory_bytes: 100, ..LiveOptions::default() };
    let mut live = Live::new(model.start(1), options).unwrap();
    live.step(120).unwrap();
    assert_eq!((live.memory_bytes(), live.earliest()), (0, 120));
    let refused = live.back(20).unwrap_err();
    assert_eq!(
        refused.to_string(),
        "the run can go back to tick 120 at the earliest, not to tick 100"
    );
    // A run taken later can go back to where it was taken.
    let mut sim = model.start(1);
    sim.run_for(MS(10)).unwrap();
    let mut live = Live::new(sim, LiveOptions::default()).unwrap();
    live.step(5).unwrap();
    assert_eq!(live.seek(9), Err(LiveError::TooFarBack { asked: 9, earliest: 10 }));
    assert!(matches!(live.back(99), Err(LiveError::TooFarBack { earliest: 10, .. })));
    assert_eq!(live.tick(), 15);
    live.seek(10).unwrap();
}

#[test]
fn run_until_stops_as_the_simulator_does_and_shows_checkpoints() {
    let mut graph = GraphBuilder::new();
    let counter = graph.node("counter", Counter);
    let graph = build(graph);
    let now = counter.output::<symbolt::sim::Scalar>("now");
    let mut live = Live::new(start(&graph), LiveOptions::default()).unwrap();
    let mut seen = None;
    let ended = live.run_until(MS(200), |view| {
        if view.value(&now)[0] < 70.0 {
            return ControlFlow::Continue(());
        }
        seen = Some(view.checkpoint().expect("between ticks"));
        ControlFlow::Break(StopReason::Condition("counted"))
    });
    let ended = ended.unwrap();
    assert_eq!((ended.reason, ended.ticks), (StopReason::Condition("counted"), 61));
    assert!(seen == live.sim().checkpoint().ok());
    let ended = live.run_until(MS(5), |_| ControlFlow::Break(StopReason::TimeUp)).unwrap();
    assert_eq!((ended.reason, ended.ticks), (StopReason::TimeUp, 1));
    assert_eq!(live.step(7).unwrap().ticks, 7);
}

#[test]
fn a_failed_run_goes_back_and_can_be_saved_by_a_clamp() {
    let mut graph = GraphBuilder::new();
    let one = graph.add("one", Constant::scalar(1e38));
    let sum = graph.add("sum", Add::scalar());
    graph.connect(&one, &sum.input, Synapse::lowpass_ms(5));
    graph.connect(&sum.output, &sum.input, Synapse::delay_ms(1));
    let mut live = Live::new(start(&build(graph)), tight()).unwrap();
    let failed = live.step(50).unwrap_err();
    assert!(failed.to_string().contains("became inf"), "{failed}");
    let tick = live.tick();
    assert!(matches!(live.step(1), Err(LiveError::Sim(SimError::Interrupted { .. }))));
    assert!(live.mark().is_err());
    live.back(2).unwrap();
    assert_eq!(live.tick(), tick - 2);
    live.intervene(silence("sum")).unwrap();
    live.step(50).unwrap();
    assert_eq!(live.sim().value(&sum.output)[0], 0.0);
}

#[test]
fn commands_of_other_threads_are_made_between_ticks_and_logged() {
    let model = Touched::new(6, "exact");
    let mut live = Live::new(model.start(2), LiveOptions::default()).unwrap();
    let commands = live.commands();
    commands.send(silence("goal")).unwrap();
    commands.send(silence("gaol")).unwrap();
    live.step(10).unwrap();
    assert_eq!(live.log().entries(), [Logged { tick: 0, what: silence("goal") }]);
    let refused = live.take_refused();
    assert_eq!((refused.len(), refused[0].tick), (1, 0));
    let why = refused[0].error.to_string();
    assert!(why.starts_with("the graph has no output, node or module `gaol`"), "{why}");
    assert!(live.take_refused().is_empty());
    // A flood, while the run goes on.
    let flood = std::thread::spawn({
        let commands = commands.clone();
        move || {
            let send = |index: u64| {
                let scale = index as f32;
                commands.send(Intervention::Noise { at: None, scale })
            };
            (0..50_000).filter(|index| send(*index).is_ok()).count()
        }
    });
    let mut steps = 0;
    while !flood.is_finished() || steps == 0 {
        live.step(1).unwrap();
        steps += 1;
    }
    let sent = flood.join().unwrap();
    while live.log().entries().len() < 1 + sent {
        live.step(1).unwrap();
    }
    assert!(sent >= 1_024);
    // They wait for a run that is not stepped, up to a limit; and going back does not take them.
    let full = (0..2_000).map(|_| commands.send(silence("hiss"))).find_map(Result::err);
    assert_eq!(full, Some(CommandError::Full));
    let (tick, made) = (live.tick(), live.log().entries().len());
    live.seek(tick.saturating_sub(3)).unwrap();
    assert!(live.log().entries().len() <= made);
    let end = live.tick();
    live.step(20).unwrap();
    let log = live.log();
    // A flood is made a few commands a tick.
    for tick in end..end + 16 {
        let now = log.entries().iter().filter(|logged| logged.tick == tick);
        let now: Vec<_> = now.map(|logged| &logged.what).collect();
        assert!(now.len() >= 64 && now.ends_with(&[&silence("hiss"); 64]), "{tick}: {}", now.len());
    }
    assert!(log.entries().last().is_some_and(|logged| logged.tick == end + 15));
    let mut fresh = Live::new(model.start(1), LiveOptions::default()).unwrap();
    fresh.follow(&log).unwrap();
    fresh.seek(live.tick()).unwrap();
    assert!(model.bits(fresh.sim()) == model.bits(live.sim()));
    drop(live);
    assert_eq!(commands.send(silence("hiss")), Err(CommandError::Ended));
}

#[test]
fn bad_logs_are_refused_with_their_line() {
    let refused = |text: &str| InterventionLog::parse(text).unwrap_err().to_string();
    let good = "{\"tick\":3,\"do\":{\"silence\":{\"at\":\"goal\"}}}\n";
    for cut in 1..good.len() {
        let error = refused(&good[..cut]);
        assert_eq!(error, "line 1 is cut: the last line of a log ends with a line break");
    }
    assert!(InterventionLog::parse("").unwrap().entries().is_empty());
    let cases = [
        ("\n", "line 2, column 0 is no intervention: EOF while parsing a value"),
        ("{}\n", "line 2, column 2 is no intervention: missing field `tick`"),
        (
            "{\"tick\":4,\"do\":{\"silense\":{\"at\":\"goal\"}}}\n",
            "line 2, column 25 is no intervention: unknown variant `silense`, expected one of `clamp`, `silence`, \
             `release`, `set`, `noise`, `world`",
        ),
        (
            "{\"tick\":4,\"do\":{\"silence\":{\"at\":\"goal\",\"for\":2}}}\n",
            "line 2, column 44 is no intervention: unknown field `for`, expected `at`",
        ),
        (
            "{\"tick\":2,\"do\":{\"silence\":{\"at\":\"goal\"}}}\n",
            "intervention 2 belongs to tick 2, but the one before it to tick 3",
        ),
    ];
    for (line, expected) in cases {
        assert_eq!(refused(&format!("{good}{line}")), expected);
    }
    for number in ["-1", "1.5", "1e99", "18446744073709551616", "NaN", "\"3\""] {
        let line = good.replace('3', number);
        assert!(refused(&line).starts_with("line 1, column"), "{number}");
    }
    let nan = "{\"tick\":3,\"do\":{\"clamp\":{\"output\":\"goal.out\",\"values\":[NaN,0]}}}\n";
    assert!(refused(nan).starts_with("line 1, column"));
    let large = nan.replace("NaN", "1e39");
    assert_eq!(refused(&large), "line 1, column 59 is no intervention: number out of range");
    let deep = format!("{{\"tick\":3,\"do\":{}\n", "[".repeat(100_000));
    assert!(refused(&deep).starts_with("line 1, column"));
    let file = std::env::temp_dir().join(format!("symbolt-live-{}.jsonl", std::process::id()));
    std::fs::write(&file, [good.as_bytes(), &[0xff, b'\n']].concat()).unwrap();
    let error = InterventionLog::read(&file).unwrap_err();
    assert_eq!(error.to_string(), "line 2, column 1 is no intervention: it is not UTF-8");
    std::fs::write(&file, good.repeat(3)).unwrap();
    assert_eq!(InterventionLog::read(&file).unwrap().entries().len(), 3);
    std::fs::remove_file(&file).unwrap();
    assert!(matches!(InterventionLog::read(&file), Err(LogError::File(_))));
}

#[test]
fn logs_that_do_not_fit_the_run_are_refused_before_it_goes_on() {
    let model = Touched::new(3, "exact");
    let mut live = Live::new(model.start(1), LiveOptions::default()).unwrap();
    live.step(5).unwrap();
    let before = live.sim().checkpoint().unwrap();
    let mut refused = |lines: &[&str]| {
        let text: String = lines.iter().map(|line| format!("{{{line}}}\n")).collect();
        let log = InterventionLog::parse(&text).unwrap();
        live.follow(&log).unwrap_err().to_string()
    };
    let fine = "\"tick\":9,\"do\":{\"silence\":{\"at\":\"goal\"}}";
    let goal = |values: &str| {
        format!("\"tick\":9,\"do\":{{\"clamp\":{{\"output\":\"goal.out\",\"values\":{values}}}}}")
    };
    assert_eq!(
        refused(&["\"tick\":4,\"do\":{\"silence\":{\"at\":\"goal\"}}"]),
        "intervention 1 belongs to tick 4, but the run stands at tick 5"
    );
    assert_eq!(
        refused(&[fine, &goal("[1]")]),
        "intervention 2, at tick 9: `goal.out` takes 2 values, not 1"
    );
    let long = format!("[{}0]", "0,".repeat(200_000));
    assert!(refused(&[&goal(&long)]).contains("takes 2 values, not 200001"));
    assert_eq!(
        refused(&["\"tick\":9,\"do\":{\"noise\":{\"scale\":-1}}"]),
        "intervention 1, at tick 9: a noise scale of -1 is not usable; expected a finite number of at least 0"
    );
    let wrong = refused(&["\"tick\":9,\"do\":{\"silence\":{\"at\":\"m0/som\"}}"]);
    let expected = "intervention 1, at tick 9: the graph has no output, node or module `m0/som`; the most similar: `m0/sum`";
    assert!(wrong.starts_with(expected), "{wrong}");
    assert_eq!(
        refused(&[fine, "\"tick\":9,\"do\":{\"release\":{\"at\":\"wave\"}}"]),
        "intervention 2, at tick 9: nothing is clamped or silenced at `wave`; held are: `goal.out`"
    );
    let set =
        refused(&["\"tick\":9,\"do\":{\"set\":{\"output\":\"m0/sum.out\",\"values\":[0,0]}}"]);
    assert!(set.contains("can be clamped but not set; sources are: `"), "{set}");
    assert!(live.ahead().is_empty() && live.log().entries().is_empty());
    assert!(live.sim().checkpoint().unwrap() == before);
}

#[test]
fn a_log_has_a_limit_and_says_so() {
    let mut graph = GraphBuilder::new();
    let goal = graph.add("goal", Constant::vector(&[0.0; 2_000]));
    graph.probe(&goal, ProbeSpec::default());
    let run = || Live::new(start_of(&graph), LiveOptions { memory_bytes: 0, ..tight() }).unwrap();
    let full = |live: &mut Live, what: Intervention| match live.intervene(what) {
        Err(LiveError::Intervention(error @ InterventionError::LogFull { .. })) => {
            error.to_string()
        }
        other => panic!("{other:?}"),
    };
    let mut live = run();
    for _ in 0..100_000 {
        live.intervene(silence("goal")).unwrap();
    }
    let said = "the log is full: it holds at most 100000 interventions, with 2000000 values in all";
    assert_eq!(full(&mut live, silence("goal")), said);
    assert_eq!(live.made().len(), 100_000);
    let set = || Intervention::Set { output: "goal.out".into(), values: vec![1.0; 2_000] };
    let mut live = run();
    for _ in 0..1_000 {
        live.intervene(set()).unwrap();
    }
    assert_eq!(full(&mut live, set()), said);
    // What has no values still fits.
    live.intervene(silence("goal")).unwrap();
}

fn start_of(graph: &GraphBuilder) -> Simulator {
    graph.start(&PopulationPlan::direct(), Seed::new(1)).unwrap()
}
