//! Carrying out a decision: finds a part, a grasp and a target that work, and goes down the ladder of recovery if none
//! do.
//!
//! 1. The choices of the model, the best first: other parts and other places come after those that failed. Each is tried
//!    by the task's grasps, those that failed last; then by any other grasp.
//! 2. Another order: the graph is asked again as if the action were done already. What it decides then is carried out
//!    if its preconditions hold in fact.
//! 3. The detours of [`recovery`](super::recovery).
//!
//! If nothing is left, the episode ends.

use rand::RngExt;

use super::live::{Live, Phase, REST, Tools};
use super::model::{Choice, Seen};
use super::recovery::attempts::{Attempt, Intent, Means};
use super::recovery::places;
use super::recovery::plight::Wanted;
use crate::robot::Pose;
use crate::robot::skill::{self, Grasp, Target};
use crate::task::event::{Ended, Recovery, RecoveryKind};
use crate::task::propositional::{ActionId, Obstacle};

/// Number of other orders that are asked for before a detour.
const ORDERS: usize = 3;
/// A family of means.
type Family = fn(usize) -> Means;

/// A reason not to carry out a choice, found while going through the choices.
struct Skipped {
    what: Intent,
    why: String,
    /// Whether the choice was not tried because another part lies wrongly at its target.
    untried: bool,
    /// Whether it failed because of something at its target.
    jammed: bool,
}

impl Live {
    /// Carries out a decided action, or a recovery.
    pub fn act(&mut self, tools: &Tools<'_>, action: ActionId) -> Phase {
        let seen = self.cell.look();
        if tools.model.look(&seen, &mut self.memory).present != self.present {
            // The world state changed while the graph was deciding.
            self.pretended.clear();
            return Phase::Rest { left: REST };
        }
        let operator = &tools.model.planner.domain()[action];
        let first = self.pretended.is_empty();
        let again = self.pretended.contains(&operator.to);
        let holds = operator.preconditions.iter().all(|state| self.present.holds(*state));
        let choices = match first || (holds && !again) {
            true => tools.model.choices(action, self.memory.as_ref(), &self.attempts),
            false => Vec::new(),
        };
        let mut skipped = Vec::new();
        if let Some(phase) = self.take(tools, &seen, &choices, &mut skipped, true) {
            return phase;
        }
        if first {
            let wanted = choices.iter().map(|c| {
                let (why, jammed) = reason(&skipped, &c.what);
                Wanted::of(c, why, jammed)
            });
            self.wanted = wanted.collect();
            self.impossible = Some(operator.name.clone());
        }
        if skipped.iter().any(|s| s.untried) {
            // A part that lies wrongly at a target is taken out before anything is put there.
            let out = self.reseat(tools, &seen);
            let out = out.or_else(|| self.take(tools, &seen, &choices, &mut skipped, false));
            if let Some(phase) = out {
                return phase;
            }
        }
        if self.pretended.len() < ORDERS && !again {
            self.pretended.push(operator.to);
            return Phase::Rest { left: REST };
        }
        self.recover(tools, None)
    }

    /// Returns how the episode ends if nothing is left to try.
    pub fn given_up(&self, stuck: Option<Obstacle>) -> Ended {
        let objects = self.lost();
        match (&self.impossible, stuck) {
            (None, _) if !objects.is_empty() => Ended::Lost { objects },
            (Some(action), _) => Ended::NoWay { action: action.clone() },
            (None, Some(obstacle)) => Ended::Stuck(obstacle),
            (None, None) => Ended::GaveUp,
        }
    }

    /// Returns the ids of the parts that fell off the table.
    pub fn lost(&self) -> Vec<String> {
        let sensed = self.cell.sensed();
        let lost = (0..sensed.part_count()).filter(|part| sensed.lost(*part));
        lost.map(|part| places::id(&sensed, part)).collect()
    }

    /// Begins the first choice that works. With `careful`, choices at whose target another part lies wrongly are left
    /// untried; without, only those are tried.
    fn take(
        &mut self,
        tools: &Tools<'_>,
        seen: &Seen,
        choices: &[Choice],
        skipped: &mut Vec<Skipped>,
        careful: bool,
    ) -> Option<Phase> {
        let untried = |s: &&Skipped| s.untried;
        let left: Vec<Intent> = skipped.iter().filter(untried).map(|s| s.what.clone()).collect();
        for any in [false, true] {
            let family: Family = if any { Means::Any } else { Means::Task };
            for choice in choices {
                if !careful && !left.contains(&choice.what) {
                    continue;
                }
                let name = places::name(&self.cell.sensed(), choice.part);
                let mut skip = |why: String, untried: bool, jammed: bool| {
                    skipped.push(Skipped { what: choice.what.clone(), why, untried, jammed });
                };
                if let Some(how) = self.attempts.worn_out(&choice.what, family) {
                    let why = format!("again and again, {name} {}", how.text());
                    skip(why, false, how.is_about_target());
                    continue;
                }
                let plight = self.plight(seen);
                let wide = self.attempts.occupied(&choice.what) > 0;
                let wrong = plight.wrongly_at(&Wanted::of(choice, String::new(), wide), wide);
                if let Some(other) = wrong.first().filter(|_| careful) {
                    let other = plight.name(*other);
                    skip(format!("{other} lies wrongly where {name} was to go"), true, wide);
                    continue;
                }
                let begun = self.begin(tools, &choice.what, choice.part, choice.target, any);
                let Some(means) = begun else {
                    let which =
                        if any { "no grasp was found that" } else { "none of the task's grasps" };
                    let why = format!("{which} can take {name} and put it where it was to go");
                    skip(why, false, false);
                    continue;
                };
                let recovery = self.recovery(tools, choice, choices, means, skipped);
                self.note(&choice.what, means, Some(choice.target.position));
                if let Some(decided) = self.log.decisions.last_mut() {
                    decided.chosen = Some(choice.chosen.clone());
                    decided.words = Some(choice.words.clone());
                    decided.recovery = recovery;
                }
                self.pretended.clear();
                self.wanted.clear();
                self.impossible = None;
                return Some(Phase::Act);
            }
        }
        None
    }

