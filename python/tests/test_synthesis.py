"""Corruptions, the benchmark's pairs, scores, files."""

import os
import pickle
import subprocess
import sys

import numpy as np
import pytest
from clouds import motion, moved

import srrf

SMALL = {"shapes": 2, "corruptions": ["cutout", "gaussian"], "severities": [2, 5], "points": 128, "seed": 3}


def test_the_program_corrupts_the_same_bytes(cloud, tmp_path):
    srrf.write(tmp_path / "a.npy", cloud)
    for kind in srrf.CORRUPTIONS:
        command = [sys.executable, "-m", "srrf", "corrupt", "a.npy", "-o", f"{kind}.npy", "-c", kind, "-s", "4"]
        subprocess.run([*command, "--seed", "9", "--quiet"], cwd=tmp_path, check=True)
        here = srrf.corrupt(cloud, kind, 4, 9, return_origin=True)
        assert np.load(tmp_path / f"{kind}.npy").tobytes() == here.points.tobytes(), kind
        assert here.origin.shape == (len(here.points),) and here.origin.max() < len(cloud) and here.origin.min() >= -1
    assert len(srrf.CORRUPTIONS) == 12


def test_origins_say_where_points_come_from(cloud):
    cut = srrf.corrupt(cloud, "cutout", 3, 1, return_origin=True)
    assert len(cut.points) < len(cloud) and np.allclose(cut.points, cloud[cut.origin], atol=1e-12)
    more = srrf.corrupt(cloud, "upsampling", 1, 1, return_origin=True)
    assert (more.origin == -1).sum() == len(cloud) // 5


def test_what_does_not_exist_is_named(cloud):
    for options, word in [({"kind": "rain"}, "cutout"), ({"kind": "cutout", "severity": 6}, "1, 2, 3, 4 and 5")]:
        with pytest.raises(srrf.OptionError, match=word):
            srrf.corrupt(cloud, **options)
    with pytest.raises(srrf.OptionError, match="whole number"):
        srrf.corrupt(cloud, "cutout", 2.5)
    for options, word in [
        ({"shapes": 0}, "shapes"),
        ({"points": 2}, "3 points"),
        ({"corrupt": "none"}, "both"),
        ({"split": "dev"}, "train"),
        ({"rotation": 400.0}, "max_deg"),
        ({"crop": 2.0}, "crop"),
    ]:
        with pytest.raises(srrf.SrrfError, match=word):
            srrf.pairs(**options)


def test_pairs_are_posed_and_correspond():
    made = srrf.pairs(**SMALL)
    assert len(made) == 2 * (1 + 2 * 2) and "128 points" in made.description
    clean = made[0]
    assert (clean.corruption, clean.severity, clean.source.shape) == ("clean", 0, (128, 3))
    order = np.argsort(clean.source_origin)
    there = moved(clean.source[order], clean.target_from_source)
    assert np.allclose(there, clean.target[np.argsort(clean.target_origin)], atol=1e-12)
    last = made[-1]
    assert (last.corruption, last.severity) == ("gaussian", 5)
    assert np.array_equal(last.source, srrf.pairs(**SMALL)[9].source)
    with pytest.raises(IndexError):
        made[10]


def test_arrays_are_the_pairs_stacked():
    made = srrf.pairs(**SMALL)
    for threads in (1, 2):
        stacked = srrf.pairs(**SMALL, num_threads=threads).arrays()
        assert len(stacked) == len(made) and stacked.source.shape == (10, 128, 3)
        for i, pair in enumerate(made):
            for name in ("source", "target", "target_from_source", "source_origin", "target_origin"):
                assert np.array_equal(getattr(stacked, name)[i], getattr(pair, name)), name
            for name in ("corruption", "severity", "shape", "class_name", "symmetric"):
                assert getattr(stacked, name)[i] == getattr(pair, name), name
    back = pickle.loads(pickle.dumps(made))
    assert np.array_equal(back.arrays([7, 1]).target, stacked.target[[7, 1]])


def test_the_evaluation_exports_the_same_bytes(tmp_path):
    program = os.environ.get("SRRF_EVAL_PROGRAM")
    if not program:
        pytest.skip("SRRF_EVAL_PROGRAM names no srrf-eval")
    command = "--shapes 2 --corruptions clean,cutout,gaussian --severities 2,5 --points 128 --seed 3"
    arguments = [*command.split(), "--export-pairs", str(tmp_path / "pairs.npz")]
    subprocess.run([program, *arguments], check=True, env={k: v for k, v in os.environ.items() if k != "SRRF_DATA"})
    with np.load(tmp_path / "pairs.npz") as file:
        stacked = srrf.pairs(**SMALL).arrays()
        groups = [(c, s) for c, s in zip(stacked.corruption, stacked.severity)]
        for corruption, severity in dict.fromkeys(groups):
            name = corruption if severity == 0 else f"{corruption}_s{severity}"
            rows = [i for i, group in enumerate(groups) if group == (corruption, severity)]
            assert file[f"{name}_x"].tobytes() == stacked.source[rows].tobytes(), name
            assert file[f"{name}_y"].tobytes() == stacked.target[rows].tobytes(), name
            assert np.array_equal(file[f"{name}_R"], stacked.target_from_source[rows][:, :3, :3])
            assert np.array_equal(file[f"{name}_x_origin"], stacked.source_origin[rows])


