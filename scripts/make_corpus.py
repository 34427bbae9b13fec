#!/usr/bin/env python3
"""Small files of clouds as people, cameras and programs write them, valid and broken, with a manifest of what each holds.

    python3 scripts/make_corpus.py FOLDER                  # writes the files and FOLDER/manifest.json
    python3 scripts/make_corpus.py FOLDER --check PROGRAM  # and compares what `PROGRAM inspect --json` says of each

The manifest is a list of objects: `file`, `args` (switches of reading), and either `points`, `faces`, `low` and `high`, or
`scans`: how many there are that are no one cloud, or `error`: words that the message has. Needs the standard library alone, and gives the same bytes everywhere.
"""

import argparse
import base64
import gzip
import io
import json
import pathlib
import random
import struct
import subprocess
import sys
import zipfile
import zlib

N = 40
_random = random.Random(0)
# Single precision, so that every format holds them as they are.
P = [tuple(struct.unpack("<f", struct.pack("<f", _random.uniform(-2, 2)))[0] for _ in range(3)) for _ in range(N)]
CASES = []


def add(file, content, args=(), points=P, faces=0, scans=0, error=None):
    """A file; `points` are those that are read from it, unless it holds scans apart, or an error with these words comes."""
    content = content.encode() if isinstance(content, str) else content
    if error is not None:
        expected = {"error": error if isinstance(error, list) else [error]}
    elif scans:
        expected = {"scans": scans}
    else:
        axes = list(zip(*points))
        expected = {"points": len(points), "faces": faces, "low": [min(a) for a in axes], "high": [max(a) for a in axes]}
    CASES.append((file, content, {"file": file, "args": list(args), **expected}))


def floats(rows, kind="f"):
    return b"".join(struct.pack(f"<{len(row)}{kind}", *row) for row in rows)


def text(row=lambda i, p: "{} {} {}".format(*p), points=P, head="", end="\n"):
    return head + "".join(row(i, p) + end for i, p in enumerate(points))


def csv(head, row=lambda i, p: "{},{},{}".format(*p), **more):
    return text(row, head=head + "\n", **more)


def npy(descr, shape, body, fortran=False):
    header = f"{{'descr': {descr}, 'fortran_order': {fortran}, 'shape': {shape}, }}"
    header += " " * (-(len(header) + 11) % 64) + "\n"
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(header)) + header.encode() + body


def npz(**arrays):
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w") as archive:
        for name, array in arrays.items():
            archive.writestr(zipfile.ZipInfo(name + ".npy"), array)
    return out.getvalue()


def plain(shape=(N, 3)):
    return npy("'<f4'", shape, floats(P))


# Bare numbers

ring = [p + (float(i * 7 % 256), float(i % 32)) for i, p in enumerate(P)]
add("nuscenes.pcd.bin", floats(ring))
add("nuscenes.bin", floats(ring))
add("kitti.bin", floats(p + (i % 100 / 100,) for i, p in enumerate(P)))
add("three.bin", floats(P))
add("double.bin", floats(P, "d"))
positive = [tuple(abs(c) + 0.1 for c in p) for p in P]
single = [struct.unpack("<3f", struct.pack("<3f", *p)) for p in positive]
add("several-layouts.bin", floats(positive), error="--layout")
add("said-layout.bin", floats(positive), ["--layout", "3xf32"], single)
add("absurd.bin", floats([(1e38, 1e-42, 1e38, 1e-42)] * N), error="--layout")

# Titles and columns of text

add("trailing-comma.csv", csv("x,y,z", lambda i, p: "{},{},{},".format(*p)))
add("extra-column.csv", csv("x,y,z", lambda i, p: "{},{},{},{}".format(*p, i % 3)))
for name, head in [("east", "easting,northing,height"), ("paraview", "Points:0,Points:1,Points:2"), ("pos", "pos_x,pos_y,pos_z"),
                   ("x_m", "x_m,y_m,z_m"), ("unit", "x [m],y [m],z [m]"), ("quoted", '"x","y","z"')]:
    add(f"title-{name}.csv", csv(head))
