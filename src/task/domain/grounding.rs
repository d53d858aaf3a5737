//! Grounding: which learned state an object is in, if any.
//!
//! The default rule asks, for each state of the object's kind, how many standard deviations its
//! position is away, over the coordinates that the state constrains, and answers *none* if that is more than
//! [`GaussianGate::limit`] for every state.
//!
//! * A spread has a floor: for `d` distinct poses with sample variance `v` the variance used is
//!   `max(floor^2, (prior^2 + (d - 1) v) / d)`. So a state seen once has the prior's spread, and parts
//!   that were recorded at the same height to some nanometres do not make a state that nothing else is in.
//! * A coordinate that spreads by [`GaussianGate::broad_m`] or more rejects nothing: a part lying anywhere on the
//!   table is on the table. Of a state in which parts were found, nobody having put them there,
//!   [`GaussianGate::broad_found_m`] is enough: in one of twenty sets of five demonstrations the five places of the
//!   bolt had by chance one coordinate alike to 8 mm, and bolts elsewhere on the table were in no state.
//! * A state in which parts were found, and of which fewer than [`MIN_DISTINCT`] distinct poses are known, may be broad
//!   in coordinates that nobody has seen vary. There the deviations are combined as the paper combines
//!   coordinates, by a p-norm with p = -2: near in one constrained coordinate is near, to within the floor.
//! * If several states are within the limit, the one of greatest density is taken.
//!
//! A state without geometry, of a domain written in code, never grounds anything.
//!
//! Orientations are part of a state's Gaussian and of target poses, but not of this rule: parts are symmetric
//! (a bolt in its hole may stand at any angle), and a few demonstrations do not show it.

use super::distance::{PAPER_EXPONENT, check_exponent, p_distance};
use super::pose::Pose;
use super::recording::Snapshot;
use crate::task::domain::{Domain, LearnedState, Origin, State, StateId, WorldState};
use crate::task::error::TaskError;

/// With this many distinct poses, a coordinate in which they agree is taken to be constrained.
pub const MIN_DISTINCT: usize = 4;

/// The default rule's numbers: how far from a learned Gaussian an object may be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GaussianGate {
    /// Least standard deviation of a coordinate, in metres.
    pub floor_m: f64,
    /// Standard deviation of a state seen once, in metres.
    pub prior_m: f64,
    /// Standard deviation from which on a coordinate rejects nothing, in metres.
    pub broad_m: f64,
    /// The same for states in which parts were found, in metres.
    pub broad_found_m: f64,
    /// Greatest distance in standard deviations.
    pub limit: f64,
}

impl Default for GaussianGate {
    fn default() -> Self {
        Self { floor_m: 1e-3, prior_m: 3e-3, broad_m: 1e-2, broad_found_m: 4e-3, limit: 5.0 }
    }
}

/// How an object's state is found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Grounding {
    /// The state of greatest density among those within the limit; none if none is.
    Gated(GaussianGate),
    /// The paper's rule (section II.F): the state whose mean position is nearest by p-norm, however far.
    Nearest {
        /// The exponent.
        p: f64,
    },
}

impl Default for Grounding {
    fn default() -> Self {
        Self::Gated(GaussianGate::default())
    }
}

impl Grounding {
    /// The paper's rule with its exponent.
    pub fn paper() -> Self {
        Self::Nearest { p: PAPER_EXPONENT }
    }

    /// Checks the rule's numbers.
    ///
    /// # Errors
    /// [`TaskError::Setting`] for a spread or limit that is not a finite number above 0, or an
    /// exponent that cannot be used.
    pub fn check(&self) -> Result<(), TaskError> {
        match self {
            Self::Nearest { p } => check_exponent(*p),
            Self::Gated(gate) => {
                for (name, value) in [
                    ("floor_m", gate.floor_m),
                    ("prior_m", gate.prior_m),
                    ("broad_m", gate.broad_m),
                    ("broad_found_m", gate.broad_found_m),
                    ("limit", gate.limit),
                ] {
                    if !(value.is_finite() && value > 0.0) {
                        let expected = "a finite number above 0";
                        let value = value.to_string();
                        return Err(TaskError::Setting { name, value, expected });
                    }
                }
                Ok(())
            }
        }
    }
}

/// The state of one object.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Grounded {
    /// The object's state, if it is in one.
    pub state: Option<StateId>,
    /// The distance to that state, or to the nearest if it is in none: standard deviations for
    /// the default rule, metres for the paper's. `None` if the kind has no states.
    pub distance: Option<f64>,
}

/// A domain made ready to say in which states objects are.
///
/// ```
/// use symbolt::sim::Seed;
/// use symbolt::task::{Classifier, Grounding, learn};
/// use symbolt::task::tasks::nuts_and_bolts::SyntheticDemonstrations;
///
/// let synthetic = SyntheticDemonstrations::default();
/// let domain = learn::learn(&synthetic.record(Seed::new(1))?.recording, &Default::default())?.domain;
/// let classifier = Classifier::new(&domain, Grounding::default())?;
/// let world = classifier.world_state(&synthetic.scene(Seed::new(2))?);
/// let names: Vec<&str> = world.iter().map(|s| &domain[s].name[..]).collect();
/// assert_eq!(names, ["BOLT_AT_START", "NUT_AT_START"]);
/// # Ok::<(), symbolt::task::TaskError>(())
/// ```
#[derive(Debug, Clone)]
pub struct Classifier {
    rule: Grounding,
    /// One a state of the domain, `None` for a state without geometry.
    states: Vec<Option<Model>>,
}

