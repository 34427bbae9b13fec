"""Options, checked by name."""

from __future__ import annotations

import operator
from collections.abc import Sequence
from typing import Any

import numpy as np

from ._errors import OptionError

#: Most threads that can be asked for.
_MOST_THREADS = 4096


def whole(name: str, value: Any, least: int, most: int) -> int:
    """A whole number in these bounds. True and False are none."""
    try:
        number = None if isinstance(value, (bool, np.bool_)) else operator.index(value)
    except TypeError:
        number = None
    if number is None or not least <= number <= most:
        raise OptionError(f"{name} is {value!r}: expected a whole number from {least} to {_short(most)}")
    return number


def seed_of(value: Any) -> int:
    """The seed of random draws."""
    return whole("seed", value, 0, 2**64 - 1)


def threads_of(value: Any) -> int | None:
    """A number of threads; None for all cores."""
    return None if value is None else whole("num_threads", value, 1, _MOST_THREADS)


def from_1(name: str, value: Any) -> int:
    """A whole number from 1."""
    return whole(name, value, 1, 2**63 - 1)


def real(name: str, value: Any) -> float:
    """A number; the library knows its bounds."""
    if isinstance(value, (str, bytes, bool, np.bool_)):
        raise OptionError(f"{name} is {value!r}: expected a number")
    try:
        return float(value)
    except (TypeError, ValueError, OverflowError):
        raise OptionError(f"{name} is {value!r}: expected a number") from None


def truth(name: str, value: Any) -> bool:
    """True or False."""
    if not isinstance(value, (bool, np.bool_)):
        raise OptionError(f"{name} is {value!r}: expected True or False")
    return bool(value)


def text(name: str, value: Any) -> str:
    """A word; the library knows which there are."""
    if not isinstance(value, str):
        raise OptionError(f"{name} is {value!r}: expected text")
    return value


def several(name: str, value: Any, example: str) -> Sequence[Any]:
    """A list."""
    if isinstance(value, (str, bytes)) or not hasattr(value, "__iter__"):
        raise OptionError(f"{name} is {value!r}: expected a list, such as {example}")
    return list(value)


def _short(number: int) -> str:
    return "2**64 - 1" if number == 2**64 - 1 else str(number)
