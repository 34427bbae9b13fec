"""Registers a folder of real pairs with srrf, Open3D, KISS-Matcher + small_gicp and small_gicp alone: as given, and turned by anything.

    pip install open3d small-gicp kiss-matcher numpy        # and laspy, for .laz files
    cargo build --release -p srrf
    python3 scripts/scenes.py SCENES --truth                             # once: poses of the pairs that have none, see below
    python3 scripts/scenes.py SCENES --srrf target/release/srrf                             # prints the page
    python3 scripts/scenes.py SCENES --srrf target/release/srrf --book book/src/generated   # scenes.md and scenes.json

SCENES holds `pairs.csv` with the columns name, source, target, pose, kind, voxel, and perhaps more. `source` and `target` are files
(.ply .pcd .xyz .obj .npy .laz, KITTI's .bin, 3DTK's .3d), `pose` one with a 4 x 4 matrix, target from source; paths are relative to
SCENES. `voxel` is the one for the peers, in the unit of the files. A pair of the kind `no overlap` has no pose; the right answer is to
abstain. Where `pose` is empty, `found/NAME.txt` counts; `--truth` makes those: of the poses of all methods, as given and turned, each
refined alike, the one with the best fit of both clouds. A pair without either is run and not scored.

Every run is a new process that reads two files and writes a pose: `cpu` is its user and system time, start and imports included. Each
pair is run as given and `--turns` times with the source turned and moved by chance (seeded by the pair's name). Right is under 5 degrees and,
where the source's centroid lands, under 2 % of the target's size (the diagonal of its box), or 0.3 m outdoors and 0.1 m indoors.

`--rows FILE` keeps the runs, one JSON line each, and does none again that it holds. `--reference FILE` are the rows of another srrf,
whose CPU seconds are set beside. Settings of the peers: scans.py.
"""

import argparse
import csv
import json
import pathlib
import sys
import tempfile
import zlib

import numpy as np

import scans

OUTDOORS = {"vehicle", "terrestrial", "aerial"}
LEAST = {"indoor": 0.1, **dict.fromkeys(OUTDOORS, 0.3)}
METHODS = {"srrf": "srrf", "open3d": "Open3D", "kiss": "KISS-Matcher + small_gicp", "small_gicp": "small_gicp"}
NO_OVERLAP = "no overlap"


def read(path):
    """The points of a file, shape [n, 3], those that are not finite left out."""
    ending = path.suffix.lower()
    if ending == ".npy":
        points = np.load(path)
    elif ending == ".bin":
        points = np.fromfile(path, np.float32).reshape(-1, 4)
    elif ending in {".3d", ".xyz", ".txt"}:
        points = np.loadtxt(path)
    elif ending == ".laz":
        import laspy

        points = laspy.read(path).xyz
    elif ending == ".obj":
        points = np.loadtxt([line.split(maxsplit=1)[1] for line in path.read_text().splitlines() if line.startswith("v ")])
    else:
        points = np.asarray(scans.o3d.io.read_point_cloud(str(path)).points)
    points = np.asarray(points, float)[:, :3]
    return points[np.isfinite(points).all(1)]


class Pair:
    def __init__(self, folder, row):
        self.name, self.kind, self.voxel = row["name"], row["kind"], float(row["voxel"])
        self.source, self.target = read(folder / row["source"]), read(folder / row["target"])
        pose = folder / (row["pose"] or f"found/{self.name}.txt")
        self.scored = pose.exists() and "not scored" not in row.get("truth", "")
        self.truth = np.loadtxt(pose) if self.scored and self.kind != NO_OVERLAP else None

    def moves(self, turns, seed):
        """The motions of the source: none, then by chance."""
        rng = np.random.default_rng([seed, zlib.crc32(self.name.encode())])
        radius = np.sqrt(((self.source - self.source.mean(0)) ** 2).sum(1).mean())
        yield np.eye(4)
        for _ in range(turns):
            q = rng.normal(size=4)
            w, x, y, z = q / np.linalg.norm(q)
            pose = np.eye(4)
            pose[:3, :3] = [[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]]
            centre = self.source.mean(0)
            pose[:3, 3] = centre - pose[:3, :3] @ centre + rng.uniform(-1, 1, 3) * radius
            yield pose

    def judge(self, found, move):
        """Degrees, distance and whether that is right; None without a truth."""
        if self.truth is None:
            return None, None, None
        degrees, miss, _ = scans.errors(found @ move, self.truth, self.source, self.target)
        size = np.linalg.norm(np.ptp(self.target, axis=0))
        return degrees, miss, bool(degrees < 5 and miss < max(0.02 * size, LEAST.get(self.kind, 0)))


