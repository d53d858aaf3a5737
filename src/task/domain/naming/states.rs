//! Symbols and sentences of states, and of the actions that bring them about.

use std::collections::{BTreeMap, HashSet};

use nalgebra::Vector3;

use super::nouns::{a, noun, symbol};
use crate::robot::{Pose, rotation_between};
use crate::task::domain::{Frame, FrameState, GoalTerm, Origin, RelationalOperator, Turn};
use crate::task::propositional::is_symbol;
use crate::task::recording::Recording;

/// Things that others are put into. The last word of a kind decides.
const CONTAINERS: &[&str] = &[
    "bag", "basket", "bin", "bottle", "bowl", "box", "bucket", "cabinet", "can", "carton", "case",
    "crate", "cup", "drawer", "dish", "glass", "jar", "mug", "nest", "pan", "pot", "recess",
    "slot", "socket", "vase",
];
/// Things that others lie on, wherever on them.
const CARRIERS: &[&str] = &[
    "bench", "board", "cart", "conveyor", "counter", "desk", "floor", "mat", "pad", "pallet",
    "rack", "shelf", "table", "tray",
];
/// Those that have several heights to lie on.
const STOREYED: &[&str] = &["cart", "conveyor", "rack", "shelf"];
/// Things that close others from above.
const COVERS: &[&str] = &["cap", "cover", "lid", "top"];
/// Things that open and close.
const OPENABLE: &[&str] =
    &["door", "drawer", "flap", "gate", "hatch", "lid", "shutter", "slide", "window"];

/// What is said of a state whose objects were found in an area.
pub(super) const IN_START_AREA: &str = "in its start area";

/// What is said of a state that makes room for others.
const ASIDE: &str = "set aside";

/// Offset across a frame above which an object lies beside it, and below which it is centred, in metres.
const BESIDE_M: f64 = 0.04;
const CENTRED_M: f64 = 0.02;
/// Height above the origin of a frame from which a centred object lies on it rather than in it, in metres.
const ON_M: f64 = 0.0125;
/// Difference in height from which the higher of two places on a thing is above it, in metres.
const ABOVE_M: f64 = 0.02;
/// Largest distance at which a landmark names a state in the world, in metres.
const NEAR_M: f64 = 0.15;
/// Distance up to which two states of other orientation are in one place, in metres.
const SAME_PLACE_M: f64 = 0.05;
/// Angle from which an orientation is another one.
const TURNED_DEG: f64 = 30.0;
/// Angle from which a tilt is a tipping over, and a turning over.
const TIPPED_DEG: [f64; 2] = [60.0, 135.0];
/// Step to which measures in names are rounded, in millimetres and in degrees.
const STEP: f64 = 5.0;

/// A fixture: an object that never moved. States in the world frame near it are named after it where no frames are learned.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Landmark {
    pub kind: String,
    pub pose: Pose,
}

/// Returns the objects of the first snapshot whose kind is `fixed`.
pub(crate) fn landmarks(recording: &Recording, fixed: impl Fn(&str) -> bool) -> Vec<Landmark> {
    let first = recording.demos.iter().flat_map(|d| d.snapshots.first()).next();
    let objects = first.into_iter().flat_map(|s| &s.objects).filter(|o| fixed(&o.kind));
    objects.map(|o| Landmark { kind: o.kind.to_string(), pose: o.pose }).collect()
}

/// Returns the landmark nearest to a position, within [`NEAR_M`].
fn nearest<'l>(position: &Pose, landmarks: &'l [Landmark]) -> Option<&'l Landmark> {
    landmarks
        .iter()
        .map(|l| (l.pose.distance(position), l))
        .filter(|(distance, _)| *distance <= NEAR_M)
        .min_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, landmark)| landmark)
}

