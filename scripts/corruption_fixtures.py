#!/usr/bin/env python3
"""Reference values for crates/srrf-corrupt, from an implementation that shares no code with it.

    python3 scripts/corruption_fixtures.py        # needs numpy, takes about four minutes

writes three files to crates/srrf-corrupt/tests/fixtures:

    deformations.json  results of the deterministic cores on numbers that both sides derive from
                       the same integer hash: to be met within rounding
    statistics.json    mean and standard deviation, over many draws, of what a corruption does to
                       one cloud: to be met within sampling error
    dcp_poses.json     poses of DCP's test set, from numpy's own legacy generator

The algorithms follow the descriptions of ModelNet40-C (Sun et al. 2022) and PyGeM, as loops over
definitions and without regard to speed. numpy.random.RandomState is frozen by numpy's policy, so
that the files come out the same under every version.
"""

import json
from math import comb
from pathlib import Path

import numpy as np

OUT = Path(__file__).resolve().parent.parent / "crates/srrf-corrupt/tests/fixtures"
MASK = (1 << 64) - 1


def hashed(stream, n):
    """Uniform in [0, 1), from splitmix64 of (stream, n): exact in every language."""
    z = ((stream << 32) + n + 1) * 0x9E3779B97F4A7C15 & MASK
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9 & MASK
    z = (z ^ (z >> 27)) * 0x94D049BB133111EB & MASK
    return ((z ^ (z >> 31)) >> 11) / (1 << 53)


def hashed_table(stream, rows, half_width):
    """[rows, 3], uniform in plus and minus half_width."""
    flat = [(2.0 * hashed(stream, n) - 1.0) * half_width for n in range(3 * rows)]
    return np.array(flat).reshape(rows, 3)


def box_surface(count):
    """[count, 3], on a box with half sides 0.8, 0.45, 0.3, by area; within the unit sphere."""
    half = np.array([0.8, 0.45, 0.3])
    area = np.array([half[1] * half[2], half[0] * half[2], half[0] * half[1]])
    edges = np.array([area[0], area[0] + area[1]]) / (area[0] + area[1] + area[2])
    points = []
    for i in range(count):
        u, *v = [hashed(7, 4 * i + k) for k in range(4)]
        face = 0 if u < edges[0] else 1 if u < edges[1] else 2
        p = (2.0 * np.array(v) - 1.0) * half
        p[face] = half[face] if p[face] >= 0.0 else -half[face]
        points.append(p)
    return np.array(points)


# ---------------------------------------------------------------------------------------------
# Deterministic cores


def shear(points, b, d, e, f):
    """Row vectors times the matrix of ModelNet40-C."""
    return points @ np.array([[1, 0, b], [d, 1, e], [f, 0, 1]])


def free_form(points, mu):
    """PyGeM's FFD: box from -1, side 2, displacements mu [5, 5, 5, 3] in units of the side."""
    bernstein = lambda i, u: comb(4, i) * u**i * (1 - u) ** (4 - i)
    out = points.copy()
    for row, p in enumerate(points):
        u = (p + 1.0) / 2.0
        if (u < 0).any() or (u > 1).any():
            continue
        for i in range(5):
            for j in range(5):
                for k in range(5):
                    weight = bernstein(i, u[0]) * bernstein(j, u[1]) * bernstein(k, u[2])
                    out[row] += 2.0 * weight * mu[i, j, k]
    return out


def controls():
    line = np.linspace(-1.0, 1.0, 5)
    return np.array([[x, y, z] for x in line for y in line for z in line])


def rbf(points, displacements, inverse):
    """PyGeM's RBF, which interpolates the positions of the deformed control points."""
    phi = lambda r: (r**2 + 0.5**2) ** (-0.5 if inverse else 0.5)
    distance = lambda a, b: np.linalg.norm(a[:, None] - b[None], axis=-1)
    c = controls()
    affine = lambda p: np.hstack([np.ones((len(p), 1)), p])
    system = np.block([[phi(distance(c, c)), affine(c)], [affine(c).T, np.zeros((4, 4))]])
    weights = np.linalg.solve(system, np.vstack([c + displacements, np.zeros((4, 3))]))
    return np.hstack([phi(distance(points, c)), affine(points)]) @ weights


def box_normalize(points):
    low, high = points.min(axis=0), points.max(axis=0)
    return (points - (low + high) / 2) / ((high - low).max() / 2)


def nearest(points, centre, size):
    return np.argsort(((points - points[centre]) ** 2).sum(axis=1), kind="stable")[:size]


