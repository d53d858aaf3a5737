//! Unit tests of `src/task/domain/frame.rs`.

use super::*;

#[test]
fn a_pose_returns_from_the_frame_of_a_turned_reference() {
    let half = 40f64.to_radians() / 2.0;
    let reference =
        Pose { position: [0.3, -0.2, 0.1], orientation: [0.0, 0.0, half.sin(), half.cos()] };
    let pose = Pose { position: [0.5, 0.1, 0.4], orientation: [0.5, 0.5, 0.5, 0.5] };
    let there = relative(&reference, &pose);
    assert!((there.position[2] - 0.3).abs() < 1e-12);
    let back = world_pose(&reference, &there);
    for (a, b) in back.position.iter().zip(pose.position) {
        assert!((a - b).abs() < 1e-12);
    }
    let dot: f64 = back.orientation.iter().zip(pose.orientation).map(|(a, b)| a * b).sum();
    assert!((dot.abs() - 1.0).abs() < 1e-12);
}
