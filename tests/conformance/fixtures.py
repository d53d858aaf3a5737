#!/usr/bin/env python3
"""Writes the fixtures of `src/neurons/conformance.rs`: parameters, inputs, spikes and outputs of ensembles, as Nengo
computes them; of `tests/engine/synapses.rs`: outputs of synapses and interpolated signals; and of
`tests/engine/learning.rs`: weights that rules have learned.

Usage: fixtures.py FOLDER             writes the fixtures
       fixtures.py FOLDER --compare   fails if the fixtures in FOLDER differ from what Nengo computes now

Needs nengo, numpy and scipy. Uses only Nengo's public interface and its results.
"""

import pathlib
import sys

import nengo
import numpy as np
import scipy.optimize

DT = 0.001
STEPS = 1000
SYNAPSE = 0.005

# name: dimensions, neurons, decoded function (None: the identity), amplitude of the input
CASES = {
    "scalar": (1, 100, None, 0.9),
    "square": (1, 100, lambda x: x**2, 0.9),
    "pointer_part": (4, 160, None, 0.8),
}


def signal(dims, amplitude, seed):
    """Returns a signal of three slow sine waves per dimension, reproducible from the seed."""
    rng = np.random.RandomState(seed)
    rates = rng.uniform(0.5, 4.0, size=(3, dims))
    phases = rng.uniform(0, 2 * np.pi, size=(3, dims))
    time = DT * np.arange(1, STEPS + 1)
    waves = np.sin(2 * np.pi * rates[None] * time[:, None, None] + phases[None])
    return amplitude / np.sqrt(dims) * waves.mean(axis=1) * np.sqrt(3)


def one(name, seed=7):
    """Runs two ensembles: a signal drives the first, and its decoded output drives the second."""
    dims, neurons, function, amplitude = CASES[name]
    given = signal(dims, amplitude, seed)
    with nengo.Network(seed=seed) as net:
        source = nengo.Node(lambda t: given[min(int(round(t / DT)) - 1, STEPS - 1)])
        rest = {"voltage": nengo.dists.Choice([0.0])}
        kind = dict(neuron_type=nengo.LIF(tau_rc=0.02, tau_ref=0.002, initial_state=rest),
                    max_rates=nengo.dists.Uniform(200, 400))
        first = nengo.Ensemble(neurons, dims, **kind)
        second = nengo.Ensemble(neurons, dims, **kind)
        nengo.Connection(source, first, synapse=None)
        relay = nengo.Node(size_in=dims)
        chain = dict(solver=nengo.solvers.LstsqL2(reg=0.1))
        between = nengo.Connection(first, relay, function=function, synapse=SYNAPSE, **chain)
        nengo.Connection(relay, second, synapse=None)
        end = nengo.Node(size_in=dims)
        after = nengo.Connection(second, end, synapse=None, **chain)
        spikes = [nengo.Probe(e.neurons, synapse=None) for e in (first, second)]
        middle = nengo.Probe(relay, synapse=None)
        out = nengo.Probe(end, synapse=None)
    with nengo.Simulator(net, dt=DT, progress_bar=False) as sim:
        sim.run_steps(STEPS)
        held = {"input": given, "middle": sim.data[middle], "output": sim.data[out]}
        for place, ensemble, connection in (("first", first, between), ("second", second, after)):
            built = sim.data[ensemble]
            held[f"{place}_encoders"] = np.array(built.encoders)
            held[f"{place}_gains"] = np.array(built.gain)
            held[f"{place}_biases"] = np.array(built.bias)
            held[f"{place}_decoders"] = np.array(sim.data[connection].weights)
        for place, probe in zip(("first", "second"), spikes):
            held[f"{place}_spikes"] = (sim.data[probe] > 0).astype(np.uint8)
    return held


# Synapses, by the name that the test knows them by. Times in seconds.
SYNAPSES = {
    "lowpass_5ms": nengo.Lowpass(0.005),
    "lowpass_30ms": nengo.Lowpass(0.03),
    "lowpass_1s": nengo.Lowpass(1.0),
    "alpha_5ms": nengo.Alpha(0.005),
    "alpha_30ms": nengo.Alpha(0.03),
    "alpha_1s": nengo.Alpha(1.0),
    "rise_2ms_decay_20ms": nengo.LinearFilter([1], [0.002 * 0.02, 0.022, 1]),
    "rise_10ms_decay_1s": nengo.LinearFilter([1], [0.01, 1.01, 1]),
    "triangle_5ms": nengo.synapses.Triangle(0.005),
    "triangle_30ms": nengo.synapses.Triangle(0.03),
    "triangle_1s": nengo.synapses.Triangle(1.0),
    "lead_10ms_20ms": nengo.LinearFilter([0.01, 1], [0.02, 1]),
    "integrator": nengo.LinearFilter([1], [1, 0]),
    "gain": nengo.LinearFilter([2], [3]),
    "damped_5hz": nengo.LinearFilter([2.0, 1000.0], [1.0, 10.0, 1000.0]),
    "biproper_third": nengo.LinearFilter([1e-6, 2e-4, 0.03, 1], [8e-6, 1.2e-3, 0.06, 1]),
    "sixth_100ms": nengo.LinearFilter([1], np.poly([-10.0] * 6) / 1e6),
    "delay_3ms": nengo.LinearFilter([1], [1, 0, 0, 0], analog=False),
}


