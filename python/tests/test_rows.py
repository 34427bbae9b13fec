"""Pairs as rows: the engines' part, without an engine."""

import json
import subprocess
import sys

import numpy as np
import pytest

import srrf

pa = pytest.importorskip("pyarrow")
import pyarrow.parquet as parquet  # noqa: E402

from srrf.ray import RegisterPairs, _list, main  # noqa: E402
from srrf.rows import SCHEMA, PairRegistrar  # noqa: E402

FAST = {"method": "fpfh-ransac"}


@pytest.fixture(scope="module")
def result(cloud, target):
    return srrf.register(cloud, target)


def test_rows_are_those_of_the_programs_batch(cloud, target, tmp_path):
    srrf.write(tmp_path / "a.npy", cloud)
    srrf.write(tmp_path / "b.npy", target)
    srrf.write(tmp_path / "line.xyz", np.outer(np.arange(9.0), [1, 2, 3]))
    rows = [("a.npy", "b.npy", 0.5), ("b.npy", "a.npy", 1.5), ("gone.npy", "a.npy", 2.0), ("line.xyz", "a.npy", 3.0)]
    pairs = pa.table({"source": [r[0] for r in rows], "target": [r[1] for r in rows], "weight": [r[2] for r in rows]})
    parquet.write_table(pairs, tmp_path / "pairs.parquet")
    arguments = ["batch", str(tmp_path / "pairs.parquet"), "-o", "r.parquet", "--method", "fpfh-ransac", "--quiet"]
    run = subprocess.run([sys.executable, "-m", "srrf", *arguments], cwd=tmp_path, capture_output=True, text=True)
    assert run.returncode == 1, run
    of_program = parquet.read_table(tmp_path / "r.parquet")
    here = PairRegistrar(tmp_path, method="fpfh-ransac").table(pairs)
    assert here.schema.names == of_program.schema.names
    for name in SCHEMA.names:
        if name not in ("seconds", "answer"):
            assert here[name].to_pylist() == of_program[name].to_pylist(), name

    def untimed(text):
        answer = json.loads(text)
        answer.pop("seconds", None)
        return json.dumps(answer)

    assert [untimed(a) for a in here["answer"].to_pylist()] == [untimed(a) for a in of_program["answer"].to_pylist()]
    assert here["error"][0].as_py() is None and "gone.npy" in here["error"][2].as_py()
    with pytest.raises(srrf.InputError, match="seconds"):
        PairRegistrar(**FAST).table(pairs.rename_columns(["source", "target", "seconds"]))


def test_rows_take_clouds_however_they_are_nested(cloud, target, result):
    actor = RegisterPairs()
    ragged = np.empty(2, object)
    ragged[:] = [cloud, cloud[:-1]]
    nested = np.empty(2, object)
    nested[:] = [np.array(list(cloud) + [None], object)[:-1], list(cloud[:-1])]
    stacked = np.stack([cloud, cloud])
    for source in (ragged, nested, stacked):
        answers = actor({"id": np.array(["x", "y"]), "source": source, "target": np.stack([target, target])})
        assert answers["id"].to_pylist() == ["x", "y"] and answers["error"].to_pylist() == [None, None]
        assert answers["target_from_source"][0].as_py() == result.target_from_source.ravel().tolist()
    no_name = actor({"source": stacked, "target": stacked})
    assert "`id`" in no_name["error"][0].as_py()


LISTS = {
    "csv": "id,source,target,weight\n007,a.npy,b.npy,0.50\n8,b.npy,a.npy,\n",
    "jsonl": '{"id": "007", "source": "a.npy", "target": "b.npy"}\n{"id": "8", "source": "b.npy", "target": "a.npy"}\n',
}


@pytest.mark.parametrize("ending", LISTS)
def test_lists_of_text_are_read_as_text(ending, tmp_path):
    (tmp_path / f"pairs.{ending}").write_text(LISTS[ending])
    pairs = _list(str(tmp_path / f"pairs.{ending}"))
    assert pairs["id"].to_pylist() == ["007", "8"]
    if ending == "csv":
        assert pairs["weight"].to_pylist() == ["0.50", ""]


@pytest.fixture
def answered(cloud, target, tmp_path):
    """A list of three pairs, one of which has no file, and a folder with their answers as an engine writes them."""
    np.save(tmp_path / "a.npy", cloud)
    np.save(tmp_path / "b.npy", target)
    pairs = pa.table({"source": ["a.npy", "b.npy", "gone.npy"], "target": ["b.npy", "a.npy", "a.npy"]})
    parquet.write_table(pairs, tmp_path / "pairs.parquet")
    (tmp_path / "out").mkdir()
    answers = PairRegistrar(tmp_path, method="icp").table(pairs)
    for part in range(2):
        parquet.write_table(answers.slice(2 * part, 2), tmp_path / "out" / f"{part}.parquet")
    return tmp_path


def run(folder, *switches):
    return main([str(folder / "pairs.parquet"), str(folder / "out"), *switches])


def test_a_run_that_is_done_does_nothing(answered, capsys):
    assert run(answered, "--method", "icp") == 0
    assert "3 pairs, 3 done already" in capsys.readouterr().err


def test_pairs_without_a_pose_are_forgotten_where_that_is_asked(answered, capsys, monkeypatch):
    monkeypatch.setitem(sys.modules, "ray", None)  # the point is reached where an engine is needed
    with pytest.raises(ImportError):
        run(answered, "--method", "icp", "--retry-failed")
    assert "3 pairs, 2 done already" in capsys.readouterr().err
    left = [parquet.read_table(answered / "out" / f"{part}.parquet").num_rows for part in range(2)]
    assert left == [2, 0]


def test_a_list_or_a_folder_that_cannot_be_used_is_said(answered, capsys):
    def said(*switches, code=2):
        assert run(answered, *switches) == code
        return capsys.readouterr().err

    assert "answers by other options" in said("--method", "auto")
    assert "answers by other options" in said("--method", "icp", "--seed", "1")
    assert "magic" in said("--method", "magic")
    assert "whole numbers from 1" in said("--batch-size", "0")
    parquet.write_table(pa.table({"source": ["a.npy"] * 2, "target": ["b.npy"] * 2}), answered / "pairs.parquet")
    assert "`a.npy -> b.npy` stands in it twice" in said()
    parquet.write_table(pa.table({"from": ["a.npy"]}), answered / "pairs.parquet")
    assert "no column ['source', 'target']; it has ['from']" in said()
    parquet.write_table(pa.table({"source": ["a"], "target": ["b"], "seconds": [1.0]}), answered / "pairs.parquet")
    assert "seconds" in said()
    (answered / "pairs.parquet").write_bytes(b"no table")
    assert said().startswith("error: ")
    (answered / "pairs.parquet").unlink()
    assert "pairs.parquet" in said()


def test_options_are_described_as_by_the_program(cloud, target, tmp_path):
    np.save(tmp_path / "a.npy", cloud)
    np.save(tmp_path / "b.npy", target)
    (tmp_path / "pairs.csv").write_text("source,target\na.npy,b.npy\n")
    arguments = ["batch", "pairs.csv", "-o", "r.jsonl", "--method", "icp", "--vertices", "--rotation", "45", "--quiet"]
    subprocess.run([sys.executable, "-m", "srrf", *arguments], cwd=tmp_path, check=True)
    of_program = json.loads((tmp_path / "r.jsonl").read_text())
    here = PairRegistrar(tmp_path, method="icp", vertices=True, rotation=45).row({"source": "a.npy", "target": "b.npy"})
    assert json.loads(here["answer"])["options"] == of_program["options"]
