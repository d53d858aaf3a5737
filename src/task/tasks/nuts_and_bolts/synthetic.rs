//! Synthetic demonstrations: recordings drawn from a seed, without physics.
//!
//! They serve tests, benches and examples that need many demonstrations or have no physics. Parts lie anywhere on a
//! table. The jig has a pocket for the nut and a hole for the bolt, and the bolt ends in the nut.
//!
//! Demonstrations can go wrong. An attempt can fail: the part falls back onto the table, a bolt ends up
//! standing on its head, or an assembly comes apart. A part can fall off the table and be lost; the later ids
//! of its kind then move down. Nearby parts can be nudged or knocked aside. The z axis points up.

use nalgebra::{UnitQuaternion, Vector3};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

use crate::robot::Pose;
use crate::robot::pose::quaternion_array;
use crate::sim::Seed;
use crate::task::error::TaskError;
use crate::task::recording::{
    Demonstration, Labels, ObjectPose, Recording, Snapshot, SnapshotEvent,
};

/// Which part is put into the jig first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Order {
    /// The nut.
    NutFirst,
    /// The bolt.
    BoltFirst,
    /// The nut or the bolt, in turn. The seed draws the first. Two or more demonstrations show both orders.
    #[default]
    Either,
}

/// Settings of a generated recording.
#[derive(Debug, Clone, PartialEq)]
pub struct SyntheticDemonstrations {
    /// Number of demonstrations (1 to 10,000).
    pub demos: usize,
    /// Number of nuts at the beginning of each demonstration (1 to 50).
    pub nuts: usize,
    /// Number of bolts at the beginning of each demonstration (1 to 50).
    pub bolts: usize,
    /// Which part is put into the jig first.
    pub order: Order,
    /// Probability that an attempt fails (0 to 0.9).
    pub fail_rate: f64,
    /// Probability that a failed attempt loses its part off the table (0 to 1).
    pub loss_rate: f64,
    /// Probability that an attempt knocks another part aside (0 to 1).
    pub knock_rate: f64,
    /// Whether snapshots are taken at contact and release and have `t`, `event` and `object`. Otherwise one snapshot is
    /// taken before each attempt and one at the end, and the touched part is not recorded.
    pub events: bool,
}

impl Default for SyntheticDemonstrations {
    fn default() -> Self {
        Self {
            demos: 5,
            nuts: 1,
            bolts: 1,
            order: Order::Either,
            fail_rate: 0.0,
            loss_rate: 0.0,
            knock_rate: 0.0,
            events: true,
        }
    }
}

/// A generated recording, with facts for scoring that a learner must not see.
#[derive(Debug, Clone, PartialEq)]
pub struct SyntheticRecording {
    /// The recording for the learner.
    pub recording: Recording,
    /// The demonstrator's names for its attempts, for scoring.
    pub labels: Labels,
    /// Number of failed attempts.
    pub failed: usize,
    /// Number of lost parts.
    pub lost: usize,
    /// Number of demonstrations that ended with a bolt in a nut.
    pub assembled: usize,
}

/// Heights of the parts' origins, in metres: lying and standing on the table, in the jig, and assembled. A
/// bolt stands 1.4 mm lower in the nut than in the jig.
pub mod heights {
    /// A nut lying on the table.
    pub const NUT_LYING: f64 = 0.0080;
    /// A bolt lying on the table.
    pub const BOLT_LYING: f64 = 0.0150;
    /// A bolt standing on its head.
    pub const BOLT_STANDING: f64 = 0.0415;
    /// A nut in its pocket.
    pub const NUT_SEATED: f64 = 0.0522;
    /// A bolt hanging in its hole.
    pub const BOLT_SEATED: f64 = 0.0640;
    /// A bolt in a nut.
    pub const BOLT_ASSEMBLED: f64 = 0.0626;
}

const POCKET: [f64; 2] = [0.31, -0.22];
const HOLE: [f64; 2] = [0.44, -0.06];
/// Play of a part in pocket and hole, in metres.
const CLEARANCE: f64 = 1.5e-3;
/// Corners of the table.
const TABLE: [[f64; 2]; 2] = [[-0.35, 0.05], [0.15, 0.55]];

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Part {
    Nut,
    Bolt,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Place {
    Lying,
    Standing,
    Jig,
    Assembled,
}

#[derive(Debug, Clone)]
struct Body {
    part: Part,
    place: Place,
    pose: Pose,
}

struct Stage<'a> {
    spec: &'a SyntheticDemonstrations,
    rng: ChaCha8Rng,
    bodies: Vec<Body>,
    snapshots: Vec<Snapshot>,
    labels: Vec<Option<String>>,
    time_s: f64,
    failed: usize,
    lost: usize,
}

