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


def main():
    folder = pathlib.Path(sys.argv[1])
    compare = "--compare" in sys.argv[2:]
    bad = 0
    for name in CASES:
        path, now = folder / f"{name}.npz", one(name)
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
