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
import json
import os
import sys
from collections import Counter
from typing import Any

import numpy as np
import pyarrow as pa

from ._errors import InputError, OptionError, SrrfError
from ._register import Registrar
from .rows import SCHEMA, PairRegistrar, check_names, described

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
    parser.add_argument("pairs", help="the list: Parquet, CSV or JSON lines, with the columns of `srrf batch`")
    parser.add_argument("out", help="a folder for the results, Parquet; pairs that are in it are not done again")
    parser.add_argument("--address", help="of a cluster; without it one is started on this machine")
    parser.add_argument("--concurrency", type=int, help="actors; all CPUs of the cluster without it")
    parser.add_argument("--batch-size", type=int, default=16, help="pairs an actor takes at a time")
    parser.add_argument("--method", default="auto")
    parser.add_argument("--rotation", default="so3")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--retry-failed", action="store_true", help="do pairs again that have no pose")
    args = parser.parse_args(arguments)
    options: dict[str, Any] = {"method": args.method, "rotation": args.rotation, "seed": args.seed}
    out = args.out if "://" in args.out else os.path.abspath(args.out)
    try:
        pairs = _list(args.pairs)
        names = [_known(row) for row in pairs.to_pylist()]
        twice = [name for name, count in Counter(names).items() if count > 1]
        if twice:
            raise InputError(f"{args.pairs}: the pair `{twice[0]}` stands in it twice; tell the two apart by an `id`")
        if args.batch_size < 1 or (args.concurrency is not None and args.concurrency < 1):
            raise OptionError("--batch-size and --concurrency are whole numbers from 1")
        done = _done(out, described(Registrar(**options, num_threads=1).options), args.retry_failed)
    except (SrrfError, OSError, pa.ArrowException) as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    places = [place for place, name in enumerate(names) if name not in done]
    print(f"{len(names)} pairs, {len(names) - len(places)} done already", file=sys.stderr)
    if not places:
        return 0
    import ray

    todo = pairs.take(pa.array(places, pa.int64()))
    ray.init(address=args.address, ignore_reinit_error=True, log_to_driver=False)
    count = args.concurrency or max(1, int(ray.cluster_resources().get("CPU", 1)))
    size = args.batch_size
    blocks = [todo.slice(begin, size) for begin in range(0, todo.num_rows, size)]
    answers = ray.data.from_arrow(blocks).map_batches(
        RegisterPairs,
        fn_constructor_args=(os.path.dirname(os.path.abspath(args.pairs)),),
        fn_constructor_kwargs=options,
        batch_size=size,
        batch_format="pyarrow",
        compute=ray.data.ActorPoolStrategy(size=count),
        num_cpus=_ACTOR_CPUS,
    )
    answers.write_parquet(out, ray_remote_args={"num_cpus": 1 - _ACTOR_CPUS})
    return 0


def _list(path: str) -> pa.Table:
    """The list of pairs. In text everything is text, as for ``srrf batch``: an id `007` stays what it is."""
    ending = os.path.splitext(path)[1].lower()
    if ending == ".csv":
        import pyarrow.csv as csv

        with csv.open_csv(path) as reader:
            names = reader.schema.names
        texts = csv.ConvertOptions(column_types={name: pa.string() for name in names})
        pairs = csv.read_csv(path, convert_options=texts)
    elif ending in (".jsonl", ".ndjson"):
        import pyarrow.json

        pairs = pyarrow.json.read_json(path)
    else:
        import pyarrow.parquet

        pairs = pyarrow.parquet.read_table(path)
    missing = [name for name in ("source", "target") if name not in pairs.column_names]
    if missing:
        raise InputError(f"{path} has no column {missing}; it has {pairs.column_names}")
    check_names(pairs.column_names)
    return pairs


def _known(row: dict[str, Any]) -> str:
    """What a pair is known by, as in ``srrf batch``."""
    if row.get("id") not in (None, ""):
        return str(row["id"])
    if not isinstance(row["source"], str) or not isinstance(row["target"], str):
        raise InputError("clouds without paths need a column `id`")
    files = f"{row['source']} -> {row['target']}"
    return files if not row.get("initial") else f"{files} ({row['initial']})"


def _done(folder: str, options: dict[str, Any], retry: bool) -> set[str]:
    """The pairs that have an answer by these options; with `retry` answers without a pose are taken out of the folder."""
    import pyarrow.dataset
    import pyarrow.parquet

    if "://" not in folder and not os.path.exists(folder):
        return set()
    found = pyarrow.dataset.dataset(folder, format="parquet", exclude_invalid_files=True)
    done: set[str] = set()
    for fragment in found.get_fragments():
        table = fragment.to_table()
        for text in table["answer"].to_pylist()[:1]:
            other = json.loads(text).get("options")
            if other != options:
                raise InputError(f"{folder} holds answers by other options, {other}; name another folder")
        if retry and table["error"].null_count < table.num_rows:
            table = table.filter(table["error"].is_null())
            pyarrow.parquet.write_table(table, f"{fragment.path}.new")
            os.replace(f"{fragment.path}.new", fragment.path)
        done.update(table["id"].to_pylist())
    return done


if __name__ == "__main__":
    sys.exit(main())
