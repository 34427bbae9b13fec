#!/usr/bin/env python3
"""What the Python package costs: pairs beside numpy, and a registration beside its own work in Rust.

    python3 scripts/speed_python.py [--shapes 12] [--rounds 5]

Needs numpy and the package srrf, installed. Everything runs on one thread, and what is counted is the processor's time, so that
other work on the machine disturbs little. The rounds of the two go by turns; medians are printed.

*Pairs*: all 12 corruptions at 5 severities. numpy corrupts both clouds of 1,024 points by the fast forms of
scripts/speed_corruptions.py, draws 1,024 of each and poses the target; its shapes are at hand. `srrf.pairs` does the same, and
the first time draws the points of its shapes too.

*Registration*: the time of `Registrar.register` on two arrays above the time of all stages in `Result.seconds`: copying the
points, threads, the answer as JSON, the object.
"""

import os

os.environ["OPENBLAS_NUM_THREADS"] = os.environ["OMP_NUM_THREADS"] = "1"

import argparse  # noqa: E402
import statistics  # noqa: E402
import sys  # noqa: E402
import time  # noqa: E402
from pathlib import Path  # noqa: E402

import numpy as np  # noqa: E402

import srrf  # noqa: E402

sys.path.insert(0, str(Path(__file__).resolve().parent))
import speed_corruptions as forms  # noqa: E402

POINTS = 1024
SIZES = (1_000, 10_000, 100_000)


def drawn(cloud, rng):
    """Exactly 1,024 points in random order."""
    order = rng.permutation(len(cloud))[:POINTS]
    if len(order) < POINTS:
        order = np.concatenate([order, rng.randint(0, len(cloud), POINTS - len(order))])
        rng.shuffle(order)
    return cloud[order]


def pose(rng):
    a, b, c = rng.uniform(0, np.pi / 4, 3)
    x = np.array([[1, 0, 0], [0, np.cos(a), -np.sin(a)], [0, np.sin(a), np.cos(a)]])
    y = np.array([[np.cos(b), 0, np.sin(b)], [0, 1, 0], [-np.sin(b), 0, np.cos(b)]])
    z = np.array([[np.cos(c), -np.sin(c), 0], [np.sin(c), np.cos(c), 0], [0, 0, 1]])
    return x @ y @ z, rng.uniform(-0.5, 0.5, 3)


def numpy_pair(base, corrupt, severity, rng):
    rotation, translation = pose(rng)
    source = drawn(corrupt(base, severity, rng)[0], rng)
    return source, drawn(corrupt(base, severity, rng)[0], rng) @ rotation.T + translation


def cpu(work):
    begun = time.process_time()
    work()
    return time.process_time() - begun


def of_numpy(kind, bases):
    forms.slow.nearest = forms.nearest
    corrupt = forms.corruptions(forms.free_form, forms.rbf)[kind]
    rng = np.random.RandomState(1)
    return lambda: [numpy_pair(base, corrupt, severity, rng) for base in bases for severity in range(5)]


def pairs(shapes, rounds):
    print("| ms a pair | numpy | srrf.pairs, first time | again | numpy over first time | numpy over again |")
    print("|---|---|---|---|---|---|")
    bases = [np.array(p.source) for p in srrf.pairs(shapes, corruptions=[], points=POINTS)]
    rows = []
    for kind in srrf.CORRUPTIONS:
        theirs = of_numpy(kind, bases)
        theirs()
        seconds = []
        for _ in range(rounds):
            made = srrf.pairs(shapes, corruptions=[kind], clean=False, points=POINTS, num_threads=1)
            first = cpu(made.arrays)
            seconds.append((cpu(theirs), first, cpu(made.arrays)))
        rows.append((kind, *(statistics.median(column) * 1e3 / len(made) for column in zip(*seconds))))
    rows.append(("all 12", *(statistics.mean(column) for column in list(zip(*rows))[1:])))
    for kind, theirs, first, again in rows:
        print(f"| {kind} | {theirs:.3f} | {first:.3f} | {again:.3f} | {theirs / first:.1f} | {theirs / again:.1f} |")


def overhead(rounds):
    print("| points of each cloud | register, ms | above its stages, ms | share, % |")
    print("|---|---|---|---|")
    rng = np.random.default_rng(1)
    registrar = srrf.Registrar(num_threads=1)
    for size in SIZES:
        source = rng.uniform((0, 0, 0), (3, 2, 1), (size, 3)) ** 1.5
        target = rng.uniform((0, 0, 0), (3, 2, 1), (size, 3)) ** 1.5
        registrar.register(source, target)
        walls, above = [], []
        for _ in range(rounds):
            begun = time.perf_counter()
            result = registrar.register(source, target)
            walls.append(time.perf_counter() - begun)
            above.append(walls[-1] - sum(result.seconds.values()))
        wall, more = statistics.median(walls), statistics.median(above)
        print(f"| {size:,} | {wall * 1e3:.1f} | {more * 1e3:.2f} | {100 * more / wall:.2f} |")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--shapes", type=int, default=12)
    parser.add_argument("--rounds", type=int, default=5)
    arguments = parser.parse_args()
    print(f"srrf {srrf.__version__}, numpy {np.__version__}, {arguments.shapes} shapes, medians of {arguments.rounds}\n")
    pairs(arguments.shapes, arguments.rounds)
    print()
    overhead(arguments.rounds)


if __name__ == "__main__":
    main()
