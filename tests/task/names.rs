//! Names of states, actions, facts and objects: symbols and sentences, for all tasks and for worlds that are not tasks.

#![allow(clippy::unwrap_used, clippy::expect_used)]

#[cfg(feature = "physics")]
use std::collections::BTreeMap;
use std::collections::BTreeSet;
use std::path::Path;

use symbolt::sim::Seed;
use symbolt::study::worlds;
use symbolt::task::classify::Classifier;
use symbolt::task::compile::Problem;
use symbolt::task::domain::RelationalDomain;
use symbolt::task::learn::{Settings, learn};
use symbolt::task::{Recording, Snapshot};

/// Symbols with their sentences, of a domain and of its problem in a scene.
struct Named {
    lists: Vec<Vec<(String, String)>>,
    objects: Vec<String>,
    /// Facts that people see, and those that only the planner needs; compared for the tasks, which need physics.
    #[cfg_attr(not(feature = "physics"), allow(dead_code))]
    shown: usize,
    #[cfg_attr(not(feature = "physics"), allow(dead_code))]
    hidden: usize,
}

fn named(domain: &RelationalDomain, scene: &Snapshot) -> Named {
    let states = domain.states.iter().map(|s| &s.name);
    let all = states.chain(domain.operators.iter().map(|o| &o.name));
    let mut lists: Vec<Vec<(String, String)>> =
        vec![all.map(|name| (name.clone(), domain.in_words(name).into_owned())).collect()];
    let layout = Classifier::new(domain).classify(scene);
    let (mut objects, mut shown, mut hidden) = (Vec::new(), 0, 0);
    let start = layout.situation();
    if let Ok(problem) = Problem::new(domain, &layout)
        && let Ok(ground) = problem.ground(&start)
    {
        let known = ground.domain();
        let facts = known.state_ids();
        let facts = facts.map(|f| (known[f].name.clone(), ground.fact_in_words(f).to_owned()));
        let actions = known.action_ids();
        let actions =
            actions.map(|a| (known[a].name.clone(), ground.action_in_words(a).to_owned()));
        lists.push(facts.chain(actions).collect());
        objects = ground.object_names().map(|(_, name)| name.to_owned()).collect();
        hidden = known.state_ids().filter(|f| ground.is_planner_only(*f)).count();
        shown = known.states().len() - hidden;
        assert!(ground.goals().iter().all(|goal| !ground.is_planner_only(*goal)));
    }
    Named { lists, objects, shown, hidden }
}

/// Returns what is wrong with names.
fn faults(names: &[(String, String)]) -> Vec<String> {
    let mut faults = Vec::new();
    let (mut symbols, mut sentences) = (BTreeSet::new(), BTreeSet::new());
    for (symbol, words) in names {
        let coded = |part: &str| {
            let mut chars = part.chars();
            let code = matches!(chars.next(), Some('P' | 'N' | 'X'));
            let number = chars.as_str();
            code && !number.is_empty() && number.chars().all(|c| c.is_ascii_digit())
        };
        if symbol.split('_').any(coded) {
            faults.push(format!("{symbol} has a code in it"));
        }
        let odd = |c: char| c == '_' || c.is_ascii_uppercase() || c.is_control();
        if words.is_empty() || words.contains(odd) || words.ends_with('.') {
            faults.push(format!("`{words}` is no sentence"));
        }
        if !symbols.insert(symbol) {
            faults.push(format!("{symbol} is there twice"));
        }
        if !sentences.insert(words) {
            faults.push(format!("`{words}` is said twice, also of {symbol}"));
        }
        // What had to be numbered could not be told apart by what it is.
        if words.ends_with(')') {
            faults.push(format!("`{words}` is numbered"));
        }
    }
    faults
}

fn check(what: &str, named: &Named) -> usize {
    for list in &named.lists {
        assert_eq!(faults(list), [""; 0], "{what}");
    }
    let objects: BTreeSet<&String> = named.objects.iter().collect();
    assert_eq!(objects.len(), named.objects.len(), "{what}: {:?}", named.objects);
    named.lists.iter().map(Vec::len).sum()
}

