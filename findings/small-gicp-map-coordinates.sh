#!/usr/bin/env bash
# small_gicp 1.0.1 (PyPI): in map coordinates `align` thins each cloud to one point, and says that it converged.
# Guess before the first run: a worse pose, by rounding. Seen: a voxel's number must fit 21 bits, so at voxels of 0.25 m points beyond 262 km
# from the origin (every UTM northing) are warned about, one line a point, and become one; the answer is the identity,
# converged, error 0.0. The same clouds around the origin are registered to a millimetre.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check small_gicp==1.0.1 numpy==2.4.6
"$folder/venv/bin/python" - 2>&1 <<'PY' | sort | uniq -c | sort -rn | tee "$folder/said" | cut -c1-150
import numpy as np, small_gicp


def surface(seed):
    plane = np.random.default_rng(seed).uniform(-5, 5, (20000, 2))
    return np.c_[plane, np.sin(plane[:, 0]) * np.cos(0.7 * plane[:, 1])]


moved = np.array([0.3, 0.2, 0.1])
for name, place in (("origin", np.zeros(3)), ("map", np.array([500000.0, 5400000.0, 120.0]))):
    found = small_gicp.align(surface(1) + place, surface(2) - moved + place, downsampling_resolution=0.25)
    off = np.linalg.norm((found.T_target_source @ np.r_[place, 1])[:3] - place - moved)
    print(f"{name}: converged {found.converged}, inliers {found.num_inliers}, {'right' if off < 0.005 else 'not moved' if abs(off - np.linalg.norm(moved)) < 1e-6 else 'else'}", flush=True)
PY
grep -q 'origin: converged True, inliers [1-9][0-9]*, right' "$folder/said" && grep -q 'map: converged True, inliers 0, not moved' "$folder/said"
