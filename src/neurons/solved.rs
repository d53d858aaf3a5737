//! Solved models: the stored neurons and decoders of a graph, with which later runs give the same bits.
//!
//! A file begins with one line of JSON that describes the rest. The encoders, biases and decoders of each population
//! follow as 32-bit floating-point numbers, little-endian. Each population has a fingerprint of everything that it was
//! solved from: path, seed, tick, time constants, tuning, and target function at its evaluation points. A graph
//! refuses a population whose fingerprint differs from the one that it needs.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use serde::{Deserialize, Serialize};
use thiserror::Error;

use super::bank::{Shape, Solved, hadamard};
use super::tuning::TuningError;
use crate::files::{FileError, Limit, read_file};
use crate::sim::Real;

/// The solved populations of a graph, by the paths of their layers.
///
/// Building a neural graph solves for all decoders. A solved model saves this work the next time:
///
/// 1. Take it from a built graph ([`SolvedModel::of`]).
/// 2. Encode it ([`encode`](Self::encode)) and write the bytes to a file.
/// 3. Load the file ([`read`](Self::read)).
/// 4. Give the model to the plan ([`PopulationPlan::solved`](super::PopulationPlan::solved)).
///
/// ```
/// use symbolt::neurons::{Layers, LifSpec, Map, Population, PopulationPlan, SolvedModel};
/// use symbolt::sim::Ports;
/// use symbolt::prelude::*;
/// use symbolt::sim::{Module, Scope, Vector};
///
/// struct Channel;
/// impl Module for Channel {
///     type Ports = Ports<Vector>;
///     fn expand(self, scope: &mut Scope<'_>) -> Ports<Vector> {
///         scope.map("channel", Map::each(4, |x| x))
///     }
/// }
///
/// let plan = PopulationPlan::lif();
/// let describe = || {
///     let mut graph = GraphBuilder::new();
///     let channel = graph.add("channel", Channel);
///     let given = graph.add("given", Constant::vector(&[0.3, 0.8, -0.3, 0.0]));
///     graph.connect(&given, &channel.input, Synapse::None);
///     graph
/// };
/// let graph = describe().build(Timebase::default(), &plan, Seed::new(1))?;
/// let bytes = SolvedModel::of(&graph).encode()?;
///
/// let solved = SolvedModel::decode(&bytes)?;
/// assert_eq!(solved.neurons(), 400);
/// let again = describe().build(Timebase::default(), &plan.solved(solved), Seed::new(1))?;
/// # let _ = again;
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, PartialEq, Default)]
pub struct SolvedModel {
    pub(super) layers: BTreeMap<String, Vec<Arc<Solved>>>,
}

/// An error in the content of a solved model's file.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum SolvedError {
    /// A file of another format.
    #[error(
        "not a file of solved populations: {reason}; expected a first line of JSON with `\"format\":\"{FORMAT}\"`"
    )]
    Format {
        /// Why the first line could not be read.
        reason: String,
    },
    /// A file of another version of the format.
    #[error("the file has version {found} of the format; expected version 1 or {VERSION}")]
    Version {
        /// Version of the file.
        found: u64,
    },
    /// A file that is too short or too long.
    #[error(
        "{found} bytes follow the first line; expected {expected}: the file is truncated or has extra bytes"
    )]
    Length {
        /// Number of bytes after the first line.
        found: usize,
        /// Number of bytes that the first line states.
        expected: usize,
    },
    /// A file whose numbers do not match their checksum, or are not finite.
    #[error(
        "the numbers do not match their checksum; the file is damaged, so solve the model again"
    )]
    Damaged,
    /// A model whose description cannot be written as JSON.
    #[error("cannot write the first line as JSON: {reason}")]
    Unwritable {
        /// Reason that the JSON writer gives.
        reason: String,
    },
    /// A population of an impossible shape.
    #[error(
        "layer `{path}` has a population of an impossible shape; expected ensembles of 1 to 10000 neurons"
    )]
    Shape {
        /// Path of the layer.
        path: String,
    },
}