/// The names were `NO_NUT_AT_NUT_POCKET_0_P1`, `NUT_AT_START_N2` and `CUBE_AT_CUBE_BIN_X4`.
#[test]
fn names_with_codes_in_them_are_caught() {
    let pair = |symbol: &str, words: &str| (symbol.to_owned(), words.to_owned());
    let good = pair("NUT_0_AT_START", "nut 0 is in its start area");
    assert_eq!(faults(std::slice::from_ref(&good)), [""; 0]);
    for bad in [
        pair("NO_NUT_AT_NUT_POCKET_0_P1", "no nut is in pocket 0"),
        pair("NUT_AT_START_N2", "a nut is in its start area"),
        pair("CUBE_AT_CUBE_BIN_X4", "at least 4 cubes are in a cube bin"),
        pair("NUT_0_AT_START", "nut 1 is in its start area"),
        pair("NUT_1_AT_START", "nut 0 is in its start area"),
        pair("NUT_1_AT_START", "nut_1 is in its start area"),
        pair("NUT_1_AT_START", "NUT is in its start area"),
        pair("NUT_1_AT_START", ""),
        pair("NUT_1_AT_START", "nut 0 is in its start area (2)"),
    ] {
        assert_eq!(faults(&[good.clone(), bad.clone()]).len(), 1, "{bad:?}");
    }
}

#[cfg(feature = "physics")]
fn of_task(name: &str, seed: u64) -> (RelationalDomain, Named) {
    use symbolt::robot::scene::Scene;
    use symbolt::task::event::Ignore;
    use symbolt::task::execute::demonstrate_sensed;
    use symbolt::task::{Recorder, Sensing, tasks};

    let task = tasks::by_name(name).expect("it is built in");
    let shown = demonstrate_sensed(&*task, 5, &Sensing::default(), Seed::new(seed), &mut Ignore);
    let shown = shown.expect("it is shown");
    let domain = learn(&shown.recording, &Settings::default()).expect("it teaches").domain;
    let scene = Scene::new(task.scene(Seed::new(7)).expect("a scene")).expect("it is sound");
    let named = named(&domain, &Recorder::default().look(&scene).0);
    (domain, named)
}

#[cfg(feature = "physics")]
#[test]
fn every_name_of_every_task_is_told_in_words_and_is_the_same_from_another_recording() {
    use rayon::prelude::*;
    use symbolt::task::tasks;

    let tasks = tasks::all().expect("they are sound");
    // A second recording of the tasks whose states are told apart by more than their frames.
    let twice = |name: &str| ["drawer", "cup", "tower"].contains(&name);
    let learned = tasks.par_iter().map(|task| {
        let name = task.name();
        (of_task(name, 1), twice(name).then(|| of_task(name, 2)))
    });
    let learned: Vec<_> = learned.collect();
    let (mut all, mut hidden) = (0, 0);
    let mut known: BTreeMap<&str, BTreeMap<String, String>> = BTreeMap::new();
    for (task, ((one, first), second)) in tasks.iter().zip(learned) {
        all += check(task.name(), &first);
        assert!(first.shown > 0 && first.hidden > 0, "{}", task.name());
        hidden += first.hidden;
        // Both recordings teach the same states.
        if let Some((other, second)) = second {
            check(task.name(), &second);
            assert_eq!(one.words, other.words, "{}", task.name());
        }
        known.insert(task.name(), one.words);
    }
    assert!(tasks.len() >= 8 && all > 200 && hidden > 20, "{all} names, {hidden} hidden");
    // These were DRAWER_AT_CABINET_2, CUP_PLACED and BLUE_BLOCK_AT_PAD.
    for (task, symbol, words) in [
        ("drawer", "DRAWER_OPEN", "a drawer is open"),
        ("drawer", "DRAWER_CLOSED", "a drawer is closed"),
        ("drawer", "OPEN_DRAWER", "open a drawer"),
        ("cup", "CUP_TURNED_OVER", "a cup is turned over"),
        ("cup", "TURN_CUP_OVER", "turn a cup over"),
        ("tower", "BLUE_BLOCK_PLACED", "a blue block is set aside"),
        ("tower", "PUT_DOWN_BLUE_BLOCK", "set a blue block aside"),
        ("tower", "RED_BLOCK_AT_PAD", "a red block is on a pad"),
        ("nuts-and-bolts", "PUT_BOLT_AT_NUT", "put a bolt in a nut"),
        ("table-setting", "KNIFE_AT_PLATE", "a knife is beside a plate"),
    ] {
        assert_eq!(known[task].get(symbol).map(String::as_str), Some(words), "{task}");
    }
}