#[derive(Debug, Clone)]
struct Model {
    kind: String,
    mean: Pose,
    axes: [Axis; 3],
    /// Whether agreement in one constrained coordinate is enough.
    any: bool,
}

#[derive(Debug, Clone, Copy)]
struct Axis {
    sd: f64,
    free: bool,
}

impl Classifier {
    /// Prepares the states of `domain`.
    ///
    /// # Errors
    /// As [`Grounding::check`].
    pub fn new(domain: &Domain, rule: Grounding) -> Result<Self, TaskError> {
        rule.check()?;
        let gate = if let Grounding::Gated(gate) = rule { gate } else { GaussianGate::default() };
        let states = domain.states().iter();
        let states = states.map(|s| Some(Model::new(s, s.learned.as_ref()?, &gate))).collect();
        Ok(Self { rule, states })
    }

    /// The state of an object of `kind` at `pose`.
    pub fn classify(&self, kind: &str, pose: &Pose) -> Grounded {
        let own = || {
            let models = self.states.iter().enumerate();
            let models = models.filter_map(|(i, model)| Some((StateId::new(i), model.as_ref()?)));
            models.filter(|(_, model)| model.kind == kind)
        };
        let nearest = |distances: &mut dyn Iterator<Item = (StateId, f64)>| {
            distances.min_by(|a, b| a.1.total_cmp(&b.1))
        };
        match self.rule {
            Grounding::Nearest { p } => {
                let mut all =
                    own().map(|(i, s)| (i, p_distance(&s.mean.position, &pose.position, p)));
                let best = nearest(&mut all);
                Grounded { state: best.map(|(i, _)| i), distance: best.map(|(_, d)| d) }
            }
            Grounding::Gated(gate) => {
                let within = own()
                    .filter(|(_, s)| s.distance(pose) <= gate.limit)
                    .map(|(i, s)| (i, s.distance(pose), s.log_density(pose, gate.limit)))
                    .max_by(|a, b| a.2.total_cmp(&b.2).then(b.0.cmp(&a.0)));
                match within {
                    Some((state, distance, _)) => {
                        Grounded { state: Some(state), distance: Some(distance) }
                    }
                    None => {
                        let mut all = own().map(|(i, s)| (i, s.distance(pose)));
                        Grounded { state: None, distance: nearest(&mut all).map(|(_, d)| d) }
                    }
                }
            }
        }
    }

    /// The states of all objects of a scene, in their order.
    pub fn classify_all(&self, scene: &Snapshot) -> Vec<Grounded> {
        scene.objects.iter().map(|o| self.classify(&o.kind, &o.pose)).collect()
    }

    /// The states that hold in a scene: those in which some object is.
    pub fn world_state(&self, scene: &Snapshot) -> WorldState {
        self.world_of(&self.classify_all(scene))
    }

    /// The states that hold when objects are in these.
    pub fn world_of(&self, grounded: &[Grounded]) -> WorldState {
        let mut world = WorldState::empty(self.states.len());
        grounded.iter().filter_map(|g| g.state).for_each(|state| world.insert(state));
        world
    }
}

impl Model {
    fn new(state: &State, learned: &LearnedState, gate: &GaussianGate) -> Self {
        let distinct = learned.distinct.max(1) as f64;
        let found = learned.origin == Origin::Found;
        let any = found && learned.distinct < MIN_DISTINCT;
        let broad = if found { gate.broad_found_m } else { gate.broad_m };
        let axes = learned.spread().map(|sd| {
            let variance = (gate.prior_m.powi(2) + (distinct - 1.0) * sd * sd) / distinct;
            // Where agreement in one coordinate is enough, it has to be close.
            let least = if any { 0.0 } else { variance.sqrt() };
            Axis { sd: least.max(gate.floor_m), free: learned.distinct >= 2 && sd >= broad }
        });
        Self { kind: state.kind.clone(), mean: learned.mean, axes, any }
    }

    fn deviation(&self, pose: &Pose, axis: usize) -> f64 {
        (pose.position[axis] - self.mean.position[axis]).abs() / self.axes[axis].sd
    }

    /// Standard deviations from the state over its constrained coordinates; 0 if it has none.
    fn distance(&self, pose: &Pose) -> f64 {
        let constrained: Vec<f64> = (0..3)
            .filter(|axis| !self.axes[*axis].free)
            .map(|axis| self.deviation(pose, axis))
            .collect();
        if self.any && !constrained.is_empty() {
            let zeros = vec![0.0; constrained.len()];
            return p_distance(&constrained, &zeros, PAPER_EXPONENT);
        }
        constrained.iter().map(|z| z * z).sum::<f64>().sqrt()
    }

    /// Log density up to a constant. A coordinate that does not reject although it is far off counts
    /// as broad as it is far.
    fn log_density(&self, pose: &Pose, limit: f64) -> f64 {
        (0..3)
            .map(|axis| {
                let (z, sd) = (self.deviation(pose, axis), self.axes[axis].sd);
                if self.axes[axis].free || z > limit {
                    -(sd * z.max(1.0)).ln() - 0.5
                } else {
                    -sd.ln() - 0.5 * z * z
                }
            })
            .sum()
    }
}
