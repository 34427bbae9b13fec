#!/usr/bin/env bash
# Builds the Python package, installs it into a clean virtual environment, and tries it there: stubs, tests, examples, notebook.
#
#   scripts/check-python.sh [--quick] [--profile dev] [--wheel FILE] [--out FOLDER] [--torch] [--peers] [--optional]
#
# --quick     only the short part: build, install, version, stubs, the quick tests
# --profile   the cargo profile of the wheel: dev (default; shares everything with .ci/run) or release
# --wheel     takes this wheel and builds none
# --out       keeps the wheel in this folder
# --torch     installs PyTorch too (gigabytes), and tries srrf.torch and its example
# --peers     installs Open3D, small_gicp and kiss-matcher too, each into its own environment, and prints figures beside theirs
# --optional  says `left out: ...` and ends well where the module venv or PyPI is not there
#
# The wheel is for glibc 2.28 and newer (manylinux_2_28), whatever this machine has: Zig, from PyPI, links its one library against
# the symbols of that glibc, and maturin checks which symbols it asks for. What it is built of is that of every other build.
#
# Needs cargo and python3 (3.10 or newer). Environments are outside the checkout (${XDG_CACHE_HOME:-~/.cache}/srrf).
# $PYTHON chooses another interpreter.
set -euo pipefail
cd "$(dirname "$0")/.."

quick= profile=dev wheel= out= torch= peers= optional=
while [ $# -gt 0 ]; do
    case "$1" in
    --quick) quick=1 ;;
    --torch) torch=1 ;;
    --peers) peers=1 ;;
    --optional) optional=1 ;;
    --profile) profile=$2; shift ;;
    --wheel) wheel=$2; shift ;;
    --out) out=$2; shift ;;
    *) sed -n '2,18s/^# \{0,1\}//p' "$0" >&2; exit 2 ;;
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
begun=$SECONDS
say() { printf '%s (after %d s)\n' "$*" $((SECONDS - begun)); }
missing() {
    [ -z "$optional" ] || { echo "left out: the Python package; $1"; exit 0; }
    echo "$1" >&2
    exit 1
}

"$python" -c 'import ensurepip, venv' 2>/dev/null || missing "the module venv is not here (Debian: apt-get install python3-venv)"
tools=$cache/python-$(cat scripts/python-tools.txt <("$python" --version) | cksum | cut -d' ' -f1)
if [ ! -e "$tools/complete" ]; then
    "$python" -m venv --clear "$tools"
    if ! "$tools/bin/pip" install --quiet -r scripts/python-tools.txt; then
        # A wrong list is a fault, and a network that is not there is none.
        "$tools/bin/pip" download --quiet --no-deps --dest "$scratch/probe" six >/dev/null 2>&1 || missing "PyPI cannot be reached"
        exit 1
    fi
    touch "$tools/complete"
fi

if [ -z "$wheel" ]; then
    printf '#!/bin/sh\nexec "%s" zig cc -- -O2 -fno-sanitize=all -target x86_64-linux-gnu.2.28 -Wl,--gc-sections -s "$@"\n' "$tools/bin/maturin" >"$scratch/zigcc"
    chmod +x "$scratch/zigcc"
    linker=() platform=linux
    if [ "$(uname -sm)" = "Linux x86_64" ]; then
        platform=manylinux_2_28
        linker=(-- -C "linker=$scratch/zigcc")
    fi
    # The interpreter is named so that every build of pyo3 is the same one. The linker is that of the last crate alone, so that
    # nothing else is compiled again. Without -O2 and -s Zig keeps what nobody uses, and twice as much comes out.
    PATH=$tools/bin:$PATH PYO3_PYTHON="$python" "$tools/bin/maturin" build --quiet --locked --profile "$profile" \
        --compatibility "$platform" --auditwheel check --out "${out:-$scratch/wheels}" "${linker[@]}"
    wheel=$(ls -t "${out:-$scratch/wheels}"/*.whl | head -1)
fi
say "$(basename "$wheel"): $(stat -c %s "$wheel" | awk '{printf "%.1f MB", $1 / 1e6}')"
if [ "$(stat -c %s "$wheel")" -ge 25000000 ]; then
    echo "the wheel is over 25 MB" >&2
    exit 1
fi
case "$(basename "$wheel")" in *-cp310-abi3-*) ;; *) echo "not an abi3 wheel for Python 3.10 and newer" >&2; exit 1 ;; esac
[ "$(uname -s)" != Linux ] || "$tools/bin/auditwheel" show "$wheel" | tr '\n' ' ' | grep -o 'platform tag: "[^"]*"' || true

# A clean environment: the wheel and what it asks for. The tools' packages come last on its path.
venv=$scratch/venv
"$python" -m venv "$venv"
"$venv/bin/pip" install --quiet "$wheel"
version=$(sed -n 's/^version = "\(.*\)"/\1/p' Cargo.toml | head -1)
cd "$scratch"
[ "$("$venv/bin/python" -c 'import srrf; print(srrf.__version__)')" = "$version" ] || { echo "the versions differ" >&2; exit 1; }
[ "$("$venv/bin/python" -c 'import importlib.metadata as m; print(m.version("srrf"))')" = "$version" ] || { echo "the package's version is not $version" >&2; exit 1; }
[ "$("$venv/bin/srrf" --version)" = "srrf $version" ] || { echo "the program does not start" >&2; exit 1; }
cd - >/dev/null
site=$("$venv/bin/python" -c 'import sysconfig; print(sysconfig.get_path("purelib"))')
"$tools/bin/python" -c 'import sysconfig; print(sysconfig.get_path("purelib"))' >"$site/tools.pth"

say "stubs: mypy --strict"
MYPYPATH=$PWD/python "$venv/bin/python" -m mypy --cache-dir "$scratch/mypy" python/srrf python/examples

export SRRF_PROGRAM=$CARGO_TARGET_DIR/debug/srrf SRRF_EVAL_PROGRAM=$CARGO_TARGET_DIR/debug/srrf-eval
[ -x "$SRRF_PROGRAM" ] || unset SRRF_PROGRAM
[ -x "$SRRF_EVAL_PROGRAM" ] || unset SRRF_EVAL_PROGRAM
test() { "$venv/bin/python" -m pytest -q -p no:cacheprovider --import-mode=importlib -rs "$@"; }
say "tests"
test python/tests
[ -z "$quick" ] || exit 0

for example in register own_method; do
    say "example: $example"
    "$venv/bin/python" "python/examples/$example.py"
done
say "notebook"
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

if [ -n "$torch" ]; then
    say "PyTorch"
    "$venv/bin/pip" install --quiet torch
    test python/tests/test_torch.py
    "$venv/bin/python" python/examples/train_torch.py
fi
[ -z "$peers" ] || "$python" scripts/python_peers.py --wheel "$wheel"
say "the Python package is as it should be"
