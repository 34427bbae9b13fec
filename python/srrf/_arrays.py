"""From what users hold to arrays of points, without importing any of it."""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, TypeAlias, Union

import numpy as np
from numpy.typing import NDArray

from . import _srrf
from ._errors import InputError, InputTypeError

if TYPE_CHECKING:
    from typing import Protocol

    class HasPoints(Protocol):
        """Such as ``open3d.geometry.PointCloud``."""

        @property
        def points(self) -> Any: ...

    class HasVertices(Protocol):
        """Such as ``trimesh.Trimesh``."""

        @property
        def vertices(self) -> Any: ...

    class HasPositions(Protocol):
        """Such as ``open3d.t.geometry.PointCloud``."""

        @property
        def point(self) -> Any: ...

    class HasColumns(Protocol):
        """Such as ``pandas.DataFrame`` and ``polars.DataFrame``."""

        @property
        def columns(self) -> Any: ...

    class HasXyz(Protocol):
        """Such as ``laspy.LasData``."""

        @property
        def xyz(self) -> Any: ...


#: A cloud: a file, an array of shape ``(N, >= 3)``, or an object that holds one.
Cloud: TypeAlias = Union[
    str,
    "os.PathLike[str]",
    NDArray[Any],
    "list[list[float]]",
    "Mapping[str, Any]",
    "HasPoints",
    "HasVertices",
    "HasPositions",
    "HasColumns",
    "HasXyz",
]

#: Fewest columns of a row that look like points lying side by side.
_WIDE = 13


def points_of(cloud: Cloud, name: str) -> NDArray[Any]:
    """The points of a cloud: ``(N, >= 3)``, float32 or float64, of this machine's byte order; a view where that is possible.

    Raises:
        InputError: for another shape, with the shape seen and the way out.
        InputTypeError: for what is no cloud, or holds no real numbers.
    """
    return _checked(_array_of(cloud, name), name)


def cloud_of(cloud: Cloud, name: str | None, default: str) -> _srrf.Cloud:
    """The points of a cloud or a file, copied, without those that are NaN or infinite; with the faces of a mesh.

    A file has its path as its name unless it is given another.
    """
    if isinstance(cloud, (str, bytes, os.PathLike)):
        return _srrf.open(os.fsdecode(cloud), name)
    name = name or default
    points = points_of(cloud, name)
    return _srrf.Cloud(points, name, faces_of(cloud, len(points), name))


def faces_of(cloud: Any, points: int, name: str) -> NDArray[np.uint32] | None:
    """The triangles of a mesh, shape (M, 3), as indices of its points; None of a cloud."""
    for attribute in ("triangles", "faces", "triangle"):  # Open3D; trimesh, PyVista; Open3D's meshes of tensors
        held = getattr(cloud, attribute, None)
        if held is None or callable(held) or _names_of(cloud) is not None:
            continue
        faces = _numbers(held["indices"] if attribute == "triangle" else held, name)
        if faces.size == 0 or faces.dtype.kind not in "iu":
            continue
        if faces.ndim == 1 and faces.size % 4 == 0 and bool((faces[::4] == 3).all()):  # PyVista: 3 a b c
            faces = faces.reshape(-1, 4)[:, 1:]
        if faces.ndim != 2 or faces.shape[1] != 3:
            raise InputError(f"{name}: faces of shape {faces.shape}, where triangles (M, 3) are expected; triangulate the mesh")
        if faces.min() < 0 or faces.max() >= points:
            raise InputError(f"{name}: a face names point {faces.max()} of {points} (from 0); mend the mesh")
        return np.ascontiguousarray(faces, dtype=np.uint32)
    return None


