"""Meshes of another world, sampled twice, with corruptions of another generator: what `srrf batch` and Open3D make of them.

    pip install open3d trimesh numpy
    cargo build --release -p srrf
    python3 scripts/other_meshes.py MESHES --srrf target/release/srrf                             # prints the page
    python3 scripts/other_meshes.py MESHES --srrf target/release/srrf --book book/src/generated   # other-meshes.md and .json

MESHES is a folder; where it holds no meshes, two wheels are taken from PyPI and unpacked there (MetaWorld's objects, MIT, and
dm_control's dog and robots, Apache-2.0): household objects, bones, robot parts. Nothing of the project was trained or
tuned on them. `--wheels` names others.

Each mesh is sampled twice on its own, scaled to the unit ball, and each sample is treated on its own by the rows below, all in
numpy; then the target is moved by any rotation and by up to 0.5 along each axis. A pose is right within 5 degrees and a tenth of
the target's radius (root mean square) where the source's centroid lands. Some meshes are symmetric: there nobody can be right for
certain, and the rows say how the methods compare, not what can be reached.

Open3D: FPFH + RANSAC + point-to-plane ICP as in scans.py; the voxel (of 0.04 to 0.13) and the distance of ICP (of 0.4 to 2 voxels)
are the best on 120 such pairs of other meshes (robosuite's).

`--pairs DIR` writes the pairs and a table of them, and registers nothing: what the probability was fitted on is

    python3 scripts/other_meshes.py ROBOSUITE --wheels robosuite==1.5.2 --meshes 60 --seed 11 --pairs DIR
    cargo run -p srrf-calibrate --bin calibrate -- --scenes DIR/pairs.csv ...
"""

import argparse
import json
import pathlib
import subprocess
import sys
import tempfile
import zipfile

import numpy as np
import trimesh

import scans

WHEELS = ["metaworld==3.1.1", "dm_control==1.0.50"]
POINTS = 1024
ICP = 2.0  # voxels
ENDINGS = {".stl", ".obj", ".ply", ".off"}


def all_meshes(folder, wheels):
    """The meshes of the folder that have some depth, no two of the same proportions."""
    if not folder.exists() or not any(p.suffix.lower() in ENDINGS for p in folder.rglob("*")):
        folder.mkdir(parents=True, exist_ok=True)
        command = [sys.executable, "-m", "pip", "download", "--no-deps", "--quiet", "--dest", folder, *wheels]
        subprocess.run([str(word) for word in command], check=True, stdout=sys.stderr)
        for wheel in sorted(folder.glob("*.whl")):
            with zipfile.ZipFile(wheel) as z:
                z.extractall(folder / wheel.stem.split("-")[0])
    found, seen = [], set()
    for path in sorted(p for p in folder.rglob("*") if p.suffix.lower() in ENDINGS and "collision" not in str(p).lower()):
        try:
            mesh = trimesh.load(path, force="mesh", process=False)
        except Exception:  # whatever trimesh cannot read is no mesh for this table
            continue
        if len(mesh.faces) < 100 or not np.isfinite(mesh.vertices).all():
            continue
        sides = np.sort(mesh.extents)
        key = tuple(np.round(sides / sides[2], 3)) if sides[2] > 0 else None
        if key is None or sides[0] < 0.1 * sides[2] or key in seen:
            continue
        seen.add(key)
        found.append(mesh)
    return found


def meshes(folder, wheels, count):
    """`count` of them, spread over the folder."""
    found = all_meshes(folder, wheels)
    if len(found) < count:
        sys.exit(f"{folder} holds {len(found)} meshes that can be used, and --meshes asks for {count}")
    return [found[i] for i in np.linspace(0, len(found) - 1, count).astype(int)]


def any_turn(rng):
    """A rotation by chance, 4 x 4."""
    q = rng.normal(size=4)
    return trimesh.transformations.quaternion_matrix(q / np.linalg.norm(q))


def write_clouds(folder, name, source, target, pose):
    """Files of one pair, and how a table begins that names them: source, target, pose."""
    for side, points in (("x", source), ("y", target)):
        scans.o3d.io.write_point_cloud(str(folder / f"{name}{side}.ply"), scans.cloud(points))
    np.savetxt(folder / f"{name}.txt", pose)
    return f"{name}x.ply,{name}y.ply,{name}.txt"


