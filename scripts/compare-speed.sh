#!/usr/bin/env bash
# Times a training step and the forward pass of this crate and of the same network in PyTorch, by turns,
# and prints one table (Markdown). See book/src/results/speed.md.
#
#   scripts/compare-speed.sh [--rounds 7] [--repeats 5] [--threads 2] [--config configs/modelnet-small.toml]
#
# Needs cargo and python3 (3.11 or newer). Where python3 has no torch, it is installed from PyPI into a
# virtual environment outside the checkout (${XDG_CACHE_HOME:-~/.cache}/srrf-speed).
set -euo pipefail
cd "$(dirname "$0")/.."

rounds=7 repeats=5 threads=2 config=configs/modelnet-small.toml
while [ $# -gt 0 ]; do
    case "$1" in
    --rounds) rounds=$2 ;;
    --repeats) repeats=$2 ;;
    --threads) threads=$2 ;;
    --config) config=$2 ;;
    *) sed -n '2,8s/^# \{0,1\}//p' "$0" >&2; exit 2 ;;
    esac
    shift 2
done

python=${PYTHON:-python3}
if ! "$python" -c 'import torch, numpy' 2>/dev/null; then
    venv=${XDG_CACHE_HOME:-$HOME/.cache}/srrf-speed
    [ -x "$venv/bin/python" ] || "$python" -m venv "$venv"
    python=$venv/bin/python
    "$python" -c 'import torch, numpy' 2>/dev/null || "$python" -m pip install --quiet torch numpy
fi

# SRRF_STEP_TIME names a program that is built already.
program=${SRRF_STEP_TIME:-}
if [ -z "$program" ]; then
    cargo build --quiet -p srrf-lab --bin step_time
    program=${CARGO_TARGET_DIR:-target}/debug/step_time
fi

"$python" scripts/speed_reference.py --check >&2
exec "$python" - "$program" "$rounds" "$repeats" "$threads" "$config" <<'PY'
import json, platform, statistics, subprocess, sys
from datetime import date

program, rounds, repeats, threads, config = sys.argv[1:]
common = ["--threads", threads, "--repeats", repeats, "--config", config]
torch = [sys.executable, "scripts/speed_reference.py"]
FIGURES = {
    "registration_step": "training step, registration",
    "skeleton_step": "training step, skeleton module",
    "forward_1": "forward, 1 pair",
    "forward_8": "forward, 8 pairs",
}
found = {}  # (side, figure) -> results


def run(side, figure, command):
    output = subprocess.run(command + ["--figure", figure, *common], check=True, capture_output=True, text=True)
    found.setdefault((side, figure), []).append(json.loads(output.stdout.strip().splitlines()[-1]))
    print(f"{side:6} {figure:18} {found[side, figure][-1]['median_s']:.4f} s", file=sys.stderr)


for _ in range(int(rounds)):
    for figure in FIGURES:
        run("ours", figure, [program])
        run("torch", figure, torch)
        if figure.endswith("step"):
            run("bf16", figure, [*torch, "--bf16"])


def value(side, figure, key, take):
    return take(result[key] for result in found[side, figure])


def ratio(figure):
    """Median over the rounds, each of which saw the same load on both sides; then that of the least times."""
    pairs = zip(found["ours", figure], found["torch", figure])
    middle = statistics.median(ours["median_s"] / torch["median_s"] for ours, torch in pairs)
    return f"{middle:.2f} ({value('ours', figure, 'min_s', min) / value('torch', figure, 'min_s', min):.2f})"


def machine():
    try:
        with open("/proc/cpuinfo") as file:
            name = next(line.split(":")[1].strip() for line in file if line.startswith("model name"))
    except (OSError, StopIteration):
        name = platform.processor()
    return f"{name}, {threads} threads"


def version(command):
    return subprocess.run(command, capture_output=True, text=True).stdout.strip()


any_torch = found["torch", "forward_1"][0]
print(f"{date.today()}, {machine()}; {version(['rustc', '--version'])}; PyTorch {any_torch['torch']}; commit "
      f"{version(['git', 'rev-parse', '--short', 'HEAD'])}; {rounds} rounds of {repeats}; {config}\n")
print("| median (least), ms | ours | PyTorch f32 | ratio | PyTorch bf16 |")
print("|---|---|---|---|---|")
for figure, name in FIGURES.items():
    cells = {}
    for side in ("ours", "torch", "bf16"):
        if (side, figure) in found:
            middle, least = value(side, figure, "median_s", statistics.median), value(side, figure, "min_s", min)
            cells[side] = f"{middle * 1e3:.1f} ({least * 1e3:.1f})"
    print(f"| {name} | {cells['ours']} | {cells['torch']} | {ratio(figure)} | {cells.get('bf16', '')} |")
print("\n| peak memory, MiB (above what the process held before the first step) | ours | PyTorch f32 | ratio |")
print("|---|---|---|---|")
for figure, name in FIGURES.items():
    if found["ours", figure][0]["peak_mib"] is None:
        continue
    cells = []
    for side in ("ours", "torch"):
        peak, start = (value(side, figure, key, statistics.median) for key in ("peak_mib", "start_mib"))
        cells.append((peak, peak - start, f"{peak:.0f} ({peak - start:.0f})"))
    share = f"{cells[0][0] / cells[1][0]:.2f} ({cells[0][1] / cells[1][1]:.2f})"
    print(f"| {name} | {cells[0][2]} | {cells[1][2]} | {share} |")
PY
