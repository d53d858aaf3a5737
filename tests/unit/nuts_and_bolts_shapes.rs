//! Unit tests of `src/task/tasks/nuts_and_bolts/shapes.rs`.

use super::*;

#[test]
fn nuts_and_bolts_have_as_many_pieces_as_their_shapes_need() {
    let (part, jig) = (PartSpec::default(), JigSpec::default());
    let all = [nut(&part), bolt(&part), pocket_block(&jig, &part), hole_block(&jig, &part)];
    assert_eq!(all.map(|pieces| pieces.len()), [6, 2, 18, 18]);
}