impl SyntheticDemonstrations {
    /// Generates a recording. The same seed gives the same bits.
    ///
    /// # Errors
    /// [`TaskError::Setting`] for a number or rate outside its range.
    pub fn record(&self, seed: Seed) -> Result<SyntheticRecording, TaskError> {
        self.check()?;
        let mut out = SyntheticRecording {
            recording: Recording::default(),
            labels: Labels::new(),
            failed: 0,
            lost: 0,
            assembled: 0,
        };
        let flip = seed.derive("kinematic", "order").rng().random::<bool>();
        let mut poses = 0;
        for demo in 0..self.demos {
            let nut_first = match self.order {
                Order::NutFirst => true,
                Order::BoltFirst => false,
                // Alternates from a drawn start, so that even two demonstrations show both orders.
                Order::Either => (demo % 2 == 0) == flip,
            };
            let mut stage = Stage {
                spec: self,
                rng: seed.derive_index("kinematic demo", demo as u64).rng(),
                bodies: Vec::new(),
                snapshots: Vec::new(),
                labels: Vec::new(),
                time_s: 0.0,
                failed: 0,
                lost: 0,
            };
            let assembled = stage.perform(nut_first);
            out.failed += stage.failed;
            out.lost += stage.lost;
            out.assembled += usize::from(assembled);
            out.recording
                .demos
                .push(Demonstration { number: demo as u64, snapshots: stage.snapshots });
            out.labels.push(stage.labels);
            // Luck can make a recording larger than expected.
            let last = out.recording.demos.last().map_or(&[][..], |demo| &demo.snapshots);
            poses += last.iter().map(|snapshot| snapshot.objects.len()).sum::<usize>();
            self.refuse_beyond(poses as f64)?;
        }
        Ok(out)
    }

    /// Generates a single scene with all parts on the table, in the form that `plan --scene` reads.
    ///
    /// # Errors
    /// As [`SyntheticDemonstrations::record`].
    pub fn scene(&self, seed: Seed) -> Result<Snapshot, TaskError> {
        let one = Self { demos: 1, ..self.clone() }.record(seed)?;
        let mut scene =
            one.recording.demos.into_iter().flat_map(|d| d.snapshots).next().unwrap_or_default();
        scene.event = None;
        scene.time_s = None;
        Ok(scene)
    }

    /// Refuses settings that would make a very large recording.
    fn check_size(&self) -> Result<(), TaskError> {
        let attempts = (3.0 / (1.0 - self.fail_rate.clamp(0.0, 0.9))).min(MAX_ATTEMPTS as f64);
        let poses = (2.0 * attempts + 2.0) * (self.nuts + self.bolts + 2) as f64;
        self.refuse_beyond(self.demos as f64 * poses)
    }

    fn refuse_beyond(&self, poses: f64) -> Result<(), TaskError> {
        if poses <= MAX_POSES as f64 {
            return Ok(());
        }
        let expected = "fewer demonstrations, parts or failures: so many make more than 550,000 poses, about 90 MB \
                        of text";
        Err(TaskError::Setting { name: "demos", value: self.demos.to_string(), expected })
    }

    fn check(&self) -> Result<(), TaskError> {
        let setting = |name, value: String, expected| TaskError::Setting { name, value, expected };
        if self.demos == 0 || self.demos > 10_000 {
            return Err(setting("demos", self.demos.to_string(), "1 to 10000"));
        }
        for (name, count) in [("nuts", self.nuts), ("bolts", self.bolts)] {
            if count == 0 || count > 50 {
                return Err(setting(name, count.to_string(), "1 to 50"));
            }
        }
        self.check_size()?;
        if !(0.0..=0.9).contains(&self.fail_rate) {
            return Err(setting("fail_rate", self.fail_rate.to_string(), "0 to 0.9"));
        }
        for (name, rate) in [("loss_rate", self.loss_rate), ("knock_rate", self.knock_rate)] {
            if !(0.0..=1.0).contains(&rate) {
                return Err(setting(name, rate.to_string(), "0 to 1"));
            }
        }
        Ok(())
    }
}

/// Maximum number of poses in a recording. They take about 90 MB as text.
const MAX_POSES: usize = 550_000;