def _array_of(cloud: Any, name: str) -> NDArray[Any]:
    if isinstance(cloud, (str, bytes, os.PathLike)):
        raise InputTypeError(f"{name}: a path, where an array is expected; read it by srrf.read(path)")
    if cloud is None:
        raise InputTypeError(f"{name}: None, where an array of shape (N, 3) is expected")
    names = _names_of(cloud)
    if names is not None:
        return _of_columns(cloud, names, name)
    for attribute in ("xyz", "points", "vertices"):  # laspy; Open3D, PyVista; trimesh
        held = getattr(cloud, attribute, None)
        if held is not None and not callable(held):
            # PyntCloud's points are a frame.
            return _array_of(held, name) if _names_of(held) is not None else _numbers(held, name)
    for attribute in ("point", "vertex"):  # Open3D's clouds and meshes of tensors
        held = getattr(cloud, attribute, None)
        if held is not None and not callable(held):
            return _numbers(held["positions"], name)
    return _numbers(cloud, name)


def _names_of(table: Any) -> list[Any] | None:
    """The names of the columns of a frame, a table or a mapping; None of anything else."""
    if isinstance(table, Mapping):
        return list(table)
    if isinstance(table, np.ndarray) or not hasattr(table, "__getitem__"):
        return None
    for attribute in ("columns", "column_names"):  # pandas, polars; PyArrow, whose `columns` are the columns
        names = getattr(table, attribute, None)
        if names is None or callable(names):
            continue
        found = list(names)
        if attribute == "column_names" or not hasattr(table, "column_names"):
            return found
    return None


def _of_columns(table: Any, names: list[Any], name: str) -> NDArray[Any]:
    """The columns x, y and z of a table, in capitals or not; or its columns where there are three, or where they have no names."""
    chosen: list[Any] = []
    for axis in "xyz":
        same = [n for n in names if n == axis] or [n for n in names if isinstance(n, str) and n.lower() == axis]
        chosen += same[:1] if len(same) == 1 else []
    if len(chosen) < 3:
        unnamed = len(names) >= 3 and names == list(range(len(names)))
        if (not unnamed and len(names) != 3) or len(set(names)) != len(names):
            raise InputError(
                f"{name}: a table with the columns {names}, of which x, y and z are to be chosen; pass table[[...]] with those three"
            )
        chosen = names[:3]
    columns = [_column(table[column], f"{name}: the column {column!r}") for column in chosen]
    if len({len(column) for column in columns}) > 1:
        raise InputError(f"{name}: columns of {[len(column) for column in columns]} numbers; pass as many of each")
    return np.stack(columns, axis=-1)


def _column(column: Any, name: str) -> NDArray[Any]:
    """A column of numbers; what is missing is NaN."""
    dtype = getattr(column, "dtype", None)
    held = column
    if not isinstance(dtype, np.dtype) and getattr(dtype, "kind", None) in ("f", "i", "u"):  # pandas, whose missing numbers are objects
        held = column.to_numpy(dtype=np.float64, na_value=np.nan)
    array = _numbers(held, name)
    if array.ndim != 1:
        raise InputError(f"{name} has the shape {array.shape}; one number for each point is expected")
    _real(array, name)
    return array


def _numbers(held: Any, name: str) -> NDArray[Any]:
    # Tensors with a gradient or on another device are arrays only after this.
    for step in ("detach", "cpu"):
        method = getattr(held, step, None)
        if callable(method) and not isinstance(held, np.ndarray):
            held = method()
    if hasattr(held, "numpy") and not hasattr(held, "__array__"):
        held = held.numpy()
    try:
        array = np.asarray(held)
    except Exception as error:  # whatever their `__array__` raises
        raise InputError(f"{name}: not an array of points ({error}); pass an array of shape (N, 3)") from error
    if array.ndim == 0 and array.dtype == object:
        raise InputTypeError(f"{name}: {_kind_of(held)}, where an array of shape (N, 3) is expected")
    names = array.dtype.names
    if names is not None:
        if not {"x", "y", "z"} <= set(names):
            raise InputError(f"{name}: a structured array with the fields {names}; it needs x, y and z")
        return np.stack([_unmasked(held[axis] if isinstance(held, np.ma.MaskedArray) else array[axis]) for axis in "xyz"], axis=-1)
    return _unmasked(held) if isinstance(held, np.ma.MaskedArray) else array


