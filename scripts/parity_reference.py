#!/usr/bin/env python3
"""Reference values of the SRRF network from an implementation that shares no code with it.

    python3 scripts/parity_reference.py crates/srrf-model/tests/fixtures/parity.json

Needs torch and numpy, takes a few seconds. The network is in `reference_network.py`, beside this
file; here each of its parts, then the whole, is run on drawn numbers, and inputs, outputs and
gradients are written down. `crates/srrf-model/tests/parity/main.rs` compares them with the crate's.
"""

import json
import sys

import torch
from reference_network import (
    BRANCH,
    PARAMETERS,
    Numbers,
    branch,
    chamfer,
    correspondence_loss,
    fnv,
    fuse,
    pfi,
    posed,
    registration_loss,
    rigid_fit,
    sem,
    sfe,
    skeleton_losses,
    soft_matches,
)

CONFIG = {
    "sem": {
        "levels": [
            {"points": 23, "neighbours": 6, "widths": [5, 7]},
            {"points": 15, "neighbours": 5, "widths": [9]},
        ],
        "global": 4,
        "head": [8, 6],
        "skeleton_points": 11,
        "logit_scale": 15.0,
    },
    "dense": {
        "tokens": 17,
        "sfe": {"layers": 2, "neighbours": 5, "width": 6, "heads": 3, "mlp": 10},
        "pfi": {"blocks": 2, "heads": 4, "feed_forward": 14, "position_hidden": 7, "squeeze": 4},
    },
    "skeleton": {
        "tokens": 0,
        "sfe": {"layers": 3, "neighbours": 4, "width": 8, "heads": 2, "mlp": 5},
        "pfi": {"blocks": 1, "heads": 8, "feed_forward": 9, "position_hidden": 5, "squeeze": 16},
    },
    "integration": {
        "test": "nearest",
        "dense_threshold": 0.2,
        "skeleton_threshold": 0.15,
        "sharpness": 2.0,
    },
}
LOSS = {"point_to_sphere": 0.3, "radius": 0.4, "distribution": 0.25, "index_match": 0.15}
BATCH, POINTS, PHASE = 2, 37, 0.5


# ---------------------------------------------------------------- the fixture

OUT = {}


def keep(name, value):
    """Writes down a tensor, or a scalar as shape [1]."""
    value = torch.as_tensor(value, dtype=torch.float64).detach()
    value = value.reshape(1) if value.ndim == 0 else value
    OUT[name] = {
        "shape": list(value.shape),
        "data": [float(f"{v:.13g}") for v in value.flatten().tolist()],
    }


def keep_gradients(name, loss, **inputs):
    """The gradient for each input, and for each parameter of the graph two numbers that stand for
    its gradient: the norm, and the product with a direction drawn from the hash of its path and `.direction`."""
    for tensor in (*inputs.values(), *PARAMETERS.values()):
        tensor.grad = None
    loss.backward()
    for key, tensor in inputs.items():
        keep(f"{name}.gradient.{key}", tensor.grad)
    found = {}
    for path, tensor in sorted(PARAMETERS.items()):
        if tensor.grad is not None:
            direction = Numbers(fnv(path + ".direction")).tensor(*tensor.shape)
            found[path] = [float(tensor.grad.norm()), float((tensor.grad * direction).sum())]
    OUT[f"{name}.gradient.parameters"] = found


def weighed(numbers, *tensors):
    """A scalar in which every number counts: sum of signed * value."""
    return sum((numbers.tensor(*t.shape) * t).sum() for t in tensors)


def rotations(numbers, count):
    """Rotations from drawn quaternions."""
    found = []
    for _ in range(count):
        w, x, y, z = (numbers.tensor(4) + torch.tensor([2.0, 0.0, 0.0, 0.0])).tolist()
        n = w * w + x * x + y * y + z * z
        found.append([
            [1 - 2 * (y * y + z * z) / n, 2 * (x * y - w * z) / n, 2 * (x * z + w * y) / n],
            [2 * (x * y + w * z) / n, 1 - 2 * (x * x + z * z) / n, 2 * (y * z - w * x) / n],
            [2 * (x * z - w * y) / n, 2 * (y * z + w * x) / n, 1 - 2 * (x * x + y * y) / n],
        ])
    return torch.tensor(found)


def inputs(seed):
    """Clouds of a batch with their true poses: the target is the posed source with 10% noise."""
    numbers = Numbers(seed)
    source = numbers.tensor(BATCH, POINTS, 3) * torch.tensor([1.0, 0.7, 0.4])
    rotation = rotations(numbers, BATCH)
    translation = numbers.tensor(BATCH, 3) * 0.2
    target = posed(source, rotation, translation) + 0.1 * numbers.tensor(BATCH, POINTS, 3)
    rounded = [t.to(torch.float32).to(torch.float64) for t in (source, target, rotation, translation)]
    return [rounded[0].requires_grad_(), rounded[1].requires_grad_(), *rounded[2:]]


def part_sem():
    source, target, _, _ = inputs(1)
    clouds = torch.cat([source, target]).detach().requires_grad_()
    skeleton, radii, weights, samples = sem("sem", CONFIG["sem"], clouds)
    for key, value in (("clouds", clouds), ("points", skeleton), ("radii", radii), ("weights", weights),
                       ("samples", samples)):
        keep(f"sem.{key}", value)
    keep_gradients("sem", weighed(Numbers(2), skeleton, radii, weights), clouds=clouds)