def deformations():
    points = hashed_table(1, 13, 1.0)
    points[12] = [1.25, 0.0, 0.0]  # outside the lattice
    b, d, e, f = [0.6 * (hashed(2, n) - 0.5) for n in range(4)]
    mu = hashed_table(3, 125, 0.5)
    shifts = hashed_table(4, 125, 0.1)
    cloud = box_surface(257)
    return {
        "points": points.tolist(),
        "shear": {"b": b, "d": d, "e": e, "f": f, "out": shear(points, b, d, e, f).tolist()},
        "distortion": free_form(points, mu.reshape(5, 5, 5, 3)).tolist(),
        "distortion_rbf": rbf(points, shifts, False).tolist(),
        "distortion_rbf_inv": rbf(points, shifts, True).tolist(),
        "clip": np.clip(1.5 * points, -1, 1).tolist(),
        "box_normalize": box_normalize(points).tolist(),
        "nearest": [
            {"centre": c, "size": k, "members": sorted(nearest(cloud, c, k).tolist())}
            for c, k in [(0, 1), (31, 30), (200, 100)]
        ],
    }


# ---------------------------------------------------------------------------------------------
# Whole corruptions: (points, origin), origin -1 for added points


def density_inc_paper(p, s, rng):
    pool, dense = np.arange(len(p)), []
    for _ in range([1, 2, 3, 4, 5][s]):
        near = nearest(p[pool], rng.randint(len(pool)), 100)
        dense += pool[near].tolist()
        pool = np.delete(pool, near)
    return added(p, p[dense] + rng.uniform(-0.02, 0.02, (len(dense), 3)))


def density_inc_modelnet40_c(p, s, rng):
    pool, kept, clusters = np.arange(len(p)), [], [1, 2, 3, 4, 5][s]
    for _ in range(clusters):
        near = nearest(p[pool], rng.randint(len(pool)), 100)
        kept += pool[near].tolist()
        pool = np.delete(pool, near)
    kept += pool[rng.randint(len(pool), size=1024 - 100 * clusters)].tolist()
    return p[kept], np.array(kept)


def density_dec(p, s, rng):
    pool = np.arange(len(p))
    for _ in range([1, 2, 3, 4, 5][s]):
        near = nearest(p[pool], rng.randint(len(pool)), 100)
        pool = np.delete(pool, rng.choice(near, 75, replace=False))
    return p[pool], pool


def cutout(p, s, rng):
    pool = np.arange(len(p))
    for _ in range([2, 3, 5, 7, 10][s]):
        pool = np.delete(pool, nearest(p[pool], rng.randint(len(pool)), 30))
    return p[pool], pool


def moved(q):
    return q, np.arange(len(q))


def added(p, q):
    return np.vstack([p, q]), np.concatenate([np.arange(len(p)), np.full(len(q), -1)])


def uniform(p, s, rng):
    c = [0.01, 0.02, 0.03, 0.04, 0.05][s]
    return moved(p + rng.uniform(-c, c, p.shape))


def gaussian(p, s, rng):
    return moved(np.clip(p + [0.010, 0.015, 0.020, 0.025, 0.030][s] * rng.randn(*p.shape), -1, 1))


