//! Choices and memories in neurons after a change of their input: switching, ties, hysteresis, clean-up, gates and drift.

use symbolt::neurons::{LifSpec, Population, PopulationPlan, SelectRule};
use symbolt::sim::{
    Constant, GraphBuilder, ProbeSpec, Real, Seed, Signal, SimDuration, Simulator, Synapse,
    VocabTag,
};
use symbolt::spa::{
    CleanupMemory, Gate, GatedMemory, GoalBuffer, Integrator, Oscillator, Routes, Selection, State,
    VocabularyBuilder, cosine_of_slices as cosine, norm, random_pointer,
};

struct Words;
impl VocabTag for Words {
    const NAME: &'static str = "words";
}

fn lif() -> PopulationPlan {
    PopulationPlan::lif()
}

fn rate() -> PopulationPlan {
    PopulationPlan::rate()
}

fn run(graph: GraphBuilder, plan: &PopulationPlan, seed: u64, ms: u64) -> Simulator {
    graph.run(plan, Seed::new(seed), SimDuration::from_millis(ms)).unwrap()
}

/// Returns the activities of two items, at each tick. Utilities are 1 and 0 for 300 ms, then `then`.
fn chosen(
    rule: SelectRule,
    then: [Real; 2],
    (plan, seed): (&PopulationPlan, u64),
) -> Vec<Vec<Real>> {
    let mut graph = GraphBuilder::new();
    let utilities = Signal::vector(2, move |t, out| {
        out.copy_from_slice(if t < 0.3 { &[1.0, 0.0] } else { &then });
    });
    let utilities = graph.add("utilities", utilities);
    let selection = graph.add("selection", Selection::new(2, rule));
    graph.route(&utilities >> &selection.utilities);
    let spec = ProbeSpec::default().filtered(Synapse::lowpass_ms(10));
    let probe = graph.probe(&selection.items, spec);
    let sim = run(graph, plan, seed, 900);
    sim.samples(&probe).iter().map(|(_, items)| items.to_vec()).collect()
}

/// Returns how long the second item takes to overtake the first, in ms.
fn switched(items: &[Vec<Real>]) -> Option<usize> {
    items[300..].iter().position(|v| v[1] > v[0])
}

#[test]
fn a_contest_follows_the_greatest_utility_whatever_won_before() {
    for level in [0.3, 0.5] {
        let rule = SelectRule::WinnerTakeAll { level };
        for (old, within_ms) in [(0.0, 25), (0.35, 25), (0.5, 25), (0.8, 45), (0.9, 120)] {
            let lifs = (1..=3).map(|seed| (lif(), seed));
            for (plan, seed) in [(PopulationPlan::direct(), 1), (rate(), 1)].into_iter().chain(lifs)
            {
                let items = chosen(rule, [old, 1.0], (&plan, seed));
                let ms = switched(&items).unwrap_or(usize::MAX);
                assert!(ms <= within_ms, "{level} {old} {seed}: {ms} ms");
                let last = items.last().unwrap();
                assert!(last[1] > 0.9 && last[0] < 0.1, "{level} {old} {seed}: {last:?}");
            }
        }
    }
    // The wrong variant: what the margin of a hysteresis does, the plain rule must not.
    let sticky = SelectRule::Hysteresis { level: 0.3, margin: 1.0 };
    assert_eq!(switched(&chosen(sticky, [0.8, 1.0], (&lif(), 1))), None);
}

#[test]
fn a_hysteresis_keeps_the_winner_within_its_margin_in_every_mode() {
    let rule = SelectRule::Hysteresis { level: 0.3, margin: 0.3 };
    for plan in [PopulationPlan::direct(), rate(), lif()] {
        assert_eq!(switched(&chosen(rule, [0.9, 1.0], (&plan, 1))), None);
        assert!(switched(&chosen(rule, [0.6, 1.0], (&plan, 1))).is_some_and(|ms| ms < 120));
        // Below the level nothing stays.
        assert!(switched(&chosen(rule, [0.2, 0.4], (&plan, 1))).is_some_and(|ms| ms < 60));
    }
    let mut graph = GraphBuilder::new();
    graph.add("bad", Selection::new(2, SelectRule::Hysteresis { level: 0.3, margin: -0.1 }));
    let refused = graph.run(&lif(), Seed::new(1), SimDuration::from_millis(1));
    assert!(refused.err().unwrap().to_string().contains("the margin is -0.1"));
}

