//! Domain files of version 3: read back as written, and refused with the field that is at fault.

#![allow(clippy::unwrap_used, clippy::expect_used)]

use proptest::prelude::*;
use serde_json::{Value, json};
use symbolt::sim::Seed;
use symbolt::task::learn::{Settings, learn_relational};
use symbolt::task::relational::{Grounder, Problem, Quantity, RelationalDomain};
use symbolt::task::tasks::nuts_and_bolts::SyntheticDemonstrations;
use symbolt::task::{Domain, Recording, Snapshot};

use crate::beside;

/// A domain with a state in the frame of a plate and a goal for each plate.
fn domain() -> RelationalDomain {
    let recording = beside::recording(6, 2);
    let learned = learn_relational(&recording, &Settings::default()).expect("learns");
    learned.domain
}

fn exchanged(text: &str, at: &str, new: Value) -> String {
    let mut file: Value = serde_json::from_str(text).expect("JSON");
    *file.pointer_mut(at).expect(at) = new;
    let text = file.to_string();
    RelationalDomain::parse(text.as_bytes(), "d.json").expect_err("refused").to_string()
}

#[test]
fn a_domain_is_read_back_as_it_was_written_and_names_its_states() {
    let domain = domain();
    let beside = domain.states.iter().find(|s| s.frame.name() == "plate").expect("in a frame");
    assert_eq!(beside.kind, "cup");
    assert!(domain.goals.iter().any(|g| g.quantity == Quantity::EachReference(1)), "{domain:?}");
    let text = domain.to_json().expect("plain data");
    assert_eq!(RelationalDomain::parse(text.as_bytes(), "d.json").expect("sound"), domain);
    let file: Value = serde_json::from_str(&text).expect("JSON");
    assert_eq!(file["version"], 3);
    assert_eq!(file["operators"][0]["to"], json!(beside.name));
    assert_eq!(file["goals"][0]["state"], json!(beside.name));
    assert_eq!(file["goals"][0]["each"], "reference");
    // The reader without frames says which reader to use.
    let refused = Domain::parse(text.as_bytes(), "d.json").expect_err("another version");
    assert!(refused.to_string().contains("field `version`: it is 3"), "{refused}");
    assert!(refused.to_string().contains("`RelationalDomain` reads version 3"), "{refused}");
}

#[test]
fn a_goal_at_references_in_place_is_read_back_and_refused_where_it_cannot_be_planned() {
    let made = SyntheticDemonstrations::default().record(Seed::new(3)).expect("it is valid");
    let learned = learn_relational(&made.recording, &Settings::default()).expect("it teaches");
    let text = learned.domain.to_json().expect("plain data");
    assert_eq!(RelationalDomain::parse(text.as_bytes(), "d.json").expect("sound"), learned.domain);
    let file: Value = serde_json::from_str(&text).expect("JSON");
    assert_eq!(file["goals"][0].get("references_in"), None);
    assert_eq!(file["goals"][1]["references_in"], "NUT_AT_NUT_POCKET");
    let given = |new: Value| exchanged(&text, "/goals/1/references_in", new);
    let each = |new: &str| exchanged(&text, "/goals/1/each", json!(new));
    let mut alone = file.clone();
    alone["goals"].as_array_mut().expect("a list").remove(0);
    let mut free = file.clone();
    for operator in free["operators"].as_array_mut().expect("a list") {
        operator["needs"] = json!([]);
    }
    let parsed = |file: Value| {
        let text = file.to_string();
        RelationalDomain::parse(text.as_bytes(), "d.json").expect_err("refused").to_string()
    };
    let cases = [
        (given(json!("NOWHERE")), "goals[1].references_in"),
        (given(json!(3)), "goals[1]"),
        (
            given(json!("BOLT_AT_START")),
            "`BOLT_AT_START` is a state of `bolt`; expected one of `nut`",
        ),
        (given(json!("NUT_AT_START")), "expected `NUT_AT_START` as an earlier term of the goal"),
        (each("reference"), "expected a term without `each`"),
        (each("object"), "expected a term without `each`"),
        (parsed(alone), "expected `NUT_AT_NUT_POCKET` as an earlier term of the goal"),
        (
            parsed(free),
            "expected that `PUT_BOLT_AT_NUT` requires `NUT_AT_NUT_POCKET` of its target",
        ),
    ];
    for (said, part) in cases {
        assert!(said.contains(part), "{part} in {said}");
    }
}

