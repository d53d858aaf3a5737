//! The text of `symbolt merge --status`: shards and cells with their missing trials.

use symbolt::study::experiment::{Shard, ShardState, ShardStatus, Status};

use crate::cli::table::{Grid, counted, unbroken, wrapped};

/// Greatest number of trials that a row lists. `--json` lists all.
const LISTED: usize = 12;

/// Returns the tables of shards and cells. The last line, `Rerun: 2,5,7`, is for scripts.
pub(super) fn described(status: &Status) -> String {
    let (done, all) = (status.done(), status.trials());
    let title = format!(
        "{} with seed {}: {done} of {all} trials are done.",
        status.experiment,
        status.seed.value()
    );
    let mut text = format!("{}\n\n", wrapped(&title, 0));
    let mut grid = Grid::new(&["shard", "folder", "state", ">done", ">trials"]);
    for shard in &status.shards {
        let folder = shard.folder.as_ref();
        let folder = folder.map_or("not given".into(), |folder| folder.display().to_string());
        let counts = [shard.done, shard.trials].map(|count| match shard.shard {
            Some(_) => count.to_string(),
            None => "?".into(),
        });
        let row = [name(shard.shard), folder, shard.state.name().into()];
        grid.row(row.into_iter().chain(counts));
    }
    text += &format!("{grid}\n");
    for shard in &status.shards {
        if let Some(sentence) = advice(shard) {
            text += &format!("{}\n\n", wrapped(&sentence, 0));
        }
    }
    let mut grid = Grid::new(&["cell", ">done", ">trials"]);
    for cell in status.cells.iter().filter(|cell| cell.done < cell.trials) {
        grid.row([cell.to_string(), cell.done.to_string(), cell.trials.to_string()]);
    }
    if !grid.is_empty() {
        text += &format!("Cells with missing trials:\n\n{grid}\n");
    }
    let mut grid = Grid::new(&["shard", "cell", ">missing", "trials, counted from 0"]);
    for shard in &status.shards {
        if shard.done == 0 && shard.trials > 0 {
            grid.row([name(shard.shard), "all".into(), shard.trials.to_string(), "all".into()]);
            continue;
        }
        for missing in &shard.missing {
            let cell = status.cells.get(missing.cell).map(ToString::to_string).unwrap_or_default();
            let count = missing.trials.len().to_string();
            grid.row([name(shard.shard), cell, count, listed(&missing.trials)]);
        }
    }
    if !grid.is_empty() {
        text += &format!("Missing trials of each shard:\n\n{grid}\n");
    }
    if let Some(rerun) = status.rerun().filter(|rerun| !rerun.is_empty()) {
        let numbers: Vec<String> = rerun.iter().map(u64::to_string).collect();
        text += &format!("Rerun: {}\n", numbers.join(","));
    }
    text
}

fn name(shard: Option<Shard>) -> String {
    shard.map_or("?".into(), |shard| shard.to_string())
}

/// Returns the first trials and the number of the others.
fn listed(trials: &[u64]) -> String {
    let shown: Vec<String> = trials.iter().take(LISTED).map(u64::to_string).collect();
    match trials.len().saturating_sub(LISTED) {
        0 => shown.join(", "),
        more => format!("{} and {more} more", shown.join(", ")),
    }
}

/// Returns a sentence on a folder that a rerun alone does not mend.
fn advice(shard: &ShardStatus) -> Option<String> {
    let folder = shard.folder.as_ref()?.display();
    let part = name(shard.shard);
    match shard.state {
        ShardState::Damaged => Some(format!(
            "{folder}: {} damaged; rerun it with `--shard {} --salvage`, which keeps the intact trials.",
            match shard.damaged_bytes {
                1 => "1 byte is".into(),
                bytes => format!("{} are", counted(bytes, "byte")),
            },
            unbroken(&part)
        )),
        ShardState::Unreadable => {
            Some(format!("{folder}: {}", shard.reason.as_deref().unwrap_or("it cannot be read")))
        }
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_lists_of_trials_are_cut_and_short_ones_are_not() {
        let trials: Vec<u64> = (0..14).collect();
        assert_eq!(listed(&trials[..2]), "0, 1");
        assert_eq!(listed(&trials[..12]), "0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11");
        assert!(listed(&trials).ends_with("10, 11 and 2 more"));
    }
}
