#!/usr/bin/env python3
"""How many workers are worth having: where the workers, the driver or the store of the clouds is the limit.

    python3 scripts/simulate_cluster.py --results results.csv [--pairs 200000] [--batch 16] [--driver-ms 5]
                                        [--store-gbit 10] [--pair-mb 1.0] [--mean SECONDS] [--seed 1]

Service times are those of the column `seconds` of results of `srrf batch` (CSV; `srrf batch merge a.parquet -o a.csv` makes
it), drawn with replacement. Each worker takes the next batch: the driver hands it out (`--driver-ms` a batch, one after the
other), the store sends its clouds (`--pair-mb` a pair, all workers share `--store-gbit`, first come, first served), then the
worker computes. Prints one table (Markdown): pairs a second, the share of the workers' time that is work, how busy driver and
store are, and hours for all pairs. Needs nothing but python3.
"""

import argparse
import csv
import heapq
import random
import sys

WORKERS = (1, 2, 4, 16, 64, 256, 512, 1024)


def simulate(workers, service, pairs, batch, driver_seconds, store_seconds, rng):
    """Seconds until the last of `pairs` is done, and the busy seconds of workers, driver and store."""
    driver_free = store_free = 0.0
    busy = [0.0, 0.0, 0.0]
    free = [0.0] * workers
    heapq.heapify(free)
    end = 0.0
    for begin in range(0, pairs, batch):
        size = min(batch, pairs - begin)
        ready = heapq.heappop(free)
        driver_free = max(driver_free, ready) + driver_seconds
        store_free = max(store_free, driver_free) + size * store_seconds
        work = sum(rng.choice(service) for _ in range(size))
        done = store_free + work
        heapq.heappush(free, done)
        end = max(end, done)
        busy = [busy[0] + work, busy[1] + driver_seconds, busy[2] + size * store_seconds]
    return end, busy


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--results", required=True)
    parser.add_argument("--pairs", type=int, default=200_000)
    parser.add_argument("--batch", type=int, default=16)
    parser.add_argument("--driver-ms", type=float, default=5.0)
    parser.add_argument("--store-gbit", type=float, default=10.0)
    parser.add_argument("--pair-mb", type=float, default=1.0)
    parser.add_argument("--mean", type=float, help="seconds a pair that the service times are scaled to, on average: the CPU seconds "
                        "of scripts/scaling.py, where the machine was busy with other work")
    parser.add_argument("--seed", type=int, default=1)
    args = parser.parse_args()
    csv.field_size_limit(sys.maxsize)
    with open(args.results, newline="", encoding="utf-8") as file:
        service = [float(row["seconds"]) for row in csv.DictReader(file) if row["seconds"]]
    if not service:
        sys.exit(f"error: {args.results} has no seconds; give results of `srrf batch` as CSV")
    mean = sum(service) / len(service)
    if args.mean is not None:
        service, mean = [seconds * args.mean / mean for seconds in service], args.mean
    print(f"{args.pairs} pairs in batches of {args.batch}; {mean:.3f} s a pair (mean of {len(service)}); driver "
          f"{args.driver_ms} ms a batch; store {args.store_gbit} Gbit/s, {args.pair_mb} MB a pair; seed {args.seed}\n")
    print("| workers | pairs a second | workers busy | driver busy | store busy | hours | the limit |")
    print("|---|---|---|---|---|---|---|")
    for workers in WORKERS:
        rng = random.Random(args.seed)
        store = args.pair_mb * 8e6 / (args.store_gbit * 1e9)
        end, busy = simulate(workers, service, args.pairs, args.batch, args.driver_ms / 1e3, store, rng)
        shares = [busy[0] / (workers * end), busy[1] / end, busy[2] / end]
        limit = ("workers", "driver", "store")[max(range(3), key=shares.__getitem__)]
        print(f"| {workers} | {args.pairs / end:.1f} | {shares[0]:.0%} | {shares[1]:.0%} | {shares[2]:.0%} "
              f"| {end / 3600:.2f} | {limit} |")


if __name__ == "__main__":
    main()