/// Returns a symbol for a state of a domain without frames: `KIND_AT_START` if its parts were found there, else
/// `KIND_AT_LANDMARK` for the nearest landmark within [`NEAR_M`], else `KIND_PLACED`.
pub(crate) fn symbol_in_world(
    kind: &str,
    origin: Origin,
    position: &Pose,
    landmarks: &[Landmark],
) -> String {
    let kind = symbol(kind);
    if origin == Origin::Found {
        return format!("{kind}_AT_START");
    }
    match nearest(position, landmarks) {
        Some(landmark) => format!("{kind}_AT_{}", symbol(&landmark.kind)),
        None => format!("{kind}_PLACED"),
    }
}

/// Returns a symbol for the action that puts a part into the state of this symbol.
pub(crate) fn action_symbol(state: &str) -> String {
    format!("PUT_{state}")
}

/// Gives out unique symbols.
#[derive(Debug, Default)]
pub(crate) struct Names {
    taken: HashSet<String>,
}

impl Names {
    /// Returns `wanted`, or `wanted_2`, `wanted_3` and so on if the name is taken.
    pub fn take(&mut self, wanted: &str) -> String {
        let mut name = wanted.to_owned();
        let mut number = 2;
        while !is_symbol(&name) || !self.taken.insert(name.clone()) {
            name = format!("{wanted}_{number}");
            number += 1;
        }
        name
    }
}

/// Gives symbols to all states and operators of a domain with frames, and returns their sentences. A state in the world
/// that is one spot is named after a landmark near it. `goals` is the goal, empty if it is not known.
pub(crate) fn name_all(
    states: &mut [FrameState],
    operators: &mut [RelationalOperator],
    goals: &[GoalTerm],
    landmarks: &[Landmark],
) -> BTreeMap<String, String> {
    let mut names = Names::default();
    let near = |state: &FrameState| {
        let place = state.places.first()?.pose();
        nearest(&place, landmarks).map(|landmark| landmark.kind.clone())
    };
    let described = describe(states, operators, goals, near);
    let mut words = BTreeMap::new();
    for (state, own) in states.iter_mut().zip(&described) {
        state.name = names.take(&own.symbol);
        words.insert(state.name.clone(), own.statement());
    }
    for operator in operators {
        let own = &described[operator.to];
        operator.name = names.take(&own.action());
        words.insert(operator.name.clone(), own.order());
    }
    words
}

/// Returns the landmark in the symbol of a state, of which no more is known.
pub(super) fn named_landmark(state: &FrameState) -> Option<String> {
    let place = state.name.strip_prefix(&symbol(&state.kind))?.strip_prefix("_AT_")?;
    Some(place.into())
}

/// How a state is brought about.
#[derive(Clone, Copy, PartialEq)]
enum Way {
    Put,
    PutDown,
    Aside,
    Open,
    Close,
    Turn,
}

/// What is said of a state.
pub(super) struct Described {
    symbol: String,
    /// What follows "a KIND is".
    rest: String,
    noun: String,
    way: Way,
}

impl Described {
    /// Returns the sentence of the state.
    pub fn statement(&self) -> String {
        format!("{} is {}", a(&self.noun), self.rest)
    }

    /// Returns the symbol of the action that brings the state about.
    fn action(&self) -> String {
        let kind = symbol(&self.noun);
        let own = self.symbol.strip_prefix(&kind).map(|rest| rest.trim_start_matches('_'));
        match (self.way, own) {
            (Way::PutDown | Way::Aside, _) => {
                format!("PUT_DOWN_{}", self.symbol.replacen("_PLACED", "", 1))
            }
            (Way::Open, Some(how)) => format!("OPEN_{kind}{}", how.replacen("OPEN", "", 1)),
            (Way::Close, Some(how)) => format!("CLOSE_{kind}{}", how.replacen("CLOSED", "", 1)),
            (Way::Turn, Some(how)) => {
                let (verb, how) = how.split_once('_').unwrap_or((how, ""));
                let verb = if verb == "TIPPED" { "TIP" } else { "TURN" };
                format!("{verb}_{kind}_{how}")
            }
            _ => action_symbol(&self.symbol),
        }
    }

