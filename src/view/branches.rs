//! Branches: what a run had done before a window went back and changed something.
//!
//! A branch is a mark at its end. It is kept when the present run leaves its path, and a window can return to it; the run that it
//! then leaves is kept in its place. At most four are kept, each with one checkpoint.

use serde_json::{Value, json};

use crate::sim::{Live, Mark};

/// Greatest number of branches. The oldest gives way.
const MOST: usize = 4;

struct Branch {
    id: u32,
    /// Its end.
    mark: Mark,
    /// The tick at which it parts from the present run.
    parted: u64,
}

/// See the module.
#[derive(Default)]
pub(super) struct Branches {
    /// The latest moment of the present path that a window has left by going back.
    left: Option<Mark>,
    kept: Vec<Branch>,
    last_id: u32,
    /// Number of returns to a branch, and the branch of the last one.
    turns: (u32, u32),
}

impl Branches {
    /// Notes where a run stands that is about to go back. A run that has failed leaves nothing.
    pub fn leave(&mut self, live: &Live) {
        if self.left.as_ref().is_none_or(|left| left.tick() < live.tick()) {
            self.left = live.mark().ok().or(self.left.take());
        }
    }

    /// Keeps what was left as a branch: at this tick the run takes another path.
    pub fn part(&mut self, tick: u64) {
        let Some(mark) = self.left.take().filter(|left| left.tick() > tick) else { return };
        if self.kept.len() == MOST {
            self.kept.remove(0);
        }
        self.last_id += 1;
        self.kept.push(Branch { id: self.last_id, mark, parted: tick });
    }

    /// Returns to the end of a branch. Returns the tick at which it had parted. The error is a sentence; the run stands where it
    /// stood then.
    pub fn turn(&mut self, id: u32, live: &mut Live) -> Result<u64, String> {
        let at = self.kept.iter().position(|branch| branch.id == id);
        let at = at.ok_or_else(|| format!("there is no branch {id}"))?;
        let here = live.mark().map_err(|error| error.to_string())?;
        live.return_to(&self.kept[at].mark).map_err(|error| error.to_string())?;
        let parted = self.kept[at].parted;
        self.kept[at].mark = here;
        // The others part from this path where they part from the old one, or where the old one does.
        self.kept.iter_mut().for_each(|branch| branch.parted = branch.parted.min(parted));
        self.left = None;
        self.turns = (self.turns.0 + 1, id);
        Ok(parted)
    }

    /// Returns what windows are told.
    pub fn told(&self) -> Value {
        let one = |branch: &Branch| {
            let (end, changes) = (branch.mark.tick(), branch.mark.log().len());
            json!({ "id": branch.id, "parted": branch.parted, "end": end, "changes": changes })
        };
        let all: Vec<Value> = self.kept.iter().map(one).collect();
        json!({ "branches": { "all": all, "turns": self.turns.0, "last": self.turns.1 } })
    }
}
