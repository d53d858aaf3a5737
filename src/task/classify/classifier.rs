//! Finds the state, the place and the reference of each object in a scene.

use std::collections::BTreeMap;

use nalgebra::Vector3;

use super::layout::{Layout, Located, Miss};
use super::places::{agreements, gaps, heights, priors, rests, tumbled, upright, widest};
use super::tolerance::{Directions, Offset, PLAY, between, predictive, tilt, up_axis, widening};
use crate::robot::Pose;
use crate::task::domain::distance::{PAPER_EXPONENT, check_exponent, p_distance};
use crate::task::domain::{
    Coordinate, Fact, Frame, FrameState, Origin, Place, RelationalDomain, Turn, relative,
};
use crate::task::error::TaskError;
use crate::task::recording::{ObjectPose, Snapshot};

/// The rule that finds an object's state.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ClassifierRule {
    /// Takes the state of the greatest density among those within `limit` standard deviations. If there is none, the object
    /// is in no state. [`Classifier`] describes the rule.
    Gated {
        /// Greatest accepted distance, in standard deviations.
        limit: f64,
    },
    /// Takes the state whose mean position is nearest by p-norm, at any distance: the paper's rule (section II.F).
    Nearest {
        /// Exponent of the p-norm.
        p: f64,
    },
}

impl Default for ClassifierRule {
    fn default() -> Self {
        Self::Gated { limit: Classifier::LIMIT }
    }
}

impl ClassifierRule {
    /// Returns the paper's rule, with its exponent of -2.
    pub fn paper() -> Self {
        Self::Nearest { p: PAPER_EXPONENT }
    }

    fn check(self) -> Result<(), TaskError> {
        match self {
            Self::Nearest { p } => check_exponent(p),
            Self::Gated { limit } if limit.is_finite() && limit > 0.0 => Ok(()),
            Self::Gated { limit } => {
                let (value, expected) = (limit.to_string(), "a finite number above 0");
                Err(TaskError::Setting { name: "limit", value, expected })
            }
        }
    }
}

/// Finds the state, the place and the reference of each object in a scene, with the states of a learned domain.
///
/// ```
/// use symbolt::sim::Seed;
/// use symbolt::task::learn::learn;
/// use symbolt::task::classify::Classifier;
/// use symbolt::task::tasks::nuts_and_bolts::SyntheticDemonstrations;
///
/// let synthetic = SyntheticDemonstrations::default();
/// let domain = learn(&synthetic.record(Seed::new(1))?.recording, &Default::default())?.domain;
/// let layout = Classifier::new(&domain).classify(&synthetic.scene(Seed::new(2))?);
/// let states = layout.located.iter().filter_map(|located| located.fact);
/// let names: Vec<&str> = states.map(|fact| &domain.states[fact.state].name[..]).collect();
/// assert_eq!(names, ["NUT_AT_START", "BOLT_AT_START"]);
/// # Ok::<(), symbolt::task::TaskError>(())
/// ```
///
/// An object is in a state if its pose, in the frame of some reference, deviates from one of the state's places by at
/// most [`Classifier::LIMIT`] standard deviations, or another limit ([`ClassifierRule`]), over the tight coordinates and the tilt. Among several such states, places and references, the one with the highest probability density is
/// taken.
///
/// # Standard deviations
///
/// A *placed* object with a constrained orientation rests on what it was put onto. It must agree in height and tilt, and
/// loosely sideways. Its variances are the play, the noise, and the predictive variance of the place, with a prior that
/// is pooled over the domain:
///
/// ```text
/// play^2 + noise^2 + (1 + 1/n) (prior^2 + (n - 1) s^2) / n
/// ```
///
/// In the frame of an object, the noise of its orientation adds its share, which grows with the distance. Here `n` is the
/// number of distinct poses and `s` their standard deviation. The last term is widened for two to thirteen poses, whose spread is uncertain: of the poses that belong to a place, 1 in 5,000 is left out in each direction. At the limit of 5, with exact poses and
/// demonstrations that agree within micrometres, this accepts 1 mm in height, 3 mm sideways and a tilt of 3 degrees.
/// After a single demonstration, it accepts 1.7 mm, 8 mm and 7 degrees. The vertical is the coordinate in which objects that lie anywhere agree; if no state shows it, the axis
/// that [`FrameState::turn`] fixes.
///
/// *Found* objects, and objects that were put down in any orientation, can lie on another side, or on each other. Their
/// variance is `noise^2 + (w^2 + (n - 1) s^2) / n`, with `w` = 10 mm for found and 3 mm for placed objects. Where the learner told
/// two places of a kind apart that differ in one coordinate alone, `w` is at most a fifth of the difference.
///
/// The direction about the upright axis is compared only if the demonstrations needed it
/// ([`FrameState::turn_matters`]).
#[derive(Debug, Clone)]
pub struct Classifier {
    pub(super) states: Vec<FrameState>,
    noise_m: f64,
    pub(super) noise_rad: f64,
    /// Kinds of fixtures that stand level, with the side that is up.
    pub(super) level: BTreeMap<String, [f64; 3]>,
    rule: ClassifierRule,
    /// The vertical coordinate of the world frame, if some state shows it.
    pub(super) up: Option<usize>,
    /// The vertical coordinate of the world frame as somebody told it, for words alone.
    told_up: Option<usize>,
    /// Frames with the coordinate that looks vertical there, for words alone.
    heights: Vec<(Frame, usize)>,
    priors: Directions,
    /// For each state, place and coordinate, the difference from the nearest place that differs in this coordinate alone, in
    /// metres.
    gaps: Vec<Vec<[f64; 3]>>,
}

