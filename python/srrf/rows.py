"""Pairs as rows in, answers as rows out: what engines such as Ray and Daft have in common. Needs ``pyarrow``.

The schema is that of the results of ``srrf batch``; see the page "Many pairs" of the book.
"""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from typing import Any

import numpy as np
import pyarrow as pa

from . import _srrf
from ._arrays import Cloud
from ._errors import InputError, SrrfError
from ._register import Options, Registrar, Target

_EVIDENCE = ("spacing", "inlier_threshold", "inliers", "fitness", "inlier_rmse", "overlap_target")

#: The version of an answer in JSON.
_VERSION = "srrf-register/1"

#: The columns of an answer.
SCHEMA = pa.schema(
    [
        pa.field("id", pa.string(), nullable=False),
        pa.field("source", pa.string()),
        pa.field("target", pa.string()),
        pa.field("initial", pa.string()),
        pa.field("target_from_source", pa.list_(pa.float64(), 16)),
        pa.field("probability", pa.float64()),
        pa.field("abstain", pa.bool_()),
        pa.field("evidence", pa.struct([(name, pa.float64()) for name in _EVIDENCE])),
        pa.field("start", pa.string()),
        pa.field("points_source", pa.int64()),
        pa.field("points_target", pa.int64()),
        pa.field("seconds", pa.float64()),
        pa.field("error", pa.string()),
        pa.field("answer", pa.string(), nullable=False),
    ]
)


class PairRegistrar:
    """Registers rows: the network is loaded once, and a pair that fails is a row with ``error``.

    A row has ``source`` and ``target``: paths, or points of shape (N, >= 3), which may come nested in lists. It may have ``id``
    and ``initial`` (a path of 4 rows of 4 numbers, or 16 numbers).

    Args:
        folder: what paths are relative to.
        options: as for :class:`srrf.Registrar`.
    """

    def __init__(self, folder: str | os.PathLike[str] | None = None, **options: Any) -> None:
        self._folder = None if folder is None else os.fspath(folder)
        self._registrar = Registrar(**options)
        self._last: tuple[str, Cloud | Target] | None = None
        self._described = described(self._registrar.options)

    def row(self, pair: Mapping[str, Any]) -> dict[str, Any]:
        """The answer for one pair, by the names of :data:`SCHEMA`."""
        names = {key: _text(pair.get(key)) for key in ("source", "target", "initial")}
        files = f"{names['source']} -> {names['target']}"
        known = files if names["initial"] is None else f"{files} ({names['initial']})"
        identity = _text(pair.get("id")) or known
        try:
            if not _text(pair.get("id")) and None in (names["source"], names["target"]):
                raise SrrfError("clouds without paths need a column `id`")
            target = self._target(pair["target"])
            result = self._registrar.register(
                self._cloud(pair["source"]), target, initial=self._pose(pair.get("initial"))
            )
            answer: dict[str, Any] = result.to_dict()
        except KeyError as error:
            answer = {"error": f"the column {error} is missing"}
        except (SrrfError, OSError, ValueError) as error:
            answer = {"error": str(error)}
        carried = {name: pair[name] for name in pair if name not in SCHEMA.names}
        return self._described_row(identity, names, carried, answer)

    def _described_row(
        self, identity: str, names: Mapping[str, str | None], carried: dict[str, Any], answer: dict[str, Any]
    ) -> dict[str, Any]:
        answer = {"schema": _VERSION} | answer | {"id": identity, **names, "columns": carried, "options": self._described}
        pose = answer.get("target_from_source")
        evidence = answer.get("evidence", {})
        points = answer.get("points", {})
        seconds = answer.get("seconds")
        return {
            "id": identity,
            **names,
            "target_from_source": [None] * 16 if pose is None else [number for row in pose for number in row],
            "probability": answer.get("probability"),
            "abstain": answer.get("abstain"),
            "evidence": {name: _number(evidence.get(name)) for name in _EVIDENCE},
            "start": answer.get("start"),
            "points_source": points.get("source"),
            "points_target": points.get("target"),
            "seconds": None if seconds is None else sum(seconds.values()),
            "error": answer.get("error"),
            "answer": _srrf.canonical_json(json.dumps(answer, default=str)),
        }

    def table(self, pairs: pa.Table) -> pa.Table:
        """Answers for all rows of a table, in their order. Other columns are carried behind them.

        Raises:
            InputError: for a column that would be overwritten.
        """
        check_names(pairs.column_names)
        rows = [self.row(pair) for pair in pairs.to_pylist()]
        table = pa.Table.from_pylist(rows, schema=SCHEMA)
        for name in pairs.column_names:
            if name not in SCHEMA.names:
                table = table.append_column(name, pairs.column(name))
        return table

    def _target(self, value: Any) -> Cloud | Target:
        """Prepared once for neighbours in the list that share it; a mesh as it is, since its source says how densely it is drawn."""
        cloud = self._cloud(value)
        if not isinstance(cloud, str):
            return self._registrar.prepare(cloud)
        if self._last is None or self._last[0] != cloud:
            self._last = None
            opened = _srrf.open(cloud, None)
            drawn = opened.is_mesh and not self._registrar.options["vertices"]
            self._last = (cloud, cloud if drawn else Target(self._registrar, self._registrar._inner.prepare(opened)))
        return self._last[1]

    def _cloud(self, value: Any) -> Cloud:
        if isinstance(value, str):
            return value if self._folder is None else os.path.join(self._folder, value)
        array = np.asarray(value)
        if array.dtype == object:  # rows of lists, as ragged columns come
            array = np.array([np.asarray(row, dtype=np.float64) for row in value])
        if array.ndim == 1 and array.size % 3 == 0:  # points one after the other
            array = array.reshape(-1, 3)
        return array

    def _pose(self, value: Any) -> Any:
        if value is None or (isinstance(value, str) and not value):
            return None
        if isinstance(value, str):
            path = value if self._folder is None else os.path.join(self._folder, value)
            return np.loadtxt(path)
        return np.asarray(value, dtype=np.float64).reshape(4, 4)


def described(options: Options) -> dict[str, Any]:
    """What answers depend on, as every row of ``srrf batch`` says it."""
    said: dict[str, Any] = {
        "method": options["method"],
        "rotation": "45" if options["rotation"] == "45" else "180",
        "refine": options["refine"],
        "weights": options["weights"],
        "seed": options["seed"],
    }
    if options["scale"] is not None:
        said["scale"] = options["scale"]
    if options["vertices"]:
        said["vertices"] = True
    return said


def check_names(columns: list[str]) -> None:
    """Refuses columns that the answers have of their own.

    Raises:
        InputError: names them.
    """
    taken = [name for name in columns if name in SCHEMA.names[4:]]
    if taken:
        raise InputError(f"the answers have columns {taken} of their own; call those of the pairs otherwise")


def _text(value: Any) -> str | None:
    """Text that is there; numbers of an ``id`` as text."""
    if isinstance(value, (int, np.integer)) and not isinstance(value, bool):
        return str(value)
    return value if isinstance(value, str) and value else None


def _number(value: Any) -> float | None:
    return None if value is None else float(value)
