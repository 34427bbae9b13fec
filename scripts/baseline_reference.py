#!/usr/bin/env python3
"""Reference values of the learned baselines from an implementation that shares no code with them.

    python3 scripts/baseline_reference.py crates/srrf-baselines/tests/fixtures/parity.json

Needs torch, numpy and scipy, takes a few seconds. Plain PyTorch in float64, clouds one by one, after the
papers and the documentation of crates/srrf-baselines. Parameters are made on both sides, as
`reference_network.py` says, which also lends its neighbours, attention and SVD.
`crates/srrf-baselines/tests/parity.rs` compares poses, losses and gradients with the crate's.
"""

import json
import math
import sys

import torch
from reference_network import (
    PARAMETERS,
    Numbers,
    attention,
    even_subsample,
    feed_forward,
    fnv,
    linear,
    neighbours,
    norm,
    parameter,
    proper_rotation,
)
from scipy.optimize import linear_sum_assignment
from torch.nn.functional import binary_cross_entropy, group_norm, silu, softmax

BATCH, POINTS, PHASE = 2, 37, 0.5
GROUPS = 8

CONFIGS = {
    "dcp_v1": {"version": "v1", "tokens": 0, "neighbours": 5, "widths": [8, 12], "width": 16, "heads": 4,
               "feed_forward": 20},
    "dcp_v2": {"version": "v2", "tokens": 29, "neighbours": 6, "widths": [8, 12], "width": 16, "heads": 4,
               "feed_forward": 20},
    "pointnetlk_differences": {"points": 0, "widths": [9, 14, 33], "jacobian": "finite_difference", "iterations": 2,
                               "test_iterations": 3},
    "pointnetlk_analytic": {"points": 31, "widths": [9, 14, 33], "jacobian": "analytic", "iterations": 2,
                            "test_iterations": 3},
    "panet": {"tokens": 23, "scales": [7, 4], "widths": [8, 12], "width": 16, "head": [14, 10], "iterations": 2},
    "rgm": {"tokens": 0, "neighbours": 5, "widths": [8, 12], "width": 12, "heads": 4, "feed_forward": 18,
            "layers": 2, "sinkhorn": 7, "match_radius": 0.2, "iterations": 2},
    "equi_gspr": {"tokens": 37, "feature_radius": 0.5, "neighbours": 6, "layers": 2, "width": 8, "kept": 37,
                  "head": [7], "match_radius": 0.2},
}
LOSSES = {
    "dcp": {"registration": 1.0},
    "pointnetlk": {"residual": 0.7, "pose": 16.0},
    "panet": {"points": 1.5},
    "rgm": {"assignment": 1.0},
    "equi_gspr": {"rotation": 1.0, "translation": 0.8, "scores": 1.2, "similarity": 0.6},
}
OUT = {}


# ---------------------------------------------------------------- parts


def block(path, x, outputs):
    """Linear, group norm over the rows of one cloud, ReLU."""
    x = linear(f"{path}.linear", x, outputs)
    groups = max(g for g in range(1, min(GROUPS, outputs) + 1) if outputs % g == 0)
    gamma, beta = (parameter(f"{path}.norm.{name}", outputs) for name in ("gamma", "beta"))
    return torch.relu(group_norm(x.T[None], groups, gamma, beta, 1e-5)[0].T)


def tokens_of(count, cloud):
    return cloud if count in (0, len(cloud)) else cloud[even_subsample(cloud, count, PHASE)]


def dgcnn(path, config, tokens, cloud):
    k = config["neighbours"]
    near = cloud[neighbours(tokens, cloud, k)]  # [n, k, 3]
    x = torch.cat([near, tokens[:, None].expand(-1, k, -1)], dim=2).reshape(-1, 6)
    levels = []
    for index, width in enumerate(config["widths"]):
        x = block(f"{path}.layers.{index}", x, width)
        levels.append(x.reshape(len(tokens), k, width).amax(1))
    levels = torch.cat(levels, dim=1)
    return block(f"{path}.joint", levels, config["width"]), levels