def test_scores_count_errors_and_failures(cloud):
    true = [motion(10.0, (0, 0, 0)), motion(40.0), np.eye(4)]
    found = [motion(12.0, (0, 0.03, 0)), motion(70.0), None]
    scores = srrf.score(found, true, [(cloud, moved(cloud, pose)) for pose in true])
    assert (scores.pairs, scores.failed) == (3, 1)
    assert np.allclose(scores.rotation_deg, [2, 30, 0], atol=1e-6)
    assert np.allclose(scores.translation, [0.03, 0, 0], atol=1e-12)
    assert abs(scores.mean_rot_deg - 32 / 3) < 1e-6 and abs(scores.median_rot_deg - 2) < 1e-6
    assert abs(scores.recall - 1 / 3) < 1e-12 and abs(scores.right - 1 / 3) < 1e-12
    assert scores.mae_r <= scores.rmse_r == pytest.approx(np.sqrt(scores.mse_r))
    stacked = srrf.score(np.stack(true), np.stack(true))
    assert stacked.recall == 1.0 and stacked.right is None and stacked.rmse_t == 0.0
    with pytest.raises(srrf.InputError, match="3 poses, but 2"):
        srrf.score(found, true[:2])
    with pytest.raises(srrf.InputError, match="not a rigid motion"):
        srrf.score([np.diag([2.0, 1, 1, 1])], true[:1])
    with pytest.raises(srrf.InputError):
        srrf.score([], [])


def test_files_there_and_back(cloud, tmp_path):
    for extension in ("ply", "pcd", "npy", "npz", "xyz", "obj"):
        path = tmp_path / f"a.{extension}"
        srrf.write(path, cloud)
        assert srrf.read(path).tobytes() == cloud.tobytes(), extension
    holes = cloud.copy()
    holes[3, 1] = np.nan
    np.save(tmp_path / "holes.npy", holes)
    assert np.array_equal(srrf.read(tmp_path / "holes.npy"), holes, equal_nan=True)
    with pytest.raises(srrf.InputError, match="1 of them"):
        srrf.write(tmp_path / "b.ply", holes)
    with pytest.raises(srrf.FileError, match="b.doc"):
        srrf.write(tmp_path / "b.doc", cloud)
    (tmp_path / "broken.ply").write_bytes(b"ply\nformat ascii 1.0\nelement vertex 9\nend_header\n")
    with pytest.raises(srrf.FileError, match="broken.ply"):
        srrf.read(tmp_path / "broken.ply")
    assert {"ply", "pcd", "e57", "las"} <= set(srrf.FORMATS)


def test_the_program_keeps_its_exit_codes(cloud, tmp_path):
    def code(*arguments):
        run = subprocess.run([sys.executable, "-m", "srrf", *arguments], cwd=tmp_path, capture_output=True, text=True)
        return run.returncode, run.stdout, run.stderr

    assert code("--version") == (0, f"srrf {srrf.__version__}\n", "")
    assert code("inspect", "none.ply")[0] == 2
    assert code("--bad")[0] == 2
    srrf.write(tmp_path / "a.ply", cloud)
    status, out, _ = code("a.ply", "a.ply")
    assert status == 0 and "probably right" in out
    status, _, err = code("register", "a.ply", "a.ply", "-o", "none/T.txt")
    assert status == 2 and "none" in err and err.startswith("error: ")


def test_pair_dataset_is_the_benchmark():
    torch = pytest.importorskip("torch")
    from srrf.torch import PairDataset

    options = {**SMALL, "split": "test"}
    data = PairDataset(dtype="float64", **options)
    assert len(data) == 10
    expected = srrf.pairs(**options)
    rows = list(data)
    assert sorted(row["index"] for row in rows) == list(range(10))
    for row in rows:
        assert np.array_equal(row["source"].numpy(), expected[row["index"]].source)
        assert np.array_equal(row["target_from_source"].numpy(), expected[row["index"]].target_from_source)
    loader = torch.utils.data.DataLoader(data, batch_size=4, num_workers=2)
    batches = list(loader)
    assert sorted(i for batch in batches for i in batch["index"].tolist()) == list(range(10))
    data.set_epoch(1)
    assert not np.array_equal(next(iter(data))["source"].numpy(), rows[0]["source"].numpy())
    assert next(iter(PairDataset(**SMALL)))["source"].dtype == torch.float32
