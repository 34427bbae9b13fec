#!/usr/bin/env python3
"""How long numpy and srrf-corrupt take for the 12 corruptions at 5 severities.

    python3 scripts/speed_corruptions.py [--clouds 100] [--threads 2]

Prints one table (Markdown): milliseconds a cloud of 1,024 points, and the ratio. numpy runs the
definitions of corruption_fixtures.py, twice where they are loops over definitions: as they are, and in
the fastest form that we know of numpy (`argpartition` for the nearest points, matrix products for the
free-form deformation, the interpolation system inverted once). There is a ratio to
each. numpy uses one thread. Times on one thread are medians over the clouds, so that other work on the machine disturbs
little. Needs numpy and cargo.
"""

import os

os.environ["OPENBLAS_NUM_THREADS"] = os.environ["OMP_NUM_THREADS"] = "1"

import argparse
import json
import statistics
import subprocess
import sys
import time
from datetime import date
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "crates/srrf-corrupt/tests/fixtures"))
import corruption_fixtures as slow  # noqa: E402
POINTS = 1024
LONGEST = 4.0  # seconds that a corruption of numpy is timed for; it gets through fewer clouds then


def nearest(points, centre, size):
    squared = ((points - points[centre]) ** 2).sum(axis=1)
    return np.argpartition(squared, size - 1)[:size]


def free_form(points, mu):
    """The same polynomial as `slow.free_form`, as a product with the displacements."""
    u = (points + 1.0) / 2.0
    inside = ((u >= 0) & (u <= 1)).all(axis=1)
    binomial = np.array([1.0, 4.0, 6.0, 4.0, 1.0])
    i = np.arange(5)
    b = binomial * u[:, :, None] ** i * (1 - u[:, :, None]) ** (4 - i)  # [points, axis, 5]
    weights = b[:, 0, :, None, None] * b[:, 1, None, :, None] * b[:, 2, None, None, :]
    moved = points + 2.0 * weights.reshape(len(points), 125) @ mu.reshape(125, 3)
    return np.where(inside[:, None], moved, points)


CONTROLS = slow.controls()
INVERSE = {}


def rbf(points, displacements, inverse):
    phi = lambda r2: (r2 + 0.25) ** -0.5 if inverse else np.sqrt(r2 + 0.25)
    between = lambda a: (a**2).sum(1)[:, None] - 2 * a @ CONTROLS.T + (CONTROLS**2).sum(1)
    affine = lambda p: np.hstack([np.ones((len(p), 1)), p])
    if inverse not in INVERSE:
        corner = np.zeros((4, 4))
        INVERSE[inverse] = np.linalg.inv(
            np.block([[phi(between(CONTROLS)), affine(CONTROLS)], [affine(CONTROLS).T, corner]]))
    weights = INVERSE[inverse][:, :125] @ (CONTROLS + displacements)
    return np.hstack([phi(between(points)), affine(points)]) @ weights


def same(clouds):
    """The fast forms give what the definitions give."""
    p, rng = clouds[0], np.random.RandomState(0)
    mu = rng.uniform(-0.3, 0.3, (125, 3))
    assert np.allclose(free_form(p[:30], mu), slow.free_form(p[:30], mu.reshape(5, 5, 5, 3)), atol=1e-10)
    for inverse in (False, True):
        assert np.allclose(rbf(p, mu, inverse), slow.rbf(p, mu, inverse), atol=1e-7)
    assert set(nearest(p, 5, 30)) == set(slow.nearest(p, 5, 30))


def distortion(build):
    def apply(p, s, rng):
        a = [0.1, 0.2, 0.3, 0.4, 0.5][s]
        return slow.moved(build(p, rng.uniform(-a, a, (5, 5, 5, 3))))

    return apply


def distortion_rbf(inverse, build):
    def apply(p, s, rng):
        a, g = rng.uniform(-np.pi, np.pi, (2, 125))
        way = np.stack([np.cos(a) * np.sin(g), np.sin(a) * np.sin(g), np.cos(g)], axis=1)
        return slow.moved(build(p, [0.025, 0.05, 0.075, 0.1, 0.125][s] * way, inverse))

    return apply


def corruptions(ffd, kernel):
    return {
        "density_inc": slow.density_inc_paper,
        "density_dec": slow.density_dec,
        "cutout": slow.cutout,
        "uniform": slow.uniform,
        "gaussian": slow.gaussian,
        "background": slow.background,
        "impulse": slow.impulse(0.05),
        "upsampling": slow.upsampling(0.08),
        "shear": slow.random_shear,
        "distortion": distortion(ffd),
        "distortion_rbf": distortion_rbf(False, kernel),
        "distortion_rbf_inv": distortion_rbf(True, kernel),
    }


def milliseconds(clouds, table):
    """Milliseconds a cloud and severity, median over the clouds."""
    found = {}
    for name, corrupt in table.items():
        rng = np.random.RandomState(1)
        corrupt(clouds[0], 0, rng)
        begun, seconds = time.perf_counter(), []
        for cloud in clouds:
            start = time.perf_counter()
            for severity in range(5):
                corrupt(cloud, severity, rng)
            seconds.append(time.perf_counter() - start)
            if time.perf_counter() - begun > LONGEST:
                break
        found[name] = statistics.median(seconds) * 1e3 / 5
    return found


def ours(clouds, threads):
    command = ["cargo", "bench", "--quiet", "--profile", "dev", "-p", "srrf-corrupt", "--bench", "test_set", "--",
               "--clouds", str(clouds), "--threads", str(threads)]
    return json.loads(subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True).stdout)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--clouds", type=int, default=100)
    parser.add_argument("--threads", type=int, default=2)
    arguments = parser.parse_args()
    rng = np.random.RandomState(0)
    clouds = [slow.box_surface(POINTS)]
    while len(clouds) < arguments.clouds:  # the same box, turned
        turn, _ = np.linalg.qr(rng.randn(3, 3))
        clouds.append(clouds[0] @ turn)
    same(clouds)
    as_defined = milliseconds(clouds, corruptions(slow.free_form, slow.rbf))
    slow.nearest = nearest
    fast = milliseconds(clouds, corruptions(free_form, rbf))
    one, many = (ours(arguments.clouds, threads) for threads in (1, arguments.threads))

    print(f"{date.today()}, numpy {np.__version__}, {arguments.clouds} clouds of {POINTS} points, 5 severities\n")
    print("Ratios: the first column over ours on one thread, and the second column over the same.\n")
    print(f"| ms a cloud | numpy as defined | numpy, fast form | ours, 1 thread | ours, {arguments.threads} threads | ratio | ratio, fast form |")
    print("|---|---|---|---|---|---|---|")
    rows = [(name, as_defined[name], fast[name], one["ms_a_cloud"][name], many["ms_a_cloud"][name]) for name in fast]
    rows.append(("all 12", *(sum(column) for column in zip(*(row[1:] for row in rows)))))
    for name, defined, numpy, single, threaded in rows:
        print(f"| {name} | {defined:.3f} | {numpy:.3f} | {single:.4f} | {threaded:.4f} "
              f"| {defined / single:.0f} | {numpy / single:.1f} |")


if __name__ == "__main__":
    main()
