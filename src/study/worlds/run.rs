//! Carries out moves by the rules of a [`Spec`].

use std::f64::consts::PI;
use std::sync::Arc;

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::rest::{draw, fits, rest};
use super::spec::{Count, Job, Kind, Lie, Quota, Spec, Start};
use super::truth::{Extent, Need, TrueGoal};
use super::{Resting, Stage};
use crate::robot::Pose;
use crate::robot::pose::quaternion_array;
use crate::sim::Seed;
use crate::task::recording::{ObjectPose, Snapshot};

/// Two objects on one reference object cannot be closer than this, in metres.
const OCCUPIED_M: f64 = 8e-3;

/// Objects whose heights differ by more than this do not collide, in metres.
const ABOVE_M: f64 = 0.12;

/// Maximum number of draws of a free pose.
const DRAWS: usize = 500;

/// The state that an object is in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct At {
    /// Index of the rule.
    pub rule: usize,
    /// Index of the reference object; `None` in the world frame.
    pub on: Option<usize>,
    /// Index of the place.
    pub place: usize,
}

#[derive(Debug)]
pub(super) struct Body {
    pub id: Arc<str>,
    pub kind: usize,
    pub pose: Isometry3<f64>,
    pub at: Option<At>,
    /// Number of the object's size, and half of its height, in metres.
    pub size: usize,
    pub half_m: f64,
}

/// A job of this run: its quota with drawn numbers, and whether it is complete.
#[derive(Debug)]
pub(super) struct Duty {
    pub quota: Quota,
    pub done: bool,
}

/// A run of a world: a scene that moves change.
#[derive(Debug)]
pub struct Run {
    pub(super) spec: Arc<Spec>,
    pub(super) seed: Seed,
    pub(super) bodies: Vec<Body>,
    pub(super) duties: Vec<Duty>,
    pub(super) moves: u64,
}

pub(super) fn isometry(pose: &Pose) -> Isometry3<f64> {
    Isometry3::from_parts(Translation3::from(pose.position), pose.rotation())
}

pub(super) fn pose(isometry: &Isometry3<f64>) -> Pose {
    let t = isometry.translation.vector;
    Pose { position: [t.x, t.y, t.z], orientation: quaternion_array(&isometry.rotation) }
}

impl Run {
    pub(super) fn begin(spec: Arc<Spec>, seed: Seed, stage: Stage) -> Self {
        let seed = match stage {
            Stage::Demonstration(number) => {
                seed.derive(spec.name, "demonstration").derive_index("number", number as u64)
            }
            Stage::Test => seed.derive(spec.name, "test"),
        };
        let mut rng = seed.derive(spec.name, "scene").rng();
        let duty = |job: &Job, rng: &mut ChaCha8Rng| match job.quota {
            Quota::Drawn(low, high) => Quota::Total(rng.random_range(low..=high)),
            quota => quota,
        };
        let turn = match stage {
            Stage::Demonstration(number) => number % 2,
            Stage::Test => seed.derive(spec.name, "turn").rng().random_range(0..2),
        };
        let in_turn = |own: Option<usize>| own.is_none_or(|own| own == turn);
        let duties = (spec.jobs.iter())
            .map(|job| Duty { quota: duty(job, &mut rng), done: !in_turn(job.in_turn) })
            .collect();
        let mut run = Self { spec: spec.clone(), seed, bodies: Vec::new(), duties, moves: 0 };
        for (index, kind) in spec.kinds.iter().enumerate().filter(|(_, k)| in_turn(k.in_turn)) {
            let count = match kind.count {
                Count::Any(low, high) => rng.random_range(low..=high),
                Count::Differs { shown, test } => {
                    let (low, high) = if stage == Stage::Test { test } else { shown };
                    rng.random_range(low..=high)
                }
                Count::Like { kind, more } => {
                    run.of_kind(kind).count() + rng.random_range(0..=more)
                }
            };
            let sizes = kind.half_heights_m.len();
            let smallest = if sizes > 0 { rng.random_range(0..sizes) } else { 0 };
            for number in 0..count {
                let id = format!("{}_{number}", kind.name).into();
                let first = match (stage, kind.start) {
                    (Stage::Demonstration(demo), Start::Seldom { demos, .. }) => demo >= demos,
                    (Stage::Demonstration(demo), _) => (demo + number) % 2 == 0,
                    (Stage::Test, _) => rng.random(),
                };
                let size = (smallest + number) % sizes.max(1);
                let half_m = kind.half_heights_m.get(size).copied().unwrap_or(0.0);
                let (pose, at) = run.start(kind, half_m, first, &mut rng);
                run.bodies.push(Body { id, kind: index, pose, at, size, half_m });
            }
        }
        run.trigger(&mut rng);
        run
    }

