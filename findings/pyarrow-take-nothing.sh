#!/usr/bin/env bash
# PyArrow 26.0.1 (PyPI): `Table.take([])` raises, where `Table.take([0])` works.
# Guess before the first run: no indices, no rows: a table of the same schema without rows, as NumPy and pandas give. Seen: the empty
# list becomes an array of type null, for which take has no kernel: ArrowNotImplementedError. A part of a list of pairs that holds
# none, as the last of many shards may, ends so. `take(pyarrow.array([], pyarrow.int64()))` gives the empty table.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check pyarrow==26.0.1
cd "$folder"
"$folder/venv/bin/python" - <<'PY'
import sys
import pyarrow as pa

table = pa.table({"source": ["a.ply", "b.ply"], "target": ["c.ply", "d.ply"]})
try:
    seen = table.take([]).num_rows
except pa.ArrowNotImplementedError as error:
    seen = f"{type(error).__name__}: {error}"
typed = table.take(pa.array([], pa.int64())).num_rows
print(f"PyArrow {pa.__version__}: take([0]) {table.take([0]).num_rows} row, take([]) {seen}, take of no int64 {typed} rows")
sys.exit(not (isinstance(seen, str) and typed == 0))
PY
