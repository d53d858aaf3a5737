//! Unit tests of `src/task/domain/naming/`.

use super::nouns::{plural, symbol};
use super::states::Landmark;
use super::*;
use crate::robot::Pose;
use crate::task::domain::Origin;
use crate::task::propositional::is_symbol;

#[test]
fn strange_kinds_give_harmless_names() {
    assert_eq!(symbol("nut"), "NUT");
    assert_eq!(symbol("<script>"), "KIND__SCRIPT_");
    assert_eq!(symbol("3mm bolt"), "KIND_3MM_BOLT");
    assert_eq!(symbol("écrou"), "KIND__CROU");
    let long = symbol(&"x".repeat(500));
    assert!(
        is_symbol(&long)
            && is_symbol(&symbol_in_world(&long, Origin::Found, &Pose::at([0.0; 3]), &[]))
    );
}

#[test]
fn a_name_is_given_once() {
    let mut names = Names::default();
    assert_eq!(names.take("NUT_AT_START"), "NUT_AT_START");
    assert_eq!(names.take("NUT_AT_START"), "NUT_AT_START_2");
    assert_eq!(names.take("NOTHING"), "NOTHING_2");
}

#[test]
fn the_nearest_landmark_names_a_place() {
    let hole = |kind: &str, x: f64| Landmark { kind: kind.into(), pose: Pose::at([x, 0.0, 0.0]) };
    let marks = [hole("nut_hole", 0.0), hole("bolt_hole", 0.2)];
    let name = |x: f64| symbol_in_world("bolt", Origin::Placed, &Pose::at([x, 0.06, 0.0]), &marks);
    assert_eq!(name(0.01), "BOLT_AT_NUT_HOLE");
    assert_eq!(name(0.19), "BOLT_AT_BOLT_HOLE");
    assert_eq!(name(0.9), "BOLT_PLACED");
}

#[test]
fn a_kind_is_a_noun() {
    assert_eq!(noun("bolt_hole"), "bolt hole");
    assert_eq!(noun("Red_Block"), "red block");
    assert_eq!(noun("___"), "___");
    assert_eq!(a("arm"), "an arm");
    for (one, many) in [
        ("bolt", "bolts"),
        ("box", "boxes"),
        ("dish", "dishes"),
        ("knife", "knives"),
        ("shelf", "shelves"),
        ("assembly", "assemblies"),
        ("tray", "trays"),
    ] {
        assert_eq!(plural(one), many);
    }
}

#[test]
fn every_object_has_a_name_of_its_own() {
    let names = |all: &[(&str, &str)]| object_names(all.iter().copied());
    let scene = [("nut_0", "nut"), ("bolt_0", "bolt"), ("bolt_1", "bolt"), ("left", "bolt")];
    assert_eq!(names(&scene), ["the nut", "bolt 0", "bolt 1", "left"]);
    let odd = [("a_b", "k"), ("a b", "k"), ("bolt", "bolt"), ("bolt_7", "bolt")];
    let odd = names(&odd);
    assert_eq!(odd, ["a_b", "a b", "bolt", "bolt 7"], "ids that differ in `_` alone stay ids");
}

#[test]
fn a_sentence_is_said_of_one_of_several_and_of_none() {
    let say = Statement::new("a nut is in a nut pocket", "nut").at(Some("nut_pocket"), "pocket 2");
    assert_eq!(say.about("nut 1"), "nut 1 is in pocket 2");
    assert_eq!(say.about_any(" other than nut 1"), "a nut other than nut 1 is in pocket 2");
    assert_eq!(say.about_some("at least 2", ""), "at least 2 nuts are in pocket 2");
    assert_eq!(say.about_none(""), "no nut is in pocket 2");
    let start = Statement::new("a nut is in its start area", "nut");
    assert_eq!(start.about_some("at least 2", ""), "at least 2 nuts are in their start area");
    assert_eq!(say.not_about("nut 1"), "nut 1 is not in pocket 2");
    // `a nut` is not a part of `a nut pocket`, and a reference that is not named comes last.
    let bolt = Statement::new("a bolt is in a nut pocket", "bolt").at(Some("nut"), "nut 0");
    assert_eq!(bolt.about_any(""), "a bolt is in a nut pocket at nut 0");
    // What a person wrote is kept whole.
    let own = Statement::new("done with a nut", "nut");
    assert_eq!(own.about("nut 1"), "done with nut 1");
    assert_eq!(own.about_some("at least 2", ""), "at least 2 times: done with a nut");
    assert_eq!(own.about_none(""), "never: done with a nut");
    assert_eq!(Statement::new("finished", "nut").about("nut 1"), "finished (nut 1)");
}

