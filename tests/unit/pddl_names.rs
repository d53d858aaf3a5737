//! Unit tests of `src/plan/strips/names.rs`.

use super::*;

#[test]
fn names_that_differ_in_case_or_blanks_alone_stay_different() {
    let mut names = Names::new();
    let given = ["Nut 1", "nut-1", "NUT-1", "1st", "", "and", "Müller", "Nut 1"];
    let given = given.map(|name| names.of(name));
    assert_eq!(given, ["nut-1", "nut-1-2", "nut-1-3", "n-1st", "n-", "and-2", "m-ller", "nut-1"]);
    let renamed = names.renamed();
    assert_eq!(renamed.len(), 7);
    assert!(renamed.contains(&("Nut 1".into(), "nut-1".into())));
}
