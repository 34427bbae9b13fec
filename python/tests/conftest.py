"""What the tests share."""

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parent))
from clouds import box, motion, moved  # noqa: E402


@pytest.fixture(scope="session")
def cloud() -> np.ndarray:
    return box()


@pytest.fixture(scope="session")
def truth() -> np.ndarray:
    return motion()


@pytest.fixture(scope="session")
def target(cloud, truth) -> np.ndarray:
    return moved(cloud, truth)