    /// Draws where an object of a kind is when the run begins.
    fn start(
        &self,
        kind: &Kind,
        half_m: f64,
        first: bool,
        rng: &mut ChaCha8Rng,
    ) -> (Isometry3<f64>, Option<At>) {
        let state = match kind.start {
            Start::Fixed(point) => return (isometry(&Pose::at(point)), None),
            Start::Anywhere { x, y, z } => {
                let mut pose = Isometry3::identity();
                for _ in 0..DRAWS {
                    let x = rng.random_range(x[0]..=x[1]);
                    let y = rng.random_range(y[0]..=y[1]);
                    let yaw = rng.random_range(-PI..=PI).to_degrees().to_radians();
                    let turn = UnitQuaternion::new(Vector3::z() * yaw);
                    pose = Isometry3::from_parts(Translation3::new(x, y, z), turn);
                    if self.clear(None, kind.radius_m, None, &pose) {
                        break;
                    }
                }
                return (pose, None);
            }
            Start::In(state) => state,
            Start::Either(one, _) | Start::Seldom { usual: one, .. } if first => one,
            Start::Either(_, other) | Start::Seldom { other, .. } => other,
        };
        let Some(rule) = self.rule(state) else { return (Isometry3::identity(), None) };
        let mut start = (Isometry3::identity(), None);
        for _ in 0..DRAWS {
            let references = self.references(rule);
            if references.is_empty() {
                break;
            }
            let on = references[rng.random_range(0..references.len())];
            let place = rng.random_range(0..self.spec.states[rule].places.len());
            let at = At { rule, on, place };
            let local = draw(&self.spec.states[rule], kind.lie, self.spec.careless, rng);
            let local = rest(&self.spec.states[rule], kind.lie, &local, rng);
            let pose = self.place(at, half_m) * local;
            start = (pose, Some(at));
            if self.vacant(None, kind.radius_m, at, &pose) {
                break;
            }
        }
        start
    }

    pub(super) fn rule(&self, state: &str) -> Option<usize> {
        self.spec.states.iter().position(|r| r.name == state)
    }

    pub(super) fn of_kind<'a>(&'a self, kind: &'a str) -> impl Iterator<Item = usize> + 'a {
        (0..self.bodies.len()).filter(move |b| self.kind(*b).name == kind)
    }

    pub(super) fn kind(&self, body: usize) -> &Kind {
        &self.spec.kinds[self.bodies[body].kind]
    }

    pub(super) fn is_in(&self, body: usize, state: &str) -> bool {
        self.bodies[body].at.is_some_and(|at| self.spec.states[at.rule].name == state)
    }

    /// The objects in a state; with `on`, only those relative to that reference object.
    pub(super) fn count(&self, state: &str, on: Option<usize>) -> usize {
        let here = |b: &Body| on.is_none() || b.at.and_then(|at| at.on) == on;
        (0..self.bodies.len()).filter(|b| self.is_in(*b, state) && here(&self.bodies[*b])).count()
    }

    /// All reference objects that a rule's state can have.
    pub(super) fn references(&self, rule: usize) -> Vec<Option<usize>> {
        match self.spec.states[rule].frame {
            None => vec![None],
            Some(kind) => self.of_kind(kind).map(Some).collect(),
        }
    }

    /// All places in a rule's state, for each of its reference objects.
    fn places(&self, rule: usize) -> impl Iterator<Item = At> + use<> {
        let places = self.spec.states[rule].places.len();
        let of = move |on| (0..places).map(move |place| At { rule, on, place });
        self.references(rule).into_iter().flat_map(of)
    }

    /// All moves into a rule's state that the rules allow.
    pub(super) fn moves_into(&self, rule: usize) -> Vec<(usize, At)> {
        let of = |body| self.places(rule).map(move |at| (body, at));
        let moves = self.of_kind(self.spec.states[rule].kind).flat_map(of);
        moves.filter(|(body, at)| self.allowed(*body, *at)).collect()
    }

    /// The pose of a place in the world, for an object of half the height `half_m`.
    pub(super) fn place(&self, at: At, half_m: f64) -> Isometry3<f64> {
        let mut local = isometry(&self.spec.states[at.rule].places[at.place]);
        local.translation.z += half_m + at.on.map_or(0.0, |on| self.bodies[on].half_m);
        at.on.map_or(local, |on| self.bodies[on].pose * local)
    }

    /// Whether `body` rests on or in `base`, directly or through other objects.
    fn rests_on(&self, body: usize, base: usize) -> bool {
        let mut below = self.bodies[body].at.and_then(|at| at.on);
        for _ in 0..self.bodies.len() {
            match below {
                Some(b) if b == base => return true,
                Some(b) => below = self.bodies[b].at.and_then(|at| at.on),
                None => return false,
            }
        }
        false
    }

