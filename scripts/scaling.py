#!/usr/bin/env python3
"""What many pairs cost on this machine: CPU seconds a pair, bytes a row, and 1 thread against 2.

    python3 scripts/scaling.py [--pairs 48] [--rounds 2] [--seed 1] [--results results.csv]

Makes pairs of the corruption benchmark (1,024 points, all twelve corruptions at severity 3), has `srrf batch` register them with
1 and with 2 threads by turns, and prints one table (Markdown). Both runs must give the same rows, but for their times.
`--results` keeps those of 1 thread, for scripts/simulate_cluster.py. Needs the package srrf, installed, and Linux.
"""

import argparse
import json
import os
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

import srrf


def write(folder, count, seed):
    kinds = len(srrf.CORRUPTIONS)
    made = srrf.pairs(-(-count // kinds), clean=False, severities=[3], seed=seed)
    lines = ["source,target"]
    for number, pair in enumerate(made.take(range(count))):
        for name in ("source", "target"):
            np.save(folder / f"{number}_{name}.npy", getattr(pair, name))
        lines.append(f"{number}_source.npy,{number}_target.npy")
    (folder / "pairs.csv").write_text("\n".join(lines) + "\n")


def batch(folder, threads):
    """Seconds, CPU seconds, and the rows without their times."""
    out = folder / f"{threads}.jsonl"
    out.unlink(missing_ok=True)
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    begun = time.perf_counter()
    command = [sys.executable, "-m", "srrf", "batch", str(folder / "pairs.csv"), "-o", str(out), "--quiet", "--threads", str(threads)]
    code = subprocess.run(command).returncode
    if code not in (0, 1):
        sys.exit(f"error: srrf batch ended with {code}")
    wall = time.perf_counter() - begun
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    rows = [json.loads(line) for line in out.read_text().splitlines()]
    for row in rows:
        row.pop("seconds", None)
    return wall, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime, rows


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--pairs", type=int, default=48)
    parser.add_argument("--rounds", type=int, default=2)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--results")
    args = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        write(folder, args.pairs, args.seed)
        runs = {1: [], 2: []}
        for _ in range(args.rounds):
            for threads, found in runs.items():
                *seconds, rows = batch(folder, threads)
                found.append(seconds)
                expected = rows if threads == 1 else expected
                assert sorted(map(str, rows)) == sorted(map(str, expected)), "other rows"
        sizes = {}
        for ending in ("jsonl", "parquet", "csv"):
            out = args.results if ending == "csv" and args.results else str(folder / f"joined.{ending}")
            merge = [sys.executable, "-m", "srrf", "batch", "merge", str(folder / "1.jsonl"), "-o", out, "--quiet"]
            subprocess.run(merge, check=True)
            sizes[ending] = os.path.getsize(out) / args.pairs
    print(f"srrf {srrf.__version__}, {args.pairs} pairs of 1,024 points, seed {args.seed}, medians of {args.rounds}\n")
    print("| threads | seconds | CPU seconds a pair | pairs a second |")
    print("|---|---|---|---|")
    for threads, found in runs.items():
        wall, cpu = (statistics.median(column) for column in zip(*found))
        print(f"| {threads} | {wall:.1f} | {cpu / args.pairs:.2f} | {args.pairs / wall:.2f} |")
    print("\nBytes a row: " + ", ".join(f"{size:.0f} as {ending}" for ending, size in sizes.items()))


if __name__ == "__main__":
    main()
