"""The SRRF network in plain PyTorch, float64, without regard to speed: clouds one by one, and every
formula as it stands in the paper and in the documentation of crates/srrf-model.

`parity_reference.py` makes the crate's fixture from it. Both sides make the same parameters, so that
none are shipped: splitmix64 gives 64 bits a draw, and `signed` the multiple of 2^-23 in [-1, 1) that
its upper 40 bits name. A parameter's stream starts at the FNV-1a hash of its path and runs in C order
of its shape, where matrices are [inputs, outputs]:

    weight         signed * 1.5 / sqrt(inputs)
    bias, beta     signed * 0.2
    gamma          1 + signed * 0.3
    others         signed * 0.4

each rounded to float32 once.
"""

import math

import numpy as np
import torch
from torch.nn.functional import layer_norm, softmax

torch.set_num_threads(1)
torch.set_default_dtype(torch.float64)

MASK = (1 << 64) - 1


# ---------------------------------------------------------------- numbers


class Numbers:
    """splitmix64."""

    def __init__(self, seed):
        self.state = seed & MASK

    def signed(self):
        self.state = (self.state + 0x9E3779B97F4A7C15) & MASK
        z = self.state
        z = ((z ^ (z >> 30)) * 0xBF58476D1CE4E5B9) & MASK
        z = ((z ^ (z >> 27)) * 0x94D049BB133111EB) & MASK
        z ^= z >> 31
        return (z >> 40) / float(1 << 23) - 1.0

    def tensor(self, *shape):
        count = math.prod(shape)
        return torch.tensor([self.signed() for _ in range(count)]).reshape(shape)


def fnv(text):
    """FNV-1a, 64 bits."""
    h = 0xCBF29CE484222325
    for byte in text.encode():
        h = ((h ^ byte) * 0x100000001B3) & MASK
    return h


PARAMETERS = {}


def parameter(path, *shape):
    """The parameter of a path, made when it is first asked for."""
    if path not in PARAMETERS:
        drawn = Numbers(fnv(path)).tensor(*shape)
        field = path.rsplit(".", 1)[1]
        if field == "weight":
            drawn = drawn * (1.5 / math.sqrt(shape[0]))
        elif field in ("bias", "beta"):
            drawn = drawn * 0.2
        elif field == "gamma":
            drawn = 1.0 + drawn * 0.3
        else:
            drawn = drawn * 0.4
        PARAMETERS[path] = drawn.to(torch.float32).to(torch.float64).requires_grad_()
    assert tuple(PARAMETERS[path].shape) == shape, path
    return PARAMETERS[path]


def linear(path, x, outputs):
    inputs = x.shape[-1]
    return x @ parameter(f"{path}.weight", inputs, outputs) + parameter(f"{path}.bias", outputs)


def norm(path, x):
    width = x.shape[-1]
    return layer_norm(x, (width,), parameter(f"{path}.gamma", width), parameter(f"{path}.beta", width), 1e-5)


# ---------------------------------------------------------------- points


def farthest_points(points, count):
    """Farthest point sampling from the point farthest from the mean."""
    p = points.detach().numpy()
    chosen = [int(np.argmax(((p - p.mean(0)) ** 2).sum(1)))]
    left = np.full(len(p), np.inf)
    while len(chosen) < count:
        left = np.minimum(left, ((p - p[chosen[-1]]) ** 2).sum(1))
        chosen.append(int(np.argmax(left)))
    return chosen


def neighbours(queries, support, k):
    """Indices of the k nearest support points of each query, nearest first: [queries, k]."""
    distance = ((queries.detach()[:, None] - support.detach()[None]) ** 2).sum(-1)
    return torch.argsort(distance, dim=1, stable=True)[:, :k]


def even_subsample(points, count, phase):
    """Points at even steps of the Morton curve: 1,024 cells along the longest side of the box."""
    p = points.detach().numpy()
    low = p.min(0)
    cells = ((p - low) / (p.max(0) - low).max() * 1023).astype(int)

    def code(cell):
        return sum(((int(cell[axis]) >> bit) & 1) << (3 * bit + axis) for bit in range(10) for axis in range(3))

    order = sorted(range(len(p)), key=lambda i: (code(cells[i]), *p[i]))
    return [order[int((i + phase) * len(p) / count)] for i in range(count)]


def distances_to_nearest(points, support):
    """|p - nearest support point| of a cloud, floored at 1e-6."""
    gaps = points - support[neighbours(points, support, 1)[:, 0]]
    return gaps.square().sum(1).clamp_min(1e-12).sqrt()


# ---------------------------------------------------------------- the network


