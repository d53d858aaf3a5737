//! The weights that a learned connection starts from, and their files.

use std::path::{Path, PathBuf};

use ndarray::{Array2, Ix2};
use rand::RngExt;
use thiserror::Error;

use super::WeightShape;
use crate::files::npz::{NpzError, NpzReader, NpzWriter};
use crate::files::{FileError, Limit, Overwrite, read_file, write_atomic};
use crate::neurons::draw::{EvenPoints, on_sphere};
use crate::sim::Seed;

/// The weights that a [`Learned`](super::Learned) connection starts from: a row per output, a column per source.
#[derive(Debug, Clone)]
pub struct Weights(Start);

#[derive(Debug, Clone)]
enum Start {
    Zero,
    Given(Array2<f64>),
    /// Rows that were not of one length: index, length, and length of the first.
    Ragged([usize; 3]),
    Uniform(f64, f64, Seed),
    Directions(Seed),
}

/// Weights that cannot be read or written.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum WeightsError {
    /// The file cannot be read or written.
    #[error(transparent)]
    File(#[from] FileError),
    /// The file has no array `weights` of double-precision numbers in two dimensions.
    #[error("{}: {source}; expected an array `weights` of type <f8 in 2 dimensions", file.display())]
    Content {
        /// Path of the file.
        file: PathBuf,
        /// What is wrong with the archive.
        source: NpzError,
    },
    /// Weights of a connection that the run does not have.
    #[error("the run is of another graph than the connection; its weights were not written")]
    AnotherGraph,
    /// A weight that is infinite or not a number.
    #[error("{}: the weight in row {row} and column {column} is {value}; expected finite numbers", file.display())]
    NotFinite {
        /// Path of the file.
        file: PathBuf,
        /// Row, counted from 0.
        row: usize,
        /// Column, counted from 0.
        column: usize,
        /// The value.
        value: f64,
    },
}

/// Name of the array in a file.
const ARRAY: &str = "weights";

impl Weights {
    /// Weights of 0.
    pub fn zero() -> Self {
        Self(Start::Zero)
    }

    /// Weights given row by row: one row per output, one number per source.
    pub fn rows(rows: impl IntoIterator<Item: AsRef<[f64]>>) -> Self {
        let rows: Vec<Vec<f64>> = rows.into_iter().map(|row| row.as_ref().to_vec()).collect();
        let width = rows.first().map_or(0, Vec::len);
        if let Some(at) = rows.iter().position(|row| row.len() != width) {
            return Self(Start::Ragged([at, rows[at].len(), width]));
        }
        let values = rows.concat();
        let array = Array2::from_shape_vec((values.len() / width.max(1), width), values);
        Self(array.map_or(Start::Zero, Start::Given))
    }

    /// Weights of a matrix: a row per output, a column per source.
    pub fn matrix(weights: Array2<f64>) -> Self {
        Self(Start::Given(weights))
    }

    /// Weights drawn uniformly between two finite numbers.
    pub fn uniform(low: f64, high: f64, seed: Seed) -> Self {
        Self(Start::Uniform(low, high, seed))
    }

    /// Rows drawn uniformly from the directions: encoders. In two and three dimensions they are spread evenly.
    pub fn directions(seed: Seed) -> Self {
        Self(Start::Directions(seed))
    }

    /// Reads weights from a file of numpy (`.npz`) with the array `weights`, as
    /// [`LearnedPorts::save`](super::LearnedPorts::save) and `numpy.savez` write it. The path `-` reads standard input.
    ///
    /// # Errors
    /// [`WeightsError::File`] if the file cannot be read; [`WeightsError::Content`] if it has no such array, or one of
    /// another type; [`WeightsError::NotFinite`] if a weight is infinite or not a number. A shape that the connection does
    /// not have is a fault when the graph is built.
    pub fn read(path: &Path) -> Result<Self, WeightsError> {
        let bytes = read_file(path, Limit::ARCHIVE)?;
        let content = |source| WeightsError::Content { file: path.into(), source };
        let array = NpzReader::new(&bytes).and_then(|mut npz| npz.read::<f64, Ix2>(ARRAY));
        let array = array.map_err(content)?;
        match array.indexed_iter().find(|(_, value)| !value.is_finite()) {
            Some(((row, column), value)) => {
                let (file, value) = (path.into(), *value);
                Err(WeightsError::NotFinite { file, row, column, value })
            }
            None => Ok(Self(Start::Given(array))),
        }
    }

    /// Returns all weights row by row, or why they do not fit.
    pub(super) fn of(&self, shape: WeightShape) -> Result<Vec<f64>, String> {
        let WeightShape { outputs, inputs } = shape;
        match &self.0 {
            Start::Zero => Ok(vec![0.0; outputs * inputs]),
            Start::Ragged([row, length, width]) => {
                Err(format!("row {row} of the weights has {length} numbers; expected {width}"))
            }
            Start::Given(array) if array.dim() != (outputs, inputs) => {
                let (rows, columns) = array.dim();
                Err(format!(
                    "the weights have {rows} rows and {columns} columns; expected {outputs}, one per output, and {inputs}, one per source"
                ))
            }
            Start::Given(array) => match array.iter().find(|value| !value.is_finite()) {
                Some(wrong) => Err(format!("a weight is {wrong}; expected finite numbers")),
                None => Ok(array.iter().copied().collect()),
            },
            Start::Uniform(low, high, seed) => {
                if !(low.is_finite() && high.is_finite() && low <= high) {
                    return Err(format!(
                        "weights between {low} and {high}; expected two finite numbers in rising order"
                    ));
                }
                if !(high - low).is_finite() {
                    return Err(format!(
                        "weights between {low:e} and {high:e}; expected a finite difference"
                    ));
                }
                let mut rng = seed.derive("", "weights").rng();
                let draw = || low + (high - low) * rng.random::<f64>();
                Ok(std::iter::repeat_with(draw).take(outputs * inputs).collect())
            }
            Start::Directions(seed) => {
                let mut rng = seed.derive("", "weights").rng();
                let mut all = vec![0.0; outputs * inputs];
                let rows = all.chunks_exact_mut(inputs);
                if !(2..=EvenPoints::MOST_DIMS).contains(&inputs) {
                    rows.for_each(|row| on_sphere(&mut rng, row));
                    return Ok(all);
                }
                let mut even = EvenPoints::new(&mut rng, inputs - 1);
                rows.for_each(|row| EvenPoints::direction(even.advance(), row));
                Ok(all)
            }
        }
    }
}

/// Writes weights to a file.
pub(super) fn save(
    weights: &Array2<f64>,
    path: &Path,
    overwrite: Overwrite,
) -> Result<(), WeightsError> {
    let bytes = || {
        let mut npz = NpzWriter::new();
        npz.add(ARRAY, weights)?;
        npz.finish()
    };
    let bytes = bytes().map_err(|source| WeightsError::Content { file: path.into(), source })?;
    Ok(write_atomic(path, bytes, overwrite)?)
}
