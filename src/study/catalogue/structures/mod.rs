//! `table-4`: the success rate of a planner with three structures of a state's pointer, by noise (section III.B).
//!
//! A trial is an episode of three steps. It draws a new vocabulary of atoms, states and actions. A state or action has
//! a deep pointer: the normalised sum of its bound pairs. To decide whether the goal is satisfied, the planner decodes
//! the goal's deep pointer part by part and compares the result with the world. If the goal is not satisfied, the
//! planner looks up the action that causes it and unbinds the action's preconditions. The first unsatisfied
//! precondition becomes the goal (sections II.E and II.F).
//!
//! Every retrieved pointer (a deep pointer, the role or object that unbinds it, an item that is compared with the
//! result) and every unbound pointer gets Gaussian noise, of standard deviation sigma / sqrt(D) in each component. The
//! noise depends on the trial, the step, the retrieved pointer, and the number of times it was retrieved. Both decoders
//! thus get the same noise.
//!
//! The paper's decoder is matching pursuit over the vocabulary. It normalises the query and finds the most similar
//! item. If the similarity is at least 0.3, it subtracts the item as retrieved and repeats.
//!
//! Our decoder compares the query with everything that could have been stored, after the same unbinding. It takes the
//! nearest candidate, which is the most likely under white noise. It is not given the number of items. The candidates
//! are computed once from the atoms of the vocabulary; each is retrieved with noise.

mod decoders;
mod episode;
mod noise;
mod world;

use serde_json::json;

use self::episode::episodes;
use self::world::{ATOMS, D, STRUCTURES, Structure};
use crate::sim::Seed;
use crate::study::experiment::{
    About, Axis, Cell, Experiment, Figure, MAX_READINGS, Mark, Measure, Reading, Results, Series,
    Style, TrialOutcome,
};
use crate::task::TaskError;

/// The experiment: three structures at several levels of noise, with one or both decoders.
pub(super) struct Structures {
    name: &'static str,
    sigmas: &'static [f64],
    decoders: [bool; 2],
    trials: u64,
}

/// Table IV of the paper, with both decoders.
pub(super) const TABLE_4: Structures = Structures {
    name: "table-4",
    sigmas: &[0.5, 0.4, 0.3, 0.2, 0.1],
    decoders: [true, true],
    trials: 10_000,
};

/// Our decoder alone, up to a noise at which it fails.
pub(super) const BEYOND: Structures = Structures {
    name: "table-4-beyond",
    sigmas: &[0.25, 0.5, 0.75, 1.0, 1.25, 1.5, 1.75, 2.0],
    decoders: [false, true],
    trials: 2_000,
};

const DECODERS: [&str; 2] = ["paper", "best"];

impl Experiment for Structures {
    fn about(&self) -> About {
        let question = match self.decoders {
            [true, _] => {
                "How often does a planner take three right actions in a row, by noise and structure of the states' pointers?"
            }
            _ => "At which noise does our decoder alone fail to plan three right actions?",
        };
        let settings = json!({"dimensions": D, "atoms": ATOMS, "threshold_of_paper": 0.3});
        About { name: self.name, question, revision: 2, settings }
    }

    fn cells(&self) -> Vec<Cell> {
        STRUCTURES
            .into_iter()
            .flat_map(|structure| self.sigmas.iter().map(move |sigma| (structure, *sigma)))
            .map(|(structure, sigma)| {
                let readings = (0..2)
                    .filter(|d| self.decoders[*d])
                    .map(|d| Reading::new(Measure::Rate, json!({"decoder": DECODERS[d]})))
                    .collect();
                let settings = json!({"structure": structure as u64, "sigma": sigma});
                Cell::new(settings, self.trials, readings)
            })
            .collect()
    }

