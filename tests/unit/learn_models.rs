//! Unit tests of `src/task/learn/relational/models.rs`.

use super::range;

#[test]
fn one_roller_that_rolled_away_does_not_widen_the_place() {
    let mut values: Vec<f64> = (0..11).map(|i| -0.03 + 0.006 * f64::from(i)).collect();
    let whole = range(&values, true);
    values.push(0.244);
    assert_eq!(range(&values, true), whole);
    // On the table, objects may lie anywhere.
    assert_eq!(range(&values, false).1, 0.244);
    values.insert(0, -0.2);
    assert_eq!(range(&values, true).0, -0.2);
    assert_eq!(range(&[0.0, 0.0, 1.0], true), (0.0, 1.0));
}
