#!/usr/bin/env python3
"""Scores `srrf align`: real scans, turntable views, a building, many scans; Open3D's multiway registration beside it.

    python3 scripts/align.py PART... [--srrf PROGRAM] [--scenes PROGRAM] [--scans DIR] [--open3d PYTHON] [--out DIR] [--seed 1]

PART     bunny, turntable, building, many; with `small` all of them in sizes for a quick look
--srrf   the program (default: `cargo build -p srrf`, then the one that this builds)
--scenes the example that simulates scans (`cargo build -p srrf-corrupt --example scenes`)
--scans  a folder with bunny/bun000.ply and so on, and bunny/bun.conf, from the Stanford 3D Scanning Repository
--open3d a Python with Open3D 0.20, for its multiway registration of the same scans

Scans lie anywhere: each is moved by a random motion. A scan counts as right if it is within 2 degrees and 2 % of the size of
the scene (bunny: 0.3 degrees) of the truth, against the scans of its map. Prints a line a run and writes results.json.
"""

import argparse
import json
import math
import os
import random
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
BUNNY = ["bun000", "bun045", "bun090", "bun315"]
OPEN3D = ROOT / "scripts" / "align_open3d.py"


# --- motions: 3 rows of 4 ---------------------------------------------------------------------------------------------------
def compose(a, b):
    return [[sum(a[i][k] * b[k][j] for k in range(3)) + (a[i][3] if j == 3 else 0.0) for j in range(4)] for i in range(3)]


def inverse(a):
    turned = [[a[j][i] for j in range(3)] for i in range(3)]
    return [turned[i] + [-sum(turned[i][k] * a[k][3] for k in range(3))] for i in range(3)]


def apply(a, p):
    return [sum(a[i][k] * p[k] for k in range(3)) + a[i][3] for i in range(3)]


def angle_deg(a):
    axis = [a[2][1] - a[1][2], a[0][2] - a[2][0], a[1][0] - a[0][1]]
    return math.degrees(math.atan2(math.hypot(*axis), a[0][0] + a[1][1] + a[2][2] - 1))


def from_quaternion(w, x, y, z, shift):
    n = math.sqrt(w * w + x * x + y * y + z * z)
    w, x, y, z = w / n, x / n, y / n, z / n
    return [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w), shift[0]],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w), shift[1]],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y), shift[2]],
    ]


def anywhere(rng, size):
    return from_quaternion(*[rng.gauss(0, 1) for _ in range(4)], [rng.uniform(-size, size) for _ in range(3)])


# --- scenes -----------------------------------------------------------------------------------------------------------------
def make_bunny(scans, out, seed):
    """The four scans, moved; truth as {name: map_from_scan}."""
    rng = random.Random(seed)
    conf = {}
    for line in (scans / "bunny" / "bun.conf").read_text().splitlines():
        words = line.split()
        if words and words[0] == "bmesh":
            *shift, qx, qy, qz, qw = map(float, words[2:9])
            turned = from_quaternion(qw, qx, qy, qz, [0, 0, 0])
            conf[words[1].removesuffix(".ply")] = [[turned[j][i] for j in range(3)] + [shift[i]] for i in range(3)]
    truth = {}
    out.mkdir(parents=True, exist_ok=True)
    for name in BUNNY:
        header, body = (scans / "bunny" / f"{name}.ply").read_text().split("end_header\n")
        count = next(int(l.split()[2]) for l in header.splitlines() if l.startswith("element vertex"))
        moved = anywhere(rng, 0.3)
        points = (apply(moved, list(map(float, line.split()[:3]))) for line in body.splitlines()[:count])
        (out / f"{name}.xyz").write_text("".join(" ".join(map(repr, p)) + "\n" for p in points))
        truth[f"{name}.xyz"] = compose(conf[name], inverse(moved))
    return truth


def make_scene(program, kind, out, **numbers):
    words = [str(program), kind, str(out)]
    for name, value in numbers.items():
        words += [f"--{name}", str(value)]
    subprocess.run(words, check=True)
    truth = {}
    for line in (out / "truth.poses").read_text().splitlines():
        if not line.startswith("#"):
            name, _station, *row = line.split()
            row = list(map(float, row))
            truth[name] = [row[0:4], row[4:8], row[8:12]]
    return truth


# --- runs -------------------------------------------------------------------------------------------------------------------
def run(command):
    """Wall seconds, processor seconds, peak memory in GB, exit code."""
    begun = time.monotonic()
    with tempfile.TemporaryFile() as said:
        child = subprocess.Popen(command, stdout=said, stderr=said)
        _, status, used = os.wait4(child.pid, 0)
        child.returncode = os.waitstatus_to_exitcode(status)
        seconds = time.monotonic() - begun
        if child.returncode not in (0, 3):
            said.seek(0)
            sys.exit(f"{' '.join(command)}\n{said.read().decode()}")
    return seconds, used.ru_utime + used.ru_stime, used.ru_maxrss / 1e6, child.returncode