def attending(path, x, memory, heads):
    normal = norm(f"{path}.norm", x)
    return x + attention(f"{path}.attention", normal, normal if memory is None else memory, heads)


def phi(path, own, other, heads, hidden):
    """Encoder on the other cloud, decoder on the own one, norms in front."""

    def mlp(name, x):
        return x + feed_forward(f"{path}.{name}", norm(f"{path}.{name}_norm", x), hidden)

    memory = mlp("encoder_mlp", attending(f"{path}.encoder_attention", other, None, heads))
    memory = norm(f"{path}.encoder_norm", memory)
    x = attending(f"{path}.decoder_attention", own, None, heads)
    x = attending(f"{path}.decoder_cross", x, memory, heads)
    return norm(f"{path}.decoder_norm", mlp("decoder_mlp", x))


def fit(source, target, weights=None):
    """Weighted least squares; R = V diag(1, 1, det) U^T."""
    n = len(source)
    weights = torch.full((n,), 1.0 / n) if weights is None else weights
    x, y = weights @ source, weights @ target
    cross = (n * weights[:, None] * (target - y)).T @ (source - x)
    gap = torch.linalg.svdvals(cross.detach())
    assert gap[1] + gap[2] * torch.det(cross.detach()).sign() > 5e-3 * gap[0], "the pose is hardly determined"
    rotation = proper_rotation(cross)
    return rotation, y - rotation @ x


def pose_loss(pose, truth):
    return (pose[0].T @ truth[0] - torch.eye(3)).square().mean() + (pose[1] - truth[1]).square().mean()


def moved(points, pose):
    return points @ pose[0].T + pose[1]


def after(second, first):
    return second[0] @ first[0], second[0] @ first[1] + second[1]


# ---------------------------------------------------------------- the methods: one pair each


def dcp(config, source, target, truth, _training):
    x, y = tokens_of(config["tokens"], source), tokens_of(config["tokens"], target)
    f, g = dgcnn("embedding", config, x, source)[0], dgcnn("embedding", config, y, target)[0]
    if config["version"] == "v2":
        sizes = (config["heads"], config["feed_forward"])
        f, g = f + phi("transformer", f, g, *sizes), g + phi("transformer", g, f, *sizes)
    else:
        f, g = 2 * f, 2 * g
    pose = fit(x, softmax(f @ g.T / math.sqrt(config["width"]), dim=1) @ y)
    return pose, {"registration": pose_loss(pose, truth)}


def twist_matrix(t):
    zero = torch.zeros(())
    return torch.stack([
        torch.stack([zero, -t[2], t[1], t[3]]),
        torch.stack([t[2], zero, -t[0], t[4]]),
        torch.stack([-t[1], t[0], zero, t[5]]),
        torch.stack([zero, zero, zero, zero]),
    ])


def pointnet(config, points):
    x = points
    for index, width in enumerate(config["widths"]):
        x = torch.relu(linear(f"layers.{index}", x, width))
    return x


