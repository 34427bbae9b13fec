"""What is taken for a cloud, and what is said of the rest."""

import numpy as np
import pytest

import srrf
from srrf._arrays import points_of


class Holder:
    """Stands for Open3D (`points`), trimesh (`vertices`) and the like."""

    def __init__(self, name, value):
        setattr(self, name, value)


class Tensor:
    """Stands for a torch tensor with a gradient: an array only after `detach` and `cpu`."""

    def __init__(self, array, steps=("detach", "cpu")):
        self.array, self.steps = array, steps

    def detach(self):
        return Tensor(self.array, self.steps[1:])

    def cpu(self):
        return Tensor(self.array, self.steps[1:])

    def __array__(self, dtype=None, copy=None):
        if self.steps:
            raise RuntimeError("call detach")
        return np.asarray(self.array, dtype)


def test_layouts_and_types_are_the_same_cloud(cloud):
    expected = srrf.corrupt(cloud, "gaussian", 2, 7)
    wide = np.column_stack([cloud, np.full((len(cloud), 4), np.nan)])
    record = np.zeros(len(cloud), dtype=[("intensity", "u1"), ("z", "f8"), ("x", "f8"), ("y", "f8")])
    record["x"], record["y"], record["z"] = cloud.T
    unaligned = np.zeros(len(cloud) * 24 + 1, np.uint8)[1:].view(np.float64).reshape(-1, 3)
    unaligned[:] = cloud
    same = [
        np.asfortranarray(cloud),
        wide,
        wide[:, :3],
        cloud[::-1][::-1],
        np.repeat(cloud, 2, axis=0)[::2],
        cloud.astype(">f8"),
        cloud.tolist(),
        record,
        unaligned,
        Holder("points", cloud),
        Holder("vertices", cloud),
        Holder("point", {"positions": cloud}),
        Tensor(cloud),
    ]
    for form in same:
        assert np.array_equal(srrf.corrupt(form, "gaussian", 2, 7), expected), type(form)
    frozen = cloud.copy()
    frozen.setflags(write=False)
    assert np.array_equal(srrf.corrupt(frozen, "gaussian", 2, 7), expected)


def test_single_precision_and_whole_numbers_are_exact():
    rng = np.random.default_rng(0)
    whole = rng.integers(-100, 100, (50, 3))
    for dtype in ("int64", "int32", "int16", "uint8", "float16", "float32", "longdouble"):
        array = (whole % 100).astype(dtype)
        assert np.array_equal(srrf._srrf.Cloud(points_of(array, "a"), "a").points(), array.astype(float)), dtype
    large = np.array([[2**40 + 1, 0, 0], [0, 1, 0], [0, 0, 1]])
    assert srrf._srrf.Cloud(points_of(large, "a"), "a").points()[0, 0] == 2**40 + 1


@pytest.mark.parametrize(
    ("array", "words"),
    [
        (np.zeros((3, 50)), ["source", "(3, 50)", "looks transposed", "source.T"]),
        (np.zeros((3, 5)), ["(3, 5)", "looks transposed", "[:, :3]"]),
        (np.vstack([np.zeros((3, 9)), np.ones(9)]), ["(4, 9)", "looks transposed", "[:3].T"]),
        (np.zeros((50, 2)), ["(50, 2)", "(N, 3)"]),
        (np.zeros(150), ["(150,)", "reshape(-1, 3)"]),
        (np.zeros((1, 50, 3)), ["(1, 50, 3)", "source[0]"]),
        (np.zeros((4, 50, 3)), ["(4, 50, 3)", "reshape(-1, 3)"]),
        (np.float64(3.0), ["()", "one row for each point"]),
        (np.zeros((0, 3)), ["empty"]),
        (np.full((9, 3), np.nan), ["each of its 9 points", "NaN"]),
        (np.zeros((9, 3)), ["line"]),
        ([[1, 2, 3], [4, 5]], ["source"]),
        (np.zeros(4, dtype=[("a", "f8")]), ["x, y and z"]),
    ],
)
def test_shapes_that_are_wrong_say_what_was_seen(array, words, cloud):
    with pytest.raises(ValueError) as caught:
        srrf.register(array, cloud)
    assert isinstance(caught.value, srrf.InputError)
    for word in words:
        assert word in str(caught.value), str(caught.value)


def test_other_types_are_refused_by_name(cloud):
    for bad, word in [
        (np.zeros((5, 3), bool), "truth values"),
        (np.zeros((5, 3), complex), "complex"),
        (np.full((5, 3), "a"), "text"),
        (np.full((5, 3), None), "objects"),
        (None, "None"),
    ]:
        with pytest.raises(TypeError, match=word):
            srrf.register(cloud, bad)
    with pytest.raises(srrf.MissingFileError, match="nowhere.ply"):
        srrf.register("nowhere.ply", cloud)
    with pytest.raises(FileNotFoundError):
        srrf.read("nowhere.ply")


def test_real_libraries_are_taken(cloud):
    expected = srrf.corrupt(cloud, "uniform", 1, 2)
    trimesh = pytest.importorskip("trimesh")
    assert np.array_equal(srrf.corrupt(trimesh.PointCloud(cloud), "uniform", 1, 2), expected)
    mesh = trimesh.Trimesh(vertices=cloud, faces=[[0, 1, 2]], process=False)
    assert np.array_equal(srrf.corrupt(mesh, "uniform", 1, 2, vertices=True), expected)


def test_open3d_is_taken(cloud):
    o3d = pytest.importorskip("open3d")
    expected = srrf.corrupt(cloud, "uniform", 1, 2)
    legacy = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(cloud))
    assert np.array_equal(srrf.corrupt(legacy, "uniform", 1, 2), expected)
    tensors = o3d.t.geometry.PointCloud(o3d.core.Tensor(cloud))
    assert np.array_equal(srrf.corrupt(tensors, "uniform", 1, 2), expected)


def test_torch_is_taken(cloud):
    torch = pytest.importorskip("torch")
    expected = srrf.corrupt(cloud, "uniform", 1, 2)
    assert np.array_equal(srrf.corrupt(torch.tensor(cloud, requires_grad=True), "uniform", 1, 2), expected)
