//! How a connection follows activities through the synapses of its rules.

use std::ops::Range;

use multiversion::multiversion;

use super::Side;
use crate::sim::{Filter, Real, Synapse, SynapseError, Timebase};

/// A synapse of a rule, made discrete, and where its numbers are.
#[derive(Debug)]
pub(super) struct Follower {
    pub of: Side,
    /// The trace: its place in the state of the connection.
    pub trace: Range<usize>,
    by: By,
}

/// How a trace follows. In double precision where it is simple.
#[derive(Debug)]
enum By {
    Copy,
    /// A low-pass with this decay in a tick.
    Lowpass(f64),
    /// Any other filter, with the place of its state in single precision.
    Filter(Filter, Range<usize>),
}

impl Follower {
    /// Makes a synapse discrete. The state of a filter begins at `at` of the numbers in single precision.
    pub fn new(
        of: Side,
        trace: Range<usize>,
        synapse: Synapse,
        (at, time): (usize, Timebase),
    ) -> Result<Self, SynapseError> {
        let filter = Filter::new(synapse, time)?;
        let by = match synapse {
            Synapse::None => By::Copy,
            Synapse::Lowpass { tau } => By::Lowpass((-time.dt_s() / tau.as_secs_f64()).exp()),
            _ => {
                let end = at + filter.state_len(trace.len());
                By::Filter(filter, at..end)
            }
        };
        Ok(Self { of, trace, by })
    }

    /// Number of its numbers in single precision.
    pub fn singles(&self) -> usize {
        if let By::Filter(_, range) = &self.by { range.len() } else { 0 }
    }

    /// Writes the trace of a tick.
    pub fn follow(&self, activity: &[Real], trace: &mut [f64], singles: &mut [Real]) {
        match &self.by {
            By::Copy => copy(activity, trace),
            By::Lowpass(decay) => low_pass(*decay, activity, trace),
            By::Filter(filter, own) => {
                copy(filter.step(activity, &mut singles[own.clone()]), trace)
            }
        }
    }
}

fn copy(from: &[Real], to: &mut [f64]) {
    to.iter_mut().zip(from).for_each(|(to, from)| *to = f64::from(*from));
}

#[multiversion(targets("x86_64+avx2", "x86_64+sse4.1"))]
fn low_pass(decay: f64, input: &[Real], traces: &mut [f64]) {
    for (trace, input) in traces.iter_mut().zip(input) {
        let next = decay * *trace + (1.0 - decay) * f64::from(*input);
        // Subnormal numbers would be slow.
        *trace = if next.abs() < 1e-30 { 0.0 } else { next };
    }
}