#[test]
fn what_lies_above_another_is_not_on_the_thing_below() {
    use crate::task::domain::{Coordinate, Frame, FrameState, Place, Turn};
    let at = |frame: &str, z: f64| FrameState {
        name: String::new(),
        kind: "block".into(),
        frame: Frame::Kind(frame.into()),
        places: vec![Place {
            coordinates: [0.0, 0.0, z].map(|mean| Coordinate::Tight { mean, sd: 1e-4 }),
            orientation: [0.0, 0.0, 0.0, 1.0],
            count: 5,
        }],
        turn: Turn::Free,
        turn_matters: false,
        origin: Origin::Placed,
        count: 5,
        any_coordinate: false,
    };
    let said = |frame: &str, heights: [f64; 2]| -> Vec<String> {
        let mut states = heights.map(|z| at(frame, z));
        name_all(&mut states, &mut [], &[], &[]).into_values().collect()
    };
    assert_eq!(said("pad", [0.025, 0.075]), ["a block is above a pad", "a block is on a pad"]);
    // It may be higher for another reason, or lie on another storey.
    assert!(said("pad", [0.025, 0.035]).iter().all(|words| words.contains(" on a pad")));
    assert!(said("shelf", [0.025, 0.325]).iter().all(|words| words.contains(" on a shelf")));
}

#[test]
fn each_of_two_drawers_is_closed_where_it_is_closed() {
    use crate::task::domain::{Coordinate, Frame, FrameState, Place, RelationalOperator, Turn};
    let at = |x: f64, y: f64| FrameState {
        name: String::new(),
        kind: "drawer".into(),
        frame: Frame::Kind("cabinet".into()),
        places: vec![Place {
            coordinates: [x, y, 0.01].map(|mean| Coordinate::Tight { mean, sd: 1e-4 }),
            orientation: [0.0, 0.0, 0.0, 1.0],
            count: 5,
        }],
        turn: Turn::Free,
        turn_matters: false,
        origin: Origin::Placed,
        count: 5,
        any_coordinate: false,
    };
    let slides = |from: usize, to: usize| RelationalOperator {
        name: String::new(),
        from: vec![from],
        to,
        needs: Vec::new(),
        order: Vec::new(),
        side_effects: Vec::new(),
        displacement: None,
        instances: 5,
        never_seen: Vec::new(),
    };
    let said = |moves: &[[usize; 2]]| -> Vec<String> {
        let mut states = [at(0.0, 0.045), at(0.085, 0.045), at(0.0, -0.045), at(0.085, -0.045)];
        let mut operators: Vec<_> = moves.iter().map(|[from, to]| slides(*from, *to)).collect();
        let words = name_all(&mut states, &mut operators, &[], &[]);
        states.iter().map(|state| words[&state.name].clone()).collect()
    };
    let own = [
        "a drawer is closed, 45 mm along y",
        "a drawer is open, 45 mm along y",
        "a drawer is closed, -45 mm along y",
        "a drawer is open, -45 mm along y",
    ];
    assert_eq!(said(&[[0, 1], [1, 0], [2, 3], [3, 2]]), own);
    // One that goes to all four places has one track.
    let one = said(&[[0, 1], [1, 2], [2, 3]]);
    assert_eq!(one.iter().filter(|words| words.contains("closed")).count(), 1, "{one:?}");
}

#[test]
fn a_part_in_a_box_on_another_face_is_not_said_to_be_in_its_start_area() {
    use crate::task::domain::{Fact, RelationalDomain};
    use crate::task::recording::ObjectPose;
    let learned = include_bytes!("../fixtures/learned/flange.json");
    let domain = RelationalDomain::parse(learned, "flange.json").expect("a domain");
    let state = domain.state("BOLT_AT_START").expect("a state");
    let fact = Fact { state, place: 0, reference: None };
    let within = domain.states[state].places[0].pose();
    let away = |m: f64| {
        let [x, y, z] = within.position;
        Pose { position: [x - m, y, z], ..within }
    };
    let names = ["bolt 0".to_owned()];
    let said = |pose: &Pose, first: &Pose| {
        let bolt = ObjectPose { id: "bolt_0".into(), kind: "bolt".into(), pose: *pose };
        domain.whereabouts(&fact, 0, &names, &[bolt], first)
    };
    assert_eq!(said(&within, &away(0.05)), "bolt 0 is in its start area");
    assert_eq!(said(&away(0.6), &within), "bolt 0 is loose, not in its start area");
    // The demonstrations seldom show all of the area: where it stood at first is in it.
    assert_eq!(said(&away(0.6), &away(0.6)), "bolt 0 is in its start area");
    // Standing on its head in a hole of the flange.
    let put =
        domain.states.iter().position(|s| s.frame.kind() == Some("flange") && s.kind == "bolt");
    let place = domain.states[put.expect("a state")].places[0].pose();
    let [x, y, z] = place.position;
    let lying = Pose { position: [x + 0.01, y, z], orientation: within.orientation };
    let object = |kind: &str, pose| ObjectPose { id: kind.into(), kind: kind.into(), pose };
    let all = [object("bolt", lying), object("flange", Pose::at([0.0; 3]))];
    let names = ["bolt 0", "the flange"].map(str::to_owned);
    let words = domain.whereabouts(&fact, 0, &names, &all, &within);
    assert_eq!(words, "bolt 0 is beside the flange, but lies wrongly there");
}