    /// Returns the sentence of the action that brings the state about.
    pub fn order(&self) -> String {
        let (kind, rest) = (a(&self.noun), &self.rest);
        let after = |word: &str| rest.strip_prefix(word).unwrap_or(rest);
        match self.way {
            Way::Put => format!("put {kind} {rest}"),
            Way::PutDown => format!("put {kind} down {rest}"),
            Way::Aside => format!("set {kind} aside{}", after(ASIDE)),
            Way::Open => format!("open {kind}{}", after("open")),
            Way::Close => format!("close {kind}{}", after("closed")),
            Way::Turn => match rest.strip_prefix("tipped") {
                Some(how) => format!("tip {kind}{how}"),
                None => format!("turn {kind}{}", after("turned")),
            },
        }
    }
}

/// Says of each state what is known of it, so that no two descriptions are the same unless the states are.
/// `near` returns the kind of a landmark near a state in the world. What is put down in an area that no term of the goal
/// names, if there are terms, is set aside.
pub(super) fn describe(
    states: &[FrameState],
    operators: &[RelationalOperator],
    goals: &[GoalTerm],
    near: impl Fn(&FrameState) -> Option<String>,
) -> Vec<Described> {
    let mut all: Vec<Described> = states.iter().map(first).collect();
    for (state, own) in states.iter().zip(&mut all) {
        if own.way == Way::PutDown
            && !is_region(state)
            && let Some(place) = near(state)
        {
            own.symbol = format!("{}_AT_{}", symbol(&state.kind), symbol(&place));
            (own.rest, own.way) = (format!("near the {}", noun(&place)), Way::Put);
        }
    }
    let asked = |state: usize| {
        goals
            .iter()
            .any(|term| term.reference.into_iter().chain(term.states()).any(|own| own == state))
    };
    for (index, own) in all.iter_mut().enumerate() {
        if own.way == Way::PutDown
            && is_region(&states[index])
            && !goals.is_empty()
            && !asked(index)
        {
            (own.rest, own.way) = (ASIDE.into(), Way::Aside);
        }
    }
    let mut groups: BTreeMap<(&str, &Frame), Vec<usize>> = BTreeMap::new();
    for (index, state) in states.iter().enumerate() {
        groups.entry((&state.kind, &state.frame)).or_default().push(index);
    }
    for group in groups.values().filter(|group| group.len() > 1) {
        let mut opens = false;
        for track in tracks(group, operators) {
            opens |= open_and_closed(states, &track, &mut all);
        }
        if !opens {
            turned(states, group, &mut all);
        }
    }
    apart(states, &mut all);
    unlike(&mut all);
    all
}

/// Describes a state by itself.
fn first(state: &FrameState) -> Described {
    let kind = symbol(&state.kind);
    let several = state.places.len() > 1;
    let found = state.origin == Origin::Found;
    let (symbol, rest, way) = match &state.frame {
        Frame::Kind(frame) => {
            let rest = format!("{} {}", relation(state, frame), a(&noun(frame)));
            (format!("{kind}_AT_{}", symbol(frame)), rest, Way::Put)
        }
        Frame::World => {
            let rest = match (found, is_region(state), several) {
                (true, true, _) => IN_START_AREA,
                (true, false, false) => "at its start place",
                (true, false, true) => "at one of its start places",
                (false, true, _) => "in its target area",
                (false, false, false) => "at its fixed spot",
                (false, false, true) => "at one of its fixed spots",
            };
            let (end, way) = if found { ("AT_START", Way::Put) } else { ("PLACED", Way::PutDown) };
            (format!("{kind}_{end}"), rest.into(), way)
        }
    };
    Described { symbol, rest, noun: noun(&state.kind), way }
}

fn is_region(state: &FrameState) -> bool {
    state.places.iter().any(|place| place.is_roomy())
}

