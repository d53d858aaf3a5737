//! The robot's motors, speeds and forces, in SI units.

use serde::{Deserialize, Serialize};

/// The gripper: two fingers that close on one another.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct GripperSpec {
    /// Newtons a finger.
    pub force_n: f64,
    /// Coefficient of friction of the pads; of pad and part the greater counts.
    pub friction: f64,
    /// How far each finger opens, in metres.
    pub stroke_m: f64,
    /// Natural frequency of the fingers' motors, in radians a second.
    pub frequency: f64,
}

impl Default for GripperSpec {
    fn default() -> Self {
        Self { force_n: 25.0, friction: 1.0, stroke_m: 0.04, frequency: 800.0 }
    }
}

/// Motors and speeds of the arm's seven joints.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ArmSpec {
    /// Speed that a joint's error asks for, in radians a second a radian.
    pub position_gain: f64,
    /// Acceleration that an error of speed asks of a stretched arm, in radians a second squared a radian
    /// a second.
    pub velocity_gain: f64,
    /// Reflected inertia of each motor, in kilogram square metres.
    pub armature: f64,
    /// Greatest torque of each motor, in newton metres.
    pub torque_nm: [f64; 7],
    /// Greatest speed of a joint while the hand is empty, in radians a second.
    pub speed: f64,
    /// Greatest speed of a joint while a part is in the hand, in radians a second.
    pub carry_speed: f64,
    /// Greatest speed of the tool while a part is in the hand, in metres a second.
    pub carry_m_s: f64,
    /// Greatest acceleration of a joint, in radians a second squared: empty, and with a part in the hand.
    pub acceleration: [f64; 2],
    /// Greatest speed of the tool near parts, in metres a second.
    pub approach_m_s: f64,
    /// Error of the tool's place above which the arm takes itself to have hit something, in metres.
    pub alarm_m: f64,
}

impl Default for ArmSpec {
    fn default() -> Self {
        Self {
            position_gain: 50.0,
            velocity_gain: 400.0,
            armature: 0.2,
            torque_nm: [87.0, 87.0, 87.0, 87.0, 12.0, 12.0, 12.0],
            speed: 2.0,
            carry_speed: 1.0,
            // Below ISO 10218-1's reduced speed of 0.25; what a part creeps in the hand grows with it.
            carry_m_s: 0.16,
            acceleration: [8.0, 3.0],
            approach_m_s: 0.12,
            alarm_m: 0.006,
        }
    }
}
