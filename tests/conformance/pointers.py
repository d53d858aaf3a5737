#!/usr/bin/env python3
"""Writes the fixture `pointers.npz` of `tests/spa/reference_models.rs`: five vocabularies, and what five models of
nengo_spa do over them: a clean-up, a recall, a parse, a sequence and a routed sequence.

Usage: pointers.py FOLDER             writes the fixture
       pointers.py FOLDER --compare   fails if the fixture in FOLDER differs from what nengo_spa computes now

Needs nengo, nengo_spa and numpy. Uses only their public interface and their results. Takes ten minutes.
"""

import pathlib
import sys

import nengo
import nengo_spa as spa
import numpy as np

SEEDS = range(1, 6)
# Networks that are drawn for each vocabulary where an answer can be wrong.
NETWORKS = 4
# Names of the vocabularies, by their number of dimensions.
PAIRED = ["RED", "BLUE", "CIRCLE", "SQUARE"]
RECALLED = [f"S{i}" for i in range(4)] + [f"M{i}" for i in range(4)]
PARSED = ["WRITE", "ONE", "TWO", "THREE", "NONE", "VERB", "NOUN"]
STATES = [f"S{i}" for i in range(5)]
KINDS = {"paired": (16, PAIRED), "recalled": (16, RECALLED), "parsed": (32, PARSED), "states": (32, STATES)}
FAST = nengo.Lowpass(0.03)


def drawn(kind, seed):
    """Of a hundred random directions for each name, that which is least similar to the names before. Rounded, so that the
    file is small and all programs read the same numbers."""
    dim, names = KINDS[kind]
    rng, rows = np.random.RandomState(seed), np.zeros((0, dim))
    for _ in names:
        some = rng.normal(size=(100, dim))
        some /= np.linalg.norm(some, axis=1, keepdims=True)
        likest = np.max(np.abs(some @ rows.T), axis=1, initial=0.0)
        rows = np.vstack([rows, some[np.argmin(likest)]])
    return np.round(rows * 2**10).astype(np.float32)


def vocabulary(kind, seed):
    made = spa.Vocabulary(KINDS[kind][0], max_similarity=1.0)
    for name, row in zip(KINDS[kind][1], drawn(kind, seed).astype(float)):
        made.add(name, spa.SemanticPointer(row / np.linalg.norm(row)))
    return made


def tick(t):
    """The index of the tick that ends at a time."""
    return int(round(t * 1e3)) - 1


def run(net, seconds, *probes):
    with nengo.Simulator(net, progress_bar=False) as sim:
        sim.run(seconds)
    return [sim.data[probe] for probe in probes]


def most_similar(kind, seed, values):
    names = KINDS[kind][1]
    rows = np.array([vocabulary(kind, seed)[name].v for name in names])
    return [names[at] for at in np.argmax(values @ rows.T, axis=1)]


