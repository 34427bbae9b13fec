"""Corrupted clouds, and pairs of them: the corruption benchmark."""

from __future__ import annotations

import operator
import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Literal, overload

import numpy as np
from numpy.typing import NDArray

from . import _srrf
from ._arrays import Cloud, cloud_of
from ._errors import InputTypeError, OptionError
from ._options import real, seed_of, several, text, threads_of, truth, whole

Reading = Literal["paper", "modelnet40_c"]

#: More would not fit into the memory of most machines.
_MOST_SHAPES = 1_000_000
_MOST_POINTS = 1_000_000


@dataclass(frozen=True, eq=False)
class Corrupted:
    """A corrupted cloud."""

    points: NDArray[np.float64]
    """Shape (M, 3), in the unit and the frame of the input."""
    origin: NDArray[np.int64]
    """Shape (M,): the row of the input that each point was, possibly moved; -1 for points that were added."""


@overload
def corrupt(
    points: Cloud,
    kind: str,
    severity: int = 3,
    seed: int = 0,
    *,
    reading: Reading = "paper",
    vertices: bool = False,
    return_origin: Literal[False] = False,
) -> NDArray[np.float64]: ...


@overload
def corrupt(
    points: Cloud,
    kind: str,
    severity: int = 3,
    seed: int = 0,
    *,
    reading: Reading = "paper",
    vertices: bool = False,
    return_origin: Literal[True],
) -> Corrupted: ...


def corrupt(
    points: Cloud,
    kind: str,
    severity: int = 3,
    seed: int = 0,
    *,
    reading: Reading = "paper",
    vertices: bool = False,
    return_origin: bool = False,
) -> NDArray[np.float64] | Corrupted:
    """Corrupts a cloud in one of twelve ways: the bytes that ``srrf corrupt`` writes.

    The cloud is brought to the unit sphere, corrupted there, and mapped back. Points with NaN or infinity are left out before.
    A mesh is corrupted as points drawn from its surface, by the seed.

    Args:
        points: a file, or points of shape (N, >= 3).
        kind: one of ``srrf.CORRUPTIONS``, such as ``"cutout"``.
        severity: how strong, 1 to 5.
        seed: seed of the draws. The same seed gives the same bytes.
        reading: the paper's text, or the code of ModelNet40-C, where they differ.
        vertices: whether the vertices of a mesh are its cloud.
        return_origin: whether to say where each point comes from.

    Returns:
        Points, shape (M, 3), float64, in the unit and the frame of the input; M may differ from N. With ``return_origin`` a
        :class:`Corrupted`, whose ``origin`` counts the points that are finite.

    Raises:
        OptionError: for a kind or severity that does not exist.
        InputError: for a cloud that is too small, a mesh without a surface, and other shapes.
    """
    moved, origin = _srrf.corrupt(
        cloud_of(points, None, "points"),
        text("kind", kind),
        _severity(severity),
        seed_of(seed),
        text("reading", reading),
        truth("vertices", vertices),
    )
    return Corrupted(moved, origin) if return_origin else moved


@dataclass(frozen=True, eq=False)
class Pair:
    """Two clouds of one shape, and the pose between them."""

    source: NDArray[np.float64]
    """Shape (N, 3), in the shape's canonical frame: mean 0, radius 1."""
    target: NDArray[np.float64]
    """Shape (N, 3), posed by ``target_from_source``."""
    target_from_source: NDArray[np.float64]
    """The true pose, shape (4, 4)."""
    source_origin: NDArray[np.int64] | None
    """Shape (N,): the base point that each source point is, -1 for added ones; None for independent sampling."""
    target_origin: NDArray[np.int64] | None
    """The same for the target. Points with equal entries correspond."""
    corruption: str
    """Name of the corruption, or ``"clean"``."""
    severity: int
    """1 to 5; 0 for clean pairs."""
    shape: str
    """Name of the shape."""
    class_name: str
    """Name of its category, empty where it has none."""
    symmetric: bool
    """Whether its category is symmetric about an axis, so that no pose is unique."""


@dataclass(frozen=True, eq=False)
class PairArrays:
    """Pairs, stacked."""

    source: NDArray[np.float64]
    """Shape (B, N, 3)."""
    target: NDArray[np.float64]
    """Shape (B, N, 3)."""
    target_from_source: NDArray[np.float64]
    """Shape (B, 4, 4)."""
    source_origin: NDArray[np.int64] | None
    """Shape (B, N)."""
    target_origin: NDArray[np.int64] | None
    """Shape (B, N)."""
    corruption: list[str]
    severity: NDArray[np.int64]
    """Shape (B,)."""
    shape: list[str]
    class_name: list[str]
    symmetric: NDArray[np.bool_]
    """Shape (B,)."""

    def __len__(self) -> int:
        return len(self.corruption)


#: Pairs that are made at once where one after the other is asked for.
_TOGETHER = 64


