//! Memories, selections and rules.

use symbolt::neurons::SelectRule;
use symbolt::prelude::*;
use symbolt::sim::{PointerRef, Real};
use symbolt::spa::{GatedMemory, Selection};

use super::{Others, Words, like, mean, ms, run, smooth, words};

const NAMES: [&str; 4] = ["A", "B", "C", "D"];

#[test]
fn a_threshold_maps_between_vocabularies_of_two_sizes() {
    let (v, w) = (words::<Words>(64, 1, &NAMES), words::<Others>(32, 2, &NAMES));
    let rule = SelectRule::Threshold { level: 0.5 };
    let memory = AssociativeMemory::new(&v, &w, NAMES.map(|name| (name, name)), rule);
    let mut graph = GraphBuilder::new();
    let memory = graph.add("memory", memory.expect("sound"));
    let cue = v.stimulus([(0, "0.45 * A"), (100, "0.8 * B")]).expect("sound");
    let cue = graph.add("cue", cue);
    graph.route(&cue >> &memory);
    let probe = graph.probe(&memory.output, smooth(30));
    let sim = run(&graph, 300);
    for name in NAMES {
        assert!(like(&w, &sim, &probe, name, (50, 100)).abs() < 0.05, "{name}");
    }
    let found = like(&w, &sim, &probe, "B", (250, 300));
    assert!((found - 1.0).abs() < 0.1, "{found}");
    let others = ["A", "C", "D"].map(|name| like(&w, &sim, &probe, name, (250, 300)));
    assert!(others.iter().all(|found| found.abs() < 0.4), "{others:?}");
}

#[test]
fn of_two_similar_items_the_greater_wins() {
    let v = words::<Words>(64, 1, &NAMES);
    let mut graph = GraphBuilder::new();
    let rule = SelectRule::WinnerTakeAll { level: 0.3 };
    let memory = graph.add("memory", CleanupMemory::new(&v, NAMES, rule).expect("sound"));
    let cue = [(0, "A + 0.8 * B"), (200, "0"), (300, "0.8 * A + B")];
    let cue = graph.add("cue", v.stimulus(cue).expect("sound"));
    graph.route(&cue >> &memory);
    let selection = graph.add("selection", Selection::new(4, rule));
    let utilities = Stimulus::vector(&[1.0, 0.8, 0.0, 0.0]).from(ms(200), &[0.0; 4]);
    let utilities = graph.add("utilities", utilities.from(ms(300), &[0.8, 1.0, 0.0, 0.0]));
    graph.route(&utilities >> &selection.utilities);
    let probe = graph.probe(&memory.output, smooth(30));
    let items = graph.probe(&selection.items, smooth(30));
    let sim = run(&graph, 500);
    for (when, [winner, loser], at) in [((150, 200), ["A", "B"], 0), ((450, 500), ["B", "A"], 1)] {
        let [won, lost] = [winner, loser].map(|name| like(&v, &sim, &probe, name, when));
        assert!(won > 0.9 && won < 1.15 && lost < 0.2, "{winner}: {won} {lost}");
        let items = mean(&sim, &items, when);
        assert!(items[at] > 0.8 && items[1 - at] < 0.1, "{items:?}");
        assert!(items[2..].iter().all(|item| item.abs() < 0.1), "{items:?}");
    }
}