/// Standard deviation of a place seen once whose objects lie in any orientation, in metres, and of an orientation that
/// tells states apart, in radians.
const PRIOR: (f64, f64) = (3e-3, 0.06);
/// Standard deviation of a place in which objects were found, if it was seen once, in metres.
pub(super) const FOUND_M: f64 = 1e-2;
pub(super) const FLOOR: (f64, f64) = (1e-3, 0.02);
/// Share of an area beside an object by which a pose may lie beyond its end, and standard deviations for each further share.
const BEYOND: (f64, f64) = (0.25, 20.0);
/// Number of standard deviations of such places, each seen once, between two that the learner told apart.
pub(super) const GAP: f64 = 5.0;
/// Movement below which an object keeps its state, in metres and radians.
const STILL: (f64, f64) = (5e-4, 0.01);
/// Difference of log densities below which two references are equally near.
const EQUAL: f64 = 0.05;

struct Match {
    fact: Fact,
    distance: f64,
    density: f64,
    offset: Offset,
}

impl Classifier {
    /// Largest accepted distance, in standard deviations.
    pub const LIMIT: f64 = 5.0;

    /// Builds a classifier for the states of `domain`.
    pub fn new(domain: &RelationalDomain) -> Self {
        Self {
            states: domain.states.clone(),
            noise_m: domain.noise_m,
            noise_rad: domain.noise_rad,
            level: domain.level.clone(),
            rule: ClassifierRule::default(),
            up: up_axis(domain.states.iter().flat_map(agreements)),
            told_up: None,
            heights: heights(&domain.states),
            priors: priors(&domain.states),
            gaps: gaps(&domain.states),
        }
    }

    /// Returns a classifier with another rule.
    ///
    /// # Errors
    /// [`TaskError::Setting`] unless the limit is finite and above 0, or the exponent finite and not 0.
    pub fn with_rule(self, rule: ClassifierRule) -> Result<Self, TaskError> {
        rule.check().map(|()| Self { rule, ..self })
    }

