#!/usr/bin/env python3
"""Files to and from other tools, value by value. scripts/check-peers.sh runs it and installs the tools.

    python3 scripts/check_peers.py CONVERT [--book]

CONVERT is the example `convert` of srrf-cloud. Each peer writes a cloud of 40 points, which is converted to .npy and
compared; and each peer reads what `convert` writes. The points are those of a seeded generator, at map coordinates where
the format and the peer hold double precision.
"""

import importlib.metadata
import pathlib
import shutil
import subprocess
import sys
import tempfile

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parent.parent
N = 40
SMALL = np.random.default_rng(0).uniform(-2, 2, (N, 3)).astype(np.float32).astype(np.float64)
LARGE = np.random.default_rng(0).uniform(-500, 500, (N, 3)) + [431_234.567, 4_812_345.678, 90.5]
FACES = np.array([[0, 1, 2], [2, 1, 3], [4, 5, 6]])
ROWS = []


def row(format, peer, points=SMALL, tolerance=0.0, vertices=False):
    """A pair of functions `write(path, points)` and `read(path)`; either may be None."""

    def add(make):
        write, read = make()
        ROWS.append((format, peer, points, tolerance, write, read))
        return make

    return add


# numpy and pandas


@row("npy", "numpy", LARGE)
def _():
    return np.save, np.load


@row("npz", "numpy", LARGE)
def _():
    return (lambda path, p: np.savez_compressed(path, points=p)), (lambda path: np.load(path)["points"])


@row("csv", "pandas", LARGE)
def _():
    import pandas

    def read(path):
        table = pandas.read_csv(path)
        return table[["x", "y", "z"]].to_numpy()

    return (lambda path, p: pandas.DataFrame(p, columns=list("xyz")).to_csv(path)), read


@row("xyz", "numpy", LARGE)
def _():
    return np.savetxt, np.loadtxt


@row("parquet", "pandas", LARGE)
def _():
    import pandas

    def write(path, p):
        table = pandas.DataFrame(p, columns=list("xyz"))
        table["label"] = "a"
        table.to_parquet(path)

    return write, lambda path: pandas.read_parquet(path)[["x", "y", "z"]].to_numpy()


@row("parquet (list column)", "pyarrow", LARGE)
def _():
    import pyarrow
    import pyarrow.parquet

    def write(path, p):
        column = pyarrow.FixedSizeListArray.from_arrays(pyarrow.array(p.ravel()), 3)
        pyarrow.parquet.write_table(pyarrow.table({"points": column}), path)

    return write, None


# Open3D


def open3d_cloud(**how):
    import open3d

    def write(path, p):
        cloud = open3d.geometry.PointCloud(open3d.utility.Vector3dVector(p))
        assert open3d.io.write_point_cloud(str(path), cloud, **how)

    def read(path):
        return np.asarray(open3d.io.read_point_cloud(str(path)).points)

    return write, read


@row("ply", "Open3D", LARGE)
def _():
    return open3d_cloud()


@row("ply (text, six digits)", "Open3D", SMALL, 1e-5)
def _():
    return open3d_cloud(write_ascii=True)[0], None


@row("pcd", "Open3D")
def _():
    return open3d_cloud()


@row("pcd (compressed)", "Open3D")
def _():
    return open3d_cloud(compressed=True)[0], None


@row("pcd (text)", "Open3D", SMALL, 1e-9)
def _():
    return open3d_cloud(write_ascii=True)[0], None


@row("xyz", "Open3D", LARGE, 1e-9)
def _():
    return open3d_cloud()


@row("pts", "Open3D", LARGE, 1e-9)
def _():
    return open3d_cloud()


def open3d_tensors():
    import open3d

    def write(path, p):
        cloud = open3d.t.geometry.PointCloud(open3d.core.Tensor(p))
        assert open3d.t.io.write_point_cloud(str(path), cloud)

    return write, None


@row("npz", "Open3D tensors", LARGE)
def _():
    return open3d_tensors()


# trimesh


def trimesh_mesh(kind):
    import trimesh

    def write(path, p):
        trimesh.Trimesh(p, FACES, process=False).export(str(path), file_type=kind)

    def read(path):
        found = trimesh.load(str(path), process=False, force=None)
        while isinstance(found, trimesh.Scene):
            (found,) = found.geometry.values()
        return np.asarray(found.vertices)

    return write, read


