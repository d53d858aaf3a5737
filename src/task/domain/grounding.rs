//! Grounding: classifies an object by its pose, that is, finds the learned state that it is in.
//!
//! [`GaussianGate`] describes the default rule.

use nalgebra::Vector3;

use super::distance::{PAPER_EXPONENT, check_exponent, p_distance};
use super::recording::Snapshot;
use super::tolerance::{Directions, Offset, PLAY, Pool, between, predictive, tilt, up_axis};
use crate::robot::Pose;
use crate::task::domain::{Domain, LearnedState, Origin, State, StateId, WorldState};
use crate::task::error::TaskError;

/// Smallest number of distinct poses at which agreement in a coordinate counts as a constraint of the state.
pub const MIN_DISTINCT: usize = 4;

/// Parameters of the default rule for classifying objects, [`Grounding::Gated`].
///
/// The rule measures the distance of the object's position from each state of its kind, in standard deviations over the
/// coordinates that the state constrains. A state is accepted if the distance is at most [`Self::limit`]. If several
/// states are accepted, the rule chooses the one with the highest probability density. If no state is accepted, the
/// object is in no state.
///
/// Demonstrations are few, so the standard deviations need care:
///
/// * **Placed states.** An object that was placed rests on something that fixes its height and the direction of its z
///   axis. Both are compared, and loosely the position sideways. For a state with `d` distinct poses and sample variance
///   `v`, the variance used is `play^2 + noise^2 + (1 + 1/d) (q^2 + (d - 1) v) / d`, with the plays [`Self::height_m`],
///   [`Self::play_m`] and [`Self::tilt_rad`] and the noises [`Self::noise_m`] and [`Self::noise_rad`]. The prior `q` is the
///   weighted median over all placed states. With exact poses that agree within micrometres, the limit of 5 accepts 1 mm
///   in height, 3 mm sideways and a tilt of 3 degrees; after one demonstration 1.7 mm, 8 mm and 7 degrees. The vertical
///   is the coordinate in which found objects agree while the others vary; if no state shows it, the direction of the z
///   axis in the mean pose.
/// * **Found states.** For a state with `d` distinct poses and sample variance `v`, the variance used is
///   `max(floor^2, (prior^2 + (d - 1) v) / d) + noise^2`, with [`Self::floor_m`] and [`Self::prior_m`]. A state seen once
///   therefore has the prior's spread. Orientation is not compared: a few demonstrations do not show all sides on which
///   an object can lie.
/// * **Broad coordinates.** A coordinate with a standard deviation of at least [`Self::broad_m`] is unconstrained and
///   rejects nothing, so a part may lie anywhere on the table. For a state in which objects were found, not placed
///   ([`Origin::Found`]), the smaller [`Self::broad_found_m`] applies instead, because a few starting positions can
///   agree by chance. In 1 of 20 sets of five demonstrations, the bolt's five positions agreed within 8 mm in one
///   coordinate. With [`Self::broad_m`], bolts elsewhere on the table were then in no state.
/// * **Few poses.** A found state with fewer than [`MIN_DISTINCT`] distinct poses may be broad in a coordinate that no
///   demonstration has varied. Its deviations are measured in units of the floor and combined by a p-norm with
///   p = -2, as the paper combines coordinates. Such a state accepts an object that agrees with it in one constrained
///   coordinate.
///
/// A state without geometry, as in a domain written in code, accepts no object.
///
/// The rotation about the z axis is ignored. Parts can be symmetric (a bolt may stand at any angle in its hole), and a
/// few demonstrations do not show this. A part that is upside down does not count as tilted. If the directions of the z
/// axis differ widely between the demonstrations, the tilt is ignored, too.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GaussianGate {
    /// Smallest standard deviation of a coordinate of a found state, in metres.
    pub floor_m: f64,
    /// Standard deviation of a found state seen once, in metres.
    pub prior_m: f64,
    /// Play of a placed object sideways, as a standard deviation in metres.
    pub play_m: f64,
    /// Play of a placed object in height, as a standard deviation in metres.
    pub height_m: f64,
    /// Play of a placed object's tilt about each horizontal axis, as a standard deviation in radians.
    pub tilt_rad: f64,
    /// Noise of the poses in addition to that of the recording: standard deviation of each coordinate in metres, at
    /// least 0.
    pub noise_m: f64,
    /// The same about each axis, in radians.
    pub noise_rad: f64,
    /// Smallest standard deviation at which a coordinate is unconstrained, in metres.
    pub broad_m: f64,
    /// As `broad_m`, for states in which objects were found, not placed, in metres.
    pub broad_found_m: f64,
    /// Largest accepted distance, in standard deviations.
    pub limit: f64,
}

impl Default for GaussianGate {
    fn default() -> Self {
        Self {
            floor_m: 1e-3,
            prior_m: 3e-3,
            play_m: PLAY.aside_m,
            height_m: PLAY.height_m,
            tilt_rad: PLAY.tilt_rad,
            noise_m: 0.0,
            noise_rad: 0.0,
            broad_m: 1e-2,
            broad_found_m: 4e-3,
            limit: 5.0,
        }
    }
}

