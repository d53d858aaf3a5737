//! Worlds as data: kinds of objects, states, rules, and the demonstrator's jobs.

use std::f64::consts::PI;

use nalgebra::{UnitQuaternion, Vector3};

use super::truth::{Extent, Need, TrueGoal, TrueState, Turn};
use crate::robot::Pose;
use crate::robot::pose::quaternion_array;

/// How many objects of a kind there are.
#[derive(Debug, Clone, Copy)]
pub(super) enum Count {
    /// A number drawn from a range, the same in demonstrations and tests.
    Any(usize, usize),
    /// A number drawn from one range in demonstrations and from another in tests.
    Differs { shown: (usize, usize), test: (usize, usize) },
    /// As many as there are objects of another kind, and up to `more` more.
    Like { kind: &'static str, more: usize },
}

/// Where an object is when a run begins.
#[derive(Debug, Clone, Copy)]
pub(super) enum Start {
    /// In a state, relative to a drawn reference object.
    In(&'static str),
    /// Alternately in the first and the second state; drawn in tests.
    Either(&'static str, &'static str),
    /// Always at the same pose, in no state.
    Fixed(Pose),
    /// Anywhere in a rectangle of the world `[[x, x], [y, y]]`, turned by up to `turn` radians, in no state.
    Anywhere { x: [f64; 2], y: [f64; 2], z: f64, turn: f64 },
}

/// How an object lies on a surface if its orientation is free.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Lie {
    /// With its z axis upwards.
    Flat,
    /// On its side, with its z axis horizontal.
    Side,
    /// In any orientation.
    Tumbled,
}

#[derive(Debug, Clone)]
pub(super) struct Kind {
    pub name: &'static str,
    pub count: Count,
    pub start: Start,
    /// Whether a hand can move the object.
    pub movable: bool,
    /// Whether the object can be moved while something rests on it or in it.
    pub carries: bool,
    pub lie: Lie,
    /// Radius of the footprint, in metres.
    pub radius_m: f64,
}

/// A state with its rules.
#[derive(Debug, Clone)]
pub(super) struct Rule {
    pub state: TrueState,
    /// Conditions for entering the state.
    pub needs: Vec<Need>,
    /// Conditions for entering and leaving the state.
    pub reach: Vec<Need>,
}

/// When a job is complete.
#[derive(Debug, Clone, Copy)]
pub(super) enum Quota {
    /// So many objects are in the state.
    Total(usize),
    /// A number of objects between these two is in the state. The number is drawn for each run.
    Drawn(usize, usize),
    /// Every reference object has an object in the state.
    EachReference,
    /// Every object of the kind is in the state.
    EachObject,
    /// No object is left in the given state.
    Empty(&'static str),
}

/// Something that the demonstrator does.
#[derive(Debug, Clone)]
pub(super) struct Job {
    pub to: &'static str,
    pub quota: Quota,
    /// States of the jobs that must be complete before this one begins.
    pub after: Vec<&'static str>,
    pub in_place: bool,
}

/// An object that moves without a hand: while some object is in `when`, objects of the kind are in `then`, otherwise in
/// `otherwise`.
#[derive(Debug, Clone, Copy)]
pub(super) struct Trigger {
    pub when: &'static str,
    pub then: &'static str,
    pub otherwise: &'static str,
}

#[derive(Debug, Clone)]
pub(super) struct Spec {
    pub name: &'static str,
    pub kinds: Vec<Kind>,
    pub rules: Vec<Rule>,
    pub jobs: Vec<Job>,
    pub triggers: Vec<Trigger>,
    pub habits: Vec<(&'static str, &'static str)>,
    pub goal: Vec<TrueGoal>,
}

/// The pose `[x, y, z]`, unrotated.
pub(super) fn at(x: f64, y: f64, z: f64) -> Pose {
    Pose::at([x, y, z])
}

/// `pose` with an orientation given by an axis and an angle in degrees.
pub(super) fn turned(pose: Pose, axis: [f64; 3], degrees: f64) -> Pose {
    let turn = UnitQuaternion::new(Vector3::from(axis) * degrees.to_radians());
    Pose { orientation: quaternion_array(&turn), ..pose }
}

/// A state at one or several points of a frame.
pub(super) fn spot(
    name: &'static str,
    kind: &'static str,
    frame: &'static str,
    places: &[Pose],
) -> Rule {
    let extent = Extent::Spot { tolerance_m: 3e-3, spread_m: 0.0 };
    let places = places.to_vec();
    let state = TrueState {
        name,
        kind,
        frame: Some(frame),
        places,
        extent,
        turn: Turn::Axis,
        tolerance_deg: 5.0,
    };
    Rule { state, needs: Vec::new(), reach: Vec::new() }
}

/// A state anywhere on a flat rectangle, in the world unless [`Rule::of`] gives a frame.
pub(super) fn area(name: &'static str, kind: &'static str, centre: Pose, half_m: [f64; 2]) -> Rule {
    let mut rule = spot(name, kind, "", &[centre]);
    rule.state.frame = None;
    rule.state.turn = Turn::Free;
    rule.state.extent = Extent::Area { half_m, depth_m: 0.0 };
    rule
}

/// A state anywhere on the table of the worlds whose parts lie loose.
pub(super) fn on_table(name: &'static str, kind: &'static str, height: f64) -> Rule {
    area(name, kind, at(-0.1, 0.3, height), [0.25, 0.25])
}

impl Rule {
    pub fn of(mut self, frame: &'static str) -> Self {
        self.state.frame = Some(frame);
        self
    }

