"""Reading and writing with options, meshes as surfaces, units."""

import os
import subprocess
import sys
import warnings

import numpy as np
import pytest
from clouds import angle_deg, box, moved

import srrf

PART = box(20000, seed=5)


def vertices_and_faces():
    """The box of :func:`clouds.box`, one box on another: 16 vertices, 24 triangles."""
    corners, faces = [], []
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    for low, high in (((0, 0, 0), (3, 2, 1)), ((0.2, 0.3, 1), (1.1, 0.9, 1.8))):
        first = len(corners)
        corners += [[(low, high)[i >> 2 & 1][0], (low, high)[i >> 1 & 1][1], (low, high)[i & 1][2]] for i in range(8)]
        for a, b, c, d in quads:
            faces += [[first + a, first + b, first + c], [first + a, first + c, first + d]]
    return np.array(corners, float), np.array(faces)


def write_off(path):
    corners, faces = vertices_and_faces()
    lines = ["OFF", f"{len(corners)} {len(faces)} 0"]
    lines += [" ".join(map(repr, map(float, p))) for p in corners] + ["3 " + " ".join(map(str, f)) for f in faces]
    path.write_text("\n".join(lines) + "\n")


def test_columns_by_name_and_by_number(cloud, tmp_path):
    rows = np.column_stack([np.arange(len(cloud)) * 100.0, cloud[:, [2, 0, 1]]])
    np.savetxt(tmp_path / "a.csv", rows, delimiter=",", header="stamp,c,a,b", comments="", fmt="%.17g")
    for columns in ("a,b,c", ["a", "b", "c"], (3, 4, 2)):
        assert np.array_equal(srrf.read(tmp_path / "a.csv", columns=columns), cloud), columns
    with pytest.raises(srrf.FileError, match="columns="):
        srrf.read(tmp_path / "a.csv")
    with pytest.raises(srrf.OptionError, match="columns: .*three columns"):
        srrf.read(tmp_path / "a.csv", columns="a,b")


def test_an_array_of_an_archive(cloud, target, tmp_path):
    np.savez(tmp_path / "a.npz", first=cloud, second=target)
    assert np.array_equal(srrf.read(tmp_path / "a.npz", array="second"), target)
    with pytest.raises(srrf.FileError, match="array="):
        srrf.read(tmp_path / "a.npz")
    with pytest.raises(srrf.FileError, match="third"):
        srrf.read(tmp_path / "a.npz", array="third")


def test_a_layout_of_bare_numbers(tmp_path):
    rows = np.arange(60, dtype="<f4").reshape(10, 6)
    rows.tofile(tmp_path / "a.bin")
    assert np.array_equal(srrf.read(tmp_path / "a.bin", layout="6xf32"), rows[:, :3])
    assert np.array_equal(srrf.read(tmp_path / "a.bin", layout="4xf32"), rows.reshape(-1, 4)[:, :3])
    with pytest.raises(srrf.OptionError, match="3xf32"):
        srrf.read(tmp_path / "a.bin", layout="2xf32")


def ptx(points, origin):
    head = f"{len(points)}\n1\n{origin}\n1 0 0\n0 1 0\n0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n{origin} 1\n"
    return head + "".join(f"{x!r} {y!r} {z!r} 0.5\n" for x, y, z in points.tolist())


def test_the_scans_of_a_file(cloud, tmp_path):
    path = tmp_path / "two.ptx"
    path.write_text(ptx(cloud[:40], "0 0 0") + ptx(cloud[40:70], "10 20 30"))
    first, second = srrf.scans(path)
    assert (first.number, first.points, second.number, second.points) == (1, 40, 2, 30)
    assert np.array_equal(second.file_from_scan[:3, 3], [10, 20, 30]) and second.file_from_scan.shape == (4, 4)
    in_file = cloud[40:70] + [10, 20, 30]
    assert np.allclose(srrf.read(path, scan=2), in_file, atol=1e-12)
    assert np.array_equal(srrf.read(f"{path}#2"), srrf.read(path, scan=2))
    with pytest.warns(srrf.ReadingWarning, match="2 scans as one cloud"):
        assert np.allclose(srrf.read(path), np.vstack([cloud[:40], in_file]), atol=1e-12)
    with pytest.raises(srrf.FileError, match="3"):
        srrf.read(path, scan=3)
    with pytest.raises(srrf.OptionError, match="scan is 0"):
        srrf.read(path, scan=0)
    srrf.write(tmp_path / "one.ply", cloud)
    (only,) = srrf.scans(tmp_path / "one.ply")
    assert only.points == len(cloud) and only.file_from_scan is None


def test_memory_is_bounded(cloud, tmp_path):
    srrf.write(tmp_path / "a.ply", cloud)
    with pytest.raises(srrf.FileError, match="max_memory="):
        srrf.read(tmp_path / "a.ply", max_memory=1000)


