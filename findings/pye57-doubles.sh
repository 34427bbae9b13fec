#!/usr/bin/env bash
# pye57 0.4.19 (PyPI): `write_scan_raw` stores float64 coordinates in single precision, without a word.
# Guess before the first run: doubles stay doubles, since E57 has them and `read_scan_raw` gives float64 back. Seen: a northing
# of 5400000.456 comes back as 5400000.5, float64 again, so nothing looks wrong: map coordinates are on a grid of half a metre.
# Take the centre off first, and put it into the scan's `translation`.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check pye57==0.4.19 numpy==2.4.6
cd "$folder"
"$folder/venv/bin/python" - <<'PY'
import sys
import numpy as np, pye57

names = ("cartesianX", "cartesianY", "cartesianZ")
point = np.array([500000.123, 5400000.456, 120.789])
file = pye57.E57("scan.e57", mode="w")
file.write_scan_raw({name: np.full(4, value) for name, value in zip(names, point)})
file.close()
back = pye57.E57("scan.e57").read_scan_raw(0)
seen = [back[name][0] for name in names]
print("pye57 0.4.19: wrote", point.tolist(), "read", [float(v) for v in seen], back["cartesianY"].dtype)
same = all(v == np.float64(np.float32(p)) for v, p in zip(seen, point))
sys.exit(not (same and seen[1] == 5400000.5 and back["cartesianY"].dtype == np.float64))
PY
