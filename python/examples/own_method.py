"""Scores a method that is written in Python on the corruption benchmark."""

import numpy as np
from numpy.typing import NDArray

import srrf


def own_method(source: NDArray[np.float64], target: NDArray[np.float64]) -> NDArray[np.float64]:
    """Lays centroid on centroid: put your method here. Shapes (N, 3); answers target_from_source, shape (4, 4)."""
    pose = np.eye(4)
    pose[:3, 3] = target.mean(axis=0) - source.mean(axis=0)
    return pose


benchmark = srrf.pairs(shapes=5, corruptions=["cutout", "gaussian"], severities=[3])
poses = [own_method(pair.source, pair.target) for pair in benchmark]
truth = [pair.target_from_source for pair in benchmark]
scores = srrf.score(poses, truth, [(pair.source, pair.target) for pair in benchmark])
print(f"{scores.pairs} pairs: {scores.mean_rot_deg:.1f} degrees off, {100 * (scores.right or 0):.0f} % right")
