//! Logs of poses as a camera and a gripper would have written them, from recordings: the carried object and the hand follow
//! smooth paths between contact and release, and samples are noisy, late, dropped and missing.

// Each test binary uses only some of these functions.
#![allow(dead_code)]

use std::fmt::Write as _;

use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use symbolt::robot::Pose;
use symbolt::task::{Demonstration, Recording, Snapshot, SnapshotEvent};

/// What a log shows of the gripper.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Shown {
    Width,
    Flag,
    Hand,
    Nothing,
}

/// How a log is sampled.
#[derive(Debug, Clone, Copy)]
pub struct Sampling {
    pub rate_hz: f64,
    pub noise_m: f64,
    pub noise_deg: f64,
    /// Share of frames that are dropped, and of poses that are missing.
    pub lost: f64,
    pub shown: Shown,
}

/// The truth about an event: demonstration, kind of event, id, and its time as the log can show it.
pub type Truth = (usize, SnapshotEvent, String, f64);

struct Leg {
    from: f64,
    to: f64,
    a: Pose,
    b: Pose,
}

struct Carry {
    id: String,
    contact: f64,
    release: f64,
    legs: Vec<Leg>,
    /// What moves along with the object, such as what lies in a drawer.
    riders: Vec<(String, Vec<Leg>)>,
}

impl Carry {
    /// The way of an object, if it moves.
    fn way(&self, id: &str) -> &[Leg] {
        let mut all = [(&self.id, &self.legs)].into_iter();
        let mut riders = self.riders.iter().map(|(id, legs)| (id, legs));
        all.find(|(own, _)| *own == id)
            .or_else(|| riders.find(|(own, _)| *own == id))
            .map_or(&[], |(_, legs)| legs)
    }
}

/// Where something is that moves with a body from `a` to `b`.
fn along(a: &Pose, b: &Pose, own: &Pose) -> Pose {
    let vector = |pose: &Pose| Vector3::from(pose.position);
    let turn = rotation(b) * rotation(a).inverse();
    let position = vector(b) + turn * (vector(own) - vector(a));
    let turn = turn * rotation(own);
    Pose { position: position.into(), orientation: [turn.i, turn.j, turn.k, turn.w] }
}

/// Distance from which something has moved along, in metres.
const ALONG_M: f64 = 0.01;

fn rotation(pose: &Pose) -> UnitQuaternion<f64> {
    let [x, y, z, w] = pose.orientation;
    UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z))
}

fn between(a: &Pose, b: &Pose, share: f64) -> Pose {
    let u = share.clamp(0.0, 1.0);
    let u = u * u * (3.0 - 2.0 * u);
    let position = [0, 1, 2].map(|i| a.position[i] + (b.position[i] - a.position[i]) * u);
    let turn = rotation(a).try_slerp(&rotation(b), u, 1e-9).unwrap_or(rotation(b));
    Pose { position, orientation: [turn.i, turn.j, turn.k, turn.w] }
}

fn pose_of(snapshot: &Snapshot, id: &str) -> Option<Pose> {
    snapshot.objects.iter().find(|object| &*object.id == id).map(|object| object.pose)
}

/// Plans the carries of a demonstration. Returns them with the time at which the log ends.
fn carries(demo: &Demonstration, rng: &mut ChaCha8Rng) -> (Vec<Carry>, f64) {
    let mut t = 1.0 + rng.random::<f64>();
    let mut found = Vec::new();
    for pair in demo.snapshots.windows(2) {
        let [one, other] = pair else { continue };
        let both = one.event == Some(SnapshotEvent::Contact)
            && other.event == Some(SnapshotEvent::Release);
        let Some(object) = one.object.filter(|_| both) else { continue };
        let id = one.objects[object].id.to_string();
        let (Some(a), Some(b)) = (pose_of(one, &id), pose_of(other, &id)) else { continue };
        let top = a.position[2].max(b.position[2]) + 0.12;
        let over =
            |pose: &Pose| Pose { position: [pose.position[0], pose.position[1], top], ..*pose };
        let stops = [a, over(&a), over(&b), b];
        t += 2.0 + rng.random::<f64>();
        let contact = t;
        t += 0.03;
        let mut legs: Vec<Leg> = Vec::new();
        for pair in stops.windows(2) {
            let lasts = (pair[0].distance(&pair[1]) / 0.25).max(0.4);
            legs.push(Leg { from: t, to: t + lasts, a: pair[0], b: pair[1] });
            t += lasts;
        }
        t += 0.03;
        let riders = one.objects.iter().filter(|object| *object.id != *id);
        let riders = riders.filter_map(|object| {
            let (own, to) = (object.pose, pose_of(other, &object.id)?);
            let stops = [own, along(&a, &stops[1], &own), along(&a, &stops[2], &own), to];
            let pairs = legs.iter().zip(stops.windows(2));
            let legs = pairs.map(|(l, s)| Leg { from: l.from, to: l.to, a: s[0], b: s[1] });
            (own.distance(&to) > ALONG_M).then(|| (object.id.to_string(), legs.collect()))
        });
        let riders = riders.collect();
        found.push(Carry { id, contact, release: t, legs, riders });
    }
    (found, t + 2.0)
}

