//! Reading back what a graph was built with: neurons, decoders, their error, and tuning curves.

use std::any::Any;
use std::fmt;
use std::sync::Arc;

use ndarray::{Array2, ArrayView2, s};
use thiserror::Error;

use super::bank::{Draft, Ensembles, Shape};
use super::draw::Neurons;
use super::layers::Populated;
use super::models::NeuronModel;
use super::solve::{Points, Special, rates};
use super::tuning::TuningError;
use crate::sim::{Graph, is_inside, nearest_first};

/// What the ensembles of a bank were made from. Neurons and points are drawn again when they are asked for.
pub(crate) struct Origin {
    /// The decoded functions and their widths.
    pub functions: Vec<(String, usize)>,
    pub special: Vec<Special>,
    pub draft: Box<dyn Fn(usize) -> Result<Draft, TuningError> + Send + Sync>,
}

impl fmt::Debug for Origin {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Origin").field("functions", &self.functions).finish_non_exhaustive()
    }
}

/// Why something cannot be read back.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum ReadBackError {
    /// There is no such layer in neurons, or several below the path.
    #[error("there is no single layer of neurons at `{asked}`; the layers of neurons are: {}", nearest_first(asked, choices.iter().map(String::as_str)))]
    Layer {
        /// Path that was given.
        asked: String,
        /// Paths of all layers in neurons.
        choices: Vec<String>,
    },
    /// The layer has fewer ensembles.
    #[error("ensemble {asked} does not exist; the population has {count}, counted from 0")]
    Ensemble {
        /// Index that was given.
        asked: usize,
        /// Number of ensembles.
        count: usize,
    },
    /// The ensemble has no such function.
    #[error("no function `{asked}` is decoded; the functions are: {}", nearest_first(asked, choices.iter().map(String::as_str)))]
    Function {
        /// Name that was given.
        asked: String,
        /// Names of all functions.
        choices: Vec<String>,
    },
    /// Points of another width.
    #[error("the points have {found} columns; expected one per dimension, {dims}")]
    Points {
        /// Number of columns.
        found: usize,
        /// Number of dimensions of the ensemble.
        dims: usize,
    },
    /// Another process has the ensemble, or its neurons cannot be drawn again.
    #[error("the ensemble cannot be read here: {reason}")]
    Elsewhere {
        /// Reason.
        reason: String,
    },
}

/// The populations of one layer, as they were built.
///
/// ```
/// use ndarray::array;
/// use symbolt::neurons::{BuiltLayer, Ensemble, LifSpec, Population, PopulationPlan};
/// use symbolt::prelude::*;
///
/// let mut graph = GraphBuilder::new();
/// let square = Ensemble::new(1).decode("square", 1, |x, out| out[0] = x[0] * x[0]);
/// let a = graph.add("a", square);
/// let given = graph.add("given", Constant::vector(&[0.5]));
/// graph.route(&given >> &a.input);
/// let plan = PopulationPlan::lif();
/// let graph = graph.build(Timebase::default(), &plan, Seed::new(1))?;
///
/// let built = BuiltLayer::of(&graph, "a")?.ensemble(0)?;
/// assert_eq!(built.encoders().dim(), (100, 1));
/// assert_eq!(built.decoders("square")?.dim(), (100, 1));
/// assert!(built.error("square")? < 0.02);
/// let curves = built.tuning_curves(array![[-1.0], [0.0], [1.0]].view())?;
/// assert_eq!(curves.dim(), (3, 100));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, Copy)]
pub struct BuiltLayer<'g> {
    path: &'g str,
    layer: &'g [Ensembles],
}

impl<'g> BuiltLayer<'g> {
    /// Returns the layer at `path`, or the only layer of neurons in the module at `path`. Costs O(nodes).
    ///
    /// # Errors
    /// [`ReadBackError::Layer`] if there is none, several, or it is in direct mode.
    pub fn of(graph: &'g Graph, path: &str) -> Result<Self, ReadBackError> {
        let all = || Self::all(graph);
        let exact = all().find(|layer| layer.path == path);
        let mut inside = all().filter(|layer| is_inside(layer.path, path));
        let only = inside.next().filter(|_| inside.next().is_none());
        exact.or(only).ok_or_else(|| ReadBackError::Layer {
            asked: path.into(),
            choices: all().map(|layer| layer.path.into()).collect(),
        })
    }

    /// Returns all layers in neurons.
    pub fn all(graph: &'g Graph) -> impl Iterator<Item = Self> {
        graph.nodes().filter_map(|(path, node): (&str, &dyn Any)| {
            let layer = node.downcast_ref::<Populated>()?.populations();
            Some(Self { path, layer })
        })
    }

