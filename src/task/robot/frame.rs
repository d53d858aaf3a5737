//! Poses as the frames that Rapier works with, and back.

use rapier3d::math::{Pose as Frame, Rotation, Vector};

use crate::task::domain::Pose;

pub(crate) fn frame_of(pose: &Pose) -> Frame {
    let [x, y, z, w] = pose.orientation;
    Frame::from_parts(Vector::from(pose.position), Rotation::from_xyzw(x, y, z, w).normalize())
}

pub(crate) fn pose_of(frame: &Frame) -> Pose {
    let q = frame.rotation.normalize();
    Pose { position: frame.translation.to_array(), orientation: [q.x, q.y, q.z, q.w] }
}
