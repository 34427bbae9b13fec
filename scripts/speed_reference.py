#!/usr/bin/env python3
"""The SRRF network in batched PyTorch, made for speed: what the crate's times are compared with.

    python3 scripts/speed_reference.py --check                 # against reference_network.py
    python3 scripts/speed_reference.py --figure registration_step --threads 2
    python3 scripts/speed_reference.py                         # all figures, each in a process of its own

Prints JSON. Sizes, losses and the optimiser come from a training configuration. Wherever PyTorch
offers two ways of writing the same thing, the one that was faster on a CPU is here: rows by
`index_select`, squared distances by one product, `amax` where no gradient follows, ReLU in place, fused
attention, AdamW with `fused=True`, the first linear layer folded through the neighbour gather, and glibc
told to keep freed memory. Data are made before the clock starts. `--bf16` runs the network, but not its
geometry, under autocast; `--compile` compiles what follows the choice of neighbours with torch.compile.
"""

import argparse
import ctypes
import json
import math
import statistics
import subprocess
import sys
import time
import tomllib
from pathlib import Path

FIGURES = ("registration_step", "skeleton_step", "forward_1", "forward_8")


def keep_freed_memory():
    """As `srrf_model::keep_freed_memory`: without it, a step is slower here too."""
    try:
        libc = ctypes.CDLL("libc.so.6")
        for parameter, value in ((-3, 1 << 30), (-1, (1 << 31) - 1), (-2, 64 << 20)):
            libc.mallopt(parameter, value)
    except (OSError, AttributeError):
        pass  # another C library


if __name__ == "__main__":
    keep_freed_memory()

import torch  # noqa: E402
from torch import nn  # noqa: E402
from torch.nn import functional as F  # noqa: E402

# ---------------------------------------------------------------- points


@torch.autocast("cpu", enabled=False)
def squared_distances(a, b):
    """|a_i - b_j|^2 for [clouds, n, 3] and [clouds, m, 3], good enough to choose neighbours by: one
    product of [-2a, |a|^2, 1] and [b, 1, |b|^2]."""
    one = torch.ones((), dtype=a.dtype)
    left = torch.cat([-2 * a, a.square().sum(-1, keepdim=True), one.expand(*a.shape[:2], 1)], -1)
    right = torch.cat([b, one.expand(*b.shape[:2], 1), b.square().sum(-1, keepdim=True)], -1)
    return left @ right.transpose(1, 2)


def maximum(x, dim, keepdim=False):
    """`amax` is far faster than `max`, but its gradient is slower."""
    return x.max(dim, keepdim).values if torch.is_grad_enabled() else x.amax(dim, keepdim)


@torch.no_grad()
def farthest_points(points, count):
    """Farthest point sampling of all clouds at once, from the point farthest from the mean."""
    clouds, n, _ = points.shape
    planes, each = points.transpose(1, 2).contiguous(), torch.arange(clouds)
    last = (points - points.mean(1, keepdim=True)).square().sum(-1).argmax(1)
    left = points.new_full((clouds, n), math.inf)
    chosen = [last]
    for _ in range(count - 1):
        gap = (planes - points[each, last][:, :, None]).square_().sum(1)
        torch.minimum(left, gap, out=left)
        last = left.argmax(1)
        chosen.append(last)
    return torch.stack(chosen, 1)


def flat(indices, points):
    """Row numbers into the flattened table of clouds of `points` points."""
    return (indices + torch.arange(len(indices)).view(-1, *[1] * (indices.ndim - 1)) * points).flatten()


@torch.no_grad()
def k_nearest(queries, support, k):
    """Row numbers of the k nearest support points, nearest first."""
    near = squared_distances(queries, support).topk(k, dim=-1, largest=False).indices
    return flat(near, support.shape[1])


@torch.no_grad()
def nearest(queries, support):
    return flat(squared_distances(queries, support).argmin(-1), support.shape[1])