def told(k):
    """Returns a step, an impulse and a rough input for tick `k` from 0."""
    return [1.0, float(k == 0), ((7919 * k * k + 13 * k) % 1009 - 504) / 512]


def synapses(steps=3000):
    """Runs every synapse on a connection and in a probe; ticks 1 to 40, then every 60th."""
    kept = np.r_[0:40, 59:steps:60]
    held = {"ticks": kept.astype(np.float64)}
    with nengo.Network() as net:
        source = nengo.Node(lambda t: told(int(round(t / DT)) - 1), size_out=3)
        probes = {}
        for name, synapse in SYNAPSES.items():
            relay = nengo.Node(size_in=3)
            nengo.Connection(source, relay, synapse=synapse)
            probes[name] = nengo.Probe(relay, synapse=None)
        probed = nengo.Probe(source, synapse=nengo.Alpha(0.005))
    with nengo.Simulator(net, dt=DT, progress_bar=False) as sim:
        sim.run_steps(steps)
        held.update({name: sim.data[probe][kept] for name, probe in probes.items()})
        held["probed_alpha_5ms"] = sim.data[probed][kept]
    return held


def interpolations():
    """Interpolates the same points by every rule that both have; times as the ends of ticks."""
    points = {0.0: 0.25, 0.05: 1.0, 0.08: -1.0, 0.1: 0.0, 0.131: 0.5, 0.19: 0.3}
    held = {"times": np.array(list(points)), "values": np.array(list(points.values()))}
    for rule in ("linear", "nearest", "cubic"):
        process = nengo.processes.Piecewise(points, interpolation=rule)
        held[rule] = process.run_steps(189, dt=DT)[:, 0]
    return held


# --- Learning: the file `learning.npz` ---

LEARN_STEPS = 10_000


def wave(t, dims, hz):
    """Slow sine waves, one per component, which the tests compute by the same formula."""
    return np.array([0.8 * np.sin(2 * np.pi * hz * (i + 1) * t + i) for i in range(dims)])


