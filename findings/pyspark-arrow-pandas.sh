#!/usr/bin/env bash
# PySpark 4.3.0 (PyPI): `DataFrame.mapInArrow` does not run without pandas, though nothing in it is pandas.
# Guess before the first run: it takes and gives `pyarrow.RecordBatch`, so PySpark and PyArrow are enough; `mapInPandas` is the one
# that needs pandas. Seen: with PyArrow alone it raises before the function is called, naming pandas and the version it asks for.
# Install `pandas` on driver and workers for Arrow functions too. Needs Java 17 or newer.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check pyspark==4.3.0 pyarrow==26.0.1
cd "$folder"
"$folder/venv/bin/python" - <<'PY' 2>"$folder/log"
import sys
import pyarrow, pyspark
from pyspark.sql import SparkSession

spark = SparkSession.builder.master("local[1]").config("spark.ui.enabled", "false").getOrCreate()
try:
    spark.range(3).mapInArrow(lambda batches: batches, "id long").collect()
    why = "it ran"
except Exception as error:
    why = f"{type(error).__name__}: {error}".splitlines()[0]
print(f"PySpark {pyspark.__version__}, PyArrow {pyarrow.__version__}, no pandas: {why}")
sys.exit("pandas" not in why.lower())
PY