@row("ply (mesh)", "trimesh")
def _():
    return trimesh_mesh("ply")


@row("obj (mesh)", "trimesh", SMALL, 1e-7)
def _():
    write, _ = trimesh_mesh("obj")
    return write, None


@row("off (mesh)", "trimesh", SMALL, 1e-9)
def _():
    return trimesh_mesh("off")[0], None


@row("glb (mesh)", "trimesh")
def _():
    return trimesh_mesh("glb")


@row("glb (points)", "trimesh")
def _():
    import trimesh

    def write(path, p):
        trimesh.Scene([trimesh.PointCloud(p)]).export(str(path))

    return write, None


# laspy


def laspy_file(version, format):
    import laspy

    def write(path, p):
        header = laspy.LasHeader(version=version, point_format=format)
        header.scales, header.offsets = [1e-3] * 3, np.floor(p.min(axis=0))
        file = laspy.LasData(header)
        file.x, file.y, file.z = p.T
        file.write(str(path))

    def read(path):
        return np.asarray(laspy.read(str(path)).xyz)

    return write, read


for version, formats in (("1.2", range(4)), ("1.3", (4, 5)), ("1.4", range(6, 11))):
    for number in formats:
        for kind in ("las", "laz"):
            if kind == "laz" and number in (4, 5, 9, 10):
                continue  # lazrs does not write waveforms
            read_too = number == 0

            def make(version=version, number=number, read_too=read_too):
                write, read = laspy_file(version, number)
                return write, read if read_too else None

            row(f"{kind} {version}, points {number}", "laspy", LARGE, 5.1e-4)(make)


# pye57


@row("e57 (single precision)", "pye57")  # in which it writes
def _():
    import pye57

    def write(path, p):
        file = pye57.E57(str(path), mode="w")
        file.write_scan_raw({f"cartesian{axis}": p[:, i].copy() for i, axis in enumerate("XYZ")})
        file.close()

    def read(path):
        scan = pye57.E57(str(path)).read_scan_raw(0)
        return np.column_stack([scan[f"cartesian{axis}"] for axis in "XYZ"])

    return write, read


@row("e57#2 (posed scan)", "pye57", LARGE, 1e-4)  # single precision in the frame of the scan
def _():
    import pye57

    def write(path, p):
        turn = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
        shift = np.array([431_000.0, 4_812_000, 0])
        local = (p - shift) @ turn
        file = pye57.E57(str(path), mode="w")
        for cloud in (p + 1, local):
            data = {f"cartesian{axis}": cloud[:, i].copy() for i, axis in enumerate("XYZ")}
            half = np.sqrt(0.5)
            posed = cloud is local
            file.write_scan_raw(
                data,
                rotation=np.array([half, 0, 0, half]) if posed else np.array([1.0, 0, 0, 0]),
                translation=shift if posed else np.zeros(3),
            )
        file.close()

    return write, None


# plyfile


def plyfile_file(text, order):
    import plyfile

    def write(path, p):
        vertex = np.zeros(len(p), dtype=[("x", "f8"), ("y", "f8"), ("z", "f8"), ("red", "u1")])
        for i, axis in enumerate("xyz"):
            vertex[axis] = p[:, i]
        element = plyfile.PlyElement.describe(vertex, "vertex")
        plyfile.PlyData([element], text=text, byte_order=order).write(str(path))

    def read(path):
        vertex = plyfile.PlyData.read(str(path))["vertex"]
        return np.column_stack([vertex[axis] for axis in "xyz"])

    return write, read


@row("ply (big endian)", "plyfile", LARGE)
def _():
    return plyfile_file(False, ">")[0], None


@row("ply (text)", "plyfile", LARGE, 1e-9)
def _():
    return plyfile_file(True, "=")[0], None


@row("ply", "plyfile", LARGE)
def _():
    return plyfile_file(False, "<")


# VTK by pyvista, meshio


