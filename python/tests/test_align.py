"""Many scans in one frame."""

import pickle

import numpy as np
import pytest
from clouds import angle_deg, box, motion, moved

import srrf

TRUTH = [np.eye(4), motion(20.0), motion(-35.0, (0.1, 0.5, -0.2))]


@pytest.fixture(scope="module")
def scans():
    """Three scans of one part, each in its own frame: scan ~ truth part."""
    return [moved(box(1500, seed), pose) for seed, pose in enumerate(TRUTH)]


@pytest.fixture(scope="module")
def map_(scans):
    return srrf.align(scans)


def test_scans_lie_in_the_frame_of_the_first(map_):
    assert map_.components == [[0, 1, 2]] and len(map_) == 3 and map_.rivals == []
    assert map_.map_from_scan.shape == (3, 4, 4) and np.array_equal(map_.map_from_scan[0], np.eye(4))
    for scan, truth in zip(map_.scans, TRUTH):
        expected = np.linalg.inv(truth)
        assert angle_deg(scan.map_from_scan, expected) < 0.5, scan
        assert np.allclose(scan.map_from_scan[:3, 3], expected[:3, 3], atol=0.03)
        assert scan.component == 0 and 0.5 < scan.probability <= 1 and not scan.abstain
    assert [scan.name for scan in map_.scans] == ["clouds[0]", "clouds[1]", "clouds[2]"]
    assert {edge["verdict"] for edge in map_.edges} <= {"holds", "contradicts", "unconfirmed", "nothing"}
    assert sum(edge["verdict"] == "holds" for edge in map_.edges) >= 2


def test_first_guesses_and_files(map_, scans, tmp_path):
    paths = []
    for index, scan in enumerate(scans):
        paths.append(tmp_path / f"{index}.npy")
        np.save(paths[-1], scan)
    again = srrf.align(paths)
    assert again.map_from_scan.tobytes() == map_.map_from_scan.tobytes()
    assert again.scans[2].name == str(paths[2])
    shifted = np.eye(4)
    shifted[:3, 3] = (5, 6, 7)
    guesses = [shifted @ np.linalg.inv(truth) for truth in TRUTH]
    guided = srrf.align(scans, initial=guesses)
    assert np.allclose(guided.map_from_scan[0], guesses[0], atol=1e-9)
    assert angle_deg(guided.map_from_scan[2], guesses[2]) < 0.5


def test_a_map_pickles(map_):
    back = pickle.loads(pickle.dumps(map_))
    assert back.to_json() == map_.to_json() and back.to_dict() == map_.to_dict()
    assert "3 scans in components of 3" in repr(back)


def test_what_makes_no_map_is_said(scans):
    for clouds, word in [
        ([], "two or more"),
        (scans[:1], "two or more"),
        ([scans[0], np.zeros((9, 3))], r"clouds\[1\]"),
        ([scans[0], np.zeros((3, 9))], r"clouds\[1\].*transposed"),
        (np.zeros((4, 9, 3)), "list of clouds"),
    ]:
        with pytest.raises(srrf.InputError, match=word):
            srrf.align(clouds)
    with pytest.raises(srrf.InputError, match="2 first guesses, but 3"):
        srrf.align(scans, initial=TRUTH[:2])
    with pytest.raises(srrf.InputError, match=r"initial\[1\]"):
        srrf.align(scans, initial=[None, 2 * np.eye(4), None])
