//! Linear nodes with few weights that are not zero.

use super::linear::Linear;
use crate::sim::{Fingerprint, InputSpec, OutputSpec, Real, Scratch, ScratchSpec, Vector};
use crate::spa::algebra::LinearMap;

impl Linear<Vector, Vector> {
    /// Makes a node that takes `from` numbers and gives `to` numbers. Each weight is the position of an input, the
    /// position of an output, and a factor; factors of the same pair add up.
    ///
    /// An input of zero costs nothing. Each other input costs O(its weights) per tick. A position outside the vectors is
    /// a fault when the graph is built.
    ///
    /// ```
    /// use symbolt::prelude::*;
    /// use symbolt::spa::Linear;
    ///
    /// let mut graph = GraphBuilder::new();
    /// let input = graph.add("input", Constant::vector(&[1.0, 2.0, 3.0]));
    /// let sums = graph.add("sums", Linear::sparse(3, 2, [(0, 0, 1.0), (2, 0, 1.0), (1, 1, -1.0)]));
    /// graph.connect(&input, &sums.input, Synapse::None);
    /// let probe = graph.probe(&sums.output, ProbeSpec::default());
    /// let graph = graph.build(Timebase::default(), &PopulationPlan::default(), Seed::new(1))?;
    /// let mut sim = Simulator::new(graph.into(), RunConfig::default())?;
    /// sim.run_for(SimDuration::from_millis(1))?;
    /// assert_eq!(sim.samples(&probe).last().expect("one tick").1, [4.0, -2.0]);
    /// # Ok::<(), symbolt::sim::SimError>(())
    /// ```
    pub fn sparse(
        from: usize,
        to: usize,
        weights: impl IntoIterator<Item = (usize, usize, Real)>,
    ) -> Self {
        let mut columns = vec![Vec::new(); from];
        let mut fault = None;
        for (input, output, factor) in weights {
            match columns.get_mut(input) {
                Some(column) if output < to => column.push((output as u32, factor)),
                _ => {
                    fault = Some(format!(
                        "the weight from {input} to {output} is outside the node; it has {from} inputs and {to} outputs, counted from 0"
                    ));
                }
            }
        }
        let map = Sparse { to, columns };
        Self::new(InputSpec::vector(from), OutputSpec::vector(to), Box::new(map)).with_fault(fault)
    }
}

/// A matrix by columns: for each input, the outputs that it reaches.
struct Sparse {
    to: usize,
    columns: Vec<Vec<(u32, Real)>>,
}

impl LinearMap for Sparse {
    fn input_width(&self) -> usize {
        self.columns.len()
    }

    fn output_width(&self) -> usize {
        self.to
    }

    fn scratch(&self) -> ScratchSpec {
        ScratchSpec::default()
    }

    fn fingerprint(&self, hash: &mut Fingerprint) {
        hash.text("sparse").number(self.to as u64);
        for column in &self.columns {
            hash.number(column.len() as u64);
            for (output, factor) in column {
                hash.number(u64::from(*output)).reals(&[*factor]);
            }
        }
    }

    fn apply_into(&self, input: &[Real], out: &mut [Real], _scratch: &mut Scratch<'_>) {
        out.fill(0.0);
        for (value, column) in input.iter().zip(&self.columns) {
            if *value != 0.0 {
                for (output, factor) in column {
                    out[*output as usize] += value * factor;
                }
            }
        }
    }
}