    /// Returns a classifier for scenes whose poses have this much more noise than the recording had: standard deviations
    /// of each coordinate in metres and about each axis in radians.
    pub fn with_noise(mut self, noise_m: f64, noise_rad: f64) -> Self {
        self.noise_m = self.noise_m.hypot(noise_m);
        self.noise_rad = self.noise_rad.hypot(noise_rad);
        self
    }

    /// Returns a classifier that says how much too high or too low objects are along this coordinate of the world frame, where no state
    /// shows the vertical. It accepts the same poses.
    pub fn with_vertical(self, axis: usize) -> Self {
        Self { told_up: (axis < 3).then_some(axis), ..self }
    }

    /// Finds the state of every object in a scene.
    pub fn classify(&self, scene: &Snapshot) -> Layout {
        let locate = |scene: &Snapshot| -> Vec<Located> {
            (0..scene.objects.len()).map(|i| self.classify_object(scene, i)).collect()
        };
        let level = self.levelled(scene);
        let scene = level.as_ref().unwrap_or(scene);
        let located = locate(scene);
        match self.righted(scene, &located) {
            Some(scene) => Layout { located: locate(&scene), objects: scene.objects },
            None => Layout { objects: scene.objects.clone(), located },
        }
    }

    /// Finds the state of every object, as [`classify`](Self::classify) does. An object keeps the state that it had in
    /// `before` while neither it nor its reference has moved away from the pose in which its state was found. An object
    /// that creeps is therefore looked at anew as soon as it has crept too far in all.
    pub fn classify_after(&self, before: &Layout, scene: &Snapshot) -> Layout {
        let mut now = self.classify(scene);
        let still: Vec<Option<usize>> = now
            .objects
            .iter()
            .map(|o| {
                let was = before.objects.iter().position(|b| b.id == o.id && b.kind == o.kind)?;
                let taken = &before.located[was].taken;
                let moved = taken.distance(&o.pose);
                let turned = taken.rotation().angle_to(&o.pose.rotation());
                let quiet =
                    moved < STILL.0 + 6.0 * self.noise_m && turned < STILL.1 + 6.0 * self.noise_rad;
                quiet.then_some(was)
            })
            .collect();
        for i in 0..now.objects.len() {
            let Some(was) = still[i] else { continue };
            let taken = before.located[was].taken;
            let Some(fact) = before.located[was].fact else {
                // An object that is nobody's may be found in a state at any time, but its pose stays the one from which
                // the movement of a reference is measured.
                if now.located[i].fact.is_none() {
                    now.located[i].taken = taken;
                }
                continue;
            };
            let reference = fact.reference.map(|r| still.iter().position(|s| *s == Some(r)));
            if let Some(None) = reference {
                continue;
            }
            now.located[i] = Located {
                fact: Some(Fact { reference: reference.flatten(), ..fact }),
                ..before.located[was]
            };
        }
        now
    }

