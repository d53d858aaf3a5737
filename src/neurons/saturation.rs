//! Where neurons saturate and exact maths does not, and how often.

use std::collections::BTreeMap;

use super::layers::Populated;
use crate::sim::{Real, SimView};

/// Share of the radius from which a value counts as beyond it.
const BEYOND: f64 = 1.2;

/// How often the ensembles of each layer were to represent values beyond their radius.
///
/// Only layers whose exact form has no such limit are counted: products, graded selections, and selections by a contest, whose neurons cannot
/// tell apart utilities beyond the radius; with them memories. So are pointers: exact maths limits their norm, and neurons that of the part of
/// each ensemble, which is too much where a pointer has most of its norm in few components, as the identity of circular convolution; not
/// where each component has an ensemble of its own ([`Represent::split`](super::Represent::split)), of which some saturate whenever a memory
/// stores something. A value counts from a fifth beyond the radius: what is nearer crosses it by noise, and
/// what is decoded still follows it.
/// [`Represent`](super::Represent) of numbers, [`Map`](super::Map) and [`Ensemble`](super::Ensemble) are limited in every mode. A layer in
/// exact maths has no ensembles and is not counted.
///
/// ```
/// # use symbolt::prelude::*;
/// # use symbolt::neurons::Saturation;
/// # use symbolt::sim::{SimError, SimView};
/// # fn watch(sim: &mut Simulator) -> Result<(), SimError> {
/// let mut saturation = Saturation::default();
/// for _ in 0..20 {
///     sim.run_for(SimDuration::from_millis(50))?;
///     saturation.look(&SimView::of(sim));
/// }
/// for layer in saturation.layers().filter(|layer| layer.share() > 0.01) {
///     println!("{layer}");
/// }
/// # Ok(())
/// # }
/// ```
#[derive(Debug, Clone, Default)]
pub struct Saturation {
    layers: BTreeMap<String, LayerSaturation>,
    values: Vec<Real>,
}

/// How often the ensembles of a layer were to represent values beyond their radius.
#[derive(Debug, Clone, PartialEq)]
pub struct LayerSaturation {
    /// Path of the layer.
    pub path: String,
    /// Radius of its ensembles.
    pub radius: f64,
    /// Number of ensembles looked at, in all looks.
    pub looked: u64,
    /// Number of these whose value was at least a fifth beyond the radius.
    pub beyond: u64,
    /// Greatest norm of a value, relative to the radius.
    pub greatest: f64,
}

impl LayerSaturation {
    /// Returns the share of ensembles beyond their radius, from 0 to 1.
    pub fn share(&self) -> f64 {
        self.beyond as f64 / self.looked.max(1) as f64
    }
}

impl std::fmt::Display for LayerSaturation {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let (percent, greatest) = (100.0 * self.share(), self.greatest);
        write!(
            f,
            "{}: {percent:.1}% of the values lie a fifth or more beyond the radius of {}, the greatest {greatest:.1} times as far",
            self.path, self.radius as Real
        )
    }
}

impl Saturation {
    /// Adds a look at a run, as it stands. With ranks it sees the neurons of this process. Costs about as much as a tick of the
    /// layers between neurons; the first look also draws one ensemble of each layer again.
    pub fn look(&mut self, view: &SimView<'_>) {
        let Self { layers, values } = self;
        view.look_at_parts(|part| {
            let Some(layer) = part.node.downcast_ref::<Populated>() else { return };
            values.clear();
            layer.unlimited(part.part, part.inputs, values);
            if values.is_empty() {
                return;
            }
            if !layers.contains_key(part.path) {
                let Some(radius) = layer.radius() else { return };
                let path = part.path.to_owned();
                let new = LayerSaturation { path, radius, looked: 0, beyond: 0, greatest: 0.0 };
                layers.insert(part.path.to_owned(), new);
            }
            let Some(found) = layers.get_mut(part.path) else { return };
            for value in values.chunks_exact(layer.dims()) {
                let square: f64 = value.iter().map(|x| f64::from(*x).powi(2)).sum();
                let share = square.sqrt() / found.radius;
                found.looked += 1;
                found.beyond += u64::from(share >= BEYOND);
                found.greatest = found.greatest.max(share);
            }
        });
    }

    /// Returns the layers that were looked at, by their paths.
    pub fn layers(&self) -> impl Iterator<Item = &LayerSaturation> {
        self.layers.values()
    }
}
