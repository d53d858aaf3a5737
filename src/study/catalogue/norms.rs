//! `figure-1a` and `figure-1c`: distances between states under a p-norm with a negative exponent.

use std::f64::consts::PI;

use rand::{Rng, RngExt};
use rand_distr::{Distribution, StandardNormal};
use serde_json::json;

use crate::sim::Seed;
use crate::study::experiment::{
    About, Axis, Cell, Experiment, Figure, Mark, Measure, Reading, Results, Row, Series, Style,
    TrialOutcome, outcome,
};
use crate::task::TaskError;
use crate::task::learn::p_distance;

/// Exponents that figure 1 compares.
const EXPONENTS: [f64; 2] = [2.0, -3.0];

fn gauss<R: Rng>(rng: &mut R, sd: f64) -> f64 {
    let z: f64 = StandardNormal.sample(rng);
    sd * z
}

/// Figure 1A: distances between pairs of 6-D states that vary little in some dimensions.
pub(super) struct Distances;

const DIMENSIONS: usize = 6;
const TIGHT: f64 = 0.05;
const BROAD: f64 = 0.5;

impl Experiment for Distances {
    fn about(&self) -> About {
        let question = "How far apart are 6-D states that are alike in k dimensions, by the Euclidean norm and by p = -3?";
        let settings = json!({"dimensions": DIMENSIONS, "tight_sd": TIGHT, "broad_sd": BROAD});
        About { name: "figure-1a", question, revision: 1, settings }
    }

    fn cells(&self) -> Vec<Cell> {
        let readings = || EXPONENTS.map(|p| Reading::new(Measure::Mean, json!({"p": p}))).to_vec();
        (0..=DIMENSIONS).map(|k| Cell::new(json!({"tight": k}), 10_000, readings())).collect()
    }

    fn trial(&self, cell: &Cell, seed: Seed) -> Result<TrialOutcome, TaskError> {
        let tight = cell.number("tight")? as usize;
        let mut rng = seed.rng();
        let mut state = || -> [f64; DIMENSIONS] {
            std::array::from_fn(|i| gauss(&mut rng, if i < tight { TIGHT } else { BROAD }))
        };
        let (a, b) = (state(), state());
        let [euclidean, negative] = EXPONENTS.map(|p| p_distance(&a, &b, p));
        Ok(outcome([euclidean, negative]))
    }

    fn figure(&self, results: &Results) -> Option<Figure> {
        let series = EXPONENTS.map(|p| {
            let mark = |row: &Row| row.median(row.number("tight")?, f64::log10);
            let marks = results.marks(&json!({"p": p}), mark);
            Series::new(format!("p = {p}"), marks, Style::Line)
        });
        Some(Figure {
            title: "Distance of two 6-D states (median, 5 to 95% of the pairs)".into(),
            x: Axis::new("dimensions with SD 0.05 (the others 0.5)"),
            y: Axis::logarithmic("distance (units of the states)", 10.0),
            series: series.into(),
        })
    }
}

/// Figure 1C: knives on a cart or beside plates. A knife's 8-D state is relative to the cart, the nearest plate and the
/// nearest table edge.
pub(super) struct TableSetting;

/// Number of tables in an example, as in figure 1B.
const TABLES: usize = 3;
/// Number of plates on a table. Each has a knife beside it.
const PLATES: usize = 4;
/// Number of knives on the cart.
const ON_CART: usize = 4;
/// Half lengths of the table's sides, in metres.
const TABLE: [f64; 2] = [0.9, 0.6];
/// Standard deviations of a knife's position in metres and heading in radians, as a person places it.
const HAND: [f64; 2] = [0.005, 0.05];

/// A position in the plane with a heading.
#[derive(Clone, Copy)]
struct Place {
    x: f64,
    y: f64,
    angle: f64,
}

impl Place {
    /// Returns this place in another frame: distances along and across its heading in metres, and the angle in radians.
    fn from(&self, frame: &Self) -> [f64; 3] {
        let (dx, dy) = (self.x - frame.x, self.y - frame.y);
        let (sin, cos) = frame.angle.sin_cos();
        [cos * dx + sin * dy, cos * dy - sin * dx, self.angle - frame.angle]
    }
}

