//! A world that follows the rules of a grounded problem.

use std::collections::BTreeSet;

use rand::RngExt;

use crate::plan::strips::{GroundOperator, Grounded};
use crate::sim::{Real, Seed, SimDuration, World, WorldError, WorldSave};

/// Command at which an action counts.
const COMMAND: Real = 0.4;
/// Milliseconds for which a command must stay the same.
const STEADY: u64 = 5;

/// An action that was begun.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Begun {
    /// Time in milliseconds.
    pub ms: u64,
    /// Position of the operator.
    pub operator: usize,
    /// Whether its preconditions held. Otherwise it did nothing.
    pub met: bool,
    /// Whether it had its effects.
    pub done: bool,
}

/// A world whose state is a set of fluents. It senses each of them and takes one command for each operator.
///
/// The motor rule is that of Blouw, Eliasmith and Tripp, "A scaleable spiking neural model of action planning" (2016): the
/// greatest command of at least 0.4 that stays the same for 5 ms is begun, and the motor is then locked for some time. An
/// action whose preconditions do not hold does nothing.
///
/// ```
/// use symbolt::sim::{SimDuration, World};
/// use symbolt::plan::goal_sets::StripsWorld;
/// use symbolt::plan::strips::{Bodies, Domain, Grounded, Problem};
///
/// let domain = b"(define (domain door) (:predicates (open))
///     (:action push :parameters () :precondition (not (open)) :effect (open)))";
/// let problem = b"(define (problem leave) (:domain door) (:init) (:goal (open)))";
/// let domain = Domain::parse(domain, "door.pddl", Bodies::Read)?;
/// let problem = Problem::parse(problem, "leave.pddl", &domain)?;
/// let grounded = Grounded::new(&domain, &problem)?;
/// let mut world = StripsWorld::new(&grounded, SimDuration::from_millis(100));
/// for _ in 0..5 {
///     world.advance(&[1.0])?;
/// }
/// assert!(world.reached());
/// assert_eq!(world.begun()[0].ms, 5);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
pub struct StripsWorld {
    fluents: usize,
    operators: Vec<GroundOperator>,
    start: BTreeSet<usize>,
    goal: Vec<usize>,
    lock: u64,
    failures: f64,
    intrusion: Option<(u64, usize)>,
    seed: Seed,
    state: BTreeSet<usize>,
    begun: Vec<Begun>,
    time: u64,
    last: Option<usize>,
    since: u64,
    free: u64,
}

impl StripsWorld {
    /// Makes a world in the initial state of a problem. After an action has begun, the motor is locked for `lock`, rounded
    /// down to milliseconds.
    pub fn new(problem: &Grounded, lock: SimDuration) -> Self {
        let start: BTreeSet<usize> = problem.start.iter().copied().collect();
        Self {
            fluents: problem.fluents.len(),
            operators: problem.operators.clone(),
            state: start.clone(),
            start,
            goal: problem.goal.clone(),
            lock: lock.as_micros() / 1000,
            failures: 0.0,
            intrusion: None,
            seed: Seed::new(0),
            begun: Vec::new(),
            time: 0,
            last: None,
            since: 0,
            free: 0,
        }
    }

    /// Lets each action fail with a probability from 0 to 1: it begins and has no effect.
    #[must_use]
    pub fn failures(mut self, probability: f64) -> Self {
        self.failures = probability;
        self
    }

    /// Lets another hand carry out an operator at a time in milliseconds. Nothing happens then if its preconditions do not
    /// hold. A position outside the problem is ignored.
    #[must_use]
    pub fn intrusion(mut self, ms: u64, operator: usize) -> Self {
        self.intrusion = Some((ms, operator));
        self
    }

    /// Returns the positions of the fluents that hold.
    pub fn state(&self) -> &BTreeSet<usize> {
        &self.state
    }

    /// Returns the actions that were begun.
    pub fn begun(&self) -> &[Begun] {
        &self.begun
    }

    /// Returns whether the goal of the problem holds.
    pub fn reached(&self) -> bool {
        Grounded::all_hold(&self.state, &self.goal)
    }

    /// Carries out an operator if its preconditions hold. Returns whether they do.
    fn apply(&mut self, operator: usize, works: bool) -> bool {
        let operator = &self.operators[operator];
        let met = Grounded::all_hold(&self.state, &operator.preconditions);
        if met && works {
            operator.apply(&mut self.state);
        }
        met
    }
}

impl World for StripsWorld {
    fn period(&self) -> SimDuration {
        SimDuration::from_millis(1)
    }

    fn sense_width(&self) -> usize {
        self.fluents
    }

    fn command_width(&self) -> usize {
        self.operators.len()
    }

    fn sense(&self, out: &mut [Real]) {
        out.fill(0.0);
        self.state.iter().for_each(|f| out[*f] = 1.0);
    }

    fn advance(&mut self, command: &[Real]) -> Result<(), WorldError> {
        self.time += 1;
        if let Some((at, operator)) = self.intrusion
            && at == self.time
            && operator < self.operators.len()
        {
            self.apply(operator, true);
        }
        let best = (0..command.len()).max_by(|a, b| command[*a].total_cmp(&command[*b]));
        let best = best.filter(|a| command[*a] >= COMMAND);
        self.since = if best == self.last { self.since + 1 } else { 1 };
        self.last = best;
        if let Some(operator) = best
            && self.since >= STEADY
            && self.time >= self.free
        {
            let draw: f64 = self.seed.derive_index("failure", self.time).rng().random();
            let works = draw >= self.failures;
            let met = self.apply(operator, works);
            self.begun.push(Begun { ms: self.time, operator, met, done: met && works });
            self.free = self.time + self.lock;
            self.since = 0;
        }
        Ok(())
    }

    fn reset(&mut self, seed: Seed) -> Result<(), WorldError> {
        self.seed = seed;
        self.state.clone_from(&self.start);
        (self.begun, self.time, self.last) = (Vec::new(), 0, None);
        (self.since, self.free) = (0, 0);
        Ok(())
    }

    fn save(&self) -> Result<WorldSave, WorldError> {
        let moment = (&self.state, self.time, self.last, self.since, self.free);
        let begun: Vec<_> = self.begun.iter().map(|b| (b.ms, b.operator, b.met, b.done)).collect();
        serde_json::to_vec(&(moment, begun))
            .map(WorldSave)
            .map_err(|e| WorldError::new(e.to_string()))
    }

    fn restore(&mut self, saved: &WorldSave) -> Result<(), WorldError> {
        type Moment = (BTreeSet<usize>, u64, Option<usize>, u64, u64);
        type Actions = Vec<(u64, usize, bool, bool)>;
        let (moment, begun): (Moment, Actions) = serde_json::from_slice(&saved.0)
            .map_err(|e| WorldError::new(format!("the save does not come from this world: {e}")))?;
        let operators = begun.iter().map(|(_, operator, ..)| operator).chain(&moment.2);
        if moment.0.iter().any(|f| *f >= self.fluents)
            || operators.into_iter().any(|o| *o >= self.operators.len())
        {
            return Err(WorldError::new("the save comes from the world of another problem"));
        }
        (self.state, self.time, self.last, self.since, self.free) = moment;
        let begun = begun.into_iter();
        self.begun =
            begun.map(|(ms, operator, met, done)| Begun { ms, operator, met, done }).collect();
        Ok(())
    }
}