/// The rule that finds an object's state.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Grounding {
    /// Chooses, among the states within [`GaussianGate::limit`], the state with the highest probability density. If no
    /// state is within the limit, the object is in no state. [`GaussianGate`] describes the rule.
    Gated(GaussianGate),
    /// Chooses the state whose mean position is nearest by p-norm, at any distance: the paper's rule (section II.F).
    Nearest {
        /// Exponent of the p-norm.
        p: f64,
    },
}

impl Default for Grounding {
    fn default() -> Self {
        Self::Gated(GaussianGate::default())
    }
}

impl Grounding {
    /// Returns the paper's rule, with its exponent of -2.
    pub fn paper() -> Self {
        Self::Nearest { p: PAPER_EXPONENT }
    }

    /// Returns the rule for scenes whose poses have this much more noise than the recording had: standard deviations of
    /// each coordinate in metres and about each axis in radians.
    pub fn with_noise(self, noise_m: f64, noise_rad: f64) -> Self {
        match self {
            Self::Gated(gate) => Self::Gated(GaussianGate {
                noise_m: gate.noise_m.hypot(noise_m),
                noise_rad: gate.noise_rad.hypot(noise_rad),
                ..gate
            }),
            Self::Nearest { .. } => self,
        }
    }

    /// Checks the rule's parameters.
    ///
    /// # Errors
    /// [`TaskError::Setting`] if a parameter of [`GaussianGate`] is not a finite number above 0, if a noise is negative
    /// or not finite, or if the exponent is 0 or not finite.
    pub fn check(&self) -> Result<(), TaskError> {
        match self {
            Self::Nearest { p } => check_exponent(*p),
            Self::Gated(gate) => {
                for (name, value) in [
                    ("floor_m", gate.floor_m),
                    ("prior_m", gate.prior_m),
                    ("play_m", gate.play_m),
                    ("height_m", gate.height_m),
                    ("tilt_rad", gate.tilt_rad),
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
                for (name, value) in [("noise_m", gate.noise_m), ("noise_rad", gate.noise_rad)] {
                    if !(value.is_finite() && value >= 0.0) {
                        let expected = "a finite number of at least 0";
                        let value = value.to_string();
                        return Err(TaskError::Setting { name, value, expected });
                    }
                }
                Ok(())
            }
        }
    }
}

/// The result of classifying one object.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Grounded {
    /// The object's state; `None` if it is in no state.
    pub state: Option<StateId>,
    /// Distance to that state, or to the nearest state if the object is in no state: in standard deviations for
    /// [`Grounding::Gated`], in metres for [`Grounding::Nearest`]. `None` if the kind has no states with geometry.
    pub distance: Option<f64>,
}

/// Finds the state of each object in a scene, using the geometry of a learned domain.
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
    /// One model for each state of the domain; `None` for a state without geometry.
    states: Vec<Option<Model>>,
}

#[derive(Debug, Clone)]
struct Model {
    kind: String,
    mean: Pose,
    axes: [Axis; 3],
    /// The vertical, for a placed state.
    up: Option<Vector3<f64>>,
    /// Standard deviation of the tilt about each horizontal axis, in radians; `None` if the tilt is not compared.
    tilt_sd: Option<f64>,
    /// Whether agreement in a single constrained coordinate is enough.
    any: bool,
}

#[derive(Debug, Clone, Copy)]
struct Axis {
    sd: f64,
    free: bool,
}

impl Classifier {
    /// Builds a classifier for the states of `domain`.
    ///
    /// # Errors
    /// As [`Grounding::check`].
    pub fn new(domain: &Domain, rule: Grounding) -> Result<Self, TaskError> {
        rule.check()?;
        let gate = if let Grounding::Gated(gate) = rule { gate } else { GaussianGate::default() };
        let known = Known::of(domain, &gate);
        let states = domain.states().iter();
        let states = states.map(|s| Some(Model::new(s, s.learned.as_ref()?, &gate, &known)));
        Ok(Self { rule, states: states.collect() })
    }

    /// Classifies an object of `kind` at `pose`.
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

    /// Returns the state that is nearest to an object of `kind` at `pose`, and by how much the object misses it; `None` if
    /// the kind has no states with geometry.
    pub fn nearest(&self, kind: &str, pose: &Pose) -> Option<(StateId, Offset)> {
        let models = self.states.iter().enumerate();
        let models = models.filter_map(|(i, model)| Some((StateId::new(i), model.as_ref()?)));
        let own = models.filter(|(_, model)| model.kind == kind);
        own.map(|(state, model)| (state, model.offset(pose)))
            .min_by(|a, b| a.1.distance().total_cmp(&b.1.distance()))
    }

    /// Classifies all objects of a scene, in order.
    pub fn classify_all(&self, scene: &Snapshot) -> Vec<Grounded> {
        scene.objects.iter().map(|o| self.classify(&o.kind, &o.pose)).collect()
    }

    /// Returns the states that hold in a scene. A state holds if at least one object is in it.
    pub fn world_state(&self, scene: &Snapshot) -> WorldState {
        self.world_of(&self.classify_all(scene))
    }