#[test]
fn of_equal_utilities_one_is_chosen_and_stays() {
    for (utilities, level) in [([1.0, 1.0], 0.3), ([0.6, 0.6], 0.5), ([0.9, 0.87], 0.5)] {
        for seed in 1..=4 {
            let mut graph = GraphBuilder::new();
            let given = graph.add("given", Constant::vector(&utilities));
            let rule = SelectRule::WinnerTakeAll { level };
            let selection = graph.add("selection", Selection::new(2, rule));
            graph.route(&given >> &selection.utilities);
            let spec = ProbeSpec::default().filtered(Synapse::lowpass_ms(10));
            let probe = graph.probe(&selection.items, spec);
            let sim = run(graph, &lif(), seed, 1_000);
            let best: Vec<Option<bool>> = sim
                .samples(&probe)
                .iter()
                .skip(200)
                .map(|(_, v)| {
                    let active = v.iter().filter(|v| **v > 0.5).count();
                    assert!(active <= 1, "{utilities:?} {seed}: both");
                    (active == 1).then(|| v[1] > v[0])
                })
                .collect();
            let one = best.iter().flatten().count();
            assert!(
                one >= best.len() / 2 && best.last() != Some(&None),
                "{utilities:?} {seed}: {one} of {}",
                best.len()
            );
            let firm: Vec<bool> = best.into_iter().flatten().collect();
            let flips = firm.windows(2).filter(|pair| pair[0] != pair[1]).count();
            assert!(flips <= 1, "{utilities:?} {seed}: {flips} flips");
        }
    }
}

/// Asks a memory for ten noisy items, one after another. Returns how often it chose exactly the most similar one.
fn cleaned(dim: usize, items: usize, (noise, level): (Real, Real), seed: u64) -> usize {
    const CUES: usize = 10;
    let names: Vec<String> = (0..items).map(|i| format!("V{i}")).collect();
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    let words = VocabularyBuilder::<Words>::new(dim, Seed::new(seed))
        .max_similarity(1.0)
        .pointers(names.iter().copied())
        .build()
        .unwrap();
    let values: Vec<Vec<Real>> =
        names.iter().map(|name| words.get(name).unwrap().to_vec()).collect();
    let cues: Vec<Vec<Real>> = (0..CUES)
        .map(|cue| {
            let clean = &values[(7 * cue + seed as usize) % items];
            let by = random_pointer(dim, Seed::new(1_000 * seed + cue as u64));
            let sum: Vec<Real> = clean.iter().zip(&by).map(|(a, b)| a + noise * b).collect();
            sum.iter().map(|v| v / norm(&sum)).collect()
        })
        .collect();
    let right: Vec<usize> = cues
        .iter()
        .map(|cue| {
            let like = |item: &usize| cosine(&values[*item], cue);
            (0..items).max_by(|a, b| like(a).total_cmp(&like(b))).unwrap()
        })
        .collect();
    let mut graph = GraphBuilder::new();
    let shown = Signal::pointer(words.space(), move |t, out: &mut [Real]| {
        out.copy_from_slice(&cues[((t * 1e3 - 0.5) as usize / 200).min(CUES - 1)]);
    });
    let shown = graph.add("shown", shown);
    let rule = SelectRule::WinnerTakeAll { level };
    let memory = graph.add("memory", CleanupMemory::new(&words, names, rule).unwrap());
    graph.route(&shown >> &memory);
    let probe = graph.probe(&memory.items, ProbeSpec::default().filtered(Synapse::lowpass_ms(20)));
    let sim = run(graph, &lif(), seed, 200 * CUES as u64);
    let samples = sim.samples(&probe);
    (0..CUES)
        .filter(|cue| {
            let items = samples.get(cue * 200 + 190).unwrap().1;
            let alone = |(at, value): (usize, &Real)| (*value > 0.7) == (at == right[*cue]);
            items.iter().enumerate().all(alone)
        })
        .count()
}

#[test]
fn noisy_pointers_are_cleaned_up_as_often_as_by_the_reference() {
    // 100 cues. The reference answers 95 of 100 of such cues; an exact search defines what is right.
    let mut right = 0;
    for (dim, items, noise) in
        [(64, 8, 1.0), (64, 20, 1.5), (128, 20, 1.5), (128, 20, 2.0), (64, 8, 1.5)]
    {
        right += (1..=2).map(|seed| cleaned(dim, items, (noise, 0.2), seed)).sum::<usize>();
    }
    assert!(right >= 95, "{right} of 100");
}