def morton(cells):
    """Interleaves the low 10 bits of [.., 3] integers."""
    v = cells & 0x3FF
    v = (v | (v << 16)) & 0x030000FF
    v = (v | (v << 8)) & 0x0300F00F
    v = (v | (v << 4)) & 0x030C30C3
    v = (v | (v << 2)) & 0x09249249
    return v[..., 0] | (v[..., 1] << 1) | (v[..., 2] << 2)


@torch.no_grad()
def even_subsample(points, count, phase):
    """Points at even steps of the Morton curve: row numbers."""
    n = points.shape[1]
    low, high = points.amin(1, keepdim=True), points.amax(1, keepdim=True)
    cells = ((points - low) / (high - low).amax(2, keepdim=True) * 1023).long()
    order = morton(cells).argsort(1)
    steps = ((torch.arange(count, dtype=torch.float64) + phase) * (n / count)).long()
    return flat(order[:, steps], n)


def relu(x):
    return F.relu(x, inplace=True)


def norms(difference):
    return difference.square().sum(-1).clamp_min(1e-12).sqrt()


def nearest_distance(points, support):
    """Distance from each point to the nearest of the support, differentiable in both: [clouds, n]."""
    rows = nearest(points.detach(), support.detach())
    return norms(points - support.reshape(-1, 3).index_select(0, rows).view_as(points))


# ---------------------------------------------------------------- the network


class Level(nn.Module):
    """Shared MLP on [x_j - x_i; f_j] over the neighbours, then the maximum."""

    def __init__(self, channels, config):
        super().__init__()
        widths = [3 + channels, *config["widths"]]
        self.mlp = nn.ModuleList(nn.Linear(a, b) for a, b in zip(widths, widths[1:]))
        self.points, self.neighbours = config["points"], config["neighbours"]

    def forward(self, xyz, features, centres, near):
        first, *others = self.mlp
        # W [x_j - x_i; f_j] = W [x_j; f_j] - W_x x_i: once a point, not once a neighbour.
        table = first(xyz if features is None else torch.cat([xyz, features], -1)).flatten(0, 1)
        shift = F.linear(centres, first.weight[:, :3]).flatten(0, 1)[:, None]
        x = relu(table.index_select(0, near).view(-1, self.neighbours, table.shape[-1]) - shift)
        for layer in others:
            x = relu(layer(x))
        return maximum(x, 1).view(*centres.shape[:2], -1)


class HeadLayer(nn.Module):
    def __init__(self, inputs, outputs):
        super().__init__()
        self.linear, self.norm = nn.Linear(inputs, outputs), nn.LayerNorm(outputs)

    def forward(self, x):
        return relu(self.norm(self.linear(x)))


class Sem(nn.Module):
    def __init__(self, config):
        super().__init__()
        channels, levels = 0, []
        for level in config["levels"]:
            levels.append(Level(channels, level))
            channels = level["widths"][-1]
        self.levels = nn.ModuleList(levels)
        self.context = nn.Linear(channels, config["global"])
        widths = [3 + channels + config["global"], *config["head"]]
        self.head = nn.Sequential(*(HeadLayer(a, b) for a, b in zip(widths, widths[1:])))
        self.weights = nn.Linear(widths[-1], config["skeleton_points"])
        self.logit_scale = config["logit_scale"]

    def forward(self, clouds):
        """Skeleton points and radii of [clouds, points, 3]."""
        xyz, features = clouds, None
        for level in self.levels:
            n = xyz.shape[1]
            centres = xyz
            if level.points < n:
                rows = flat(farthest_points(xyz.detach(), level.points), n)
                centres = xyz.reshape(-1, 3).index_select(0, rows).view(len(xyz), level.points, 3)
            near = k_nearest(centres.detach(), xyz.detach(), level.neighbours)
            xyz, features = centres, level(xyz, features, centres, near)
        context = maximum(relu(self.context(features)), 1, keepdim=True)
        x = torch.cat([xyz, features, context.expand(-1, xyz.shape[1], -1)], -1)
        logits = self.weights(self.head(x)).to(xyz.dtype) * self.logit_scale
        with torch.autocast("cpu", enabled=False):
            weights = torch.softmax(logits, 1).transpose(1, 2)
            skeleton = weights @ xyz  # Eq. (5)
            radii = weights @ nearest_distance(xyz, skeleton)[..., None]  # Eq. (6)
        return skeleton, radii[..., 0]


