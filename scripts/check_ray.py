#!/usr/bin/env python3
"""The work of scripts/check-ray.sh: run by it, in an empty folder, where srrf and ray are installed."""

import argparse
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.dataset
import pyarrow.parquet as parquet

import srrf

TARGETS = 20
ACTOR = "MapBatches(RegisterPairs)"


def write_pairs(count):
    """A list of small pairs that share targets; one of a hundred names a file that is not there."""
    rng = np.random.default_rng(5)
    for i in range(TARGETS):
        np.save(f"target{i}.npy", rng.uniform((0, 0, 0), (3, 2, 1), (60, 3)))
    rows = []
    for i in range(count):
        target = i * TARGETS // count
        if i % 100 != 7:
            np.save(f"source{i}.npy", np.load(f"target{target}.npy") + rng.normal(0, 0.02, (60, 3)) + [0.05, 0, 0])
        rows.append({"source": f"source{i}.npy", "target": f"target{target}.npy", "site": f"s{i % 3}"})
    parquet.write_table(pa.Table.from_pylist(rows), "pairs.parquet")


def ancestors(pid):
    while pid > 1:
        yield pid
        try:
            pid = int(Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[1])
        except OSError:
            return


def actors(of):
    """Processes of actors under the process `of`."""
    for folder in Path("/proc").iterdir():
        if folder.name.isdigit():
            try:
                title = (folder / "cmdline").read_bytes().decode(errors="replace")
            except OSError:
                continue
            if ACTOR in title and of in ancestors(int(folder.name)):
                yield int(folder.name)


def run_ray(count):
    """Runs the command, and kills one actor once some answers are there. Gives the seconds."""
    begun = time.perf_counter()
    command = [sys.executable, "-m", "srrf.ray", "pairs.parquet", "out", "--method", "icp", "--concurrency", "2"]
    run = subprocess.Popen([*command, "--batch-size", str(max(1, count // 40))])
    killed = None
    while run.poll() is None:
        if killed is None and os.path.isdir("out") and len(os.listdir("out")) >= 3:
            for pid in actors(run.pid):
                os.kill(pid, signal.SIGKILL)
                killed = pid
                break
        time.sleep(0.02)
    assert run.returncode == 0, run.returncode
    assert killed is not None, "no actor was there to be killed"
    return time.perf_counter() - begun


def untimed(table):
    rows = {}
    for row in table.to_pylist():
        answer = json.loads(row["answer"])
        answer.pop("seconds", None)
        row = {**row, "answer": json.dumps(answer), "seconds": None}
        assert row["id"] not in rows, f"{row['id']} is there twice"
        rows[row["id"]] = row
    return rows


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--pairs", type=int, default=2000)
    count = parser.parse_args().pairs
    write_pairs(count)
    begun = time.perf_counter()
    batch = [sys.executable, "-m", "srrf", "batch", os.path.abspath("pairs.parquet"), "-o", "batch.parquet"]
    done = subprocess.run([*batch, "--method", "icp", "--quiet"])
    assert done.returncode == 1, "the pairs without a file have no pose"
    seconds = time.perf_counter() - begun
    ray_seconds = run_ray(count)
    of_batch = parquet.read_table("batch.parquet")
    of_ray = pyarrow.dataset.dataset("out", format="parquet").to_table()
    assert of_ray.schema.names == of_batch.schema.names, of_ray.schema.names
    expected, found = untimed(of_batch), untimed(of_ray)
    assert len(expected) == len(found) == count, (len(expected), len(found))
    different = [name for name in expected if expected[name] != found[name]]
    assert not different, (len(different), expected[different[0]], found[different[0]])
    failed = sum(row["error"] is not None for row in found.values())
    size = sum(f.stat().st_size for f in Path("out").iterdir())
    command = [sys.executable, "-m", "srrf.ray", "pairs.parquet", "out"]
    again = subprocess.run([*command, "--method", "icp"], capture_output=True, text=True)
    assert again.returncode == 0 and f"{count} done already" in again.stderr, again
    other = subprocess.run(command, capture_output=True, text=True)
    assert other.returncode == 2 and "answers by other options" in other.stderr, other
    print(f"{count} pairs, an actor killed: no row lost, none twice, {failed} errors as rows, all equal to `srrf batch`")
    print(f"srrf {srrf.__version__}: batch {seconds:.1f} s, Ray with its start {ray_seconds:.1f} s, {size / count:.0f} bytes a row")


if __name__ == "__main__":
    main()