def part_losses():
    source, target, rotation, translation = inputs(3)
    numbers = Numbers(4)
    skeletons = (numbers.tensor(2 * BATCH, 11, 3) * 0.5).requires_grad_()
    radii = (0.2 + 0.1 * numbers.tensor(2 * BATCH, 11)).requires_grad_()
    for key, value in (("source", source), ("target", target), ("rotation", rotation), ("translation", translation),
                       ("skeletons", skeletons), ("radii", radii)):
        keep(f"losses.{key}", value)
    losses = skeleton_losses(LOSS, source, target, skeletons, radii, rotation, translation)
    for index, (key, value) in enumerate(losses.items()):
        keep(f"losses.{key}", value)
        gradients = torch.autograd.grad(value, (skeletons, radii), retain_graph=True, allow_unused=True)
        for name, gradient in zip(("skeletons", "radii"), gradients):
            if gradient is not None:
                keep(f"losses.{key}.gradient.{name}", gradient)
    pretraining = chamfer(skeletons, torch.cat([source, target]))
    keep("losses.chamfer", pretraining)
    keep("losses.chamfer.gradient.skeletons", torch.autograd.grad(pretraining, skeletons)[0])


def part_sfe():
    source, _, _, _ = inputs(5)
    tokens = source.detach()[:, 3:20] + 0.01 * Numbers(6).tensor(BATCH, 17, 3)
    config = CONFIG["dense"]["sfe"]
    features = torch.stack([sfe("dense.sfe", config, t, c) for t, c in zip(tokens, source)])
    for key, value in (("tokens", tokens), ("cloud", source), ("features", features)):
        keep(f"sfe.{key}", value)
    keep_gradients("sfe", weighed(Numbers(7), features), cloud=source)  # tokens only choose neighbours


def part_pfi():
    numbers = Numbers(8)
    features = numbers.tensor(2 * BATCH, 13, 12).requires_grad_()
    points = numbers.tensor(2 * BATCH, 13, 3).requires_grad_()
    pairs = [
        pfi("dense.pfi", CONFIG["dense"]["pfi"], features[i], points[i], features[BATCH + i], points[BATCH + i])
        for i in range(BATCH)
    ]
    phi = torch.stack([pair[0] for pair in pairs] + [pair[1] for pair in pairs])
    for key, value in (("features", features), ("points", points), ("phi", phi)):
        keep(f"pfi.{key}", value)
    keep_gradients("pfi", weighed(Numbers(9), phi), features=features, points=points)


def part_head():
    """Soft matching of 11 source points with 13 target points, and the SVD."""
    numbers = Numbers(10)
    source_features = numbers.tensor(BATCH, 11, 7).requires_grad_()
    target_features = numbers.tensor(BATCH, 13, 7).requires_grad_()
    source_points = numbers.tensor(BATCH, 11, 3).requires_grad_()
    target_points = numbers.tensor(BATCH, 13, 3).requires_grad_()
    named = {
        "source_features": source_features,
        "target_features": target_features,
        "source_points": source_points,
        "target_points": target_points,
    }
    matches, probabilities, rotation, translation = [], [], [], []
    for i in range(BATCH):
        found = soft_matches("dense.matching", source_features[i], target_features[i], target_points[i])
        pose = rigid_fit(source_points[i], found[0])
        for to, value in zip((matches, probabilities, rotation, translation), (*found, *pose)):
            to.append(value)
    found = {"matches": matches, "probabilities": probabilities, "rotation": rotation, "translation": translation}
    found = {key: torch.stack(value) for key, value in found.items()}
    for key, value in (*named.items(), *found.items()):
        keep(f"head.{key}", value)
    keep_gradients("head", weighed(Numbers(11), *found.values()), **named)


def whole():
    source, target, rotation, translation = inputs(16)
    skeletons, radii, weights, samples = sem("sem", CONFIG["sem"], torch.cat([source, target]))
    stopped = skeletons.detach()  # the gradient stop
    skeleton = branch("skeleton", CONFIG["skeleton"], stopped[:BATCH], stopped[BATCH:], PHASE)
    dense = branch("dense", CONFIG["dense"], source, target, PHASE)
    fused_rotation, fused_translation, gammas, lambdas = fuse(
        CONFIG["integration"], dense, skeleton, source, target)

    for key, value in (("source", source), ("target", target), ("rotation", rotation), ("translation", translation),
                       ("skeletons", skeletons), ("radii", radii), ("gammas", gammas), ("lambda", lambdas),
                       ("fused.rotation", fused_rotation), ("fused.translation", fused_translation)):
        keep(f"whole.{key}", value)
    for name, found in (("dense", dense), ("skeleton", skeleton)):
        for key in BRANCH[:5]:
            keep(f"whole.{name}.{key}", found[key])

    losses = {"skeleton_loss": skeleton_losses(LOSS, source, target, skeletons, radii, rotation, translation)["total"]}
    for name, found in (("dense", dense), ("skeleton", skeleton)):
        losses[f"{name}.registration"] = registration_loss(
            found["rotation"], found["translation"], rotation, translation)
        losses[f"{name}.correspondence"] = correspondence_loss(
            found["source_points"], found["matches"], rotation, translation)
    losses["fused.registration"] = registration_loss(fused_rotation, fused_translation, rotation, translation)
    for key, value in losses.items():
        keep(f"whole.{key}", value)
    keep_gradients("whole", sum(losses.values()), source=source, target=target)


def main():
    OUT.update(config=CONFIG, loss=LOSS, phase=PHASE)
    for part in (part_sem, part_losses, part_sfe, part_pfi, part_head, whole):
        part()
    OUT["parameters"] = {path: list(tensor.shape) for path, tensor in sorted(PARAMETERS.items())}
    with open(sys.argv[1], "w") as file:
        file.write("{\n" + ",\n".join(f"{json.dumps(k)}: {json.dumps(v, separators=(',', ':'))}" for k, v in OUT.items()))
        file.write("\n}\n")


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    main()