    pub fn turn(mut self, turn: Turn) -> Self {
        self.state.turn = turn;
        self
    }

    pub fn tolerance(mut self, millimetres: f64, degrees: f64) -> Self {
        let tolerance_m = millimetres * 1e-3;
        self.state.extent = Extent::Spot { tolerance_m, spread_m: 0.2 * tolerance_m };
        self.state.tolerance_deg = degrees;
        self
    }

    pub fn depth(mut self, metres: f64) -> Self {
        if let Extent::Area { depth_m, .. } = &mut self.state.extent {
            *depth_m = metres;
        }
        self
    }

    pub fn needs(mut self, needs: &[Need]) -> Self {
        self.needs = needs.to_vec();
        self
    }

    pub fn reach(mut self, needs: &[Need]) -> Self {
        self.reach = needs.to_vec();
        self
    }
}

impl Kind {
    /// A kind that nobody moves, with one object.
    pub fn fixture(name: &'static str, start: Start) -> Self {
        let count = Count::Any(1, 1);
        let (lie, radius_m) = (Lie::Flat, 0.08);
        Self { name, count, start, movable: false, carries: true, lie, radius_m }
    }

    /// A kind that hands move and that nothing can rest on while it is moved.
    pub fn part(name: &'static str, count: Count, start: Start) -> Self {
        let kind = Self::fixture(name, start);
        Self { count, movable: true, carries: false, radius_m: 0.025, ..kind }
    }

    pub fn count(self, count: Count) -> Self {
        Self { count, ..self }
    }

    pub fn lie(self, lie: Lie) -> Self {
        Self { lie, ..self }
    }

    pub fn radius(self, radius_m: f64) -> Self {
        Self { radius_m, ..self }
    }

    pub fn carries(self) -> Self {
        Self { carries: true, ..self }
    }
}

/// A fixture's start anywhere in a rectangle, turned by any angle.
pub(super) fn anywhere(x: [f64; 2], y: [f64; 2], z: f64) -> Start {
    Start::Anywhere { x, y, z, turn: PI }
}

impl Spec {
    pub fn new(name: &'static str) -> Self {
        Self {
            name,
            kinds: Vec::new(),
            rules: Vec::new(),
            jobs: Vec::new(),
            triggers: Vec::new(),
            habits: Vec::new(),
            goal: Vec::new(),
        }
    }

    pub fn kinds(mut self, kinds: impl IntoIterator<Item = Kind>) -> Self {
        self.kinds.extend(kinds);
        self
    }

    pub fn states(mut self, rules: impl IntoIterator<Item = Rule>) -> Self {
        self.rules.extend(rules);
        self
    }

    pub fn job(mut self, to: &'static str, quota: Quota) -> Self {
        self.jobs.push(Job { to, quota, after: Vec::new(), in_place: false });
        self
    }

    /// The job added last begins when the jobs for `states` are complete.
    pub fn after(mut self, states: &[&'static str]) -> Self {
        if let Some(job) = self.jobs.last_mut() {
            job.after.extend(states);
        }
        self
    }

    /// The job added last leaves its object where it is and only turns it.
    pub fn in_place(mut self) -> Self {
        if let Some(job) = self.jobs.last_mut() {
            job.in_place = true;
        }
        self
    }

    /// The demonstrator always completes the job for `first` before the job for `then`.
    pub fn habit(mut self, first: &'static str, then: &'static str) -> Self {
        self.habits.push((first, then));
        self
    }

    pub fn trigger(mut self, trigger: Trigger) -> Self {
        self.triggers.push(trigger);
        self
    }

    pub fn goal(mut self, state: &'static str, at_least: usize) -> Self {
        self.goal.push(TrueGoal { state, each: None, at_least });
        self
    }

    pub fn goal_each(mut self, state: &'static str, each: &'static str) -> Self {
        self.goal.push(TrueGoal { state, each: Some(each), at_least: 1 });
        self
    }

    /// What the world demands of a move into a state.
    pub fn needs_of(&self, state: &str) -> impl Iterator<Item = Need> {
        let rules = self.rules.iter().filter(move |rule| rule.state.name == state);
        rules.flat_map(|rule| rule.needs.iter().chain(&rule.reach).copied())
    }
}
