//! `capacity`: the rate at which the right filler is decoded from a sum of bound pairs, compared with a prediction.
//!
//! A trial draws K roles and a vocabulary of M items; K of the items are the fillers. The trial sums the bound pairs,
//! adds noise of standard deviation sigma / sqrt(D) to each component, unbinds the first role, and takes the most
//! similar item. Items are uniform on the unit sphere. Roles are Gaussian or unitary and have length 1.
//!
//! The prediction is computed as follows. Let q be the unbound pointer and c its dot product with the right filler. If
//! another filler scores above c, the answer is wrong. Otherwise it is right if none of the other M - K items scores
//! above c. The probability of this is `F((1 + c / |q|) / 2)^(M - K)`. Here F is the distribution function of the beta
//! distribution `Beta((D - 1) / 2, (D - 1) / 2)`, which is the distribution of `(1 + cosine) / 2` for directions
//! uniform on the sphere. The prediction is the mean of this probability over q, so each trial returns the probability
//! for its own q.
//!
//! The table also has the large-D formula (Plate 1995, appendix; Frady, Kleyko and Sommer 2018):
//! `integral of phi(h) Phi(s + h)^(M - 1)` with the signal-to-noise ratio `s = sqrt(D / (K + 1 + sigma^2))`, or
//! `sqrt(D / (K + sigma^2))` for unitary roles.
//!
//! The decoder named `best` knows all roles and subtracts the estimated interference; see [`PairDecoder`].

use rand_distr::{Distribution, StandardNormal};
use serde_json::json;
use statrs::distribution::{Beta, Continuous, ContinuousCDF, Normal};

use crate::sim::{Real, Seed};
use crate::spa::{Algebra, Hrr, PairDecoder, dot, dots, draw_pointer, norm};
use crate::study::experiment::{
    About, Axis, Cell, Experiment, Figure, Mark, Measure, Reading, Results, Row, Series, Style,
    TrialOutcome, outcome,
};
use crate::task::TaskError;

/// A combination of sizes and noise.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Size {
    dimensions: usize,
    bound: usize,
    items: usize,
    sigma: f64,
    unitary: bool,
}

/// Returns the sizes of all cells.
fn sizes() -> Vec<Size> {
    let mut sizes = Vec::new();
    for dimensions in [32, 64, 128, 256] {
        for bound in [2, 4, 8, 16] {
            let drawn = [(16, 0.0), (64, 0.0), (64, 1.0), (256, 0.0)];
            for (items, sigma) in drawn.into_iter().filter(|(items, _)| *items != bound) {
                sizes.push(Size { dimensions, bound, items, sigma, unitary: false });
            }
        }
        sizes.push(Size { dimensions, bound: 4, items: 64, sigma: 0.0, unitary: true });
        sizes.push(Size { dimensions, bound: 4, items: 64, sigma: 1.0, unitary: true });
    }
    sizes
}

/// The experiment.
pub(super) struct Capacity;

/// Evaluates the large-D formula by the trapezoidal rule.
fn gaussian(size: &Size) -> f64 {
    let Size { dimensions, bound, items, sigma, unitary } = *size;
    let own = if unitary { 0.0 } else { 1.0 };
    let signal = (dimensions as f64 / (bound as f64 + own + sigma * sigma)).sqrt();
    let normal = Normal::standard();
    let step = 0.01;
    (-800..=800)
        .map(|i| {
            let h = f64::from(i) * step;
            step * normal.pdf(h) * normal.cdf(signal + h).powi(items as i32 - 1)
        })
        .sum()
}

/// Returns the index of the item with the greatest dot product with a query. Each row of `items` is an item.
fn best(items: &[Real], query: &[Real], similarities: &mut [Real]) -> usize {
    dots(items, query, similarities);
    let scored = similarities.iter().enumerate();
    scored.max_by(|a, b| a.1.total_cmp(b.1)).map_or(0, |(index, _)| index)
}

impl Size {
    fn trial(&self, seed: Seed) -> Result<TrialOutcome, TaskError> {
        let Self { dimensions: dim, bound, items, sigma, unitary } = *self;
        let mut rng = seed.rng();
        let mut work = Hrr.scratch(dim);
        let roles: Vec<Vec<Real>> = (0..bound)
            .map(|_| {
                let mut role = draw_pointer(dim, &mut rng);
                if unitary {
                    Hrr.make_unitary(&mut role, &mut work);
                }
                role
            })
            .collect();
        // The first items are the fillers.
        let vocabulary: Vec<Vec<Real>> = (0..items).map(|_| draw_pointer(dim, &mut rng)).collect();
        let (rows, mut scores) = (vocabulary.concat(), vec![0.0; items]);
        let sd = (sigma / (dim as f64).sqrt()) as Real;
        let mut trace: Vec<Real> =
            (0..dim).map(|_| -> f32 { StandardNormal.sample(&mut rng) }).map(|z| sd * z).collect();
        let (mut pair, mut inverse) = (vec![0.0; dim], vec![0.0; dim]);
        for (role, filler) in roles.iter().zip(&vocabulary) {
            Hrr.bind_into(role, filler, &mut pair, &mut work);
            trace.iter_mut().zip(&pair).for_each(|(t, p)| *t += p);
        }
        let mut unbound = vec![0.0; dim];
        let mut unbind = |trace: &[Real], role: usize, unbound: &mut [Real]| {
            Hrr.inverse_into(&roles[role], &mut inverse);
            Hrr.bind_into(trace, &inverse, unbound, &mut work);
        };
        unbind(&trace, 0, &mut unbound);
        let right = best(&rows, &unbound, &mut scores) == 0;
        let score = dot(&vocabulary[0], &unbound);
        let ahead = vocabulary[1..bound].iter().all(|other| dot(other, &unbound) < score);
        let cosine = f64::from(score / norm(&unbound)).clamp(-1.0, 1.0);
        let half = (dim as f64 - 1.0) / 2.0;
        let below = Beta::new(half, half).map_or(f64::NAN, |f| f.cdf((1.0 + cosine) / 2.0));
        let predicted = if ahead { below.powi((items - bound) as i32) } else { 0.0 };

        let mut decoder = PairDecoder::new(dim, &roles.concat(), &rows)?;
        let flag = |yes: bool| if yes { 1.0 } else { 0.0 };
        let (right, best) = (flag(right), flag(decoder.read(&trace)[0].item == 0));
        Ok(outcome([right, predicted, best, right - predicted, best - right]))
    }
}

