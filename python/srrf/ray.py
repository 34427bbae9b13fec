"""Many pairs on many machines, by Ray Data. Needs ``ray[data]`` and ``pyarrow``.

    ds = ray.data.read_parquet("pairs.parquet")
    ds = ds.map_batches(srrf.ray.RegisterPairs, batch_size=16, batch_format="pyarrow",
                        compute=ray.data.ActorPoolStrategy(size=64), num_cpus=0.875)
    ds.write_parquet("out")

or, with the same effect, a command that goes on where it stopped::

    python -m srrf.ray pairs.parquet out/ --address ray://head:10001

Columns in and out are those of ``srrf batch``.
"""

from __future__ import annotations

import argparse
import os
import sys
from typing import Any

import numpy as np
import pyarrow as pa

from .rows import SCHEMA, PairRegistrar, check_names

__all__ = ["SCHEMA", "RegisterPairs", "main"]


#: CPUs of an actor. The rest is for tasks that write: where actors hold all CPUs, Ray Data waits for ever.
_ACTOR_CPUS = 0.875


class RegisterPairs:
    """An actor of ``Dataset.map_batches``: the network is loaded once an actor. Ask for a little less than one CPU an actor, so that
    reading and writing have some: where actors hold all CPUs, Ray Data waits for ever.

    Batches come as a ``pyarrow.Table`` or as a dictionary of NumPy arrays. Clouds in arrays are taken as they come: columns of
    ragged clouds are arrays of objects, or of three axes where all clouds of a block have one size.

    Args:
        folder: what paths are relative to; on every machine the same.
        options: as for :class:`srrf.Registrar`; ``num_threads`` is 1 unless it is given.
    """

    def __init__(self, folder: str | os.PathLike[str] | None = None, **options: Any) -> None:
        self._pairs = PairRegistrar(folder, **{"num_threads": 1, **options})

    def __call__(self, batch: Any) -> pa.Table:
        if isinstance(batch, pa.Table):
            return self._pairs.table(batch)
        columns = {name: list(values) for name, values in dict(batch).items()}
        size = len(next(iter(columns.values()), []))
        check_names(list(columns))
        rows = [{name: _plain(values[i]) for name, values in columns.items()} for i in range(size)]
        table = pa.Table.from_pylist([self._pairs.row(row) for row in rows], schema=SCHEMA)
        for name, values in columns.items():
            if name not in SCHEMA.names:
                table = table.append_column(name, pa.array([_plain(value) for value in values]))
        return table


def _plain(value: Any) -> Any:
    return value.item() if isinstance(value, np.generic) else value


def main(arguments: list[str] | None = None) -> int:
    """The command ``python -m srrf.ray``."""
    parser = argparse.ArgumentParser(prog="python -m srrf.ray", description="Registers the pairs of a list by Ray.")
    parser.add_argument("pairs", help="the list: Parquet or CSV, with the columns of `srrf batch`")
    parser.add_argument("out", help="a folder for the results, Parquet; pairs that are in it are not done again")
    parser.add_argument("--address", help="of a cluster; without it one is started on this machine")
    parser.add_argument("--concurrency", type=int, help="actors; all CPUs of the cluster without it")
    parser.add_argument("--batch-size", type=int, default=16, help="pairs an actor takes at a time")
    parser.add_argument("--method", default="auto")
    parser.add_argument("--rotation", default="so3")
    parser.add_argument("--seed", type=int, default=0)
    args = parser.parse_args(arguments)

    import pyarrow.csv
    import pyarrow.parquet
    import ray

    read = pyarrow.csv.read_csv if args.pairs.endswith(".csv") else pyarrow.parquet.read_table
    pairs = read(args.pairs)
    missing = [name for name in ("source", "target") if name not in pairs.column_names]
    if missing:
        print(f"error: {args.pairs} has no column {missing}; it has {pairs.column_names}", file=sys.stderr)
        return 2
    done = _done(args.out)
    rows = pairs.to_pylist()
    todo = pairs.take([i for i, row in enumerate(rows) if _known(row) not in done])
    print(f"{len(rows)} pairs, {len(rows) - todo.num_rows} done already", file=sys.stderr)
    if todo.num_rows == 0:
        return 0
    ray.init(address=args.address, ignore_reinit_error=True, log_to_driver=False)
    count = args.concurrency or max(1, int(ray.cluster_resources().get("CPU", 1)))
    size = max(1, args.batch_size)
    blocks = [todo.slice(begin, size) for begin in range(0, todo.num_rows, size)]
    folder = os.path.dirname(os.path.abspath(args.pairs))
    options = {"method": args.method, "rotation": args.rotation, "seed": args.seed}
    answers = ray.data.from_arrow(blocks).map_batches(
        RegisterPairs,
        fn_constructor_args=(folder,),
        fn_constructor_kwargs=options,
        batch_size=size,
        batch_format="pyarrow",
        compute=ray.data.ActorPoolStrategy(size=count),
        num_cpus=_ACTOR_CPUS,
    )
    answers.write_parquet(args.out, ray_remote_args={"num_cpus": 1 - _ACTOR_CPUS})
    return 0


def _known(row: dict[str, Any]) -> str:
    """What a pair is known by, as in ``srrf batch``."""
    if row.get("id") not in (None, ""):
        return str(row["id"])
    files = f"{row['source']} -> {row['target']}"
    return files if not row.get("initial") else f"{files} ({row['initial']})"


def _done(folder: str) -> set[str]:
    import pyarrow.dataset

    if not os.path.isdir(folder) or not any(name.endswith(".parquet") for name in os.listdir(folder)):
        return set()
    return set(pyarrow.dataset.dataset(folder, format="parquet").to_table(columns=["id"])["id"].to_pylist())


if __name__ == "__main__":
    sys.exit(main())
