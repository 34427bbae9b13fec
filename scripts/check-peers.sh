#!/bin/sh
# Files to and from other tools, value by value: scripts/check-peers.sh [--book]
#
# Installs the tools into a virtual environment (SRRF_PEERS_VENV, or a temporary one), and Debian's pcl-tools where
# apt-get may install, then runs scripts/check_peers.py, which prints a table. With --book it goes to
# book/src/generated/peers.md. Not in CI: it downloads about a gigabyte.
set -eu
cd "$(dirname "$0")/.."
venv=${SRRF_PEERS_VENV:-}
if [ -z "$venv" ]; then
  venv=$(mktemp -d)
  trap 'rm -rf "$venv"' EXIT
fi
if ! [ -x "$venv/bin/python" ]; then
  "${SRRF_PYTHON:-python3}" -m venv "$venv"
fi
"$venv/bin/pip" install -q open3d==0.20.0 trimesh 'laspy[lazrs]' pye57 pandas pyarrow plyfile pyvista meshio \
  mcap-ros2-support
if ! command -v pcl_pcd2ply >/dev/null && [ "$(id -u)" = 0 ]; then
  apt-get install -qq -y --no-install-recommends pcl-tools >/dev/null 2>&1 || echo "pcl-tools cannot be installed" >&2
fi
cargo build -q -p srrf-cloud --example convert
convert=$(cargo metadata --format-version 1 --no-deps | "$venv/bin/python" -c 'import json, sys; print(json.load(sys.stdin)["target_directory"])')/debug/examples/convert
"$venv/bin/python" scripts/check_peers.py "$convert" "$@"

# Files as people and cameras write them, by the program itself.
cargo build -q -p srrf
"$venv/bin/python" scripts/make_corpus.py "$(mktemp -d)" --check "${convert%/examples/convert}/srrf"
