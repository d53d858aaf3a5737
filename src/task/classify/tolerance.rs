//! How closely a placed object must agree with the demonstrations, and by how much it misses a place.
//!
//! A placed object rests on something. What it rests on fixes its height and the tilt of its upright axis to
//! micrometres, whoever put it there. Sideways it may have play, such as a peg in its bore. The
//! deviations are therefore measured in three directions, each with its own standard deviation.
//!
//! # Variances
//!
//! A place with `n` distinct poses and the sample variance `s^2` predicts the next pose with the variance
//!
//! ```text
//! play^2 + noise^2 + (1 + 1/n) (prior^2 + (n - 1) s^2) / n
//! ```
//!
//! The last term is the predictive variance of a Gaussian whose variance has a scaled inverse chi-squared prior with one
//! degree of freedom (Gelman et al., Bayesian Data Analysis, section 3.3). The prior is pooled over all placed states of
//! the domain, as in empirical Bayes methods for few samples (Smyth, Statistical Applications in Genetics and Molecular
//! Biology 3(1), 2004). It is the weighted median of their variances, which a few loosely placed states do not shift.
//! The play is a constant. A demonstrator that repeats itself within micrometres does not show how far a part can be
//! pushed within its clearance.
//!
//! Limits are given in standard deviations, and a standard deviation that was learned from few poses is uncertain itself.
//! Its share is therefore widened by [`widening`]: the quantile of Student's t distribution that leaves out 1 pose in
//! 5,000, over the limit of five. That is 1.94 for five poses, 1.14 for ten, and 1 from fourteen on. Two to four poses
//! count as five do, because their quantiles would accept everything.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use crate::robot::Pose;

/// Standard deviations in the three directions: in height and sideways in metres, and of the tilt about each horizontal
/// axis in radians.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Directions {
    pub height_m: f64,
    pub aside_m: f64,
    pub tilt_rad: f64,
}

/// Play of a placed object. At a limit of 5 standard deviations this accepts 1 mm in height, 3 mm sideways and 3 degrees.
/// In 584 looks at parts that were put into a fixture, with parts dropped at a rate of 0.3, correctly seated parts were at most
/// 0.01 mm, 1.4 mm and 0.1 degrees off; parts that had come to rest wrongly at least 2.6 mm and 10 degrees.
pub(crate) const PLAY: Directions = Directions { height_m: 2e-4, aside_m: 6e-4, tilt_rad: 0.0105 };
/// Priors of a domain without any placed state that was seen twice.
const UNKNOWN: Directions = Directions { height_m: 2e-4, aside_m: 1e-3, tilt_rad: 0.015 };
/// Greatest weight of one state: a file may claim more poses than memory has bytes.
const MOST_DOF: usize = 1 << 20;
/// Greatest priors.
const MOST: Directions = Directions { height_m: 3e-3, aside_m: 3e-3, tilt_rad: 0.06 };

/// Returns the predictive variance of a place with this number of distinct poses, without play and noise, widened for few
/// poses.
pub(crate) fn predictive(prior: f64, sd: f64, poses: usize) -> f64 {
    let n = poses.max(1) as f64;
    widening(poses).powi(2) * (1.0 + 1.0 / n) * (prior * prior + (n - 1.0) * sd * sd) / n
}

/// Least and greatest number of poses whose standard deviation is widened as such.
const FEW: (usize, usize) = (5, 13);
/// Quantiles of Student's t distribution with `FEW.0` to `FEW.1` degrees of freedom that leave out 1 of 5,000 values on
/// both sides together, over the limit of five.
const WIDENING: [f64; 9] = [1.935, 1.604, 1.413, 1.288, 1.202, 1.139, 1.090, 1.052, 1.021];

/// Returns the factor by which a standard deviation learned from this number of distinct poses is widened. A place that was
/// seen once has the prior alone, which is not.
pub(crate) fn widening(poses: usize) -> f64 {
    match poses {
        0 | 1 => 1.0,
        n if n > FEW.1 => 1.0,
        n => WIDENING[n.max(FEW.0) - FEW.0],
    }
}

/// Collects the variances of the placed states of a domain.
#[derive(Debug, Clone, Default)]
pub(crate) struct Pool {
    height: Vec<(f64, usize)>,
    aside: Vec<(f64, usize)>,
    tilt: Vec<(f64, usize)>,
}

impl Pool {
    /// Adds a standard deviation along a direction of which `up` is the vertical component.
    pub fn position(&mut self, up: f64, sd: f64, dof: usize) {
        let list = if up * up > 0.5 { &mut self.height } else { &mut self.aside };
        list.push((sd * sd, dof.min(MOST_DOF)));
    }

    /// Adds the standard deviation of a tilt.
    pub fn tilt(&mut self, sd: f64, dof: usize) {
        self.tilt.push((sd * sd, dof.min(MOST_DOF)));
    }

