//! Remarks: what the learner noticed about the demonstrations and decided by itself, for people to check.

use std::fmt;

use crate::task::domain::{Coordinate, FrameState, Place, RelationalDomain};

/// Something that a person should know of what was learned. Its text is one sentence.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Remark {
    /// Objects that nobody handled are seen elsewhere from look to look.
    ViewsDiffer {
        /// A kind that nobody handled, the one that jumps least.
        kind: String,
        /// The usual distance between two looks, in metres.
        off_m: f64,
    },
    /// What was put at a reference is seen elsewhere in some demonstrations than in the others, as by another camera. It was
    /// taken to be where the others see it.
    DemonstrationsDiffer {
        /// Kind of what was put there; `None` for all kinds.
        kind: Option<String>,
        /// Kind of the reference; `None` for the world.
        reference: Option<String>,
        /// Numbers of the demonstrations.
        demos: Vec<u64>,
        /// The distance, in metres.
        off_m: f64,
    },
    /// Another hand moved objects of the kind. It has no states, only what lies relative to it has.
    MovedByOthers {
        /// The kind.
        kind: String,
    },
    /// The same is done to objects of several kinds.
    Alike {
        /// The kinds, at least two.
        kinds: Vec<String>,
        /// Kinds of the references to which they are brought, or `world`.
        to: Vec<String>,
    },
    /// An attribute decides what is done to the objects of a kind, but for some. It divides nothing.
    WouldDivide {
        /// The kind.
        kind: String,
        /// The attribute.
        attribute: String,
        /// Id of the first such object.
        id: String,
        /// Number of its demonstration.
        demo: u64,
        /// Number of further such objects.
        more: usize,
        /// Whether they lack the attribute. If not, what is done to them is an exception.
        lacks: bool,
    },
    /// Objects of a kind were left in a state in most demonstrations, but not in nearly all. The goal says nothing of the kind.
    NotInGoal {
        /// The kind.
        kind: String,
        /// The state.
        state: String,
        /// Number of demonstrations that end so.
        held: usize,
        /// Number of demonstrations.
        of: usize,
    },
    /// No goal was found.
    NoGoal(NoGoal),
}

/// Why no goal was found.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum NoGoal {
    /// No action was learned.
    NoAction,
    /// Demonstrations end differently.
    EndsDiffer {
        /// The states that actions achieve and that hold at some ends, each with the number of these.
        ends: Vec<(String, usize)>,
        /// Number of demonstrations.
        of: usize,
    },
    /// All that holds at the end held all along.
    NothingNew,
}

impl Remark {
    /// Returns the name of what is remarked, in snake case.
    pub fn name(&self) -> &'static str {
        match self {
            Self::ViewsDiffer { .. } => "views_differ",
            Self::DemonstrationsDiffer { .. } => "demonstrations_differ",
            Self::MovedByOthers { .. } => "moved_by_others",
            Self::Alike { .. } => "alike",
            Self::WouldDivide { .. } => "would_divide",
            Self::NotInGoal { .. } => "not_in_goal",
            Self::NoGoal(_) => "no_goal",
        }
    }
}

impl fmt::Display for Remark {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::ViewsDiffer { kind, off_m } => write!(
                f,
                "`{kind}` was moved by nobody and is seen {:.0} mm off from look to look, as by cameras that disagree; \
                 places less than that apart are taken for one",
                1e3 * off_m
            ),
            Self::DemonstrationsDiffer { kind, reference, demos, off_m } => {
                let demos: Vec<String> = demos.iter().map(|demo| format!("demo {demo}")).collect();
                let what =
                    kind.as_ref().map_or("all that".into(), |kind| format!("a `{kind}` that"));
                let at = reference.as_ref().map_or(String::new(), |kind| format!(" at `{kind}`"));
                write!(
                    f,
                    "in {}, {what} was put down{at} is {:.0} mm off from where the others show it, as by \
                     another camera; it was taken for one place",
                    listed(&demos),
                    1e3 * off_m
                )
            }
            Self::MovedByOthers { kind } => write!(
                f,
                "`{kind}` was moved by another hand, not by the demonstrated actions; where it stands is no state and no goal"
            ),
            Self::Alike { kinds, to } => {
                let names: Vec<String> = kinds.iter().map(|kind| format!("`{kind}`")).collect();
                write!(f, "the same is done to {}: they go to {}", listed(&names), listed(to))
            }
            Self::WouldDivide { kind, attribute, id, demo, more, lacks } => {
                let why = if *lacks { "lacks it" } else { "is an exception" };
                write!(f, "`{attribute}` would divide `{kind}`, but `{id}` in demo {demo} {why}")?;
                if *more > 0 { write!(f, ", and so do {more} other objects") } else { Ok(()) }
            }
            Self::NotInGoal { kind, state, held, of } => write!(
                f,
                "`{state}` is how {held} of {of} demonstrations end; the goal says nothing of where a `{kind}` goes"
            ),
            Self::NoGoal(why) => write!(f, "no goal was found: {why}"),
        }
    }
}

