#!/usr/bin/env bash
# Registers 2,000 small pairs on a Ray cluster of several processes on this machine, kills an actor on the way, and compares
# every row with `srrf batch`.
#
#   scripts/check-ray.sh [--wheel FILE] [--pairs 2000]
#
# Installs the wheel (built as scripts/check-python.sh does, unless one is given), Ray and PyArrow from PyPI into a virtual
# environment outside the checkout. The cluster listens on 127.0.0.1 alone, and ends with the script.
set -euo pipefail
cd "$(dirname "$0")/.."

wheel= pairs=2000
while [ $# -gt 0 ]; do
    case "$1" in
    --wheel) wheel=$2 ;;
    --pairs) pairs=$2 ;;
    *) sed -n '2,8s/^# \{0,1\}//p' "$0" >&2; exit 2 ;;
    esac
    shift 2
done
python=${PYTHON:-python3}
cache=${XDG_CACHE_HOME:-$HOME/.cache}/srrf
export CARGO_TARGET_DIR="${CARGO_TARGET_DIR:-$cache/target}" PIP_DISABLE_PIP_VERSION_CHECK=1 RAY_USAGE_STATS_ENABLED=0
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT

venv=$cache/ray
[ -x "$venv/bin/python" ] || "$python" -m venv "$venv"
"$venv/bin/pip" install --quiet "ray[data]==2.60.0" "pyarrow==26.0.1" maturin==1.16.0
if [ -z "$wheel" ]; then
    PYO3_PYTHON="$python" "$venv/bin/maturin" build --quiet --locked --profile dev --compatibility linux --out "$scratch"
    wheel=$(ls "$scratch"/*.whl)
fi
"$venv/bin/pip" install --quiet --force-reinstall --no-deps "$wheel"
cd "$scratch"
"$venv/bin/python" "$OLDPWD/scripts/check_ray.py" --pairs "$pairs"
