"""Registration: the answer, its parts, and what it survives."""

import json
import multiprocessing
import os
import pickle
import signal
import subprocess
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from clouds import angle_deg, box, moved
from processes import ended, heard

import srrf

FAST = {"method": "fpfh-ransac"}


@pytest.fixture(scope="module")
def result(cloud, target):
    return srrf.register(cloud, target)


def test_the_pose_is_found_and_the_parts_agree(result, truth, cloud, target):
    pose = result.target_from_source
    assert pose.shape == (4, 4) and pose.dtype == np.float64
    assert angle_deg(pose, truth) < 0.1 and np.allclose(pose[:3, 3], truth[:3, 3], atol=0.01)
    assert result.probability > 0.5 and not result.abstain
    assert np.array_equal(result.rotation, pose[:3, :3]) and np.array_equal(result.translation, pose[:3, 3])
    w, *xyz = result.quaternion_wxyz
    assert np.array_equal(result.quaternion_xyzw, [*xyz, w]) and abs(np.linalg.norm(result.quaternion_wxyz) - 1) < 1e-12
    assert abs(2 * np.degrees(np.arccos(w)) - angle_deg(np.eye(4), pose)) < 1e-6
    assert np.array_equal(result.poses[0].target_from_source, pose)
    assert result.evidence["fitness"] > 0.9 and np.shape(result.evidence["information"]) == (6, 6)
    assert np.allclose(result.transform(cloud), target, atol=0.01)
    assert json.loads(result.to_json()) == result.to_dict()
    pose[0, 0] = 5.0
    assert result.target_from_source[0, 0] != 5.0, "a copy"


def test_the_same_seed_gives_the_same_bytes_on_any_number_of_threads(result, cloud, target):
    for threads in (1, 2):
        again = srrf.register(cloud, target, num_threads=threads)
        assert again == result
        assert again.target_from_source.tobytes() == result.target_from_source.tobytes()


def test_the_program_gives_the_same_bytes(result, cloud, target, tmp_path):
    srrf.write(tmp_path / "a.npy", cloud)
    srrf.write(tmp_path / "b.ply", target)
    program = os.environ.get("SRRF_PROGRAM")
    command = [program, "register"] if program else [sys.executable, "-m", "srrf"]
    arguments = ["a.npy", "b.ply", "--json", "r.json", "-o", "T.txt", "--quiet"]
    assert subprocess.run([*command, *arguments], cwd=tmp_path).returncode == 0
    assert np.loadtxt(tmp_path / "T.txt").tobytes() == result.target_from_source.tobytes()
    written = srrf.Result((tmp_path / "r.json").read_text())
    same = {"seconds": None, "source": None, "target": None}
    assert {**written.to_dict(), **same} == {**result.to_dict(), **same}
    by_path = srrf.register(tmp_path / "a.npy", tmp_path / "b.ply")
    assert by_path.target_from_source.tobytes() == result.target_from_source.tobytes()
    assert by_path.to_dict()["source"].endswith("a.npy")


def test_points_that_are_nan_are_left_out_and_said(result, cloud, target):
    holes = np.insert(cloud, [0, 5, 5], [[np.nan, 0, 0], [0, np.inf, 0], [0, 0, -np.inf]], axis=0)
    with_holes = srrf.register(holes, target)
    assert with_holes.target_from_source.tobytes() == result.target_from_source.tobytes()
    assert with_holes.to_dict()["dropped_points"] == {"source": 3, "target": 0}
    assert any("source: 3 points with NaN or infinity were left out" in w for w in with_holes.warnings)


def test_a_prepared_target_serves_many_sources(result, cloud, target):
    registrar = srrf.Registrar()
    ready = registrar.prepare(target)
    assert len(ready) == len(target) and np.array_equal(ready.points, target)
    assert registrar.register(cloud, ready) == result
    back = pickle.loads(pickle.dumps(ready))
    assert pickle.loads(pickle.dumps(registrar)).register(cloud, back) == result


def test_a_first_guess_is_used_and_checked(cloud, target, truth):
    found = srrf.register(cloud, target, initial=truth, method="given")
    assert angle_deg(found.target_from_source, truth) < 0.1
    for bad, word in [
        (np.eye(3), "shape"),
        (2 * np.eye(4), "last row"),
        (np.diag([2.0, 1, 1, 1]), "not a rigid motion"),
        (np.diag([-1.0, 1, 1, 1]), "mirror"),
        (np.full((4, 4), np.nan), "NaN"),
        (truth.T, "transposed"),
    ]:
        with pytest.raises(srrf.InputError, match=word):
            srrf.register(cloud, target, initial=bad, method="given")