/// The place farthest from everything was the edge of the cup: the cube did not fit in there.
#[test]
fn an_object_goes_to_the_middle_of_a_region_unless_another_is_near() {
    let domain = domain();
    let mut file: Value =
        serde_json::from_str(&domain.to_json().expect("plain data")).expect("JSON");
    let to = file["operators"][0]["to"].clone();
    let states = file["states"].as_array_mut().expect("a list");
    let state = states.iter_mut().find(|s| s["name"] == to).expect("there");
    state["places"].as_array_mut().expect("a list").truncate(1);
    for axis in 0..2 {
        let region = json!({"open": {"low": -0.016, "high": 0.016}});
        state["places"][0]["coordinates"][axis] = region;
    }
    file["operators"][0]["displacement"] = json!(null);
    let text = file.to_string();
    let domain = RelationalDomain::parse(text.as_bytes(), "d.json").expect("sound");

    let mut scene = beside::recording(6, 2).demos[0].snapshots[0].clone();
    for (index, object) in scene.objects.iter_mut().enumerate() {
        object.pose.position[0] = 0.2 * index as f64;
    }
    let target = |scene: &Snapshot| {
        let layout = Grounder::new(&domain).layout(scene);
        let problem = Problem::new(&domain, &layout).expect("its goal is known");
        let moves = problem.moves(&layout.situation());
        let m = moves.iter().find(|m| m.operator == 0).expect("a cup can be moved");
        let pose = problem.target(m, &layout).pose;
        let plate = m.reference.expect("beside a plate");
        (m.object, pose, scene.objects[plate].pose)
    };
    let (cup, pose, at) = target(&scene);
    let off = (0..2).map(|i| (pose.position[i] - at.position[i]).abs()).fold(0.0, f64::max);
    assert!(off < 1e-9, "{off} m from the middle");
    let other = scene.objects.iter().rposition(|o| &*o.kind == "cup").expect("two cups");
    scene.objects[other].pose.position = pose.position;
    scene.objects[other].pose.position[0] += 0.01;
    let (same, aside, _) = target(&scene);
    assert!(same == cup && other != cup);
    assert!(aside.distance(&scene.objects[other].pose) > 0.02, "{aside:?}");
}

#[test]
fn versions_1_and_2_are_read_and_converted() {
    let old = include_str!("../fixtures/domain_v1.json");
    let one = RelationalDomain::parse(old.as_bytes(), "one.json").expect("version 1");
    let plain = Domain::parse(old.as_bytes(), "one.json").expect("version 1");
    let text = plain.to_json().expect("plain data");
    assert!(text.contains("\"version\": 2"));
    let two = RelationalDomain::parse(text.as_bytes(), "two.json").expect("version 2");
    assert_eq!(one, two);
    assert_eq!(one, RelationalDomain::from_domain(&plain).expect("it has geometry"));
    assert_eq!((one.states.len(), one.operators.len(), one.goals.len()), (5, 3, 1));
    let future = text.replace("\"version\": 2", "\"version\": 4");
    let refused = RelationalDomain::parse(future.as_bytes(), "d.json").expect_err("unknown");
    assert!(refused.to_string().contains("it is 4; expected 1 to 3"), "{refused}");
}

#[test]
fn every_fault_names_its_field_and_what_was_expected() {
    let text = domain().to_json().expect("plain data");
    let cases = [
        ("/format", json!("other"), "field `format`: it is `other`; expected `symbolt-domain`"),
        ("/version", json!("3"), "field `version`: it is `3`"),
        ("/provenance", json!([]), "field `provenance`: it is a list; expected an object"),
        ("/noise_m", json!("no"), "field `noise_m`"),
        ("/goals/0", json!(7), "field `goals[0]`: it is 7; expected an object"),
        ("/goals/0/state", json!("CUP"), "field `goals[0].state`: `CUP` is not a state"),
        ("/goals/0/each", json!("plate"), "field `goals[0]`"),
        ("/goals/0/each", json!({"object": null}), "field `goals[0].each`: it is an object"),
        ("/goals/0/at_least", json!(0), "asks for 0 of"),
        ("/states", json!({}), "field `states`"),
        ("/states/0", json!([1]), "field `states[0]`: it is a list"),
        ("/states/0/kind", json!(1), "field `states[0]`"),
        ("/states/0/places", json!([]), "has no places"),
        ("/states/0/places/0/count", json!(-1), "field `states[0].places[0]`"),
        ("/states/0/places/0/orientation", json!([0, 0, 0, 2]), "expected a unit quaternion"),
        (
            "/states/0/places/0/coordinates/1",
            json!({"tight": [0.1, 0.2]}),
            "field `states[0].places[0].coordinates[1].tight`: it is a list",
        ),
        (
            "/states/0/places/0/coordinates/1",
            json!({"open": {"low": 2.0, "high": 1.0}}),
            "a coordinate that is not usable",
        ),
        ("/states/0/origin", json!({"found": null}), "field `states[0].origin`: it is an object"),
        ("/states/0/name", json!("no name"), "`no name` cannot be a name"),
        ("/operators/0/to", json!("CUP"), "field `operators[0].to`: `CUP` is not a state"),
        ("/operators/0/from/0", json!("CUP"), "field `operators[0].from[0]`: `CUP`"),
        ("/operators/0/needs", json!([{"state": 1}]), "field `operators[0].needs[0]`"),
        ("/operators/0/side_effects", json!([[]]), "field `operators[0].side_effects[0]`"),
        ("/operators/0/displacement", json!("far"), "field `operators[0].displacement`"),
    ];
    for (at, value, part) in cases {
        let refused = exchanged(&text, at, value);
        assert!(refused.starts_with("d.json"), "{refused}");
        assert!(refused.contains(part), "{at}: {part} in {refused}");
    }
    let near = exchanged(&text, "/operators/0/to", json!("CUP_AT_PLAT"));
    assert!(near.contains("did you mean `CUP_AT_PLATE`?"), "{near}");
    let twice = text.replacen("\"goals\":", "\"goals\": [], \"goals\":", 1);
    let refused = RelationalDomain::parse(twice.as_bytes(), "d.json").expect_err("twice");
    assert!(refused.to_string().contains("duplicate field `goals`"), "{refused}");
    for list in ["[]", "7", "\"domain\""] {
        let refused = RelationalDomain::parse(list.as_bytes(), "d.json").expect_err("no object");
        assert!(refused.to_string().contains("expected an object"), "{refused}");
    }
}

