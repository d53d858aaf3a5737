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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::robot::rotation_between;
    use crate::task::recording::{ObjectPose, SnapshotEvent};

    /// Ten nuts and nine bolts on a line, one metre long.
    fn scene() -> Snapshot {
        let object = |(index, kind): (usize, &str)| ObjectPose {
            id: format!("{kind}_{index}").into(),
            kind: kind.into(),
            pose: Pose::at([index as f64 * 0.1, if kind == "nut" { 0.0 } else { 1.0 }, 0.0]),
        };
        let nuts = (0..10).map(|i| (i, "nut"));
        let objects = nuts.chain((0..9).map(|i| (i, "bolt"))).map(object).collect();
        Snapshot { objects, ..Snapshot::default() }
    }

    fn seen(sensing: Sensing, ticks: u64) -> Vec<Snapshot> {
        (0..ticks).map(|tick| sensing.apply(&scene(), Seed::new(1), tick)).collect()
    }

    #[test]
    fn exact_sensing_changes_nothing() {
        assert!(Sensing::default().is_exact());
        assert_eq!(seen(Sensing::default(), 1)[0], scene());
    }

    #[test]
    fn noise_has_the_stated_deviations() {
        // 11,400 coordinates and 3,800 angles. The bounds are 4.5 standard errors wide, a false-alarm rate of 1e-5
        // each over all seeds. Noise of a wrong unit, or with a uniform distribution of the same range, is caught.
        let sensing = Sensing { pose_noise_m: 2e-3, pose_noise_deg: 3.0, ..Sensing::default() };
        let (mut square, mut turn_square, mut axis, mut count) = (0.0, 0.0, [0.0; 3], 0.0);
        let exact = scene();
        for snapshot in seen(sensing, 200) {
            for (a, b) in exact.objects.iter().zip(&snapshot.objects) {
                let offsets = (0..3).map(|i| b.pose.position[i] - a.pose.position[i]);
                square += offsets.map(|d| d * d).sum::<f64>();
                let turn = rotation_between(&a.pose, &b.pose);
                turn_square += turn.iter().map(|v| v * v).sum::<f64>();
                (0..3).for_each(|i| axis[i] += turn[i] * turn[i]);
                count += 1.0;
            }
        }
        assert_eq!(count, 3800.0);
        let deviation = (square / (3.0 * count)).sqrt();
        assert!((deviation / 2e-3 - 1.0).abs() < 4.5 / (6.0 * count).sqrt(), "{deviation}");
        let degrees = (turn_square / count).sqrt().to_degrees();
        assert!((degrees / 3.0 - 1.0).abs() < 4.5 / (2.0 * count).sqrt(), "{degrees}");
        // Each axis has a third of the squares. The variance of angle^2 cos^2 is 3/5 - 1/9 in units of the variance.
        for part in axis {
            let share = part / turn_square;
            assert!((share - 1.0 / 3.0).abs() < 4.5 * (0.49 / count).sqrt(), "{axis:?}");
        }
    }

    #[test]
    fn noise_depends_on_seed_id_and_tick_only() {
        let sensing = Sensing {
            pose_noise_m: 1e-3,
            pose_noise_deg: 1.0,
            outlier_rate: 0.1,
            missing_rate: 0.1,
            swap_rate: 0.0,
        };
        let all = sensing.apply(&scene(), Seed::new(7), 3);
        assert_eq!(all, sensing.apply(&scene(), Seed::new(7), 3));
        assert_ne!(all, sensing.apply(&scene(), Seed::new(7), 4));
        assert_ne!(all, sensing.apply(&scene(), Seed::new(8), 3));
        let mut fewer = scene();
        fewer.objects.reverse();
        fewer.objects.remove(4);
        let left_out = scene().objects[14].id.clone();
        let part = Sensing { outlier_rate: 0.0, ..sensing }.apply(&fewer, Seed::new(7), 3);
        let all = Sensing { outlier_rate: 0.0, ..sensing }.apply(&scene(), Seed::new(7), 3);
        let with_all = all.objects.iter().filter(|o| o.id != left_out);
        assert!(part.objects.iter().rev().eq(with_all));
    }

    /// The share of objects for which `wrong` holds, over 1,000 snapshots.
    fn rate(sensing: Sensing, wrong: impl Fn(&ObjectPose, Option<&ObjectPose>) -> bool) -> f64 {
        let exact = scene();
        let mut count = 0;
        for snapshot in seen(sensing, 1000) {
            let same = |id: &str| snapshot.objects.iter().find(|o| &*o.id == id);
            count += exact.objects.iter().filter(|o| wrong(o, same(&o.id))).count();
        }
        count as f64 / (1000.0 * exact.objects.len() as f64)
    }

    #[test]
    fn rates_are_met() {
        // 19,000 objects at a rate of 5%: 4.5 standard errors are 0.7%, a false-alarm rate of 1e-5 over all seeds. Swaps
        // come in pairs, so their standard error is larger by the square root of 2; one of nine bolts is left out.
        let none = Sensing::default();
        let missing = rate(Sensing { missing_rate: 0.05, ..none }, |_, seen| seen.is_none());
        assert!((missing - 0.05).abs() < 0.007, "{missing}");
        let off = |a: &ObjectPose, b: Option<&ObjectPose>| b.is_none_or(|b| b.pose != a.pose);
        let outliers = rate(Sensing { outlier_rate: 0.05, ..none }, off);
        assert!((outliers - 0.05).abs() < 0.007, "{outliers}");
        let swapped = rate(Sensing { swap_rate: 0.05, ..none }, off);
        assert!((swapped - 0.05 * 18.0 / 19.0).abs() < 0.010, "{swapped}");
    }

    #[test]
    fn outliers_fill_the_bounding_box() {
        let sensing = Sensing { outlier_rate: 1.0, ..Sensing::default() };
        let snapshots = seen(sensing, 200);
        let poses: Vec<[f64; 3]> =
            snapshots.iter().flat_map(|s| s.objects.iter().map(|o| o.pose.position)).collect();
        assert_eq!(poses.len(), 3800);
        for (axis, (low, high)) in [(0, (0.0, 0.9)), (1, (0.0, 1.0)), (2, (-0.05, 0.05))] {
            let values = || poses.iter().map(|p| p[axis]);
            assert!(values().all(|v| v >= low && v <= high));
            // The least of 3,800 draws lies in the first hundredth, but for 1 in 1e16 seeds.
            let margin = 0.01 * (high - low);
            assert!(values().any(|v| v < low + margin) && values().any(|v| v > high - margin));
        }
    }

    #[test]
    fn swapped_objects_have_the_same_kind_and_all_keep_their_number() {
        let sensing = Sensing { swap_rate: 1.0, ..Sensing::default() };
        let exact = scene();
        for snapshot in seen(sensing, 50) {
            assert_eq!(snapshot.objects.len(), exact.objects.len());
            let mut wrong = 0;
            for (a, b) in exact.objects.iter().zip(&snapshot.objects) {
                assert_eq!((&a.id, &a.kind), (&b.id, &b.kind));
                assert_eq!(a.pose.position[1], b.pose.position[1], "kinds must not mix");
                wrong += usize::from(a.pose != b.pose);
            }
            assert_eq!(wrong, 18);
        }
    }

    #[test]
    fn the_touched_object_is_followed_through_swaps_and_losses() {
        let sensing = Sensing { swap_rate: 0.5, missing_rate: 0.3, ..Sensing::default() };
        let (mut kept, mut none, mut renamed) = (0, 0, 0);
        for tick in 0..300 {
            let touched = (tick % 19) as usize;
            let mut exact = scene();
            exact.event = Some(SnapshotEvent::Contact);
            exact.object = Some(touched);
            let snapshot = sensing.apply(&exact, Seed::new(5), tick);
            let here = exact.objects[touched].pose;
            match snapshot.object {
                Some(object) => {
                    assert_eq!(snapshot.objects[object].pose, here);
                    kept += 1;
                    renamed +=
                        usize::from(snapshot.objects[object].id != exact.objects[touched].id);
                }
                None => {
                    assert!(snapshot.objects.iter().all(|o| o.pose != here));
                    none += 1;
                }
            }
        }
        assert!(kept > 150 && none > 50 && renamed > 50, "{kept} {none} {renamed}");
    }

    #[test]
    fn a_sensed_recording_can_be_written_and_read_and_its_demonstrations_differ() {
        let demo = |number| {
            let snapshots =
                (0..4).map(|s| Snapshot { number: s, ..scene() }).collect::<Vec<Snapshot>>();
            Demonstration { number, snapshots }
        };
        let recording = Recording { demos: vec![demo(0), demo(1)] };
        let sensing = Sensing {
            pose_noise_m: 1e-3,
            pose_noise_deg: 1.0,
            outlier_rate: 0.05,
            missing_rate: 0.05,
            swap_rate: 0.05,
        };
        let sensed = sensing.apply_recording(&recording, Seed::new(1));
        assert_ne!(sensed.demos[0].snapshots, sensed.demos[1].snapshots);
        let text = sensed.to_jsonl(None).unwrap();
        let (read, _) = Recording::parse(text.as_bytes(), "sensed").unwrap();
        assert_eq!(read.snapshot_count(), 8);
    }

    #[test]
    fn numbers_out_of_range_are_named() {
        let none = Sensing::default();
        assert!(none.check().is_ok());
        let wrong = [
            (
                Sensing { pose_noise_m: -1e-3, ..none },
                "`pose_noise_m` is -0.001; expected 0 to 1 m",
            ),
            (
                Sensing { pose_noise_deg: f64::NAN, ..none },
                "`pose_noise_deg` is NaN; expected 0 to 180 degrees",
            ),
            (Sensing { outlier_rate: 1.5, ..none }, "`outlier_rate` is 1.5; expected 0 to 1"),
            (Sensing { missing_rate: 2.0, ..none }, "`missing_rate` is 2; expected 0 to 1"),
            (Sensing { swap_rate: -0.1, ..none }, "`swap_rate` is -0.1; expected 0 to 1"),
        ];
        for (sensing, message) in wrong {
            assert_eq!(sensing.check().unwrap_err().to_string(), message);
        }
    }
}
