#!/usr/bin/env python3
"""Seconds and peak memory of reading 3 million points, beside Open3D: PLY, PCD and NPY.

    python3 scripts/speed_reading.py READ_SPEED [--book] [--points N]

READ_SPEED is the example `read_speed` of srrf-cloud (`cargo build -p srrf-cloud --example read_speed`). Needs numpy and
open3d 0.20. Each reader runs in a process of its own, five times; the fastest counts, and the memory is what the process
took at most above what it had before. All coordinates are compared by their sum. NPY is not Open3D's: NumPy reads it,
and Open3D takes the array. With --book the table goes to book/src/generated/reading.md.
"""

import argparse
import json
import pathlib
import platform
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parent.parent
TIMES = 5
PEER = """
import json, re, sys, time
import numpy as np, open3d as o3d
peak = lambda: 1024 * int(re.search(r"VmHWM:\\s+(\\d+)", open("/proc/self/status").read())[1])
path, times = sys.argv[1], int(sys.argv[2])
before, seconds = peak(), float("inf")
for _ in range(times):
    begun = time.perf_counter()
    if path.endswith(".npy"):
        cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(np.load(path)))
    else:
        cloud = o3d.io.read_point_cloud(path)
    seconds = min(seconds, time.perf_counter() - begun)
points = np.asarray(cloud.points)
memory = peak() - before
print(json.dumps({"seconds": seconds, "bytes": memory, "points": len(points), "sum": float(points.sum())}))
"""


def write(folder, count):
    import numpy as np

    points = np.random.default_rng(0).uniform(-50, 50, (count, 3)).astype("<f4")
    xyz = "".join(f"property float {axis}\n" for axis in "xyz")
    ply = f"ply\nformat binary_little_endian 1.0\nelement vertex {count}\n{xyz}end_header\n"
    pcd = (
        "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\n"
        f"WIDTH {count}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {count}\nDATA binary\n"
    )
    for name, head in [("cloud.ply", ply), ("cloud.pcd", pcd)]:
        (folder / name).write_bytes(head.encode() + points.tobytes())
    np.save(folder / "cloud.npy", points)
    return [folder / f"cloud.{extension}" for extension in ("ply", "pcd", "npy")]


def measure(*command):
    run = subprocess.run(command, capture_output=True, text=True, check=True)
    return json.loads(run.stdout.splitlines()[-1])


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("read_speed")
    parser.add_argument("--points", type=int, default=3_000_000)
    parser.add_argument("--book", action="store_true")
    args = parser.parse_args()
    import open3d

    lines = [
        "<!-- Written by scripts/speed_reading.py --book. -->",
        "# Reading, beside Open3D",
        "",
        f"{args.points:,} points in single precision, fastest of {TIMES}; memory above what the process had before. Open3D "
        f"{open3d.__version__}, Python {platform.python_version()}. A ratio below 1 is for SRRF.",
        "",
        "| format | SRRF | Open3D | ratio | SRRF, memory | Open3D, memory | ratio |",
        "|---|---|---|---|---|---|---|",
    ]
    with tempfile.TemporaryDirectory() as folder:
        for path in write(pathlib.Path(folder), args.points):
            ours = measure(args.read_speed, str(path), str(TIMES))
            theirs = measure(sys.executable, "-c", PEER, str(path), str(TIMES))
            if ours["points"] != theirs["points"] or abs(ours["sum"] - theirs["sum"]) > 1e-3:
                raise SystemExit(f"{path.name}: {ours} and {theirs}")
            row = [path.suffix[1:].upper()]
            for key, unit, digits in [("seconds", "s", 3), ("bytes", "MB", 0)]:
                scale = 1 if key == "seconds" else 1e-6
                row += [f"{scale * found[key]:.{digits}f} {unit}" for found in (ours, theirs)]
                row.append(f"{ours[key] / theirs[key]:.2f}")
            lines.append("| " + " | ".join(row) + " |")
            print(lines[-1], flush=True)
    if args.book:
        (ROOT / "book/src/generated/reading.md").write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