#[test]
fn a_cue_that_turns_is_answered_anew() {
    let words = VocabularyBuilder::<Words>::new(256, Seed::new(1))
        .pointers(["RED", "BLUE"])
        .build()
        .unwrap();
    let turned = [("RED + 0.5 * BLUE", "RED"), ("0.5 * RED + BLUE", "BLUE")];
    for plan in [PopulationPlan::direct(), rate(), lif()] {
        let mut graph = GraphBuilder::new();
        let cue = graph.add("cue", words.stimulus([(0, turned[0].0), (300, turned[1].0)]).unwrap());
        let rule = SelectRule::WinnerTakeAll { level: 0.3 };
        let memory = CleanupMemory::new(&words, ["RED", "BLUE"], rule).unwrap();
        let memory = graph.add("memory", memory);
        graph.route(&cue >> &memory);
        let probe =
            graph.probe(&memory.output, ProbeSpec::default().filtered(Synapse::lowpass_ms(10)));
        let sim = run(graph, &plan, 1, 400);
        for (at, (_, answer)) in [290, 380].into_iter().zip(turned) {
            let (_, found) = sim.samples(&probe).get(at).unwrap();
            assert!(cosine(&found, &words.get(answer).unwrap()) > 0.99, "{answer} at {at}");
        }
    }
}

#[test]
fn every_rule_works_with_few_neurons_an_item() {
    let tau = SimDuration::from_millis(40);
    let level = 0.3;
    for per_item in [1, 2, 4] {
        for rule in [
            SelectRule::Threshold { level },
            SelectRule::Graded { level },
            SelectRule::WinnerTakeAll { level },
            SelectRule::Hysteresis { level, margin: 0.2 },
            SelectRule::IndependentAccumulators { level, tau },
        ] {
            let plan = PopulationPlan::all(Population::Lif(LifSpec::few_per_item(per_item)));
            let items = chosen(rule, [0.0, 0.9], (&plan, 1));
            for (at, winner) in [(290, 0), (890, 1)] {
                let (own, other) = (items[at][winner], items[at][1 - winner]);
                assert!(own > 0.6 && other < 0.1, "{per_item} {rule:?} at {at}: {own} {other}");
            }
        }
    }
    // None at all is still refused.
    let mut graph = GraphBuilder::new();
    graph.add("none", Selection::new(2, SelectRule::WinnerTakeAll { level }));
    let plan = PopulationPlan::all(Population::Lif(LifSpec::few_per_item(0)));
    let refused = graph.run(&plan, Seed::new(1), SimDuration::from_millis(1)).err().unwrap();
    assert!(refused.to_string().contains("`neurons` is 0"), "{refused}");
}

#[test]
fn a_gate_is_a_gain_and_closes_fully_in_every_mode() {
    let words = VocabularyBuilder::<Words>::new(64, Seed::new(1)).pointer("A").build().unwrap();
    let a = words.get("A").unwrap();
    for plan in [PopulationPlan::direct(), rate(), lif()] {
        for open in [1.2, 1.0, 0.98, 0.95, 0.9, 0.5, 0.15, 0.09, 0.0, -1.0] {
            let mut graph = GraphBuilder::new();
            let level = graph.add("level", Constant::scalar(open));
            // Closed, it holds back what is far beyond its radius.
            let given = graph.add("given", Constant::pointer(words.space(), &a));
            let gate = graph.add("gate", Gate::new(&words));
            graph.route(5.0 * &given >> &gate);
            graph.route(&given * -4.0 >> &gate);
            graph.route(&level >> &gate.open);
            let probe =
                graph.probe(&gate.output, ProbeSpec::default().filtered(Synapse::lowpass_ms(20)));
            let sim = run(graph, &plan, 1, 250);
            let passed = cosine(&sim.samples(&probe).last().unwrap().1, &a)
                * norm(&sim.samples(&probe).last().unwrap().1);
            let expected = if open < 0.1 { 0.0 } else { open.min(1.0) };
            let bound = if open < 0.1 { 1e-6 } else { 0.12 };
            assert!(
                (passed - expected).abs() <= bound || passed.is_nan() && expected == 0.0,
                "{open}: {passed}"
            );
        }
    }
}

/// Stores a pointer of norm `weight` in 150 ms, then holds it. Returns norm (over the weight) and cosine at 200 ms and 2 s.
fn held(dim: usize, weight: Real, seed: u64) -> [(Real, Real); 2] {
    let words = VocabularyBuilder::<Words>::new(dim, Seed::new(seed)).pointer("A").build().unwrap();
    let a = words.get("A").unwrap();
    let mut graph = GraphBuilder::new();
    let given = graph.add("given", Constant::pointer(words.space(), &a));
    let open = graph.add("open", Signal::scalar(|t| if t < 0.15 { 1.0 } else { 0.0 }));
    let buffer = graph.add("buffer", GoalBuffer::new(&words));
    graph.route(weight * &given >> &buffer);
    graph.route(&open >> &buffer.open);
    let probe = graph.probe(&buffer.output, ProbeSpec::default().filtered(Synapse::lowpass_ms(20)));
    let sim = run(graph, &lif(), seed, 2_150);
    [250, 2_149].map(|at| {
        let (_, value) = sim.samples(&probe).get(at).unwrap();
        (norm(&value) / weight, cosine(&value, &a))
    })
}