class Rows:
    """What is done to a dense sample of a mesh, shape [n, 3], before it is a cloud."""

    def __init__(self, rng):
        self.rng = rng
        self.camera = None
        self.names = {
            "clean": lambda p: self.some(p), "noise 0.01": lambda p: self.noise(self.some(p), 0.01),
            "noise 0.03": lambda p: self.noise(self.some(p), 0.03), "outliers 15 %": self.outliers, "holes": self.holes,
            "85 % kept": lambda p: self.cropped(p, 0.85), "70 % kept": lambda p: self.cropped(p, 0.7),
            "one view": self.view, "uneven density": self.gradient, "two at once": self.two,
        }

    def unit(self):
        v = self.rng.normal(size=3)
        return v / np.linalg.norm(v)

    def some(self, p, count=POINTS):
        return p[self.rng.choice(len(p), count, replace=len(p) < count)]

    def noise(self, p, sigma):
        return p + self.rng.normal(size=p.shape) * sigma

    def outliers(self, p):
        n = round(0.15 * POINTS)
        return np.vstack([self.some(p, POINTS - n), self.rng.uniform(-1, 1, (n, 3))])

    def holes(self, p):
        for _ in range(4):  # each takes the fourteenth part of what is left, about a point
            distance = np.linalg.norm(p - p[self.rng.integers(len(p))], axis=1)
            p = p[np.argsort(distance)[len(p) // 14:]]
        return self.some(p)

    def cropped(self, p, keep):
        height = p @ self.unit()
        return self.some(p[height <= np.quantile(height, keep)], round(keep * POINTS))

    def view(self, p):
        """What a far camera sees, the two cameras some 30 degrees apart."""
        d = self.camera + 0.5 * self.unit()
        d /= np.linalg.norm(d)
        a = np.cross(d, [0.3, 0.5, 0.8])
        a /= np.linalg.norm(a)
        cell = np.floor(np.stack([p @ a, p @ np.cross(d, a)]) / 0.05).astype(int)
        _, pixel = np.unique(cell, axis=1, return_inverse=True)
        front = np.full(pixel.max() + 1, -np.inf)
        np.maximum.at(front, pixel.ravel(), p @ d)
        return self.some(p[p @ d > front[pixel.ravel()] - 0.08])

    def gradient(self, p):
        height = p @ self.unit()
        weight = 0.05 + ((height - height.min()) / (np.ptp(height) + 1e-9)) ** 2
        return p[self.rng.choice(len(p), POINTS, replace=False, p=weight / weight.sum())]

    def two(self, p):
        if self.rng.random() < 0.5:
            return self.noise(self.holes(p), 0.015)
        return self.outliers(self.cropped(p, 0.85))

    def pair(self, mesh, work):
        """Source, target and the pose between them."""
        draw = lambda n: trimesh.sample.sample_surface(mesh, n, seed=int(self.rng.integers(1 << 30)))[0]
        frame = draw(4000)
        centre = frame.mean(0)
        size = np.linalg.norm(frame - centre, axis=1).max()
        self.camera = self.unit()
        source, target = (work((draw(6000) - centre) / size) for _ in range(2))
        pose = any_turn(self.rng)
        pose[:3, 3] = self.rng.uniform(-0.5, 0.5, 3)
        return source, target @ pose[:3, :3].T + pose[:3, 3], pose


def write(folder, pairs, meshes):
    """Clouds, poses and a table `name,source,target,pose,kind`; no file is replaced."""
    folder.mkdir(parents=True)
    lines = ["name,source,target,pose,kind"]
    for i, (name, source, target, pose) in enumerate(pairs):
        lines.append(f"mesh{i % meshes} {name},{write_clouds(folder, i, source, target, pose)},mesh: {name}")
    (folder / "pairs.csv").write_text("\n".join(lines) + "\n")
    print(f"{len(pairs)} pairs in {folder / 'pairs.csv'}")


TEXT = """\
40 meshes of two packages that nothing here was trained or tuned on: MetaWorld's household objects, dm_control's bones and robot
parts. Each is sampled twice, each sample is damaged on its own by a generator in numpy, the target is turned by any rotation. The
400 pairs of 717 or 1,024 points are registered by `srrf batch` and its defaults and by Open3D's FPFH + RANSAC + ICP, whose voxel and
distance were chosen on other meshes.

- *Right* is within 5 degrees and a tenth of the target's radius. *Abstained* is the share with a probability below 0.5.
- Some of the meshes are symmetric, so that a quarter of the clean pairs is beyond everybody. Read across, not down.
"""


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=pathlib.Path, metavar="MESHES")
    parser.add_argument("--srrf", default="target/release/srrf")
    parser.add_argument("--meshes", type=int, default=40)
    parser.add_argument("--wheels", nargs="+", default=WHEELS)
    parser.add_argument("--voxel", type=float, default=0.06, help="of Open3D; the clouds have a radius of about 0.6")
    parser.add_argument("--rotation", choices=["45", "so3"], default="so3", help="what srrf is told of the rotation")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--pairs", type=pathlib.Path, metavar="DIR", help="write the pairs and a table of them here, register nothing")
    parser.add_argument("--book", type=pathlib.Path, metavar="DIR", help="write other-meshes.md and other-meshes.json here")
    arguments = parser.parse_args()
    scans.o3d.utility.set_verbosity_level(scans.o3d.utility.VerbosityLevel.Error)
    shapes = meshes(arguments.folder, arguments.wheels, arguments.meshes)
    rows = Rows(np.random.default_rng(arguments.seed))
    pairs = [(name, *rows.pair(mesh, work)) for name, work in rows.names.items() for mesh in shapes]
    if arguments.pairs:
        return write(arguments.pairs, pairs, len(shapes))

    command = f"python3 scripts/other_meshes.py MESHES --srrf PROGRAM --seed {arguments.seed} --book book/src/generated"
    page = scans.Page("Meshes of another world", command)
    page.foot += f"; {scans.version(arguments.srrf)}; {' and '.join(arguments.wheels)}"
    page.add(TEXT)
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        lines = ["source,target"]
        for i, (_, source, target, _) in enumerate(pairs):
            for which, points in (("x", source), ("y", target)):
                scans.o3d.io.write_point_cloud(str(folder / f"{i}{which}.ply"), scans.cloud(points))
            lines.append(f"{i}x.ply,{i}y.ply")
        (folder / "pairs.csv").write_text("\n".join(lines) + "\n")
        scans.run([arguments.srrf, "batch", folder / "pairs.csv", "-o", folder / "out.jsonl", "--quiet",
                   "--rotation", arguments.rotation])
        by_srrf = [json.loads(line) for line in (folder / "out.jsonl").read_text().splitlines()]
        by_peer = [scans.by_open3d(*(str(folder / f"{i}{w}.ply") for w in "xy"), arguments.voxel, 1, ICP)
                   for i in range(len(pairs))]

    page.add("| | srrf right | median, degrees | abstained | right of the others | mean p | Open3D right | median, degrees |",
             "|---|---|---|---|---|---|---|---|")
    scored = [
        (name, *scans.errors(np.array(ours["target_from_source"]), pose, source, target)[::2], ours["abstain"],
         ours["probability"], *scans.errors(np.asarray(peer), pose, source, target)[::2])
        for (name, source, target, pose), ours, (peer, _) in zip(pairs, by_srrf, by_peer)
    ]
    for name in [*rows.names, "all"]:
        degrees, right, abstain, p, peer_degrees, peer_right = (
            np.array(column) for column in list(zip(*(s for s in scored if name in (s[0], "all"))))[1:])
        others = right[~abstain].mean() if (~abstain).any() else np.nan
        cells = {"right": right.mean(), "median": np.median(degrees), "abstained": abstain.mean(), "right_answered": others,
                 "p": p.mean(), "peer_right": peer_right.mean(), "peer_median": np.median(peer_degrees)}
        cells = {cell: "-" if np.isnan(value) else f"{value:.2f}" for cell, value in cells.items()}
        page.add(f"| {name} | " + " | ".join(cells.values()) + " |")
        key = name.replace(" %", "").replace(" ", "-")
        page.numbers |= {f"meshes.{key}.{cell}": value for cell, value in cells.items()}
    seconds, peer_seconds = [sum(ours["seconds"].values()) for ours in by_srrf], [warm for _, warm in by_peer]
    page.add("", f"Seconds a pair, median, without reading files: srrf {np.median(seconds):.2f} on one thread each, "
                 f"Open3D {np.median(peer_seconds):.2f} on all threads.")
    page.readme("meshes", right, ~abstain, seconds, peer_right, peer_seconds)
    page.write(arguments.book, "other-meshes")


if __name__ == "__main__":
    main()