def background(p, s, rng):
    return added(p, rng.uniform(-1, 1, (len(p) // [45, 40, 35, 30, 20][s], 3)))


def impulse(linf):
    def apply(p, s, rng):
        q, n = p.copy(), len(p) // [30, 25, 20, 15, 10][s]
        q[rng.choice(len(p), n, replace=False)] += rng.choice([-1, 1], (n, 3)) * linf
        return moved(q)

    return apply


def upsampling(linf):
    def apply(p, s, rng):
        n = len(p) // [5, 4, 3, 2, 1][s]
        return added(p, p[rng.choice(len(p), n, replace=False)] + rng.uniform(-linf, linf, (n, 3)))

    return apply


def random_shear(p, s, rng):
    c = [0.05, 0.10, 0.15, 0.20, 0.25][s]
    return moved(shear(p, *(rng.uniform(c - 0.05, c + 0.05, 4) * rng.choice([-1, 1], 4))))


# Both maps are linear in the displacements, so that their matrices are built once.
FIXED = {}


def linear(name, p, displacements, build):
    if name not in FIXED:
        eye = np.eye(125)
        FIXED[name] = np.stack([(build(np.stack([e] * 3, axis=1)) - p)[:, 0] for e in eye], axis=1)
    return p + FIXED[name] @ displacements


def distortion(p, s, rng):
    a = [0.1, 0.2, 0.3, 0.4, 0.5][s]
    mu = rng.uniform(-a, a, (125, 3))
    return moved(linear("ffd", p, mu, lambda m: free_form(p, m.reshape(5, 5, 5, 3))))


def distortion_rbf(inverse):
    def apply(p, s, rng):
        a, g = rng.uniform(-np.pi, np.pi, (2, 125))
        way = np.stack([np.cos(a) * np.sin(g), np.sin(a) * np.sin(g), np.cos(g)], axis=1)
        shift = [0.025, 0.05, 0.075, 0.1, 0.125][s] * way
        return moved(linear(f"rbf{inverse}", p, shift, lambda d: rbf(p, d, inverse)))

    return apply


def measures(p, out, origin):
    """What a corruption did, in numbers; measured alike in crates/srrf-corrupt/tests."""
    kept = origin >= 0
    rms = np.sqrt(((out[kept] - p[origin[kept]]) ** 2).sum(axis=1).mean())
    shift = np.linalg.norm(out.mean(axis=0) - p.mean(axis=0))
    queries = out[::8]
    squared = ((queries[:, None] - out[None]) ** 2).sum(axis=-1)
    eighth = np.sqrt(np.partition(squared, 8, axis=1)[:, 8])  # entry 0 is the point itself
    return [rms, shift, eighth.mean(), eighth.std()]


def statistics(draws=400):
    corruptions = {
        "density_inc": density_inc_paper,
        "density_inc/modelnet40_c": density_inc_modelnet40_c,
        "density_dec": density_dec,
        "cutout": cutout,
        "uniform": uniform,
        "gaussian": gaussian,
        "background": background,
        "impulse": impulse(0.05),
        "impulse/modelnet40_c": impulse(0.1),
        "upsampling": upsampling(0.08),
        "upsampling/modelnet40_c": upsampling(0.05),
        "shear": random_shear,
        "distortion": distortion,
        "distortion_rbf": distortion_rbf(False),
        "distortion_rbf_inv": distortion_rbf(True),
    }
    rows = []
    for number, (name, corrupt) in enumerate(corruptions.items()):
        p = box_surface(2048 if name == "density_inc/modelnet40_c" else 1024)
        for s in range(5):
            rng = np.random.RandomState(100 * number + s)
            results = [corrupt(p, s, rng) for _ in range(draws)]
            table = np.array([measures(p, *result) for result in results])
            rows.append(
                {
                    "corruption": name,
                    "severity": s + 1,
                    "points": len(results[0][0]),
                    "mean": [float(f"{v:.6g}") for v in table.mean(axis=0)],
                    "deviation": [float(f"{v:.4g}") for v in table.std(axis=0, ddof=1)],
                }
            )
    return {"draws": draws, "measures": ["rms_move", "centroid_shift", "spacing", "spacing_deviation"], "rows": rows}


# ---------------------------------------------------------------------------------------------


def dcp_poses():
    poses = []
    for item in [0, 1, 2, 1000, 2467]:
        np.random.seed(item)
        a, b, c = [np.random.uniform() * np.pi / 4 for _ in range(3)]
        t = [np.random.uniform(-0.5, 0.5) for _ in range(3)]
        rx = np.array([[1, 0, 0], [0, np.cos(a), -np.sin(a)], [0, np.sin(a), np.cos(a)]])
        ry = np.array([[np.cos(b), 0, np.sin(b)], [0, 1, 0], [-np.sin(b), 0, np.cos(b)]])
        rz = np.array([[np.cos(c), -np.sin(c), 0], [np.sin(c), np.cos(c), 0], [0, 0, 1]])
        poses.append({"item": item, "rotation": (rx @ ry @ rz).tolist(), "translation": t})
    return poses


def main():
    OUT.mkdir(parents=True, exist_ok=True)
    for name, content in [
        ("deformations", deformations()),
        ("dcp_poses", dcp_poses()),
        ("statistics", statistics()),
    ]:
        rows = content.pop("rows", None) if isinstance(content, dict) else None
        text = json.dumps(content, indent=1)
        if rows is not None:  # one row a line
            lines = ",\n  ".join(json.dumps(row) for row in rows)
            text = text[: text.rindex("}")].rstrip() + ',\n "rows": [\n  ' + lines + "\n ]\n}"
        path = OUT / f"{name}.json"
        path.write_text(text + "\n")
        print(f"{path.name}: {path.stat().st_size} bytes")


if __name__ == "__main__":
    main()
