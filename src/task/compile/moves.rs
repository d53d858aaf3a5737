//! Moves: operators with their parameters bound to the objects of a scene, and the poses that they aim at.

use nalgebra::Vector3;

use super::problem::Problem;
use crate::robot::{Pose, UP};
use crate::task::classify::Layout;
use crate::task::domain::{
    Fact, NeedVerdict, Parameters, ROOMY_M, RelationalOperator, Situation, Subject, Turn, relative,
    world_pose,
};

/// An operator with its parameters bound.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Move {
    /// Index of the operator.
    pub operator: usize,
    /// Index of the object that moves.
    pub object: usize,
    /// Index of the target reference; `None` in the world frame.
    pub reference: Option<usize>,
    /// Index of the place in the operator's new state.
    pub place: usize,
}

impl Move {
    /// Returns the objects that the parameters of the operator stand for, with the fact that the object leaves.
    pub(crate) fn parameters(&self, from: Option<&Fact>) -> Parameters {
        Parameters::new(Some(self.object), from.and_then(|f| f.reference), self.reference)
    }

    /// Returns the fact that the object enters.
    pub(crate) fn result(&self, operator: &RelationalOperator) -> Fact {
        Fact { state: operator.to, place: self.place, reference: self.reference }
    }
}

/// The pose that a move aims at.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TargetPose {
    /// Pose in the world.
    pub pose: Pose,
    /// How much of the orientation matters.
    pub turn: Turn,
}

/// Number of candidate positions along each open coordinate.
const CANDIDATES: usize = 7;

impl Problem<'_> {
    /// Returns every move that the operators allow in `situation`, whether its undecided needs are met or not.
    pub fn moves(&self, situation: &Situation) -> Vec<Move> {
        let mut moves = Vec::new();
        for (o, operator) in self.domain.operators.iter().enumerate() {
            for object in self.of_kind(&self.domain.states[operator.to].kind) {
                let Some(now) = situation[object] else { continue };
                if !operator.from.contains(&now.state) {
                    continue;
                }
                for (reference, place) in self.targets(o, Some(object)) {
                    let stays = now.state == operator.to && now.reference == reference;
                    let below = reference.is_some_and(|r| self.rests_on(r, object, situation));
                    let m = Move { operator: o, object, reference, place };
                    let mut hard =
                        operator.needs.iter().filter(|n| n.verdict != NeedVerdict::Undecided);
                    let allowed = !stays
                        && !below
                        && self.place_is_free(&m, situation)
                        && hard.all(|n| self.met(&m, n, situation));
                    if allowed {
                        moves.push(m);
                    }
                }
            }
        }
        moves
    }

    /// Returns whether all undecided needs of a move are met.
    pub fn decided(&self, m: &Move, situation: &Situation) -> bool {
        let needs = self.domain.operators[m.operator].needs.iter();
        needs.filter(|n| n.verdict == NeedVerdict::Undecided).all(|n| self.met(m, n, situation))
    }

    /// Returns whether the undecided needs that are in force are met.
    pub(super) fn permitted(&self, m: &Move, situation: &Situation) -> bool {
        let needs = self.domain.operators[m.operator].needs.iter().enumerate();
        needs
            .filter(|(n, _)| self.in_force.contains(&(m.operator, *n)))
            .all(|(_, need)| self.met(m, need, situation))
    }

    /// Returns the pose that a move aims at, given where the objects are now. Open coordinates keep the demonstrated
    /// displacement. Without one, a position away from objects in the region is taken, or its middle.
    pub fn target(&self, m: &Move, layout: &Layout) -> TargetPose {
        let operator = &self.domain.operators[m.operator];
        let state = &self.domain.states[operator.to];
        let place = &state.places[m.place];
        let frame = match m.reference {
            Some(r) => layout.objects[r].pose,
            None => Pose::at([0.0; 3]),
        };
        let now = relative(&frame, &layout.objects[m.object].pose);
        let mut pose = place.pose();
        let open: Vec<(usize, f64, f64)> = place
            .coordinates
            .iter()
            .enumerate()
            .filter_map(|(i, c)| c.room().map(|(low, high)| (i, low, high)))
            .collect();
        if let Some(displacement) = &operator.displacement {
            for (i, ..) in &open {
                pose.position[*i] = now.position[*i] + displacement.mean[*i];
            }
        } else if !open.is_empty() {
            pose.position = self.roomiest(m, layout, &frame, pose.position, &open);
        }
        if state.turn == Turn::Free {
            pose.orientation = now.orientation;
        }
        TargetPose { pose: world_pose(&frame, &pose), turn: state.turn }
    }

    /// Lets a move have its effect on the poses of a layout: the object goes to the target, and what rests on it goes along.
    pub(crate) fn displace(
        &self,
        m: &Move,
        target: &TargetPose,
        situation: &Situation,
        layout: &mut Layout,
    ) {
        let from = layout.objects[m.object].pose;
        for (i, object) in layout.objects.iter_mut().enumerate() {
            if self.rests_on(i, m.object, situation) {
                object.pose = world_pose(&target.pose, &relative(&from, &object.pose));
            }
        }
        layout.objects[m.object].pose = target.pose;
    }

    /// Returns the candidate position that is farthest from all other objects. Heights keep their middle. The reference
    /// is not in the way, nor are objects farther away than the region is wide; of equal positions, the one nearest to the
    /// middle is taken.
    fn roomiest(
        &self,
        m: &Move,
        layout: &Layout,
        frame: &Pose,
        middle: [f64; 3],
        open: &[(usize, f64, f64)],
    ) -> [f64; 3] {
        let others: Vec<Vector3<f64>> = layout
            .objects
            .iter()
            .enumerate()
            .filter(|(i, _)| *i != m.object && Some(*i) != m.reference)
            .map(|(_, o)| Vector3::from(relative(frame, &o.pose).position))
            .collect();
        let across: Vec<&(usize, f64, f64)> =
            open.iter().filter(|(i, low, high)| *i != UP && high - low > ROOMY_M).collect();
        let width = across.iter().map(|(_, low, high)| (high - low).powi(2)).sum::<f64>().sqrt();
        let mut best = (f64::NEG_INFINITY, 0.0, middle);
        let total = CANDIDATES.pow(across.len().min(3) as u32);
        for n in 0..total {
            let mut position = middle;
            let mut rest = n;
            for (i, low, high) in &across {
                let share = (rest % CANDIDATES) as f64 / (CANDIDATES - 1) as f64;
                rest /= CANDIDATES;
                // The outer tenth of the range may be the rim.
                position[*i] = low + (high - low) * (0.1 + 0.8 * share);
            }
            let near =
                others.iter().map(|o| (o - Vector3::from(position)).norm()).fold(width, f64::min);
            let off = (Vector3::from(position) - Vector3::from(middle)).norm();
            if near > best.0 + 1e-9 || (near > best.0 - 1e-9 && off < best.1 - 1e-9) {
                best = (near, off, position);
            }
        }
        best.2
    }

    /// Returns a move's needs that are not met, in words for tables: the state's name, and whose state it is.
    pub fn open_needs(&self, m: &Move, situation: &Situation) -> Vec<String> {
        let operator = &self.domain.operators[m.operator];
        let open = operator.needs.iter().filter(|n| !self.met(m, n, situation));
        open.map(|n| {
            let state = &self.domain.states[n.condition.state].name;
            match n.condition.subject {
                Subject::Is(role) => format!("{state} of the {}", role.name()),
                Subject::At(role) => format!("{state} at the {}", role.name()),
                Subject::Any => state.clone(),
            }
        })
        .collect()
    }
}