#[test]
fn a_goal_buffer_keeps_norm_and_direction_for_two_seconds() {
    for (dim, weight, seed) in [(64, 1.0, 1), (64, 0.5, 2), (128, 0.75, 3), (256, 1.0, 4)] {
        for (length, direction) in held(dim, weight, seed) {
            let least = if weight < 1.0 { 0.9 } else { 0.95 };
            assert!((length - 1.0).abs() < 0.12, "{dim} {weight} {seed}: norm {length}");
            assert!(direction > least, "{dim} {weight} {seed}: cosine {direction}");
        }
    }
}

#[test]
fn a_state_remembers_as_well_as_that_of_the_reference() {
    let cosines: Vec<Real> = (1..=5)
        .map(|seed| {
            let words =
                VocabularyBuilder::<Words>::new(64, Seed::new(seed)).pointer("A").build().unwrap();
            let a = words.get("A").unwrap();
            let shown = a.to_vec();
            let mut graph = GraphBuilder::new();
            let shown = Signal::pointer(words.space(), move |t, out: &mut [Real]| {
                out.iter_mut()
                    .zip(&shown)
                    .for_each(|(out, v)| *out = if t < 0.1 { *v } else { 0.0 });
            });
            let shown = graph.add("shown", shown);
            let state = graph.add("state", State::new(&words).recurrent(Synapse::lowpass_ms(100)));
            graph.route(&shown >> &state);
            let spec = ProbeSpec::default().filtered(Synapse::lowpass_ms(20));
            let probe = graph.probe(&state.output, spec);
            let sim = run(graph, &lif(), seed, 2_200);
            cosine(&sim.samples(&probe).last().unwrap().1, &a)
        })
        .collect();
    let mean = cosines.iter().sum::<Real>() / 5.0;
    // The reference over thirty seeds: 0.72 to 0.88, mean 0.81. With the regularisation of other populations: mean 0.83.
    assert!(mean > 0.845, "{cosines:?}");
}

#[test]
fn numbers_are_integrated_turned_and_held_in_spikes() {
    let mut graph = GraphBuilder::new();
    let kick = Signal::vector(2, |t, out| out[0] = if t < 0.1 { 1.0 } else { 0.0 });
    let kick = graph.add("kick", kick);
    let clock = graph.add("clock", Oscillator::new(2.0));
    graph.route(&kick >> &clock);
    let speed = graph.add("speed", Signal::scalar(|t| if t < 0.5 { 1.2 } else { 0.0 }));
    let place = graph.add("place", Integrator::scalar());
    graph.route(&speed >> &place);
    let open = graph.add("open", Signal::scalar(|t| if t < 0.2 { 1.0 } else { 0.0 }));
    let memory = graph.add("memory", GatedMemory::scalar().radius(2.0));
    graph.route(1.5 + &speed >> &memory);
    graph.route(&open >> &memory.open);
    let spec = || ProbeSpec::default().filtered(Synapse::lowpass_ms(10));
    let turning = graph.probe(&clock.output, spec());
    let (placed, kept) = (graph.probe(&place.output, spec()), graph.probe(&memory.output, spec()));
    let sim = run(graph, &lif(), 1, 3_000);
    let placed = sim.samples(&placed).get(1_400).unwrap().1[0];
    assert!((placed - 0.6).abs() < 0.08, "{placed}");
    // 2.7 is beyond the radius of 2, but within the room for the drive.
    let kept = sim.samples(&kept).get(2_200).unwrap().1[0];
    assert!((kept - 2.7).abs() < 0.25, "{kept}");
    let points: Vec<[Real; 2]> = sim.samples(&turning).iter().map(|(_, v)| [v[0], v[1]]).collect();
    for [x, y] in &points[1_000..] {
        assert!((x.hypot(*y) - 1.0).abs() < 0.2, "{x} {y}");
    }
    let turns =
        points[1_000..].windows(2).filter(|two| two[0][1] < 0.0 && two[1][1] >= 0.0).count();
    assert!((3..=5).contains(&turns), "{turns} turns in 2 s");
}