def test_options_that_make_no_sense_are_named(cloud):
    for options, word in [
        ({"method": "magic"}, "fpfh-ransac"),
        ({"rotation": "90"}, "so3"),
        ({"weights": "none.safetensors"}, "none.safetensors"),
        ({"device": "abacus"}, "abacus"),
        ({"seed": -1}, "seed"),
        ({"seed": 0.5}, "seed"),
        ({"abstain_below": 2.0}, "abstain_below"),
        ({"num_threads": 0}, "num_threads"),
        ({"num_threads": 10**9}, "num_threads"),
    ]:
        with pytest.raises(srrf.OptionError, match=word):
            srrf.register(cloud, cloud, **options)
    with pytest.raises(TypeError):
        srrf.register(cloud, cloud, sead=1)


def test_results_pickle_and_draw(result, cloud, target):
    back = pickle.loads(pickle.dumps(result))
    assert back == result and back.to_json() == result.to_json()
    assert result._repr_html_().startswith("<iframe srcdoc=") and "<table>" in back._repr_html_()
    page = result.to_html(unit="m")
    assert page.startswith("<!doctype html>") and back.to_html(cloud, target, unit="m") == page
    with pytest.raises(srrf.InputError, match="to_html"):
        back.to_html()
    assert "probably right" in repr(result)
    for error in (srrf.InputError("a"), srrf.NoPoseError("b"), srrf.MissingFileError("c")):
        assert str(pickle.loads(pickle.dumps(error))) == str(error)


def in_child(registrar, cloud, target):
    return registrar.register(cloud, target)


def by_function(cloud, target):
    return srrf.register(cloud, target)


@pytest.mark.filterwarnings("ignore:.*fork.*:DeprecationWarning")
@pytest.mark.parametrize("way", ["fork", "spawn"])
def test_children_register_too(way, result, cloud, target):
    registrar = srrf.Registrar()
    registrar.register(cloud, target)  # threads run in this process before it forks
    with multiprocessing.get_context(way).Pool(2) as pool:
        answers = pool.starmap(in_child, [(registrar, cloud, target)] * 2, chunksize=1)
        answers.append(pool.apply(by_function, (cloud, target)))
    assert all(answer == result for answer in answers)
    assert registrar.register(cloud, target) == result


def test_threads_share_a_registrar_without_the_lock(cloud, target):
    registrar = srrf.Registrar(**FAST, num_threads=1)
    expected = registrar.register(cloud, target)
    with ThreadPoolExecutor(4) as pool:
        assert all(r == expected for r in pool.map(lambda _: registrar.register(cloud, target), range(8)))
    ticks, done = 0, threading.Event()
    worker = threading.Thread(target=lambda: (registrar.register(box(4000), box(4000)), done.set()))
    worker.start()
    while not done.wait(0.001):
        ticks += 1
    worker.join()
    assert ticks > 0, "another thread ran meanwhile"


LONG = """
import numpy as np, srrf, sys
rng = np.random.default_rng(0)
p = rng.uniform(-1, 1, (40000, 3))
print("ready", flush=True)
try:
    while True:
        srrf.register(p, rng.uniform(-1, 1, (40000, 3)), num_threads=1)
except KeyboardInterrupt:
    print("interrupted", flush=True)
    small = rng.uniform(-1, 1, (200, 3))
    print(srrf.register(small, small, method="icp").target_from_source[0, 0], flush=True)
"""


@pytest.mark.skipif(sys.platform == "win32", reason="no SIGINT to a child")
def test_ctrl_c_ends_a_long_call():
    child = subprocess.Popen([sys.executable, "-c", LONG], stdout=subprocess.PIPE, text=True, preexec_fn=heard)
    assert child.stdout.readline() == "ready\n"
    time.sleep(1.0)
    child.send_signal(signal.SIGINT)
    out = ended(child, 120)
    assert child.returncode == 0 and out.startswith("interrupted\n"), (child.returncode, out)
    assert abs(float(out.splitlines()[1]) - 1) < 1e-6, "the next call works"


def test_no_pose_is_an_error_of_its_own(cloud):
    with pytest.raises(srrf.InputError, match="source.*line"):
        srrf.register(np.outer(np.arange(9.0), [1, 2, 3]), cloud)
    assert issubclass(srrf.NoPoseError, RuntimeError) and issubclass(srrf.OptionError, ValueError)
    assert issubclass(srrf.MissingFileError, (FileNotFoundError, OSError))


def test_far_from_the_origin_nothing_is_lost(cloud, target, truth):
    far = np.array([5e5, 4e6, 100.0])
    found = srrf.register(cloud + far, target + far)
    centre = (cloud + far).mean(axis=0)
    there = found.rotation @ centre + found.translation
    assert np.allclose(there, moved(cloud, truth).mean(axis=0) + far, atol=0.01)
