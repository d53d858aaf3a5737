//! States that are Gaussians in the world frame, and actions with counts, as a relational domain: what the learner of the
//! paper infers, and what domain files of versions 1 and 2 hold.

use std::collections::BTreeMap;

use nalgebra::{Matrix3, Vector3};
use serde::Deserialize;

use super::condition::{Condition, Subject};
use super::goal::{GoalTerm, Quantity};
use super::operator::{Need, NeedVerdict, RelationalOperator, SideEffect};
use super::state::{Coordinate, FrameState, Origin, Place, Turn};
use super::{Frame, Provenance, RelationalDomain};
use crate::robot::Pose;
use crate::task::propositional::Fault;

/// Smallest number of distinct poses at which agreement in a coordinate counts as a constraint of the state.
pub(crate) const MIN_DISTINCT: usize = 4;
/// Standard deviation at which an orientation no longer counts as constrained, in radians.
pub(crate) const WILD_RAD: f64 = 0.35;
/// Smallest standard deviation at which a coordinate of a placed and of a found state is open, in metres. A few starting
/// positions can agree by chance: in 1 of 20 sets of five demonstrations, five positions agreed within 8 mm in one
/// coordinate.
const BROAD_M: f64 = 1e-2;
const BROAD_FOUND_M: f64 = 4e-3;

/// A state in the world frame, as a Gaussian of position and orientation.
pub(crate) struct GaussianState {
    pub name: String,
    pub kind: String,
    pub geometry: Geometry,
}

/// The poses of the objects in a state.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Geometry {
    /// Number of poses that the state was learned from, and of distinct ones.
    pub count: usize,
    pub distinct: usize,
    pub origin: Origin,
    pub mean: Pose,
    /// Covariance about the mean: first the three coordinates in metres, then the rotations about the scene's three axes
    /// in radians.
    pub covariance: [[f64; 6]; 6],
}

/// An action whose conditions are states of any object, with the counts behind them.
pub(crate) struct CountedOperator {
    pub name: String,
    pub from: Option<usize>,
    pub to: usize,
    pub preconditions: Vec<usize>,
    /// The other states that began to hold, each with the number of instances in which it did.
    pub effects: Vec<(usize, usize)>,
    /// States that never held before the action.
    pub absent: Vec<usize>,
    pub instances: usize,
    /// For each state, the number of instances in which it held before the action.
    pub before: Vec<u32>,
}

/// The tables of such a domain.
pub(crate) struct Gaussians {
    pub states: Vec<GaussianState>,
    pub operators: Vec<CountedOperator>,
    /// The state that most demonstrations reached with their last action, in how many they did, and of how many.
    pub goal: Option<(usize, [usize; 2])>,
    pub provenance: Provenance,
}

impl Gaussians {
    /// Returns the relational domain: every state lies in the world frame, and every precondition is about any object but
    /// the one that moves.
    pub fn domain(self) -> Result<RelationalDomain, Fault> {
        let goals = self.goal.into_iter().map(|(state, [held, of])| GoalTerm {
            or: Vec::new(),
            state,
            reference: None,
            quantity: Quantity::AtLeast(1),
            held,
            of,
        });
        let mut domain = RelationalDomain {
            states: self.states.into_iter().map(GaussianState::in_frame).collect(),
            operators: self.operators.into_iter().map(CountedOperator::with_needs).collect(),
            goals: goals.collect(),
            noise_m: 0.0,
            noise_rad: 0.0,
            level: BTreeMap::new(),
            provenance: self.provenance,
            sub_kinds: Vec::new(),
            words: BTreeMap::new(),
        };
        if let Some(fault) = domain.fault() {
            return Err(fault);
        }
        domain.complete_words();
        Ok(domain)
    }
}

impl CountedOperator {
    fn with_needs(self) -> RelationalOperator {
        let of = self.instances.max(1);
        let need = |state: usize| Need {
            condition: Condition { state, subject: Subject::Any },
            or: Vec::new(),
            verdict: NeedVerdict::Required,
            holds: true,
            least: 1,
            every: false,
            held: self.before.get(state).map_or(of, |held| *held as usize),
            of,
        };
        let begun = |(state, changed)| SideEffect {
            condition: Condition { state, subject: Subject::Any },
            begins: true,
            changed,
            of,
        };
        // The state that the object leaves is the condition on the object itself.
        let needs = self.preconditions.iter().filter(|p| Some(**p) != self.from);
        RelationalOperator {
            needs: needs.map(|state| need(*state)).collect(),
            name: self.name,
            from: self.from.into_iter().collect(),
            to: self.to,
            side_effects: self.effects.iter().map(|effect| begun(*effect)).collect(),
            displacement: None,
            order: Vec::new(),
            instances: of,
            never_seen: self.absent,
        }
    }
}

impl GaussianState {
    fn in_frame(self) -> FrameState {
        let Self { name, kind, geometry } = self;
        let Geometry { count, distinct, origin, mean, covariance } = &geometry;
        let found = *origin == Origin::Found;
        let broad = if found { BROAD_FOUND_M } else { BROAD_M };
        let coordinates = std::array::from_fn(|i| {
            let (mean, sd) = (mean.position[i], covariance[i][i].max(0.0).sqrt());
            if *distinct >= 2 && sd >= broad {
                Coordinate::Open { low: mean - 2.0 * sd, high: mean + 2.0 * sd }
            } else {
                Coordinate::Tight { mean, sd }
            }
        });
        FrameState {
            turn: match geometry.tilt_sd() {
                Some(sd) if !found => Turn::Axis { axis: [0.0, 0.0, 1.0], sd },
                _ => Turn::Free,
            },
            name,
            kind,
            frame: Frame::World,
            places: vec![Place { coordinates, orientation: mean.orientation, count: *distinct }],
            turn_matters: false,
            origin: *origin,
            count: *count,
            any_coordinate: found && *distinct < MIN_DISTINCT,
        }
    }
}

impl Geometry {
    /// Returns the standard deviation of the direction of the objects' z axis about each of two perpendicular axes, in
    /// radians; `None` if the direction is not constrained.
    fn tilt_sd(&self) -> Option<f64> {
        let turns = Matrix3::from_fn(|i, j| self.covariance[3 + i][3 + j]);
        let up = self.mean.rotation() * Vector3::z();
        let variance = 0.5 * (turns.trace() - up.dot(&(turns * up)));
        let sd = variance.max(0.0).sqrt();
        (sd < WILD_RAD).then_some(sd)
    }
}