/// Marks the numbers of a knife's state that are angles.
const ANGLES: [bool; 8] = [false, false, true, false, false, true, false, true];

/// Returns the distance between the states of two knives. Angles differ by at most half a circle.
fn apart(a: &[f64; 8], b: &[f64; 8], p: f64) -> f64 {
    let difference: [f64; 8] = std::array::from_fn(|i| {
        let by = a[i] - b[i];
        if ANGLES[i] { (by + PI).rem_euclid(2.0 * PI) - PI } else { by }
    });
    p_distance(&difference, &[0.0; 8], p)
}

/// Returns the state of a knife: its place in the frame of the cart and in the frame of the nearest plate, and its
/// distance and angle to the nearest edge of the table.
fn state(knife: &Place, cart: &Place, plates: &[Place]) -> [f64; 8] {
    let [a, b, c] = knife.from(cart);
    let far = |plate: &Place| (plate.x - knife.x).hypot(plate.y - knife.y);
    let near = plates.iter().min_by(|p, q| far(p).total_cmp(&far(q))).unwrap_or(cart);
    // A plate is round, so its frame has the heading of the table.
    let [d, e, f] = knife.from(&Place { angle: 0.0, ..*near });
    let edges = [
        (TABLE[0] - knife.x, 0.0),
        (TABLE[1] - knife.y, PI / 2.0),
        (TABLE[0] + knife.x, PI),
        (TABLE[1] + knife.y, -PI / 2.0),
    ];
    let (distance, normal) =
        edges.into_iter().min_by(|p, q| p.0.abs().total_cmp(&q.0.abs())).unwrap_or((0.0, 0.0));
    [a, b, c, d, e, f, distance, knife.angle - normal]
}

/// Draws an example. Returns the states of the knives on the carts, and of the knives beside plates, of all tables.
fn example<R: Rng>(rng: &mut R) -> [Vec<[f64; 8]>; 2] {
    let mut groups = [Vec::new(), Vec::new()];
    let between = |rng: &mut R, low: f64, high: f64| low + (high - low) * rng.random::<f64>();
    for _ in 0..TABLES {
        let cart = Place {
            x: between(rng, 1.4, 2.2),
            y: between(rng, -1.0, 1.0),
            angle: between(rng, -PI, PI),
        };
        // The plates are at the long sides.
        let plates: Vec<Place> = (0..PLATES)
            .map(|i| {
                let side = if i % 2 == 0 { 1.0 } else { -1.0 };
                let half = if i < 2 { -1.0 } else { 1.0 };
                Place {
                    x: half * between(rng, 0.25, 0.6),
                    y: side * (TABLE[1] - 0.17 + gauss(rng, 0.01)),
                    angle: 0.0,
                }
            })
            .collect();
        // These knives lie side by side in the cart's tray.
        for i in 0..ON_CART {
            let (along, across) = (gauss(rng, HAND[0]), 0.03 * i as f64 + gauss(rng, HAND[0]));
            let (sin, cos) = cart.angle.sin_cos();
            let knife = Place {
                x: cart.x + cos * along - sin * across,
                y: cart.y + sin * along + cos * across,
                angle: cart.angle + gauss(rng, HAND[1]),
            };
            groups[0].push(state(&knife, &cart, &plates));
        }
        for plate in &plates {
            let outwards = plate.y.signum();
            // The knife lies to the right of the person at this plate and points away from the edge.
            let knife = Place {
                x: plate.x + outwards * (0.16 + gauss(rng, HAND[0])),
                y: plate.y + gauss(rng, HAND[0]),
                angle: -outwards * PI / 2.0 + gauss(rng, HAND[1]),
            };
            groups[1].push(state(&knife, &cart, &plates));
        }
    }
    groups
}

impl Experiment for TableSetting {
    fn about(&self) -> About {
        let question = "Knives on a cart or beside plates: are distances within a group smaller than between groups?";
        let settings = json!({
            "tables": TABLES, "plates": PLATES, "knives_on_cart": ON_CART, "table_half_m": TABLE,
            "placing_sd_m_rad": HAND,
        });
        About { name: "figure-1c", question, revision: 2, settings }
    }

