//! Begins detours.

use super::attempts::{Intent, Means};
use super::plight::{Plight, Wanted};
use super::rung::Detour;
use super::{detours, places};
use crate::robot::Pose;
use crate::robot::skill;
use crate::task::event::{Recovery, RecoveryKind};
use crate::task::execute::live::{Live, Phase, REST, Tools};
use crate::task::execute::model::Seen;
use crate::task::propositional::Obstacle;

/// Speed above which a part is not at rest, in metres per second.
const MOVES_M_S: f64 = 0.02;
/// Number of detours of an episode, and more for each part.
const DETOURS: (usize, usize) = (6, 3);

impl Live {
    /// Returns what the recoveries know of the scene.
    pub fn plight<'v>(&'v self, seen: &'v Seen) -> Plight<'v> {
        let Self { in_no_state, as_found, attempts, homes, wanted, .. } = self;
        let (sensed, in_the_way, stuck) = (self.cell.sensed(), &[], false);
        Plight { sensed, seen, in_no_state, as_found, attempts, homes, wanted, in_the_way, stuck }
    }

    /// Recovers where no action can be carried out, or where the planner is stuck; ends the episode if nothing is left.
    pub fn recover(&mut self, tools: &Tools<'_>, stuck: Option<Obstacle>) -> Phase {
        let seen = self.cell.look();
        let mut in_the_way = match stuck {
            Some(Obstacle::NothingCauses { state }) => {
                tools.model.in_the_way(state, self.memory.as_ref())
            }
            _ => Vec::new(),
        };
        // A pin may have to be lifted out of its ring, or the ring off the pin.
        in_the_way.sort_by_key(|(part, _)| {
            self.attempts.tries(&Intent::detour(RecoveryKind::Clear, *part))
        });
        let all = detours(&Plight { in_the_way: &in_the_way, stuck: true, ..self.plight(&seen) });
        self.pretended.clear();
        for detour in all {
            if let Some(phase) = self.detour(tools, &detour) {
                return phase;
            }
        }
        match self.cell.sensed().is_still(MOVES_M_S) {
            // A part that still falls or rolls may come to be in a state, or be lost.
            Some(false) => Phase::Rest { left: REST },
            _ => Phase::Over(self.given_up(stuck)),
        }
    }

    /// Takes out a part that lies wrongly at a wanted target.
    pub fn reseat(&mut self, tools: &Tools<'_>, seen: &Seen) -> Option<Phase> {
        let plight = self.plight(seen);
        let lies = |w: &Wanted, part| plight.wrongly_at(w, true).contains(&part);
        let wrongly = |part| plight.wanted.iter().any(|w| lies(w, part));
        let lies_wrongly = |part: usize| plight.in_no_state[part] || wrongly(part);
        let first = |d: &Detour| d.kind == RecoveryKind::Reseat && lies_wrongly(d.part);
        let all: Vec<Detour> = detours(&plight).into_iter().filter(first).collect();
        all.iter().find_map(|detour| self.detour(tools, detour))
    }

    /// Begins a detour; `None` if it is not possible or was tried often enough.
    fn detour(&mut self, tools: &Tools<'_>, detour: &Detour) -> Option<Phase> {
        let Detour { kind, part, ref why, .. } = *detour;
        let what = Intent::detour(kind, part);
        let start = self.cell.sensed().part(part)?;
        let most = DETOURS.0 + DETOURS.1 * self.in_no_state.len();
        if self.attempts.detours() >= most || !self.attempts.may_detour(&what, &start) {
            return None;
        }
        let begun = match kind {
            RecoveryKind::Push => self.push(&what, &start),
            _ => self.move_away(tools, &what, detour.strict),
        };
        let means = begun?;
        let object = places::id(&self.cell.sensed(), part);
        let name = places::name(&self.cell.sensed(), part);
        let attempt = self.attempts.tries(&what) + 1;
        self.note(&what, means, None);
        if let Some(decided) = self.log.decisions.last_mut() {
            decided.recovery = Some(Recovery { kind, object, name, why: why.clone(), attempt });
        }
        self.pretended.clear();
        self.wanted.clear();
        self.impossible = None;
        Some(Phase::Act)
    }

    /// Begins to put a part at a free place.
    fn move_away(&mut self, tools: &Tools<'_>, what: &Intent, strict: bool) -> Option<Means> {
        let places = places::free_places(&self.cell.sensed(), what.part, &self.homes, strict);
        for any in [false, true] {
            for place in &places {
                if let Some(means) = self.begin(tools, what, what.part, *place, any) {
                    return Some(means);
                }
            }
        }
        None
    }

    /// Begins to push a part.
    fn push(&mut self, what: &Intent, start: &Pose) -> Option<Means> {
        let pushes = skill::pushes(&self.cell.sensed(), what.part);
        let usable = self.attempts.usable(what, start, pushes.len(), Means::Push);
        let first = usable.into_iter().find(|index| self.cell.begin_push(&pushes[*index]));
        first.map(Means::Push)
    }
}
