"""Registers real scans with srrf, with Open3D's FPFH + RANSAC + ICP and with small_gicp, in one run.

    pip install open3d small-gicp numpy
    cargo build --release -p srrf
    python3 scripts/scans.py SCANS --srrf target/release/srrf                             # prints the page
    python3 scripts/scans.py SCANS --srrf target/release/srrf --book book/src/generated   # writes scans.md and scans.json

SCANS holds `bunny/` (the Stanford bunny's range scans and bun.conf) and `lidar/` (source.ply, target.ply and
T_target_source.txt, 4 x 4). Every ordered pair is registered from the given frames and from random poses of the
source (seeded). A pose is right within 5 degrees and a tenth of the target's radius (root mean square) where the
source's centroid lands. Every job is a new process that reads both files and writes the pose: `s` is its wall time,
`cpu` its user and system time, start and imports included; for the Python peers `s` in brackets is without them and
without reading.

Open3D: voxel-thinned, normals and FPFH radii 2 and 5 voxels, RANSAC on feature matches with the checks and limits of
Open3D's own global registration tutorial (edge length 0.9, distance 1.5 voxels, 100,000 iterations, confidence
0.999), then point-to-plane ICP at 0.4 voxels; the voxel is 1/30 of the target's radius for objects and 0.5 m for
the LiDAR pair, the tutorial's proportions. small_gicp: GICP from the identity, its defaults for these sizes. It is a
local method, so it is not expected to solve random poses.
"""

import argparse
import collections
import contextlib
import datetime
import json
import os
import pathlib
import platform
import subprocess
import sys
import tempfile
import time

import numpy as np

if sys.argv[1:2] != ["--job"] or sys.argv[2:3] == ["open3d"]:
    import open3d as o3d