/// Writes a log in the long form, and returns the events that it shows.
pub fn log(recording: &Recording, sampling: &Sampling, seed: u64) -> (String, Vec<Truth>) {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let (mut text, mut truth) =
        (String::from("demo,time,id,x,y,z,qx,qy,qz,qw,width,grasped\n"), Vec::new());
    for (number, demo) in recording.demos.iter().enumerate() {
        let (all, end) = carries(demo, &mut rng);
        for carry in &all {
            let by_signal = matches!(sampling.shown, Shown::Width | Shown::Flag);
            let (first, last) = match by_signal {
                true => (carry.contact, carry.release),
                false => (carry.legs[0].from, carry.legs[2].to),
            };
            truth.push((number, SnapshotEvent::Contact, carry.id.clone(), first));
            truth.push((number, SnapshotEvent::Release, carry.id.clone(), last));
        }
        let mut frame = 0.0;
        while frame < end {
            let t = frame + rng.random_range(-0.2..0.2) / sampling.rate_hz;
            frame += 1.0 / sampling.rate_hz;
            if rng.random::<f64>() < sampling.lost {
                continue;
            }
            let closed = all.iter().any(|c| (c.contact..=c.release).contains(&t));
            let ramp = |c: &Carry| {
                ((t - c.contact + 0.3) / 0.3).clamp(0.0, 1.0)
                    - ((t - c.release) / 0.3).clamp(0.0, 1.0)
            };
            let width = 0.08 - 0.05 * all.iter().map(ramp).sum::<f64>();
            let mut bodies: Vec<(String, Pose)> = Vec::new();
            for object in &demo.snapshots[0].objects {
                let own = all.iter().rev().flat_map(|c| c.way(&object.id).iter().rev());
                let pose = own.into_iter().find(|leg| t >= leg.from);
                let pose = pose.map_or(object.pose, |leg| {
                    between(&leg.a, &leg.b, (t - leg.from) / (leg.to - leg.from))
                });
                bodies.push((object.id.to_string(), pose));
            }
            if sampling.shown == Shown::Hand {
                bodies.push(("hand".into(), hand(&all, t)));
            }
            for (id, pose) in bodies {
                if rng.random::<f64>() < sampling.lost {
                    continue;
                }
                let mut normal = || rng.sample::<f64, _>(StandardNormal);
                let [x, y, z] = pose.position.map(|v| v + sampling.noise_m * normal());
                let axis = Vector3::new(normal(), normal(), normal()).normalize();
                let angle = sampling.noise_deg.to_radians() * normal();
                let turn = UnitQuaternion::new(axis * angle) * rotation(&pose);
                let (width, grasped) = match sampling.shown {
                    Shown::Width => (format!("{:.4}", width + 2e-4 * normal()), String::new()),
                    Shown::Flag => (String::new(), u8::from(closed).to_string()),
                    _ => (String::new(), String::new()),
                };
                let (i, j, k, w) = (turn.i, turn.j, turn.k, turn.w);
                let _ = writeln!(
                    text,
                    "{number},{t:.4},{id},{x:.5},{y:.5},{z:.5},{i:.5},{j:.5},{k:.5},{w:.5},{width},{grasped}"
                );
            }
        }
    }
    (text, truth)
}

/// The hand: above the object while it is held, and on its way before and after.
fn hand(all: &[Carry], t: f64) -> Pose {
    let over = |pose: &Pose| {
        let [x, y, z] = pose.position;
        Pose::at([x, y, z + 0.08])
    };
    let mut last = (0.0, Pose::at([0.3, 0.0, 0.5]));
    for carry in all {
        let first = over(&carry.legs[0].a);
        if t < carry.contact - 0.4 {
            // It rises on its way, also to the same object.
            let share = ((t - last.0 - 0.3) / (carry.contact - 0.7 - last.0)).clamp(0.0, 1.0);
            let [x, y, z] = between(&last.1, &first, share).position;
            return Pose::at([x, y, z + 0.15 * (share * std::f64::consts::PI).sin()]);
        }
        if t < carry.release + 0.3 {
            let leg = carry.legs.iter().rev().find(|leg| t >= leg.from);
            return leg.map_or(first, |leg| {
                over(&between(&leg.a, &leg.b, (t - leg.from) / (leg.to - leg.from)))
            });
        }
        last = (carry.release, over(&carry.legs[2].b));
    }
    let [x, y, z] = last.1.position;
    between(&last.1, &Pose::at([x, y, z + 0.2]), (t - last.0 - 0.3) / 1.0)
}
