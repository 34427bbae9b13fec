#!/usr/bin/env bash
# Runs the parity suite (crates/srrf-train/tests/backends.rs) and 20 training steps on other backends than
# flex. See book/src/train/devices.md.
#
#   scripts/check-backends.sh [ndarray|wgpu|vulkan|cuda ...]     (default: ndarray wgpu)
#
# For wgpu and vulkan on a machine without a GPU, Mesa's lavapipe is installed where apt-get may do so. The
# first build of wgpu takes half an hour on 2 free cores; it goes to a target folder of its own.
set -euo pipefail
cd "$(dirname "$0")/.."
[ $# -gt 0 ] || set -- ndarray wgpu
cache=${XDG_CACHE_HOME:-$HOME/.cache}/srrf
export CARGO_TARGET_DIR="${CARGO_TARGET_DIR:-$cache/target}/backends"
# Mesa keeps its compiled shaders here; Burn keeps autotune results as cubecl.toml says.
export MESA_SHADER_CACHE_DIR="${MESA_SHADER_CACHE_DIR:-$cache/mesa}"
export XDG_RUNTIME_DIR="${XDG_RUNTIME_DIR:-$cache}" # lavapipe complains where there is none
mkdir -p "$MESA_SHADER_CACHE_DIR"
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT

# A Vulkan driver, lavapipe if there is none.
driver() {
  ls /usr/share/vulkan/icd.d/*.json /etc/vulkan/icd.d/*.json >/dev/null 2>&1 && return
  as_root=; [ "$(id -u)" = 0 ] || as_root=sudo
  $as_root apt-get update -qq
  $as_root apt-get install -y -qq --no-install-recommends mesa-vulkan-drivers libvulkan1 >/dev/null
}

for device in "$@"; do
  case "$device" in
    wgpu | vulkan) driver ;;
    ndarray | cuda) ;;
    *) sed -n '2,9s/^# \{0,1\}//p' "$0" >&2; exit 2 ;;
  esac
  printf '\n== %s: parity with flex\n' "$device"
  SRRF_REQUIRE_DEVICE=$device cargo test --locked -p srrf-train --features "$device" --test backends -- \
    --nocapture --test-threads 1 "$device"
  printf '\n== %s: 20 training steps\n' "$device"
  cargo run --locked -q -p srrf-train --features "$device" -- --config configs/smoke.toml --device "$device" \
    --run "$scratch/$device"
done
