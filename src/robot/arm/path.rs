//! Paths of joint angles, run from rest to rest.

use rapier3d::math::{Pose as Frame, Vector};
use serde::{Deserialize, Serialize};

use super::kinematics::{self, Angles, JOINTS};
use super::spec::ArmSpec;

/// A sequence of joint angles, run at a smoothly changing speed in a given time.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Path {
    points: Vec<Angles>,
    duration_s: f64,
}

/// Peak over mean speed of the profile `10 u^3 - 15 u^4 + 6 u^5`.
const PEAK: f64 = 1.875;
/// Peak acceleration of the same profile, as a multiple of distance over duration squared.
const STEEPEST: f64 = 5.774;
/// Shortest time of a path, in seconds.
const SHORTEST_S: f64 = 0.1;
/// Distance between the points of a straight line, in metres.
const LINE_STEP_M: f64 = 0.004;

/// Number of pieces into which a path is divided to measure the end effector's movement.
const LOOKS: usize = 16;

fn farthest(a: &Angles, b: &Angles) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

impl Path {
    /// Returns the path that is straight in joint angles. `held` says whether a part is in the hand.
    pub fn joints(from: &Angles, to: &Angles, arm: &ArmSpec, held: bool) -> Self {
        let (speed, acceleration) = match held {
            false => (arm.speed, arm.acceleration[0]),
            true => (arm.carry_speed, arm.acceleration[1]),
        };
        let way = farthest(from, to);
        let duration_s = (PEAK * way / speed).max((STEEPEST * way / acceleration).sqrt());
        let duration_s = duration_s.max(SHORTEST_S);
        let mut path = Self { points: vec![*from, *to], duration_s };
        if held {
            let places: Vec<Vector> =
                path.samples(LOOKS).map(|q| kinematics::tool(&q).translation).collect();
            let farthest = places.windows(2).map(|w| (w[1] - w[0]).length()).fold(0.0, f64::max);
            let slowest = PEAK * farthest * LOOKS as f64 / arm.carry_m_s;
            path.duration_s = path.duration_s.max(slowest);
        }
        path
    }

    /// Returns the path on which the end effector moves straight by `shift` from its place at `from`, without
    /// turning; `None` if the arm cannot follow.
    pub fn line(from: &Angles, shift: Vector, arm: &ArmSpec) -> Option<Self> {
        let start = kinematics::tool(from);
        let target = Frame::from_parts(start.translation + shift, start.rotation);
        Self::line_to(from, &target, arm)
    }

    /// Returns the path on which the end effector moves straight to `target` and turns evenly; `None` if the
    /// arm cannot follow.
    pub fn line_to(from: &Angles, target: &Frame, arm: &ArmSpec) -> Option<Self> {
        let start = kinematics::tool(from);
        let way = (target.translation - start.translation).length();
        let count = (way / LINE_STEP_M).ceil().max(1.0) as usize;
        let mut points = vec![*from];
        let mut q = *from;
        for step in 1..=count {
            let between = start.lerp(target, step as f64 / count as f64);
            let next = kinematics::solve_near(&between, &q)?;
            // A large step means a jump to another posture.
            if farthest(&q, &next) > 0.15 {
                return None;
            }
            q = next;
            points.push(q);
        }
        let mut duration_s = (PEAK * way / arm.approach_m_s).max(SHORTEST_S);
        let fastest = points.windows(2).map(|w| farthest(&w[0], &w[1])).fold(0.0, f64::max);
        duration_s = duration_s.max(PEAK * fastest * count as f64 / arm.speed);
        Some(Self { points, duration_s })
    }

    /// Returns the path run backwards.
    pub fn reversed(mut self) -> Self {
        self.points.reverse();
        self
    }

    /// Returns the path run so slowly that it lasts at least `duration_s` seconds.
    pub fn lasting(mut self, duration_s: f64) -> Self {
        self.duration_s = self.duration_s.max(duration_s);
        self
    }

    /// Returns the duration, in seconds.
    pub fn duration_s(&self) -> f64 {
        self.duration_s
    }

    /// Returns the last joint angles.
    pub fn end(&self) -> Angles {
        self.points[self.points.len() - 1]
    }

    /// Returns joint angles and speeds `time_s` seconds after the start.
    pub fn at(&self, time_s: f64) -> (Angles, Angles) {
        let u = (time_s / self.duration_s).clamp(0.0, 1.0);
        let share = u * u * u * (10.0 - 15.0 * u + 6.0 * u * u);
        let rate = 30.0 * u * u * (1.0 - u) * (1.0 - u) / self.duration_s;
        let legs = (self.points.len() - 1) as f64;
        let leg = ((share * legs) as usize).min(self.points.len() - 2);
        let within = share * legs - leg as f64;
        let (from, to) = (&self.points[leg], &self.points[leg + 1]);
        let mut angles = [0.0; JOINTS];
        let mut speeds = [0.0; JOINTS];
        for joint in 0..JOINTS {
            let by = to[joint] - from[joint];
            angles[joint] = from[joint] + within * by;
            speeds[joint] = by * legs * rate;
        }
        (angles, speeds)
    }

    /// Returns the number of samples needed so that no joint turns by more than `most` radians between two samples; at
    /// least 8.
    pub fn looks(&self, most: f64) -> usize {
        let ways = self.points.windows(2).map(|w| farthest(&w[0], &w[1]));
        let steepest = ways.fold(0.0, f64::max) * (self.points.len() - 1) as f64;
        ((steepest / most).ceil() as usize).max(8)
    }

    /// Returns joint angles along the path, evenly spaced, ends included.
    pub fn samples(&self, count: usize) -> impl Iterator<Item = Angles> {
        let legs = (self.points.len() - 1) as f64;
        (0..=count).map(move |i| {
            let share = i as f64 / count as f64 * legs;
            let leg = (share as usize).min(self.points.len() - 2);
            let within = share - leg as f64;
            std::array::from_fn(|joint| {
                let (from, to) = (self.points[leg][joint], self.points[leg + 1][joint]);
                from + within * (to - from)
            })
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_path_begins_and_ends_at_rest_and_its_speed_is_its_derivative() {
        let mut to = kinematics::HOME;
        to[0] += 1.0;
        let path = Path::joints(&kinematics::HOME, &to, &ArmSpec::default(), false);
        for (time_s, at) in [(0.0, kinematics::HOME), (path.duration_s(), to)] {
            let (angles, speeds) = path.at(time_s);
            assert!(farthest(&angles, &at) < 1e-12);
            assert!(farthest(&speeds, &[0.0; JOINTS]) < 1e-9);
        }
        let (mid, h) = (0.4 * path.duration_s(), 1e-6);
        let (speeds, rise) = (path.at(mid).1, path.at(mid + h).0[0] - path.at(mid - h).0[0]);
        assert!((speeds[0] - rise / (2.0 * h)).abs() < 1e-6);
        assert!(speeds[0] > 0.5 && speeds[0] <= ArmSpec::default().speed + 1e-9);
    }

    #[test]
    fn a_line_is_straight() {
        let path =
            Path::line(&kinematics::HOME, Vector::new(0.05, 0.03, -0.1), &ArmSpec::default());
        let path = path.expect("it is within reach");
        let start = kinematics::tool(&kinematics::HOME);
        let way = Vector::new(0.05, 0.03, -0.1);
        let mut seen = 0;
        for angles in path.samples(37) {
            let by = kinematics::tool(&angles).translation - start.translation;
            let off = by - way * (by.dot(way) / way.length_squared());
            assert!(off.length() < 1e-4, "{}", off.length());
            seen += 1;
        }
        assert_eq!(seen, 38);
    }
}
