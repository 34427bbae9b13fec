"""The compiled part of the package. Its interface may change: use ``srrf`` itself."""

import os
from collections.abc import Sequence
from typing import Any, TypedDict

from numpy.typing import NDArray
import numpy as np

__version__: str
CORRUPTIONS: list[str]
FORMATS: list[str]

class Reading(TypedDict):
    columns: str | None
    array: str | None
    layout: str | None
    scan: int | None
    topic: str | None
    message: int | None
    max_memory: int | None

class Cloud:
    name: str
    dropped: int
    is_mesh: bool
    def __init__(self, array: NDArray[Any], name: str, faces: NDArray[np.uint32] | None = None) -> None: ...
    def __len__(self) -> int: ...
    def points(self) -> NDArray[np.float64]: ...

class Registrar:
    def __init__(
        self,
        *,
        method: str,
        rotation: str,
        refine: bool,
        weights: str | None,
        device: str,
        seed: int,
        abstain_below: float,
        vertices: bool,
        scale: float | str | None,
        num_threads: int | None,
    ) -> None: ...
    def prepare(self, target: Cloud) -> Target: ...
    def register(
        self, source: Cloud, target: Cloud | Target, initial: NDArray[np.float64] | None = None
    ) -> tuple[str, Cloud, Cloud]: ...

class Target:
    cloud: Cloud

class Pairs:
    def __init__(
        self,
        *,
        shapes: int,
        corruptions: Sequence[str],
        severities: Sequence[int],
        clean: bool,
        data: str | None,
        split: str,
        seed: int,
        points: int,
        rotation_deg: float | None,
        translation: float,
        corrupt: str,
        sampling: str,
        normalize: str,
        reading: str,
        crop: float | None,
        dcp_poses: bool,
        spread: bool,
        num_threads: int | None,
    ) -> None: ...
    def __len__(self) -> int: ...
    def description(self) -> str: ...
    def pairs(self, indices: Sequence[int]) -> list[dict[str, Any]]: ...
    def arrays(self, indices: Sequence[int]) -> dict[str, Any]: ...

def align(
    registrar: Registrar,
    clouds: Sequence[Cloud],
    initial: Sequence[NDArray[np.float64] | None],
    sequence: bool,
    refine: bool,
) -> str: ...
def canonical_json(text: str) -> str: ...
def corrupt(
    cloud: Cloud, name: str, number: int, seed: int, reading: str, vertices: bool
) -> tuple[NDArray[np.float64], NDArray[np.int64]]: ...
def open(path: str | os.PathLike[str], name: str | None = None) -> Cloud: ...
def read(
    path: str | os.PathLike[str], reading: Reading, vertices: bool | None, surface: int | None, seed: int
) -> tuple[NDArray[np.float64], list[str]]: ...
def scans(
    path: str | os.PathLike[str], reading: Reading
) -> list[tuple[str, int, NDArray[np.float64] | None]]: ...
def unit_factor(unit: str, to: str) -> float: ...
def write(path: str | os.PathLike[str], cloud: Cloud, single: bool) -> bool: ...
def page(answer: str, source: Cloud, target: Cloud, unit: str, up: str | None) -> str: ...
def rigid_motion(pose: NDArray[np.float64], name: str) -> NDArray[np.float64]: ...
def program(arguments: Sequence[str]) -> int: ...
def score(
    poses: Sequence[NDArray[np.float64] | None],
    truth: Sequence[NDArray[np.float64]],
    clouds: Sequence[tuple[Cloud, Cloud]] | None = None,
) -> str: ...
