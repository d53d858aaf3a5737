//! The robot's motors, speeds and forces, in SI units.

use serde::{Deserialize, Serialize};

use crate::task::error::TaskError;

/// Refuses the first number that is outside its range: name, number, least, most.
pub(crate) fn in_range(numbers: &[(&'static str, f64, f64, f64)]) -> Result<(), TaskError> {
    match numbers.iter().find(|(_, value, least, most)| !(least..=most).contains(&value)) {
        Some(&(name, value, least, most)) => Err(TaskError::Range { name, value, least, most }),
        None => Ok(()),
    }
}

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

impl GripperSpec {
    /// Checks the numbers.
    ///
    /// # Errors
    /// [`TaskError::Range`], naming the setting.
    pub fn check(&self) -> Result<(), TaskError> {
        in_range(&[
            ("gripper.force_n", self.force_n, 0.1, 1e3),
            ("gripper.friction", self.friction, 1e-3, 10.0),
            ("gripper.stroke_m", self.stroke_m, 5e-3, 0.06),
            ("gripper.frequency", self.frequency, 1.0, 5e3),
        ])
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

impl ArmSpec {
    /// Checks the numbers, for steps of `step_ms`.
    ///
    /// # Errors
    /// [`TaskError::Range`] or [`TaskError::Setting`], naming the setting.
    pub fn check(&self, step_ms: u64) -> Result<(), TaskError> {
        let gain = 1e3 / step_ms.max(1) as f64;
        in_range(&[
            ("arm.position_gain", self.position_gain, 1.0, gain),
            ("arm.velocity_gain", self.velocity_gain, 1.0, 1e5),
            ("arm.armature", self.armature, 0.0, 100.0),
            ("arm.speed", self.speed, 0.05, 10.0),
            ("arm.carry_speed", self.carry_speed, 0.05, 10.0),
            ("arm.carry_m_s", self.carry_m_s, 0.05, 10.0),
            ("arm.acceleration", self.acceleration[0], 0.1, 1e3),
            ("arm.acceleration", self.acceleration[1], 0.1, 1e3),
            ("arm.approach_m_s", self.approach_m_s, 0.01, 2.0),
            ("arm.alarm_m", self.alarm_m, 1e-3, 0.1),
        ])?;
        match self.torque_nm.iter().find(|t| !(0.0..=1e4).contains(*t)) {
            Some(bad) => Err(TaskError::Setting {
                name: "arm.torque_nm",
                value: bad.to_string(),
                expected: "0 to 10000 for each joint",
            }),
            None => Ok(()),
        }
    }
}
