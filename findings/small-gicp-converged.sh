#!/usr/bin/env bash
# small_gicp 1.0.1 (PyPI): `converged` is true where not one point found a partner.
# Guess before the first run: false. Seen: converged True, 0 iterations, 0 inliers, error 0.0 and the identity, for two clouds
# that lie 50 m apart: every number but `num_inliers` looks like a perfect fit. Ask for `num_inliers` before all else.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check small_gicp==1.0.1 numpy==2.4.6
"$folder/venv/bin/python" - <<'PY'
import sys
import numpy as np, small_gicp

random = np.random.default_rng(0)
plane = random.uniform(-5, 5, (5000, 2))
target = np.c_[plane, np.sin(plane[:, 0])]
found = small_gicp.align(target, target + [50, 0, 0], downsampling_resolution=0.2)
said = (found.converged, found.iterations, found.num_inliers, found.error, np.array_equal(found.T_target_source, np.eye(4)))
print("small_gicp 1.0.1: converged, iterations, inliers, error, identity:", said)
sys.exit(said != (True, 0, 0, 0.0, True))
PY