def run(pair, turn, move, methods, arguments, folder):
    """The rows of one placement of a pair."""
    files = [folder / "source.ply", folder / "target.ply"]
    # Metres from an origin near by: float32, which some of the peers read, keeps the digits.
    near = np.round(pair.target.mean(0)) if np.abs(pair.target).max() > 1e4 else np.zeros(3)
    shift = np.eye(4)
    shift[:3, 3] = -near
    moved = pair.source @ move[:3, :3].T + move[:3, 3]
    for points, file in zip((moved - near, pair.target - near), files):
        scans.write(file, points)
    for method in methods:
        extra = {}
        if method == "srrf":
            found, used, result = scans.result_of_srrf(arguments.srrf, files, folder, arguments.threads)
            extra = {"p": result["probability"], "start": result.get("start"), "seconds": result["seconds"],
                     "refined": result["refinement"] and len(result["refinement"]["starts"])}
        else:
            found, used, _ = scans.result_of_peer(method, files, folder, pair.voxel, arguments.threads)
        found = np.linalg.inv(shift) @ found @ shift
        degrees, miss, right = pair.judge(found, move)
        yield {"pair": pair.name, "kind": pair.kind, "turn": turn, "method": method, "degrees": degrees, "miss": miss,
               "right": right, "wall": used.wall, "cpu": used.cpu, "mib": used.mib, "pose": (found @ move).tolist(), **extra}


def best_fit(pair, poses):
    """Of these poses, refined alike, the one that brings most of both clouds together."""
    registration = scans.o3d.pipelines.registration
    source, target = (scans.cloud(p - pair.target.mean(0)).voxel_down_sample(pair.voxel / 2) for p in (pair.source, pair.target))
    shift = np.eye(4)
    shift[:3, 3] = -pair.target.mean(0)
    target.estimate_normals(scans.o3d.geometry.KDTreeSearchParamKNN(20))
    found = []
    for pose in poses:
        pose = shift @ pose @ np.linalg.inv(shift)
        for distance in (2 * pair.voxel, pair.voxel, 0.5 * pair.voxel):
            pose = registration.registration_icp(
                source, target, distance, pose, registration.TransformationEstimationPointToPlane()).transformation
        moved = scans.o3d.geometry.PointCloud(source).transform(pose)
        r = [np.asarray(a.compute_point_cloud_distance(b)) for a, b in ((moved, target), (target, moved))]
        found.append((sum((1 / (1 + (d / pair.voxel) ** 2 * 4)).sum() for d in r), np.linalg.inv(shift) @ pose @ shift))
    return max(found, key=lambda f: f[0])[1]


def expected_error(rows, bins=5):
    """Expected calibration error over bins of equal width."""
    p, right = np.array([r["p"] for r in rows]), np.array([bool(r["right"]) for r in rows])
    cell = np.minimum((p * bins).astype(int), bins - 1)
    return sum(abs(p[cell == b].sum() - right[cell == b].sum()) for b in range(bins)) / len(rows)


TEXT = """\
Public scan pairs of vehicles, rooms, terrain, from the air, of objects, of parts and of objects in clutter, each as given and turned by
anything. *Right* is under 5 degrees and 2 % of the size (0.3 m outdoors, 0.1 m indoors where that is more). Times are those of whole
processes, start and reading included. Where a repository gives no pose, the truth is the best fit of the poses of all methods, so
that an error that all share goes unseen.
"""


