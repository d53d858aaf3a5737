//! Demonstrations without physics: a cup is put beside each plate, wherever the plates stand.

use nalgebra::{UnitQuaternion, Vector3};
use symbolt::robot::Pose;
use symbolt::task::{Demonstration, ObjectPose, Recording, Snapshot, SnapshotEvent};

/// Where a cup stands, in the frame of its plate.
pub const BESIDE: [f64; 3] = [0.12, 0.03, 0.02];

/// A number between 0 and 1 for a demonstration and a role.
fn share(demo: usize, role: usize) -> f64 {
    let mixed = (demo as f64 + 1.0) * 0.618_034 + (role as f64 + 1.0) * 0.414_214;
    (mixed * (1.0 + role as f64)).fract()
}

fn pose(position: [f64; 3], yaw: f64) -> Pose {
    let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), yaw);
    Pose { position, orientation: [turn.i, turn.j, turn.k, turn.w] }
}

/// Returns the pose of a cup beside a plate.
pub fn beside(plate: &Pose) -> Pose {
    let [x, y, z, w] = plate.orientation;
    let turn = UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(w, x, y, z));
    let at = Vector3::from(plate.position) + turn * Vector3::from(BESIDE);
    Pose { position: at.into(), orientation: plate.orientation }
}

fn snapshot(
    number: u64,
    objects: &[ObjectPose],
    event: SnapshotEvent,
    object: Option<usize>,
) -> Snapshot {
    Snapshot {
        number,
        time_s: Some(number as f64),
        event: Some(event),
        object,
        objects: objects.to_vec(),
    }
}

/// Returns demonstrations with this many plates and as many cups.
pub fn recording(demos: usize, plates: usize) -> Recording {
    let demo = |demo: usize| {
        let mut objects: Vec<ObjectPose> = Vec::new();
        for plate in 0..plates {
            let x = 0.35 * plate as f64 + 0.1 * share(demo, 3 * plate);
            let y = 0.3 + 0.2 * share(demo, 3 * plate + 1);
            let yaw = 2.0 * share(demo, 3 * plate + 2) - 1.0;
            let (id, kind) = (format!("plate_{plate}").into(), "plate".into());
            objects.push(ObjectPose { id, kind, pose: pose([x, y, 0.01], yaw) });
        }
        for cup in 0..plates {
            let x = 0.6 * share(demo, 20 + 2 * cup);
            let y = -0.4 + 0.3 * share(demo, 21 + 2 * cup);
            let (id, kind) = (format!("cup_{cup}").into(), "cup".into());
            objects.push(ObjectPose { id, kind, pose: pose([x, y, 0.03], share(demo, 40 + cup)) });
        }
        let mut snapshots = vec![snapshot(0, &objects, SnapshotEvent::Start, None)];
        for cup in 0..plates {
            let index = plates + cup;
            let number = snapshots.len() as u64;
            snapshots.push(snapshot(number, &objects, SnapshotEvent::Contact, Some(index)));
            objects[index].pose = beside(&objects[cup].pose);
            snapshots.push(snapshot(number + 1, &objects, SnapshotEvent::Release, Some(index)));
        }
        let number = snapshots.len() as u64;
        snapshots.push(snapshot(number, &objects, SnapshotEvent::End, None));
        Demonstration { number: demo as u64, snapshots }
    };
    Recording { demos: (0..demos).map(demo).collect() }
}
