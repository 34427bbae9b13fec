"""Signals, forks, pickles."""

import copy
import multiprocessing
import os
import pickle
import signal
import subprocess
import sys
import threading
import time

import numpy as np
import pytest
from clouds import box
from processes import ended, heard

import srrf

posix = pytest.mark.skipif(sys.platform == "win32", reason="no SIGINT to a child, no fork")

# Each is far longer than the wait, on any machine.
LONG = {
    "pairs": "for seed in range(1000): srrf.pairs(50, seed=seed).take(range(3000))",
    "align": "srrf.align([rng.uniform(-1, 1, (20000, 3)) for _ in range(40)], num_threads=1)",
    "corrupt": "for _ in range(1000): srrf.corrupt(big, 'distortion_rbf')",
    "prepared": "for target in [ready.prepare(big)] * 1000: ready.register(big, target)",
}


@posix
@pytest.mark.parametrize("name", LONG)
def test_ctrl_c_ends_whatever_runs(name):
    code = (
        "import numpy as np, srrf\n"
        "rng = np.random.default_rng(0)\n"
        "big = rng.uniform(-1, 1, (100000, 3))\n"
        "ready = srrf.Registrar(method='fpfh-ransac')\n"
        "print('ready', flush=True)\n"
        f"try:\n    {LONG[name]}\n    print('done', flush=True)\n"
        "except KeyboardInterrupt:\n    print('interrupted', flush=True)\n"
        "print(srrf.pairs(1, points=8)[0].severity, flush=True)\n"
    )
    child = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True, preexec_fn=heard)
    assert child.stdout.readline() == "ready\n"
    time.sleep(0.7)
    child.send_signal(signal.SIGINT)
    out = ended(child, 120)
    assert child.returncode == 0 and out == "interrupted\n0\n", (child.returncode, out)


@posix
def test_ctrl_c_ends_the_program(tmp_path):
    rng = np.random.default_rng(0)
    for name in ("a", "b"):
        np.save(tmp_path / f"{name}.npy", rng.uniform(-1, 1, (200000, 3)))
    child = subprocess.Popen(
        [sys.executable, "-m", "srrf", "a.npy", "b.npy"],
        cwd=tmp_path,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        preexec_fn=heard,
    )
    time.sleep(2.0)
    child.send_signal(signal.SIGINT)
    ended(child, 120)
    assert child.returncode in (130, -signal.SIGINT), child.returncode


def in_child(registrar, ready, source):
    return registrar.register(source, ready).to_dict()["target_from_source"]


def of_pairs(made):
    return made.arrays().source


@pytest.mark.filterwarnings("ignore:.*fork.*:DeprecationWarning")
@pytest.mark.parametrize("way", [way for way in ("fork", "spawn", "forkserver") if way in multiprocessing.get_all_start_methods()])
def test_children_take_all_objects(way, cloud, target):
    registrar = srrf.Registrar(method="fpfh-ransac", num_threads=2)
    ready = registrar.prepare(target)
    expected = registrar.register(cloud, ready).to_dict()["target_from_source"]
    made = srrf.pairs(2, corruptions=["shear"], severities=[1], points=64, num_threads=2)
    stacked = made.arrays().source
    with multiprocessing.get_context(way).Pool(2) as pool:
        answers = pool.starmap(in_child, [(registrar, ready, cloud)] * 3, chunksize=1)
        arrays = pool.map(of_pairs, [made, made], chunksize=1)
    assert answers == [expected] * 3 and all(np.array_equal(found, stacked) for found in arrays)


@posix
@pytest.mark.filterwarnings("ignore:.*fork.*:DeprecationWarning")
def test_a_fork_while_another_thread_registers(cloud, target):
    registrar = srrf.Registrar(method="fpfh-ransac", num_threads=2)
    expected = registrar.register(cloud, target)
    stop = threading.Event()

    def work():
        while not stop.is_set():
            registrar.register(box(3000), box(3000, seed=4))

    worker = threading.Thread(target=work)
    worker.start()
    try:
        for _ in range(3):
            child = os.fork()
            if child == 0:
                status = 1
                try:
                    status = 0 if registrar.register(cloud, target) == expected else 2
                finally:
                    os._exit(status)
            assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 0
    finally:
        stop.set()
        worker.join()


def test_whatever_is_answered_pickles(cloud, target, tmp_path):
    made = srrf.pairs(1, corruptions=["cutout"], severities=[2], points=64)
    found = srrf.register(cloud, target, method="icp")
    srrf.write(tmp_path / "a.ply", cloud)
    for thing in (
        srrf.corrupt(cloud, "cutout", return_origin=True),
        made[0],
        made.arrays(),
        srrf.score([found], [np.eye(4)]),
        found.poses[0],
        srrf.align([cloud, target], method="icp").scans[0],
        srrf.scans(tmp_path / "a.ply")[0],
    ):
        for back in (pickle.loads(pickle.dumps(thing)), copy.deepcopy(thing)):
            assert type(back) is type(thing)
            for name, value in vars(thing).items():
                assert np.array_equal(getattr(back, name), value), (thing, name)
    assert copy.copy(found) == found == copy.deepcopy(found)
    for protocol in range(pickle.HIGHEST_PROTOCOL + 1):
        assert pickle.loads(pickle.dumps(found, protocol)) == found
    for error in (srrf.InputError("a"), srrf.OptionError("b"), srrf.FileError("c"), srrf.InternalError("d")):
        back = pickle.loads(pickle.dumps(error))
        assert type(back) is type(error) and str(back) == str(error)


def test_a_target_from_a_pickle_says_the_same(cloud, target):
    registrar = srrf.Registrar(method="icp")
    holes = np.insert(target, 3, np.nan, axis=0)
    ready = registrar.prepare(holes, name="map")
    back = pickle.loads(pickle.dumps(ready))
    assert registrar.register(cloud, back) == registrar.register(cloud, ready)
    assert registrar.register(cloud, back).to_dict()["dropped_points"] == {"source": 0, "target": 1}
    assert "map" in repr(back) and len(back) == len(target)
