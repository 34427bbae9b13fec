"""Registers two point clouds of any size, unit and place, and says whether it worked.

>>> import srrf
>>> result = srrf.register("scan1.ply", "scan2.ply")  # or arrays of shape (N, 3)
>>> result.target_from_source, result.probability, result.abstain

The network is in the package: nothing is downloaded, and no PyTorch is needed.
"""

from . import _srrf
from ._errors import (
    FileError,
    InputError,
    InputTypeError,
    InternalError,
    MissingFileError,
    NoPoseError,
    OptionError,
    SrrfError,
)
from ._files import read, write
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
    "MissingFileError",
    "NoPoseError",
    "OptionError",
    "Pair",
    "PairArrays",
    "Pairs",
    "Pose",
    "Registrar",
    "Result",
    "Scores",
    "SrrfError",
    "Target",
    "__version__",
    "corrupt",
    "pairs",
    "read",
    "register",
    "score",
    "write",
]