/// Returns whether the last word of a kind is one of these.
fn is_one(kind: &str, words: &[&str]) -> bool {
    let noun = noun(kind);
    let last = noun.rsplit(' ').next().unwrap_or_default();
    words.contains(&last.trim_end_matches(|c: char| c.is_ascii_digit()))
}

/// Returns the preposition between a state's object and its reference. A noun tells what no position does: that a cup is
/// hollow.
fn relation(state: &FrameState, frame: &str) -> &'static str {
    let across = |p: &[f64; 3]| p[0].hypot(p[1]);
    let at: Vec<[f64; 3]> = state.places.iter().map(|place| place.pose().position).collect();
    let all = |holds: &dyn Fn(&[f64; 3]) -> bool| at.iter().all(holds);
    let covers = is_one(&state.kind, COVERS) && all(&|p| across(p) < CENTRED_M && p[2] > 0.0);
    if covers || is_one(frame, CARRIERS) {
        return "on";
    }
    if is_one(frame, CONTAINERS) {
        return "in";
    }
    if is_region(state) {
        return "at";
    }
    if all(&|p| across(p) > BESIDE_M && p[2].abs() < BESIDE_M) {
        return "beside";
    }
    if all(&|p| across(p) < CENTRED_M && p[2] >= ON_M) {
        return "on";
    }
    if all(&|p| across(p) < BESIDE_M && p[2].abs() < ON_M) { "in" } else { "at" }
}

/// Returns the middle of all places of a state.
fn middle(state: &FrameState) -> Vector3<f64> {
    let all = state.places.iter().map(|place| Vector3::from(place.pose().position));
    all.sum::<Vector3<f64>>() / state.places.len().max(1) as f64
}

/// Returns the angle of an orientation from that of its frame, in radians.
fn angle(state: &FrameState) -> f64 {
    state.places.first().map_or(0.0, |place| place.pose().rotation().angle())
}

fn rounded(value: f64) -> f64 {
    (value / STEP).round() * STEP
}

/// Parts states of a kind by the actions that lead from one to another: each drawer of a cabinet has a track of its own.
/// All are one track where one of them would have a single state.
fn tracks(group: &[usize], operators: &[RelationalOperator]) -> Vec<Vec<usize>> {
    let mut track: BTreeMap<usize, usize> = group.iter().map(|state| (*state, *state)).collect();
    for operator in operators {
        for from in &operator.from {
            if let (Some(a), Some(b)) = (track.get(from).copied(), track.get(&operator.to).copied())
            {
                track.values_mut().filter(|own| **own == a).for_each(|own| *own = b);
            }
        }
    }
    let mut all: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    for (state, own) in track {
        all.entry(own).or_default().push(state);
    }
    if all.values().any(|track| track.len() < 2) {
        return vec![group.to_vec()];
    }
    all.into_values().collect()
}

/// Tells the states of a thing that opens apart: it is closed where it is nearest to its frame. Returns `false` if it is
/// no such thing.
fn open_and_closed(states: &[FrameState], group: &[usize], all: &mut [Described]) -> bool {
    let single = |i: &usize| {
        let state = &states[*i];
        let near = |pose: Pose| (Vector3::from(pose.position) - middle(state)).norm();
        let mut apart = state.places.iter().map(|place| near(place.pose()));
        !state.places.is_empty() && !is_region(state) && apart.all(|m| m < SAME_PLACE_M / 2.0)
    };
    let framed = states[group[0]].frame.kind().is_some();
    if !framed || !is_one(&states[group[0]].kind, OPENABLE) || !group.iter().all(single) {
        return false;
    }
    // A radian counts as much as 20 cm: a door swings by as much as a drawer slides.
    let extent = |i: &usize| middle(&states[*i]).norm() + 0.2 * angle(&states[*i]);
    let mut order = group.to_vec();
    order.sort_by(|a, b| extent(a).total_cmp(&extent(b)));
    let (closed, open) = (order[0], &order[1..]);
    let kind = symbol(&states[closed].kind);
    let say = |of: &mut Described, symbol: String, rest: String, way: Way| {
        (of.symbol, of.rest, of.way) = (symbol, rest, way);
    };
    say(&mut all[closed], format!("{kind}_CLOSED"), "closed".into(), Way::Close);
    for index in open {
        let by_mm = 1e3 * (middle(&states[*index]) - middle(&states[closed])).norm();
        let by_deg = (angle(&states[*index]) - angle(&states[closed])).abs().to_degrees();
        let (symbol, rest) = match (open.len(), by_deg >= TURNED_DEG) {
            (1, _) => (format!("{kind}_OPEN"), "open".into()),
            (_, true) => {
                let by = rounded(by_deg);
                (format!("{kind}_OPEN_{by}DEG"), format!("open by {by} degrees"))
            }
            (_, false) => {
                let by = rounded(by_mm);
                (format!("{kind}_OPEN_{by}MM"), format!("open by {by} mm"))
            }
        };
        say(&mut all[*index], symbol, rest, Way::Open);
    }
    true
}

