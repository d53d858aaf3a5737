//! Settings of the robot's motors, speeds and forces, in SI units.

use serde::{Deserialize, Serialize};

use crate::robot::error::{RobotError, in_range};

/// The gripper: two fingers that close towards each other.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct GripperSpec {
    /// Force of each finger, in newtons.
    pub force_n: f64,
    /// Coefficient of friction of the pads. Between pad and part, the greater of the two coefficients
    /// applies.
    pub friction: f64,
    /// Greatest distance of each finger from the middle of the gripper, in metres.
    pub stroke_m: f64,
    /// Natural frequency of the fingers' motors, in radians per second.
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
    /// [`RobotError::Range`], naming the setting.
    pub fn check(&self) -> Result<(), RobotError> {
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
    /// Speed demanded for each radian of a joint's error, in radians per second per radian.
    pub position_gain: f64,
    /// Acceleration demanded of a stretched arm for each unit of speed error, in radians per second squared
    /// per radian per second.
    pub velocity_gain: f64,
    /// Reflected inertia of each motor, in kilogram square metres.
    pub armature: f64,
    /// Greatest torque of each motor, in newton metres.
    pub torque_nm: [f64; 7],
    /// Greatest speed of a joint while the hand is empty, in radians per second.
    pub speed: f64,
    /// Greatest speed of a joint while the hand holds a part, in radians per second.
    pub carry_speed: f64,
    /// Greatest speed of the end effector while it holds a part, in metres per second.
    pub carry_m_s: f64,
    /// Greatest acceleration of a joint, in radians per second squared: first with an empty hand, then with a part in
    /// the hand.
    pub acceleration: [f64; 2],
    /// Greatest speed of the end effector near parts, in metres per second.
    pub approach_m_s: f64,
    /// Position error of the end effector above which the arm is taken to have hit something, in metres.
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
            // Below the reduced speed of ISO 10218-1 (0.25). A held part creeps more at higher speeds.
            carry_m_s: 0.16,
            acceleration: [8.0, 3.0],
            approach_m_s: 0.12,
            alarm_m: 0.006,
        }
    }
}

impl ArmSpec {
    /// Checks the numbers for physics steps of `step_ms` milliseconds.
    ///
    /// # Errors
    /// [`RobotError::Range`] or [`RobotError::Setting`], naming the setting.
    pub fn check(&self, step_ms: u64) -> Result<(), RobotError> {
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
            Some(bad) => Err(RobotError::Setting {
                name: "arm.torque_nm",
                value: bad.to_string(),
                expected: "0 to 10000 for each joint",
            }),
            None => Ok(()),
        }
    }
}