/// Maximum number of attempts in one demonstration.
const MAX_ATTEMPTS: usize = 60;

impl Stage<'_> {
    /// Plays one demonstration and returns whether a bolt ends in a nut.
    fn perform(&mut self, nut_first: bool) -> bool {
        for (part, count) in [(Part::Nut, self.spec.nuts), (Part::Bolt, self.spec.bolts)] {
            for _ in 0..count {
                let pose = self.lying(part);
                self.bodies.push(Body { part, place: Place::Lying, pose });
            }
        }
        if self.spec.events {
            self.snapshot(Some(SnapshotEvent::Start), None, None);
        }
        let parts = if nut_first { [Part::Nut, Part::Bolt] } else { [Part::Bolt, Part::Nut] };
        for _ in 0..MAX_ATTEMPTS {
            if self.bodies.iter().any(|b| b.place == Place::Assembled) {
                break;
            }
            let seated =
                |part| self.bodies.iter().position(|b| b.part == part && b.place == Place::Jig);
            let (nut, bolt) = (seated(Part::Nut), seated(Part::Bolt));
            let done = match (nut, bolt) {
                (Some(nut), Some(bolt)) => self.assemble(nut, bolt),
                _ => {
                    let part = if seated(parts[0]).is_none() { parts[0] } else { parts[1] };
                    self.put_in_jig(part)
                }
            };
            if !done {
                break;
            }
        }
        self.snapshot(self.spec.events.then_some(SnapshotEvent::End), None, None);
        self.bodies.iter().any(|b| b.place == Place::Assembled)
    }

    /// Makes one attempt to put a part into the jig; returns false if no part is left.
    fn put_in_jig(&mut self, part: Part) -> bool {
        let free = |b: &Body| b.part == part && matches!(b.place, Place::Lying | Place::Standing);
        let Some(at) = self.bodies.iter().position(free) else { return false };
        let label = if part == Part::Nut { "PUT_NUT_IN_JIG" } else { "PUT_BOLT_IN_JIG" };
        self.begin(at, label);
        if self.fails() {
            self.drop_part(at);
        } else {
            self.bodies[at].place = Place::Jig;
            self.bodies[at].pose = self.seated(part);
            self.finish(at);
        }
        true
    }

    /// Makes one attempt to put the bolt into the nut.
    fn assemble(&mut self, nut: usize, bolt: usize) -> bool {
        self.begin(bolt, "ASSEMBLE");
        if self.fails() {
            if self.chance(self.spec.loss_rate) {
                // Both come out, and the nut falls over the edge.
                self.bodies[bolt].place = Place::Lying;
                self.bodies[bolt].pose = self.lying(Part::Bolt);
                self.finish_with(bolt, Some(nut));
            } else {
                self.drop_part(bolt);
            }
            return true;
        }
        // The nut moves within its pocket, and the bolt takes the nut's position.
        self.bodies[nut].pose = self.seated(Part::Nut);
        let [x, y, _] = self.bodies[nut].pose.position;
        let jitter = self.jitter();
        self.bodies[bolt].place = Place::Assembled;
        self.bodies[bolt].pose = Pose {
            position: [x + 0.2 * CLEARANCE, y, heights::BOLT_ASSEMBLED + jitter],
            orientation: self.upright(),
        };
        self.finish(bolt);
        true
    }

    fn fails(&mut self) -> bool {
        let fails = self.chance(self.spec.fail_rate);
        self.failed += usize::from(fails);
        fails
    }

    /// Drops a part: off the table, on its head, or flat.
    fn drop_part(&mut self, at: usize) {
        let part = self.bodies[at].part;
        if self.chance(self.spec.loss_rate) {
            self.finish_with(at, Some(at));
            return;
        }
        self.bodies[at].pose = self.lying(part);
        self.bodies[at].place = Place::Lying;
        if part == Part::Bolt && self.chance(0.2) {
            let jitter = self.jitter();
            self.bodies[at].place = Place::Standing;
            self.bodies[at].pose.position[2] = heights::BOLT_STANDING + 10.0 * jitter;
            self.bodies[at].pose.orientation = self.upright();
        }
        self.finish(at);
    }

    fn begin(&mut self, at: usize, label: &str) {
        let event = self.spec.events.then_some(SnapshotEvent::Contact);
        self.snapshot(event, Some(at), Some(label.into()));
    }

    fn finish(&mut self, at: usize) {
        self.finish_with(at, None);
    }

    /// Ends an attempt: other parts creep or are knocked aside, the release is recorded, and a lost part
    /// disappears.
    fn finish_with(&mut self, at: usize, lost: Option<usize>) {
        for other in 0..self.bodies.len() {
            if other != at && self.bodies[other].place == Place::Lying {
                let creep = 2e-5 * self.normal();
                self.bodies[other].pose.position[0] += creep;
                self.bodies[other].pose.position[1] -= creep;
            }
        }
        let lying: Vec<usize> = (0..self.bodies.len())
            .filter(|b| *b != at && self.bodies[*b].place == Place::Lying)
            .collect();
        if !lying.is_empty() && self.chance(self.spec.knock_rate) {
            let knocked = lying[self.rng.random_range(0..lying.len())];
            self.bodies[knocked].pose = self.lying(self.bodies[knocked].part);
        }
        if self.spec.events && lost != Some(at) {
            self.snapshot(Some(SnapshotEvent::Release), Some(at), None);
        }
        if let Some(lost) = lost {
            self.bodies.remove(lost);
            self.lost += 1;
        }
    }

    fn snapshot(
        &mut self,
        event: Option<SnapshotEvent>,
        touched: Option<usize>,
        label: Option<String>,
    ) {
        let (mut nuts, mut bolts) = (0, 0);
        let mut objects: Vec<ObjectPose> = self
            .bodies
            .iter()
            .map(|body| {
                let (kind, number) = match body.part {
                    Part::Nut => ("nut", &mut nuts),
                    Part::Bolt => ("bolt", &mut bolts),
                };
                *number += 1;
                let id = format!("{kind}_{}", *number - 1).into();
                ObjectPose { id, kind: kind.into(), pose: body.pose }
            })
            .collect();
        for (kind, [x, y]) in [("nut_pocket", POCKET), ("bolt_hole", HOLE)] {
            let pose = Pose::at([x, y, 0.044]);
            objects.push(ObjectPose { id: format!("{kind}_0").into(), kind: kind.into(), pose });
        }
        self.time_s += if self.snapshots.is_empty() { 0.0 } else { 1.5 };
        self.snapshots.push(Snapshot {
            number: self.snapshots.len() as u64,
            time_s: self.spec.events.then_some(self.time_s),
            event,
            object: touched.filter(|_| self.spec.events),
            objects,
        });
        self.labels.push(label);
    }

    fn chance(&mut self, probability: f64) -> bool {
        self.rng.random::<f64>() < probability
    }

    fn normal(&mut self) -> f64 {
        self.rng.sample(StandardNormal)
    }

    /// Heights repeat to about 20 micrometres.
    fn jitter(&mut self) -> f64 {
        1e-5 * self.normal()
    }

    fn uniform(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.rng.random::<f64>()
    }

    fn lying(&mut self, part: Part) -> Pose {
        let x = self.uniform(TABLE[0][0], TABLE[1][0]);
        let y = self.uniform(TABLE[0][1], TABLE[1][1]);
        let yaw = self.uniform(-3.1, 3.1);
        let roll = self.uniform(-3.1, 3.1);
        let (z, turn) = match part {
            Part::Nut => (heights::NUT_LYING, UnitQuaternion::identity()),
            Part::Bolt => (
                heights::BOLT_LYING,
                UnitQuaternion::from_axis_angle(&Vector3::y_axis(), std::f64::consts::FRAC_PI_2)
                    * UnitQuaternion::from_axis_angle(&Vector3::z_axis(), roll),
            ),
        };
        let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), yaw) * turn;
        let z = z + self.jitter();
        Pose { position: [x, y, z], orientation: quaternion_array(&turn) }
    }

    fn seated(&mut self, part: Part) -> Pose {
        let ([x, y], z) = match part {
            Part::Nut => (POCKET, heights::NUT_SEATED),
            Part::Bolt => (HOLE, heights::BOLT_SEATED),
        };
        let position = [
            x + self.uniform(-CLEARANCE, CLEARANCE),
            y + self.uniform(-CLEARANCE, CLEARANCE),
            z + self.jitter(),
        ];
        Pose { position, orientation: self.upright() }
    }

    fn upright(&mut self) -> [f64; 4] {
        let yaw = self.uniform(-3.1, 3.1);
        quaternion_array(&UnitQuaternion::from_axis_angle(&Vector3::z_axis(), yaw))
    }
}