    /// Finds the state of one object of a scene.
    pub fn classify_object(&self, scene: &Snapshot, index: usize) -> Located {
        let object = &scene.objects[index];
        let mut matches: Vec<Match> = Vec::new();
        for (s, state) in self.states.iter().enumerate().filter(|(_, s)| *s.kind == *object.kind) {
            let references: Vec<Option<usize>> = match &state.frame {
                Frame::World => vec![None],
                Frame::Kind(kind) => (0..scene.objects.len())
                    .filter(|r| *r != index && *scene.objects[*r].kind == **kind)
                    .map(Some)
                    .collect(),
            };
            for reference in references {
                let frame = reference.map(|r| &scene.objects[r].pose);
                let pose = frame.map_or(object.pose, |frame| relative(frame, &object.pose));
                for (p, place) in state.places.iter().enumerate() {
                    let vertical = in_frame(self.up, frame);
                    let up = vertical.or_else(|| upright(state, place));
                    let shown = vertical.or_else(|| in_frame(self.told_up, frame));
                    let shown = shown.or_else(|| self.height(&state.frame)).or(up);
                    let (mut distance, density, offset) =
                        self.compare((state, place, &self.gaps[s][p]), &pose, up, shown);
                    if let ClassifierRule::Nearest { p } = self.rule {
                        distance = p_distance(&place.pose().position, &pose.position, p);
                    }
                    let fact = Fact { state: s, place: p, reference };
                    matches.push(Match { fact, distance, density, offset });
                }
            }
        }
        if let ClassifierRule::Nearest { .. } = self.rule {
            return nearest(&matches, object.pose);
        }
        let near = matches.iter().map(|m| m.distance).min_by(f64::total_cmp);
        let nearest = matches.iter().min_by(|a, b| {
            a.offset.distance().total_cmp(&b.offset.distance()).then(a.fact.cmp(&b.fact))
        });
        let miss = nearest.map(|m| Miss { nearest: m.fact, offset: m.offset });
        let taken = object.pose;
        if let ClassifierRule::Gated { limit } = self.rule {
            matches.retain(|m| m.distance <= limit);
        }
        let best =
            matches.iter().max_by(|a, b| a.density.total_cmp(&b.density).then(b.fact.cmp(&a.fact)));
        let Some(best) = best else {
            return Located { fact: None, distance: near, ambiguous: false, taken, miss };
        };
        let ambiguous = matches.iter().any(|m| {
            m.fact.state == best.fact.state
                && m.fact.reference != best.fact.reference
                && best.density - m.density < EQUAL
        });
        let distance = Some(best.distance);
        Located { fact: Some(best.fact), distance, ambiguous, taken, miss: None }
    }

    /// Returns how far along each axis of its frame a place of a state reaches from its middle, in metres: as far as an object
    /// is accepted that agrees otherwise. Along an open axis of the world, where there is no end, it is as far as objects were seen.
    /// The frame is taken to stand upright.
    ///
    /// # Panics
    /// If there is no such state or place.
    pub fn reach(&self, state: usize, place: usize) -> [f64; 3] {
        let (own, at, gaps) =
            (&self.states[state], &self.states[state].places[place], &self.gaps[state][place]);
        let up = in_frame(self.up, None).or_else(|| upright(own, at));
        let limit = match self.rule {
            ClassifierRule::Gated { limit } => limit,
            ClassifierRule::Nearest { .. } => Self::LIMIT,
        };
        std::array::from_fn(|i| match at.coordinates[i] {
            Coordinate::Tight { sd, .. } => limit * self.spread((own, at, gaps), (i, sd), up),
            Coordinate::Open { low, high } if own.frame == Frame::World => (high - low) / 2.0,
            Coordinate::Open { low, high } => {
                let range = match tumbled(own) {
                    true => (high - low).max(0.01).max(widest(at)) * widening(at.count),
                    false => (high - low).max(0.01),
                };
                (high - low) / 2.0 + range * (BEYOND.0 + limit / BEYOND.1)
            }
        })
    }

    /// Finds the state of an object that is alone in its scene: only states in the world frame can be found.
    pub fn classify_alone(&self, kind: &str, pose: &Pose) -> Located {
        let object = ObjectPose { id: kind.into(), kind: kind.into(), pose: *pose };
        self.classify_object(&Snapshot { objects: vec![object], ..Snapshot::default() }, 0)
    }

    /// Returns the direction in a frame that looks vertical there.
    fn height(&self, frame: &Frame) -> Option<Vector3<f64>> {
        let (_, axis) = self.heights.iter().find(|(own, _)| own == frame)?;
        Some(Vector3::ith(*axis, 1.0))
    }