class Pairs(Sequence[Pair]):
    """Pairs of the corruption benchmark, made when they are asked for: see :func:`pairs`."""

    def __init__(self, **options: Any) -> None:
        self._options = options
        self._inner = _srrf.Pairs(**options)

    @property
    def description(self) -> str:
        """One line: which shapes, which protocol."""
        return self._inner.description()

    def __len__(self) -> int:
        return len(self._inner)

    @overload
    def __getitem__(self, index: int) -> Pair: ...

    @overload
    def __getitem__(self, index: slice) -> list[Pair]: ...

    def __getitem__(self, index: int | slice) -> Pair | list[Pair]:
        if isinstance(index, slice):
            return self.take(range(*index.indices(len(self))))
        try:
            place = operator.index(index)
        except TypeError:
            raise TypeError(f"{index!r} is no number of a pair; pass a whole number or a slice") from None
        return self.take([place])[0]

    def __iter__(self) -> Iterator[Pair]:
        for begin in range(0, len(self), _TOGETHER):
            yield from self[begin : begin + _TOGETHER]

    def take(self, indices: Sequence[int]) -> list[Pair]:
        """The pairs of these indices, made in parallel. A mask of truth values chooses as in NumPy."""
        return [Pair(**made) for made in self._inner.pairs(self._places(indices))]

    def arrays(self, indices: Sequence[int] | slice | None = None) -> PairArrays:
        """Stacks the pairs of these indices (all of them without), made in parallel.

        Raises:
            InputError: where clouds differ in size, as crops do; :meth:`take` them then. Also for more pairs than half of the
                machine's memory holds.
        """
        return PairArrays(**self._inner.arrays(self._places(slice(None) if indices is None else indices)))

    def _places(self, indices: Sequence[int] | slice) -> Sequence[int]:
        size = len(self)
        if isinstance(indices, slice):
            return range(*indices.indices(size))
        if isinstance(indices, range):
            chosen = np.arange(indices.start, indices.stop, indices.step)
        else:
            chosen = np.asarray(indices)
        if chosen.dtype == bool:
            if chosen.shape != (size,):
                raise IndexError(f"a mask of shape {chosen.shape} for {size} pairs")
            chosen = np.flatnonzero(chosen)
        if chosen.ndim != 1 or (chosen.size and chosen.dtype.kind not in "iu"):
            raise InputTypeError(f"indices of shape {chosen.shape} and type {chosen.dtype}; pass a list of whole numbers, or a slice")
        bad = chosen[(chosen < -size) | (chosen >= size)] if chosen.size else chosen
        if bad.size:
            raise IndexError(f"pair {bad[0]} of {size}")
        places: list[int] = [int(index) % size for index in chosen]
        return places

    def __repr__(self) -> str:
        return f"<srrf.Pairs {len(self)}: {self.description}>"

    def __reduce__(self) -> tuple[Any, tuple[dict[str, Any]]]:
        return _pairs, (self._options,)


def pairs(
    shapes: int = 4,
    *,
    corruptions: Sequence[str] | None = None,
    severities: Sequence[int] = (1, 2, 3, 4, 5),
    clean: bool = True,
    data: str | os.PathLike[str] | None = None,
    split: Literal["test", "train"] = "test",
    seed: int = 1,
    points: int = 1024,
    rotation: float | Literal["so3"] = 45.0,
    translation: float = 0.5,
    corrupt: Literal["both", "source", "target"] = "both",
    sampling: Literal["shared", "independent"] = "shared",
    normalize: Literal["none", "canonical", "after_pose"] = "none",
    reading: Reading = "paper",
    crop: float | None = None,
    dcp_poses: bool = False,
    spread: bool = False,
    num_threads: int | None = None,
) -> Pairs:
    """The pairs of the corruption benchmark: those that ``srrf-eval`` scores with the same options, byte for byte.

    Args:
        shapes: number of shapes.
        corruptions: names of ``srrf.CORRUPTIONS``; None for all twelve.
        severities: from 1 to 5.
        clean: whether clean pairs come first.
        data: ModelNet40, or a folder of shapes; without it ``$SRRF_DATA``, and without that built-in shapes.
        split: shapes to measure on, or shapes to learn from (built-in ones are of ``seed`` then).
        seed: seed of all draws.
        points: points of each cloud.
        rotation: each Euler angle is below so many degrees; or any rotation.
        translation: largest translation on each axis, in the canonical unit (shapes have radius 1).
        corrupt: which cloud is corrupted.
        sampling: whether source and target are the same points of the shape, or points of their own.
        normalize: whether corrupted clouds are scaled to a box as in ModelNet40-C.
        reading: the paper's text, or the code of ModelNet40-C, where they differ.
        crop: share of each cloud that is kept, in (0, 1].
        dcp_poses: whether shape i has the pose of item i of DCP's test set.
        spread: whether each shape is shown at one severity only, the severities in turn.
        num_threads: worker threads of :meth:`Pairs.arrays`; None for all cores.

    Raises:
        OptionError: for options that make no sense.
        FileError: for data that cannot be read.
    """
    if isinstance(rotation, str) and rotation != "so3":
        raise OptionError(f'rotation is {rotation!r}: expected degrees, or "so3"')
    kinds = _srrf.CORRUPTIONS if corruptions is None else several("corruptions", corruptions, '["cutout", "gaussian"]')
    return Pairs(
        shapes=whole("shapes", shapes, 1, _MOST_SHAPES),
        corruptions=[text("corruptions", kind) for kind in kinds],
        severities=[_severity(severity) for severity in several("severities", severities, "[1, 3, 5]")],
        clean=truth("clean", clean),
        data=None if data is None else os.fsdecode(data),
        split=text("split", split),
        seed=seed_of(seed),
        points=whole("points", points, 1, _MOST_POINTS),
        rotation_deg=None if isinstance(rotation, str) else real("rotation", rotation),
        translation=real("translation", translation),
        corrupt=text("corrupt", corrupt),
        sampling=text("sampling", sampling),
        normalize=text("normalize", normalize),
        reading=text("reading", reading),
        crop=None if crop is None else real("crop", crop),
        dcp_poses=truth("dcp_poses", dcp_poses),
        spread=truth("spread", spread),
        num_threads=threads_of(num_threads),
    )


def _severity(number: Any) -> int:
    return whole("severity", number, -(2**63), 2**63 - 1)  # the library says which there are


def _pairs(options: dict[str, Any]) -> Pairs:
    return Pairs(**options)