    fn trial(&self, cell: &Cell, seed: Seed) -> Result<TrialOutcome, TaskError> {
        let (number, sigma) = (cell.number("structure")?, cell.number("sigma")?);
        let own = STRUCTURES.into_iter().find(|structure| f64::from(*structure as u8) == number);
        let Some(structure) = own else { return Ok([f64::NAN; MAX_READINGS]) };
        let mut numbers = [f64::NAN; MAX_READINGS];
        let results = episodes(structure, sigma, seed, self.decoders);
        for (out, result) in numbers.iter_mut().zip(results.into_iter().flatten()) {
            *out = if result { 1.0 } else { 0.0 };
        }
        Ok(numbers)
    }

    fn figure(&self, results: &Results) -> Option<Figure> {
        let marks = |decoder: &str, structure: Structure| -> Vec<Mark> {
            let wanted = json!({"decoder": decoder, "structure": structure as u64});
            results.marks(&wanted, |row| Some(row.percent(row.number("sigma")?)))
        };
        let mut series = Vec::new();
        for (decoder, whose) in DECODERS.iter().zip(["paper's decoder", "our decoder"]) {
            let of_structures = STRUCTURES.map(|structure| (structure, marks(decoder, structure)));
            // If no structure ever fails, the three lines would coincide.
            let same = |marks: &[Mark]| marks.iter().all(|m| m.y == 100.0);
            if of_structures.iter().all(|(_, marks)| !marks.is_empty() && same(marks)) {
                let [(_, marks), ..] = of_structures;
                let name = format!("all structures, {whose}");
                series.push(Series::new(name, marks, Style::Line));
                continue;
            }
            for (structure, marks) in of_structures {
                if !marks.is_empty() {
                    let name = format!("structure {}, {whose}", structure as u64);
                    series.push(Series::new(name, marks, Style::Line));
                }
            }
        }
        Some(Figure {
            title: "Episodes of three right actions".into(),
            x: Axis::new("noise sigma (length of the noise of a pointer of length 1)"),
            y: Axis::from_to("success (%)", 0.0, 102.0),
            series,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::noise::{Noise, Source};
    use super::*;
    use crate::spa::norm;

    fn rate(structure: Structure, sigma: f64, trials: u64) -> [f64; 2] {
        let mut good = [0.0; 2];
        for trial in 0..trials {
            let seed = Seed::new(1).derive_index("trial", trial);
            for (good, result) in good.iter_mut().zip(episodes(structure, sigma, seed, [true; 2])) {
                *good += if result == Some(true) { 1.0 } else { 0.0 };
            }
        }
        good.map(|g| g / trials as f64)
    }

    #[test]
    fn without_noise_our_decoder_never_fails_and_with_much_both_do() {
        for structure in STRUCTURES {
            let [paper, best] = rate(structure, 0.0, 60);
            assert!(paper > 0.9 && best == 1.0, "{structure:?}: {paper} {best}");
            let [paper, best] = rate(structure, 4.0, 40);
            assert!(paper < 0.2 && best < 0.6, "{structure:?}: {paper} {best}");
        }
    }

    #[test]
    fn the_length_of_the_noise_is_sigma() {
        let mut noise = Noise::new(Seed::new(3), 0.0);
        let vector = vec![0.25; D];
        assert_eq!(noise.onto(Source::Deep(2), &vector), vector);
        let mut noise = Noise::new(Seed::new(3), 0.5);
        let noisy = noise.onto(Source::Deep(2), &vector);
        let length = norm(&noisy.iter().zip(&vector).map(|(a, b)| a - b).collect::<Vec<_>>());
        // The length of 256 components varies by 4%.
        assert!((length - 0.5).abs() < 0.1, "{length}");
    }

    #[test]
    fn noise_depends_on_the_source_the_repetition_and_the_step() {
        let vector = vec![0.0; D];
        let (mut a, mut b) = (Noise::new(Seed::new(3), 0.5), Noise::new(Seed::new(3), 0.5));
        // The noise of another source does not matter.
        b.onto(Source::Role(1, 7), &vector);
        let first = a.onto(Source::Deep(2), &vector);
        assert_eq!(first, b.onto(Source::Deep(2), &vector));
        assert_ne!(first, a.onto(Source::Deep(2), &vector));
        a.next_step();
        assert_ne!(first, a.onto(Source::Deep(2), &vector));
    }
}