    /// Whether no footprint overlaps that of an object of radius `radius_m` at `pose`. The object itself, what it
    /// carries, and what it would rest on are left out.
    pub(super) fn clear(
        &self,
        body: Option<usize>,
        radius_m: f64,
        on: Option<usize>,
        pose: &Isometry3<f64>,
    ) -> bool {
        (0..self.bodies.len()).all(|other| {
            if body.is_some_and(|b| b == other || self.rests_on(other, b))
                || on.is_some_and(|on| on == other || self.rests_on(on, other))
            {
                return true;
            }
            let apart = self.bodies[other].pose.translation.vector - pose.translation.vector;
            apart.z.abs() > ABOVE_M || apart.xy().norm() >= radius_m + self.kind(other).radius_m
        })
    }

    /// Whether a place is free for an object at `pose`.
    pub(super) fn vacant(
        &self,
        body: Option<usize>,
        radius_m: f64,
        at: At,
        pose: &Isometry3<f64>,
    ) -> bool {
        match self.spec.states[at.rule].extent {
            Extent::Area { depth_m, .. } => {
                depth_m > 0.0 || self.clear(body, radius_m, at.on, pose)
            }
            Extent::Spot { .. } => (0..self.bodies.len()).all(|other| {
                let seat = self.bodies[other].at;
                let apart = || {
                    let place = self.place(at, self.bodies[other].half_m).translation.vector;
                    (self.bodies[other].pose.translation.vector - place).norm()
                };
                Some(other) == body
                    || seat
                        .is_none_or(|seat| seat != at && (seat.on != at.on || apart() > OCCUPIED_M))
            }),
        }
    }

    pub(super) fn holds(&self, need: &Need, body: usize, on: Option<usize>) -> bool {
        let others = |state| {
            let others = (0..self.bodies.len()).filter(|b| *b != body && Some(*b) != on);
            others.filter(|b| self.is_in(*b, state)).count()
        };
        match *need {
            Need::Object(state) => self.is_in(body, state),
            Need::Reference(state) => on.is_some_and(|on| self.is_in(on, state)),
            Need::Holds { state, at_least } => {
                on.is_some_and(|on| self.count(state, Some(on)) >= at_least)
            }
            Need::Somewhere(state) => others(state) > 0,
            Need::Nowhere(state) => others(state) == 0,
            Need::Clear(state) => on.is_some_and(|on| self.count(state, Some(on)) == 0),
            Need::Every(state) => {
                let kind = self.rule(state).map_or("", |rule| self.spec.states[rule].kind);
                self.of_kind(kind).all(|b| b == body || Some(b) == on || self.is_in(b, state))
            }
        }
    }

    /// Whether the rules let an object enter a state, wherever exactly it is put.
    pub(super) fn allowed(&self, body: usize, at: At) -> bool {
        let kind = self.kind(body);
        let loaded = || self.bodies.iter().any(|b| b.at.and_then(|at| at.on) == Some(body));
        if kind.fixture || (!kind.carries && loaded()) {
            return false;
        }
        if at.on.is_some_and(|on| on == body || self.rests_on(on, body)) {
            return false;
        }
        let rule = &self.spec.states[at.rule];
        let holds = |need: &Need| self.holds(need, body, at.on);
        rule.size.is_none_or(|size| size == self.bodies[body].size)
            && rule.needs.iter().chain(&rule.reach).all(holds)
            && (rule.either.is_empty() || rule.either.iter().any(holds))
            && self.bodies[body].at.is_none_or(|now| {
                self.spec.states[now.rule].reach.iter().all(|n| self.holds(n, body, now.on))
            })
    }

    /// The states at a target pose that the rules let the object enter, nearest first.
    fn targets(&self, body: usize, target: &Isometry3<f64>) -> Vec<At> {
        let mut found = Vec::new();
        for (rule, candidate) in self.spec.states.iter().enumerate() {
            if candidate.kind != self.kind(body).name {
                continue;
            }
            for at in self.places(rule) {
                let local = self.place(at, self.bodies[body].half_m).inverse() * target;
                if fits(candidate, &local)
                    && self.allowed(body, at)
                    && self.vacant(Some(body), self.kind(body).radius_m, at, target)
                {
                    found.push((local.translation.vector.norm(), at));
                }
            }
        }
        found.sort_by(|a, b| a.0.total_cmp(&b.0));
        found.into_iter().map(|(_, at)| at).collect()
    }

    /// Moves an object to a place, with everything that rests on it.
    fn put(&mut self, body: usize, at: At, to: Isometry3<f64>) {
        let shift = to * self.bodies[body].pose.inverse();
        let load: Vec<usize> =
            (0..self.bodies.len()).filter(|other| self.rests_on(*other, body)).collect();
        for other in load {
            self.bodies[other].pose = shift * self.bodies[other].pose;
        }
        self.bodies[body].pose = to;
        self.bodies[body].at = Some(at);
    }

