"""The benchmark's pairs for PyTorch."""

import pickle

import numpy as np
import pytest

import srrf

torch = pytest.importorskip("torch")
from srrf.torch import PairDataset, collate  # noqa: E402

OPTIONS = {"corruptions": ["gaussian", "shear"], "severities": [2], "points": 96, "seed": 7}


def by_index(dataset):
    return {item["index"]: item for item in dataset}


def test_the_bytes_are_those_of_the_benchmark():
    dataset = PairDataset(5, dtype="float64", **OPTIONS)
    expected = srrf.pairs(5, split="train", **OPTIONS)
    items = by_index(dataset)
    assert len(dataset) == len(expected) == 5 * 3 == len(items)
    for index, pair in enumerate(expected):
        for name in ("source", "target", "target_from_source"):
            tensor = items[index][name]
            assert tensor.dtype == torch.float64 and tensor.numpy().tobytes() == getattr(pair, name).tobytes(), name
        assert (items[index]["corruption"], items[index]["severity"]) == (pair.corruption, pair.severity)


def test_single_precision_is_the_default_and_only_rounds():
    exact, single = by_index(PairDataset(2, dtype="float64", **OPTIONS)), by_index(PairDataset(2, **OPTIONS))
    assert single[3]["source"].dtype == torch.float32
    assert torch.equal(single[3]["source"], exact[3]["source"].to(torch.float32))


def test_the_order_is_drawn_and_the_same_each_time():
    dataset = PairDataset(8, **OPTIONS)
    order = [item["index"] for item in dataset]
    assert sorted(order) == list(range(24)) and order != sorted(order)
    assert [item["index"] for item in dataset] == order
    assert [item["index"] for item in pickle.loads(pickle.dumps(dataset))] == order


def test_epochs_have_draws_of_their_own():
    dataset = PairDataset(2, **OPTIONS)
    first = by_index(dataset)
    dataset.set_epoch(1)
    second = by_index(dataset)
    assert not torch.equal(first[0]["source"], second[0]["source"])
    of_seed = srrf.pairs(2, split="train", **{**OPTIONS, "seed": 8})
    assert np.allclose(second[0]["source"].numpy(), of_seed[0].source, atol=1e-6)
    dataset.set_epoch(0)
    assert torch.equal(by_index(dataset)[0]["source"], first[0]["source"])


@pytest.mark.parametrize("workers", [0, 2])
def test_workers_share_the_pairs_without_overlap(workers):
    dataset = PairDataset(4, **OPTIONS)
    loader = torch.utils.data.DataLoader(dataset, batch_size=4, num_workers=workers)
    alone = by_index(dataset)
    seen = []
    for batch in loader:
        size = len(batch["index"])  # the last one of a worker may be smaller
        assert batch["source"].shape == (size, 96, 3) and batch["target_from_source"].shape == (size, 4, 4)
        for place, index in enumerate(batch["index"].tolist()):
            assert torch.equal(batch["target"][place], alone[index]["target"])
            seen.append(index)
    assert sorted(seen) == list(range(12))


def test_clouds_of_several_sizes_come_as_a_list():
    items = list(PairDataset(2, **OPTIONS))[:3]
    assert collate(items)["source"].shape == (3, 96, 3)
    items[1] = {**items[1], "source": items[1]["source"][:81]}
    batch = collate(items)
    assert [len(cloud) for cloud in batch["source"]] == [96, 81, 96] and isinstance(batch["source"], list)
    assert batch["target"].shape == (3, 96, 3) and batch["target_from_source"].shape == (3, 4, 4)


def test_corrupted_clouds_have_as_many_points_as_asked_for():
    dataset = PairDataset(2, corruptions=["cutout", "upsampling"], severities=[3], points=96, seed=7)
    (batch,) = torch.utils.data.DataLoader(dataset, batch_size=8)
    assert batch["source"].shape == batch["target"].shape == (6, 96, 3)


def test_options_that_make_no_sense_are_named():
    with pytest.raises(srrf.OptionError, match="whole number"):
        PairDataset(0)
    with pytest.raises(srrf.OptionError, match="rain"):
        PairDataset(2, corruptions=["rain"])