def align(program, scans, out, *more):
    poses = out / "poses.json"
    wall, cpu, memory, code = run([str(program), "align", str(scans), "-o", str(poses), "--quiet", *more])
    result = json.loads(poses.read_text())
    result["wall"], result["cpu"], result["memory_gb"], result["code"] = wall, cpu, memory, code
    return result


def placed(result):
    """(component, name, map_from_scan, abstain) of each scan of a map of two or more."""
    size = [len(c["scans"]) for c in result["components"]]
    return [
        (s["component"], Path(s["name"]).name, s["map_from_scan"][:3], s["abstain"])
        for s in result["scans"]
        if size[s["component"]] > 1
    ]


def score(found, truth, limit_deg, limit):
    """Right scans of the largest map, wrong scans of all maps, worst angle of the right ones; each map against the scan by which most are
    right."""
    right_in, wrong, worst = [], 0, 0.0
    for component in sorted({c for c, *_ in found}):
        members = [(name, pose) for c, name, pose, _ in found if c == component]
        best = None
        for anchor, at in members[: max(8, len(members) // 8)]:
            errors = []
            for name, pose in members:
                # Truth and answer, both in the frame of the anchor.
                off = compose(
                    inverse(compose(inverse(truth[anchor]), truth[name])),
                    compose(inverse(at), pose),
                )
                errors.append((angle_deg(off), math.hypot(*[r[3] for r in off]), name))
            good = [e for e in errors if e[0] <= limit_deg]
            middle = [e for e in good if placed_off(truth, anchor, at, members, e[2]) <= limit]
            if best is None or len(middle) > len(best[0]):
                best = (middle, len(members))
        right_in.append(len(best[0]))
        wrong += best[1] - len(best[0])
        worst = max([worst] + [e[0] for e in best[0]])
    return (max(right_in) if right_in else 0), wrong, worst


CENTRES = {}


def placed_off(truth, anchor, at, members, name):
    """How far the middle of a scan is from where it should be, in the frame of the anchor."""
    pose = next(p for n, p in members if n == name)
    middle = CENTRES.get(name, [0.0, 0.0, 0.0])
    should = apply(compose(inverse(truth[anchor]), truth[name]), middle)
    does = apply(compose(inverse(at), pose), middle)
    return math.dist(should, does)


def remember_centres(result):
    for s in result["scans"]:
        CENTRES[Path(s["name"]).name] = apply(inverse(s["map_from_scan"][:3]), s["centre"])


def line(part, who, scans, right, wrong, worst, seconds, cpu, memory, **more):
    row = {"part": part, "who": who, "scans": scans, "right": right, "wrong": wrong, "worst_deg": round(worst, 4)}
    row |= {"seconds": round(seconds, 1), "cpu_seconds": round(cpu, 1), "memory_gb": round(memory, 2)} | more
    print(json.dumps(row), flush=True)
    return row


def srrf_line(part, result, truth, limit_deg, limit, **more):
    remember_centres(result)
    right, wrong, worst = score(placed(result), truth, limit_deg, limit)
    pairs = result["pairs"]
    more |= {"maps": len([c for c in result["components"] if c["placed"]]), "pairs": pairs["tried"], "pair_seconds": round(pairs["seconds"], 1)}
    more |= {"contradictions": len(result["contradictions"]), "loop_deg": round((result["worst_loop"] or {}).get("angle_deg", 0), 4)}
    more |= {"abstained": sum(s["abstain"] for s in result["scans"]), "code": result["code"]}
    return line(part, "srrf", len(truth), right, wrong, worst, result["wall"], result["cpu"], result["memory_gb"], **more)


def open3d_line(args, part, folder, truth, limit_deg, limit):
    if not args.open3d:
        return []
    out = folder / "open3d.json"
    seconds, cpu, memory, _ = run([args.open3d, str(OPEN3D), str(folder), str(out)])
    found = [(0, name, pose[:3], False) for name, pose in json.loads(out.read_text()).items()]
    right, wrong, worst = score(found, truth, limit_deg, limit)
    return [line(part, "open3d", len(truth), right, wrong, worst, seconds, cpu, memory)]


def throw_in(edges, result, share, seed):
    """Adds wrong pairs to a file of edges, as sure as the right ones: so many of each hundred are wrong then."""
    rng = random.Random(seed)
    lines = edges.read_text().splitlines()
    first = json.loads(lines[0])
    taken = {frozenset((json.loads(l)["source"], json.loads(l)["target"])) for l in lines}
    hashes = [s["hash"] for s in result["scans"]]
    wanted = round(share * len(lines) / (1 - share))
    size = max(math.dist(a["centre"], b["centre"]) for a in result["scans"] for b in result["scans"])
    added = 0
    for _ in range(100 * wanted):
        source, target = rng.sample(hashes, 2)
        if added < wanted and frozenset((source, target)) not in taken:
            taken.add(frozenset((source, target)))
            pose = anywhere(rng, size) + [[0.0, 0.0, 0.0, 1.0]]
            wrong = first | {"source": source, "target": target, "target_from_source": pose, "probability": 0.95, "abstain": False}
            lines.append(json.dumps(wrong))
            added += 1
    edges.write_text("".join(l + "\n" for l in lines))
    return added


# --- parts ------------------------------------------------------------------------------------------------------------------
def bunny(args, small):
    rows = []
    for seed in range(args.seed, args.seed + (1 if small else 3)):
        folder = args.out / f"bunny-{seed}"
        truth = make_bunny(args.scans, folder / "scans", seed)
        result = align(args.srrf, folder / "scans", folder)
        rows.append(srrf_line("bunny", result, truth, 0.3, 0.001, seed=seed))
        rows += open3d_line(args, "bunny", folder / "scans", truth, 0.3, 0.001)
    return rows


def turntable(args, small):
    rows = []
    for shape in range(2 if small else 20):
        folder = args.out / f"turntable-{shape:02}"
        count = 12 if small else 36
        truth = make_scene(args.scenes, "turntable", folder / "scans", scans=count, points=3000 if small else 6000, shape=shape, seed=args.seed)
        edges = folder / "edges.jsonl"
        edges.unlink(missing_ok=True)
        result = align(args.srrf, folder / "scans", folder, "--edges", str(edges))
        rows.append(srrf_line("turntable", result, truth, 2.0, 0.04, shape=shape))
        added = throw_in(edges, result, 0.3, args.seed + shape)
        result = align(args.srrf, folder / "scans", folder, "--edges", str(edges))
        rows.append(srrf_line("turntable, 30 % wrong", result, truth, 2.0, 0.04, shape=shape, thrown_in=added))
        rows += open3d_line(args, "turntable", folder / "scans", truth, 2.0, 0.04)
    return rows


def building(args, small):
    folder = args.out / "building"
    truth = make_scene(args.scenes, "building", folder / "scans", row=2 if small else 12, points=8000 if small else 20000, seed=args.seed)
    result = align(args.srrf, folder / "scans", folder, "--edges", str(folder / "edges.jsonl"))
    return [srrf_line("building", result, truth, 2.0, 0.3)] + open3d_line(args, "building", folder / "scans", truth, 2.0, 0.3)


def many(args, small):
    folder = args.out / "many"
    truth = make_scene(args.scenes, "corridor", folder / "scans", scans=40 if small else 500, points=4000 if small else 20000, seed=args.seed)
    result = align(args.srrf, folder / "scans", folder, "--max-memory", "4G")
    return [srrf_line("many", result, truth, 2.0, 0.3)]


PARTS = {"bunny": bunny, "turntable": turntable, "building": building, "many": many}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("parts", nargs="+", metavar="PART", choices=[*PARTS, "small"])
    parser.add_argument("--srrf", type=Path)
    parser.add_argument("--scenes", type=Path)
    parser.add_argument("--scans", type=Path)
    parser.add_argument("--open3d")
    parser.add_argument("--out", type=Path, default=Path("align-runs"))
    parser.add_argument("--seed", type=int, default=1)
    args = parser.parse_args()
    target = ROOT / "target" / "debug"
    if not args.srrf or not args.scenes:
        subprocess.run(["cargo", "build", "-p", "srrf", "--bin", "srrf"], cwd=ROOT, check=True)
        subprocess.run(["cargo", "build", "-p", "srrf-corrupt", "--example", "scenes"], cwd=ROOT, check=True)
        args.srrf, args.scenes = args.srrf or target / "srrf", args.scenes or target / "examples" / "scenes"
    small = "small" in args.parts
    parts = [p for p in args.parts if p != "small"] or list(PARTS)
    if "bunny" in parts and not args.scans:
        parser.error("bunny needs --scans, a folder with bunny/bun000.ply and so on")
    args.out.mkdir(parents=True, exist_ok=True)
    rows = [row for part in parts for row in PARTS[part](args, small)]
    (args.out / "results.json").write_text(json.dumps(rows, indent=1) + "\n")


if __name__ == "__main__":
    main()
