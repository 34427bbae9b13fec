"""Registers the pairs of a Parquet file by Daft: `python daft_pairs.py pairs.parquet out`. Needs daft and pyarrow."""

import sys
from typing import Any

import daft

from srrf.rows import SCHEMA, PairRegistrar

ANSWER = daft.DataType.struct({field.name: daft.DataType.from_arrow_type(field.type) for field in SCHEMA})


@daft.cls(max_concurrency=2)
class Register:
    """The network is loaded once a process."""

    def __init__(self, folder: str) -> None:
        self.pairs = PairRegistrar(folder, num_threads=1)

    @daft.method(return_dtype=ANSWER)
    def __call__(self, source: str, target: str) -> dict[str, Any]:
        return self.pairs.row({"source": source, "target": target})


def main(pairs: str, out: str, folder: str = ".") -> None:
    """Answers go to a folder of Parquet files, with the columns of `srrf batch`."""
    frame = daft.read_parquet(pairs)
    register = Register(folder)
    answers = frame.select(register(frame["source"], frame["target"]).alias("a"))
    answers.select(*[answers["a"].get(name).alias(name) for name in SCHEMA.names]).write_parquet(out)


if __name__ == "__main__":
    main(*sys.argv[1:])