def sem_one(path, config, cloud):
    """Skeleton, radii, weights and samples of one cloud."""
    xyz, features = cloud, None
    for index, level in enumerate(config["levels"]):
        count = min(level["points"], len(xyz))
        centres = xyz[farthest_points(xyz, count)] if count < len(xyz) else xyz
        near = neighbours(centres, xyz, level["neighbours"])
        x = xyz[near] - centres[:, None]  # x_j - x_i
        if features is not None:
            x = torch.cat([x, features[near]], dim=2)
        for layer, width in enumerate(level["widths"]):
            x = torch.relu(linear(f"{path}.levels.{index}.mlp.{layer}", x, width))
        xyz, features = centres, x.amax(1)
    context = torch.relu(linear(f"{path}.global", features, config["global"])).amax(0)
    x = torch.cat([xyz, features, context.expand(len(xyz), -1)], dim=1)
    for index, width in enumerate(config["head"]):
        x = torch.relu(norm(f"{path}.head.{index}.norm", linear(f"{path}.head.{index}.linear", x, width)))
    logits = linear(f"{path}.weights", x, config["skeleton_points"]) * config["logit_scale"]
    weights = softmax(logits, dim=0)  # over the sampled points
    skeleton = weights.T @ xyz  # Eq. (5)
    radii = weights.T @ distances_to_nearest(xyz, skeleton)  # Eq. (6)
    return skeleton, radii, weights, xyz


def sem(path, config, clouds):
    return [torch.stack(part) for part in zip(*(sem_one(path, config, cloud) for cloud in clouds))]


def attention(path, queries, memory, heads):
    """Multi-head attention; the key and value projections share one matrix, keys first."""
    width = queries.shape[-1]
    size = width // heads
    q = linear(f"{path}.query", queries, width)
    k, v = linear(f"{path}.key_value", memory, 2 * width).split(width, dim=-1)
    found = []
    for head in range(heads):
        part = slice(head * size, (head + 1) * size)
        scores = q[..., part] @ k[..., part].transpose(-1, -2) / math.sqrt(size)
        found.append(softmax(scores, dim=-1) @ v[..., part])
    return linear(f"{path}.output", torch.cat(found, dim=-1), width)


def feed_forward(path, x, hidden):
    return linear(f"{path}.outer", torch.relu(linear(f"{path}.inner", x, hidden)), x.shape[-1])


def encoder_layer(path, x, heads, hidden):
    x = norm(f"{path}.attention_norm", attention(f"{path}.attention", x, x, heads) + x)
    return norm(f"{path}.mlp_norm", feed_forward(f"{path}.mlp", x, hidden) + x)


def decoder_layer(path, x, memory, heads, hidden):
    x = norm(f"{path}.self_norm", attention(f"{path}.self_attention", x, x, heads) + x)
    x = norm(f"{path}.cross_norm", attention(f"{path}.cross_attention", x, memory, heads) + x)
    return norm(f"{path}.mlp_norm", feed_forward(f"{path}.mlp", x, hidden) + x)


def sfe(path, config, tokens, cloud):
    """Structural features of one cloud's tokens."""
    k, width = config["neighbours"], config["width"]
    near, table, outputs = neighbours(tokens, cloud, k), cloud, []
    for index in range(config["layers"]):
        layer = f"{path}.layers.{index}"
        joined = table[near].reshape(len(tokens), -1)  # Concat over the neighbours
        joined = linear(f"{layer}.join", joined, width)
        table = encoder_layer(f"{layer}.encoder", joined, config["heads"], config["mlp"])
        outputs.append(table)
        near = neighbours(tokens, tokens, k)
    return norm(f"{path}.norm", torch.relu(torch.cat(outputs, dim=1)))


