//! What nodes read in a tick.

use std::marker::PhantomData;

use crate::sim::describe::io::{Inputs, Slot, StepCx};
use crate::sim::real::Real;
use crate::sim::seed::Seed;
use crate::sim::time::Timebase;

/// The values that nodes read in a tick. In advance they are the same for all nodes, on every thread.
#[derive(Default)]
pub(crate) struct Stage {
    /// Outputs written in emit, in the order of emits.
    pub signals: Vec<Real>,
    /// Values that stay constant during a tick: registered outputs at its start, then the filters of connections.
    pub held: Vec<Real>,
    /// Sums of several sources, and zeros for unconnected inputs.
    pub gathered: Vec<Real>,
    /// What each node draws its noise from.
    pub random: Vec<Random>,
    pub clock: Clock,
}

/// The seed of a node, and the factor of its noise.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Random {
    pub seed: Seed,
    pub noise: Real,
}

/// The tick that is computed.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Clock {
    pub tick: u64,
    pub time: Timebase,
}

impl Clock {
    /// Returns the context of a call of a node.
    pub fn cx<'a>(self, Random { seed, noise }: Random) -> StepCx<'a> {
        let Self { tick, time } = self;
        let (node_seed, noise_scale) = (seed, noise);
        StepCx { tick, time, noise_scale, node_seed, part: None, graph: PhantomData }
    }
}

impl Stage {
    /// Returns the inputs of a node in advance.
    pub fn inputs<'a>(&'a self, slots: &'a [Slot]) -> Inputs<'a> {
        let Self { signals, held, gathered, .. } = self;
        Inputs { slots, signals, held, gathered }
    }

    /// Returns the context of a call of node number `node`.
    pub fn cx(&self, node: usize) -> StepCx<'_> {
        self.clock.cx(self.random[node])
    }
}
