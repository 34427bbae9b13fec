"""Scores of poses."""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import _srrf
from ._arrays import Cloud, cloud_of, pose_of
from ._errors import InputError
from ._result import Result


@dataclass(frozen=True)
class Scores:
    """Errors over many pairs, as ``srrf-eval`` counts them. Rotations in degrees, translations in the unit of the clouds."""

    mse_r: float
    """Mean squared error of the Euler angles (DCP), degrees squared."""
    rmse_r: float
    mae_r: float
    mse_t: float
    """Mean squared error of the translation, per component."""
    rmse_t: float
    mae_t: float
    mean_rot_deg: float
    """Mean angle between found and true rotation."""
    median_rot_deg: float
    mean_trans: float
    """Mean distance between found and true translation."""
    median_trans: float
    recall: float
    """Share of pairs within 5 degrees and 0.1."""
    right: float | None
    """Share of right poses: within 5 degrees and a tenth of the target's radius. Known where the clouds are given."""
    pairs: int
    failed: int
    """Pairs without a usable pose; they count as the identity."""
    rotation_deg: NDArray[np.float64]
    """The angle of each pair, shape (pairs,)."""
    translation: NDArray[np.float64]
    """The distance of each pair, shape (pairs,)."""


def score(
    poses: Iterable[Any],
    truth: Iterable[Any],
    clouds: Sequence[tuple[Cloud, Cloud]] | None = None,
) -> Scores:
    """Scores poses against the true ones, by the scorer that made the tables of this project.

    Args:
        poses: found poses, target_from_source: an array of shape (B, 4, 4), or a list of (4, 4) arrays, of
            :class:`srrf.Result` and of None where a method found nothing.
        truth: the true poses, in the same order; shape (B, 4, 4).
        clouds: source and target of each pair, to count right poses too.

    Raises:
        InputError: for lists of different lengths, and matrices that are no rigid motion.
    """
    for name, given in (("poses", poses), ("truth", truth)):
        if isinstance(given, Result) or (isinstance(given, np.ndarray) and given.ndim == 2):
            raise InputError(f"{name}: one pose, where one for each pair is expected; pass [{name}]")
    found = [_matrix(pose, f"poses[{i}]") for i, pose in enumerate(poses)]
    true = [pose_of(pose, f"truth[{i}]") for i, pose in enumerate(truth)]
    held = None
    if clouds is not None:
        held = [_both(pair, f"clouds[{i}]") for i, pair in enumerate(clouds)]
    for name, length in (("truth", len(true)), ("clouds", len(found) if held is None else len(held))):
        if length != len(found):
            raise InputError(f"{len(found)} poses, but {length} in {name}; pass one of each for every pair")
    answer = json.loads(_srrf.score(found, true, held))
    figures = answer["scores"]
    known = {field.name: figures.get(field.name) for field in fields(Scores)}
    known["rotation_deg"] = np.array([error["rotation_deg"] for error in answer["errors"]])
    known["translation"] = np.array([error["translation_norm"] for error in answer["errors"]])
    return Scores(**known)


def _both(pair: Any, name: str) -> tuple[_srrf.Cloud, _srrf.Cloud]:
    if isinstance(pair, (str, bytes)) or not hasattr(pair, "__len__") or len(pair) != 2:
        raise InputError(f"{name}: expected the source and the target of a pair; pass [(source, target), ...]")
    return cloud_of(pair[0], None, f"{name}[0]"), cloud_of(pair[1], None, f"{name}[1]")


def _matrix(pose: Any, name: str) -> NDArray[np.float64] | None:
    if pose is None:
        return None
    return pose_of(pose.target_from_source if isinstance(pose, Result) else pose, name)