#[test]
fn accumulators_keep_their_choice_until_they_are_reset() {
    let v = words::<Words>(64, 1, &NAMES);
    let mut graph = GraphBuilder::new();
    let rule = SelectRule::IndependentAccumulators { level: 0.0, tau: ms(100) };
    let memory = graph.add("memory", CleanupMemory::new(&v, NAMES, rule).expect("sound"));
    let cue = [(0, "A + 0.8 * B"), (250, "0.6 * A + B")];
    let cue = graph.add("cue", v.stimulus(cue).expect("sound"));
    graph.route(&cue >> &memory);
    let reset = Stimulus::vector(&[0.0; 4]).from(ms(450), &[1.0; 4]).from(ms(650), &[0.0; 4]);
    let reset = graph.add("reset", reset);
    graph.route(&reset >> &memory.inhibit);
    let probe = graph.probe(&memory.output, smooth(30));
    let sim = run(&graph, 1000);
    let of = |when| ["A", "B"].map(|name| like(&v, &sim, &probe, name, when));
    for (when, held) in [((200, 250), 0), ((380, 440), 0), ((950, 1000), 1)] {
        let found = of(when);
        assert!(found[held] > 0.9 && found[1 - held] < 0.2, "{when:?}: {found:?}");
    }
    let silent = of((620, 650));
    assert!(silent.iter().all(|found| *found < 0.1), "{silent:?}");
}

#[test]
fn a_memory_has_an_answer_where_nothing_is_similar() {
    let v = words::<Words>(64, 1, &NAMES);
    let mut graph = GraphBuilder::new();
    let rule = SelectRule::Threshold { level: 0.5 };
    let memory = CleanupMemory::new(&v, NAMES, rule).expect("sound");
    let memory = graph.add("memory", memory.otherwise(v.get("D").expect("there")));
    let cue = graph.add("cue", v.stimulus([(0, "0.2 * A"), (250, "A")]).expect("sound"));
    graph.route(&cue >> &memory);
    let probe = graph.probe(&memory.output, smooth(30));
    let sim = run(&graph, 500);
    let of = |when| ["A", "D"].map(|name| like(&v, &sim, &probe, name, when));
    let (before, after) = (of((150, 250)), of((400, 500)));
    assert!(before[1] > 0.9 && before[0] < 0.15, "{before:?}");
    assert!(after[0] > 0.9 && after[1] < 0.15, "{after:?}");
}

#[test]
fn keys_and_values_may_be_expressions() {
    let (v, w) = (words::<Words>(64, 1, &NAMES), words::<Others>(64, 2, &NAMES));
    let rule = SelectRule::Threshold { level: 0.3 };
    let pairs = [("A", "C * D"), ("A * B", "C + D")];
    let mut graph = GraphBuilder::new();
    let memory = AssociativeMemory::new(&v, &w, pairs, rule).expect("sound");
    let memory = graph.add("memory", memory);
    let cue = graph.add("cue", v.stimulus([(0, "A"), (150, "A * B")]).expect("sound"));
    graph.route(&cue >> &memory);
    let probe = graph.probe(&memory.output, smooth(30));
    let sim = run(&graph, 300);
    let cosines = |at: usize| {
        let value = sim.samples(&probe).get(at).expect("there").1;
        ["C * D", "C + D"].map(|text| cosine(&value, &w.parse(text).expect("sound")))
    };
    let (first, second) = (cosines(148), cosines(298));
    assert!(first[0] > 0.9 && first[1] < 0.4, "{first:?}");
    assert!(second[1] > 0.9 && second[0] < 0.4, "{second:?}");
}

#[test]
fn utilities_are_thresholded_each_by_itself() {
    let mut graph = GraphBuilder::new();
    let utilities = graph.add("utilities", Constant::vector(&[0.8, 0.5, 0.1, -0.1]));
    let rules = [SelectRule::Threshold { level: 0.2 }, SelectRule::Graded { level: 0.2 }];
    let mut index = 0;
    let probes = rules.map(|rule| {
        index += 1;
        let selection = graph.add(&format!("selection{index}"), Selection::new(4, rule));
        graph.route(&utilities >> &selection.utilities);
        graph.probe(&selection.items, smooth(30))
    });
    let sim = run(&graph, 250);
    let [step, graded] = probes.map(|probe| mean(&sim, &probe, (200, 250)));
    assert!(step[..2].iter().all(|item| (item - 1.0).abs() < 0.1), "{step:?}");
    assert!((graded[0] - 0.8).abs() < 0.06 && (graded[1] - 0.5).abs() < 0.06, "{graded:?}");
    assert!(step[2..].iter().chain(&graded[2..]).all(|item| item.abs() < 1e-3));
}