    /// Begins to take a part and put it at a target, by the task's grasps or by any other. Returns the grasp.
    pub fn begin(
        &mut self,
        tools: &Tools<'_>,
        what: &Intent,
        part: usize,
        target: Target,
        any: bool,
    ) -> Option<Means> {
        let sensed = self.cell.sensed();
        let (grasps, family): (Vec<Grasp>, Family) = match any {
            false => (tools.spec.task.grasps(&sensed, part), Means::Task),
            true => (skill::any_grasps(&sensed, part), Means::Any),
        };
        let start = sensed.part(part)?;
        let usable = self.attempts.usable(what, &start, grasps.len(), family);
        let list: Vec<Grasp> = usable.iter().map(|index| grasps[*index]).collect();
        if list.is_empty() {
            return None;
        }
        let drop_at = self.draw_drop(tools.spec.drop_rate);
        let at = self.cell.begin(part, target, &list, drop_at)?;
        Some(family(usable.get(at).copied().unwrap_or(0)))
    }

    /// Remembers an attempt that begins. `at` is where its part is to be put; a detour has no such place.
    pub fn note(&mut self, what: &Intent, means: Means, at: Option<[f64; 3]>) {
        let start = self.cell.sensed().part(what.part).unwrap_or(Pose::at([0.0; 3]));
        let layout = self.memory.as_ref();
        let target = what.reference.as_deref().and_then(|id| layout?.pose(id).copied());
        let attempt = Attempt::begun(what.clone(), means, start, at.is_none());
        self.attempts.begin(Attempt { at, target, ..attempt });
    }

    /// Describes how a choice differs from what was tried before; `None` if it is the decided action as usual.
    fn recovery(
        &self,
        tools: &Tools<'_>,
        choice: &Choice,
        choices: &[Choice],
        means: Means,
        skipped: &[Skipped],
    ) -> Option<Recovery> {
        let object = places::id(&self.cell.sensed(), choice.part);
        let name = places::name(&self.cell.sensed(), choice.part);
        let attempt = self.attempts.taken(choice.part) + 1;
        let recovery = |kind, why: String| {
            let (object, name) = (object.clone(), name.clone());
            Some(Recovery { kind, object, name, why, attempt })
        };
        let differs = |other: &Intent| match other.part == choice.part {
            true => RecoveryKind::Place,
            false => RecoveryKind::Part,
        };
        // Of two references, the one comes first to which the part was brought less often.
        let brought_before = |other: &Intent| {
            let there = Intent { part: choice.part, ..other.clone() };
            let apart = other.reference != choice.what.reference;
            if !apart || self.attempts.tries(&there) <= self.attempts.tries(&choice.what) {
                return None;
            }
            let mut names = tools.model.ground.object_names();
            let (_, at) = names.find(|(id, _)| Some(*id) == other.reference.as_deref())?;
            Some(format!("{name} was to go to {at} before"))
        };
        let elsewhere = |other: &Intent, why: String| {
            let before = brought_before(other).filter(|_| other.part != choice.part);
            before.map_or_else(|| why.clone(), |before| format!("{why}; {before}"))
        };
        if !self.pretended.is_empty() {
            let why = self.wanted.first().map(|w| w.why.clone());
            let why = why.unwrap_or_else(|| "the decided action cannot be carried out now".into());
            return recovery(RecoveryKind::Order, why);
        }
        if let Some(first) = skipped.iter().find(|s| s.what != choice.what) {
            return recovery(differs(&first.what), elsewhere(&first.what, first.why.clone()));
        }
        // What fell to where it belongs is no reason to take the next.
        let there = |a: &&Attempt| tools.model.took_effect(&a.what, self.memory.as_ref());
        let last = self.attempts.last().filter(|a| {
            !a.detour && a.what.action == choice.what.action && (a.what == choice.what || !there(a))
        });
        if let Some((last, how)) = last.and_then(|a| Some((a, a.failure_in_words()?))) {
            let why = format!("{} {how}", places::name(&self.cell.sensed(), last.what.part));
            if last.what != choice.what {
                return recovery(differs(&last.what), elsewhere(&last.what, why));
            }
            let other = last.means != means;
            return recovery(if other { RecoveryKind::Grasp } else { RecoveryKind::Again }, why);
        }
        let mut own = choices.iter().filter(|other| other.part == choice.part);
        if let Some(why) = own.find_map(|other| brought_before(&other.what)) {
            return recovery(RecoveryKind::Place, why);
        }
        match means {
            Means::Any(_) => {
                recovery(RecoveryKind::Grasp, "the task names none that is possible".into())
            }
            _ => None,
        }
    }

    /// Draws whether and when the next skill drops its part, from the seed and the number of skills so far.
    fn draw_drop(&self, rate: f64) -> Option<f64> {
        let mut rng = self.seed.derive_index("drop", self.log.skill_count() as u64).rng();
        let (chance, share): (f64, f64) = (rng.random(), rng.random());
        (chance < rate).then_some(share)
    }
}

/// Returns why a choice was not carried out, the last reason found, and whether something at its target is the reason.
fn reason(skipped: &[Skipped], what: &Intent) -> (String, bool) {
    let own = || skipped.iter().filter(|s| s.what == *what);
    let why = own().next_back().map_or_else(|| "it was not possible".into(), |s| s.why.clone());
    (why, own().any(|s| s.jammed))
}