def read_bunny(folder):
    """Name, points and pose (world from scan) of each scan."""
    scans = []
    for line in (folder / "bun.conf").read_text().splitlines():
        words = line.split()
        if len(words) >= 9 and words[0] == "bmesh" and (folder / words[1]).exists():
            t, (x, y, z, w) = np.array(words[2:5], float), np.array(words[5:9], float)
            x, y, z, w = np.array([x, y, z, w]) / np.linalg.norm([x, y, z, w])
            rotation = np.array([
                [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
            ])
            pose = np.eye(4)
            pose[:3, :3], pose[:3, 3] = rotation.T, t
            points = np.asarray(o3d.io.read_point_cloud(str(folder / words[1])).points)
            scans.append((words[1].removesuffix(".ply"), points, pose))
    return scans


def random_pose(rng, radius):
    axis = rng.normal(size=3)
    axis /= np.linalg.norm(axis)
    pose = np.eye(4)
    pose[:3, :3] = o3d.geometry.get_rotation_matrix_from_axis_angle(axis * rng.uniform(0, np.pi))
    pose[:3, 3] = rng.uniform(-1, 1, 3) * radius
    return pose


def cloud(points):
    c = o3d.geometry.PointCloud()
    c.points = o3d.utility.Vector3dVector(points)
    return c


def write(path, points):
    """A PLY of float32, which small_gicp's reader needs."""
    head = f"ply\nformat binary_little_endian 1.0\nelement vertex {len(points)}\nproperty float x\nproperty float y\nproperty float z\nend_header\n"
    path.write_bytes(head.encode() + np.ascontiguousarray(points, "<f4").tobytes())


Used = collections.namedtuple("Used", "wall cpu mib")


def run(command):
    """Runs a process; its wall and CPU seconds and its memory."""
    with tempfile.TemporaryFile() as said:
        begun = time.perf_counter()
        process = subprocess.Popen([str(word) for word in command], stdout=subprocess.DEVNULL, stderr=said)
        status, kib = pathlib.Path(f"/proc/{process.pid}/status"), 0
        while True:
            # What the kernel reports at the end holds the memory of this script, from before the program was loaded.
            with contextlib.suppress(OSError):
                kib = max([kib, *(int(line.split()[1]) for line in status.read_text().splitlines() if line.startswith("VmHWM"))])
            ended, code, used = os.wait4(process.pid, os.WNOHANG)
            if ended:
                break
            time.sleep(0.005)
        wall = time.perf_counter() - begun
        said.seek(0)
        if os.waitstatus_to_exitcode(code) not in (0, 3):
            sys.exit(said.read().decode())
    return Used(wall, used.ru_utime + used.ru_stime, kib / 1024)


def result_of_srrf(program, files, folder, threads):
    """Its pose, what the process used, and all that it says."""
    out = folder / "result.json"
    used = run([program, "register", *files, "--json", out, "--threads", threads, "--quiet"])
    result = json.loads(out.read_text())
    return np.array(result["target_from_source"]), used, result


def by_srrf(program, files, folder, threads):
    pose, used, result = result_of_srrf(program, files, folder, threads)
    return pose, used.wall, used.cpu, None, result["probability"]


def result_of_peer(name, files, folder, voxel, threads):
    """Its pose, what the process used, and its seconds without start and reading."""
    out = folder / "pose.json"
    used = run([sys.executable, __file__, "--job", name, *files, out, voxel, threads])
    result = json.loads(out.read_text())
    return np.array(result["pose"]), used, result["seconds"]


def by_peer(name, files, folder, voxel, threads):
    pose, used, seconds = result_of_peer(name, files, folder, voxel, threads)
    return pose, used.wall, used.cpu, seconds, None


def job(name, source, target, out, voxel, threads):
    """What one of the peers does in its own process."""
    work = {"open3d": by_open3d, "small_gicp": by_small_gicp, "kiss": by_kiss}[name]
    pose, seconds = work(source, target, float(voxel), int(threads))
    pathlib.Path(out).write_text(json.dumps({"pose": np.asarray(pose).tolist(), "seconds": seconds}))


def by_open3d(source, target, voxel, _threads, icp=0.4):
    clouds = [o3d.io.read_point_cloud(path) for path in (source, target)]
    begun = time.perf_counter()
    o3d.utility.random.seed(1)
    registration = o3d.pipelines.registration
    parts = []
    for full in clouds:
        down = full.voxel_down_sample(voxel)
        normals = o3d.geometry.KDTreeSearchParamHybrid(2 * voxel, 30)
        full.estimate_normals(normals)
        down.estimate_normals(normals)
        features = registration.compute_fpfh_feature(down, o3d.geometry.KDTreeSearchParamHybrid(5 * voxel, 100))
        parts.append((full, down, features))
    (s, s_down, s_fpfh), (t, t_down, t_fpfh) = parts
    distance = 1.5 * voxel
    coarse = registration.registration_ransac_based_on_feature_matching(
        s_down, t_down, s_fpfh, t_fpfh, True, distance,
        registration.TransformationEstimationPointToPoint(False), 3,
        [registration.CorrespondenceCheckerBasedOnEdgeLength(0.9),
         registration.CorrespondenceCheckerBasedOnDistance(distance)],
        registration.RANSACConvergenceCriteria(100000, 0.999))
    fine = registration.registration_icp(
        s, t, icp * voxel, coarse.transformation, registration.TransformationEstimationPointToPlane())
    return fine.transformation, time.perf_counter() - begun


def by_small_gicp(source, target, voxel, threads):
    import small_gicp

    source, target = (small_gicp.read_ply(path).points()[:, :3] for path in (source, target))
    begun = time.perf_counter()
    found = small_gicp.align(
        target, source, registration_type="GICP", downsampling_resolution=voxel / 2,
        max_correspondence_distance=4 * voxel, num_threads=threads)
    return found.T_target_source, time.perf_counter() - begun


def by_kiss(source, target, voxel, threads):
    """KISS-Matcher with its defaults, then GICP from there."""
    import kiss_matcher
    import small_gicp

    source, target = (small_gicp.read_ply(path).points()[:, :3] for path in (source, target))
    begun = time.perf_counter()
    found = kiss_matcher.KISSMatcher(kiss_matcher.KISSMatcherConfig(voxel_size=voxel)).estimate(
        source.astype(np.float32), target.astype(np.float32))
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = np.asarray(found.rotation), np.asarray(found.translation).ravel()
    found = small_gicp.align(
        target, source, pose, registration_type="GICP", downsampling_resolution=voxel / 2,
        max_correspondence_distance=2 * voxel, num_threads=threads)
    return found.T_target_source, time.perf_counter() - begun


def errors(found, truth, source, target):
    # |A - B| = 2 sqrt(2) sin(angle / 2): exact for small angles, where the arc cosine of the trace is not.
    degrees = np.degrees(2 * np.arcsin(min(1, np.linalg.norm(found[:3, :3] - truth[:3, :3]) / 8**0.5)))
    centre = np.append(source.mean(0), 1)
    miss = np.linalg.norm((found @ centre - truth @ centre)[:3])
    radius = np.sqrt(((target - target.mean(0)) ** 2).sum(1).mean())
    return degrees, miss, degrees < 5 and miss < 0.1 * radius


def percent(shares):
    return f"{100 * np.mean(shares):.0f}" if len(shares) else "-"


def machine():
    """Processor, cores and load, for the foot of a page with times."""
    cpu = platform.processor() or platform.machine()
    info = pathlib.Path("/proc/cpuinfo")
    if info.exists():
        cpu = next((w.split(":", 1)[1].strip() for w in info.read_text().splitlines() if w.startswith("model name")), cpu)
    return f"{os.cpu_count()} cores of {cpu}, load {os.getloadavg()[0]:.1f} at the start"


def version(program):
    return subprocess.run([program, "--version"], capture_output=True, text=True, check=True).stdout.strip()


class Page:
    """A page of the book and the numbers on it, or both on standard output."""

    def __init__(self, title, command):
        date = datetime.date.today().isoformat()
        self.lines = [f"# {title}", "", f"<!-- written by {command.split()[1]}; do not edit -->", "", "```sh", command, "```", ""]
        self.foot = f"{date}; {machine()}; Open3D {o3d.__version__}"
        self.numbers = {}

    def add(self, *lines):
        self.lines += lines

    def readme(self, row, right, answered, seconds, peer_right, peer_seconds):
        """The row of README's table."""
        values = {
            "right": percent(right), "right_answered": percent(right[answered]), "seconds": f"{np.median(seconds):.1f}",
            "peer": "Open3D, FPFH + RANSAC + ICP", "peer_right": percent(peer_right), "peer_seconds": f"{np.median(peer_seconds):.1f}",
        }
        self.numbers |= {f"readme.{row}.{key}": value for key, value in values.items()}

    def write(self, folder, name):
        text = "\n".join([*self.lines, "", self.foot]) + "\n"
        numbers = json.dumps(self.numbers, indent=1, ensure_ascii=False) + "\n"
        if folder is None:
            print(text, numbers, sep="\n")
            return
        folder.mkdir(parents=True, exist_ok=True)
        (folder / f"{name}.md").write_text(text)
        (folder / f"{name}.json").write_text(numbers)


SCANS_TEXT = """\
All twelve ordered pairs of four range scans of the Stanford bunny (30,000 to 40,000 points; credit: Stanford Computer Graphics
Laboratory), and one outdoor LiDAR pair (69,000 points, from small_gicp's repository). Each is registered from the given frames and
from random poses: with `srrf register` and its defaults, with Open3D's FPFH + RANSAC + ICP (settings in the script), and with
small_gicp's GICP.

- A number is the rotation error in degrees. A cross marks a pose that is wrong: by 5 degrees, or by a tenth of the target's radius.
- `p` is the probability that `srrf` gives its own answer; below 0.5 it abstains.
- `overlap` is the share of the source that has a target point near it under the true pose.
- `s` is the wall time of a process that reads both files and writes the pose, `cpu` its user and system time, start and imports
  included; in brackets the time of the Python peers without their start and without reading.
- GICP is a local method, and not made for random poses. It is by far the fastest where the given frames are good.
"""


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scans", type=pathlib.Path)
    parser.add_argument("--srrf", default="target/release/srrf")
    parser.add_argument("--poses", type=int, default=1, help="random poses of each pair, beside the given frames")
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--first", type=int, help="only so many of the pairs: a look, no table to quote")
    parser.add_argument("--book", type=pathlib.Path, metavar="DIR", help="write scans.md and scans.json here")
    if sys.argv[1:2] == ["--job"]:
        return job(*sys.argv[2:])
    arguments = parser.parse_args()
    rng = np.random.default_rng(arguments.seed)

    pairs = []
    bunny = read_bunny(arguments.scans / "bunny")
    for a, source, source_pose in bunny:
        for b, target, target_pose in bunny:
            if a != b:
                pairs.append((f"{a} to {b}", source, target, np.linalg.inv(target_pose) @ source_pose, None))
    lidar = arguments.scans / "lidar"
    clouds = [np.asarray(o3d.io.read_point_cloud(str(lidar / f"{n}.ply")).points) for n in ("source", "target")]
    pairs.append(("lidar", *clouds, np.loadtxt(lidar / "T_target_source.txt"), 0.5))

    page = Page("Real scans", f"python3 scripts/scans.py SCANS --srrf PROGRAM --seed {arguments.seed} --book book/src/generated")
    page.foot += f"; {version(arguments.srrf)}"
    page.add(SCANS_TEXT)
    page.add("| pair | from | overlap | srrf | p | s | cpu | Open3D | s | cpu | small_gicp | s | cpu |", "|---" * 13 + "|")
    rows = []
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        for label, source, target, truth, voxel in pairs[: arguments.first]:
            radius = np.sqrt(((target - target.mean(0)) ** 2).sum(1).mean())
            voxel = voxel or radius / 30
            tree = o3d.geometry.KDTreeFlann(cloud(target))
            posed = (truth[:3, :3] @ source[::17].T).T + truth[:3, 3]
            near = [tree.search_knn_vector_3d(p, 1)[2][0] < (radius / 50) ** 2 for p in posed]
            for k in range(1 + arguments.poses):
                move = np.eye(4) if k == 0 else random_pose(rng, radius)
                moved, wanted = source @ move[:3, :3].T + move[:3, 3], truth @ np.linalg.inv(move)
                files = [folder / "source.ply", folder / "target.ply"]
                for points, file in zip((moved, target), files):
                    o3d.io.write_point_cloud(str(file), cloud(points))
                found = [by_srrf(arguments.srrf, files, folder, arguments.threads)]
                found += [by_peer(n, files, folder, voxel, arguments.threads) for n in ("open3d", "small_gicp")]
                e = [errors(f[0], wanted, moved, target) for f in found]
                p = found[0][4]
                rows.append((k == 0, e, found, p))
                cells = [f"{d:.2f}{'' if right else ' ✗'}" for d, _, right in e]
                times = [f"{wall:.2f}{'' if warm is None else f' ({warm:.2f})'} | {cpu:.2f}" for _, wall, cpu, warm, _ in found]
                page.add(f"| {label} | {'given' if k == 0 else 'random'} | {np.mean(near):.2f} | {cells[0]} | {p:.2f} | "
                         f"{times[0]} | {cells[1]} | {times[1]} | {cells[2]} | {times[2]} |")
                print(page.lines[-1], file=sys.stderr, flush=True)
    page.add("")
    for given in (True, False):
        part = [r for r in rows if r[0] == given]
        right = [sum(r[1][m][2] for r in part) for m in range(3)]
        wall, cpu = ([np.median([r[2][m][which] for r in part]) for m in range(3)] for which in (1, 2))
        page.add(f"- {'Given frames' if given else 'Random poses'}: of {len(part)} right: srrf {right[0]}, Open3D {right[1]}, "
                 f"small_gicp {right[2]}; median seconds {wall[0]:.2f}, {wall[1]:.2f}, {wall[2]:.2f}, median CPU seconds "
                 f"{cpu[0]:.2f}, {cpu[1]:.2f}, {cpu[2]:.2f}.")
        page.numbers |= {f"scans.{'given' if given else 'random'}.{m}.right": str(n)
                         for m, n in zip(("srrf", "open3d", "small_gicp"), right)}
    faster = sum(r[2][0][1] < r[2][1][1] for r in rows)
    silent = sum(1 for r in rows if not r[1][0][2] and r[3] >= 0.5)
    page.add(f"- srrf took less wall time than Open3D in {faster} of {len(rows)}.",
             f"- srrf was wrong without abstaining in {silent} of {len(rows)}.")
    page.numbers |= {"scans.all": str(len(rows)), "scans.srrf.faster": str(faster), "scans.srrf.silent": str(silent)}
    for m, method in enumerate(("srrf", "open3d", "small_gicp")):
        page.numbers[f"scans.{method}.right"] = str(sum(r[1][m][2] for r in rows))
    right, peer = (np.array([bool(r[1][m][2]) for r in rows]) for m in (0, 1))
    page.readme("scans", right, np.array([r[3] >= 0.5 for r in rows]), [r[2][0][1] for r in rows], peer,
                [r[2][1][1] for r in rows])
    page.write(arguments.book, "scans")


if __name__ == "__main__":
    main()
