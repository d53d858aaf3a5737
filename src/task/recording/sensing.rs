//! Imperfect sensing: what a camera would report of a scene, instead of the exact poses.

use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use serde::{Deserialize, Serialize};

use super::{Demonstration, Recording, Snapshot};
use crate::robot::pose::{Pose, quaternion_array};
use crate::sim::Seed;
use crate::task::error::TaskError;

/// Errors of sensing. The default has none.
///
/// Errors are drawn anew for each object and each snapshot, fixtures included. They depend on the seed, the object's id
/// and the tick. Only swaps also depend on the other objects of the kind.
///
/// ```
/// use symbolt::sim::Seed;
/// use symbolt::task::{ObjectPose, Sensing, Snapshot};
/// use symbolt::robot::Pose;
///
/// let nut = ObjectPose { id: "nut_0".into(), kind: "nut".into(), pose: Pose::at([0.1, 0.2, 0.0]) };
/// let scene = Snapshot { objects: vec![nut], ..Snapshot::default() };
/// let sensing = Sensing { pose_noise_m: 1e-3, ..Sensing::default() };
/// let seen = sensing.apply(&scene, Seed::new(1), 0);
/// let error_m = seen.objects[0].pose.distance(&scene.objects[0].pose);
/// assert!(error_m > 0.0 && error_m < 0.01);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Sensing {
    /// Standard deviation of the error of a position, per coordinate, in metres (0 to 1).
    pub pose_noise_m: f64,
    /// Standard deviation of the angle by which an orientation is off, in degrees (0 to 180). The axis is uniform.
    pub pose_noise_deg: f64,
    /// Probability that a pose is an outlier (0 to 1): uniform in the bounding box of the scene, with a uniform
    /// orientation. The box is at least [`Sensing::SMALLEST_BOX_M`] long in each direction.
    pub outlier_rate: f64,
    /// Probability that an object is missing from a snapshot (0 to 1).
    pub missing_rate: f64,
    /// Probability that two objects of the same kind exchange their ids (0 to 1). In each snapshot the objects of a
    /// kind form random pairs. In a kind with an odd number of objects, one is left out.
    pub swap_rate: f64,
}

impl Sensing {
    /// Least length of the box from which outliers are drawn, in metres.
    pub const SMALLEST_BOX_M: f64 = 0.1;

    /// Checks the ranges of the fields.
    ///
    /// # Errors
    /// [`TaskError::Setting`] for the first field outside its range.
    pub fn check(&self) -> Result<(), TaskError> {
        let settings = [
            ("pose_noise_m", self.pose_noise_m, 1.0, "0 to 1 m"),
            ("pose_noise_deg", self.pose_noise_deg, 180.0, "0 to 180 degrees"),
            ("outlier_rate", self.outlier_rate, 1.0, "0 to 1"),
            ("missing_rate", self.missing_rate, 1.0, "0 to 1"),
            ("swap_rate", self.swap_rate, 1.0, "0 to 1"),
        ];
        for (name, value, most, expected) in settings {
            if !(0.0..=most).contains(&value) {
                return Err(TaskError::Setting { name, value: value.to_string(), expected });
            }
        }
        Ok(())
    }

    /// Returns whether sensing has no errors, so that [`Sensing::apply`] returns an equal snapshot.
    pub fn is_exact(&self) -> bool {
        *self == Self::default()
    }

    /// Returns the snapshot as sensed at `tick`. The same seed and tick give the same bits.
    ///
    /// Objects keep their order. `object` still refers to the object that was touched: after a swap, to its wrong id;
    /// it is `None` if the object is missing. Call [`Sensing::check`] before. Rates above 1 act as 1.
    pub fn apply(&self, snapshot: &Snapshot, seed: Seed, tick: u64) -> Snapshot {
        if self.is_exact() {
            return snapshot.clone();
        }
        let own = |id: &str, role: &str| seed.derive(id, role).derive_index("tick", tick).rng();
        let mut seen = snapshot.clone();
        let bounds = bounds(snapshot);
        for object in &mut seen.objects {
            let mut rng = own(&object.id, "sensed pose");
            object.pose = if chance(&mut rng, self.outlier_rate) {
                outlier(bounds, &mut rng)
            } else {
                self.noisy(&object.pose, &mut rng)
            };
        }
        for (one, other) in self.swaps(snapshot, own) {
            let pose = seen.objects[one].pose;
            seen.objects[one].pose = seen.objects[other].pose;
            seen.objects[other].pose = pose;
            seen.object = seen.object.map(|touched| match touched {
                t if t == one => other,
                t if t == other => one,
                t => t,
            });
        }
        // An object is missing under the id with which it would have been seen.
        let missing: Vec<bool> = (seen.objects.iter())
            .map(|object| chance(&mut own(&object.id, "missing"), self.missing_rate))
            .collect();
        seen.object = seen
            .object
            .filter(|touched| !missing.get(*touched).is_none_or(|m| *m))
            .map(|touched| touched - missing[..touched].iter().filter(|missing| **missing).count());
        let mut gone = missing.iter();
        seen.objects.retain(|_| gone.next().is_some_and(|missing| !missing));
        seen
    }

