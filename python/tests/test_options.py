"""Options that make no sense are refused by name."""

import numpy as np
import pytest

import srrf


@pytest.mark.parametrize(
    ("options", "word"),
    [
        ({"num_threads": True}, "num_threads is True"),
        ({"num_threads": 1.5}, "num_threads is 1.5"),
        ({"seed": True}, "seed is True"),
        ({"seed": 2**64}, "2\\*\\*64 - 1"),
        ({"method": None}, "method is None: expected text"),
        ({"rotation": 60}, "`60`"),
        ({"refine": "no"}, "refine is 'no': expected True or False"),
        ({"vertices": 1}, "vertices is 1"),
        ({"abstain_below": "half"}, "abstain_below is 'half'"),
        ({"abstain_below": float("nan")}, "abstain_below"),
        ({"weights": 3}, "weights is 3"),
        ({"weights": "srrf-small"}, "safetensors"),
    ],
)
def test_of_a_registration(options, word, cloud):
    with pytest.raises(srrf.OptionError, match=word):
        srrf.register(cloud, cloud, **options)


def test_numbers_of_numpy_are_numbers(cloud, target):
    expected = srrf.register(cloud, target, method="icp", rotation="45", seed=3, num_threads=1)
    for rotation in (45, 45.0, np.float64(45), np.int64(45)):
        found = srrf.register(
            cloud, target, method="icp", rotation=rotation, seed=np.uint8(3), refine=np.True_, num_threads=np.int32(1)
        )
        assert found == expected


@pytest.mark.parametrize(
    ("options", "word"),
    [
        ({"corruptions": "cutout"}, r"corruptions is 'cutout': expected a list"),
        ({"corruptions": [3]}, "corruptions is 3: expected text"),
        ({"severities": 3}, "severities is 3: expected a list"),
        ({"severities": [1.0]}, "severity is 1.0"),
        ({"severities": [10**30]}, "severity"),
        ({"corruptions": [], "clean": False}, "no pairs"),
        ({"clean": "yes"}, "clean is 'yes'"),
        ({"shapes": 10**12}, "shapes is 1000000000000: expected a whole number from 1 to"),
        ({"points": 10**12}, "points is 1000000000000: expected a whole number from 1 to"),
        ({"rotation": "so2"}, "rotation is 'so2'"),
        ({"rotation": float("nan")}, "max_deg"),
        ({"translation": None}, "translation is None"),
        ({"num_threads": 0}, "num_threads"),
        ({"sampling": "both"}, "independent"),
        ({"normalize": 1}, "normalize is 1: expected text"),
    ],
)
def test_of_pairs(options, word):
    with pytest.raises(srrf.OptionError, match=word):
        srrf.pairs(**options)


def test_of_a_corruption(cloud):
    for options, word in [
        ({"kind": 3}, "kind is 3"),
        ({"kind": "cutout", "severity": "3"}, "severity is '3'"),
        ({"kind": "cutout", "seed": -1}, "seed is -1"),
        ({"kind": "cutout", "reading": "other"}, "modelnet40_c"),
    ]:
        with pytest.raises(srrf.OptionError, match=word):
            srrf.corrupt(cloud, **options)


def test_pairs_are_chosen_as_in_numpy():
    made = srrf.pairs(3, corruptions=["uniform", "shear"], severities=[1, 4], points=64)
    assert len(made) == 15
    mask = np.zeros(15, bool)
    mask[[2, 11]] = True
    for chosen in ([2, 11], [2, -4], mask, mask.tolist(), np.array([2, 11], np.uint8), range(2, 12, 9), (2, np.int64(11))):
        assert np.array_equal(made.arrays(chosen).source, np.stack([made[2].source, made[11].source])), chosen
        assert [pair.corruption for pair in made.take(chosen)] == ["clean", "shear"], chosen
    assert made.arrays([]).source.shape[0] == 0 and made.take([]) == []
    for chosen, error in [([15], IndexError), ([-16], IndexError), ([True], IndexError), ([1.0], TypeError), ([[1]], TypeError)]:
        with pytest.raises(error):
            made.take(chosen)
        with pytest.raises(error):
            made.arrays(chosen)
    for index in ("a", 1.0, None):
        with pytest.raises(TypeError, match="whole number or a slice"):
            made[index]


def test_pairs_that_no_machine_holds_are_refused():
    made = srrf.pairs(1_000_000, points=100_000)
    assert len(made) == 61_000_000 and (made[-1].shape, made[60_999_999].severity) == (made[999_999].shape, 5)
    with pytest.raises(srrf.InputError, match="memory"):
        made.arrays(range(100_000_000 // 1000))


def test_scores_say_which_pair_is_wrong(cloud):
    pose = np.eye(4)
    found = srrf.register(cloud, cloud, method="icp")
    assert srrf.score([found, None, np.full((4, 4), np.nan)], [pose] * 3).failed == 2
    assert srrf.score(iter([pose]), iter([pose])).recall == 1.0
    for arguments, word in [
        ((pose, pose), "poses: one pose"),
        ((found, [pose]), "poses: one pose"),
        (([pose], [pose], [cloud]), r"clouds\[0\]: expected the source and the target"),
        (([pose], [pose], [(cloud, cloud[:, :2])]), r"clouds\[0\]\[1\]"),
        (([pose[:3]], [pose]), r"poses\[0\].*\(4, 4\)"),
        (([pose], [None]), r"truth\[0\]"),
    ]:
        with pytest.raises(srrf.InputError, match=word):
            srrf.score(*arguments)


def test_a_result_is_a_first_guess(cloud, target):
    first = srrf.register(cloud, target)
    again = srrf.register(cloud, target, initial=first, method="given")
    by_matrix = srrf.register(cloud, target, initial=first.target_from_source.tolist(), method="given")
    assert again == by_matrix
    for bad in ("T.txt", np.eye(4)[None], {}):
        with pytest.raises(srrf.InputError, match="initial"):
            srrf.register(cloud, target, initial=bad)


def test_many_scans_are_a_list(cloud):
    for bad in (None, 5, {"a": cloud, "b": cloud}, b"ab", cloud):
        with pytest.raises(srrf.InputTypeError, match="list of clouds"):
            srrf.align(bad)
    with pytest.raises(srrf.OptionError, match="sequence is 'yes'"):
        srrf.align([cloud, cloud], method="icp", sequence="yes")
