//! Unit tests of `src/task/tasks/file/shape.rs`.

use super::*;

#[test]
fn a_prism_has_flats_at_its_radius_and_a_ring_is_hollow() {
    let prism = Shape::Prism {
        base: [0.0, 0.0, -0.01],
        radius_m: 0.01,
        top_radius_m: None,
        height_m: 0.02,
        sides: 6,
    };
    let [piece] = &prism.pieces()[..] else { panic!("one piece") };
    let far = piece.iter().map(|c| c[0]).fold(0.0, f64::max);
    assert!((far - 0.01).abs() < 1e-12, "{far}");
    let ring = Shape::Ring {
        base: [0.0; 3],
        inner_m: 0.01,
        outer_m: 0.02,
        height_m: 0.02,
        chamfer_m: 0.002,
        sides: 8,
    };
    let pieces = ring.pieces();
    assert_eq!(pieces.len(), 8);
    let near = pieces.iter().flatten().map(|c| c[0].hypot(c[1])).fold(1.0, f64::min);
    assert!(near >= 0.01, "{near}");
}
