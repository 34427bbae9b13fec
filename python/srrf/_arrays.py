"""From what users hold to arrays of points, without importing any of it."""

from __future__ import annotations

import os
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


#: A cloud: a file, an array of shape ``(N, >= 3)``, or an object that holds one.
Cloud: TypeAlias = Union[
    str, "os.PathLike[str]", NDArray[Any], "list[list[float]]", "HasPoints", "HasVertices", "HasPositions"
]


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
    if isinstance(cloud, (str, os.PathLike)):
        return _srrf.open(cloud, name)
    name = name or default
    points = points_of(cloud, name)
    return _srrf.Cloud(points, name, _faces_of(cloud, len(points), name))


def _faces_of(cloud: Any, points: int, name: str) -> NDArray[np.uint32] | None:
    """The triangles of a mesh, shape (M, 3), as indices of its points; None of a cloud."""
    for attribute in ("triangles", "faces"):  # Open3D; trimesh, PyVista
        held = getattr(cloud, attribute, None)
        if held is None or callable(held):
            continue
        faces = np.asarray(held)
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
    for attribute in ("points", "vertices"):  # Open3D, PyVista; trimesh
        held = getattr(cloud, attribute, None)
        if held is not None and not callable(held):
            cloud = held
            break
    else:
        point = getattr(cloud, "point", None)  # Open3D's clouds of tensors
        if point is not None and not callable(point):
            cloud = point["positions"]
    return _numbers(cloud, name)


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
    except (TypeError, ValueError, RuntimeError) as error:
        raise InputError(f"{name}: not an array of points ({error}); pass an array of shape (N, 3)") from error
    names = array.dtype.names
    if names is not None:
        if not {"x", "y", "z"} <= set(names):
            raise InputError(f"{name}: a structured array with the fields {names}; it needs x, y and z")
        array = np.stack([array[axis] for axis in "xyz"], axis=-1)
    return array


def _checked(array: NDArray[Any], name: str) -> NDArray[Any]:
    shape = array.shape
    kind = array.dtype.kind
    if kind not in "fiu":
        what = {"b": "truth values", "c": "complex numbers", "O": "objects", "U": "text", "S": "text"}.get(kind)
        raise InputTypeError(
            f"{name}: shape {shape} of {what or array.dtype}, where real numbers are expected; pass float32 or float64"
        )
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
    if (rows == 3 and columns != 3) or ones:
        if ones:
            way_out = f"pass {name}[:3].T"
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
    array = _numbers(pose, name)
    if array.dtype.kind not in "fiu":
        raise InputTypeError(f"{name}: {array.dtype}, where real numbers are expected; pass a (4, 4) array of float64")
    if array.ndim != 2:
        raise InputError(f"{name}: shape {array.shape}; a pose has shape (4, 4), target_from_source")
    return np.require(array, dtype=np.float64, requirements="A")
