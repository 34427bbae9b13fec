"""Clouds for the tests: made, never read."""

import numpy as np


def box(points: int = 700, seed: int = 3) -> np.ndarray:
    """Points on the faces of a box with a smaller one on it: no motion but the identity maps it onto itself."""
    rng = np.random.default_rng(seed)
    parts = []
    for share, low, high in ((0.7, (0, 0, 0), (3, 2, 1)), (0.3, (0.2, 0.3, 1), (1.1, 0.9, 1.8))):
        low, high = np.array(low, float), np.array(high, float)
        p = rng.uniform(low, high, (int(points * share), 3))
        axis = rng.integers(0, 3, len(p))
        side = rng.integers(0, 2, len(p))
        p[np.arange(len(p)), axis] = np.where(side, high[axis], low[axis])
        parts.append(p)
    return np.concatenate(parts)


def motion(angle_deg: float = 25.0, shift: tuple = (0.4, -0.2, 0.7)) -> np.ndarray:
    """A turn about (1, 2, 3) and a shift, shape (4, 4)."""
    axis = np.array([1.0, 2.0, 3.0]) / np.sqrt(14.0)
    k = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    angle = np.radians(angle_deg)
    pose = np.eye(4)
    pose[:3, :3] = np.eye(3) + np.sin(angle) * k + (1 - np.cos(angle)) * k @ k
    pose[:3, 3] = shift
    return pose


def moved(points: np.ndarray, pose: np.ndarray) -> np.ndarray:
    return points @ pose[:3, :3].T + pose[:3, 3]


def angle_deg(a: np.ndarray, b: np.ndarray) -> float:
    cosine = (np.trace(a[:3, :3].T @ b[:3, :3]) - 1) / 2
    return float(np.degrees(np.arccos(np.clip(cosine, -1, 1))))
