"""Many scans into one frame."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import _srrf
from ._arrays import Cloud, cloud_of, pose_of
from ._errors import InputError, InputTypeError
from ._options import truth
from ._register import Method, Rotation, checked_options, _registrar


@dataclass(frozen=True, eq=False)
class PlacedScan:
    """Where one scan lies."""

    name: str
    """Its path, or its place in the list."""
    map_from_scan: NDArray[np.float64]
    """The pose in the map of its component, shape (4, 4)."""
    component: int
    """Number of its component. Nothing is known between two components."""
    probability: float
    """Probability that its pose in the component is right."""
    abstain: bool
    """Whether nothing holds it, or too little."""
    spread: float | None
    """Standard deviation of its points, root mean square over the scan; unit of the input."""


class Map:
    """Scans in one frame, or in one frame a component. It pickles with all figures."""

    __slots__ = ("_text", "_figures")

    def __init__(self, text: str) -> None:
        """From the JSON that :meth:`to_json` writes."""
        self._text = text
        self._figures: dict[str, Any] = json.loads(text)

    @property
    def scans(self) -> list[PlacedScan]:
        """One a scan, in the order of the input."""
        keys = ("name", "component", "probability", "abstain", "spread")
        return [
            PlacedScan(map_from_scan=np.array(s["map_from_scan"], dtype=np.float64), **{k: s[k] for k in keys})
            for s in self._figures["scans"]
        ]

    @property
    def map_from_scan(self) -> NDArray[np.float64]:
        """All poses, shape (N, 4, 4). Poses of two components have nothing to do with each other."""
        return np.array([s["map_from_scan"] for s in self._figures["scans"]], dtype=np.float64)

    @property
    def components(self) -> list[list[int]]:
        """Numbers of the scans (from 0) that hold together, the largest component first."""
        return [list(component) for component in self._figures["components"]]

    @property
    def edges(self) -> list[dict[str, Any]]:
        """The pairs that were tried, and what became of each: ``"verdict"`` is holds, contradicts, unconfirmed or nothing."""
        return list(self.to_dict()["edges"])

    @property
    def rivals(self) -> list[list[int]]:
        """Loops of pairs that contradict the map and agree with each other: places look alike. Empty where there are none."""
        return [list(loop) for loop in self._figures["rivals"]]

    def to_dict(self) -> dict[str, Any]:
        """All figures."""
        figures: dict[str, Any] = json.loads(self._text)
        return figures

    def to_json(self) -> str:
        """All figures in one line of JSON, every number in full."""
        return self._text

    def __len__(self) -> int:
        return len(self._figures["scans"])

    def __repr__(self) -> str:
        sizes = ", ".join(str(len(component)) for component in self.components)
        return f"<srrf.Map {len(self)} scans in components of {sizes}>"

    def __reduce__(self) -> tuple[type[Map], tuple[str]]:
        return Map, (self._text,)


def align(
    clouds: Sequence[Cloud],
    *,
    initial: Sequence[NDArray[Any] | None] | None = None,
    sequence: bool = False,
    joint: bool = True,
    method: Method = "auto",
    rotation: Rotation = "so3",
    refine: bool = True,
    weights: str | os.PathLike[str] | None = None,
    device: str = "flex",
    seed: int = 0,
    abstain_below: float = 0.5,
    vertices: bool = False,
    num_threads: int | None = None,
) -> Map:
    """Lays many scans in one frame, and says which may be trusted. Scans that nothing joins are components of their own.

    Args:
        clouds: two or more files or arrays of shape (N, >= 3), all in one unit.
        initial: first guesses of ``map_from_scan``, shape (4, 4), one a scan; None where nothing is known.
        sequence: whether the scans were taken one after the other, each overlapping the next.
        joint: whether to end with the joint refinement on points.
        method: and all that follow as for :class:`srrf.Registrar`.

    Returns:
        The :class:`Map`. The lowest scan of a component is where its first guess says, or at the identity.

    Raises:
        InputError: for fewer than two scans, a scan that determines no rotation, and meshes without ``vertices=True``.
        OptionError: for options that make no sense.
    """
    if isinstance(clouds, (str, bytes, os.PathLike, np.ndarray, Mapping)) or not hasattr(clouds, "__iter__"):
        raise InputTypeError("clouds: expected a list of clouds; pass [first, second, ...]")
    given = list(clouds)
    guesses: list[Any] = [] if initial is None else list(initial)
    if guesses and len(guesses) != len(given):
        raise InputError(f"{len(guesses)} first guesses, but {len(given)} clouds; pass one for each, or None for some")
    scans = [cloud_of(cloud, None, f"clouds[{index}]") for index, cloud in enumerate(given)]
    poses = [None if guess is None else pose_of(guess, f"initial[{i}]") for i, guess in enumerate(guesses)]
    options = checked_options(
        method=method,
        rotation=rotation,
        refine=refine,
        weights=weights,
        device=device,
        seed=seed,
        abstain_below=abstain_below,
        vertices=vertices,
        scale=1.0,  # scans of one building differ in size
        num_threads=num_threads,
    )
    return Map(_srrf.align(_registrar(options)._inner, scans, poses, truth("sequence", sequence), truth("joint", joint)))
