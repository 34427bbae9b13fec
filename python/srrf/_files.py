"""Files of clouds."""

from __future__ import annotations

import os
import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from . import _srrf
from ._arrays import Cloud, faces_of, points_of
from ._errors import InputError, OptionError, ReadingWarning
from ._options import from_1, seed_of

#: Units of length.
Unit = Literal["um", "mm", "cm", "m", "km", "in", "ft", "us-ft"]


@dataclass(frozen=True, eq=False)
class Scan:
    """One of the scans of a file."""

    number: int
    """From 1, as ``srrf.read(path, scan=number)`` and ``path#number`` take it."""
    name: str
    """Empty where it has none."""
    points: int
    """How many there are, in the file."""
    file_from_scan: NDArray[np.float64] | None
    """Pose of the scanner, shape (4, 4), from its frame to that of the file, where the file has it."""


def read(
    path: str | os.PathLike[str],
    *,
    columns: str | Sequence[str | int] | None = None,
    array: str | None = None,
    layout: str | None = None,
    scan: int | None = None,
    topic: str | None = None,
    message: int | None = None,
    vertices: bool | None = None,
    surface_points: int | None = None,
    seed: int = 0,
    unit: Unit | None = None,
    to: Unit | None = None,
    max_memory: int | None = None,
) -> NDArray[np.float64]:
    """Reads all points of a file, in its order: shape (N, 3), float64, in the unit and the frame of the file.

    The format is that of the extension, or of the content where that says nothing; ``srrf.FORMATS`` names all of them.
    Points with NaN or infinity are among them: functions that take clouds leave them out and say so. What should be known of
    the reading is said by a :class:`ReadingWarning`.

    Args:
        path: the file; ``file.e57#2`` is its second scan.
        columns: the columns of a text, or the fields of an array, that are x, y and z: names, or numbers from 1, such as
            ``"east,north,up"`` or ``(2, 3, 4)``.
        array: the array of an archive that is the cloud.
        layout: what a point of a ``.bin`` is: ``"kitti"``, ``"nuscenes"``, or its numbers and their type, such as ``"3xf32"``.
        scan: the scan of a file that holds several, from 1; None for all of them in one frame.
        topic: the topic whose messages are the cloud.
        message: the message of a topic, from 1.
        vertices: of a mesh, True reads its vertices, False draws points from its surface; None reads the vertices and warns.
        surface_points: how many are drawn; None for about as many as lie as densely as the vertices.
        seed: seed of that draw.
        unit: the unit that the file is in, where it is to be converted.
        to: the unit of the answer then.
        max_memory: most bytes that reading may take; None for half of the machine's memory.

    Raises:
        MissingFileError: where there is no such file.
        FileError: for a file that is broken, empty, of no known format, or that can be read in several ways of which none is
            named; the message names the option.
        OptionError: for an option that makes no sense.
    """
    factor = _factor(unit, to)
    if surface_points is not None:
        from_1("surface_points", surface_points)
        if vertices is not False:
            raise OptionError("surface_points says how many points are drawn from a surface; pass vertices=False with it")
    seed = seed_of(seed)
    path = os.fsdecode(path)
    reading = _reading(columns, array, layout, scan, topic, message, max_memory)
    points, said = _srrf.read(path, reading, vertices, surface_points, seed)
    for sentence in said:
        warnings.warn(f"{path}: {sentence}", ReadingWarning, stacklevel=2)
    return points if factor == 1.0 else points * factor


def scans(
    path: str | os.PathLike[str],
    *,
    topic: str | None = None,
    layout: str | None = None,
    columns: str | Sequence[str | int] | None = None,
    array: str | None = None,
    max_memory: int | None = None,
) -> list[Scan]:
    """Lists the scans of a file; one where its format holds no more.

    Args:
        path: the file.
        topic: and all that follow as for :func:`read`.

    Raises:
        FileError: as :func:`read`.
    """
    found = _srrf.scans(os.fsdecode(path), _reading(columns, array, layout, None, topic, None, max_memory))
    return [Scan(number, name, points, pose) for number, (name, points, pose) in enumerate(found, 1)]


def write(
    path: str | os.PathLike[str],
    points: Cloud,
    *,
    single: bool | None = None,
    unit: Unit | None = None,
    to: Unit | None = None,
) -> None:
    """Writes points, shape (N, >= 3), in the format that the extension says; the file appears whole or not at all.

    Of a mesh its vertices are written, and a :class:`ReadingWarning` says so. What is read back is the same in every bit, but for formats that hold less (KITTI's ``.bin``, binary STL, LAS) and where
    single precision was asked for.

    Args:
        path: the file.
        points: the cloud.
        single: whether formats that have both write single precision; None does so for float32. Where that would move points by
            more than a millionth of the cloud's size they are written in double precision, and a :class:`ReadingWarning` says so.
        unit: the unit that the points are in, where they are to be converted.
        to: the unit of the file then.

    Raises:
        InputError: for points with NaN or infinity, and other shapes.
        FileError: for an extension that says no format, and where nothing can be written.
        OptionError: for units that do not exist.
    """
    factor = _factor(unit, to)
    path = os.fsdecode(path)
    array = points_of(points, "points")
    faces = faces_of(points, len(array), "points")
    if single is None:
        single = array.dtype == np.float32
    if factor != 1.0:
        array = array.astype(np.float64) * factor
    cloud = _srrf.Cloud(array, "points")
    if cloud.dropped:
        raise InputError(f"points: {cloud.dropped} of them hold NaN or infinity; remove them first")
    if faces is not None:
        sentence = f"points alone are written: the {len(array)} vertices of a mesh, without its {len(faces)} faces"
        warnings.warn(f"{path}: {sentence}", ReadingWarning, stacklevel=2)
    if _srrf.write(path, cloud, single):
        sentence = "single precision would move points, so it has double precision"
        warnings.warn(f"{path}: {sentence}", ReadingWarning, stacklevel=2)


def unit_factor(unit: Unit, to: Unit) -> float:
    """What lengths in one unit are multiplied by to be in another: ``unit_factor("mm", "m")`` is 0.001.

    Raises:
        OptionError: for a unit that does not exist.
    """
    return _srrf.unit_factor(unit, to)


def _factor(unit: Unit | None, to: Unit | None) -> float:
    if (unit is None) != (to is None):
        raise OptionError(f"unit is {unit!r} and to is {to!r}: name both units, or neither")
    return 1.0 if unit is None or to is None else unit_factor(unit, to)


def _reading(
    columns: str | Sequence[str | int] | None,
    array: str | None,
    layout: str | None,
    scan: int | None,
    topic: str | None,
    message: int | None,
    max_memory: int | None,
) -> _srrf.Reading:
    if columns is not None and not isinstance(columns, str):
        columns = ",".join(str(column) for column in columns)
    for name, number in (("scan", scan), ("message", message), ("max_memory", max_memory)):
        if number is not None:
            from_1(name, number)
    return {
        "columns": columns,
        "array": array,
        "layout": layout,
        "scan": scan,
        "topic": topic,
        "message": message,
        "max_memory": max_memory,
    }
