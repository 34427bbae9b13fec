#!/usr/bin/env bash
# Trains on a CUDA device in slices, each shorter than a time limit, that go on where the last one stopped.
#
#   scripts/train-gpu.sh --data PATH [--config configs/modelnet.toml, or LIST.toml#NAME] [--folder gpu] [--minutes 9] [--slices N]
#   scripts/train-gpu.sh --prepare --data PATH     builds the program and packs the data, for another machine
#
# FOLDER holds all that the machine with the GPU needs beside this checkout: the program `srrf-train`, the
# training shapes packed below 50 MB (`data/`), and the runs (`runs/CONFIG/`). What is there already is used, so that
# machine needs neither cargo, Python nor network: the program finds the CUDA driver at run time.
# Building needs the crates registry, and LibTorch for --device libtorch (book/src/train/devices.md); packing needs python3.
# For a rehearsal without a GPU: --device flex --config configs/smoke.toml.
set -euo pipefail
cd "$(dirname "$0")/.."

config=configs/modelnet.toml data= folder=gpu minutes=9 slices=1000 device=cuda prepare=
while [ $# -gt 0 ]; do
  case "$1" in
    --prepare) prepare=yes; shift; continue ;;
    --data) data=$2 ;;
    --config) config=$2 ;;
    --folder) folder=$2 ;;
    --minutes) minutes=$2 ;;
    --slices) slices=$2 ;;
    --device) device=$2 ;;
    *) sed -n '2,11s/^# \{0,1\}//p' "$0" >&2; exit 2 ;;
  esac
  shift 2
done
mkdir -p "$folder"

if [ ! -x "$folder/srrf-train" ]; then
  features=()
  [ "$device" = flex ] || features=(--features "$device")
  target=${CARGO_TARGET_DIR:-${XDG_CACHE_HOME:-$HOME/.cache}/srrf/target}
  [ "$device" = flex ] || target=$target/backends
  CARGO_TARGET_DIR=$target cargo build --locked -p srrf-train "${features[@]}"
  strip -o "$folder/srrf-train" "$target/debug/srrf-train"
  chmod +x "$folder/srrf-train"
fi

# Coordinates to 2^-12 (half a step is 1.2e-4 of the radius; the smallest corruption is fifty times that) and
# points in the order of a space-filling curve, in the same HDF5 layout, so that deflate finds more to take out.
pack() {
  local python=python3
  if ! "$python" -c 'import h5py, numpy' 2>/dev/null; then
    local venv=${XDG_CACHE_HOME:-$HOME/.cache}/srrf/pack
    [ -x "$venv/bin/python" ] || python3 -m venv "$venv"
    python=$venv/bin/python
    "$python" -c 'import h5py, numpy' 2>/dev/null || "$python" -m pip install --quiet h5py numpy
  fi
  rm -rf "$folder/data.part"
  mkdir "$folder/data.part"
  "$python" - "$data" "$folder/data.part" <<'PY'
import pathlib, shutil, sys
import h5py, numpy as np

source, out = map(pathlib.Path, sys.argv[1:])
if not list(source.glob("ply_data_train*.h5")):
    source = next(p.parent for p in sorted(source.glob("*/ply_data_train*.h5")))
def curve(grid):
    """Place of each grid point (13 bits an axis) along a Morton curve."""
    key = np.zeros(grid.shape[:2], np.uint64)
    for bit in range(14):
        for axis in range(3):
            key |= ((grid[..., axis] >> bit) & 1).astype(np.uint64) << np.uint64(3 * bit + axis)
    return key
for path in sorted(source.glob("ply_data_train*.h5")):
    with h5py.File(path) as file, h5py.File(out / path.name, "w") as packed:
        grid = np.round(file["data"][:, :1024].astype("f8") * 2**12).astype(np.int64)
        order = np.argsort(curve(grid + 2**12 + 8), axis=1, kind="stable")
        points = np.take_along_axis(grid, order[..., None], 1) / 2**12
        packed.create_dataset("data", data=points.astype("<f4"), chunks=(64, points.shape[1], 3),
                              compression="gzip", compression_opts=9, shuffle=True)
        packed.create_dataset("label", data=file["label"][:].astype("u1"))
for path in [*source.glob("ply_data_train*.json"), *source.glob("*.txt")]:
    shutil.copy(path, out)
size = sum(path.stat().st_size for path in out.iterdir())
print(f"packed: {size / 1e6:.1f} MB")
if size >= 50e6:
    sys.exit("the packed data are not below 50 MB")
PY
  mv "$folder/data.part" "$folder/data"
}

needs_data=()
# `source` of a configuration may stand in one that it extends; built-in shapes are said in the file itself.
if ! grep -q '^source = "shapes"' "${config%%#*}"; then
  if [ ! -d "$folder/data" ]; then
    [ -n "$data" ] || { echo "train-gpu: say where ModelNet40 is: --data PATH" >&2; exit 2; }
    pack
  fi
  needs_data=(--data "$folder/data")
fi
if [ -n "$prepare" ]; then
  du -sh "$folder"/*
  exit
fi

if [ "$device" = cuda ] && ! ldconfig -p | grep -q 'libcuda\.so' && [ -z "${LD_LIBRARY_PATH:-}" ]; then
  echo "train-gpu: no libcuda.so; install NVIDIA's driver, or name its folder in LD_LIBRARY_PATH" >&2
fi
run=$(basename "${config##*#}" .toml) # the name in a list, or that of the file
for ((slice = 1; slice <= slices; slice++)); do
  "$folder/srrf-train" --config "$config" "${needs_data[@]}" --run "$folder/runs/$run" --device "$device" \
    --minutes "$minutes" --resume 2>&1 | tee "$folder/slice.log"
  grep -q '^not complete' "$folder/slice.log" || { echo "complete after $slice slices"; exit; }
done
echo "not complete; run this again to go on"