class Attention(nn.Module):
    def __init__(self, width, heads):
        super().__init__()
        self.query, self.key_value = nn.Linear(width, width), nn.Linear(width, 2 * width)
        self.output, self.heads = nn.Linear(width, width), heads

    def forward(self, queries, memory):
        def split(x):
            return x.unflatten(-1, (self.heads, -1)).transpose(1, 2)

        q, (k, v) = self.query(queries), self.key_value(memory).chunk(2, -1)
        mixed = F.scaled_dot_product_attention(split(q), split(k), split(v))
        return self.output(mixed.transpose(1, 2).flatten(2))


class FeedForward(nn.Module):
    def __init__(self, width, hidden):
        super().__init__()
        self.inner, self.outer = nn.Linear(width, hidden), nn.Linear(hidden, width)

    def forward(self, x):
        return self.outer(relu(self.inner(x)))


class EncoderLayer(nn.Module):
    def __init__(self, width, heads, hidden):
        super().__init__()
        self.attention, self.attention_norm = Attention(width, heads), nn.LayerNorm(width)
        self.mlp, self.mlp_norm = FeedForward(width, hidden), nn.LayerNorm(width)

    def forward(self, x):
        x = self.attention_norm(self.attention(x, x) + x)
        return self.mlp_norm(self.mlp(x) + x)


class DecoderLayer(nn.Module):
    def __init__(self, width, heads, hidden):
        super().__init__()
        self.self_attention, self.self_norm = Attention(width, heads), nn.LayerNorm(width)
        self.cross_attention, self.cross_norm = Attention(width, heads), nn.LayerNorm(width)
        self.mlp, self.mlp_norm = FeedForward(width, hidden), nn.LayerNorm(width)

    def forward(self, x, memory):
        x = self.self_norm(self.self_attention(x, x) + x)
        x = self.cross_norm(self.cross_attention(x, memory) + x)
        return self.mlp_norm(self.mlp(x) + x)


class SfeLayer(nn.Module):
    def __init__(self, inputs, config):
        super().__init__()
        self.join = nn.Linear(inputs, config["width"])
        self.encoder = EncoderLayer(config["width"], config["heads"], config["mlp"])


class Sfe(nn.Module):
    def __init__(self, config):
        super().__init__()
        k, width = config["neighbours"], config["width"]
        self.layers = nn.ModuleList(SfeLayer(k * (width if i else 3), config) for i in range(config["layers"]))
        self.norm = nn.LayerNorm(config["layers"] * width)
        self.neighbours = k

    def forward(self, clouds, in_cloud, in_tokens):
        """Features of the tokens whose neighbours in the clouds and among the tokens are given."""
        table, near, outputs = clouds.flatten(0, 1), in_cloud, []
        for layer in self.layers:
            joined = table.index_select(0, near).view(len(clouds), -1, self.neighbours * table.shape[-1])
            outputs.append(layer.encoder(layer.join(joined)))
            table, near = outputs[-1].flatten(0, 1), in_tokens
        return self.norm(relu(torch.cat(outputs, -1)))


