#!/usr/bin/env bash
# Open3D 0.20.0 (PyPI): `write_point_cloud(..., write_ascii=True)` writes the doubles of a PLY with six significant digits.
# Guess before the first run: a file of `property double` holds the digits of a double, as Open3D's own ASCII PCD and XYZ nearly do.
# Seen, with both APIs: the header says double, a northing of 5400000.987 stands there as `5.4e+06`, and the call answers True. Map
# coordinates are on a grid of metres to tens of metres, so that a whole scan may fall onto one point. Binary PLY keeps every bit.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check open3d==0.20.0 numpy==2.4.6
cd "$folder"
"$folder/venv/bin/python" - <<'PY'
import sys
import numpy as np, open3d as o3d

points = np.array([500000.123, 5400000.987, 120.789]) + 0.1 * np.arange(4)[:, None]
legacy = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points))
tensor = o3d.t.geometry.PointCloud(o3d.core.Tensor(points))
done = [
    o3d.io.write_point_cloud("legacy.ply", legacy, write_ascii=True),
    o3d.t.io.write_point_cloud("tensor.ply", tensor, write_ascii=True),
    o3d.io.write_point_cloud("binary.ply", legacy),
]
double = "property double x" in open("legacy.ply").read()
read = {name: np.asarray(o3d.io.read_point_cloud(name + ".ply").points) for name in ("legacy", "tensor", "binary")}
print("Open3D", o3d.__version__, "answers", done, "header says double:", double)
for name, back in read.items():
    print(f"{name}: {len(np.unique(back, axis=0))} different points of 4, first {back[0].tolist()}")
lost = [np.array_equal(read[n][:, :2], np.tile([500000.0, 5.4e6], (4, 1))) for n in ("legacy", "tensor")]
sys.exit(not (all(done) and double and all(lost) and np.array_equal(read["binary"], points)))
PY