/// Tells states in one place apart by their orientation, from that in which objects were found.
fn turned(states: &[FrameState], group: &[usize], all: &mut [Described]) {
    let free = |i: &usize| states[*i].turn == Turn::Free;
    if group.iter().any(free) {
        return;
    }
    let rank = |i: &usize| (states[*i].origin != Origin::Found, (1e3 * angle(&states[*i])) as i64);
    let Some(base) = group.iter().copied().min_by_key(rank) else { return };
    let Some(from) = states[base].places.first().map(|place| place.pose()) else { return };
    let mut any = false;
    for index in group.iter().filter(|index| **index != base) {
        let (own, first) = (&states[*index], &states[base]);
        let near = (middle(own) - middle(first)).norm() < SAME_PLACE_M;
        let regions = is_region(own) && is_region(first);
        let Some(pose) = own.places.first().map(|place| place.pose()) else { continue };
        let tilt = (from.rotation() * Vector3::z()).angle(&(pose.rotation() * Vector3::z()));
        let about = |axis: &Vector3<f64>| (from.rotation() * axis).angle(&(pose.rotation() * axis));
        let by = match own.turn {
            Turn::Axis { axis, .. } => about(&Vector3::from(axis)),
            Turn::Line { axis, .. } => {
                let by = about(&Vector3::from(axis));
                by.min(std::f64::consts::PI - by)
            }
            _ => Vector3::from(rotation_between(&from, &pose)).norm(),
        };
        let (tilt, by) = (tilt.to_degrees(), by.to_degrees());
        if !(near || regions) || by < TURNED_DEG {
            continue;
        }
        let [tipped, over] = TIPPED_DEG;
        let kind = symbol(&own.kind);
        let (symbol, rest) = match tilt.min(by) {
            tilt if tilt >= over => ("TURNED_OVER".into(), "turned over".into()),
            tilt if tilt >= tipped => ("TIPPED_OVER".into(), "tipped over".into()),
            _ => {
                let by = rounded(by);
                (format!("TURNED_BY_{by}DEG"), format!("turned by {by} degrees"))
            }
        };
        any = true;
        let of = &mut all[*index];
        if own.frame == Frame::World {
            of.symbol = format!("{kind}_{symbol}");
            (of.rest, of.way) = (rest, Way::Turn);
        } else {
            of.symbol = format!("{}_{symbol}", of.symbol);
            of.rest = format!("{}, {rest}", of.rest);
        }
    }
    if any && states[base].frame == Frame::World && states[base].origin == Origin::Found {
        all[base].rest = "turned as at the start".into();
    }
}