    /// Returns the standard deviation in metres with which coordinate `i` is compared. `up` is the vertical, if it is
    /// known.
    fn spread(
        &self,
        (state, place, gaps): (&FrameState, &Place, &[f64; 3]),
        (i, sd): (usize, f64),
        up: Option<Vector3<f64>>,
    ) -> f64 {
        if state.any_coordinate {
            return FLOOR.0.hypot(self.noise_m);
        }
        let noise = self.noise_m * self.noise_m;
        if rests(state) {
            return self.careful(place, sd, (i, up));
        }
        let prior = if state.origin == Origin::Found { FOUND_M } else { PRIOR.0 };
        let prior = prior.min(gaps[i] / GAP);
        let n = place.count.max(1) as f64;
        let aside = |(j, c): (usize, &Coordinate)| match *c {
            Coordinate::Tight { sd, .. } if up.is_some_and(|up| up[j] * up[j] < 0.5) => Some(sd),
            _ => None,
        };
        let sides = place.coordinates.iter().enumerate().filter_map(aside);
        let sd = match aside((i, &place.coordinates[i])) {
            Some(sd) if tumbled(state) => sides.fold(sd, f64::max),
            _ => sd,
        };
        ((prior * prior + (n - 1.0) * sd * sd) / n + noise).sqrt().max(FLOOR.0)
    }

    /// Returns the standard deviation in metres of coordinate `i` of objects that were put down with care.
    fn careful(&self, place: &Place, sd: f64, (i, up): (usize, Option<Vector3<f64>>)) -> f64 {
        let up = up.map_or(0.0, |up| up[i]);
        let prior = between(&self.priors, up).sqrt();
        let own = predictive(prior, sd, place.count);
        (between(&PLAY, up) + own + self.noise_m * self.noise_m).sqrt()
    }

    /// Returns the standard deviation in radians with which an orientation that tells states apart is compared.
    fn angular_spread(&self, sd: f64, count: usize) -> f64 {
        let n = count.max(1) as f64;
        let variance = (PRIOR.1 * PRIOR.1 + (n - 1.0) * sd * sd) / n;
        (variance + self.noise_rad * self.noise_rad).sqrt().max(FLOOR.1)
    }

    /// Returns the standard deviation in radians with which a tilt is compared.
    fn tilt_spread(&self, state: &FrameState, place: &Place) -> f64 {
        let sd = state.turn.sd().unwrap_or(0.0);
        let own = predictive(self.priors.tilt_rad, sd, place.count);
        (PLAY.tilt_rad.powi(2) + own + self.noise_rad.powi(2)).sqrt()
    }

