//! The poses that moves aim at.

use nalgebra::Vector3;

use super::moves::Move;
use super::problem::Problem;
use crate::robot::{Pose, UP};
use crate::task::classify::Layout;
use crate::task::domain::{ROOMY_M, Situation, Turn, relative, world_pose};

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
        let pose = state.turn.faced(&pose, &now);
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
}