def page_of(rows, methods, names, reference, arguments):
    page = scans.Page("Real pairs", f"python3 scripts/scenes.py SCENES --srrf PROGRAM --seed {arguments.seed} --book book/src/generated")
    page.foot += f"; {scans.version(arguments.srrf)}"
    page.add(TEXT)
    kinds = [k for k in dict.fromkeys(r["kind"] for r in rows) if k != NO_OVERLAP]
    page.add("| kind (pairs) | " + " | ".join(f"{METHODS[m]} given, turned" for m in methods) + " |", "|---" * (1 + len(methods)) + "|")
    scored = [r for r in rows if r["right"] is not None]
    for kind in [*kinds, "all"]:
        of_kind = [r for r in scored if kind in (r["kind"], "all")]
        cells = [f"{kind} ({len({r['pair'] for r in of_kind})})"]
        for m in methods:
            parts = [[r["right"] for r in of_kind if r["method"] == m and (r["turn"] > 0) == turned] for turned in (False, True)]
            cells.append(", ".join(f"{sum(p)}/{len(p)}" for p in parts if p))
            for name, part in zip(("given", "turned"), parts):
                page.numbers |= {f"scenes.{kind}.{m}.{name}": str(sum(part)), f"scenes.{kind}.{m}.{name}.of": str(len(part))}
        page.add("| " + " | ".join(cells) + " |")

    ours = [r for r in scored if r["method"] == "srrf"]
    if ours:
        page.add("", "Probability of srrf against how often it is right:", "", "| probability | runs | mean | right |", "|---|---|---|---|")
        for low, high in ((0, 0.3), (0.3, 0.5), (0.5, 0.7), (0.7, 0.9), (0.9, 1.01)):
            part = [r for r in ours if low <= r["p"] < high]
            if part:
                page.add(f"| {low} to {min(high, 1)} | {len(part)} | {np.mean([r['p'] for r in part]):.2f} | {np.mean([r['right'] for r in part]):.2f} |")
        answered = [r["right"] for r in ours if r["p"] >= 0.5]
        trusted = [r["p"] >= 0.5 for r in rows if r["kind"] == NO_OVERLAP and r["method"] == "srrf"]
        page.add("", f"Answered {len(answered)} of {len(ours)}, of those right {sum(answered)}; expected calibration error "
                     f"{expected_error(ours):.3f}; trusted without overlap {sum(trusted)} of {len(trusted)}.")
        page.numbers |= {"scenes.answered": str(len(answered)), "scenes.answered.right": str(sum(answered)),
                         "scenes.ece": f"{expected_error(ours):.3f}", "scenes.trusted": f"{sum(trusted)}"}

    page.add("", "Median of the runs: CPU seconds, wall seconds, MiB.", "", "| runs | " + " | ".join(METHODS[m] for m in methods)
             + (" | the other srrf's CPU, ratio |" if reference else " |"), "|---" * (1 + len(methods) + bool(reference)) + "|")
    by_key = {(r["pair"], r["turn"], r["method"]): r for r in rows}
    lead = reference or {(r["pair"], r["turn"]): r for r in rows if r["method"] == "srrf"}
    whose = "the other srrf" if reference else "srrf"
    everywhere = [m for m in methods if m != "small_gicp"]  # which is run as given
    for title, low, high in ((f"{whose} is sure", 0.9, 2), (f"{whose} doubts", 0, 0.9)):
        keys = [k for k, r in lead.items() if low <= r["p"] < high and all((*k, m) in by_key for m in everywhere)]
        if not keys:
            continue
        cells = [f"{title} ({len(keys)})"]
        for m in methods:
            values = [np.median([by_key[*k, m][what] for k in keys if (*k, m) in by_key] or [np.nan]) for what in ("cpu", "wall", "mib")]
            cells.append(f"{values[0]:.2f}, {values[1]:.2f}, {values[2]:.0f}")
        if reference:
            ratio = np.median([by_key[*k, "srrf"]["cpu"] / reference[k]["cpu"] for k in keys])
            cells.append(f"{np.median([reference[k]['cpu'] for k in keys]):.2f}, {ratio:.2f}")
        if {"srrf", "kiss"} <= set(methods):
            ratio = np.median([by_key[*k, "srrf"]["cpu"] / by_key[*k, "kiss"]["cpu"] for k in keys])
            cells[0] += f", {ratio:.2f} of KISS-Matcher + small_gicp's CPU"
        page.add("| " + " | ".join(cells) + " |")

    page.add("", "Degrees, as given and turned; a cross marks a wrong pose.", "",
             "| pair | kind | " + " | ".join(METHODS[m] + (" (p)" if m == "srrf" else "") for m in methods) + " | CPU s |",
             "|---" * (3 + len(methods)) + "|")
    for name in names:
        of_pair = [r for r in rows if r["pair"] == name]
        cells = []
        for m in methods:
            runs = sorted((r for r in of_pair if r["method"] == m), key=lambda r: r["turn"])
            said = lambda r: ("-" if r["degrees"] is None else f"{r['degrees']:.1f}") + (f" ({r['p']:.2f})" if "p" in r else "") + (" ✗" if r["right"] is False else "")
            cells.append(", ".join(said(r) for r in runs))
        cpu = ", ".join(f"{np.mean([r['cpu'] for r in of_pair if r['method'] == m] or [np.nan]):.1f}" for m in methods)
        page.add(f"| {name} | {of_pair[0]['kind'] if of_pair else ''} | " + " | ".join(cells) + f" | {cpu} |")
    return page


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scenes", type=pathlib.Path)
    parser.add_argument("--srrf", default="target/release/srrf")
    parser.add_argument("--methods", default=",".join(METHODS), help="which of " + ", ".join(METHODS))
    parser.add_argument("--only", help="only pairs whose name or kind holds one of these words, comma-separated")
    parser.add_argument("--turns", type=int, default=2)
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--truth", action="store_true", help="write found/NAME.txt for the pairs without a pose, from these runs")
    parser.add_argument("--rows", type=pathlib.Path)
    parser.add_argument("--reference", type=pathlib.Path)
    parser.add_argument("--book", type=pathlib.Path, metavar="DIR", help="write scenes.md and scenes.json here")
    arguments = parser.parse_args()
    scans.o3d.utility.set_verbosity_level(scans.o3d.utility.VerbosityLevel.Error)
    methods = arguments.methods.split(",")
    table = list(csv.DictReader((arguments.scenes / "pairs.csv").open()))
    if arguments.only:
        table = [t for t in table if any(w in t["name"] or w in t["kind"] for w in arguments.only.split(","))]
    kept = {}
    if arguments.rows and arguments.rows.exists():
        for line in arguments.rows.read_text().splitlines():
            row = json.loads(line)
            kept[row["pair"], row["turn"], row["method"]] = row
    rows = []
    with tempfile.TemporaryDirectory() as name:
        for entry in table:
            pair = Pair(arguments.scenes, entry)
            for turn, move in enumerate(pair.moves(arguments.turns, arguments.seed)):
                wanted = [m for m in methods if not (m == "small_gicp" and turn)]
                known = [kept[pair.name, turn, m] for m in wanted if (pair.name, turn, m) in kept]
                for row in known:  # the truth may have come later than the run
                    row["degrees"], row["miss"], row["right"] = pair.judge(np.array(row["pose"]) @ np.linalg.inv(move), move)
                missing = [m for m in wanted if (pair.name, turn, m) not in kept]
                made = []
                for row in run(pair, turn, move, missing, arguments, pathlib.Path(name)) if missing else ():
                    made.append(row)
                    if arguments.rows:
                        with arguments.rows.open("a") as out:
                            out.write(json.dumps(row) + "\n")
                    print({k: round(v, 2) if isinstance(v, float) else v for k, v in row.items() if k not in ("pose", "seconds")},
                          file=sys.stderr, flush=True)
                rows += known + made
            if arguments.truth and not entry["pose"] and pair.kind != NO_OVERLAP:
                (arguments.scenes / "found").mkdir(exist_ok=True)
                poses = [np.array(r["pose"]) for r in rows if r["pair"] == pair.name]
                np.savetxt(arguments.scenes / "found" / f"{pair.name}.txt", best_fit(pair, poses), fmt="%.9g")
    reference = {}
    if arguments.reference:
        for line in arguments.reference.read_text().splitlines():
            row = json.loads(line)
            if row["method"] == "srrf":
                reference[row["pair"], row["turn"]] = row
    page_of(rows, methods, [t["name"] for t in table], reference, arguments).write(arguments.book, "scenes")


if __name__ == "__main__":
    main()