impl Experiment for Capacity {
    fn about(&self) -> About {
        let question = "How often is the right filler decoded from a sum of bound pairs, and how often is it predicted to be?";
        let settings = json!({"rounds_of_cancellation": PairDecoder::ROUNDS});
        About { name: "capacity", question, revision: 2, settings }
    }

    fn cells(&self) -> Vec<Cell> {
        let cell = |size: &Size| {
            let settings = json!({
                "dimensions": size.dimensions, "bound": size.bound, "items": size.items,
                "sigma": size.sigma, "roles": if size.unitary { "unitary" } else { "gaussian" },
                "large_d_formula": (gaussian(size) * 1e6).round() / 1e6,
            });
            let readings = vec![
                Reading::new(Measure::Rate, json!({"reading": "linear"})),
                Reading::new(Measure::Mean, json!({"reading": "prediction"})),
                Reading::new(Measure::Rate, json!({"reading": "best"})),
                Reading::new(Measure::Difference, json!({"reading": "linear less prediction"})),
                Reading::new(Measure::Difference, json!({"reading": "best less linear"})),
            ];
            Cell::new(settings, 40_000, readings)
        };
        sizes().iter().map(cell).collect()
    }

    fn trial(&self, cell: &Cell, seed: Seed) -> Result<TrialOutcome, TaskError> {
        let whole = |setting| Ok::<_, TaskError>(cell.number(setting)? as usize);
        let size = Size {
            dimensions: whole("dimensions")?,
            bound: whole("bound")?,
            items: whole("items")?,
            sigma: cell.number("sigma")?,
            unitary: cell.is("roles", "unitary"),
        };
        size.trial(seed)
    }

    fn figure(&self, results: &Results) -> Option<Figure> {
        let mut series = Vec::new();
        for (colour, bound) in [8, 16].into_iter().enumerate() {
            let of = |reading: &str| {
                json!({
                    "bound": bound, "items": 64, "sigma": 0.0, "roles": "gaussian", "reading": reading,
                })
            };
            let mut add = |name: &str, marks: Vec<Mark>, style| {
                let name = format!("{bound} pairs, {name}");
                series.push(Series { colour: Some(colour), ..Series::new(name, marks, style) });
            };
            let drawn =
                [("best", Style::Line), ("linear", Style::Rings), ("prediction", Style::Dashed)];
            for (reading, style) in drawn {
                let mark = |row: &Row| Some(row.percent(row.number("dimensions")?.log2()));
                add(reading, results.marks(&of(reading), mark), style);
            }
            let mark = |row: &Row| {
                let y = 100.0 * row.number("large_d_formula")?;
                Some(Mark { x: row.number("dimensions")?.log2(), y, bar: None })
            };
            add("large-D formula", results.marks(&of("linear"), mark), Style::Dotted);
        }
        Some(Figure {
            title: "Right filler out of 64 items, no noise".into(),
            x: Axis::logarithmic("dimensions", 2.0),
            y: Axis::from_to("right (%)", 0.0, 102.0),
            series,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_large_d_formula_has_its_closed_form_for_two_items() {
        // For two items it is Phi(s / sqrt 2), because the difference of two normal numbers is normal.
        let size = Size { dimensions: 8, bound: 1, items: 2, sigma: 0.0, unitary: true };
        let s = 8.0f64.sqrt();
        let exact = Normal::standard().cdf(s / 2.0f64.sqrt());
        assert!((gaussian(&size) - exact).abs() < 1e-6, "{} {exact}", gaussian(&size));
    }

    #[test]
    fn the_rate_of_right_fillers_agrees_with_the_prediction() {
        // With 3,000 trials, four standard errors of the difference are below 3.7 points: a false alarm in less than
        // one of 10,000 seeds.
        for (dimensions, bound, items) in [(32, 4, 64), (64, 8, 16)] {
            let size = Size { dimensions, bound, items, sigma: 0.5, unitary: false };
            let (mut right, mut predicted, mut improved) = (0.0, 0.0, 0.0);
            for trial in 0..3_000 {
                let [linear, prediction, best, ..] = size.trial(Seed::new(trial)).expect("runs");
                right += linear / 3e3;
                predicted += prediction / 3e3;
                improved += best / 3e3;
            }
            assert!(right > 0.1 && right < 0.999, "{right}");
            assert!((right - predicted).abs() < 0.037, "{size:?}: {right} {predicted}");
            assert!(improved > right + 0.1, "{improved} {right}");
        }
    }
}