add("title-order.csv", csv("id,z,x,y", lambda i, p: f"{i},{p[2]},{p[0]},{p[1]}"))
add("title-comment.xyz", text(lambda i, p: f"{i} {p[0]} {p[1]} {p[2]}", head="# id x y z\n# made by hand\n"))
add("title-unknown.csv", csv("a,b,c"), error=["--columns", "a, b, c"])
add("title-said.csv", csv("a,b,c"), ["--columns", "c,b,a"], [p[::-1] for p in P])
add("degrees.csv", csv("lon,lat,height"), error="degrees")
add("pandas.csv", csv(",x,y,z", lambda i, p: "{},{},{},{}".format(i, *p)))
add("pandas-numbers.csv", csv(",0,1,2", lambda i, p: "{},{},{},{}".format(i, *p)))
add("pandas-quote-all.csv", csv('"","x","y","z"', lambda i, p: '"{}","{}","{}","{}"'.format(i, *p)))
comma = lambda p: [str(c).replace(".", ",") for c in p]
add("decimal-commas.csv", csv("x;y;z", lambda i, p: ";".join(comma(p)), end="\r\n"))
add("decimal-commas-quoted.csv", csv("x,y,z", lambda i, p: ",".join(f'"{c}"' for c in comma(p))))
add("decimal-commas.txt", csv("x\ty\tz", lambda i, p: "\t".join(comma(p))))
add("thousands.csv", 'x,y,z\n"1,234","2,345","3,456"\n', error="thousands")
add("words.csv", csv("name,x,y,z", lambda i, p: '"a, {}\nb","{}","{}","{}"'.format(i, *p)))
for encoding in ["utf-16-le", "utf-16-be", "utf-32-le", "utf-32-be"]:
    for name, mark in [(encoding, ""), (encoding + "-marked", "\ufeff")]:
        add(f"{name}.csv", (mark + csv("x,y,z")).encode(encoding))
        add(f"{name}.off", f"{mark}OFF\n{N} 0 0\n{text()}".encode(encoding))
add("cut.csv", ("\ufeff" + csv("x,y,z")).encode("utf-16-le")[:-1], error=["UTF-16", "damaged at character", "UTF-8"])
add("excel.csv", "sep=;\r\n" + csv("x;y;z", lambda i, p: "{};{};{}".format(*p), end="\r\n"))
add("empty-cells.csv", csv("x,y,z") + "1,,3\n,,\nNA,1,2\n1,2,#N/A\n")
add("empty-cells.txt", csv("x\ty\tz\tn", lambda i, p: "{}\t{}\t{}\t".format(*p)) + "1\t\t3\t4\n")
add("cloudcompare.xyz", text(lambda i, p: "{} {} {} nan".format(*p), head=f"//X Y Z Scalar\n{N}\n"))

# Poses and transposed tables

add("tum.txt", "".join(f"{i}.5 {i} 0 0 0 0 0 1\n" for i in range(5)), error="TUM")
add("kitti.txt", "".join(f"1 0 0 {i} 0 1 0 0 0 0 1 0\n" for i in range(5)), error="KITTI")
add("matrix.txt", "1 0 0 4\n0 1 0 5\n0 0 1 6\n0 0 0 1\n", error="pose")
add("transposed.npy", npy("'<f8'", (3, N), floats(zip(*P), "d")), error="transposed")
add("transposed.npz", npz(points=npy("'<f8'", (3, N), floats(zip(*P), "d"))), error="transposed")

# NumPy

add("plain.npy", plain())
add("fortran.npy", npy("'<f8'", (N, 3), floats(zip(*P), "d"), True))
add("map.npy", npy("'<f4'", (5, 8, 3), floats(P)))
add("batch.npy", npy("'<f4'", (1, N, 3), floats(P)))
add("half.npy", npy("'<f2'", (2, 3), struct.pack("<6e", 1, 2, 3, 4, 5.5, -6)), points=[(1, 2, 3), (4, 5.5, -6)])
fields = "[('X', '<f4'), ('Y', '<f4'), ('Z', '<f4'), ('', '|V4'), ('ok', '|b1'), ('name', '<U2')]"
row = lambda p: struct.pack("<3f", *p) + bytes(4) + b"\x01" + "ab".encode("utf-32-le")
add("fields.npy", npy(fields, (N,), b"".join(map(row, P))))
add("open3d.npz", npz(positions=plain(), colors=npy("'<f4'", (N, 3), floats([(0.5, 0.5, 0.5)] * N))))
for name in ["pts", "coord", "pc", "xyz"]:
    add(f"named-{name}.npz", npz(**{name: plain(), "faces": npy("'<i4'", (1, 3), bytes(12))}))
