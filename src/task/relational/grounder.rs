//! Finds the state, the place and the reference of each object in a scene.

use nalgebra::Vector3;

use super::frame::relative;
use super::layout::{Fact, Layout};
use super::state::{Coordinate, FrameState, Place, Turn};
use super::{Frame, RelationalDomain};
use crate::task::domain::distance::p_distance;
use crate::task::domain::{Origin, Pose, Snapshot};
use crate::task::error::TaskError;

/// The state of one object of a scene.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Located {
    /// The state, place and reference; `None` if the object is in no state.
    pub fact: Option<Fact>,
    /// Distance to that state, or to the nearest state if the object is in none, in standard deviations. `None` if the
    /// kind has no states.
    pub distance: Option<f64>,
    /// Whether a second reference is as likely as the one in `fact`.
    pub ambiguous: bool,
}

/// Classifies objects by the states of a relational domain.
///
/// An object is in a state if its pose, in the frame of some reference, deviates from one of the state's places by at
/// most [`Grounder::LIMIT`] standard deviations, or the limit of [`Grounder::with_limit`], over the tight coordinates. Among several such states, places and
/// references, the one with the highest probability density is taken. Orientation is compared as far as the
/// demonstrations needed it ([`FrameState::turn_matters`]); otherwise only a tilt of a placed object counts.
#[derive(Debug, Clone)]
pub struct Grounder {
    states: Vec<FrameState>,
    noise_m: f64,
    noise_rad: f64,
    limit: f64,
}

/// Standard deviation of a place seen once, and the smallest one: in metres and in radians.
const PRIOR: (f64, f64) = (3e-3, 0.06);
/// Standard deviation of a place in which objects were found, if it was seen once, in metres.
const FOUND_M: f64 = 1e-2;
const FLOOR: (f64, f64) = (1e-3, 0.02);
/// Tilt up to which a placed object counts as upright, in radians.
const TILT: f64 = 0.14;
/// Movement below which an object keeps its state, in metres and radians.
const STILL: (f64, f64) = (5e-4, 0.01);
/// Difference of log densities below which two references are equally near.
const EQUAL: f64 = 0.05;

struct Match {
    fact: Fact,
    distance: f64,
    density: f64,
}

impl Grounder {
    /// Largest accepted distance, in standard deviations.
    pub const LIMIT: f64 = 5.0;

    /// Builds a grounder for the states of `domain`.
    pub fn new(domain: &RelationalDomain) -> Self {
        Self {
            states: domain.states.clone(),
            noise_m: domain.noise_m,
            noise_rad: domain.noise_rad,
            limit: Self::LIMIT,
        }
    }

    /// Returns a grounder that accepts distances of at most `limit` standard deviations.
    ///
    /// # Errors
    /// [`TaskError::Setting`] unless the limit is finite and above 0.
    pub fn with_limit(self, limit: f64) -> Result<Self, TaskError> {
        if limit.is_finite() && limit > 0.0 {
            return Ok(Self { limit, ..self });
        }
        let (value, expected) = (limit.to_string(), "a finite number above 0");
        Err(TaskError::Setting { name: "limit", value, expected })
    }

    /// Returns a grounder for scenes whose poses have this much more noise than the recording had: standard deviations
    /// of each coordinate in metres and about each axis in radians.
    pub fn with_noise(mut self, noise_m: f64, noise_rad: f64) -> Self {
        self.noise_m = self.noise_m.hypot(noise_m);
        self.noise_rad = self.noise_rad.hypot(noise_rad);
        self
    }

    /// Finds the state of every object in a scene.
    pub fn layout(&self, scene: &Snapshot) -> Layout {
        let located = (0..scene.objects.len()).map(|i| self.locate(scene, i)).collect();
        Layout::new(scene, located)
    }

    /// Finds the state of every object, as [`layout`](Self::layout) does. An object keeps the state that it had in
    /// `before` while neither it nor its reference has moved.
    pub fn layout_after(&self, before: &Layout, scene: &Snapshot) -> Layout {
        let mut now = self.layout(scene);
        let still: Vec<Option<usize>> = now
            .objects
            .iter()
            .map(|o| {
                let was = before.objects.iter().position(|b| b.id == o.id && b.kind == o.kind)?;
                let moved = before.objects[was].pose.distance(&o.pose);
                let turned = before.objects[was].pose.rotation().angle_to(&o.pose.rotation());
                let quiet =
                    moved < STILL.0 + 6.0 * self.noise_m && turned < STILL.1 + 6.0 * self.noise_rad;
                quiet.then_some(was)
            })
            .collect();
        for i in 0..now.objects.len() {
            let Some(was) = still[i] else { continue };
            let Some(fact) = before.located[was].fact else { continue };
            let reference = fact.reference.map(|r| still.iter().position(|s| *s == Some(r)));
            if let Some(None) = reference {
                continue;
            }
            now.located[i] = Located {
                fact: Some(Fact { reference: reference.flatten(), ..fact }),
                ..before.located[was]
            };
        }
        now
    }