def cleaned(seed, network):
    """Two pairs are bound and remembered; twenty questions of 100 ms are answered through a contest of the four names."""
    words = vocabulary("paired", seed)
    asked, answers = ["BLUE", "RED", "CIRCLE", "SQUARE"] * 5, ["CIRCLE", "SQUARE", "BLUE", "RED"] * 5

    def shown(first, second):
        return lambda t: first if tick(t) < 200 else second if tick(t) < 400 else "0"

    with spa.Network(seed=100 * seed + network) as net:
        shape, color, bound, query, result, clean = (spa.State(words) for _ in range(6))
        spa.Transcode(shown("CIRCLE", "SQUARE"), output_vocab=words) >> shape
        spa.Transcode(shown("BLUE", "RED"), output_vocab=words) >> color
        spa.Transcode(lambda t: "0" if tick(t) < 400 else asked[min((tick(t) - 400) // 100, 19)], output_vocab=words) >> query
        bind = spa.Bind(words)
        shape >> bind.input_left
        color >> bind.input_right
        nengo.Connection(bind.output, bound.input, transform=0.5, synapse=0.1)
        nengo.Connection(bound.output, bound.input, synapse=0.1)
        2 * (bound * ~query) >> result
        memory = spa.WTAAssocMem(threshold=0.3, input_vocab=words, mapping=PAIRED)
        result >> memory
        memory >> clean
        probe = nengo.Probe(clean.output, synapse=0.02)
    (values,) = run(net, 2.4, probe)
    found = most_similar("paired", seed, values[499::100])
    return sum(one == other for one, other in zip(found, answers, strict=True))


def recalled(seed, network):
    """Four pairs are bound and remembered in 16 dimensions; each of the eight names is asked for its partner."""
    words = vocabulary("recalled", seed)
    answers = [f"M{i}" for i in range(4)] + [f"S{i}" for i in range(4)]

    def shown(letter):
        return lambda t: f"{letter}{tick(t) // 200}" if tick(t) < 800 else "0"

    with spa.Network(seed=100 * seed + network) as net:
        word, marker, motor, cue = (spa.State(words) for _ in range(4))
        memory = spa.State(words, feedback=1.0)
        spa.Transcode(shown("S"), output_vocab=words) >> word
        spa.Transcode(shown("M"), output_vocab=words) >> marker
        spa.Transcode(lambda t: "0" if tick(t) < 800 else RECALLED[min((tick(t) - 800) // 100, 7)], output_vocab=words) >> cue
        word * marker >> memory
        memory * ~cue >> motor
        probe = nengo.Probe(motor.output, synapse=FAST)
    (values,) = run(net, 1.6, probe)
    found = most_similar("recalled", seed, values[899::100])
    return sum(one == other for one, other in zip(found, answers, strict=True))


def parsed(seed):
    """WRITE and ONE are read for half a second each, then nothing; whether the hand then says ONE."""
    words = vocabulary("parsed", seed)
    with spa.Network(seed=seed) as net:
        vision, phrase, motor = (spa.State(words) for _ in range(3))
        noun, verb = (spa.State(words, feedback=1.0, feedback_synapse=0.1) for _ in range(2))
        spa.Transcode(lambda t: ["WRITE", "ONE", "NONE"][tick(t) // 500 % 3], output_vocab=words) >> vision
        noun * spa.sym.NOUN + verb * spa.sym.VERB >> phrase
        with spa.ActionSelection():
            spa.ifmax(spa.dot(vision, spa.sym.WRITE), vision >> verb)
            spa.ifmax(spa.dot(vision, spa.sym.ONE + spa.sym.TWO + spa.sym.THREE), vision >> noun)
            done = spa.dot(vision, spa.sym("NONE - WRITE - ONE - TWO - THREE")) + spa.dot(phrase, spa.sym("WRITE * VERB"))
            spa.ifmax(0.5 * done, phrase * ~spa.sym.NOUN >> motor)
        probe = nengo.Probe(motor.output, synapse=FAST)
    (values,) = run(net, 1.5, probe)
    return int(most_similar("parsed", seed, values[1250:].mean(axis=0, keepdims=True)) == ["ONE"])


def sequence(seed, routed):
    """Five states follow each other; routed, the last brings back what is seen. The mean time of a state, in ms."""
    words = vocabulary("states", seed)
    with spa.Network(seed=seed) as net:
        state = spa.State(words, feedback=1.0, feedback_synapse=0.01)
        spa.Transcode(lambda t: "S0" if tick(t) < 100 else "0", output_vocab=words) >> state
        vision = spa.State(words)
        spa.sym.S0 >> vision
        with spa.ActionSelection() as actions:
            for at in range(5):
                to = vision if routed and at == 4 else getattr(spa.sym, f"S{(at + 1) % 5}")
                spa.ifmax(spa.dot(state, getattr(spa.sym, f"S{at}")), to >> state)
        probe = nengo.Probe(actions.thalamus.output, synapse=FAST)
    (values,) = run(net, 1.0, probe)
    best = np.argmax(values[50:], axis=1)
    changes = np.flatnonzero(np.diff(best))
    return float(np.diff(changes).mean())


def made():
    held = {f"{kind}_{seed}": drawn(kind, seed) for kind in KINDS for seed in SEEDS}

    def often(model):
        return lambda seed: sum(model(seed, network) for network in range(NETWORKS))

    models = {"cleaned": often(cleaned), "recalled": often(recalled), "parsed": parsed}
    models |= {"sequence": lambda seed: sequence(seed, False), "routed": lambda seed: sequence(seed, True)}
    for name, model in models.items():
        held[name] = np.array([model(seed) for seed in SEEDS], dtype=float)
        print(name, held[name], flush=True)
    return held


def main():
    path, now = pathlib.Path(sys.argv[1]) / "pointers.npz", made()
    if "--compare" not in sys.argv[2:]:
        np.savez_compressed(path, **now)
        return
    with np.load(path) as before:
        missing = set(now) ^ set(before.files)
        bad = missing | {key for key in set(now) - missing if not np.allclose(now[key], before[key])}
    print(f"differ: {sorted(bad)}" if bad else f"the fixture agrees with nengo_spa {spa.version.version}")
    sys.exit(1 if bad else 0)


if __name__ == "__main__":
    main()
