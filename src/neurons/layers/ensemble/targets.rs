//! The evaluation points of an ensemble, and what its functions want there.

use std::sync::Arc;

use super::{Decoded, Ensemble};
use crate::neurons::draw::{EvenPoints, in_ball};
use crate::neurons::poles;
use crate::neurons::solve::Special;
use crate::neurons::tuning::TuningError;
use crate::sim::{Real, Seed};

impl Ensemble {
    /// Returns the evaluation points, in units of the radius.
    pub(super) fn points(&self, neurons: usize, seed: Seed) -> Vec<f64> {
        let count = match &self.settings.points {
            Some(Err(rows)) => {
                let radius = f64::from(self.radius);
                return rows.iter().flatten().map(|x| x / radius).collect();
            }
            Some(Ok(count)) => *count,
            None => (neurons * 3 / 2).clamp(if self.dims == 1 { 500 } else { 1_000 }, 3_000),
        };
        if self.dims == 1 {
            // Evenly apart, as in other layers: chance would favour one side of few neurons.
            return (0..count).map(|p| (2 * p + 1) as f64 / count as f64 - 1.0).collect();
        }
        let mut rng = seed.derive("", "points").rng();
        let mut values = vec![0.0; count * self.dims];
        let rows = values.chunks_exact_mut(self.dims);
        if self.dims > EvenPoints::MOST_DIMS {
            rows.for_each(|value| in_ball(&mut rng, value, 3));
            return values;
        }
        let mut even = EvenPoints::new(&mut rng, self.dims);
        for value in rows {
            let point = even.advance();
            EvenPoints::direction(point, value);
            let length = point[self.dims - 1].powf(1.0 / self.dims as f64);
            value.iter_mut().for_each(|value| *value *= length);
        }
        values
    }

    /// Returns the targets at points in units of the radius, a row per point, and checks them. They are 0 for functions
    /// with points of their own.
    pub(super) fn targets(&self, values: &[f64]) -> Result<Vec<f64>, TuningError> {
        let (dims, outputs) = (self.dims, self.outputs().max(1));
        let radius = f64::from(self.radius);
        let mut wanted = vec![0.0; values.len() / dims * outputs];
        let mut from = 0;
        for Decoded { target, .. } in &self.functions {
            let width = target.width;
            let function = |at: &[f64], out: &mut [f64]| {
                let argument: Vec<Real> = at.iter().map(|x| *x as Real).collect();
                let mut single = vec![0.0; width];
                target.compute(&argument, &mut single);
                out.iter_mut().zip(single).for_each(|(out, value)| *out = f64::from(value));
            };
            if !target.has_points() {
                let at: Vec<f64> = values.iter().map(|x| x * radius).collect();
                let mut own = vec![0.0; at.len() / dims * width];
                for (at, out) in at.chunks_exact(dims).zip(own.chunks_exact_mut(width)) {
                    function(at, out);
                    if let Some(wrong) = out.iter().find(|value| !value.is_finite()) {
                        let at: Vec<Real> = at.iter().map(|x| *x as Real).collect();
                        return Err(poles::not_finite(*wrong, at));
                    }
                }
                if !matches!(self.settings.points, Some(Err(_))) {
                    poles::check(&function, radius, (&at, dims), (&own, width))?;
                }
                let rows = wanted.chunks_exact_mut(outputs).zip(own.chunks_exact(width));
                rows.for_each(|(row, own)| row[from..from + width].copy_from_slice(own));
            }
            from += width;
        }
        Ok(wanted)
    }

    /// Returns the functions that have points or a solver of their own.
    pub(super) fn special(&self) -> Result<Vec<Special>, TuningError> {
        let (mut all, mut from) = (Vec::new(), 0);
        for Decoded { target, .. } in &self.functions {
            let columns = from..from + target.width;
            from = columns.end;
            let points = target.own_points(f64::from(self.radius));
            if let Some(wrong) = points.iter().flat_map(|p| &p.wanted).find(|x| !x.is_finite()) {
                return Err(poles::not_finite(*wrong, "one of its evaluation points"));
            }
            let solver = target.solver_or(&self.settings.solver);
            if points.is_some() || solver.is_some() {
                all.push(Special { columns, points: points.map(Arc::new), solver });
            }
        }
        Ok(all)
    }
}