    /// Puts an object down at a target in the world frame. It comes to rest near it.
    fn put_down(&mut self, body: usize, at: At, target: &Isometry3<f64>, rng: &mut ChaCha8Rng) {
        let place = self.place(at, self.bodies[body].half_m);
        let local = place.inverse() * target;
        let local = rest(&self.spec.states[at.rule], self.kind(body).lie, &local, rng);
        self.put(body, at, place * local);
    }

    /// Moves the objects that no hand moves.
    fn trigger(&mut self, rng: &mut ChaCha8Rng) {
        for trigger in self.spec.clone().triggers.iter().copied() {
            let on = self.count(trigger.when, None) > 0;
            let state = if on { trigger.then } else { trigger.otherwise };
            let Some(rule) = self.rule(state) else { continue };
            let kind = self.spec.states[rule].kind;
            for body in self.of_kind(kind).collect::<Vec<_>>() {
                let Some(now) = self.bodies[body].at.filter(|now| now.rule != rule) else {
                    continue;
                };
                let at = At { rule, ..now };
                let local = rest(&self.spec.states[rule], Lie::Flat, &Isometry3::identity(), rng);
                self.put(body, at, self.place(at, self.bodies[body].half_m) * local);
            }
        }
    }
}

impl Run {
    /// Returns the current poses of all objects. `number` is the number of accepted moves; there is no event.
    pub fn snapshot(&self) -> Snapshot {
        let object = |body: &Body| ObjectPose {
            id: body.id.clone(),
            kind: self.spec.kinds[body.kind].name.into(),
            pose: pose(&body.pose),
        };
        Snapshot {
            number: self.moves,
            objects: self.bodies.iter().map(object).collect(),
            ..Snapshot::default()
        }
    }

    /// Returns the true state of each object, in the order of [`Run::snapshot`]; `None` for a fixture without states.
    pub(super) fn resting(&self) -> Vec<Option<Resting>> {
        let resting = |at: At| Resting {
            state: self.spec.states[at.rule].name,
            reference: at.on.map(|on| self.bodies[on].id.clone()),
        };
        self.bodies.iter().map(|body| body.at.map(resting)).collect()
    }

    /// Moves an object to a target pose in the world frame and returns whether the world accepted the move. A refused
    /// move changes nothing. An accepted move ends at a resting pose near the target.
    pub fn act(&mut self, object: &str, target: &Pose) -> bool {
        let Some(body) = self.bodies.iter().position(|b| *b.id == *object) else { return false };
        let target = isometry(target);
        let Some(at) = self.targets(body, &target).first().copied() else { return false };
        let mut rng = self.seed.derive_index("rest", self.moves).rng();
        self.put_down(body, at, &target, &mut rng);
        self.moves += 1;
        self.trigger(&mut rng);
        true
    }

    /// Lets another hand, with the world's probability, move a drawn object that lies loose to another point of where it
    /// lies. No event tells of it.
    pub(super) fn disturb(&mut self) {
        let mut rng = self.seed.derive_index("bystander", self.moves).rng();
        if rng.random::<f64>() >= self.spec.bystander {
            return;
        }
        let mut loose: Vec<(usize, At)> = (0..self.bodies.len())
            .filter_map(|body| Some((body, self.bodies[body].at?)))
            .filter(|(body, at)| !self.spec.states[at.rule].is_spot() && self.allowed(*body, *at))
            .collect();
        while !loose.is_empty() {
            let (body, at) = loose.swap_remove(rng.random_range(0..loose.len()));
            if let Some(to) = self.free_target(body, at, &mut rng) {
                return self.put_down(body, at, &to, &mut rng);
            }
        }
    }

    /// Returns whether the goal is reached.
    pub fn solved(&self) -> bool {
        let holds = |goals: &[TrueGoal]| goals.iter().all(|goal| self.reached(goal));
        let (one, other) = (&self.spec.goal, &self.spec.or_goal);
        holds(one) || (!other.is_empty() && holds(other))
    }

    fn reached(&self, goal: &TrueGoal) -> bool {
        self.rule(goal.state).map(|rule| &self.spec.states[rule]).is_some_and(|state| {
            match goal.each {
                None => self.count(goal.state, None) >= goal.at_least,
                Some(each) if each == state.kind => {
                    self.of_kind(each).all(|b| self.is_in(b, goal.state))
                }
                Some(each) => {
                    self.of_kind(each).all(|b| self.count(goal.state, Some(b)) >= goal.at_least)
                }
            }
        })
    }
}