def pointnetlk(config, source, target, truth, training):
    source, target = tokens_of(config["points"], source), tokens_of(config["points"], target)
    feature = pointnet(config, target).amax(0)
    if config["jacobian"] == "analytic":
        # By autograd, at the point of each maximum; twice differentiable.
        embedded = pointnet(config, target)
        best = embedded.argmax(0)
        columns = []
        for k, i in enumerate(best):
            point = target[i].detach().clone().requires_grad_()
            gradient = torch.autograd.grad(pointnet(config, point[None])[0, k], point, create_graph=True,
                                           allow_unused=True)[0]
            point = point.detach()
            columns.append(torch.cat([torch.linalg.cross(point, gradient), gradient]))
        jacobian = torch.stack(columns)
    else:
        step = 1e-2
        columns = []
        for k in range(6):
            motion = torch.matrix_exp(twist_matrix(-step * torch.eye(6)[k]))
            columns.append((feature - pointnet(config, moved(target, (motion[:3, :3], motion[:3, 3]))).amax(0)) / step)
        jacobian = torch.stack(columns, dim=1)
    normal = jacobian.T @ jacobian
    normal = normal + 1e-6 * normal.trace() / 6 * torch.eye(6)
    inverse = torch.linalg.inv(normal) @ jacobian.T
    motion = torch.eye(4)
    for _ in range(config["iterations" if training else "test_iterations"]):
        residual = pointnet(config, moved(source, (motion[:3, :3], motion[:3, 3]))).amax(0) - feature
        motion = torch.matrix_exp(twist_matrix(-inverse @ residual)) @ motion
    wanted = torch.eye(4)
    wanted[:3, :3], wanted[:3, 3] = truth
    difference = motion @ torch.linalg.inv(wanted) - torch.eye(4)
    return (motion[:3, :3], motion[:3, 3]), {"residual": residual.square().sum(), "pose": difference.square().mean()}


def quaternion_rotation(q):
    w, x, y, z = q / q.norm()
    return torch.stack([
        torch.stack([1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)]),
        torch.stack([2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)]),
        torch.stack([2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]),
    ])