    /// Finds the state of one object of a scene.
    pub fn locate(&self, scene: &Snapshot, index: usize) -> Located {
        let object = &scene.objects[index];
        let mut matches: Vec<Match> = Vec::new();
        for (s, state) in self.states.iter().enumerate().filter(|(_, s)| *s.kind == *object.kind) {
            let references: Vec<Option<usize>> = match &state.frame {
                Frame::World => vec![None],
                Frame::Kind(kind) => (0..scene.objects.len())
                    .filter(|r| *r != index && *scene.objects[*r].kind == **kind)
                    .map(Some)
                    .collect(),
            };
            for reference in references {
                let pose = match reference {
                    Some(r) => relative(&scene.objects[r].pose, &object.pose),
                    None => object.pose,
                };
                for (p, place) in state.places.iter().enumerate() {
                    let (distance, density) = self.compare(state, place, &pose);
                    let fact = Fact { state: s, place: p, reference };
                    matches.push(Match { fact, distance, density });
                }
            }
        }
        let near = matches.iter().map(|m| m.distance).min_by(f64::total_cmp);
        matches.retain(|m| m.distance <= self.limit);
        let best =
            matches.iter().max_by(|a, b| a.density.total_cmp(&b.density).then(b.fact.cmp(&a.fact)));
        let Some(best) = best else {
            return Located { fact: None, distance: near, ambiguous: false };
        };
        let ambiguous = matches.iter().any(|m| {
            m.fact.state == best.fact.state
                && m.fact.reference != best.fact.reference
                && best.density - m.density < EQUAL
        });
        Located { fact: Some(best.fact), distance: Some(best.distance), ambiguous }
    }

    /// Returns the standard deviation in metres with which a coordinate is compared. Objects that were found can lie on
    /// another side, or on each other.
    fn spread(&self, sd: f64, count: usize, found: bool) -> f64 {
        let prior = if found { FOUND_M } else { PRIOR.0 };
        let n = count.max(1) as f64;
        let variance = (prior * prior + (n - 1.0) * sd * sd) / n;
        (variance + self.noise_m * self.noise_m).sqrt().max(FLOOR.0)
    }

    /// Returns the standard deviation in radians with which an orientation is compared.
    fn angular_spread(&self, sd: f64, count: usize) -> f64 {
        let n = count.max(1) as f64;
        let variance = (PRIOR.1 * PRIOR.1 + (n - 1.0) * sd * sd) / n;
        (variance + self.noise_rad * self.noise_rad).sqrt().max(FLOOR.1)
    }

    /// Returns the distance in standard deviations, and the log density.
    fn compare(&self, state: &FrameState, place: &Place, pose: &Pose) -> (f64, f64) {
        let (mut squares, mut density) = (0.0, 0.0);
        let mut tight = Vec::new();
        for (i, coordinate) in place.coordinates.iter().enumerate() {
            let x = pose.position[i];
            match *coordinate {
                Coordinate::Tight { mean, sd } => {
                    let spread = if state.any_coordinate {
                        FLOOR.0.hypot(self.noise_m)
                    } else {
                        self.spread(sd, place.count, state.origin == Origin::Found)
                    };
                    let z = (x - mean) / spread;
                    tight.push(z);
                    squares += z * z;
                    density -= spread.ln() + 0.919 + 0.5 * z * z;
                }
                Coordinate::Open { low, high } => {
                    let range = (high - low).max(0.01);
                    let beyond = (low - x).max(x - high).max(0.0) / range;
                    // The more poses showed the range, the less likely is a pose beyond.
                    let certain = 2.0 + (place.count as f64).ln_1p();
                    density -= range.ln() + certain * (10.0 * beyond).min(1.0) + 2.0 * beyond;
                    // Beside an object, a place has an end; on the table, demonstrations seldom show all of it.
                    if state.frame != Frame::World {
                        let z = (beyond - 0.25).max(0.0) * 20.0;
                        squares += z * z;
                    }
                }
            }
        }
        if state.any_coordinate && !tight.is_empty() {
            let zeros = vec![0.0; tight.len()];
            let distance = p_distance(&tight, &zeros, -2.0);
            return (distance, -distance * distance / 2.0 - 3.0 * FLOOR.0.ln() - 20.0);
        }
        let mean = Pose { position: pose.position, orientation: place.orientation };
        if state.turn_matters {
            if let Some((angle, sd)) = state.turn.deviation(&mean, pose) {
                let spread = self.angular_spread(sd, place.count);
                let z = angle / spread;
                squares += z * z;
                density -= 2.0 * spread.ln() + 0.5 * z * z;
            }
        } else if state.origin == Origin::Placed && state.turn != Turn::Free {
            let tilt = tilt(&state.turn, &mean, pose);
            let z = Self::LIMIT * tilt / TILT.max(6.0 * self.noise_rad);
            squares += z * z;
        }
        (squares.sqrt(), density)
    }
}

/// Returns the angle between an object's axis and the axis in the mean pose, whatever their signs. Of a fully constrained
/// orientation, the axis that deviates least is taken: the object may be symmetric about any of them.
fn tilt(turn: &Turn, mean: &Pose, pose: &Pose) -> f64 {
    let off = |axis: Vector3<f64>| {
        let angle = (mean.rotation() * axis).angle(&(pose.rotation() * axis));
        angle.min(std::f64::consts::PI - angle)
    };
    match turn {
        Turn::Axis { axis, .. } => off(Vector3::from(*axis)),
        _ => [Vector3::x(), Vector3::y(), Vector3::z()]
            .map(off)
            .into_iter()
            .fold(f64::INFINITY, f64::min),
    }
}