    /// Returns the pooled standard deviations.
    pub fn priors(mut self) -> Directions {
        let of = |list: &mut Vec<(f64, usize)>, unknown: f64, most: f64| {
            median(list).map_or(unknown, |variance| variance.sqrt().min(most))
        };
        Directions {
            height_m: of(&mut self.height, UNKNOWN.height_m, MOST.height_m),
            aside_m: of(&mut self.aside, UNKNOWN.aside_m, MOST.aside_m),
            tilt_rad: of(&mut self.tilt, UNKNOWN.tilt_rad, MOST.tilt_rad),
        }
    }
}

/// Returns the median weighted by the degrees of freedom; `None` if there are none.
fn median(list: &mut Vec<(f64, usize)>) -> Option<f64> {
    list.retain(|(_, dof)| *dof > 0);
    list.sort_by(|a, b| a.0.total_cmp(&b.0));
    let total: usize = list.iter().map(|(_, dof)| dof).sum();
    let at = |share: usize| {
        let mut sum = 0;
        let reached = list.iter().find(|(_, dof)| {
            sum += dof;
            2 * sum > share
        });
        reached.map(|(variance, _)| *variance)
    };
    // With an even split, the mean of the two values in the middle.
    let (low, high) = (at(total.saturating_sub(1))?, at(total)?);
    Some(0.5 * (low + high))
}

/// Returns the variance of the play along a direction of which `up` is the vertical component.
pub(crate) fn between(directions: &Directions, up: f64) -> f64 {
    let (height, aside) = (directions.height_m.powi(2), directions.aside_m.powi(2));
    aside + (height - aside) * (up * up).min(1.0)
}

/// Returns the vertical coordinate of the world frame. Each table of states in which objects were found is given as
/// three flags: whether each coordinate agrees between the objects. Objects that lie anywhere on a table agree in their
/// height alone. `None` if no state shows it, or if two states disagree.
pub(crate) fn up_axis(tables: impl Iterator<Item = [bool; 3]>) -> Option<usize> {
    let mut up = None;
    for agrees in tables {
        let [axis] = (0..3).filter(|i| agrees[*i]).collect::<Vec<usize>>()[..] else { continue };
        if up.is_some_and(|up| up != axis) {
            return None;
        }
        up = Some(axis);
    }
    up
}

/// Returns the tilt of an object: the angle between its upright axis now and in the mean pose, in radians. `up` is the
/// vertical in the frame of the poses. An object that is upside down does not count as tilted.
pub(crate) fn tilt(up: &Vector3<f64>, mean: &Pose, pose: &Pose) -> f64 {
    let own = mean.rotation().inverse() * up;
    let angle = (pose.rotation() * own).angle(up);
    angle.min(std::f64::consts::PI - angle)
}

/// How a pose differs from a place.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Offset {
    /// Distance to the place, over its constrained coordinates, in metres.
    pub off_m: f64,
    /// Height above the place, in metres; negative below. 0 if the vertical is unknown.
    pub high_m: f64,
    /// Tilt, or the angle by which the orientation differs if the state constrains it otherwise, in radians.
    pub off_rad: f64,
    /// Whether the angle is one on the spot, of something that lies, and no tilt.
    #[serde(skip)]
    pub turned: bool,
}

/// Length by which an angle is turned into a distance to find the nearest place, in metres: the size of a part.
const LEVER_M: f64 = 0.02;
/// Smallest height, distance and angle that are put into words.
const SAID: (f64, f64, f64) = (2e-4, 5e-4, 0.017);

impl Offset {
    /// Returns the offset of a deviation from a place.
    pub(crate) fn of(deviation: &Vector3<f64>, up: Option<&Vector3<f64>>, off_rad: f64) -> Self {
        let high_m = up.map_or(0.0, |up| deviation.dot(up));
        Self { off_m: deviation.norm(), high_m, off_rad, turned: false }
    }

    /// Returns position and angle as one distance, in metres.
    pub(crate) fn distance(&self) -> f64 {
        self.off_m + LEVER_M * self.off_rad
    }

    /// Returns the offset in words, such as `2.6 mm too high and tilted by 10 degrees`.
    pub fn in_words(&self) -> String {
        let mut parts: Vec<String> = Vec::new();
        let millimetres = |m: f64| format!("{:.1} mm", 1e3 * m);
        let aside_m = (self.off_m * self.off_m - self.high_m * self.high_m).max(0.0).sqrt();
        if self.high_m.abs() >= SAID.0 {
            let way = if self.high_m > 0.0 { "high" } else { "low" };
            parts.push(format!("{} too {way}", millimetres(self.high_m.abs())));
        }
        if aside_m >= SAID.1 {
            // Without the vertical, nobody knows in which direction.
            let way = if self.high_m == 0.0 { "off" } else { "aside" };
            parts.push(format!("{} {way}", millimetres(aside_m)));
        }
        if self.off_rad >= SAID.2 {
            let way = if self.turned { "turned" } else { "tilted" };
            parts.push(format!("{way} by {:.0} degrees", self.off_rad.to_degrees()));
        }
        match parts.pop() {
            None => format!("{} off", millimetres(self.off_m)),
            Some(last) if parts.is_empty() => last,
            Some(last) => format!("{} and {last}", parts.join(", ")),
        }
    }
}

#[cfg(test)]
#[path = "../../../tests/unit/classify_tolerance.rs"]
mod tests;