/// Tells states with equal symbols apart by where they lie, along the axis on which they differ most.
fn apart(states: &[FrameState], all: &mut [Described]) {
    let mut equal: BTreeMap<String, Vec<usize>> = BTreeMap::new();
    for (index, own) in all.iter().enumerate() {
        equal.entry(own.symbol.clone()).or_default().push(index);
    }
    for group in equal.into_values().filter(|group| group.len() > 1) {
        let along = |i: usize, axis: usize| middle(&states[i])[axis];
        let range = |axis: usize| {
            let values = group.iter().map(|i| along(*i, axis));
            let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| {
                (low.min(v), high.max(v))
            });
            high - low
        };
        // Of equal ranges, the first axis.
        let axis = (0..3).rev().max_by(|a, b| range(*a).total_cmp(&range(*b))).unwrap_or(0);
        let (letter, large) = (["x", "y", "z"][axis], ["X", "Y", "Z"][axis]);
        let mut order = group.clone();
        order.sort_by(|a, b| along(*a, axis).total_cmp(&along(*b, axis)));
        let measures: Vec<f64> = order.iter().map(|i| rounded(1e3 * along(*i, axis))).collect();
        let framed = |i: &usize| states[*i].frame.kind().is_some() && !is_region(&states[*i]);
        let measured =
            order.iter().all(framed) && measures.windows(2).all(|pair| pair[0] < pair[1]);
        let lowest = measures.first().copied().unwrap_or_default();
        let flat = states[order[0]].frame.kind().is_some_and(|frame| !is_one(frame, STOREYED));
        if measured
            && flat
            && let ([lower, upper], [low, high]) = (&order[..], &measures[..])
            && axis == 2
            && high - low >= 1e3 * ABOVE_M
            && all[*lower].rest.starts_with("on ")
        {
            // Of two heights, "on" and "above" say enough.
            let upper = &mut all[*upper];
            upper.symbol = upper.symbol.replacen("_AT_", "_ABOVE_", 1);
            upper.rest = upper.rest.replacen("on ", "above ", 1);
            continue;
        }
        for (rank, (index, mm)) in order.iter().zip(measures).enumerate() {
            // An area or a place is one of several; what is near or in something is so at some height.
            let of_world =
                states[*index].frame == Frame::World && !all[*index].rest.starts_with("near");
            let one = if of_world { "the one " } else { "" };
            let (symbol, rest) = match (measured, order.len(), axis, rank) {
                (true, ..) => {
                    let minus = if mm < 0.0 { "MINUS_" } else { "" };
                    let way = match (axis, mm < 0.0) {
                        (2, false) => format!("{mm} mm up"),
                        (2, true) => format!("{} mm down", -mm),
                        _ => format!("{mm} mm along {letter}"),
                    };
                    (format!("{large}_{minus}{}MM", mm.abs()), way)
                }
                (_, 2, 2, 0) => ("LOWER".into(), format!("{one}at lower height")),
                (_, 2, 2, _) => ("UPPER".into(), format!("{one}at upper height")),
                (_, 2, _, 0) => (format!("LOW_{large}"), format!("{one}at low {letter}")),
                (_, 2, _, _) => (format!("HIGH_{large}"), format!("{one}at high {letter}")),
                _ => {
                    let (rank, of) = (rank + 1, order.len());
                    (
                        format!("{rank}_OF_{of}_ALONG_{large}"),
                        format!("{rank} of {of} along {letter}"),
                    )
                }
            };
            let of = &mut all[*index];
            of.symbol = format!("{}_{symbol}", of.symbol);
            // What lies higher than another of its kind on the same thing does not touch it, unless this has storeys.
            let higher = measured && axis == 2 && mm - lowest >= 1e3 * ABOVE_M;
            let own = match of.rest.strip_prefix("on ") {
                Some(place) if higher && flat => format!("above {place}"),
                _ => of.rest.clone(),
            };
            of.rest = format!("{own}, {rest}");
        }
    }
}

/// Numbers descriptions that are equal still: different kinds can give one noun.
fn unlike(all: &mut [Described]) {
    let mut seen: BTreeMap<String, usize> = BTreeMap::new();
    for own in all {
        let number = seen.entry(own.statement()).or_default();
        *number += 1;
        if *number > 1 {
            own.rest = format!("{} ({number})", own.rest);
        }
    }
}