    /// Returns the distance in standard deviations, the log density and the offset. `up` is what an object stands along, or the axis
    /// about which it may be turned; `vertical` is the vertical, if it is known.
    fn compare(
        &self,
        (state, place, gaps): (&FrameState, &Place, &[f64; 3]),
        pose: &Pose,
        up: Option<Vector3<f64>>,
        vertical: Option<Vector3<f64>>,
    ) -> (f64, f64, Offset) {
        let (mut squares, mut density) = (0.0, 0.0);
        let mut tight = Vec::new();
        let mut deviation = Vector3::zeros();
        // An error of the angle of the reference moves what is far from it.
        let framed = state.frame != Frame::World;
        // How far is known from the place: what is judged may be anywhere.
        let at = place.pose().position;
        let arm = if framed { self.noise_rad * Vector3::from(at) } else { Vector3::zeros() };
        let in_area =
            state.origin == Origin::Found && place.coordinates.iter().any(|c| c.is_open());
        for (i, coordinate) in place.coordinates.iter().enumerate() {
            let x = pose.position[i];
            match *coordinate {
                Coordinate::Tight { mean, sd } => {
                    let swing = (arm.norm_squared() - arm[i] * arm[i]).max(0.0).sqrt();
                    let spread = self.spread((state, place, gaps), (i, sd), up).hypot(swing);
                    deviation[i] = x - mean;
                    let z = deviation[i] / spread;
                    tight.push(z);
                    squares += z * z;
                    let log = |spread: f64| {
                        let z = deviation[i] / spread;
                        -(spread.ln() + 0.919 + 0.5 * z * z)
                    };
                    // What was found in an area may have been put there as carefully as what was put elsewhere.
                    let careful =
                        in_area.then(|| log(self.careful(place, sd, (i, up)).hypot(swing)));
                    density += careful.map_or(log(spread), |careful| careful.max(log(spread)));
                }
                Coordinate::Open { low, high } => {
                    let own = (high - low).max(0.01);
                    // Few poses show little of where things tumble to.
                    let range = match tumbled(state) {
                        true => own.max(widest(place)) * widening(place.count),
                        false => own,
                    };
                    let beyond = (low - x).max(x - high).max(0.0) / range;
                    // The more poses showed the range, the less likely is a pose beyond.
                    let certain = 2.0 + (place.count as f64).ln_1p();
                    density -= range.ln() + certain * (10.0 * beyond).min(1.0) + 2.0 * beyond;
                    // Beside an object, a place has an end; on the table, demonstrations seldom show all of it.
                    if framed {
                        deviation[i] = (x - high).max(0.0) - (low - x).max(0.0);
                        let z = (beyond - BEYOND.0).max(0.0) * BEYOND.1;
                        squares += z * z;
                    }
                }
            }
        }
        if state.any_coordinate && !tight.is_empty() {
            let zeros = vec![0.0; tight.len()];
            let distance = p_distance(&tight, &zeros, PAPER_EXPONENT);
            let density = -distance * distance / 2.0 - 3.0 * FLOOR.0.ln() - 20.0;
            return (distance, density, Offset::of(&deviation, vertical.as_ref(), 0.0));
        }
        let mean = Pose { position: pose.position, orientation: place.orientation };
        let (mut off_rad, mut turned) = (0.0, false);
        if state.turn_matters
            && let Some((angle, sd)) = state.turn.deviation(&mean, pose)
        {
            let spread = self.angular_spread(sd, place.count);
            let z = angle / spread;
            squares += z * z;
            density -= 2.0 * spread.ln() + 0.5 * z * z;
            off_rad = angle;
        }
        if rests(state) {
            let fixed = match state.turn {
                Turn::Axis { .. } | Turn::Line { .. } => upright(state, place),
                _ => up.or_else(|| upright(state, place)),
            };
            let mean = state.turn.faced(&mean, pose);
            let angle = fixed.map_or(0.0, |fixed| tilt(&fixed, &mean, pose));
            let z = angle / self.tilt_spread(state, place);
            squares += z * z;
            // What lies leans in no direction when it is turned on the spot.
            let lies = |(axis, vertical): (Vector3<f64>, Vector3<f64>)| {
                axis.dot(&vertical).abs() < 0.5 * axis.norm()
            };
            turned = angle >= off_rad && fixed.zip(vertical).is_some_and(lies);
            off_rad = off_rad.max(angle);
        }
        let offset = Offset::of(&deviation, vertical.as_ref(), off_rad);
        (squares.sqrt(), density, Offset { turned, ..offset })
    }
}

/// Returns a coordinate of the world frame as a direction in a frame.
fn in_frame(up: Option<usize>, frame: Option<&Pose>) -> Option<Vector3<f64>> {
    let up = Vector3::ith(up?, 1.0);
    Some(frame.map_or(up, |frame| frame.rotation().inverse() * up))
}

/// Returns the match at the least distance.
fn nearest(matches: &[Match], taken: Pose) -> Located {
    let best =
        matches.iter().min_by(|a, b| a.distance.total_cmp(&b.distance).then(a.fact.cmp(&b.fact)));
    let (fact, distance) = (best.map(|m| m.fact), best.map(|m| m.distance));
    let other = |m: &Match| {
        Some(m.distance) == distance
            && fact.is_some_and(|f| f.state == m.fact.state && f.reference != m.fact.reference)
    };
    Located { fact, distance, ambiguous: matches.iter().any(other), taken, miss: None }
}
