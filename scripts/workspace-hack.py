#!/usr/bin/env python3
"""Keeps `cargo build -p X` from compiling a dependency again that the built workspace has.

    python3 scripts/workspace-hack.py          # would anything be compiled twice? By Cargo's plans, in seconds (CI)
    python3 scripts/workspace-hack.py --build  # the same by building each member, in minutes
    python3 scripts/workspace-hack.py --write  # writes crates/workspace-hack/Cargo.toml anew, then `cargo check`

Cargo gives a dependency the features that the chosen members ask for, so one member alone may get it with other
features than all of them together, and with it everything above. The crate `workspace-hack`, on which every member
depends, asks for the features of all of them. --write compares Cargo's own plans for each member and for the
workspace, and needs no compiler; so does the check. --build builds each member and fails where Cargo compiled anything
that is not a member. (cargo-hakari does the same; it takes minutes to install and has no say in what CI may trust.)
"""

import argparse
import json
import os
import subprocess
import sys
from collections import defaultdict
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
MANIFEST = ROOT / "crates/workspace-hack/Cargo.toml"
MARK = "# Written by scripts/workspace-hack.py from here on.\n"
sys.setrecursionlimit(10_000)


def members():
    found = subprocess.run(["cargo", "metadata", "--no-deps", "--format-version", "1"], cwd=ROOT, check=True, capture_output=True)
    return sorted(package["name"] for package in json.loads(found.stdout)["packages"])


def plan(*chosen):
    """Features of each dependency in Cargo's plan: (name, version, for the host) -> sets of features."""
    command = ["cargo", "build", "--unit-graph", "-Zunstable-options", *chosen]
    found = subprocess.run(command, cwd=ROOT, env={**os.environ, "RUSTC_BOOTSTRAP": "1"}, check=True, capture_output=True)
    graph = json.loads(found.stdout)
    units, seen, features = graph["units"], set(), defaultdict(set)
    waiting = [(index, False) for index in graph["roots"]]
    while waiting:
        index, host = waiting.pop()
        unit = units[index]
        host |= bool({"proc-macro", "custom-build"} & set(unit["target"]["kind"])) and unit["mode"] != "run-custom-build"
        if (index, host) in seen:
            continue
        seen.add((index, host))
        if unit["pkg_id"].startswith("registry") and "lib" in unit["target"]["kind"][0]:
            name, version = unit["pkg_id"].rsplit("#", 1)[1].rsplit("@", 1)
            features[name, version, host].add(frozenset(unit["features"]))
        waiting += [(other["index"], host) for other in unit["dependencies"]]
    return features


def section(title, wanted):
    if not wanted:
        return ""
    several = [name for name, _ in wanted]
    rows = []
    for (name, version), features in sorted(wanted.items()):
        twice = several.count(name) > 1
        key = f"{name}-{version.split('.')[0]}-{version.split('.')[1]}" if twice else name
        package = f'package = "{name}", ' if twice else ""
        listed = ", ".join(f'"{feature}"' for feature in sorted(features))
        rows.append(f'{key} = {{ {package}version = "{version}", default-features = false, features = [{listed}] }}\n')
    return f"\n[{title}]\n{''.join(rows)}"


def write():
    head = MANIFEST.read_text().split(MARK)[0]
    wanted = {False: {}, True: {}}  # for the host? -> (name, version) -> features
    while True:
        MANIFEST.write_text(head + MARK + section("dependencies", wanted[False]) + section("build-dependencies", wanted[True]))
        everything = plan("--workspace", "--all-targets")
        more = 0
        for member in members():
            for chosen in (["-p", member], ["-p", member, "--all-targets"]):
                for (name, version, host), found in plan(*chosen).items():
                    whole = everything[name, version, host]
                    if found != whole and (name, version) not in wanted[host]:
                        wanted[host][name, version] = frozenset().union(*whole)
                        more += 1
        print(f"{more} more")
        if not more:
            return


def check():
    """Compares the plan of each member with the workspace's: what has other features there is compiled again."""
    everything = plan("--workspace", "--all-targets")
    again = {}
    for member in members():
        alone = plan("-p", member)
        again[member] = [f"{name} {version}" for (name, version, host), found in alone.items() if not found <= everything[name, version, host]]
    report(again)


def build():
    """Builds each member by itself in a workspace that is built; what Cargo compiles then must be members alone."""
    subprocess.run(["cargo", "build", "--workspace", "--locked", "--quiet"], cwd=ROOT, check=True)
    again = defaultdict(list)
    for member in members():
        command = ["cargo", "build", "--locked", "--quiet", "-p", member, "--message-format", "json"]
        found = subprocess.run(command, cwd=ROOT, check=True, stdout=subprocess.PIPE, text=True).stdout
        again[member] = []
        for line in found.splitlines():
            message = json.loads(line)
            if message["reason"] == "compiler-artifact" and not message["fresh"] and message["package_id"].startswith("registry"):
                again[member].append(message["package_id"].rsplit("#", 1)[1])
    report(again)


def report(again):
    """Says what each member compiles again, and fails where that is something."""
    for member, names in again.items():
        print(f"cargo build -p {member}: {len(names)} dependencies compiled again {' '.join(sorted(names))}")
    if any(again.values()):
        sys.exit("run `python3 scripts/workspace-hack.py --write`, and see that each member depends on workspace-hack")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--write", action="store_true", help="write the manifest anew")
    parser.add_argument("--build", action="store_true", help="check by building")
    asked = parser.parse_args()
    write() if asked.write else build() if asked.build else check()