def test_units_are_converted(cloud, tmp_path):
    srrf.write(tmp_path / "mm.npy", cloud, unit="m", to="mm")
    assert np.array_equal(np.load(tmp_path / "mm.npy"), cloud * 1000)
    assert np.allclose(srrf.read(tmp_path / "mm.npy", unit="mm", to="m"), cloud, rtol=1e-15)
    assert srrf.unit_factor("in", "mm") == 25.4
    with pytest.raises(srrf.OptionError, match="both units"):
        srrf.read(tmp_path / "mm.npy", unit="mm")
    with pytest.raises(srrf.OptionError, match="us-ft"):
        srrf.unit_factor("mile", "m")


def test_float32_stays_single(cloud, tmp_path):
    single = cloud.astype(np.float32)
    srrf.write(tmp_path / "a.ply", single)
    srrf.write(tmp_path / "b.ply", cloud)
    assert b"property float x" in (tmp_path / "a.ply").read_bytes() and b"property double x" in (tmp_path / "b.ply").read_bytes()
    assert np.array_equal(srrf.read(tmp_path / "a.ply"), single)
    srrf.write(tmp_path / "c.ply", cloud, single=True)
    assert np.array_equal(srrf.read(tmp_path / "c.ply"), single)
    with pytest.warns(srrf.ReadingWarning, match="double precision"):
        srrf.write(tmp_path / "far.ply", cloud + [5e6, 0, 0], single=True)
    assert np.array_equal(srrf.read(tmp_path / "far.ply"), cloud + [5e6, 0, 0])


def test_a_mesh_is_read_as_it_is_asked_for(tmp_path):
    write_off(tmp_path / "part.off")
    corners, _ = vertices_and_faces()
    with pytest.warns(srrf.ReadingWarning, match="24 faces, whose 16 vertices"):
        assert np.array_equal(srrf.read(tmp_path / "part.off"), corners)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert np.array_equal(srrf.read(tmp_path / "part.off", vertices=True), corners)
    drawn = srrf.read(tmp_path / "part.off", vertices=False, surface_points=5000)
    assert drawn.shape == (5000, 3)
    on_a_side = np.min([np.abs(drawn[:, a] - v) for a in range(3) for v in np.unique(corners[:, a])], axis=0)
    assert on_a_side.max() < 1e-12 and drawn.min() >= 0 and drawn[:, 0].max() <= 3
    again = srrf.read(tmp_path / "part.off", vertices=False, surface_points=5000)
    assert np.array_equal(again, drawn) and not np.array_equal(
        srrf.read(tmp_path / "part.off", vertices=False, surface_points=5000, seed=1), drawn
    )
    with pytest.raises(srrf.OptionError, match="vertices=False"):
        srrf.read(tmp_path / "part.off", surface_points=100)


class Mesh:
    """Stands for trimesh (`faces`), Open3D (`triangles`) and PyVista (`faces` one after the other)."""

    def __init__(self, points, faces, of="vertices", faces_of="faces"):
        setattr(self, of, points)
        setattr(self, faces_of, faces)


def test_a_mesh_is_registered_as_a_surface_as_the_program_does(truth, tmp_path):
    write_off(tmp_path / "part.off")
    scan = moved(PART, truth)
    np.save(tmp_path / "scan.npy", scan)
    by_path = srrf.register(tmp_path / "part.off", tmp_path / "scan.npy")
    assert angle_deg(by_path.target_from_source, truth) < 0.2 and not by_path.abstain
    run = [sys.executable, "-m", "srrf", "part.off", "scan.npy", "--json", "r.json", "--quiet"]
    assert subprocess.run(run, cwd=tmp_path).returncode == 0
    of_program = srrf.Result((tmp_path / "r.json").read_text())
    assert of_program.target_from_source.tobytes() == by_path.target_from_source.tobytes()
    assert of_program.to_dict()["surfaces"] == by_path.to_dict()["surfaces"]
    corners, faces = vertices_and_faces()
    flat = np.column_stack([np.full(len(faces), 3), faces]).ravel()
    for mesh in (
        Mesh(corners, faces),
        Mesh(corners, faces.astype(np.int32), faces_of="triangles"),
        Mesh(corners, flat, of="points"),
    ):
        assert srrf.register(mesh, scan).target_from_source.tobytes() == by_path.target_from_source.tobytes()
    for bad, word in [(faces + 1, "names point 16 of 16"), (faces[:, :2], "triangulate")]:
        with pytest.raises(srrf.InputError, match=word):
            srrf.register(Mesh(corners, bad), scan)
    registrar = srrf.Registrar(method="icp")
    with pytest.raises(srrf.InputError, match="vertices=True"):
        registrar.prepare(Mesh(corners, faces))
    with pytest.raises(srrf.InputError, match="vertices=True"):
        srrf.align([Mesh(corners, faces), scan])
    assert len(srrf.Registrar(method="icp", vertices=True).prepare(Mesh(corners, faces))) == 16


