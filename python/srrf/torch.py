"""The corruption benchmark for PyTorch: a data set to train on. Needs ``torch``."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from torch import Tensor, from_numpy
from torch.utils.data import IterableDataset, default_collate, get_worker_info

from ._synthesis import Pairs, pairs

_TOGETHER = 64


def collate(items: list[dict[str, Any]]) -> dict[str, Any]:
    """A batch, for ``collate_fn`` of a ``DataLoader``: clouds of one size are stacked, as those of a data set are, and those that
    differ in size, as where items of several are joined, stay a list of tensors."""
    batch = {}
    for name in items[0]:
        values = [item[name] for item in items]
        ragged = isinstance(values[0], Tensor) and any(value.shape != values[0].shape for value in values)
        batch[name] = values if ragged else default_collate(values)
    return batch


class PairDataset(IterableDataset[dict[str, Any]]):
    """Pairs as dictionaries of tensors: ``source`` and ``target`` (N, 3), ``target_from_source`` (4, 4).

    The pairs are those of ``srrf.pairs`` with the same options; by default the shapes are those to learn from. Workers of a
    ``DataLoader`` share them without overlap. All clouds have ``points`` points. Epoch 0 has the seed itself, and epoch ``e`` the
    seed plus ``e``: call :meth:`set_epoch` before each.

    Args:
        shapes: number of shapes.
        dtype: of the clouds and poses; float32 rounds the benchmark's bytes.
        options: as for :func:`srrf.pairs`.
    """

    def __init__(self, shapes: int = 1000, *, dtype: str = "float32", split: str = "train", **options: Any) -> None:
        super().__init__()
        self._dtype = np.dtype(dtype)
        self._options: dict[str, Any] = {"shapes": shapes, "split": split, "seed": 1, **options}
        self._epoch = 0
        self._pairs: Pairs | None = None
        self._length = len(self._of_epoch())

    def set_epoch(self, epoch: int) -> None:
        """Chooses the draws: epoch ``e`` has the seed plus ``e``; the shapes stay the same where they are from ``data``."""
        self._epoch = int(epoch)
        self._pairs = None

    def __len__(self) -> int:
        return self._length

    def __iter__(self) -> Iterator[dict[str, Any]]:
        made = self._of_epoch()
        worker = get_worker_info()
        first, step = (0, 1) if worker is None else (worker.id, worker.num_workers)
        # Made in parallel where no workers are.
        together = _TOGETHER if worker is None else 1
        places = range(first, len(made), step)
        order = np.random.default_rng([self._options["seed"], self._epoch]).permutation(len(made))
        for begin in range(0, len(places), together):
            chosen = [int(order[place]) for place in places[begin : begin + together]]
            for index, pair in zip(chosen, made.take(chosen)):
                yield {
                    "source": self._tensor(pair.source),
                    "target": self._tensor(pair.target),
                    "target_from_source": self._tensor(pair.target_from_source),
                    "corruption": pair.corruption,
                    "severity": pair.severity,
                    "index": index,
                }

    def _of_epoch(self) -> Pairs:
        if self._pairs is None:
            options = {**self._options, "seed": self._options["seed"] + self._epoch}
            self._pairs = pairs(**options)
        return self._pairs

    def _tensor(self, array: Any) -> Tensor:
        return from_numpy(np.ascontiguousarray(array, dtype=self._dtype))

    def __getstate__(self) -> dict[str, Any]:
        return {**self.__dict__, "_pairs": None}
