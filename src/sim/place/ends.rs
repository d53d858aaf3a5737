//! What processes tell one another when they end, and what is told to the user then.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

/// Why a process failed.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Failure {
    /// Exit code.
    pub code: u8,
    /// What to tell the user, in one sentence.
    pub sentence: String,
}

/// What a process tells the others when it ends.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(in crate::sim) struct End {
    /// Number of exchanges that it took part in.
    pub exchanges: u64,
    pub failure: Option<Failure>,
    /// Whether it knew of the end or the fault of another process, so that its failure may only follow from that.
    pub told: bool,
}

/// Returns the exit code of all `ranks` processes, and the sentences to tell.
///
/// A failure that all processes have is told once. Otherwise the sentences name the processes; those of processes that
/// only follow others are left out.
pub(in crate::sim) fn verdict(ranks: usize, ends: &BTreeMap<usize, End>) -> (u8, Vec<String>) {
    let failed = |told: bool| {
        ends.iter()
            .filter(move |(_, end)| told || !end.told)
            .filter_map(|(rank, end)| end.failure.as_ref().map(|failure| (*rank, failure)))
            .collect::<Vec<_>>()
    };
    let mut failures = failed(false);
    if failures.is_empty() {
        failures = failed(true);
    }
    let Some((_, first)) = failures.first() else { return (0, Vec::new()) };
    if failures.len() == ranks {
        return (first.code, vec![first.sentence.clone()]);
    }
    let mut sentences = Vec::new();
    let mut known: Vec<&str> = Vec::new();
    for (rank, failure) in &failures {
        if !known.contains(&&*failure.sentence) {
            known.push(&failure.sentence);
            sentences.push(format!("rank {rank}: {}", failure.sentence));
        }
    }
    (first.code, sentences)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A rank, its failure, and whether it was told of another.
    type Ended<'a> = (usize, Option<(u8, &'a str)>, bool);

    fn told(ranks: usize, ends: &[Ended<'_>]) -> (u8, Vec<String>) {
        let end = |(rank, failure, told): &Ended<'_>| {
            let failure =
                failure.map(|(code, sentence)| Failure { code, sentence: sentence.into() });
            (*rank, End { exchanges: 3, failure, told: *told })
        };
        verdict(ranks, &ends.iter().map(end).collect())
    }

    #[test]
    fn a_failure_of_all_is_told_once_and_a_failure_of_some_with_its_rank() {
        let bad = Some((2, "bad seed"));
        assert_eq!(told(2, &[(0, None, false), (1, None, false)]), (0, vec![]));
        let all = [(0, bad, false), (1, bad, false)];
        assert_eq!(told(2, &all), (2, vec!["bad seed".into()]));
        // The third rank has not ended yet.
        assert_eq!(told(3, &all), (2, vec!["rank 0: bad seed".into()]));
        let some = [(0, None, false), (1, bad, false), (2, Some((1, "full disk")), false)];
        assert_eq!(
            told(3, &some),
            (2, vec!["rank 1: bad seed".into(), "rank 2: full disk".into()])
        );
    }

    #[test]
    fn a_failure_that_follows_another_is_not_told() {
        let follows = Some((1, "rank 1 stopped: full disk"));
        let ends = [(0, follows, true), (1, Some((3, "full disk")), false), (2, follows, true)];
        assert_eq!(told(3, &ends), (3, vec!["rank 1: full disk".into()]));
        // Rank 1 just ended too early.
        let ends = [(0, Some((1, "rank 1 has ended")), true), (1, None, false)];
        assert_eq!(told(2, &ends), (1, vec!["rank 0: rank 1 has ended".into()]));
    }
}