def vtk_file(writer, mode=None, compressor=None, encoded=True, version=None):
    import pyvista
    import vtk

    def write(path, p):
        mesh = pyvista.PolyData(p.copy(), np.hstack([[3, *face] for face in FACES]))
        mesh.point_data["intensity"] = np.arange(len(p), dtype=np.float32)
        mesh.point_data["Normals"] = np.tile([0.0, 0, 1], (len(p), 1))
        out = getattr(vtk, writer)()
        out.SetFileName(str(path))
        out.SetInputData(mesh)
        if writer == "vtkPolyDataWriter":
            (out.SetFileTypeToBinary if mode else out.SetFileTypeToASCII)()
            if version:
                out.SetFileVersion(version)
        else:
            getattr(out, f"SetDataModeTo{mode}")()
            out.SetEncodeAppendedData(encoded)
            if compressor is None:
                out.SetCompressorTypeToNone()
            else:
                getattr(out, f"SetCompressorTypeTo{compressor}")()
        assert out.Write()

    def read(path):
        return np.asarray(pyvista.read(str(path)).points)

    return write, read


@row("vtk (binary)", "VTK", LARGE)
def _():
    return vtk_file("vtkPolyDataWriter", True)


@row("vtk (binary, version 4.2)", "VTK", LARGE)
def _():
    return vtk_file("vtkPolyDataWriter", True, version=42)[0], None


@row("vtk (text)", "VTK", LARGE, 1e-4)
def _():
    return vtk_file("vtkPolyDataWriter", False)[0], None


for words, mode, compressor, encoded in (
    ("text", "Ascii", None, True),
    ("base64", "Binary", None, True),
    ("base64, zlib", "Binary", "ZLib", True),
    ("appended, base64", "Appended", None, True),
    ("appended, base64, zlib", "Appended", "ZLib", True),
    ("appended, raw", "Appended", None, False),
    ("appended, raw, zlib", "Appended", "ZLib", False),
):

    def make(mode=mode, compressor=compressor, encoded=encoded):
        write, read = vtk_file("vtkXMLPolyDataWriter", mode, compressor, encoded)
        return write, read if compressor and mode == "Binary" else None

    row(f"vtp ({words})", "VTK", LARGE, 1e-4 if mode == "Ascii" else 0.0)(make)


def meshio_file(kind, **how):
    import meshio

    def write(path, p):
        meshio.Mesh(p, [("triangle", FACES)]).write(str(path), file_format=kind, **how)

    def read(path):
        return meshio.read(str(path)).points

    return write, read


@row("vtk (cells, version 5)", "meshio", LARGE)
def _():
    return meshio_file("vtk")[0], None


@row("vtk (cells, version 4.2)", "meshio", LARGE)
def _():
    return meshio_file("vtk42")[0], None


@row("vtu", "meshio", LARGE)
def _():
    return meshio_file("vtu")[0], None


# ROS


@row("mcap", "mcap-ros2-support")
def _():
    from mcap_ros2.writer import Writer

    definition = (
        "std_msgs/Header header\nuint32 height\nuint32 width\nPointField[] fields\nbool is_bigendian\n"
        "uint32 point_step\nuint32 row_step\nuint8[] data\nbool is_dense\n" + "=" * 80 + "\nMSG: std_msgs/Header\n"
        "builtin_interfaces/Time stamp\nstring frame_id\n" + "=" * 80 + "\nMSG: builtin_interfaces/Time\nint32 sec\n"
        "uint32 nanosec\n" + "=" * 80 + "\nMSG: sensor_msgs/PointField\nstring name\nuint32 offset\nuint8 datatype\n"
        "uint32 count\n"
    )

    def write(path, p):
        data = np.zeros(len(p), dtype=[("x", "<f4"), ("y", "<f4"), ("z", "<f4"), ("pad", "<f4"), ("i", "<f4")])
        for i, axis in enumerate("xyz"):
            data[axis] = p[:, i]
        fields = [
            {"name": name, "offset": offset, "datatype": 7, "count": 1}
            for name, offset in (("x", 0), ("y", 4), ("z", 8), ("intensity", 16))
        ]
        message = {
            "header": {"stamp": {"sec": 1, "nanosec": 2}, "frame_id": "lidar"},
            "height": 1,
            "width": len(p),
            "fields": fields,
            "is_bigendian": False,
            "point_step": 20,
            "row_step": 20 * len(p),
            "data": data.tobytes(),
            "is_dense": True,
        }
        with open(path, "wb") as out, Writer(out) as writer:
            schema = writer.register_msgdef("sensor_msgs/msg/PointCloud2", definition)
            writer.write_message("/points", schema, message, log_time=1, publish_time=1)

    return write, None