class Learning:
    """Networks of rate neurons with given parameters, so that nothing but the rule decides the weights."""

    def __init__(self):
        self.rng = np.random.RandomState(11)
        self.held = {}

    def cells(self, name, count, dims, gain=None):
        """Returns an ensemble of rate neurons. With a gain, all neurons have this gain and a bias of 1."""
        encoders = self.rng.normal(size=(count, dims))
        encoders /= np.linalg.norm(encoders, axis=1, keepdims=True)
        gains = self.rng.uniform(1.0, 4.0, count) if gain is None else np.full(count, gain)
        biases = self.rng.uniform(0.5, 3.0, count) if gain is None else np.ones(count)
        self.held.update({f"{name}_encoders": encoders, f"{name}_gains": gains, f"{name}_biases": biases})
        return nengo.Ensemble(count, dims, neuron_type=nengo.LIFRate(), encoders=encoders,
                              gain=nengo.dists.Choice([gain]) if gain else gains, bias=biases)

    def finish(self, net, probes):
        """Runs a network and keeps the last sample of each probe, by name."""
        with net:
            made = {name: nengo.Probe(of, attribute, synapse=None) for name, (of, attribute) in probes.items()}
        with nengo.Simulator(net, dt=DT, progress_bar=False) as sim:
            # The change of a tick is added at the beginning of the next one.
            sim.run_steps(LEARN_STEPS + 1)
            for name, probe in made.items():
                self.held[name] = np.array(sim.data[probe][-1])

    def decoded(self, name, rules, state=None):
        """Learns a function of a wave by an error that passes two synapses."""
        with nengo.Network(seed=1) as net:
            given = nengo.Node(lambda t: wave(t, 1, 0.7))
            wanted = nengo.Node(lambda t: wave(t, 1, 0.7) ** 2)
            pre = self.cells(name, 20, 1)
            nengo.Connection(given, pre, synapse=None)
            out, error = nengo.Node(size_in=1), nengo.Node(size_in=1)
            learned = nengo.Connection(pre, out, synapse=SYNAPSE, learning_rule_type=rules,
                                       function=lambda x: [0.0], solver=nengo.solvers.NoSolver())
            nengo.Connection(out, error, synapse=None)
            nengo.Connection(wanted, error, synapse=None, transform=-1)
            made = learned.learning_rule
            made = list(made.values()) if isinstance(made, dict) else [made]
            for rule in made:
                nengo.Connection(error, rule, synapse=SYNAPSE)
        probes = {f"{name}_weights": (learned, "weights")}
        if state:
            probes[f"{name}_{state}"] = (made[0], state)
        self.finish(net, probes)

    def between(self, name, rules, state=None):
        """Learns weights between the neurons of two ensembles."""
        with nengo.Network(seed=1) as net:
            given = nengo.Node(lambda t: wave(t, 2, 0.7))
            pre, post = self.cells(f"{name}_pre", 12, 2), self.cells(f"{name}_post", 8, 2)
            nengo.Connection(given, pre, synapse=None)
            nengo.Connection(given, post, synapse=None)
            start = self.rng.uniform(0, 1e-3, size=(8, 12))
            self.held[f"{name}_start"] = start
            learned = nengo.Connection(pre.neurons, post.neurons, transform=start, synapse=SYNAPSE,
                                       learning_rule_type=rules)
            made = learned.learning_rule
            made = list(made.values()) if isinstance(made, dict) else [made]
        probes = {f"{name}_weights": (learned, "weights")}
        if state:
            probes[f"{name}_{state}"] = (made[0], state)
        self.finish(net, probes)

    def encoders(self, name):
        """Learns the encoders of an ensemble, while a signal says so."""
        with nengo.Network(seed=1) as net:
            given = nengo.Node(lambda t: wave(t, 2, 0.7))
            signal = nengo.Node(lambda t: 0.0 if t < 6.0005 else -1.0)
            post = self.cells(name, 25, 2, gain=2.0)
            learned = nengo.Connection(given, post, synapse=SYNAPSE, learning_rule_type=nengo.Voja(learning_rate=0.003))
            nengo.Connection(signal, learned.learning_rule, synapse=None)
        self.finish(net, {f"{name}_scaled": (learned.learning_rule, "scaled_encoders")})

    def all(self):
        self.decoded("pes", nengo.PES(learning_rate=1e-3))
        self.decoded("slow_pes", nengo.PES(learning_rate=1e-3, pre_synapse=0.03))
        self.decoded("rls", nengo.RLS(learning_rate=1e-3), "inv_gamma")
        self.decoded("both", {"a": nengo.PES(learning_rate=1e-3), "b": nengo.RLS(learning_rate=1e-4)})
        self.between("oja", nengo.Oja(learning_rate=1e-6, beta=1e3))
        self.between("bcm", nengo.BCM(learning_rate=1e-10), "theta")
        self.between("mixed", {"a": nengo.Oja(learning_rate=1e-6, beta=1e3), "b": nengo.BCM(learning_rate=1e-10)})
        self.encoders("voja")
        return self.held


# name of a neuron model here: its type, its settings, and the values that its state starts at
MODELS = {
    "lif": (nengo.LIF, {}, dict(voltage=0, refractory_time=0)),
    "adaptive_lif": (nengo.AdaptiveLIF, {}, dict(voltage=0, refractory_time=0, adaptation=0)),
    "adaptive_lif_rate": (nengo.AdaptiveLIFRate, dict(tau_n=0.2), dict(adaptation=0)),
    "rectified_linear": (nengo.RectifiedLinear, {}, {}),
    "spiking_rectified_linear": (nengo.SpikingRectifiedLinear, {}, dict(voltage=0.3)),
    "sigmoid": (nengo.Sigmoid, {}, {}),
    "tanh": (nengo.Tanh, {}, {}),
    "regular_tanh": (nengo.RegularSpiking, dict(base_type=nengo.Tanh()), dict(voltage=0.3)),
    "regular_lif": (nengo.RegularSpiking, dict(base_type=nengo.LIFRate()), dict(voltage=0.3)),
}
# the types of Izhikevich 2003: a, b, c, d
for name, (a, b, c, d) in {
    "rs": (0.02, 0.2, -65, 8),
    "ib": (0.02, 0.2, -55, 4),
    "ch": (0.02, 0.2, -50, 2),
    "fs": (0.1, 0.2, -65, 8),
    "lts": (0.02, 0.25, -65, 8),
    "rz": (0.1, 0.26, -65, 8),
}.items():
    settings = dict(tau_recovery=a, coupling=b, reset_voltage=c, reset_recovery=d)
    MODELS[f"izhikevich_{name}"] = (nengo.Izhikevich, settings, dict(voltage=-65, recovery=-13))


