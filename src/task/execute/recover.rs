//! The ladder of recovery: what the executor does when an action cannot begin or keeps failing, or when the planner is
//! stuck while parts are in no state.

use super::means;
use super::model::{Choice, Seen};
use crate::task::domain::Pose;
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
    /// Whether something at the target is the reason.
    pub jammed: bool,
}

impl Wanted {
    pub fn of(choice: &Choice, why: String, jammed: bool) -> Self {
        let Choice { part, reference, target, .. } = choice;
        Self { part: *part, reference: *reference, at: target.position, why, jammed }
    }
}

/// A detour: a kind of recovery with a part.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Detour {
    pub kind: RecoveryKind,
    pub part: usize,
    /// Whether the part must lie afterwards as parts of its kind lay when they were found.
    pub strict: bool,
    pub why: String,
}

/// What the ladder knows of the scene.
pub(super) struct View<'v> {
    pub scene: &'v Scene,
    pub seen: &'v Seen,
    /// For each part, whether it is in no state.
    pub in_no_state: &'v [bool],
    /// For each part, the pose in which it was first seen.
    pub homes: &'v [Option<Pose>],
}

/// Horizontal distance within which a part lies at a target, in metres.
const AT_M: f64 = 0.035;
/// Horizontal distance within which a part is beside another one, so that the hand may lack room, in metres.
const BESIDE_M: f64 = 0.075;
/// Horizontal distance within which, and height above which, a part rests on another one, in metres.
const ON_TOP_M: (f64, f64) = (0.02, 0.008);
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

    /// Returns the id of a part.
    pub fn name(&self, part: usize) -> String {
        means::name(self.scene, part)
    }

    /// Returns whether a part lies otherwise than parts of its kind lay when they were found, such as on its edge.
    fn lies_ill(&self, part: usize) -> bool {
        let pose = self.scene.part(part);
        pose.is_some_and(|pose| !means::lies_well(self.scene, part, &pose, self.homes))
    }

    fn loose(&self, part: usize) -> bool {
        self.in_no_state.get(part).copied().unwrap_or(false)
    }

    /// Returns whether the robot can lift a part away.
    fn free(&self, part: usize) -> bool {
        self.scene.slider(part).is_none()
    }

    /// Returns whether another part rests on a part.
    fn bears(&self, part: usize) -> bool {
        let Some(at) = self.at(part) else { return false };
        self.parts().any(|(other, own)| {
            let above = own[2] - at[2] > ON_TOP_M.1;
            other != part && above && (own[0] - at[0]).hypot(own[1] - at[1]) < ON_TOP_M.0
        })
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

    /// Returns the parts in no state that lie at a target; with `wide`, also those beside it.
    pub fn wrongly_at(&self, wanted: &Wanted, wide: bool) -> Vec<usize> {
        let except: Vec<usize> = [wanted.part].into_iter().chain(wanted.reference).collect();
        let within_m = if wide { BESIDE_M } else { AT_M };
        let mut near = self.near(wanted.at, within_m, &except);
        near.retain(|part| self.loose(*part));
        near
    }
}

/// Collects detours, each kind once for each part.
struct List<'v> {
    view: &'v View<'v>,
    all: Vec<Detour>,
}

impl List<'_> {
    fn add(&mut self, kind: RecoveryKind, part: usize, strict: bool, why: String) {
        let same = |d: &Detour| d.kind == kind && d.part == part && d.strict == strict;
        let seen = self.view.at(part).is_some() && !self.view.bears(part);
        if seen && self.view.free(part) && !self.all.iter().any(same) {
            self.all.push(Detour { kind, part, strict, why });
        }
    }

    /// Adds the references: they may lie wrongly although their state says otherwise.
    fn reseat_references(&mut self, wanted: &[Wanted]) {
        for w in wanted {
            if let Some(reference) = w.reference {
                let why = format!("{}; {} may lie wrongly", w.why, self.view.name(reference));
                self.add(RecoveryKind::Reseat, reference, false, why);
            }
        }
    }

    /// Adds the parts that lie around the targets.
    fn clear_targets(&mut self, wanted: &[Wanted]) {
        let targets: Vec<usize> =
            wanted.iter().flat_map(|w| [Some(w.part), w.reference]).flatten().collect();
        for w in wanted {
            for part in self.view.near(w.at, BESIDE_M, &targets) {
                let name = self.view.name(w.part);
                let why = format!("it lies where {name} is to be put; {}", w.why);
                self.add(RecoveryKind::Clear, part, false, why);
            }
        }
    }
}

/// Lists the detours that move parts away whose states forbid a fact. Each part comes with the name of the fact.
pub(super) fn clearing(view: &View<'_>, in_the_way: &[(usize, String)]) -> Vec<Detour> {
    let mut list = List { view, all: Vec::new() };
    for strict in [true, false] {
        for (part, fact) in in_the_way {
            let why = format!("{fact} does not hold, and no action causes it");
            list.add(RecoveryKind::Clear, *part, strict, why);
        }
    }
    list.all
}

/// Lists detours in the order in which they are tried. With `stuck`, parts in no state are dealt with even if no action
/// wants them.
pub(super) fn detours(view: &View<'_>, wanted: &[Wanted], stuck: bool) -> Vec<Detour> {
    use RecoveryKind::{Clear, Push, Regrasp, Reseat};
    let mut list = List { view, all: Vec::new() };
    for w in wanted {
        for part in view.wrongly_at(w, true) {
            let name = view.name(w.part);
            let why = format!("it is in no state and lies where {name} is to be put");
            list.add(Reseat, part, false, why);
        }
    }
    // The parts to be dealt with, each with the reason.
    let mut handled: Vec<(usize, String)> = Vec::new();
    for w in wanted {
        if !handled.iter().any(|(part, _)| *part == w.part) {
            handled.push((w.part, w.why.clone()));
        }
    }
    let jammed: Vec<Wanted> = wanted.iter().filter(|w| w.jammed).cloned().collect();
    list.reseat_references(&jammed);
    list.clear_targets(&jammed);
    // If none of several parts can be put there, the reason is probably near the target.
    if handled.len() > 1 {
        list.clear_targets(wanted);
    }
    let loose = view.parts().map(|(part, _)| part).filter(|part| stuck && view.loose(*part));
    for part in loose {
        if !handled.iter().any(|(own, _)| *own == part) {
            handled.push((part, "it is in no state that an action can use".into()));
        }
    }
    for (part, why) in &handled {
        list.add(Regrasp, *part, true, why.clone());
        if view.lies_ill(*part) {
            list.add(Push, *part, false, why.clone());
        }
    }
    list.clear_targets(wanted);
    for (part, _) in &handled {
        let Some(at) = view.at(*part) else { continue };
        let except: Vec<usize> = handled.iter().map(|(part, _)| *part).collect();
        for other in view.near(at, BESIDE_M, &except) {
            let why = format!("it lies beside {}, which could not be taken", view.name(*part));
            list.add(Clear, other, false, why);
        }
    }
    list.reseat_references(wanted);
    for (part, why) in &handled {
        list.add(Regrasp, *part, false, why.clone());
        list.add(Push, *part, false, why.clone());
    }
    list.all
}