    /// Returns the path of the layer.
    pub fn path(&self) -> &'g str {
        self.path
    }

    /// Returns the number of populations: 1, except in selections in which items inhibit each other.
    pub fn populations(&self) -> usize {
        self.layer.len()
    }

    /// Returns the number of ensembles in each population: 1 for an [`Ensemble`](super::Ensemble), or its copies.
    pub fn ensembles(&self) -> usize {
        self.layer[0].bank.shape().ensembles
    }

    /// Returns an ensemble of the first population. Draws its neurons again.
    ///
    /// # Errors
    /// [`ReadBackError::Ensemble`] if there are fewer; [`ReadBackError::Elsewhere`] if another rank has it.
    pub fn ensemble(&self, index: usize) -> Result<BuiltEnsemble, ReadBackError> {
        self.ensemble_of(0, index)
    }

    /// Returns an ensemble of a population, both counted from 0.
    ///
    /// # Errors
    /// As [`ensemble`](Self::ensemble).
    pub fn ensemble_of(
        &self,
        population: usize,
        index: usize,
    ) -> Result<BuiltEnsemble, ReadBackError> {
        let count = self.layer.len();
        let missing = ReadBackError::Ensemble { asked: population, count };
        let Ensembles { bank, origin, .. } = self.layer.get(population).ok_or(missing)?;
        let (solved, shape) = (&*bank.solved, bank.shape());
        if index >= shape.ensembles {
            return Err(ReadBackError::Ensemble { asked: index, count: shape.ensembles });
        }
        let place = match &solved.own {
            None => Some(index),
            Some(own) => own.binary_search(&index).ok(),
        };
        let elsewhere = |reason: String| ReadBackError::Elsewhere { reason };
        let place = place.ok_or_else(|| elsewhere("another rank has it".into()))?;
        let Draft { neurons, radius, points } =
            (origin.draft)(index).map_err(|error| elsewhere(error.to_string()))?;
        let Shape { neurons: count, outputs, .. } = shape;
        let decoders = &solved.decoders[place * shape.padded() * outputs..];
        // Decoders are kept per unit of activity.
        let unit = if bank.spiking_of(1) > 0 { bank.dt_s } else { 1.0 };
        let decoder =
            |(n, k): (usize, usize)| -> f64 { f64::from(decoders[n * outputs + k]) * unit };
        Ok(BuiltEnsemble {
            model: bank.model.clone(),
            neurons,
            radius,
            points,
            functions: origin.functions.clone(),
            special: origin.special.clone(),
            decoders: Array2::from_shape_fn((count, outputs), decoder),
        })
    }
}

/// The neurons and decoders of one ensemble, as they were built.
///
/// A neuron gets the current `gain (encoder . x) / radius + bias` at the value x.
#[derive(Debug, Clone)]
pub struct BuiltEnsemble {
    model: Arc<dyn NeuronModel>,
    neurons: Neurons,
    radius: f64,
    points: Points,
    functions: Vec<(String, usize)>,
    special: Vec<Special>,
    decoders: Array2<f64>,
}

impl BuiltEnsemble {
    /// Returns the encoders: a row per neuron and a column per dimension, of length 1 unless they were given otherwise.
    pub fn encoders(&self) -> Array2<f64> {
        let Neurons { dims, encoders, .. } = &self.neurons;
        Array2::from_shape_fn((self.neurons.count(), *dims), |(n, k)| encoders[n * dims + k])
    }

    /// Returns the gain of each neuron.
    pub fn gains(&self) -> &[f64] {
        &self.neurons.gains
    }

    /// Returns the bias of each neuron.
    pub fn biases(&self) -> &[f64] {
        &self.neurons.biases
    }

    /// Returns the radius: greatest norm of a represented value.
    pub fn radius(&self) -> f64 {
        self.radius
    }

    /// Returns the neuron model.
    pub fn model(&self) -> &dyn NeuronModel {
        &*self.model
    }

    /// Returns where along its encoder, in units of the radius, each neuron begins to fire; not a finite number for a
    /// gain of 0.
    pub fn intercepts(&self) -> Vec<f64> {
        let onset = self.model.onset();
        let neurons = self.gains().iter().zip(self.biases());
        neurons.map(|(gain, bias)| (onset - bias) / gain).collect()
    }

    /// Returns the rate of each neuron at the end of its encoder on the radius, in Hz.
    pub fn max_rates(&self) -> Vec<f64> {
        let mut rates: Vec<f64> =
            self.gains().iter().zip(self.biases()).map(|(gain, bias)| gain + bias).collect();
        self.model.rates(&mut rates);
        rates
    }

    /// Returns the names and widths of the decoded functions. Those of other layers than ensembles are one, `out`.
    pub fn functions(&self) -> impl Iterator<Item = (&str, usize)> {
        self.functions.iter().map(|(name, width)| (&**name, *width))
    }

