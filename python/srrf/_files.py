"""Files of clouds."""

from __future__ import annotations

import os
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import _srrf
from ._arrays import Cloud, points_of


def read(path: str | os.PathLike[str]) -> NDArray[np.float64]:
    """Reads all points of a file, in its order: shape (N, 3), float64, in the unit and the frame of the file.

    The format is that of the extension, or of the content where that says nothing; ``srrf.FORMATS`` names all of them.
    Points with NaN or infinity are among them: functions that take clouds leave them out and say so.

    Raises:
        MissingFileError: where there is no such file.
        FileError: for a file that is broken, empty, or of no known format.
    """
    return _srrf.read(path)


def write(path: str | os.PathLike[str], points: Cloud) -> None:
    """Writes points, shape (N, >= 3), in the format that the extension says; the file appears whole or not at all.

    What is read back is the same in every bit, but for formats that hold less (KITTI's ``.bin``, binary STL, LAS).

    Raises:
        InputError: for points with NaN or infinity, and other shapes.
        FileError: for an extension that says no format, and where nothing can be written.
    """
    array: NDArray[Any] = points_of(points, "points")
    cloud = _srrf.Cloud(array, "points")
    if cloud.dropped:
        from ._errors import InputError

        raise InputError(f"points: {cloud.dropped} of them hold NaN or infinity; remove them first")
    _srrf.write(path, cloud)