    fn cells(&self) -> Vec<Cell> {
        EXPONENTS
            .map(|p| {
                let share = "share of pairs within below those between";
                let readings = ["on the cart", "beside plates", "between groups", share]
                    .map(|pairs| Reading::new(Measure::Mean, json!({"pairs": pairs})));
                Cell::new(json!({"p": p}), 500, readings.into())
            })
            .into()
    }

    fn trial(&self, cell: &Cell, seed: Seed) -> Result<TrialOutcome, TaskError> {
        let p = cell.number("p")?;
        let groups = example(&mut seed.rng());
        let within = |group: &[[f64; 8]]| -> Vec<f64> {
            (0..group.len())
                .flat_map(|i| (0..i).map(move |j| (i, j)))
                .map(|(i, j)| apart(&group[i], &group[j], p))
                .collect()
        };
        let [cart, plates] = [within(&groups[0]), within(&groups[1])];
        let between: Vec<f64> =
            groups[0].iter().flat_map(|a| groups[1].iter().map(|b| apart(a, b, p))).collect();
        let mean = |all: &[f64]| all.iter().sum::<f64>() / all.len() as f64;
        // This is the area under the ROC curve: 1 if all distances within groups are below those between groups, 1/2 by
        // chance.
        let mut sorted = between.clone();
        sorted.sort_by(f64::total_cmp);
        let all: Vec<f64> = cart.iter().chain(&plates).copied().collect();
        let above = |d: &f64| (sorted.len() - sorted.partition_point(|b| b <= d)) as f64;
        let share = all.iter().map(above).sum::<f64>() / (all.len() * sorted.len()) as f64;
        Ok(outcome([mean(&cart), mean(&plates), mean(&between), share]))
    }

    fn figure(&self, results: &Results) -> Option<Figure> {
        // The names are listed from the bottom. The points of the two exponents are shifted apart.
        let names = ["between groups", "beside plates", "on the cart"];
        let series = EXPONENTS.map(|p| {
            let mark = |(at, pairs): (usize, &&str)| {
                let y = at as f64 + if p > 0.0 { 0.12 } else { -0.12 };
                let mark = |row: &Row| row.median(y, f64::log10).map(Mark::across);
                results.marks(&json!({"p": p, "pairs": pairs}), mark)
            };
            let marks = names.iter().enumerate().flat_map(mark).collect();
            Series::new(format!("p = {p}"), marks, Style::Points)
        });
        Some(Figure {
            title: "Mean distance of knives' 8-D states (median, 5 to 95% of the examples)".into(),
            x: Axis::logarithmic("distance (m and rad)", 10.0),
            y: Axis::named(names.map(|pairs| format!("pairs {pairs}")).into()),
            series: series.into(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn knives_of_a_group_are_near_in_the_coordinates_that_define_the_group() {
        let groups = example(&mut Seed::new(4).rng());
        // Knives on the cart are near in the cart's frame, for every heading of the cart.
        for pair in groups[0].chunks_exact(ON_CART) {
            for (a, b) in pair.iter().zip(&pair[1..]) {
                assert!((a[0] - b[0]).abs() < 0.05 && (a[1] - b[1]).abs() < 0.08);
            }
        }
        // Knives beside plates are half a circle from the edge's normal, where angles wrap around.
        let slant = |knife: &[f64; 8]| (knife[7]).rem_euclid(2.0 * PI);
        let only_slant = |a: &[f64; 8], b: &[f64; 8]| {
            let (mut one, mut other) = ([0.0; 8], [0.0; 8]);
            (one[7], other[7]) = (a[7], b[7]);
            apart(&one, &other, 2.0)
        };
        for (a, b) in groups[1].iter().zip(&groups[1][1..]) {
            assert!((slant(a) - PI).abs() < 0.3, "{}", slant(a));
            assert!(only_slant(a, b) < 0.4, "{}", only_slant(a, b));
        }
    }
}
