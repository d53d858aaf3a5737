//! Unit tests of `src/task/learn/names.rs`.

use super::*;

#[test]
fn strange_kinds_give_harmless_names() {
    assert_eq!(symbol("nut"), "NUT");
    assert_eq!(symbol("<script>"), "KIND__SCRIPT_");
    assert_eq!(symbol("3mm bolt"), "KIND_3MM_BOLT");
    assert_eq!(symbol("écrou"), "KIND__CROU");
    let long = symbol(&"x".repeat(500));
    assert!(
        is_symbol(&long) && is_symbol(&state_name(&long, Origin::Found, &Pose::at([0.0; 3]), &[]))
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
    let name = |x: f64| state_name("bolt", Origin::Placed, &Pose::at([x, 0.06, 0.0]), &marks);
    assert_eq!(name(0.01), "BOLT_AT_NUT_HOLE");
    assert_eq!(name(0.19), "BOLT_AT_BOLT_HOLE");
    assert_eq!(name(0.9), "BOLT_PLACED");
}