column = lambda axis: npy("'<f8'", (N,), b"".join(struct.pack("<d", p[axis]) for p in P))
add("xyz.npz", npz(x=column(0), y=column(1), z=column(2), colors=npy("'<f4'", (N, 3), bytes(12 * N))))
add("easting.npz", npz(height=column(2), easting=column(0), northing=column(1)))
add("said-axes.npz", npz(a=column(0), b=column(1), c=column(2)), ["--columns", "a,b,c"])
add("colours-alone.npz", npz(colors=plain()), error=["--array", "its name says another"])
add("objects.npy", npy("'|O'", (2,), b"\x80\x04"), error="Python objects")
add("two-arrays.npz", npz(a=plain(), b=plain()), error="--array")
add("said-array.npz", npz(a=plain(), b=npy("'<f4'", (2, 3), bytes(24))), ["--array", "a"])

# PCD


def pcd(names="x y z", types="F F F", data="ascii", lines="", size="SIZE 4 4 4\n", version="0.7", body=None):
    fields = "COLUMNS" if version == ".5" else "FIELDS"
    head = f"# .PCD v{version}\nVERSION {version}\n{fields} {names}\n{size}TYPE {types}\nCOUNT{' 1' * len(types.split())}\n{lines}"
    return (head + f"WIDTH {N}\nHEIGHT 1\nPOINTS {N}\nDATA {data}\n").encode() + (body or text().encode())


add("plain.pcd", pcd())
add("small-type.pcd", pcd(types="f f f"))
add("capitals.pcd", pcd("X Y Z"))
add("capital-binary.pcd", pcd(data="BINARY", body=floats(P)))
add("version-5.pcd", f"# .PCD v.5\nVERSION .5\nCOLUMNS x y z\nWIDTH {N}\nHEIGHT 1\nPOINTS {N}\nDATA ascii\n" + text())
add("cut.pcd", pcd(data="binary", body=floats(P)[:-5]), error="cut short")


def lzf(columns, zeros=0):
    """A body of PCD in LZF: the columns as they are, then zeros as one zero and a copy of it."""
    plain = b"".join(struct.pack(f"<{len(column)}f", *column) for column in columns)
    packed = b"".join(bytes([len(part) - 1]) + part for part in (plain[i:i + 32] for i in range(0, len(plain), 32)))
    if zeros:
        packed += bytes([0, 0, 7 << 5, zeros - 10, 0])
    return struct.pack("<II", len(packed), len(plain) + zeros) + packed


add("packed.pcd", pcd(data="binary_compressed", body=lzf(zip(*P))))
add("packed-zeros.pcd", pcd("x y z i", "F F F F", size="SIZE 4 4 4 4\n", data="binary_compressed", body=lzf(zip(*P), 4 * N)))
add("packed-cut.pcd", pcd(data="binary_compressed", body=lzf(zip(*P))[:-5]), error="cut short")

# PLY


def ply(properties="property float x\nproperty float y\nproperty float z\n", form="ascii", body=None, faces=""):
    head = f"ply\nformat {form} 1.0\nelement vertex {N}\n{properties}{faces}end_header\n"
    return head.encode() + (text().encode() if body is None else body)


binary = "binary_little_endian"
xyz = "property float x\nproperty float y\nproperty float z\n"
add("plain.ply", ply())
add("capitals.ply", ply(xyz.replace(" x", " X").replace(" y", " Y").replace(" z", " Z")))
add("bool.ply", ply(xyz + "property bool b\n", binary, b"".join(floats([p]) + b"\x01" for p in P)))
add("long4.ply", ply(xyz + "property long b\n", binary, b"".join(floats([p]) + bytes(4) for p in P)))
add("long8.ply", ply(xyz + "property long b\n", binary, b"".join(floats([p]) + bytes(8) for p in P)))
add("unknown-type.ply", ply(xyz + "property quad b\n", binary, b"".join(floats([p]) + b"\x09\x09" for p in P)))
add("unknown-size.ply", ply(xyz + "property quad b\n", binary, floats(P) + bytes(3)), error=["`b`", "quad"])
face = "element face 2\nproperty list uchar int vertex_indices\n"
add("mesh.ply", ply(form=binary, faces=face, body=floats(P) + struct.pack("<B3iB4i", 3, 0, 1, 2, 4, 0, 1, 2, 3)), faces=3)
add("cut.ply", ply(form=binary, body=floats(P)[:-1]), error=["announced", "39 found"])