    /// Returns the states that hold, given the results for all objects of a scene.
    pub fn world_of(&self, grounded: &[Grounded]) -> WorldState {
        let mut world = WorldState::empty(self.states.len());
        grounded.iter().filter_map(|g| g.state).for_each(|state| world.insert(state));
        world
    }
}

/// What the states of a domain show together.
struct Known {
    /// The vertical coordinate, if some state shows it.
    up: Option<usize>,
    priors: Directions,
}

impl Known {
    fn of(domain: &Domain, gate: &GaussianGate) -> Self {
        let all = || domain.states().iter().filter_map(|s| s.learned.as_ref());
        let found = all().filter(|s| s.origin == Origin::Found && s.distinct >= 2);
        let up = up_axis(found.map(|s| s.spread().map(|sd| sd < gate.broad_found_m)));
        let mut pool = Pool::default();
        for state in all().filter(|s| s.origin == Origin::Placed) {
            let (dof, vertical) = (state.distinct.saturating_sub(1), vertical(up, state));
            for (i, sd) in state.spread().into_iter().enumerate() {
                if sd < gate.broad_m {
                    pool.position(vertical[i], sd, dof);
                }
            }
            if let Some(sd) = state.tilt_sd() {
                pool.tilt(sd, dof);
            }
        }
        Self { up, priors: pool.priors() }
    }
}

/// Returns the vertical: coordinate `up`, or the z axis of a state's objects.
fn vertical(up: Option<usize>, state: &LearnedState) -> Vector3<f64> {
    up.map_or_else(|| state.upright(), |up| Vector3::ith(up, 1.0))
}

impl Model {
    fn new(state: &State, learned: &LearnedState, gate: &GaussianGate, known: &Known) -> Self {
        let distinct = learned.distinct.max(1);
        let found = learned.origin == Origin::Found;
        let any = found && learned.distinct < MIN_DISTINCT;
        let broad = if found { gate.broad_found_m } else { gate.broad_m };
        let up = vertical(known.up, learned);
        let noise = gate.noise_m * gate.noise_m;
        let play = Directions { height_m: gate.height_m, aside_m: gate.play_m, tilt_rad: 0.0 };
        let mut axis = 0;
        let axes = learned.spread().map(|sd| {
            let n = distinct as f64;
            let variance = if !found {
                let prior = between(&known.priors, up[axis]).sqrt();
                between(&play, up[axis]) + predictive(prior, sd, distinct)
            } else if any {
                // If agreement in one coordinate is enough, it must be close: use the floor alone.
                gate.floor_m.powi(2)
            } else {
                ((gate.prior_m.powi(2) + (n - 1.0) * sd * sd) / n).max(gate.floor_m.powi(2))
            };
            axis += 1;
            Axis { sd: (variance + noise).sqrt(), free: learned.distinct >= 2 && sd >= broad }
        });
        let tilt_sd = learned.tilt_sd().filter(|_| !found).map(|sd| {
            let own = predictive(known.priors.tilt_rad, sd, distinct);
            (gate.tilt_rad.powi(2) + own + gate.noise_rad.powi(2)).sqrt()
        });
        let up = (!found).then_some(up);
        Self { kind: state.kind.clone(), mean: learned.mean, axes, up, tilt_sd, any }
    }

    /// Angle between the z axis of an object and that of the mean pose, in radians; 0 if it is not compared.
    fn tilt(&self, pose: &Pose) -> f64 {
        let z = self.mean.rotation() * Vector3::z();
        self.tilt_sd.map_or(0.0, |_| tilt(&z, &self.mean, pose))
    }

    fn offset(&self, pose: &Pose) -> Offset {
        let off = |i: usize| match self.axes[i].free {
            true => 0.0,
            false => pose.position[i] - self.mean.position[i],
        };
        let deviation = Vector3::new(off(0), off(1), off(2));
        Offset::of(&deviation, self.up.as_ref(), self.tilt(pose))
    }

    fn deviation(&self, pose: &Pose, axis: usize) -> f64 {
        (pose.position[axis] - self.mean.position[axis]).abs() / self.axes[axis].sd
    }

    /// Distance to the state in standard deviations, over its constrained coordinates and the tilt; 0 if nothing is
    /// constrained.
    fn distance(&self, pose: &Pose) -> f64 {
        let constrained: Vec<f64> = (0..3)
            .filter(|axis| !self.axes[*axis].free)
            .map(|axis| self.deviation(pose, axis))
            .collect();
        if self.any && !constrained.is_empty() {
            let zeros = vec![0.0; constrained.len()];
            return p_distance(&constrained, &zeros, PAPER_EXPONENT);
        }
        let tilt = self.tilt_sd.map_or(0.0, |sd| self.tilt(pose) / sd);
        constrained.iter().chain([&tilt]).map(|z| z * z).sum::<f64>().sqrt()
    }

    /// Log density, up to a constant. If a coordinate deviates strongly but does not reject the pose, its spread is
    /// taken to be as large as the deviation.
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
