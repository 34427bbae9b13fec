#!/usr/bin/env bash
# small_gicp 1.0.1 (PyPI): `read_ply` of a file with double coordinates gives a cloud of no points, and raises nothing.
# Guess before the first run: it reads them, or raises. Seen: one line on the error stream ("only float properties are
# supported") and a cloud of size 0, which goes on into `align`. Ask for the size after reading, or write floats.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check small_gicp==1.0.1 numpy==2.4.6
cd "$folder"
"$folder/venv/bin/python" - <<'PY'
import sys
import numpy as np, small_gicp

sizes = {}
for kind, dtype in (("float", "<f4"), ("double", "<f8")):
    head = "ply\nformat binary_little_endian 1.0\nelement vertex 5\n"
    head += "".join(f"property {kind} {axis}\n" for axis in "xyz") + "end_header\n"
    with open(f"{kind}.ply", "wb") as file:
        file.write(head.encode() + np.arange(15, dtype=dtype).tobytes())
    sizes[kind] = small_gicp.read_ply(f"{kind}.ply").size()
print("small_gicp 1.0.1: points read of 5:", sizes)
sys.exit(sizes != {"float": 5, "double": 0})
PY