# Meshes of corners

CORNERS = [(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (1.0, 1.0, 0.0), (0.0, 1.0, 0.5)]
TRIANGLES = [(0, 1, 2), (0, 2, 3)]


def mesh(file, content, **more):
    add(file, content, points=CORNERS, faces=2, **more)


rows = "0 0 0\n1 0 0\n1 1 0\n0 1 0.5\n3 0 1 2\n3 0 2 3\n"
mesh("plain.off", "OFF\n4 2 0\n" + rows)
mesh("one-line.off", "OFF 4 2 0 " + rows.replace("\n", " "))
mesh("small.off", "off\n4 2 0\n" + rows)
mesh("glued.off", "OFF4 2 0\n" + rows)
mesh("no-word.off", "4 2 0\n" + rows)
colours = "".join(line + " 255 0 0 255\n" for line in rows.splitlines()[:4]) + "3 0 1 2\n3 0 2 3\n"
mesh("colours.off", "COFF\n4 2 0\n" + colours)
mesh("texture.off", "STOFF\n4 2 0\n" + colours.replace(" 255 0 0 255", " 0.5 0.5"))
mesh("normals.off", "NOFF\n4 2 0\n" + colours.replace(" 255 0 0 255", " 0 0 1"))
mesh("weights.off", "4OFF\n4 2 0\n" + colours.replace(" 255 0 0 255", " 1"))
mesh("three-dimensions.off", "nOFF\n3\n4 2 0\n" + rows)
add("four-dimensions.off", "nOFF\n4\n1 0 0\n1 2 3 4\n", error="4 dimensions")
add("binary.off", b"OFF BINARY\n\0\0\0\1\0\0\0\0\0\0\0\0", error="binary OFF")
obj = "".join("v {} {} {}\n".format(*c) for c in CORNERS) + "f 1 2 3\nf 1/1 3/2 4/3\n"
mesh("plain.obj", obj)
mesh("bom-and-more.obj", "\ufeff# a\nfoo bar\n" + obj.replace("v 1.0 0.0", "v 1.0 \\\n0.0", 1))
add("loose.obj", obj + "v 5 6 7\n", points=[*CORNERS, (5.0, 6.0, 7.0)], faces=2)
add("points.obj", "".join("v {} {} {}\n".format(*p) for p in P))
facets = [[CORNERS[i] for i in t] for t in TRIANGLES]
stl = "".join("facet normal 0 0 1\nouter loop\n" + "".join("vertex {} {} {}\n".format(*c) for c in f) + "endloop\nendfacet\n" for f in facets)
mesh("plain.stl", f"solid a\n{stl}endsolid a\n")
mesh("capitals.stl", f"solid a\n{stl}endsolid a\n".upper())
solid = bytes(80) + struct.pack("<I", 2) + b"".join(struct.pack("<12fH", 0, 0, 1, *sum(f, ()), 0) for f in facets)
mesh("binary.stl", solid)
mesh("one-byte-more.stl", solid + b"\n")

# Scans, VTK, glTF, MCAP

move = "1 0 0\n1 0 0\n0 1 0\n0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n10 0 0 1\n"
still = move.replace("1 0 0\n1 0 0\n", "0 0 0\n1 0 0\n", 1).replace("10 0 0 1", "0 0 0 1")
half = [text(lambda i, p: "{} {} {} 0.5".format(*p), points=half) for half in (P[:20], P[20:])]
ptx = f"20\n1\n{still}{half[0]}20\n1\n{move}{half[1]}"
add("two.ptx", ptx, points=P[:20] + [(x + 10, y, z) for x, y, z in P[20:]])
add("second.ptx", ptx, ["--scan", "2"], [(x + 10, y, z) for x, y, z in P[20:]])
add("one-more.pts", f"{N - 1}\n{text()}", error=[f"announces {N - 1} points, and {N} follow"])
add("one-fewer.pts", f"{N + 1}\n{text()}", error=f"{N + 1} points announced, {N} found")
add("off-in-two.pts", f"21\n{half[0]}20\n{half[1]}", ["--scan", "1"], error="21 points announced, 20 found")
add("two.pts", f"20\n{half[0]}20\n{half[1]}", scans=2)
add("second.pts", f"20\n{half[0]}20\n{half[1]}", ["--scan", "2"], P[20:])
vtk = "# vtk DataFile Version 3.0\na\n{}\nDATASET POLYDATA\nPOINTS 40 float\n"
add("text.vtk", vtk.format("ASCII") + text())
add("binary.vtk", vtk.format("BINARY").encode() + b"".join(struct.pack(">3f", *p) for p in P))
packed = zlib.compress(floats(P))
head = struct.pack("<4I", 1, 12 * N, 0, len(packed))
for name, how, data in [("text", "ascii", text()), ("zlib", "binary", base64.b64encode(head).decode() + base64.b64encode(packed).decode())]:
    add(f"{name}.vtp", '<?xml version="1.0"?>\n<VTKFile type="PolyData" version="1.0" byte_order="LittleEndian" '
        f'compressor="vtkZLibDataCompressor"><PolyData><Piece NumberOfPoints="{N}"><Points><DataArray type="Float32" '
        f'NumberOfComponents="3" format="{how}">{data}</DataArray></Points></Piece></PolyData></VTKFile>\n')
scene = json.dumps({
    "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
    "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "mode": 0}]}],
    "buffers": [{"byteLength": 12 * N}], "bufferViews": [{"buffer": 0, "byteLength": 12 * N}],
    "accessors": [{"bufferView": 0, "componentType": 5126, "count": N, "type": "VEC3",
                   "min": [min(a) for a in zip(*P)], "max": [max(a) for a in zip(*P)]}],
}).encode()
scene += b" " * (-len(scene) % 4)
chunks = struct.pack("<I4s", len(scene), b"JSON") + scene + struct.pack("<I4s", 12 * N, b"BIN\0") + floats(P)
add("points.glb", struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks)


def mcap(messages):
    string = lambda s: struct.pack("<I", len(s)) + s.encode()
    record = lambda kind, body: struct.pack("<BQ", kind, len(body)) + body
    cdr = b"\0\1\0\0" + struct.pack("<iII", 0, 0, 2) + b"a\0\0\0" + struct.pack("<III", 1, N, 3)
    for i, name in enumerate("xyz"):
        cdr += struct.pack("<I", 2) + name.encode() + b"\0\0\0" + struct.pack("<IBxxxI", 4 * i, 7, 1)
    cdr += struct.pack("<BxxxIII", 0, 12, 12 * N, 12 * N) + floats(P) + b"\1"
    body = record(1, string("ros2") + string(""))
    body += record(3, struct.pack("<H", 1) + string("sensor_msgs/msg/PointCloud2") + string("ros2msg") + struct.pack("<I", 0))
    body += record(4, struct.pack("<HH", 0, 1) + string("/lidar") + string("cdr") + struct.pack("<I", 0))
    for i in range(messages):
        body += record(5, struct.pack("<HIQQ", 0, i, i, i) + cdr)
    body += record(15, struct.pack("<I", 0)) + record(2, struct.pack("<QQI", 0, 0, 0))
    return b"\x89MCAP0\r\n" + body + b"\x89MCAP0\r\n"


add("one.mcap", mcap(1))
add("two.mcap", mcap(2), scans=2)
add("second.mcap", mcap(2), ["--message", "2", "--topic", "/lidar"])

# What is no cloud, or of a format that is not read


def laszip1():
    item = struct.pack("<HHH", 6, 20, 2)
    record = struct.pack("<HHBBHIIqqH", 1, 0, 0, 0, 0, 0, 0, -1, -1, 1) + item
    vlr = struct.pack("<H16sHH32s", 0, b"laszip encoded", 22204, len(record), b"") + record
    head = bytearray(227)
    head[:4], head[24:26] = b"LASF", b"\1\2"
    struct.pack_into("<HII", head, 94, 227, 227 + len(vlr), 1)
    struct.pack_into("<BHI", head, 104, 0x80, 20, 1)
    struct.pack_into("<3d", head, 131, 0.01, 0.01, 0.01)
    return bytes(head) + vlr + bytes(28)


def las(minor=2, kind=0, size=20, count=N, more=b"", cut=0):
    """LAS 1.`minor` with points of format `kind`, each of `size` bytes of which all but x, y and z are zero."""
    head = bytearray(375 if minor == 4 else 227)
    head[:4], head[24:26] = b"LASF", bytes([1, minor])
    struct.pack_into("<HIIBHI", head, 94, len(head), len(head), 0, kind, size, 0 if kind > 5 else count)
    struct.pack_into("<6d", head, 131, STEP, STEP, STEP, 0, 0, 0)
    if minor == 4:
        struct.pack_into("<Q", head, 247, count)
    body = b"".join(struct.pack("<3i", *[round(c / STEP) for c in p]) + bytes(size - 12) for p in P)
    return bytes(head) + body[:len(body) - cut] + more


STEP = 0.0001
steps = [tuple(round(c / STEP) * STEP for c in p) for p in P]
add("plain.las", las(), points=steps)
add("colours.las", las(kind=2, size=26), points=steps)
add("undescribed.las", las(kind=1, size=28 + 4), points=steps)
add("las14.las", las(4, kind=6, size=30), points=steps)
add("las14-old-points.las", las(4, kind=1, size=28), points=steps)
add("more-bytes.las", las(more=b"more"), points=steps)
add("cut.las", las(cut=7), error="cut short")
add("laszip1.laz", laszip1(), error="LASzip 1")
add("pointer.ply", "version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 9\n", error="git lfs pull")
add("page.pcd", "<!DOCTYPE html><html></html>", error="web page")
add("packed.ply.gz", gzip.compress(ply(), mtime=0), error="gunzip")
add("modelnet.h5", b"\x89HDF\r\n\x1a\n" + bytes(8), error="HDF5")
add("empty.xyz", "", error="empty")
add("object.npy", b"\x80\x04\x95", error="pickle")
add("pose.json", '{"target_from_source": []}', error="JSON")
for name, content, words in [("a.dxf", "0\nSECTION\n", "CAD"), ("a.drc", b"DRACO\2\2", "draco_decoder"), ("a.rcp", b"\1\2\3", "ReCap"),
                             ("a.fls", b"\1\2\3", "FARO"), ("a.bag", "#ROSBAG V2.0\n", "ROS 1 bag"), ("a.pkl", b"\x80\4", "pickle")]:
    add(name, content, error=words)
add("useless-switch.ply", ply(), ["--columns", "x,y,z"], error=["--columns", "says nothing"])


def check(program, folder):
    """Compares what the program says with the manifest; the number of files that differ."""
    wrong = 0
    for _, _, expected in CASES:
        command = [program, "inspect", "--json", "--vertices", str(folder / expected["file"]), *expected["args"]]
        run = subprocess.run(command, capture_output=True, text=True)
        found = json.loads(run.stdout or "[{}]")[0]
        if "error" in expected:
            message = found.get("error", "")
            good = run.returncode == 2 and all(word in message for word in expected["error"])
        elif "scans" in expected:
            good = run.returncode == 0 and len(found["scans"]) == expected["scans"]
        else:
            near = lambda a, b: all(abs(x - y) < 1e-6 for x, y in zip(a, b, strict=True))
            good = run.returncode == 0 and found["points"] == expected["points"] and found["faces"] == expected["faces"]
            good = good and near(found["low"], expected["low"]) and near(found["high"], expected["high"])
        if not good:
            wrong += 1
            print(f"{expected['file']}: expected {expected}, found {found or run.stderr}", file=sys.stderr)
    print(f"{len(CASES) - wrong} of {len(CASES)} files as the manifest says")
    return wrong


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--check", metavar="PROGRAM")
    args = parser.parse_args()
    args.folder.mkdir(parents=True, exist_ok=True)
    for file, content, _ in CASES:
        (args.folder / file).write_bytes(content)
    manifest = [expected for _, _, expected in CASES]
    (args.folder / "manifest.json").write_text(json.dumps(manifest, indent=1) + "\n")
    print(f"{len(CASES)} files in {args.folder}")
    return check(args.check, args.folder) if args.check else 0


if __name__ == "__main__":
    sys.exit(1 if main() else 0)