impl fmt::Display for NoGoal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoAction => f.write_str("no action was learned"),
            Self::NothingNew => f.write_str(
                "all that holds at the end of the demonstrations held in them all along",
            ),
            Self::EndsDiffer { ends, of } => {
                let ends = ends.iter().map(|(name, held)| format!("`{name}` in {held} of {of}"));
                let ends: Vec<String> = ends.collect();
                write!(f, "the demonstrations end differently, {}", listed(&ends))
            }
        }
    }
}

fn listed(names: &[String]) -> String {
    match names {
        [rest @ .., last] if !rest.is_empty() => format!("{} and {last}", rest.join(", ")),
        _ => names.concat(),
    }
}

/// Distance up to which two places are the same, in metres.
const SAME_M: f64 = 5e-3;

/// The states between which an action moves its object.
type Move<'d> = (&'d FrameState, &'d FrameState);

/// Returns the groups of kinds to which the same is done: their actions lead between places in the same frames that agree in
/// at least two coordinates. The height at which objects lie tells their size, not what is done to them.
pub(super) fn alike(domain: &RelationalDomain) -> Vec<Remark> {
    let state = |index: usize| &domain.states[index];
    let mut groups: Vec<(Vec<Move<'_>>, Vec<String>)> = Vec::new();
    let mut kinds: Vec<&str> = domain.states.iter().map(|s| &*s.kind).collect();
    kinds.sort_unstable();
    kinds.dedup();
    for kind in kinds {
        let own = domain.operators.iter().filter(|o| state(o.to).kind == kind);
        let moves = own.flat_map(|o| o.from.iter().map(|from| (state(*from), state(o.to))));
        let mut moves: Vec<_> = moves.collect();
        moves.sort_by_key(|(from, to)| (from.frame.kind(), to.frame.kind()));
        let same = |others: &[Move<'_>]| {
            let pairs = || moves.iter().zip(others);
            !moves.is_empty()
                && moves.len() == others.len()
                && pairs().all(|(a, b)| is_alike(a.0, b.0) && is_alike(a.1, b.1))
        };
        match groups.iter_mut().find(|(others, _)| same(others)) {
            Some((.., kinds)) => kinds.push(kind.to_owned()),
            None => groups.push((moves, vec![kind.to_owned()])),
        }
    }
    let groups = groups.into_iter().filter(|(_, kinds)| kinds.len() > 1);
    groups
        .map(|(moves, kinds)| {
            let mut to: Vec<String> =
                moves.iter().map(|(_, to)| to.frame.name().to_owned()).collect();
            to.dedup();
            Remark::Alike { kinds, to }
        })
        .collect()
}

fn is_alike(a: &FrameState, b: &FrameState) -> bool {
    let places = |s: &FrameState| s.places.iter().any(Place::is_roomy);
    a.frame == b.frame
        && a.origin == b.origin
        && places(a) == places(b)
        && a.places.len() == b.places.len()
        && a.places.iter().all(|p| b.places.iter().any(|q| agree(p, q)))
}

fn agree(a: &Place, b: &Place) -> bool {
    let near = a.coordinates.iter().zip(&b.coordinates).filter(|(a, b)| match (a, b) {
        (Coordinate::Tight { mean: a, .. }, Coordinate::Tight { mean: b, .. }) => {
            (a - b).abs() <= SAME_M
        }
        (Coordinate::Open { low: a, high: b }, Coordinate::Open { low: c, high: d }) => {
            a <= d && c <= b
        }
        _ => false,
    });
    near.count() >= 2
}
