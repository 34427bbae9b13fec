"""Registers the pairs of a Parquet file by Spark: `python spark_pairs.py pairs.parquet out folder`. Needs pyspark and pyarrow."""

import sys
from collections.abc import Iterator

import pyarrow as pa
from pyspark.sql import SparkSession
from pyspark.sql.pandas.types import from_arrow_schema

from srrf.rows import SCHEMA, PairRegistrar

FIXED = pa.types.is_fixed_size_list
# Spark's arrays have no fixed size.
PLAIN = pa.schema([f.with_type(pa.list_(f.type.value_type)) if FIXED(f.type) else f for f in SCHEMA])


class Register:
    """For `mapInArrow`: the network is loaded once a task."""

    def __init__(self, folder: str) -> None:
        self.folder = folder

    def __call__(self, batches: Iterator[pa.RecordBatch]) -> Iterator[pa.RecordBatch]:
        pairs = PairRegistrar(self.folder, num_threads=1)
        for batch in batches:
            answers = pairs.table(pa.Table.from_batches([batch]))
            yield from answers.select(SCHEMA.names).cast(PLAIN).to_batches()


def main(pairs: str, out: str, folder: str = ".", tasks: str = "2") -> None:
    """Answers go to a folder of Parquet files, with the columns of `srrf batch`."""
    spark = SparkSession.builder.appName("srrf").getOrCreate()
    frame = spark.read.parquet(pairs).repartition(int(tasks))
    frame.mapInArrow(Register(folder), from_arrow_schema(PLAIN)).write.parquet(out)
    spark.stop()


if __name__ == "__main__":
    main(*sys.argv[1:])