    /// Returns the recording as sensed. The number of a demonstration selects its seed, the number of a snapshot is the
    /// tick.
    pub fn apply_recording(&self, recording: &Recording, seed: Seed) -> Recording {
        let sense = |demo: &Demonstration| {
            let seed = seed.derive_index("sensed demonstration", demo.number);
            let snapshots = demo.snapshots.iter().map(|s| self.apply(s, seed, s.number)).collect();
            Demonstration { number: demo.number, snapshots }
        };
        Recording { demos: recording.demos.iter().map(sense).collect() }
    }

    fn noisy(&self, pose: &Pose, rng: &mut ChaCha8Rng) -> Pose {
        let position = pose.position.map(|value| value + self.pose_noise_m * normal(rng));
        // The direction of a normal vector is uniform.
        let axis = Vector3::from([normal(rng), normal(rng), normal(rng)]);
        let angle = (self.pose_noise_deg * normal(rng)).to_radians();
        let orientation = match axis.try_normalize(1e-12) {
            Some(axis) if angle != 0.0 => {
                quaternion_array(&(UnitQuaternion::new(axis * angle) * pose.rotation()))
            }
            _ => pose.orientation,
        };
        Pose { position, orientation }
    }

    /// The pairs of objects that exchange their ids.
    fn swaps(
        &self,
        snapshot: &Snapshot,
        own: impl Fn(&str, &str) -> ChaCha8Rng,
    ) -> Vec<(usize, usize)> {
        if self.swap_rate <= 0.0 {
            return Vec::new();
        }
        let objects = &snapshot.objects;
        let mut keyed: Vec<(&str, u64, f64, usize)> = (objects.iter().enumerate())
            .map(|(index, object)| {
                let mut rng = own(&object.id, "swap");
                (&*object.kind, rng.random::<u64>(), rng.random::<f64>(), index)
            })
            .collect();
        keyed.sort_by(|a, b| (a.0, a.1, a.3).cmp(&(b.0, b.1, b.3)));
        keyed
            .chunk_by(|a, b| a.0 == b.0)
            .flat_map(|kind| kind.chunks_exact(2))
            .filter(|pair| pair[0].2 < self.swap_rate)
            .map(|pair| (pair[0].3, pair[1].3))
            .collect()
    }
}

fn normal(rng: &mut ChaCha8Rng) -> f64 {
    rng.sample(StandardNormal)
}

fn chance(rng: &mut ChaCha8Rng, probability: f64) -> bool {
    rng.random::<f64>() < probability
}

/// Least and greatest coordinates of the scene, padded to the smallest box.
fn bounds(snapshot: &Snapshot) -> [(f64, f64); 3] {
    std::array::from_fn(|axis| {
        let values = snapshot.objects.iter().map(|o| o.pose.position[axis]);
        let low = values.clone().fold(f64::INFINITY, f64::min);
        let high = values.fold(f64::NEG_INFINITY, f64::max);
        let pad = (Sensing::SMALLEST_BOX_M - (high - low)).max(0.0) / 2.0;
        (low - pad, high + pad)
    })
}

fn outlier(bounds: [(f64, f64); 3], rng: &mut ChaCha8Rng) -> Pose {
    let position = bounds.map(|(low, high)| low + (high - low) * rng.random::<f64>());
    let [w, x, y, z] = [normal(rng), normal(rng), normal(rng), normal(rng)];
    let turn = UnitQuaternion::try_new(Quaternion::new(w, x, y, z), 1e-12).unwrap_or_default();
    Pose { position, orientation: quaternion_array(&turn) }
}
