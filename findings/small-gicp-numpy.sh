#!/usr/bin/env bash
# small_gicp 1.0.1 (PyPI): the wheel asks for no NumPy, and cannot be imported without it.
# Guess before the first run: every function takes arrays, so the wheel declares numpy and pip brings it. Seen: `pip install small_gicp`
# installs one package, and `import small_gicp` ends in "ImportError: initialization failed", caused by the missing module. Install
# numpy beside it.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check small_gicp==1.0.1
cd "$folder"
"$folder/venv/bin/python" - <<'PY'
import importlib.metadata, sys

requires = importlib.metadata.requires("small_gicp") or []
try:
    import small_gicp
    why = None
except ImportError as error:
    why = f"{type(error).__name__}: {error}; cause: {error.__cause__!r}"
print("small_gicp", importlib.metadata.version("small_gicp"), "requires", requires, "import:", why)
sys.exit(not (why and "numpy" not in " ".join(requires).lower()))
PY
