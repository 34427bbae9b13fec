"""Registers two point clouds of any size, unit and place, and says whether it worked.

>>> import srrf
>>> result = srrf.register("scan1.ply", "scan2.ply")  # or arrays of shape (N, 3)
>>> result.target_from_source, result.probability, result.abstain

The network is in the package: nothing is downloaded, and no PyTorch is needed.
"""

from . import _srrf
from ._align import Map, PlacedScan, align
from ._errors import (
    FileError,
    InputError,
    InputTypeError,
    InternalError,
    MissingFileError,
    NoPoseError,
    OptionError,
    ReadingWarning,
    SrrfError,
)
from ._files import Scan, read, scans, unit_factor, write
from ._register import Registrar, Target, register
from ._result import Pose, Result
from ._score import Scores, score
from ._synthesis import Corrupted, Pair, PairArrays, Pairs, corrupt, pairs

__version__: str = _srrf.__version__

#: Names of the corruptions, in the paper's order.
CORRUPTIONS: tuple[str, ...] = tuple(_srrf.CORRUPTIONS)
#: Names of the formats of files.
FORMATS: tuple[str, ...] = tuple(_srrf.FORMATS)

__all__ = [
    "CORRUPTIONS",
    "FORMATS",
    "Corrupted",
    "FileError",
    "InputError",
    "InputTypeError",
    "InternalError",
    "Map",
    "MissingFileError",
    "NoPoseError",
    "OptionError",
    "Pair",
    "PairArrays",
    "Pairs",
    "PlacedScan",
    "Pose",
    "ReadingWarning",
    "Registrar",
    "Result",
    "Scan",
    "Scores",
    "SrrfError",
    "Target",
    "__version__",
    "align",
    "corrupt",
    "pairs",
    "read",
    "register",
    "scans",
    "score",
    "unit_factor",
    "write",
]
