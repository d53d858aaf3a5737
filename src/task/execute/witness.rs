//! A witness of the scene: it records what lies where, and judges by geometry whether a bolt is through a
//! nut. Neither the learner nor the executor asks its judgement.

use std::sync::Arc;

use crate::task::domain::Pose;
use crate::task::domain::{Event, ObjectPose, Snapshot};
use crate::task::scene::{PartKind, Scene, SceneSpec};

/// What lies in the jig, seen from the scene's own geometry.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Assembly {
    /// A nut that lies flat in the pocket.
    pub nut_in_pocket: Option<usize>,
    /// A bolt that hangs in the hole.
    pub bolt_in_hole: Option<usize>,
    /// A bolt whose shaft is through the nut in the pocket, its head on the nut.
    pub bolt_in_nut: Option<usize>,
}

/// How far from its height a part may be, in metres.
const HEIGHT_M: f64 = 1e-3;

impl Assembly {
    /// Looks at the scene.
    pub fn judge(scene: &Scene) -> Self {
        let (spec, mut found) = (scene.spec(), Self::default());
        let (part, jig) = (&spec.part, &spec.jig);
        let near = |pose: &Pose, at: [f64; 2], within: f64| {
            (pose.position[0] - at[0]).hypot(pose.position[1] - at[1]) <= within
        };
        let level = |pose: &Pose, z: f64| (pose.position[2] - z).abs() <= HEIGHT_M;
        let nut_z = jig.pocket_floor_m + part.nut_height_m / 2.0;
        let poses: Vec<(PartKind, Pose)> = scene
            .kinds()
            .enumerate()
            .filter_map(|(index, kind)| Some((kind, scene.part(index)?)))
            .collect();
        for (index, (kind, pose)) in poses.iter().enumerate() {
            let up = upright(pose);
            let flat = up.abs() > 0.99;
            // A nut's flats can be nearer to the wall than its corners.
            let play = jig.pocket_clearance_m + 0.14 * part.across_flats_m / 2.0;
            if *kind == PartKind::Nut && flat && level(pose, nut_z) && near(pose, jig.pocket, play)
            {
                found.nut_in_pocket = Some(index);
            }
            let play = 2.0 * jig.hole_clearance_m;
            let hangs = up > 0.99 && level(pose, jig.hole_top_m) && near(pose, jig.hole, play);
            if *kind == PartKind::Bolt && hangs {
                found.bolt_in_hole = Some(index);
            }
        }
        if let Some(nut) = found.nut_in_pocket {
            let [x, y, _] = poses[nut].1.position;
            let on_nut = jig.pocket_floor_m + part.nut_height_m;
            let play = part.nut_hole_m / 0.866 - part.shaft_radius_m + 2e-4;
            found.bolt_in_nut = poses.iter().position(|(kind, pose)| {
                *kind == PartKind::Bolt
                    && upright(pose) > 0.99
                    && level(pose, on_nut)
                    && near(pose, [x, y], play)
            });
        }
        found
    }

    /// Whether a bolt is through the nut in the pocket.
    pub fn is_assembled(&self) -> bool {
        self.bolt_in_nut.is_some()
    }

    /// Whether a part is in the jig.
    pub fn holds(&self, part: usize) -> bool {
        [self.nut_in_pocket, self.bolt_in_hole, self.bolt_in_nut].contains(&Some(part))
    }
}

/// The upward share of a part's axis: 1 upright, -1 upside down.
fn upright(pose: &Pose) -> f64 {
    let [x, y, _, _] = pose.orientation;
    1.0 - 2.0 * (x * x + y * y)
}

/// Takes snapshots of a scene.
///
/// A part that fell off the table is gone from then on, and the later ids of its kind move down, as in
/// recordings by a camera that numbers what it sees.
#[derive(Debug, Clone)]
pub struct Recorder {
    kinds: [Arc<str>; 2],
    fixed: Vec<ObjectPose>,
    snapshots: Vec<Snapshot>,
}

/// Below this height a part has left the table.
const GONE_M: f64 = -0.05;

impl Recorder {
    /// A recorder of scenes like `spec`.
    pub fn new(spec: &SceneSpec) -> Self {
        let fixed = [
            (format!("{}_pocket", spec.nut_kind), spec.jig.pocket, spec.jig.pocket_floor_m),
            (format!("{}_hole", spec.bolt_kind), spec.jig.hole, spec.jig.hole_top_m),
        ]
        .map(|(kind, [x, y], z)| ObjectPose {
            id: format!("{kind}_0").into(),
            kind: kind.into(),
            pose: Pose::at([x, y, z]),
        });
        Self {
            kinds: [spec.nut_kind.as_str().into(), spec.bolt_kind.as_str().into()],
            fixed: fixed.into(),
            snapshots: Vec::new(),
        }
    }

    /// What is to be seen now, and which part of the scene each object is (`None` for the jig).
    pub fn look(&self, scene: &Scene) -> (Snapshot, Vec<Option<usize>>) {
        let mut counts = [0, 0];
        let (mut objects, mut parts) = (Vec::new(), Vec::new());
        for (index, kind) in scene.kinds().enumerate() {
            let Some(pose) = scene.part(index).filter(|p| p.position[2] > GONE_M) else { continue };
            let which = usize::from(kind == PartKind::Bolt);
            let name = self.kinds[which].clone();
            let id = format!("{name}_{}", counts[which]).into();
            counts[which] += 1;
            objects.push(ObjectPose { id, kind: name, pose });
            parts.push(Some(index));
        }
        objects.extend(self.fixed.iter().cloned());
        parts.extend(self.fixed.iter().map(|_| None));
        let snapshot = Snapshot {
            number: self.snapshots.len() as u64,
            time_s: Some(scene.time_s()),
            event: None,
            object: None,
            objects,
        };
        (snapshot, parts)
    }

    /// Takes a snapshot of what a touch, the start or the end shows.
    pub fn note(&mut self, scene: &Scene, event: Event, touched: Option<usize>) {
        let (mut snapshot, parts) = self.look(scene);
        snapshot.event = Some(event);
        snapshot.object = touched.and_then(|t| parts.iter().position(|p| *p == Some(t)));
        // A part let go over the edge is not there to be named.
        if touched.is_none() || snapshot.object.is_some() {
            self.snapshots.push(snapshot);
        }
    }

    /// The snapshots.
    pub fn into_snapshots(self) -> Vec<Snapshot> {
        self.snapshots
    }
}
