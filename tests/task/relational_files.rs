//! Domain files of version 3: read back as written, and refused with the field that is at fault.

#![allow(clippy::unwrap_used, clippy::expect_used)]

use proptest::prelude::*;
use serde_json::{Value, json};
use symbolt::sim::Seed;
use symbolt::task::classify::Classifier;
use symbolt::task::compile::Problem;
use symbolt::task::domain::{Quantity, RelationalDomain};
use symbolt::task::learn::{Settings, learn};
use symbolt::task::tasks::nuts_and_bolts::SyntheticDemonstrations;
use symbolt::task::{Recording, Snapshot};

use crate::beside;

/// A domain with a state in the frame of a plate and a goal for each plate.
fn domain() -> RelationalDomain {
    let recording = beside::recording(6, 2);
    let learned = learn(&recording, &Settings::default()).expect("learns");
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
}

#[test]
fn a_goal_at_references_in_place_is_read_back_and_refused_where_it_cannot_be_planned() {
    let made = SyntheticDemonstrations::default().record(Seed::new(3)).expect("it is valid");
    let learned = learn(&made.recording, &Settings::default()).expect("it teaches");
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
        let layout = Classifier::new(&domain).classify(scene);
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

/// A domain file written by version 0.1.0, learned from five demonstrations.
const VERSION_1: &str = include_str!("../fixtures/domain_v1.json");

/// The same file as version 2 had it.
fn version_2() -> Value {
    let mut file: Value = serde_json::from_str(VERSION_1).expect("JSON");
    file["version"] = json!(2);
    for state in file["states"].as_array_mut().expect("a list") {
        let learned = state.as_object_mut().expect("an object");
        let keys = ["count", "distinct", "origin", "mean", "covariance"];
        let learned: serde_json::Map<String, Value> =
            keys.map(|key| (key.to_owned(), learned.remove(key).expect(key))).into_iter().collect();
        state["learned"] = learned.into();
    }
    for operator in file["operators"].as_array_mut().expect("a list") {
        let kind = operator.as_object_mut().expect("an object").remove("kind");
        operator["parameters"] = json!([{"name": "object", "kind": kind}]);
    }
    file
}

#[test]
fn versions_1_and_2_are_read_and_written_as_version_3() {
    let one = RelationalDomain::parse(VERSION_1.as_bytes(), "one.json").expect("version 1");
    let text = version_2().to_string();
    let two = RelationalDomain::parse(text.as_bytes(), "two.json").expect("version 2");
    assert_eq!(one, two);
    assert_eq!((one.states.len(), one.operators.len(), one.goals.len()), (5, 3, 1));
    let raw: Value = serde_json::from_str(VERSION_1).expect("JSON");
    for (state, raw) in one.states.iter().zip(raw["states"].as_array().expect("a list")) {
        let [place] = &state.places[..] else { panic!("{state:?}") };
        let mean = place.pose();
        assert_eq!(
            (json!(state.name), json!(place.count)),
            (raw["name"].clone(), raw["distinct"].clone())
        );
        for (axis, value) in mean.position.iter().enumerate() {
            let raw = raw["mean"]["position"][axis].as_f64().expect("a number");
            assert!((value - raw).abs() < 1e-12, "{state:?}");
        }
    }
    for (operator, raw) in one.operators.iter().zip(raw["operators"].as_array().expect("a list")) {
        assert_eq!(json!(operator.instances), raw["evidence"]["instances"]);
        assert_eq!(json!(one.names(&operator.never_seen)), raw["absent"]);
        // The state that the object leaves is no need of its own.
        for need in &operator.needs {
            let held = &raw["evidence"]["before"][need.condition.state];
            assert_eq!(json!(need.held), *held, "{operator:?}");
        }
    }
    let new = one.to_json().expect("plain data");
    assert!(new.contains("\"version\": 3"));
    assert_eq!(RelationalDomain::parse(new.as_bytes(), "new.json").expect("it is read"), one);
    let future = new.replace("\"version\": 3", "\"version\": 4");
    let refused = RelationalDomain::parse(future.as_bytes(), "d.json").expect_err("unknown");
    assert!(refused.to_string().contains("it is 4; expected 1 to 3"), "{refused}");
}

#[test]
fn faults_in_old_versions_name_their_field() {
    let two = version_2().to_string();
    let cases = [
        (VERSION_1, "/provenance", json!(7), "field `provenance`: it is 7; expected an object"),
        (VERSION_1, "/states/4/mean", json!([1]), "field `states[4].mean`: it is a list"),
        (VERSION_1, "/states/3/count", json!(-7.5), "field `states[3]`: invalid type"),
        (VERSION_1, "/states/0/name", json!("nut"), "`nut` cannot be a name"),
        (
            VERSION_1,
            "/operators/1/evidence",
            json!("x"),
            "field `operators[1].evidence`: it is `x`",
        ),
        (VERSION_1, "/operators/1/evidence/before", json!([1]), "has 1 counts; expected 5"),
        (VERSION_1, "/operators/1/kind", json!(-7.5), "field `operators[1]`: invalid type"),
        (VERSION_1, "/goal", json!("HAPPINESS"), "field `goal`: `HAPPINESS` is not a state"),
        (VERSION_1, "/states/0/mean/orientation/3", json!(9.0), "expected a unit quaternion"),
        (&two, "/states/1/learned", json!(7), "field `states[1].learned`: it is 7"),
        (&two, "/states/1/learned/origin", json!({"found": null}), "origin`: it is an object"),
        (&two, "/states/1/learned/covariance/0/0", json!(1e300), "a coordinate that is not usable"),
        (&two, "/operators/0/to", json!("NOWHERE"), "field `operators[0].to`: `NOWHERE`"),
        (&two, "/operators/0/removes", json!(["NO"]), "field `operators[0].removes[0]`"),
        (&two, "/operators/2/parameters", json!([7]), "field `operators[2]`"),
    ];
    for (text, at, value, part) in cases {
        let refused = exchanged(text, at, value);
        assert!(
            refused.starts_with("d.json") && refused.contains(part),
            "{at}: {part} in {refused}"
        );
    }
    let broken = VERSION_1.replacen("\"distinct\"", "\"different\"", 1);
    let refused =
        RelationalDomain::parse(broken.as_bytes(), "old.json").expect_err("unknown field");
    assert!(refused.to_string().contains("unknown field `different`"), "{refused}");
    let mut bare = version_2();
    bare["states"][0].as_object_mut().expect("an object").remove("learned");
    let refused = RelationalDomain::parse(bare.to_string().as_bytes(), "d").expect_err("bare");
    assert!(refused.to_string().contains("`states[0].learned`: it is missing"), "{refused}");
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
fn a_need_about_a_parameter_that_its_action_lacks_is_refused_and_not_ignored() {
    let about = |file: &mut Value, operator: usize, state: &str, role: &str| {
        let need = json!({
            "state": state, "subject": {"is": role}, "verdict": "required", "holds": true,
            "least": 1, "held": 5, "of": 5,
        });
        file["operators"][operator]["needs"].as_array_mut().expect("a list").push(need);
        RelationalDomain::parse(file.to_string().as_bytes(), "d.json").map_err(|e| e.to_string())
    };
    let world = || {
        let old = RelationalDomain::parse(VERSION_1.as_bytes(), "one.json").expect("version 1");
        serde_json::from_str(&old.to_json().expect("plain data")).expect("JSON")
    };
    let refused = about(&mut world(), 0, "NUT_AT_START", "target").expect_err("no target");
    assert!(refused.contains("`NUT_AT_START`, about its target, and has no target"), "{refused}");
    let refused = about(&mut world(), 0, "NUT_AT_START", "origin").expect_err("no origin");
    assert!(refused.contains("has no origin"), "{refused}");
    about(&mut world(), 2, "BOLT_AT_START", "object").expect("every action has an object");
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
    let layout = Classifier::new(domain).classify(scene);
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
