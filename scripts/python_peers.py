#!/usr/bin/env python3
"""Figures of the Python package beside those of its peers.

    python3 scripts/python_peers.py --wheel FILE

Installs each into a clean virtual environment outside the checkout and prints one table (Markdown): the size that
installing adds (with all that it asks for), the processor's seconds of a fresh process that imports it (median of 8), whether objects
and results pickle, and whether it has types. Needs the network for the peers.
"""

import argparse
import os
import resource
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

# NumPy by name: without it small_gicp 1.0.1 does not import, and it does not ask for it.
PEERS = {
    "srrf": ([], "srrf"),
    "Open3D 0.20.0": (["open3d==0.20.0"], "open3d"),
    "small_gicp 1.0.1": (["small-gicp==1.0.1", "numpy"], "small_gicp"),
    "kiss-matcher 1.0.2": (["kiss-matcher==1.0.2", "numpy"], "kiss_matcher"),
}
# Makes the object that registers, and an answer.
MAKE = {
    "srrf": "import srrf; made = srrf.Registrar(method='icp'); answer = made.register(p, p)",
    "open3d": "import open3d as o3d; c = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(p)); made = c;"
    " answer = o3d.pipelines.registration.registration_icp(c, c, 0.1)",
    "small_gicp": "import small_gicp; made = small_gicp.PointCloud(p); answer = small_gicp.align(p, p)",
    "kiss_matcher": "import kiss_matcher; made = kiss_matcher.KISSMatcher(kiss_matcher.KISSMatcherConfig(0.1));"
    " answer = made.estimate(list(p.astype('float32')), list(p.astype('float32')))",
}
PICKLE = """
import pickle
import numpy as np
p = np.random.default_rng(0).uniform(0, 1, (500, 3))
{make}
def pickles(thing):
    try:
        pickle.loads(pickle.dumps(thing))
        return "yes"
    except Exception as error:
        return "no"
print(pickles(made), pickles(answer))
"""


def size(folder):
    return sum(f.lstat().st_size for f in Path(folder).rglob("*") if f.is_file() and not f.is_symlink())


def cpu(command):
    """The processor's seconds of a command: other work on the machine disturbs them little."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def measure(name, requirements, module, folder):
    subprocess.run([sys.executable, "-m", "venv", folder], check=True)
    python = str(Path(folder) / "bin/python")
    site = subprocess.run([python, "-c", "import sysconfig; print(sysconfig.get_path('purelib'))"], check=True,
                          capture_output=True, text=True).stdout.strip()
    empty = size(site)
    subprocess.run([python, "-m", "pip", "install", "--quiet", "--disable-pip-version-check", "--no-compile",
                    "--only-binary", ":all:", *requirements], check=True)
    with_all = size(site) - empty
    own = sum(size(Path(site) / entry) for entry in os.listdir(site) if entry.replace("-", "_").startswith(module))
    seconds = [statistics.median(cpu([python, "-c", f"import {what}"]) for _ in range(8)) for what in (module, "numpy")]
    run = subprocess.run([python, "-c", PICKLE.format(make=MAKE[module])], capture_output=True, text=True)
    pickles = run.stdout.split() if run.returncode == 0 else ["?", "?"]
    if run.returncode:
        print(run.stderr.strip().splitlines()[-1], file=sys.stderr)
    package = Path(site) / module
    stubs = any(Path(site).glob(f"{module}*/**/py.typed")) or any(Path(site).glob(f"{module}*/**/*.pyi"))
    return (name, own / 1e6, with_all / 1e6, *seconds, *pickles[-2:],
            "yes" if stubs else "no")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--wheel", required=True)
    parser.add_argument("--only", help="one of them, such as kiss_matcher")
    arguments = parser.parse_args()
    wheel = arguments.wheel
    print("| | package, MB | with all it asks for, MB | import, CPU s | NumPy alone, CPU s | object pickles | answer pickles | types |")
    print("|---|---|---|---|---|---|---|---|")
    for name, (requirements, module) in PEERS.items():
        if arguments.only not in (None, module):
            continue
        with tempfile.TemporaryDirectory() as folder:
            row = measure(name, requirements or [wheel], module, folder)
        print("| {} | {:.1f} | {:.1f} | {:.2f} | {:.2f} | {} | {} | {} |".format(*row), flush=True)


if __name__ == "__main__":
    main()
