"""Tables, masked arrays, meshes and other holders of points."""

import numpy as np
import pytest
from clouds import box

import srrf
from srrf._arrays import faces_of, points_of


class Held:
    """Holds what it is given, as the objects of other libraries do."""

    def __init__(self, **parts):
        self.__dict__.update(parts)


class Table(Held):
    """Stands for a frame of pandas or polars: names of columns, and columns by name."""

    def __init__(self, **columns):
        super().__init__(columns=list(columns), held=columns)

    def __getitem__(self, name):
        return self.held[name]


@pytest.fixture(scope="module")
def axes(cloud):
    x, y, z = cloud.T
    return {"intensity": np.zeros(len(cloud)), "y": y, "z": z, "x": x}


def test_the_columns_of_a_table_are_chosen_by_name(cloud, axes):
    capitals = {name.upper(): column for name, column in axes.items()}
    for table in (Table(**axes), Table(**capitals), axes, Table(a=axes["x"], b=axes["y"], c=axes["z"])):
        assert np.array_equal(points_of(table, "t"), cloud), table
    both = Table(X=axes["x"] + 7, **axes)
    assert np.array_equal(points_of(both, "t"), cloud), "the exact names come first"
    single = {name: column.astype(np.float32) for name, column in axes.items()}
    assert points_of(single, "t").dtype == np.float32


def test_tables_without_x_y_z_are_asked_about(cloud, axes):
    for table, word in [
        (Table(i=axes["x"], e=axes["x"], n=axes["y"], h=axes["z"]), r"'i', 'e', 'n', 'h'.*chosen"),
        ({"points": cloud}, "'points'.*chosen"),
        ({"x": axes["x"], "y": axes["y"], "z": axes["z"][:-1]}, "numbers"),
        ({"x": cloud, "y": axes["y"], "z": axes["z"]}, r"column 'x' has the shape"),
    ]:
        with pytest.raises(srrf.InputError, match=word):
            points_of(table, "t")
    with pytest.raises(srrf.InputTypeError, match="column 'z'.*text"):
        points_of({"x": axes["x"], "y": axes["y"], "z": np.array(["1"] * len(cloud))}, "t")


def test_pandas_is_taken(cloud, axes):
    pandas = pytest.importorskip("pandas")
    frame = pandas.DataFrame(axes)
    labelled = frame.assign(label="tree")
    for table in (frame, labelled, frame.rename(columns=str.upper), frame.astype("Float64"), frame[frame.columns[::-1]]):
        assert np.array_equal(points_of(table, "t"), cloud), table.dtypes
    assert np.array_equal(points_of(pandas.DataFrame(np.column_stack([cloud, cloud])), "t"), cloud), "columns without names"
    holes = frame.astype("Float64")
    holes.loc[3, "x"] = pandas.NA
    assert np.flatnonzero(np.isnan(points_of(holes, "t"))[:, 0]).tolist() == [3]
    assert np.array_equal(points_of(frame.loc[5:60, ["x", "y", "z"]], "t"), cloud[5:61])
    with pytest.raises(srrf.InputTypeError, match="column 'x'"):
        points_of(labelled.assign(x="far"), "t")


def test_polars_and_arrow_are_taken(cloud, axes):
    for library in ("polars", "pyarrow"):
        module = pytest.importorskip(library)
        table = module.DataFrame(axes) if library == "polars" else module.table(axes)
        assert np.array_equal(points_of(table, "t"), cloud), library


def test_masked_points_are_left_out_and_said(cloud, target):
    for dtype in (float, np.float32, int):
        given = (cloud * 100).astype(dtype)
        masked = np.ma.masked_array(given, mask=np.zeros(given.shape, bool))
        assert np.array_equal(points_of(masked, "m"), given)
        masked[[4, 9], 1] = np.ma.masked
        found = points_of(masked, "m")
        assert np.flatnonzero(np.isnan(found).any(axis=1)).tolist() == [4, 9]
        assert np.array_equal(np.delete(found, [4, 9], axis=0), np.delete(given, [4, 9], axis=0))
    masked = np.ma.masked_array(cloud, mask=np.zeros(cloud.shape, bool))
    masked[7] = np.ma.masked
    assert "source: 1 point with NaN" in " ".join(srrf.register(masked, target, method="icp").warnings)
    with pytest.raises(srrf.InputError, match="1 of them hold NaN"):
        srrf.write("never.ply", masked)


def test_points_of_other_libraries(cloud):
    faces = np.array([[0, 1, 2], [2, 3, 4]])
    holders = [
        Held(xyz=cloud, points=Held(x=1)),  # laspy
        Held(points=Table(x=cloud[:, 0], y=cloud[:, 1], z=cloud[:, 2])),  # PyntCloud
        Held(vertex={"positions": cloud}, triangle={"indices": faces}),  # Open3D's meshes of tensors
    ]
    for holder in holders:
        assert np.array_equal(points_of(holder, "h"), cloud)
    assert np.array_equal(faces_of(holders[2], len(cloud), "h"), faces)
    for thing in (Held(), iter(cloud), {1, 2}, print):
        with pytest.raises(srrf.InputTypeError, match=r"an object of .*\(N, 3\)"):
            points_of(thing, "h")


@pytest.mark.parametrize(
    ("array", "words"),
    [
        (np.zeros((4, 50)), ["(4, 50)", "transposed", "source.T", "source[:, :3]"]),
        (np.zeros((6, 2000)), ["(6, 2000)", "transposed", "source.T"]),
        (np.zeros((50, 3), object), ["objects", "astype(float)"]),
        (np.array([[None, 1, 2]] * 4), ["objects", "astype(float)"]),
        (np.zeros((5, 3), "M8[s]"), ["datetime64[s]"]),
        ([], ["(0,)"]),
        ([[]], ["(1, 0)"]),
        (np.zeros((3, 0)), ["(3, 0)"]),
        (np.zeros((0, 7)), ["empty"]),
        (np.zeros((2, 2, 2, 3)), ["(2, 2, 2, 3)"]),
        (b"a.ply", ["a.ply"]),
    ],
)
def test_what_is_refused_says_what_it_is(array, words, cloud):
    with pytest.raises((srrf.InputError, srrf.FileError)) as caught:
        srrf.register(array, cloud)
    for word in words:
        assert word in str(caught.value), str(caught.value)


def test_few_wide_rows_that_are_points_are_taken():
    rows = np.random.default_rng(0).uniform(size=(20, 13))
    assert points_of(rows, "r").shape == (20, 3) and points_of(rows[:5, :6], "r").shape == (5, 3)


def test_lists_views_and_precisions(cloud):
    expected = srrf.corrupt(cloud, "impulse", 2, 1)
    twice = np.empty((2 * len(cloud), 10))
    twice[1::2, 7:1:-2] = cloud
    for form in (twice[1::2, 7:1:-2], [list(p) for p in cloud], list(cloud), tuple(map(tuple, cloud)), memoryview(cloud)):
        assert np.array_equal(srrf.corrupt(form, "impulse", 2, 1), expected)
    half = box(60).astype(np.float16)
    assert np.array_equal(points_of(half, "h"), half.astype(np.float32))
    unsigned = np.array([[2**63, 0, 0], [0, 1, 0], [0, 0, 1]], np.uint64)
    assert points_of(unsigned, "u")[0, 0] == 2.0**63
