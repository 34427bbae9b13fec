"""Parts in clutter, generated: scenes of meshes on a table that one camera sees, and the part that is looked for.

    pip install open3d trimesh numpy
    python3 scripts/clutter.py MESHES OUT --scenes 20        # writes clouds, poses and OUT/pairs.csv
    python3 scripts/scenes.py OUT --srrf target/release/srrf # registers them

MESHES is a folder as for other_meshes.py, whose wheels it takes where the folder holds none. Each scene has five meshes, turned by
anything, that stand apart on a table; rays of one camera (320 x 240) meet the surfaces, with noise along the ray of 0.3 % of a part's
size. `clutter` is a part's whole surface onto the scene, `cad` its whole surface onto what the camera sees of it alone. Only parts of
which at least a third of what the camera could see is in view are asked for. No two scenes share a part as long as there are enough.
"""

import argparse
import pathlib
import sys

import numpy as np
import trimesh

import other_meshes
import scans

PARTS = 5
APART = 1.25
NOISE = 0.003
POINTS = 12000
LEAST_SEEN = 0.33
WIDTH, HEIGHT = 320, 240


def placed(mesh, rng, at):
    """The mesh with a size of 1, turned, standing on the table at a place, and the pose that puts it there."""
    size = np.linalg.norm(mesh.extents)
    own = trimesh.Trimesh((mesh.vertices - mesh.bounds.mean(0)) / size, mesh.faces, process=False)
    pose = other_meshes.any_turn(rng)
    pose[:2, 3] = at
    pose[2, 3] = -(own.vertices @ pose[2, :3]).min()
    return own, pose


def rays(rng):
    """Origins and directions of one camera that looks at the table's middle, shape [rays, 6]."""
    angle, up = rng.uniform(0, 2 * np.pi), np.radians(rng.uniform(30, 60))
    eye = 4.0 * np.array([np.cos(angle) * np.cos(up), np.sin(angle) * np.cos(up), np.sin(up)])
    ahead = -eye / np.linalg.norm(eye)
    right = np.cross(ahead, [0, 0, 1])
    right /= np.linalg.norm(right)
    down = np.cross(ahead, right)
    x, y = np.meshgrid(np.linspace(-0.62, 0.62, WIDTH), np.linspace(-0.465, 0.465, HEIGHT))
    ways = ahead + x.reshape(-1, 1) * right + y.reshape(-1, 1) * down
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    return np.hstack([np.broadcast_to(eye, ways.shape), ways]).astype(np.float32)


def seen(parts, ways):
    """Distance along each ray, and which of the parts it meets (one more: the table)."""
    scene = scans.o3d.t.geometry.RaycastingScene()
    for own, pose in parts:
        vertices = (own.vertices @ pose[:3, :3].T + pose[:3, 3]).astype(np.float32)
        scene.add_triangles(vertices, own.faces.astype(np.uint32))
    side = 2.5
    table = np.array([[-side, -side, 0], [side, -side, 0], [side, side, 0], [-side, side, 0]], np.float32)
    scene.add_triangles(table, np.array([[0, 1, 2], [0, 2, 3]], np.uint32))
    hit = scene.cast_rays(scans.o3d.core.Tensor(ways))
    return hit["t_hit"].numpy(), hit["geometry_ids"].numpy()


def scene(meshes, rng):
    """Kind, source, target and pose of each part that is asked for."""
    places = APART * np.array([[0, 0], [1, 0], [-1, 0], [0, 1], [0, -1]]) + rng.uniform(-0.1, 0.1, (PARTS, 2))
    parts = [placed(mesh, rng, at) for mesh, at in zip(meshes, places)]
    ways = rays(rng)
    far, which = seen(parts, ways)
    far = far + rng.normal(size=far.shape) * NOISE
    points = ways[:, :3] + far[:, None] * ways[:, 3:]
    hit = np.isfinite(far)
    for i, (own, pose) in enumerate(parts):
        _, alone = seen([(own, pose)], ways)
        mine = hit & (which == i)
        if mine.sum() < 300 or mine.sum() < LEAST_SEEN * (alone == 0).sum():
            continue
        source = trimesh.sample.sample_surface(own, POINTS, seed=int(rng.integers(1 << 30)))[0]
        turn = other_meshes.any_turn(rng)  # the source's own frame: nothing of the pose is given away
        turn[:3, 3] = rng.uniform(-1, 1, 3)
        source = source @ turn[:3, :3].T + turn[:3, 3]
        truth = pose @ np.linalg.inv(turn)
        yield "clutter", source, points[hit], truth
        yield "cad", source, points[mine], truth


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("meshes", type=pathlib.Path, metavar="MESHES")
    parser.add_argument("out", type=pathlib.Path, metavar="OUT")
    parser.add_argument("--scenes", type=int, default=20)
    parser.add_argument("--wheels", nargs="+", default=other_meshes.WHEELS)
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()
    if arguments.out.exists():
        sys.exit(f"{arguments.out} is there already; no file is replaced")
    arguments.out.mkdir(parents=True)
    rng = np.random.default_rng(arguments.seed)
    count = arguments.scenes * PARTS
    shapes = other_meshes.all_meshes(arguments.meshes, arguments.wheels)
    order = np.concatenate([rng.permutation(len(shapes)) for _ in range(-(-count // len(shapes)))])[:count]
    lines = ["name,source,target,pose,kind,voxel"]
    for number, some in enumerate(order.reshape(-1, PARTS)):
        for part, (kind, source, target, pose) in enumerate(scene([shapes[i] for i in some], rng)):
            name = f"{kind}-{number}-{part // 2}"
            lines.append(f"{name},{other_meshes.write_clouds(arguments.out, name, source, target, pose)},{kind},0.02")
    (arguments.out / "pairs.csv").write_text("\n".join(lines) + "\n")
    print(f"{len(lines) - 1} pairs in {arguments.out / 'pairs.csv'}")


if __name__ == "__main__":
    main()