/// Generated worlds have several parts of a kind, regions, joints, stacks and fixtures alike.
#[test]
fn every_name_of_the_generated_worlds_is_told_in_words() {
    let (mut all, mut known) = (0, 0);
    for world in worlds::all() {
        let recording = world.record(5, Seed::new(1));
        let Ok(learned) = learn(&recording, &Settings::default()) else { continue };
        let scene = recording.demos[0].snapshots[0].clone();
        all += check(world.name(), &named(&learned.domain, &scene));
        known += 1;
    }
    assert!(known >= 25 && all > 500, "{all} names of {known} worlds");
}

/// Recordings of others: areas on a table, pegs, bins alike, stacks, a gate.
#[test]
fn every_name_of_recordings_of_others_is_told_in_words() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures/learned");
    let (mut all, mut known) = (0, 0);
    for name in ["areas", "gate", "pegs", "stack", "tower", "two_bins", "two_goals"] {
        let recording =
            Recording::read(&folder.join(format!("{name}.jsonl"))).expect("it is valid");
        let learned = learn(&recording, &Settings::default()).expect("it teaches");
        let scene = recording.demos[0].snapshots[0].clone();
        all += check(name, &named(&learned.domain, &scene));
        known += 1;
    }
    assert!(known == 7 && all > 70, "{all} names of {known} recordings");
}

#[test]
fn a_file_without_sentences_gets_them_and_a_persons_own_travel_with_it() {
    let old = include_str!("../fixtures/learned/drawer.json");
    let parse = |text: &str| RelationalDomain::parse(text.as_bytes(), "drawer.json");
    let domain = parse(old).expect("it is valid");
    let both = ["DRAWER_AT_CABINET", "DRAWER_AT_CABINET_2"].map(|name| domain.in_words(name));
    assert_eq!(
        BTreeSet::from(both),
        BTreeSet::from(["a drawer is closed", "a drawer is open"].map(Into::into))
    );
    let pair = |old: &str, new: &str| (old.to_owned(), new.to_owned());
    let own = pair("DRAWER_AT_CABINET_2", "the drawer is pulled out");
    let reworded = domain.reword(std::slice::from_ref(&own)).expect("it is a sentence");
    let renamed = reworded.rename(&[pair("DRAWER_AT_CABINET_2", "PULLED_OUT")]).expect("a name");
    let again = parse(&renamed.to_json().expect("it is written")).expect("it is valid");
    assert_eq!(again, renamed);
    assert_eq!(again.in_words("PULLED_OUT"), "the drawer is pulled out");
    assert!(!again.words.contains_key("DRAWER_AT_CABINET_2"));
    for (wrong, why) in [
        (vec![pair("DRAWER", "a drawer is open")], "has no state or action `DRAWER`"),
        (vec![own.clone(), own.clone()], "renamed twice"),
        (vec![pair("PUT_MUG_AT_DRAWER", "a mug is in a drawer")], "the same sentence"),
        (vec![pair("MUG_AT_DRAWER", "a \u{1b}[31mmug")], "cannot be printed"),
        (vec![pair("MUG_AT_DRAWER", " ")], "cannot be printed"),
        (vec![pair("MUG_AT_DRAWER", &"x".repeat(1_000))], "too long"),
    ] {
        let error = domain.reword(&wrong).expect_err("refused").to_string();
        assert!(error.contains(why), "{why} in {error}");
    }
    for (words, field) in
        [(r#"{"NOBODY": "a word"}"#, "words"), ("3", "words"), (r#"{"A": 1}"#, "words")]
    {
        let file = old.replacen('{', &format!("{{\"words\": {words},"), 1);
        let error = parse(&file).expect_err("refused").to_string();
        assert!(error.contains(&format!("field `{field}`")), "{field} in {error}");
    }
}