def _unmasked(array: NDArray[Any]) -> NDArray[Any]:
    """With NaN where numbers are masked."""
    if not isinstance(array, np.ma.MaskedArray):
        return array
    if array.dtype.kind not in "fiu" or not np.ma.is_masked(array):
        return np.asarray(array)
    single = array.dtype.kind == "f" and array.dtype.itemsize <= 4
    held = array.astype(np.float32 if single else np.float64)
    return np.asarray(np.ma.filled(held, np.nan))


def _kind_of(thing: Any) -> str:
    kind = type(thing)
    return f"an object of {kind.__module__}.{kind.__qualname__}"


def _real(array: NDArray[Any], name: str) -> None:
    """Refuses what are no real numbers."""
    kind = array.dtype.kind
    if kind not in "fiu":
        what = {"b": "truth values", "c": "complex numbers", "O": "objects", "U": "text", "S": "text", "T": "text"}.get(kind)
        way_out = "pass array.astype(float)" if kind in "OUST" else "pass float32 or float64"
        raise InputTypeError(
            f"{name}: shape {array.shape} of {what or array.dtype}, where real numbers are expected; {way_out}"
        )


def _checked(array: NDArray[Any], name: str) -> NDArray[Any]:
    shape = array.shape
    kind = array.dtype.kind
    _real(array, name)
    if array.ndim != 2:
        if array.ndim == 3 and shape[0] == 1:
            way_out = f"a batch of one: pass {name}[0]"
        elif array.ndim == 3 and shape[2] >= 3:
            way_out = "an organised scan or a batch: pass array.reshape(-1, 3), or one cloud at a time"
        elif array.ndim == 1 and array.size and array.size % 3 == 0:
            way_out = "a flat list: pass array.reshape(-1, 3)"
        else:
            way_out = "pass one row for each point"
        raise InputError(f"{name}: shape {shape}; expected (N, 3) or more columns; {way_out}")
    rows, columns = shape
    ones = rows == 4 and columns != 4 and columns > 0 and bool((array[3] == 1).all())
    if (rows == 3 and columns != 3) or ones or (rows > 3 and columns >= max(_WIDE, rows + 1)):
        if ones:
            way_out = f"pass {name}[:3].T"
        elif rows > 3:
            way_out = f"pass {name}.T; if these are {rows} points with {columns} columns, pass {name}[:, :3]"
        elif columns > 3:
            way_out = f"pass {name}.T; if these are three points with {columns} columns, pass {name}[:, :3]"
        else:
            way_out = f"it holds {columns} points; three or more are needed"
        raise InputError(f"{name}: shape {shape} looks transposed; expected (N, 3); {way_out}")
    if columns < 3:
        raise InputError(f"{name}: shape {shape}; expected (N, 3) or more columns; add the coordinates that are missing")
    single = array.dtype.kind == "f" and array.dtype.itemsize <= 4 or (kind in "iu" and array.dtype.itemsize <= 2)
    return np.require(array[:, :3], dtype=np.float32 if single else np.float64, requirements="A")


def pose_of(pose: Any, name: str) -> NDArray[np.float64]:
    """A pose: ``(4, 4)``, float64, target_from_source."""
    found = getattr(pose, "target_from_source", None)  # of a result
    array = _numbers(pose if found is None or isinstance(pose, np.ndarray) else found, name)
    if array.dtype.kind not in "fiu":
        raise InputTypeError(f"{name}: {array.dtype}, where real numbers are expected; pass a (4, 4) array of float64")
    if array.ndim != 2:
        raise InputError(f"{name}: shape {array.shape}; a pose has shape (4, 4), target_from_source")
    return np.require(array, dtype=np.float64, requirements="A")