#[test]
fn utilities_may_be_any_expression() {
    let names = ["A", "B", "C", "D", "E", "F", "G", "H", "CAT", "DOG", "PARROT", "MOUSE", "SHOOP"];
    let v = words::<Words>(64, 1, &names);
    let mut graph = GraphBuilder::new();
    let shown = [(0, "0"), (150, "CAT"), (300, "DOG * ~CAT"), (450, "PARROT"), (600, "MOUSE")];
    let shown = graph.add("shown", v.stimulus(shown).expect("sound"));
    let vision = graph.add("vision", State::new(&v));
    let motor = graph.add("motor", State::new(&v));
    let same = graph.add("same", symbolt::spa::Compare::new(&v));
    graph.route(&shown >> &vision);
    graph.route(Words::SHOOP >> &same.a);
    graph.route(Words::SHOOP >> &same.b);
    let same = &same.output;
    let cat = || vision.dot(Words::CAT);
    let rules = Rules::new()
        .rule("constant", 0.5, [Words::A >> &motor])
        .rule("dot", cat(), [Words::B >> &motor])
        .rule("bound", (&vision * Words::CAT).dot(Words::DOG), [Words::C >> &motor])
        .rule("scaled", 2.0 * vision.dot(0.5 * Words::CAT), [Words::D >> &motor])
        .rule("cancelled", cat() + 0.5 - cat(), [Words::E >> &motor])
        .rule("more", vision.dot(Words::PARROT) + same, [Words::F >> &motor])
        .rule("mean", 0.5 * vision.dot(Words::MOUSE) + 0.5 * same, [Words::G >> &motor])
        .rule("less", (vision.dot(Words::MOUSE) - same) * 0.5, [Words::H >> &motor])
        .rule("product", same * same, []);
    let rules = graph.add("rules", rules);
    assert_eq!(rules.names()[5], "more");
    let probe = graph.probe(&rules.utilities, smooth(30));
    let sim = run(&graph, 750);
    let bound = dot(&v.parse("DOG * ~CAT * CAT").expect("sound"), &v.get("DOG").expect("there"));
    // Of each of the five things shown, what each utility should be.
    let wanted: [[Real; 9]; 5] = [
        [0.5, 0.0, 0.0, 0.0, 0.5, 1.0, 0.5, -0.5, 1.0],
        [0.5, 1.0, 0.0, 1.0, 0.5, 1.0, 0.5, -0.5, 1.0],
        [0.5, 0.0, bound, 0.0, 0.5, 1.0, 0.5, -0.5, 1.0],
        [0.5, 0.0, 0.0, 0.0, 0.5, 2.0, 0.5, -0.5, 1.0],
        [0.5, 0.0, 0.0, 0.0, 0.5, 1.0, 1.0, 0.0, 1.0],
    ];
    for (part, wanted) in wanted.iter().enumerate() {
        let found = mean(&sim, &probe, (150 * part + 120, 150 * part + 150));
        let off = found.iter().zip(wanted).map(|(f, w)| (f - w).abs()).fold(0.0, Real::max);
        assert!(off < 0.25, "{part}: {found:?} instead of {wanted:?}");
    }
}

