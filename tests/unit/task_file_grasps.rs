//! Unit tests of `src/task/tasks/file/grasps.rs`.

use super::*;
use crate::task::tasks::file::format::Around;

#[test]
fn a_cube_is_grasped_from_above_on_whichever_side_it_lies() {
    let side = GraspData {
        at: [0.0, 0.0, -0.006],
        beyond_m: 0.0,
        approach: [0.0, 0.0, -1.0],
        closing: [1.0, 0.0, 0.0],
        openings_m: vec![0.02],
        tilts_deg: vec![0.0, 40.0],
        most_deg: 60.0,
        around: Some(Around { axis: [0.0, 0.0, 1.0], times: 2 }),
    };
    let upright = grasps(std::slice::from_ref(&side), &BodyFrame::at([0.4, 0.0, 0.012]));
    assert_eq!(
        upright.len(),
        6,
        "two senses, which half a turn repeats, and as many for each tilt"
    );
    assert_eq!(upright[0].at, [0.4, 0.0, 0.012 - 0.006 + FINGER_TIP_M]);
    assert!((upright[0].approach[2] + 1.0).abs() < 1e-12);
    assert!((upright[2].approach[2] + 40f64.to_radians().cos()).abs() < 1e-12);
    let fallen = Turn::about_x(std::f64::consts::FRAC_PI_2);
    let fallen = BodyFrame { position: [0.4, 0.0, 0.012], turn: fallen };
    assert!(grasps(std::slice::from_ref(&side), &fallen).len() == 2, "only tilts towards the side");
    let around_x = Some(Around { axis: [1.0, 0.0, 0.0], times: 4 });
    let any = GraspData { around: around_x, ..side };
    assert!(grasps(&[any], &fallen).iter().take(2).all(|g| g.approach[2] < -0.99));
}