def panet(config, source, target, truth, _training):
    k = config["scales"][0]

    def encode(cloud, count, near):
        x = cloud[near].reshape(-1, 3)
        levels = []
        for index, width in enumerate(config["widths"]):
            x = block(f"layers.{index}", x, width)
            scales = [x.reshape(count, k, width)[:, :scale].amax(1) for scale in config["scales"]]
            squeezed = block(f"attention.{index}.squeeze", sum(scales), max(width // 4, 1))
            weights = softmax(linear(f"attention.{index}.scores", squeezed, len(scales)), dim=1)
            levels.append(sum(weights[:, s : s + 1] * f for s, f in enumerate(scales)))
        return block("joint", torch.cat(levels, dim=1), config["width"]).amax(0)

    def graph(cloud):
        return neighbours(tokens_of(config["tokens"], cloud), cloud, k)

    near, count = graph(source), config["tokens"]
    fixed = encode(target, count, graph(target))
    pose = (torch.eye(3), torch.zeros(3))
    for _ in range(config["iterations"]):
        x = torch.cat([encode(moved(source, pose), count, near), fixed])
        for index, width in enumerate(config["head"]):
            x = torch.relu(linear(f"head.{index}", x, width))
        x = linear("pose", x, 7)
        pose = after((quaternion_rotation(x[:4]), x[4:]), pose)
    return pose, {"points": (moved(source, pose) - moved(source, truth)).abs().mean()}


def log_sinkhorn(scores, iterations):
    n, m = scores.shape
    log = torch.zeros(n + 1, m + 1)
    log[:n, :m] = scores
    for _ in range(iterations):
        log = torch.cat([log[:n] - log[:n].logsumexp(1, keepdim=True), log[n:]], dim=0)
        log = torch.cat([log[:, :m] - log[:, :m].logsumexp(0, keepdim=True), log[:, m:]], dim=1)
    return log[:n, :m].exp()


def rgm_matching(config, source, target):
    x, y = tokens_of(config["tokens"], source), tokens_of(config["tokens"], target)
    width, sizes = config["width"], (config["heads"], config["feed_forward"])
    nodes = []
    for tokens, cloud in ((x, source), (y, target)):
        edge, node = dgcnn("features", config, tokens, cloud)
        nodes.append(torch.cat([node, edge], dim=1))
    for index in range(config["layers"]):
        path, convolved = f"layers.{index}", []
        for own, other in ((nodes[0], nodes[1]), (nodes[1], nodes[0])):
            embedded = own + phi(f"{path}.transformer", own, other, *sizes)
            edges = softmax(embedded @ embedded.T / math.sqrt(own.shape[1]), dim=1)
            edges = edges / edges.sum(0, keepdim=True)
            convolved.append(edges @ torch.relu(linear(f"{path}.neighbours", own, width))
                             + torch.relu(linear(f"{path}.own", own, width)))
        nodes = convolved
        weight = parameter(f"{path}.affinity.weight", width, width)
        scores = nodes[0] @ (torch.eye(width) + (weight + weight.T) / 2) @ nodes[1].T
        scores = (scores - scores.mean()) / (scores.var(unbiased=False) + 1e-5).sqrt()
        scores = scores * parameter(f"{path}.affinity.gamma", 1) + parameter(f"{path}.affinity.beta", 1)
        assignment = log_sinkhorn(scores, config["sinkhorn"])
        if index + 1 < config["layers"]:
            opposite = (assignment @ nodes[1], assignment.T @ nodes[0])
            nodes = [linear(f"{path}.mixing", torch.cat(both, dim=1), width) for both in zip(nodes, opposite)]
    return x, y, assignment


def rgm_truth(posed, target, radius):
    distance = torch.cdist(posed.detach(), target.detach())
    truth = torch.zeros_like(distance)
    forth, back = distance.argmin(1), distance.argmin(0)

    def keep(pairs, within):
        for i, j in pairs:
            if distance[i, j] < within and truth[i].sum() == 0 and truth[:, j].sum() == 0:
                truth[i, j] = 1.0

    everything = list(enumerate(forth.tolist()))
    keep([(i, j) for i, j in everything if back[j] == i], radius)
    keep(everything, radius)
    order = distance.flatten().argsort(stable=True).tolist()
    keep([divmod(k, distance.shape[1]) for k in order], 2 * radius)
    return truth


def rgm(config, source, target, truth, training):
    if training:
        x, y, assignment = rgm_matching(config, source, target)
        wanted = rgm_truth(moved(x, truth), y, config["match_radius"])
        loss = binary_cross_entropy(assignment, wanted, reduction="sum") / len(x)
        return None, {"assignment": loss}
    pose = (torch.eye(3), torch.zeros(3))
    for _ in range(config["iterations"]):
        x, y, assignment = rgm_matching(config, moved(source, pose), target)
        rows, columns = linear_sum_assignment(-assignment.detach().numpy())
        weights = assignment[rows, columns]
        sums = (assignment.sum(1) >= 0.5) & (assignment.sum(0)[columns] >= 0.5)
        assert sums.sum() >= 3
        weights = weights * sums
        pose = after(fit(x, y[columns], weights / weights.sum()), pose)
    return pose, {}


def equi_gspr(config, source, target, truth, _training, descriptors):
    def features(points, descriptor):
        x, f = points, linear("embedding", descriptor, config["width"])
        near = neighbours(points, points, config["neighbours"])
        for index in range(config["layers"]):
            path, width = f"layers.{index}", config["width"]
            away = x[:, None] - x[near]
            squared = away.square().sum(2, keepdim=True)
            dot = (x[:, None] * x[near]).sum(2, keepdim=True)
            own = f[:, None].expand(-1, near.shape[1], -1)
            edges = torch.cat([own, f[near], squared, squared.clamp_min(1e-12).sqrt(), dot], dim=2)
            message = silu(linear(f"{path}.edge_inner", edges, width))
            message = norm(f"{path}.edge_norm", silu(linear(f"{path}.edge_outer", message, width)))
            step = linear(f"{path}.step_outer", silu(linear(f"{path}.step_inner", message, width)), 1)
            inner = silu(linear(f"{path}.node_inner", torch.cat([f, message.sum(1)], dim=1), width))
            x, f = x + (away * step).mean(1), f + linear(f"{path}.node_outer", inner, width)
        return f

    f, g = features(source, descriptors[0]), features(target, descriptors[1])
    similarity = torch.sigmoid((f * g).sum(1) / math.sqrt(config["width"]))
    head = torch.cat([f, g], dim=1)
    for index, width in enumerate(config["head"]):
        head = torch.relu(linear(f"head.{index}", head, width))
    score = torch.sigmoid(linear("score", head, 1))[:, 0]
    weights = similarity * score + 1e-6
    return fit(source, target, weights / weights.sum()), {}


# ---------------------------------------------------------------- the fixture


def keep(name, value):
    value = torch.as_tensor(value, dtype=torch.float64).detach()
    value = value.reshape(1) if value.ndim == 0 else value
    OUT[name] = {"shape": list(value.shape), "data": [float(f"{v:.11g}") for v in value.flatten().tolist()]}


def keep_gradients(name, loss):
    """Of each parameter's gradient the norm, and the product with a drawn direction."""
    loss.backward()
    found = {}
    for path, tensor in sorted(PARAMETERS.items()):
        if tensor.grad is not None:
            direction = Numbers(fnv(path + ".direction")).tensor(*tensor.shape)
            found[path] = [float(f"{v:.11g}") for v in (tensor.grad.norm(), (tensor.grad * direction).sum())]
    OUT[f"{name}.gradient"] = found


def inputs():
    """Clouds and true poses; the target is the posed source with noise."""
    numbers = Numbers(31)
    source = numbers.tensor(BATCH, POINTS, 3) * torch.tensor([1.0, 0.7, 0.4])
    rotation = torch.stack([torch.matrix_exp(twist_matrix(0.4 * numbers.tensor(6))[:3, :3]) for _ in range(BATCH)])
    translation = 0.1 * numbers.tensor(BATCH, 3)
    target = source @ rotation.transpose(1, 2) + translation[:, None] + 0.04 * numbers.tensor(BATCH, POINTS, 3)
    return [t.to(torch.float32).to(torch.float64) for t in (source, target, rotation, translation)]


METHODS = {"dcp": dcp, "pointnetlk": pointnetlk, "panet": panet, "rgm": rgm}


def main():
    source, target, rotation, translation = inputs()
    for name, value in (("source", source), ("target", target), ("rotation", rotation), ("translation", translation)):
        keep(name, value)
    OUT["configs"], OUT["losses"] = CONFIGS, LOSSES
    for name, config in CONFIGS.items():
        PARAMETERS.clear()
        method = next((m for m in METHODS if name.startswith(m)), "equi_gspr")
        pairs = list(zip(source, target, zip(rotation, translation)))
        if method == "equi_gspr":
            # From given matches: descriptors are the crate's own, tested elsewhere.
            drawn = Numbers(32).tensor(2, BATCH, POINTS, 36).to(torch.float32).to(torch.float64)
            drawn[1] = drawn[0] + 0.3 * drawn[1]
            OUT["equi_gspr.descriptor_seed"] = 32
            poses = [equi_gspr(config, *pair, False, drawn[:, i])[0] for i, pair in enumerate(pairs)]
            keep(f"{name}.rotation", torch.stack([pose[0] for pose in poses]))
            keep(f"{name}.translation", torch.stack([pose[1] for pose in poses]))
            keep_gradients(name, sum((pose[0] * rotation[i]).sum() + pose[1].sum() for i, pose in enumerate(poses)))
            continue
        poses = [METHODS[method](config, *pair, False)[0] for pair in pairs]
        keep(f"{name}.rotation", torch.stack([pose[0] for pose in poses]))
        keep(f"{name}.translation", torch.stack([pose[1] for pose in poses]))
        terms = [METHODS[method](config, *pair, True)[1] for pair in pairs]
        total = 0.0
        for key, weight in LOSSES[method].items():
            value = sum(term[key] for term in terms) / BATCH
            keep(f"{name}.loss.{key}", value)
            total = total + weight * value
        keep_gradients(name, total)
    with open(sys.argv[1], "w") as file:
        lines = (f"{json.dumps(k)}: {json.dumps(v, separators=(',', ':'))}" for k, v in OUT.items())
        file.write("{\n" + ",\n".join(lines) + "\n}\n")


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    main()
