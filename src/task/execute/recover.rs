//! The ladder of recovery: what the executor does when an action cannot begin or keeps failing, or when the planner is
//! stuck while parts are in no state.

use super::mind::{Choice, Seen};
use crate::task::event::RecoveryKind;
use crate::task::scene::Scene;

/// What the executor wanted to do and could not: a part, and where it was to be put.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub(super) struct Wanted {
    pub part: usize,
    /// Part that the part was to be put onto, into or beside.
    pub reference: Option<usize>,
    /// Position of the target, in metres.
    pub at: [f64; 3],
    /// Why it was not possible, in words.
    pub why: String,
}

impl Wanted {
    pub fn of(choice: &Choice, why: String) -> Self {
        let Choice { part, reference, target, .. } = choice;
        Self { part: *part, reference: *reference, at: target.position, why }
    }
}

/// A detour: a kind of recovery with a part.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Detour {
    pub kind: RecoveryKind,
    pub part: usize,
    pub why: String,
}

/// What the ladder knows of the scene.
pub(super) struct View<'v> {
    pub scene: &'v Scene,
    pub seen: &'v Seen,
    /// For each part, whether it is in no state.
    pub in_no_state: &'v [bool],
    pub name: &'v dyn Fn(usize) -> String,
}

/// Horizontal distance within which a part is beside another one, so that the hand may lack room, in metres.
const BESIDE_M: f64 = 0.075;
/// Height difference up to which a part lies at a target, in metres.
const LEVEL_M: f64 = 0.08;

impl View<'_> {
    /// Returns the seen parts with their positions.
    fn parts(&self) -> impl Iterator<Item = (usize, [f64; 3])> + '_ {
        let all = self.seen.snapshot.objects.iter().zip(&self.seen.parts);
        all.filter_map(|(object, part)| Some(((*part)?, object.pose.position)))
    }

    fn at(&self, part: usize) -> Option<[f64; 3]> {
        self.parts().find(|(own, _)| *own == part).map(|(_, at)| at)
    }

    fn loose(&self, part: usize) -> bool {
        self.in_no_state.get(part).copied().unwrap_or(false)
    }

    /// Returns whether the robot can lift a part away.
    fn free(&self, part: usize) -> bool {
        self.scene.slider(part).is_none()
    }

    /// Returns the other parts near a position, the nearest first.
    fn near(&self, at: [f64; 3], within_m: f64, except: &[usize]) -> Vec<usize> {
        let mut near: Vec<(f64, usize)> = self
            .parts()
            .filter(|(part, _)| !except.contains(part) && self.free(*part))
            .filter(|(_, own)| (own[2] - at[2]).abs() < LEVEL_M)
            .map(|(part, own)| ((own[0] - at[0]).hypot(own[1] - at[1]), part))
            .filter(|(far, _)| *far < within_m)
            .collect();
        near.sort_by(|a, b| a.0.total_cmp(&b.0));
        near.into_iter().map(|(_, part)| part).collect()
    }

    /// Returns the parts in no state that lie at a target.
    pub fn wrongly_at(&self, wanted: &Wanted) -> Vec<usize> {
        let within_m = self.scene.kind(wanted.part).map_or(0.02, |k| k.handling.in_the_way_m);
        let except: Vec<usize> = [wanted.part].into_iter().chain(wanted.reference).collect();
        let mut near = self.near(wanted.at, within_m.max(0.02), &except);
        near.retain(|part| self.loose(*part));
        near
    }
}

/// Lists detours in the order in which they are tried. With `stuck`, parts in no state are dealt with even if no action
/// wants them.
pub(super) fn detours(view: &View<'_>, wanted: &[Wanted], stuck: bool) -> Vec<Detour> {
    use RecoveryKind::{Clear, Push, Regrasp, Reseat};
    let name = view.name;
    let mut all: Vec<Detour> = Vec::new();
    let mut add = |kind: RecoveryKind, part: usize, why: String| {
        if view.free(part) && !all.iter().any(|d| d.kind == kind && d.part == part) {
            all.push(Detour { kind, part, why });
        }
    };
    for w in wanted {
        for part in view.wrongly_at(w) {
            let why = format!("it is in no state and lies where {} is to be put", name(w.part));
            add(Reseat, part, why);
        }
    }
    for w in wanted.iter().filter(|w| view.at(w.part).is_some()) {
        add(Regrasp, w.part, w.why.clone());
    }
    let loose: Vec<usize> =
        view.parts().map(|(part, _)| part).filter(|part| view.loose(*part)).collect();
    if stuck {
        for part in &loose {
            add(Regrasp, *part, "it is in no state that an action can use".into());
        }
    }
    let targets: Vec<usize> =
        wanted.iter().flat_map(|w| [Some(w.part), w.reference]).flatten().collect();
    for w in wanted {
        for part in view.near(w.at, BESIDE_M, &targets) {
            add(Clear, part, format!("it lies where {} is to be put; {}", name(w.part), w.why));
        }
    }
    let handled = wanted.iter().map(|w| w.part).chain(loose.iter().copied().filter(|_| stuck));
    for part in handled {
        let Some(at) = view.at(part) else { continue };
        for other in view.near(at, BESIDE_M, &targets) {
            add(Clear, other, format!("it lies beside {}, which could not be taken", name(part)));
        }
    }
    // The reference itself may lie wrongly although its state says otherwise.
    for w in wanted {
        if let Some(reference) = w.reference.filter(|r| view.at(*r).is_some()) {
            add(Reseat, reference, format!("{}; {} may lie wrongly", w.why, name(reference)));
        }
    }
    for w in wanted.iter().filter(|w| view.at(w.part).is_some()) {
        add(Push, w.part, w.why.clone());
    }
    if stuck {
        for part in &loose {
            add(Push, *part, "it is in no state and cannot be grasped".into());
        }
    }
    all
}