def activities(kind, currents):
    """Returns the activities of neurons at constant currents: a row per tick."""
    count = len(currents)
    with nengo.Network(seed=1) as net:
        neurons = nengo.Ensemble(
            count, 1, neuron_type=kind, gain=np.ones(count), bias=np.zeros(count)
        ).neurons
        nengo.Connection(nengo.Node(currents), neurons, synapse=None)
        probe = nengo.Probe(neurons, synapse=None)
    with nengo.Simulator(net, dt=DT, progress_bar=False, optimize=False) as sim:
        sim.run_steps(STEPS)
        return np.array(sim.data[probe])


def models():
    """Returns rates, gains and biases of neuron models, and their activities over a second at constant currents."""
    held = {
        "currents": np.array([-31.3, -2.1, -0.37, 0.0, 0.53, 1.07, 1.5, 2.0, 3.1, 5.3, 10.7, 23.9, 77.7]),
        "max_rates": np.array([207.0, 251.0, 318.0, 389.0]),
        "intercepts": np.array([-0.9, 0.0, 0.37, 0.85]),
    }
    for name, (kind, settings, start) in MODELS.items():
        start = {key: nengo.dists.Choice([value]) for key, value in start.items()}
        kind = kind(initial_state=start, **settings)
        one = np.ones(1)
        held[f"{name}_rates"] = kind.rates(held["currents"][:, None], one, 0 * one)[:, 0]
        built = kind.gain_bias(held["max_rates"], held["intercepts"])
        held[f"{name}_gain_bias"] = np.array(built)
        all = activities(kind, held["currents"])
        if not kind.spiking:
            held[f"{name}_activities"] = all[99::300]
        else:
            held[f"{name}_spikes"] = np.rint(all * DT).astype(float)
    return held


def solvers():
    """Returns rates of a small ensemble at points, targets there, and the decoders of Nengo's and scipy's solvers."""
    rng = np.random.RandomState(5)
    kind = nengo.LIF()
    gain, bias = kind.gain_bias(rng.uniform(200, 400, 24), rng.uniform(-0.9, 0.8, 24))
    points = rng.uniform(-1, 1, (80, 1))
    encoders = rng.choice([-1.0, 1.0], (24, 1))
    rates = kind.rates(points @ encoders.T, gain, bias)
    targets = np.concatenate([points, points**2], axis=1)
    held = {"rates": rates, "targets": targets}
    for name, solver in {
        "l2": nengo.solvers.LstsqL2(reg=0.1),
        "l2_weak": nengo.solvers.LstsqL2(reg=0.01),
        "plain": nengo.solvers.Lstsq(rcond=0.01),
        "non_negative": nengo.solvers.Nnls(),
    }.items():
        held[name] = solver(rates, targets, rng=rng)[0]
    # The least penalised error among decoders of at least 0. Nengo's NnlsL2 takes the least error of the normal equations
    # instead, which is another problem.
    ridge = 0.1 * rates.max() * np.sqrt(len(rates)) * np.eye(24)
    below = np.zeros((24, 2))
    system, wanted = np.concatenate([rates, ridge]), np.concatenate([targets, below])
    columns = [scipy.optimize.nnls(system, column)[0] for column in wanted.T]
    held["non_negative_l2"] = np.array(columns).T
    return held


def main():
    folder = pathlib.Path(sys.argv[1])
    compare = "--compare" in sys.argv[2:]
    bad = 0
    makers = {name: lambda name=name: one(name) for name in CASES}
    makers |= {"synapses": synapses, "interpolations": interpolations, "learning": lambda: Learning().all()}
    makers |= {"models": models, "solvers": solvers}
    for name, make in makers.items():
        path, now = folder / f"{name}.npz", make()
        if not compare:
            np.savez_compressed(path, **now)
            print(f"{path}: {sum(int(v.sum()) for k, v in now.items() if 'spikes' in k)} spikes")
            continue
        with np.load(path) as before:
            for key in sorted(set(now) | set(before.files)):
                if key not in now or key not in before.files:
                    same = False
                elif key.endswith("spikes"):
                    same = np.array_equal(now[key], before[key])
                else:
                    same = np.allclose(now[key], before[key], rtol=1e-9, atol=1e-12)
                if not same:
                    print(f"{path}: `{key}` differs from what nengo {nengo.__version__} computes")
                    bad += 1
    if compare and not bad:
        print(f"the fixtures agree with nengo {nengo.__version__}")
    sys.exit(1 if bad else 0)


if __name__ == "__main__":
    main()