#[test]
fn a_person_can_rename_states_and_actions() {
    let domain = domain();
    let pair = |a: &str, b: &str| (a.to_owned(), b.to_owned());
    let renamed = domain.rename(&[pair("CUP_AT_PLATE", "CUP_BESIDE_PLATE")]).expect("renames");
    assert_eq!(renamed.state("CUP_BESIDE_PLATE").expect("there"), domain.goals[0].state);
    let refuse = |old: &str, new: &str| domain.rename(&[pair(old, new)]).unwrap_err().to_string();
    assert!(refuse("CUP_AT_PLAT", "X").contains("did you mean `CUP_AT_PLATE`?"));
    assert!(refuse("CUP_AT_PLATE", "CUP_AT_START").contains("is used twice"));
    assert!(refuse("CUP_AT_PLATE", "no good").contains("cannot be a name"));
}

/// Uses a domain in every way that a command does.
fn use_it(domain: &RelationalDomain, scene: &Snapshot) {
    let layout = Grounder::new(domain).layout(scene);
    if let Ok(problem) = Problem::new(domain, &layout) {
        let situation = layout.situation();
        for m in problem.moves(&situation) {
            let _ = problem.target(&m, &layout);
            let _ = problem.open_needs(&m, &situation);
        }
        let _ = problem.plan(&situation, &[]);
    }
    for operator in &domain.operators {
        for need in &operator.needs {
            let _ = (domain.need_in_words(operator, need), need.reason());
        }
    }
    let _ = domain.to_json().expect("plain data");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    #[test]
    fn random_bytes_never_panic(bytes in prop::collection::vec(any::<u8>(), 0..300)) {
        let _ = RelationalDomain::parse(&bytes, "x");
    }

    #[test]
    fn mutated_domains_are_used_or_refused(
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6),
        digits in prop::collection::vec((any::<prop::sample::Index>(), 0u8..10), 0..12),
    ) {
        let domain = DOMAIN.get_or_init(|| domain().to_json().expect("plain data"));
        let recording = RECORDING.get_or_init(|| beside::recording(1, 2));
        let scene = &recording.demos[0].snapshots[0];
        // Changed bytes are nearly always refused; changed digits keep the file readable.
        let mut bytes = domain.clone().into_bytes();
        let places: Vec<usize> = (0..bytes.len()).filter(|i| bytes[*i].is_ascii_digit()).collect();
        for (index, value) in &digits {
            bytes[places[index.index(places.len())]] = b'0' + value;
        }
        if let Ok(domain) = RelationalDomain::parse(&bytes, "x") {
            use_it(&domain, scene);
        }
        for (index, value) in &changes {
            let at = index.index(bytes.len());
            bytes[at] = *value;
        }
        if let Ok(domain) = RelationalDomain::parse(&bytes, "x") {
            use_it(&domain, scene);
        }
    }
}

static DOMAIN: std::sync::OnceLock<String> = std::sync::OnceLock::new();
static RECORDING: std::sync::OnceLock<Recording> = std::sync::OnceLock::new();