#[test]
fn rules_route_bind_and_invert() {
    // Three numbers are a pointer too: binding moves [0, 1, 0] and [0, 0, 1] to [1, 0, 0].
    let control = words::<Words>(32, 1, &["A", "B", "C"]);
    let buffers = VocabularyBuilder::<Others>::new(3, Seed::new(1)).any_similarity();
    let buffers = buffers
        .vector("B", &PointerRef::<Others>::from_raw(&[0.0, 1.0, 0.0]))
        .vector("C", &PointerRef::<Others>::from_raw(&[0.0, 0.0, 1.0]));
    let buffers = buffers.build().expect("sound");
    let mut graph = GraphBuilder::new();
    let shown = control.stimulus([(0, "A"), (200, "B"), (400, "C")]).expect("sound");
    let shown = graph.add("shown", shown);
    let ctrl = graph.add("ctrl", State::new(&control));
    graph.route(&shown >> &ctrl);
    let [first, second, third] =
        ["first", "second", "third"].map(|name| graph.add(name, State::new(&buffers)));
    graph.route(Others::B >> &first);
    graph.route(Others::C >> &second);
    let rules = Rules::new()
        .rule("one", ctrl.dot(Words::A), [&first >> &third])
        .rule("two", ctrl.dot(Words::B), [&second >> &third])
        .rule("both", ctrl.dot(Words::C), [&first * &second >> &third]);
    graph.add("rules", rules);
    let probe = graph.probe(&third.output, smooth(30));
    let sim = run(&graph, 600);
    for (part, place) in [(0, 1), (1, 2), (2, 0)] {
        let all: Vec<Vec<Real>> = (0..50)
            .map(|k| sim.samples(&probe).get(200 * part + 150 + k).unwrap().1.to_vec())
            .collect();
        for at in 0..3 {
            let mean = all.iter().map(|v| v[at]).sum::<Real>() / 50.0;
            assert!(if at == place { mean > 0.7 } else { mean.abs() < 0.2 }, "{part} {at}: {mean}");
        }
    }
    // A fixed pointer, a state and the inverse of a state as effects; an inverse as condition.
    let v = words::<Words>(32, 3, &["A", "B"]);
    let mut graph = GraphBuilder::new();
    let shown = v.stimulus([(0, "A"), (200, "B"), (400, "~A")]).expect("sound");
    let shown = graph.add("shown", shown);
    let [vision, motor] = ["vision", "motor"].map(|name| graph.add(name, State::new(&v)));
    graph.route(&shown >> &vision);
    let rules = Rules::new()
        .rule("fixed", vision.dot(Words::A), [Words::A >> &motor])
        .rule("copied", vision.dot(Words::B), [&vision >> &motor])
        .rule("inverted", vision.dot(!Words::A), [!&vision >> &motor]);
    graph.add("rules", rules);
    let probe = graph.probe(&motor.output, smooth(30));
    let sim = run(&graph, 600);
    for (part, [is, is_not]) in [(0, ["A", "B"]), (1, ["B", "A"]), (2, ["A", "B"])] {
        let when = (200 * part + 180, 200 * part + 200);
        let found = [is, is_not].map(|name| like(&v, &sim, &probe, name, when));
        assert!(found[0] > 0.8 && found[1] < 0.25, "{part}: {found:?}");
    }
}

#[test]
fn a_gated_memory_holds_what_it_was_given() {
    let mut graph = GraphBuilder::new();
    let given = Stimulus::scalar(0.0).from(ms(100), &[0.5]).from(ms(500), &[0.0]);
    let given = graph.add("given", given);
    let open = graph.add("open", Stimulus::scalar(1.0).from(ms(400), &[0.0]));
    let memory = graph.add("memory", GatedMemory::scalar());
    graph.route(&given >> &memory);
    graph.route(&open >> &memory.open);
    let probe = graph.probe(&memory.output, smooth(10));
    let sim = run(&graph, 700);
    let all: Vec<Real> = sim.samples(&probe).iter().map(|(_, v)| v[0]).collect();
    assert_eq!(all.len(), 700);
    let within = |from: usize, to: usize, wanted: Real, bound: Real| {
        let off = all[from..to].iter().map(|v| (v - wanted).abs()).fold(0.0, Real::max);
        assert!(off < bound, "{from} to {to}: {off}");
    };
    within(0, 100, 0.0, 0.05);
    within(200, 400, 0.5, 0.1);
    within(400, 700, 0.5, 0.1);
}
