//! Unit tests of `src/task/learn/operators.rs`.

use super::*;

const NUT_ON_TABLE: StateId = StateId::new(0);
const BOLT_ON_TABLE: StateId = StateId::new(1);
const NUT_IN_JIG: StateId = StateId::new(2);
const BOLT_IN_JIG: StateId = StateId::new(3);
const BOLT_ASSEMBLED: StateId = StateId::new(4);

fn instance(before: [u8; 5], after: [u8; 5]) -> Instance {
    let flags = |bits: [u8; 5]| bits.iter().map(|b| *b == 1).collect();
    Instance { before: flags(before), after: flags(after) }
}

/// The three demonstrations of PUT_NUT_IN_JIG in the paper's Tables I, II and III.
fn paper_tables() -> [Instance; 3] {
    [
        instance([1, 0, 0, 0, 0], [0, 0, 1, 0, 0]),
        instance([1, 1, 0, 0, 0], [0, 1, 1, 0, 0]),
        instance([1, 0, 0, 0, 0], [0, 0, 1, 1, 0]),
    ]
}

#[test]
fn table_i_alone_gives_the_precondition_and_the_effect() {
    let evidence = Evidence::count(&paper_tables()[..1]);
    assert_eq!(evidence.preconditions(), [NUT_ON_TABLE]);
    assert_eq!(evidence.effects(), [NUT_IN_JIG]);
}

#[test]
fn table_ii_adds_no_precondition_that_table_i_did_without() {
    let tables = paper_tables();
    let alone = Evidence::count(&tables[1..2]);
    assert_eq!(alone.preconditions(), [NUT_ON_TABLE, BOLT_ON_TABLE]);
    let both = Evidence::count(&tables[..2]);
    assert_eq!(both.before, [2, 1, 0, 0, 0]);
    assert_eq!(both.preconditions(), [NUT_ON_TABLE]);
}

#[test]
fn table_iii_adds_no_effect_that_somebody_else_caused() {
    let tables = paper_tables();
    let alone = Evidence::count(&tables[2..]);
    assert_eq!(alone.effects(), [NUT_IN_JIG, BOLT_IN_JIG]);
    let all = Evidence::count(&tables);
    assert_eq!(all.instances, 3);
    assert_eq!(all.change, [-3, 0, 3, 1, 0]);
    assert_eq!(all.preconditions(), [NUT_ON_TABLE]);
    assert_eq!(all.effects(), [NUT_IN_JIG]);
    assert_eq!(all.absent(), [NUT_IN_JIG, BOLT_IN_JIG, BOLT_ASSEMBLED]);
}

#[test]
fn an_action_with_two_preconditions_keeps_both() {
    let evidence = Evidence::count(&[
        instance([1, 1, 1, 1, 0], [1, 1, 1, 0, 1]),
        instance([0, 0, 1, 1, 0], [0, 0, 1, 0, 1]),
    ]);
    assert_eq!(evidence.preconditions(), [NUT_IN_JIG, BOLT_IN_JIG]);
    assert_eq!(evidence.effects(), [BOLT_ASSEMBLED]);
}

#[test]
fn no_instances_give_no_claims() {
    let none = Evidence::count(&[]);
    assert!(none.preconditions().is_empty() && none.effects().is_empty());
    assert!(none.absent().is_empty());
}