def test_other_units_are_asked_for_and_brought_together(truth):
    scan = moved(PART[:4000], truth)
    with pytest.raises(srrf.InputError, match=r'srrf.unit_factor\("mm", "m"\)'):
        srrf.register(PART[4000:8000] * 1000, scan)
    by_unit = srrf.register(PART[4000:8000] * 1000, scan, scale=srrf.unit_factor("mm", "m"))
    assert angle_deg(by_unit.target_from_source, truth) < 0.5 and by_unit.scale == 0.001
    there = by_unit.transform(PART[:100] * 1000)
    assert np.allclose(there, moved(PART[:100], truth), atol=0.02)
    estimated = srrf.register(PART[4000:8000] * 1000, scan, scale="auto")
    assert abs(estimated.scale / 0.001 - 1) < 0.01 and angle_deg(estimated.target_from_source, truth) < 0.5
    for bad in (0.0, -1.0, float("nan"), "twice", True):
        with pytest.raises(srrf.OptionError, match="scale is"):
            srrf.register(PART[:500], scan, scale=bad)


def test_every_format_there_and_back_by_every_kind_of_path(cloud, tmp_path):
    exact = {"ply", "pcd", "npy", "npz", "off", "obj", "mcap", "parquet", "pq", "vtk", "vtp", "ptx", "pts", "xyz", "txt", "csv", "e57"}
    single = {"bin", "glb", "gltf", "kitti"}
    seen = set()
    for extension in srrf.FORMATS:
        path = tmp_path / f"a.{extension}"
        try:
            srrf.write(str(path), cloud)
        except srrf.FileError as error:
            assert extension in str(error), error
            continue
        seen.add(extension)
        found = srrf.read(path)
        for other in (str(path), os.fsencode(path)):
            assert srrf.read(other).tobytes() == found.tobytes()
        assert np.abs(found - cloud).max() < (2e-3 if extension in ("las", "laz") else 1e-6), extension
        if extension in exact:
            assert found.tobytes() == cloud.tobytes(), extension
        if extension in single:
            assert np.array_equal(found, cloud.astype(np.float32)), extension
        assert srrf.scans(str(path))[0].points == len(cloud), extension
    assert {"ply", "pcd", "npy", "las", "e57", "parquet"} <= seen


def test_what_is_no_file_is_said(tmp_path, cloud):
    (tmp_path / "empty.ply").write_bytes(b"")
    for path, error, word in [
        (tmp_path, srrf.FileError, "(?i)directory"),
        ("", srrf.MissingFileError, ""),
        (tmp_path / "empty.ply", srrf.FileError, "empty.ply"),
        (tmp_path / "no" / "a.ply", srrf.MissingFileError, "a.ply"),
    ]:
        with pytest.raises(error, match=word):
            srrf.read(path)
        with pytest.raises(error, match=word):
            srrf.register(path, cloud)
    for path, word in [(tmp_path / "a", "extension"), (tmp_path / "no" / "a.ply", "no"), (tmp_path, "")]:
        with pytest.raises(srrf.FileError, match=word):
            srrf.write(path, cloud)
    for bad in (None, 3):
        with pytest.raises(TypeError):
            srrf.read(bad)
    assert [p.name for p in tmp_path.iterdir()] == ["empty.ply"], "nothing is left behind"


def test_a_mesh_is_corrupted_as_the_program_does(tmp_path):
    write_off(tmp_path / "part.off")
    corners, faces = vertices_and_faces()
    for switch, vertices in ([], False), (["--vertices"], True):
        command = [sys.executable, "-m", "srrf", "corrupt", "part.off", "-o", "bad.npy", "-c", "gaussian", "--seed", "5", *switch]
        subprocess.run(command, cwd=tmp_path, check=True, capture_output=True)
        expected = np.load(tmp_path / "bad.npy")
        assert len(expected) == (16 if vertices else 20000)
        for mesh in (tmp_path / "part.off", Mesh(corners, faces)):
            assert srrf.corrupt(mesh, "gaussian", seed=5, vertices=vertices).tobytes() == expected.tobytes()


def test_a_mesh_is_written_as_points_and_that_is_said(tmp_path):
    corners, faces = vertices_and_faces()
    with pytest.warns(srrf.ReadingWarning, match="16 vertices of a mesh, without its 24 faces"):
        srrf.write(tmp_path / "a.ply", Mesh(corners, faces))
    assert np.array_equal(srrf.read(tmp_path / "a.ply"), corners)
