//! Gaussian noise.

use rand::RngExt;
use rand_distr::StandardNormal;

use crate::sim::describe::builder::{Module, Scope};
use crate::sim::describe::fingerprint::Fingerprint;
use crate::sim::describe::handle::Ports;
use crate::sim::describe::io::{EmitIo, StepCx};
use crate::sim::describe::kind::{Kind, Pointer, Scalar, Space, Vector, VocabTag};
use crate::sim::describe::node::Node;
use crate::sim::describe::port::{InputSpec, OutputSpec, PortDecl};
use crate::sim::real::Real;

/// Adds independent Gaussian noise to every component in every tick, without delay. For noise as a signal of its own, also
/// filtered or integrated, see [`WhiteNoise`](crate::sim::WhiteNoise).
///
/// The noise depends only on run seed, path and tick. The run multiplies the noise by its noise scale
/// ([`RunConfig::noise`](crate::sim::RunConfig::noise)). At scale 0 the output has the same bits as the input. A standard
/// deviation that is negative or not finite is a fault when the graph is built.
pub struct Noise<K: Kind> {
    input: InputSpec<K>,
    output: OutputSpec<K>,
    sd: Real,
    white: bool,
}

impl<K: Kind> Noise<K> {
    /// Scales the standard deviation with the tick, as white noise needs: the given one holds for ticks of 1 ms, and is
    /// multiplied by `sqrt(1 ms / tick)`. The noise behind a synapse is then about the same for every tick.
    pub fn white(mut self) -> Self {
        self.white = true;
        self
    }
}

impl Noise<Scalar> {
    /// Creates noise with standard deviation `sd` for a number.
    pub fn scalar(sd: Real) -> Self {
        Self { input: InputSpec::scalar(), output: OutputSpec::scalar(), sd, white: false }
    }
}

impl Noise<Vector> {
    /// Creates noise with standard deviation `sd` for each of the `width` components of a vector.
    pub fn vector(width: usize, sd: Real) -> Self {
        Self {
            input: InputSpec::vector(width),
            output: OutputSpec::vector(width),
            sd,
            white: false,
        }
    }
}

impl<V: VocabTag> Noise<Pointer<V>> {
    /// Creates noise with a norm of about `sigma` for a pointer of D dimensions: the standard deviation of each
    /// component is `sigma / sqrt(D)`.
    pub fn pointer(space: &Space<V>, sigma: Real) -> Self {
        let sd = sigma / (space.width() as Real).sqrt();
        Self {
            input: InputSpec::pointer(space),
            output: OutputSpec::pointer(space),
            sd,
            white: false,
        }
    }
}

impl<K: Kind> Node for Noise<K> {
    fn declare(&self, ports: &mut PortDecl) {
        if !self.sd.is_finite() || self.sd < 0.0 {
            ports.fault(format!(
                "a standard deviation of {} is not usable; use a finite number of at least 0",
                self.sd
            ));
        }
        ports.input("in", self.input.clone()).output("out", self.output.clone());
    }

    fn fingerprint(&self, hash: &mut Fingerprint) {
        hash.reals(&[self.sd]);
        if self.white {
            hash.text("white");
        }
    }

    fn emit(&self, cx: &StepCx<'_>, io: &mut EmitIo<'_>) {
        let input = io.inputs.get(0);
        let output = io.outputs.get_mut(0);
        output.copy_from_slice(input);
        let per_tick = if self.white { (1e-3 / cx.dt_s()).sqrt() as Real } else { 1.0 };
        let sd = self.sd * per_tick * cx.noise_scale();
        if sd > 0.0 {
            let mut rng = cx.rng();
            for value in output {
                let draw: Real = rng.sample(StandardNormal);
                *value += sd * draw;
            }
        }
    }
}

impl<K: Kind> Module for Noise<K> {
    type Ports = Ports<K>;

    fn expand(self, scope: &mut Scope<'_>) -> Ports<K> {
        let node = scope.leaf(self);
        scope.ports(Ports::of(&node))
    }
}