def pfi(path, config, source, source_points, target, target_points):
    """Interacting features of a pair: Phi_X, Phi_Y."""
    width, heads, hidden = source.shape[-1], config["heads"], config["feed_forward"]

    def embedded(features, points):
        inner = torch.sigmoid(linear(f"{path}.position_inner", points, config["position_hidden"]))
        return features + torch.relu(linear(f"{path}.position_outer", inner, width))

    def phi(memory, x):
        for index in range(config["blocks"]):
            memory = encoder_layer(f"{path}.encoder.{index}", memory, heads, hidden)
        for index in range(config["blocks"]):
            x = decoder_layer(f"{path}.decoder.{index}", x, memory, heads, hidden)
        return x

    def recalibrated(x):
        squeezed = torch.relu(linear(f"{path}.squeeze", x.mean(0), max(width // config["squeeze"], 1)))
        return x * torch.sigmoid(linear(f"{path}.excite", squeezed, width))

    x, y = embedded(source, source_points), embedded(target, target_points)
    return recalibrated(source + phi(y, x)), recalibrated(target + phi(x, y))


def soft_matches(path, source_features, target_features, target_points):
    sharpness = torch.exp(parameter(f"{path}.log_sharpness", 1))
    scores = source_features @ target_features.T * sharpness / math.sqrt(source_features.shape[-1])
    probabilities = softmax(scores, dim=1)
    return probabilities @ target_points, probabilities


def proper_rotation(matrix):
    """U diag(1, 1, det(U V^T)) V^T."""
    u, _, vh = torch.linalg.svd(matrix)
    sign = torch.det(u @ vh).detach().sign()
    return u @ torch.diag(torch.stack([torch.ones(()), torch.ones(()), sign])) @ vh


def polar_rotation(matrix):
    """The nearest rotation by Newton's iteration, for det > 0: a blend of two rotations always has
    two equal singular values, at which the gradient of torch's SVD is not finite."""
    for _ in range(20):
        matrix = (matrix + torch.linalg.inv(matrix).T) / 2
    return matrix


def rigid_fit(source, target):
    """Eq. (1) to (4): H = sum (x - xbar)(y - ybar)^T = U S V^T, R = V U^T."""
    x, y = source.mean(0), target.mean(0)
    cross = ((source - x).T @ (target - y)).T
    gap = torch.linalg.svdvals(cross)
    # Nearer to a line or to a mirror image the crate bounds the gradient, on purpose.
    assert gap[1] + gap[2] * torch.det(cross).sign() > 5e-3 * gap[0], "the pose is hardly determined"
    rotation = proper_rotation(cross)
    return rotation, y - rotation @ x


def branch_one(path, config, source, target, phase):
    def tokens(cloud):
        count = config["tokens"]
        return cloud if count in (0, len(cloud)) else cloud[even_subsample(cloud, count, phase)]

    x, y = tokens(source), tokens(target)
    features = [sfe(f"{path}.sfe", config["sfe"], t, c) for t, c in ((x, source), (y, target))]
    features = pfi(f"{path}.pfi", config["pfi"], features[0], x, features[1], y)
    matches, probabilities = soft_matches(f"{path}.matching", *features, y)
    return *rigid_fit(x, matches), x, y, matches, probabilities


BRANCH = ("rotation", "translation", "source_points", "target_points", "matches", "probabilities")


def branch(path, config, source, target, phase):
    pairs = (branch_one(path, config, x, y, phase) for x, y in zip(source, target))
    return dict(zip(BRANCH, (torch.stack(part) for part in zip(*pairs))))


def fuse(config, dense, skeleton, source, target):
    rotations, translations, gammas, lambdas = [], [], [], []
    for i in range(len(source)):
        ratios = []
        for found, threshold in ((dense, "dense_threshold"), (skeleton, "skeleton_threshold")):
            moved = source[i] @ found["rotation"][i].T + found["translation"][i]
            gap = torch.cdist(moved.detach(), target[i].detach()).amin(1)
            ratios.append(float((gap < config[threshold]).double().mean()))
        c, s = (ratio ** config["sharpness"] for ratio in ratios)
        weight = c / (c + s) if c + s > 0 else 0.5
        blend = [weight * dense[k][i] + (1 - weight) * skeleton[k][i] for k in ("rotation", "translation")]
        rotations.append(polar_rotation(blend[0]))
        translations.append(blend[1])
        gammas.append(ratios)
        lambdas.append(weight)
    return torch.stack(rotations), torch.stack(translations), gammas, lambdas


# ---------------------------------------------------------------- losses


def chamfer(a, b):
    one = torch.stack([distances_to_nearest(p, q) for p, q in zip(a, b)]).mean()
    return one + torch.stack([distances_to_nearest(q, p) for p, q in zip(a, b)]).mean()


def posed(points, rotation, translation):
    return points @ rotation.transpose(1, 2) + translation[:, None]


def skeleton_losses(factors, source, target, skeletons, radii, rotation, translation):
    """L_s, L_p, L_r, L_ddl, the index-matched distance and the sum weighted by `factors`; skeletons
    and radii are those of the sources, then those of the targets."""
    clouds = torch.cat([source, target])
    batch, m = radii.shape
    corners = torch.tensor([[a, b, c] for a in (1.0, -1.0) for b in (1.0, -1.0) for c in (1.0, -1.0)])
    spheres = skeletons[:, :, None] + radii[:, :, None, None] * corners / math.sqrt(3.0)
    sampling = chamfer(spheres.reshape(batch, 8 * m, 3), clouds)

    to_sphere, to_cloud = [], []
    for cloud, points, r in zip(clouds, skeletons, radii):
        near = neighbours(cloud, points, 1)[:, 0]
        to_sphere.append(((cloud - points[near]).norm(dim=1) - r[near]).abs().mean())
        to_cloud.append((distances_to_nearest(points, cloud) - r).abs().mean())
    point_to_sphere = torch.stack(to_sphere).mean() + torch.stack(to_cloud).mean()

    radius = -radii.mean()
    moved, other = posed(skeletons[: batch // 2], rotation, translation), skeletons[batch // 2 :]
    distribution = chamfer(moved, other)
    spread = (other - other.mean(1, keepdim=True)).square().sum(2).mean().sqrt()
    index_match = (moved - other).norm(dim=2).mean() / spread
    total = (
        sampling
        + factors["point_to_sphere"] * point_to_sphere
        + factors["radius"] * radius
        + factors["distribution"] * distribution
        + factors["index_match"] * index_match
    )
    return {
        "sampling": sampling,
        "point_to_sphere": point_to_sphere,
        "radius": radius,
        "distribution": distribution,
        "index_match": index_match,
        "total": total,
    }


def registration_loss(rotation, translation, true_rotation, true_translation):
    """Both terms as means over their elements."""
    difference = rotation.transpose(1, 2) @ true_rotation - torch.eye(3)
    return difference.square().mean() + (translation - true_translation).square().mean()


def correspondence_loss(points, matches, rotation, translation):
    return (posed(points, rotation, translation) - matches).norm(dim=2).mean()