class Pfi(nn.Module):
    def __init__(self, width, config):
        super().__init__()
        heads, hidden, squeezed = config["heads"], config["feed_forward"], max(width // config["squeeze"], 1)
        self.position_inner = nn.Linear(3, config["position_hidden"])
        self.position_outer = nn.Linear(config["position_hidden"], width)
        self.encoder = nn.ModuleList(EncoderLayer(width, heads, hidden) for _ in range(config["blocks"]))
        self.decoder = nn.ModuleList(DecoderLayer(width, heads, hidden) for _ in range(config["blocks"]))
        self.squeeze, self.excite = nn.Linear(width, squeezed), nn.Linear(squeezed, width)

    def forward(self, features, points):
        """Both directions as one batch: sources, then targets."""
        embedded = features + relu(self.position_outer(torch.sigmoid(self.position_inner(points))))
        memory = embedded
        for block in self.encoder:
            memory = block(memory)
        memory, x = memory.roll(len(memory) // 2, 0), embedded
        for block in self.decoder:
            x = block(x, memory)
        x = features + x
        return x * torch.sigmoid(self.excite(relu(self.squeeze(x.mean(1, keepdim=True)))))


class Matching(nn.Module):
    def __init__(self):
        super().__init__()
        self.log_sharpness = nn.Parameter(torch.zeros(1))

    def forward(self, source, target, points):
        scale = self.log_sharpness.exp() / math.sqrt(source.shape[-1])
        scores = (source * scale) @ target.transpose(1, 2)
        return torch.softmax(scores.to(points.dtype), -1) @ points


class NearestRotation(torch.autograd.Function):
    """U diag(1, 1, det(U V^T)) V^T with the gradient in closed form, which is finite also where two
    singular values are equal, as those of a blend of two rotations are."""

    @staticmethod
    def forward(ctx, matrices):
        u, s, vh = torch.linalg.svd(matrices)
        sign = torch.det(u @ vh).sign()
        d = torch.ones_like(s)
        d[:, 2] = sign
        gap = (s * d)[:, :, None] + (s * d)[:, None]
        k = 1 / torch.maximum(gap, 1e-3 * s[:, :1, None])
        ud = u * d[:, None]
        ctx.save_for_backward(ud, vh, k)
        return ud @ vh

    @staticmethod
    def backward(ctx, gradient):
        ud, vh, k = ctx.saved_tensors
        turn = k * (ud.transpose(1, 2) @ gradient @ vh.transpose(1, 2))
        return ud @ (turn - turn.transpose(1, 2)) @ vh


nearest_rotation = NearestRotation.apply


@torch.autocast("cpu", enabled=False)
def rigid_fit(source, target):
    """Eq. (1) to (4): the least-squares pose, target ~ R source + t."""
    x, y = source.mean(1, keepdim=True), target.mean(1, keepdim=True)
    rotation = nearest_rotation((target - y).transpose(1, 2) @ (source - x))
    return rotation, (y - x @ rotation.transpose(1, 2))[:, 0]


class Branch(nn.Module):
    def __init__(self, config):
        super().__init__()
        self.sfe, self.matching = Sfe(config["sfe"]), Matching()
        self.pfi = Pfi(config["sfe"]["layers"] * config["sfe"]["width"], config["pfi"])
        self.tokens = config["tokens"]

    def matches(self, tokens, clouds, in_cloud, in_tokens):
        """Everything between the neighbours and the SVD."""
        phi = self.pfi(self.sfe(clouds, in_cloud, in_tokens), tokens)
        source, target = phi.chunk(2)
        return self.matching(source, target, tokens.chunk(2)[1])

    def forward(self, source, target, phase):
        clouds = tokens = torch.cat([source, target])
        if 0 < self.tokens < clouds.shape[1]:
            rows = even_subsample(clouds.detach(), self.tokens, phase)
            tokens = clouds.reshape(-1, 3).index_select(0, rows).view(len(clouds), self.tokens, 3)
        k = self.sfe.neighbours
        in_tokens = k_nearest(tokens.detach(), tokens.detach(), k)
        in_cloud = in_tokens if tokens is clouds else k_nearest(tokens.detach(), clouds.detach(), k)
        matches = self.matches(tokens, clouds, in_cloud, in_tokens).to(source.dtype)
        points = tokens.chunk(2)[0]
        return *rigid_fit(points, matches), points, matches


class Srrf(nn.Module):
    def __init__(self, config):
        super().__init__()
        self.sem = Sem(config["sem"])
        self.dense, self.skeleton = Branch(config["dense"]), Branch(config["skeleton"])
        self.integration = config["integration"]

    def forward(self, source, target, phase):
        """Both branches and the fused pose. SEM is cut off from the registration, and its gradient is
        left out, as in the registration stage."""
        with torch.no_grad():
            skeletons = self.sem(torch.cat([source, target]))[0]
        skeleton = self.skeleton(*skeletons.chunk(2), phase)
        dense = self.dense(source, target, phase)
        return dense, skeleton, self.fuse(dense, skeleton, source, target)

    @torch.autocast("cpu", enabled=False)
    def fuse(self, dense, skeleton, source, target):
        config = self.integration
        with torch.no_grad():
            ratios = []
            for branch, threshold in ((dense, "dense_threshold"), (skeleton, "skeleton_threshold")):
                moved = posed(source, *branch[:2])
                gap = squared_distances(moved, target).amin(-1)
                ratios.append((gap < config[threshold] ** 2).to(source.dtype).mean(-1) ** config["sharpness"])
            total = ratios[0] + ratios[1]
            weight = torch.where(total > 0, ratios[0] / total, 0.5)
        rotation = torch.lerp(skeleton[0], dense[0], weight[:, None, None])
        return nearest_rotation(rotation), torch.lerp(skeleton[1], dense[1], weight[:, None])


# ---------------------------------------------------------------- losses


@torch.autocast("cpu", enabled=False)
def posed(points, rotation, translation):
    return torch.baddbmm(translation[:, None], points, rotation.transpose(1, 2))


def registration_loss(rotation, translation, true_rotation, true_translation):
    difference = rotation.transpose(1, 2) @ true_rotation - torch.eye(3, dtype=rotation.dtype)
    return difference.square().mean() + (translation - true_translation).square().mean()


def registration_losses(factor, found, truth):
    dense, skeleton, fused = found
    total = registration_loss(*fused, *truth)
    for rotation, translation, points, matches in (dense, skeleton):
        total = total + registration_loss(rotation, translation, *truth)
        total = total + factor * norms(posed(points, *truth) - matches).mean()
    return total


def chamfer(a, b):
    return nearest_distance(a, b).mean() + nearest_distance(b, a).mean()


def skeleton_losses(factors, clouds, skeletons, radii, truth):
    m = skeletons.shape[1]
    signs = torch.tensor([1.0, -1.0], dtype=clouds.dtype) / math.sqrt(3.0)
    spheres = skeletons[:, :, None] + radii[:, :, None, None] * torch.cartesian_prod(signs, signs, signs)
    sampling = chamfer(spheres.flatten(1, 2), clouds)

    near = nearest(clouds, skeletons.detach())
    to_sphere = norms(clouds - skeletons.reshape(-1, 3).index_select(0, near).view_as(clouds))
    to_sphere = (to_sphere - radii.reshape(-1).index_select(0, near).view_as(to_sphere)).abs().mean()
    point_to_sphere = to_sphere + (nearest_distance(skeletons, clouds) - radii).abs().mean()

    source, other = skeletons.chunk(2)
    moved = posed(source, *truth)
    spread = ((other - other.mean(1, keepdim=True)).square().mean() * 3.0).sqrt().clamp_min(1e-3)
    index_match = norms((moved - other).view(-1, m, 3)).mean() / spread
    return (
        sampling
        + factors["point_to_sphere"] * point_to_sphere
        - factors["radius"] * radii.mean()
        + factors["distribution"] * chamfer(moved, other)
        + factors["index_match"] * index_match
    )


# ---------------------------------------------------------------- the check


def check():
    """Values and gradients against the slow network, in f64, on its small sizes."""
    sys.path.insert(0, str(Path(__file__).parent))
    sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "crates/srrf-model/tests/fixtures"))
    import parity_reference as parity
    import reference_network as slow

    config = parity.CONFIG
    source, target, rotation, translation = parity.inputs(16)
    source, target = source.detach(), target.detach()
    phase, truth = parity.PHASE, (rotation, translation)

    skeletons, radii, _, _ = slow.sem("sem", config["sem"], torch.cat([source, target]))
    halves = skeletons.detach().chunk(2)
    skeleton = slow.branch("skeleton", config["skeleton"], *halves, phase)
    dense = slow.branch("dense", config["dense"], source, target, phase)
    fused = slow.fuse(config["integration"], dense, skeleton, source, target)[:2]
    wanted = [skeletons, radii, *fused]
    wanted += [found[key] for found in (dense, skeleton) for key in ("rotation", "translation", "matches")]
    total = slow.registration_loss(*fused, *truth)
    for found in (dense, skeleton):
        total = total + slow.registration_loss(found["rotation"], found["translation"], *truth)
        total = total + slow.correspondence_loss(found["source_points"], found["matches"], *truth)
    sem_total = slow.skeleton_losses(parity.LOSS, source, target, skeletons, radii, *truth)["total"]
    (total + sem_total).backward()

    model = Srrf(config).double()
    names = {".gamma": ".weight", ".beta": ".bias", "sem.global.": "sem.context."}

    def theirs(path):
        for old, new in names.items():
            path = path.replace(old, new)
        return path

    parameters = dict(model.named_parameters())
    slow_parameters = {theirs(path): value for path, value in slow.PARAMETERS.items()}
    assert parameters.keys() == slow_parameters.keys(), parameters.keys() ^ slow_parameters.keys()

    def ours(tensor):  # matrices are [inputs, outputs] there
        return tensor.detach().T if tensor.ndim == 2 else tensor.detach()

    for path, value in parameters.items():
        value.data.copy_(ours(slow_parameters[path]))
    found = model(source, target, phase)
    skeletons, radii = model.sem(torch.cat([source, target]))
    got = [skeletons, radii, *found[2]]
    got += [branch[i] for branch in found[:2] for i in (0, 1, 3)]
    ours_total = registration_losses(1.0, found, truth)
    ours_sem = skeleton_losses(parity.LOSS, torch.cat([source, target]), skeletons, radii, truth)
    (ours_total + ours_sem).backward()

    wanted += [total, sem_total, *(ours(slow_parameters[path].grad) for path in parameters)]
    got += [ours_total, ours_sem, *(value.grad for value in parameters.values())]
    worst = max(float((a - b).detach().abs().max() / (1 + b.detach().abs().max())) for a, b in zip(got, wanted))
    print(json.dumps({"check": "passed" if worst < 1e-5 else "FAILED", "largest_difference": worst}))
    return worst < 1e-5