/// The error of reading a solved model from a file.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum SolvedFileError {
    /// The file cannot be read.
    #[error(transparent)]
    File(#[from] FileError),
    /// The file's content is invalid.
    #[error("{}: {source}", file.display())]
    Content {
        /// Path of the file.
        file: PathBuf,
        /// Error in the content.
        source: SolvedError,
    },
}

const FORMAT: &str = "symbolt-solved";
const VERSION: u64 = 2;

/// Maximum length of the first line, in bytes. A layer takes about 250.
const MAX_HEADER: usize = 4 << 20;

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Header {
    format: String,
    version: u64,
    layers: BTreeMap<String, Vec<Entry>>,
    /// CRC-32 of `layers` as JSON and of all numbers.
    checksum: u32,
}

impl Header {
    fn checksum(&self, payload: &[u8]) -> Result<u32, SolvedError> {
        let mut hasher = crc32fast::Hasher::new();
        hasher.update(&json_bytes(&self.layers)?);
        hasher.update(payload);
        Ok(hasher.finalize())
    }
}

fn json_bytes(value: &impl Serialize) -> Result<Vec<u8>, SolvedError> {
    serde_json::to_vec(value).map_err(|e| SolvedError::Unwritable { reason: e.to_string() })
}

/// The fields of the first line that every version of the format has.
#[derive(Deserialize)]
struct Beginning {
    format: String,
    version: u64,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Entry {
    fingerprint: u64,
    shape: Shape,
    /// Files of version 1 repeat here what is in the fingerprint: the output and constants of the neuron model.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    firing: Option<String>,
    silencing: Real,
    quiet: Real,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    constants: Option<BTreeMap<String, Real>>,
}

impl Entry {
    /// Lengths of the arrays of encoders, biases and decoders. `None` if the shape is impossible.
    fn lengths(&self) -> Option<[usize; 3]> {
        let shape = self.shape;
        let possible = (1..=10_000).contains(&shape.neurons)
            && shape.ensembles > 0
            && shape.dims > 0
            && shape.outputs > 0
            && (!shape.hadamard || hadamard::DIMS.contains(&shape.dims));
        if !possible {
            return None;
        }
        let biases = shape.ensembles.checked_mul(shape.neurons.checked_add(128)?)?;
        biases.checked_mul(shape.dims.max(shape.outputs))?.checked_mul(16)?;
        let biases = shape.ensembles * shape.padded();
        Some([biases * shape.columns(), biases, biases * shape.outputs])
    }
}

impl SolvedModel {
    /// Returns the paths of the layers, in alphabetical order.
    pub fn paths(&self) -> impl Iterator<Item = &str> {
        self.layers.keys().map(String::as_str)
    }

    /// Returns the number of neurons in all layers.
    pub fn neurons(&self) -> usize {
        let shapes = self.layers.values().flatten().map(|solved| solved.shape);
        shapes.map(|shape| shape.ensembles * shape.neurons).sum()
    }

    /// Returns the content of a file that [`read`](Self::read) can load. Costs one copy of the model.
    ///
    /// # Errors
    /// [`SolvedError::Unwritable`] if the first line cannot be written as JSON. No known model causes this.
    pub fn encode(&self) -> Result<Vec<u8>, SolvedError> {
        let mut payload = Vec::new();
        let mut entries = BTreeMap::new();
        for (path, solved) in &self.layers {
            let entry = |solved: &Arc<Solved>| Entry {
                fingerprint: solved.fingerprint,
                shape: solved.shape,
                firing: None,
                silencing: solved.silencing,
                quiet: solved.quiet,
                constants: None,
            };
            entries.insert(path.clone(), solved.iter().map(entry).collect());
            for solved in solved {
                for part in [&solved.encoders, &solved.biases, &solved.decoders] {
                    payload.extend(part.iter().flat_map(|v| v.to_le_bytes()));
                }
            }
        }
        let mut header =
            Header { format: FORMAT.into(), version: VERSION, layers: entries, checksum: 0 };
        header.checksum = header.checksum(&payload)?;
        let mut bytes = json_bytes(&header)?;
        bytes.push(b'\n');
        bytes.extend(payload);
        Ok(bytes)
    }

    /// Returns whether `bytes` begin like the file of a solved model.
    pub fn recognises(bytes: &[u8]) -> bool {
        bytes.starts_with(format!("{{\"format\":\"{FORMAT}\"").as_bytes())
    }

