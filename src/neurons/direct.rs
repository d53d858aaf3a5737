//! Direct mode: the layers as exact functions, with the delays of a population but without its noise.

use crate::sim::{
    AdvanceIo, Fingerprint, LayerRequest, Node, NodeFault, PortDecl, Real, StateSpec, StepCx,
};

use super::layer::{EVIDENCE_THRESHOLD, INHIBITION, Map, Product, Represent, Select, SelectRule};

/// Passes its input on. If the norm exceeds the radius, scales the value back to the radius. If there is a gate,
/// scales the value by the gate.
pub(crate) struct DirectRepresent(pub Represent);

impl Node for DirectRepresent {
    fn declare(&self, ports: &mut PortDecl) {
        self.0.declare(ports);
    }

    fn fingerprint(&self, hash: &mut Fingerprint) {
        hash.reals(&[self.0.radius]).number(u64::from(self.0.gated));
    }

    fn advance(&self, _cx: &StepCx<'_>, io: &mut AdvanceIo<'_>) -> Result<(), NodeFault> {
        let input = io.inputs.get(0);
        let output = io.outputs.get_mut(0);
        let square: Real = input.iter().map(|v| v * v).sum();
        let limit = self.0.radius;
        let open = if self.0.gated { io.inputs.scalar(1).clamp(0.0, 1.0) } else { 1.0 };
        let clamp = match square > limit * limit {
            true if square.is_finite() => limit / square.sqrt(),
            // The square exceeds single precision.
            true => {
                let square: f64 = input.iter().map(|v| f64::from(*v).powi(2)).sum();
                (f64::from(limit) / square.sqrt()) as Real
            }
            false => 1.0,
        };
        let scale = open * clamp;
        if scale != 1.0 {
            for (out, value) in output.iter_mut().zip(input) {
                *out = value * scale;
            }
        } else {
            output.copy_from_slice(input);
        }
        Ok(())
    }
}

pub(crate) struct DirectMap(pub Map);

impl Node for DirectMap {
    fn declare(&self, ports: &mut PortDecl) {
        self.0.declare(ports);
    }

    /// Hashes the function's values at evenly spaced points, because the function itself cannot be hashed.
    fn fingerprint(&self, hash: &mut Fingerprint) {
        let (half, radius) = (128i16, self.0.radius);
        let at = |i: i16| radius * Real::from(i) / Real::from(half);
        let values: Vec<Real> = (-half..=half).map(|i| (self.0.function)(at(i))).collect();
        hash.reals(&values);
    }

    fn advance(&self, _cx: &StepCx<'_>, io: &mut AdvanceIo<'_>) -> Result<(), NodeFault> {
        let input = io.inputs.get(0);
        for (out, value) in io.outputs.get_mut(0).iter_mut().zip(input) {
            *out = (self.0.function)(*value);
        }
        Ok(())
    }
}

pub(crate) struct DirectProduct(pub Product);

impl Node for DirectProduct {
    fn declare(&self, ports: &mut PortDecl) {
        self.0.declare(ports);
    }

    fn fingerprint(&self, _hash: &mut Fingerprint) {}

    fn advance(&self, _cx: &StepCx<'_>, io: &mut AdvanceIo<'_>) -> Result<(), NodeFault> {
        let (a, b) = (io.inputs.get(0), io.inputs.get(1));
        for ((out, a), b) in io.outputs.get_mut(0).iter_mut().zip(a).zip(b) {
            *out = a * b;
        }
        Ok(())
    }
}

pub(crate) struct DirectSelect(pub Select);

impl Node for DirectSelect {
    fn declare(&self, ports: &mut PortDecl) {
        self.0.declare(ports);
        if let SelectRule::IndependentAccumulators { .. } = self.0.rule {
            ports.state(StateSpec { reals: self.0.items, ..StateSpec::default() });
        }
    }

    fn fingerprint(&self, hash: &mut Fingerprint) {
        self.0.rule.fingerprint(hash);
    }

    fn advance(&self, cx: &StepCx<'_>, io: &mut AdvanceIo<'_>) -> Result<(), NodeFault> {
        let (utilities, inhibit) = (io.inputs.get(0), io.inputs.get(1));
        let output = io.outputs.get_mut(0);
        output.fill(0.0);
        let net = utilities.iter().zip(inhibit).map(|(u, i)| u - INHIBITION * i);
        match self.0.rule {
            SelectRule::Threshold { level } => {
                for (out, utility) in output.iter_mut().zip(net) {
                    if utility >= level {
                        *out = 1.0;
                    }
                }
            }
            SelectRule::WinnerTakeAll { level } => {
                let mut best = None;
                let mut most = level;
                for (index, utility) in net.enumerate() {
                    if utility > most || (best.is_none() && utility >= level) {
                        (best, most) = (Some(index), utility);
                    }
                }
                if let Some(index) = best {
                    output[index] = 1.0;
                }
            }
            SelectRule::IndependentAccumulators { level, tau } => {
                let rate = (cx.dt_s() / tau.as_secs_f64()) as Real;
                let evidence = &mut *io.state.reals;
                for ((evidence, utility), inhibit) in
                    evidence.iter_mut().zip(utilities).zip(inhibit)
                {
                    let gathered = *evidence + rate * (utility - level) - INHIBITION * inhibit;
                    *evidence = gathered.clamp(0.0, 1.0);
                }
                // If several items reach the threshold in one tick, the one with the most evidence wins.
                let first = (0..evidence.len())
                    .filter(|i| evidence[*i] >= EVIDENCE_THRESHOLD)
                    .reduce(|best, i| if evidence[i] > evidence[best] { i } else { best });
                if let Some(first) = first {
                    let own = evidence[first];
                    evidence.fill(0.0);
                    (evidence[first], output[first]) = (own, 1.0);
                }
            }
        }
        Ok(())
    }
}