# ---------------------------------------------------------------- the clock


def generated_pairs(batch, points, seed=1):
    """Noisy boxes and ellipsoids under poses of up to 45 degrees, in network units."""
    make = torch.Generator().manual_seed(seed)
    ball = torch.randn(batch, points, 3, generator=make)
    ball = ball / ball.norm(dim=-1, keepdim=True)
    box = ball / ball.abs().amax(-1, keepdim=True)
    half = torch.rand(batch, points, 1, generator=make) < 0.5
    source = torch.where(half, ball, box) * (0.3 + 0.7 * torch.rand(batch, 1, 3, generator=make))
    source = source - source.mean(1, keepdim=True)
    source = source * 0.6 / source.square().sum(-1).mean(-1).sqrt()[:, None, None]
    angles = torch.rand(batch, 3, generator=make) * math.pi / 4
    cos, sin, zero, one = angles.cos(), angles.sin(), torch.zeros(batch), torch.ones(batch)
    turn = [
        torch.stack([one, zero, zero, zero, cos[:, 0], -sin[:, 0], zero, sin[:, 0], cos[:, 0]], -1),
        torch.stack([cos[:, 1], zero, sin[:, 1], zero, one, zero, -sin[:, 1], zero, cos[:, 1]], -1),
        torch.stack([cos[:, 2], -sin[:, 2], zero, sin[:, 2], cos[:, 2], zero, zero, zero, one], -1),
    ]
    rotation = turn[2].view(-1, 3, 3) @ turn[1].view(-1, 3, 3) @ turn[0].view(-1, 3, 3)
    noise = 0.02 * torch.randn(batch, points, 3, generator=make)
    target = source @ rotation.transpose(1, 2) + noise
    mean = target.mean(1)
    shuffled = torch.randperm(points, generator=make)
    return source, (target - mean[:, None])[:, shuffled].contiguous(), rotation, -mean