    /// Reads a file with the bytes of [`encode`](Self::encode). The path `-` reads standard input.
    ///
    /// # Errors
    /// [`SolvedFileError::File`] if `path` is not a regular file or cannot be read; [`SolvedFileError::Content`] if
    /// the content has another format or version, or is damaged.
    pub fn read(path: &Path) -> Result<Self, SolvedFileError> {
        let content = |source| SolvedFileError::Content { file: path.into(), source };
        Self::decode(&read_file(path, Limit::MODEL)?).map_err(content)
    }

    /// Decodes the bytes of [`encode`](Self::encode).
    ///
    /// # Errors
    /// [`SolvedError::Format`], [`Version`](SolvedError::Version), [`Length`](SolvedError::Length),
    /// [`Shape`](SolvedError::Shape) or [`Damaged`](SolvedError::Damaged) if `encode` did not write these bytes.
    pub fn decode(bytes: &[u8]) -> Result<Self, SolvedError> {
        let not_one = |reason: String| SolvedError::Format { reason };
        let end = bytes.iter().position(|b| *b == b'\n');
        let end = end.ok_or_else(|| not_one("it has no first line".into()))?;
        let (line, payload) = (&bytes[..end], &bytes[end + 1..]);
        if line.len() > MAX_HEADER {
            let long = line.len();
            return Err(not_one(format!(
                "its first line has {long} bytes; expected at most {MAX_HEADER}"
            )));
        }
        let start: Beginning =
            serde_json::from_slice(line).map_err(|error| not_one(error.to_string()))?;
        if start.format != FORMAT {
            return Err(not_one(format!("its format is `{}`", start.format)));
        }
        if !(1..=VERSION).contains(&start.version) {
            return Err(SolvedError::Version { found: start.version });
        }
        let header: Header =
            serde_json::from_slice(line).map_err(|error| not_one(error.to_string()))?;
        let mut expected = 0usize;
        for (path, entries) in &header.layers {
            for entry in entries {
                let shape = || SolvedError::Shape { path: path.clone() };
                let lengths = entry.lengths().ok_or_else(shape)?;
                let bytes = lengths.iter().map(|l| 4 * l).sum();
                expected = expected.checked_add(bytes).ok_or_else(shape)?;
            }
        }
        if payload.len() != expected {
            return Err(SolvedError::Length { found: payload.len(), expected });
        }
        let (fours, _) = payload.as_chunks::<4>();
        let finite = fours.iter().all(|four| Real::from_le_bytes(*four).is_finite());
        if header.checksum(payload)? != header.checksum || !finite {
            return Err(SolvedError::Damaged);
        }
        let mut rest = payload;
        let mut take = |count: usize| -> Vec<Real> {
            let (own, after) = rest.split_at(4 * count);
            rest = after;
            let (fours, _) = own.as_chunks::<4>();
            fours.iter().map(|four| Real::from_le_bytes(*four)).collect()
        };
        let mut layers = BTreeMap::new();
        for (path, entries) in header.layers {
            let mut solved = Vec::with_capacity(entries.len());
            for entry in entries {
                let Some([encoders, biases, decoders]) = entry.lengths() else {
                    return Err(SolvedError::Shape { path });
                };
                solved.push(Arc::new(Solved {
                    shape: entry.shape,
                    fingerprint: entry.fingerprint,
                    encoders: take(encoders),
                    biases: take(biases),
                    decoders: take(decoders),
                    silencing: entry.silencing,
                    quiet: entry.quiet,
                    own: None,
                }));
            }
            layers.insert(path, solved);
        }
        Ok(Self { layers })
    }

    /// Returns the population of the layer at `path` that has this fingerprint and shape.
    pub(super) fn find(
        &self,
        path: &str,
        fingerprint: u64,
        shape: Shape,
    ) -> Result<Arc<Solved>, TuningError> {
        let solved = self.layers.get(path).ok_or(TuningError::Missing)?;
        let fits =
            |solved: &&Arc<Solved>| (solved.fingerprint, solved.shape) == (fingerprint, shape);
        solved.iter().find(fits).cloned().ok_or(TuningError::Mismatch)
    }
}