# PCL


def pcl(*words):
    subprocess.run(words, check=True, capture_output=True)


def pcl_pcd(mode):
    def write(path, p):
        text = path.with_suffix(".text.pcd")
        head = f"VERSION .7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH {len(p)}\nHEIGHT 1\nPOINTS {len(p)}\n"
        text.write_text(head + "DATA ascii\n" + "".join("%.9g %.9g %.9g\n" % tuple(q) for q in p))
        pcl("pcl_convert_pcd_ascii_binary", str(text), str(path), str(mode))

    def read(path):
        text = path.with_suffix(".back.pcd")
        pcl("pcl_convert_pcd_ascii_binary", str(path), str(text), "0")
        return np.loadtxt(text.read_text().split("DATA ascii\n")[1].splitlines())[:, :3]

    return write, read


if shutil.which("pcl_convert_pcd_ascii_binary"):
    for mode, words in ((0, " (text)"), (1, ""), (2, " (compressed)")):

        def make(mode=mode):
            write, read = pcl_pcd(mode)
            return write, read if mode == 1 else None

        row(f"pcd{words}", "PCL", SMALL, 1e-6)(make)

PACKAGES = {"Open3D": "open3d", "Open3D tensors": "open3d", "VTK": "vtk"}


def version(peer):
    if peer == "PCL":
        found = subprocess.run(["dpkg-query", "-W", "-f", "${Version}", "pcl-tools"], capture_output=True, text=True)
        return found.stdout.split("+")[0]
    return importlib.metadata.version(PACKAGES.get(peer, peer))


def verdict(points, expected, tolerance):
    points = np.asarray(points, dtype=np.float64)
    if points.shape != expected.shape:
        return f"**{len(points)} points of {len(expected)}**"
    off = np.abs(points - expected).max()
    if off == 0:
        return f"{len(points)} points, the same bits"
    words = f"{len(points)} points, to {off:.0e}"
    return words if off <= tolerance else f"**{words}**"


def main():
    convert = sys.argv[1]
    lines = [
        "| format | peer | it writes, SRRF reads | SRRF writes, it reads |",
        "|---|---|---|---|",
    ]
    bad = 0
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        for number, (format, peer, points, tolerance, write, read) in enumerate(ROWS):
            extension = format.split(" ")[0].split("#")[0]
            scan = "#2" if "#2" in format else ""
            cells = []
            if write:
                path, back = folder / f"{number}.{extension}", folder / f"{number}.npy"
                if extension == "npy":
                    back = folder / f"{number}.ply.npy"
                write(path, points)
                done = subprocess.run([convert, f"{path}{scan}", str(back)], capture_output=True, text=True)
                if done.returncode:
                    cells.append(f"**{done.stderr.strip().replace(str(folder) + '/', '')}**")
                else:
                    cells.append(verdict(np.load(back), points, tolerance))
            else:
                cells.append("")
            if read:
                source, path = folder / f"{number}.in.npy", folder / f"{number}.out.{extension}"
                np.save(source, points)
                done = subprocess.run([convert, str(source), str(path)], capture_output=True, text=True)
                if done.returncode:
                    cells.append(f"**{done.stderr.strip().replace(str(folder) + '/', '')}**")
                else:
                    try:
                        cells.append(verdict(read(path), points, tolerance))
                    except Exception as error:  # what a peer says is what the table shows
                        cells.append(f"**{type(error).__name__}: {str(error).splitlines()[0]}**")
            else:
                cells.append("")
            bad += sum("**" in cell for cell in cells)
            lines.append(f"| {format} | {peer} {version(peer)} | {cells[0]} | {cells[1]} |")
            print(lines[-1], flush=True)
    lines[0:0] = [
        "<!-- Written by scripts/check-peers.sh --book. -->",
        "# Other tools, value by value",
        "",
        f"{N} points of a seeded generator; at map coordinates (double precision) where format and peer hold them. What is off "
        "by more than the format's own step is in bold. `scripts/check-peers.sh` makes this table.",
        "",
    ]
    if "--book" in sys.argv:
        (ROOT / "book/src/generated/peers.md").write_text("\n".join(lines) + "\n")
    print(f"{len(ROWS)} rows, {bad} cells that are wrong")
    return 1 if bad else 0


sys.exit(main())