def memory_mib(key):
    """A line of /proc/self/status in MiB. (`getrusage` counts in what the parent process held before it
    started this one.)"""
    try:
        with open("/proc/self/status") as file:
            return next(int(line.split()[1]) / 1024 for line in file if line.startswith(key))
    except (OSError, StopIteration):
        return None


def merged(below, above):
    both = [key for key, value in above.items() if isinstance(value, dict) and isinstance(below.get(key), dict)]
    return {**below, **above, **{key: merged(below[key], above[key]) for key in both}}


def read_config(path):
    """A configuration with those that it extends, as srrf-train reads them."""
    with open(path, "rb") as file:
        config = tomllib.load(file)
    base = config.pop("extends", None)
    return merged(read_config(Path(path).parent / base), config) if base else config


def measure(arguments):
    start_mib = memory_mib("VmHWM:")
    torch.set_num_threads(arguments.threads)
    torch.manual_seed(1)
    config = read_config(arguments.config)
    optimizer_config, losses = config["optimizer"], config["losses"]
    model = Srrf(config["network"])
    if arguments.compile:
        for branch in (model.dense, model.skeleton):
            branch.matches = torch.compile(branch.matches)
        for level in model.sem.levels:
            level.compile()
    autocast = torch.autocast("cpu", torch.bfloat16, enabled=arguments.bf16)
    figure = arguments.figure
    batch = {"forward_1": 1, "forward_8": 8}.get(figure, optimizer_config["batch"])
    source, target, *truth = generated_pairs(batch, config.get("pairs", {}).get("points", 1024))
    clouds = torch.cat([source, target])

    if figure.startswith("forward"):
        model.eval()

        def run():
            with torch.inference_mode(), autocast:
                model(source, target, 0.5)

    else:
        trained = [model.sem] if figure == "skeleton_step" else [model.dense, model.skeleton]
        parameters = [p for part in trained for p in part.parameters()]
        optimizer = torch.optim.AdamW(
            parameters, lr=1e-5, betas=(0.9, optimizer_config["beta_2"]), eps=1e-8,
            weight_decay=optimizer_config["weight_decay"], fused=True)

        def run():
            optimizer.zero_grad(set_to_none=True)
            with autocast:
                if figure == "skeleton_step":
                    skeletons, radii = model.sem(clouds)
                    loss = skeleton_losses(losses["skeleton"], clouds, skeletons, radii, truth)
                else:
                    loss = registration_losses(losses["correspondence"], model(source, target, 0.5), truth)
            loss.backward()
            nn.utils.clip_grad_norm_(parameters, optimizer_config["clip_norm"])
            optimizer.step()
            return float(loss.detach())  # as a log of the losses needs

    for _ in range(arguments.warmup):
        loss = run()
    times = []
    for _ in range(arguments.repeats):
        start = time.perf_counter()
        loss = run()
        times.append(time.perf_counter() - start)
    print(json.dumps({
        "figure": figure, "threads": arguments.threads, "median_s": statistics.median(times), "min_s": min(times),
        "repeats": len(times), "loss": loss, "start_mib": start_mib, "peak_mib": memory_mib("VmHWM:"),
        "torch": torch.__version__, "bf16": arguments.bf16, "compile": arguments.compile,
    }))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    root = Path(__file__).resolve().parent.parent
    parser.add_argument("--config", type=Path, default=root / "configs/modelnet-small.toml")
    parser.add_argument("--figure", choices=FIGURES, help="one figure; default: all, one after the other")
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--warmup", type=int, default=3)
    parser.add_argument("--repeats", type=int, default=10)
    parser.add_argument("--bf16", action="store_true", help="autocast to bfloat16")
    parser.add_argument("--compile", action="store_true", help="torch.compile of the network's parts")
    parser.add_argument("--check", action="store_true", help="compare with the slow reference, in f64")
    arguments = parser.parse_args()
    if arguments.check:
        sys.exit(0 if check() else 1)
    if arguments.figure:
        measure(arguments)
        return
    for figure in FIGURES:
        subprocess.run([sys.executable, __file__, *sys.argv[1:], "--figure", figure], check=True)


if __name__ == "__main__":
    main()
