#!/usr/bin/env python3
"""Writes the fixtures of `src/neurons/conformance.rs`: parameters, inputs, spikes and outputs of ensembles, as Nengo
computes them.

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
    fixtures = {name: lambda name=name: one(name) for name in CASES}
    fixtures["models"] = models
    fixtures["solvers"] = solvers
    for name, make in fixtures.items():
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
