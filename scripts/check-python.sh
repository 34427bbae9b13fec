#!/usr/bin/env bash
# Builds the Python package, installs it into a clean virtual environment, and tries it there: stubs, tests, examples, notebook.
#
#   scripts/check-python.sh [--quick] [--profile dev] [--wheel FILE] [--peers]
#
# --quick    only the short part: build, install, version, stubs, the quick tests
# --profile  the cargo profile of the wheel: dev (default; shares everything with .ci/run) or release
# --wheel    takes this wheel and builds none
# --peers    installs Open3D, small_gicp and kiss-matcher too, each into its own environment, and prints figures beside theirs
#
# Needs cargo and python3 (3.10 or newer). Environments are outside the checkout (${XDG_CACHE_HOME:-~/.cache}/srrf).
# $PYTHON chooses another interpreter.
set -euo pipefail
cd "$(dirname "$0")/.."

quick= profile=dev wheel= peers=
while [ $# -gt 0 ]; do
    case "$1" in
    --quick) quick=1 ;;
    --peers) peers=1 ;;
    --profile) profile=$2; shift ;;
    --wheel) wheel=$2; shift ;;
    *) sed -n '2,13s/^# \{0,1\}//p' "$0" >&2; exit 2 ;;
    esac
    shift
done
python=${PYTHON:-python3}
cache=${XDG_CACHE_HOME:-$HOME/.cache}/srrf
export CARGO_TARGET_DIR="${CARGO_TARGET_DIR:-$cache/target}"
export PIP_DISABLE_PIP_VERSION_CHECK=1
unset SRRF_DATA PYTHONPATH
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT

tools=$cache/python-$(cat scripts/python-tools.txt <("$python" --version) | cksum | cut -d' ' -f1)
if [ ! -e "$tools/complete" ]; then
    "$python" -m venv --clear "$tools"
    "$tools/bin/pip" install --quiet -r scripts/python-tools.txt
    touch "$tools/complete"
fi

if [ -z "$wheel" ]; then
    # The interpreter is named so that every build of pyo3 is the same one. `linux` asks for no older system than this one.
    platform=linux
    [ "$profile" = release ] && platform=manylinux_2_28
    PYO3_PYTHON="$python" "$tools/bin/maturin" build --quiet --locked --profile "$profile" --compatibility "$platform" \
        --auditwheel check --out "$scratch/wheels"
    wheel=$(ls "$scratch"/wheels/*.whl)
fi
echo "$(basename "$wheel"): $(stat -c %s "$wheel" | awk '{printf "%.1f MB", $1 / 1e6}')"
if [ "$profile" = release ] && [ "$(stat -c %s "$wheel")" -ge 25000000 ]; then
    echo "the wheel is over 25 MB" >&2
    exit 1
fi
case "$(basename "$wheel")" in *-cp310-abi3-*) ;; *) echo "not an abi3 wheel for Python 3.10 and newer" >&2; exit 1 ;; esac

# A clean environment: the wheel and what it asks for. The tools' packages come last on its path.
venv=$scratch/venv
"$python" -m venv "$venv"
"$venv/bin/pip" install --quiet "$wheel"
version=$(sed -n 's/^version = "\(.*\)"/\1/p' Cargo.toml | head -1)
cd "$scratch"
[ "$("$venv/bin/python" -c 'import srrf; print(srrf.__version__)')" = "$version" ] || { echo "the versions differ" >&2; exit 1; }
"$venv/bin/pip" show srrf | grep -qx "Version: $version" || { echo "the package's version is not $version" >&2; exit 1; }
[ "$("$venv/bin/srrf" --version)" = "srrf $version" ] || { echo "the program does not start" >&2; exit 1; }
cd - >/dev/null
site=$("$venv/bin/python" -c 'import sysconfig; print(sysconfig.get_path("purelib"))')
"$tools/bin/python" -c 'import sysconfig; print(sysconfig.get_path("purelib"))' >"$site/tools.pth"

echo "stubs: mypy --strict"
MYPYPATH=$PWD/python "$venv/bin/python" -m mypy --cache-dir "$scratch/mypy" python/srrf python/examples

export SRRF_PROGRAM=$CARGO_TARGET_DIR/debug/srrf SRRF_EVAL_PROGRAM=$CARGO_TARGET_DIR/debug/srrf-eval
[ -x "$SRRF_PROGRAM" ] || unset SRRF_PROGRAM
[ -x "$SRRF_EVAL_PROGRAM" ] || unset SRRF_EVAL_PROGRAM
test() { "$venv/bin/python" -m pytest -q -p no:cacheprovider --import-mode=importlib -rs "$@"; }
test python/tests
[ -z "$quick" ] || exit 0

for example in register own_method; do
    echo "example: $example"
    "$venv/bin/python" "python/examples/$example.py"
done
echo "notebook"
"$venv/bin/python" - "$scratch" <<'PY'
import sys
import nbformat
from nbclient import NotebookClient

notebook = nbformat.read("python/examples/two_scans.ipynb", as_version=4)
assert not any(cell.get("outputs") for cell in notebook.cells), "the notebook is kept without outputs"
NotebookClient(notebook, timeout=300, resources={"metadata": {"path": sys.argv[1]}}).execute()
pictures = [o for c in notebook.cells for o in c.get("outputs", []) if "text/html" in o.get("data", {})]
assert len(pictures) == 2 and all("iframe" in o["data"]["text/html"] for o in pictures), len(pictures)
print(f"{len(notebook.cells)} cells, {len(pictures)} pictures")
PY

[ -n "$peers" ] && "$python" scripts/python_peers.py --wheel "$wheel"
echo "the Python package is as it should be"