    fn columns(&self, function: &str) -> Result<std::ops::Range<usize>, ReadBackError> {
        let mut from = 0;
        for (name, width) in &self.functions {
            if name == function {
                return Ok(from..from + width);
            }
            from += width;
        }
        let choices = self.functions.iter().map(|(name, _)| name.clone()).collect();
        Err(ReadBackError::Function { asked: function.into(), choices })
    }

    /// Returns the decoders of a function: a row per neuron and a column per number of its value. The decoded value is
    /// the sum of rates (Hz) times rows. In the precision in which they run.
    ///
    /// # Errors
    /// [`ReadBackError::Function`] if there is no such function.
    pub fn decoders(&self, function: &str) -> Result<Array2<f64>, ReadBackError> {
        Ok(self.decoders.slice(s![.., self.columns(function)?]).to_owned())
    }

    /// Returns the points and targets of a function.
    fn points_of(&self, function: &str) -> Result<Points, ReadBackError> {
        let columns = self.columns(function)?;
        let own = self.special.iter().find(|special| special.columns == columns);
        let own = own.and_then(|special| special.points.as_deref().cloned());
        Ok(own.unwrap_or_else(|| self.points.columns(&columns)))
    }

    /// Returns the evaluation points of a function, a row per point, in the unit of the represented value; and the
    /// target values there, a row per point.
    ///
    /// # Errors
    /// [`ReadBackError::Function`] if there is no such function.
    pub fn evaluation_points(
        &self,
        function: &str,
    ) -> Result<(Array2<f64>, Array2<f64>), ReadBackError> {
        let (points, dims) = (self.points_of(function)?, self.neurons.dims);
        let at = |(p, k): (usize, usize)| points.values[p * dims + k] * self.radius;
        let values = Array2::from_shape_fn((points.values.len() / dims, dims), at);
        Ok((values, points.targets()))
    }

    /// Returns the decoding error of a function: the root of the mean square difference between decoded and target
    /// values at its evaluation points, without noise of spikes. In the unit of the function.
    ///
    /// # Errors
    /// [`ReadBackError::Function`] if there is no such function.
    pub fn error(&self, function: &str) -> Result<f64, ReadBackError> {
        let points = self.points_of(function)?;
        let rates = rates::<f64>(&*self.model, &self.neurons, &points.values);
        let off = rates.dot(&self.decoders(function)?) - points.targets();
        Ok(off.mapv(|x| x * x).mean().unwrap_or_default().sqrt())
    }

    /// Returns tuning curves: the rates (Hz) at `points`, a row per point and a column per neuron. Points have a row
    /// each, in the unit of the represented value.
    ///
    /// # Errors
    /// [`ReadBackError::Points`] if the points have another width than the ensemble.
    pub fn tuning_curves(&self, points: ArrayView2<'_, f64>) -> Result<Array2<f64>, ReadBackError> {
        let (found, dims) = (points.ncols(), self.neurons.dims);
        if found != dims {
            return Err(ReadBackError::Points { found, dims });
        }
        let values: Vec<f64> = points.iter().map(|x| x / self.radius).collect();
        Ok(rates::<f64>(&*self.model, &self.neurons, &values))
    }

    /// Returns response curves: the rates (Hz) of each neuron at values along its own encoder, in units of the radius.
    /// A row per value and a column per neuron.
    pub fn response_curves(&self, along: &[f64]) -> Array2<f64> {
        let mut curves = Array2::from_shape_fn((along.len(), self.neurons.count()), |(at, n)| {
            self.gains()[n] * along[at] + self.biases()[n]
        });
        if let Some(currents) = curves.as_slice_mut() {
            self.model.rates(currents);
        }
        curves
    }

    /// Returns the full weights of a connection that decodes `function` into ensemble `to`: a row per neuron of `to`
    /// and a column per neuron of this ensemble, in current per Hz. `gain (encoder . D) / radius` of the target.
    ///
    /// # Errors
    /// [`ReadBackError::Function`] if there is no such function; [`ReadBackError::Points`] if its width is not that of
    /// `to`.
    pub fn weights(&self, function: &str, to: &Self) -> Result<Array2<f64>, ReadBackError> {
        let decoders = self.decoders(function)?;
        let (found, dims) = (decoders.ncols(), to.neurons.dims);
        if found != dims {
            return Err(ReadBackError::Points { found, dims });
        }
        let mut scaled = to.encoders();
        for (mut row, gain) in scaled.rows_mut().into_iter().zip(to.gains()) {
            row *= gain / to.radius;
        }
        Ok(scaled.dot(&decoders.t()))
    }
}
