"""Train the network of `network.py` on rendered pictures of procedural posters.

    cd examples; python -m pose_network.train [--steps 1000] [--seed 1] [--weights FILE]

Needs PyTorch (`pip install torch`); the servo does not. The pictures are functions of the seed. The
columns are: wall and CPU time, step, mean surprise of the true matches, mean of d / (1 + d) for
matches that are d cells off, relative error of the pose, and the medians of the errors of position
(in distances of the goal) and rotation (in radians), for rolls above and below 0.3 rad.
"""

import argparse
import time
from typing import NamedTuple

import numpy as np
import torch
from pose_network import network
from pose_network.network import CELL, CELLS, COLUMNS, FOCAL, HEIGHT, RIDGE, ROWS, WEIGHTS, WIDTH
from pose_network.posters import TRAINED, draw_poster
from pose_network.views import build_poses, invert, make_renderer
from torch.nn.functional import conv2d, normalize

RATE = 3e-3
POSTERS, GROUP, STARTS = 1500, 16, 8
FEATURES, HIDDEN = 32, 16
SAMPLED = 128  # cells of the goal in one batch


def make_parameters(seed):
    """Return the parameters of the network at the start of the training."""
    generator = torch.Generator().manual_seed(seed)

    def weight(*shape, gain=1.0):
        deviation = gain * np.sqrt(2 / np.prod(shape[1:]))
        return torch.randn(*shape, generator=generator) * deviation

    parameters = {
        "a": weight(16, 1, 5, 5),
        "b": weight(32, 16, 3, 3),
        "c": weight(32, 32, 3, 3, gain=0.7),
        "d": weight(32, 32, 3, 3, gain=0.7),
        "e": weight(FEATURES, 32, 3, 3),
        "p": weight(HIDDEN, FEATURES + 4),
        "q": weight(1, HIDDEN, gain=0.3),
    }
    biases = {f"{name}0": torch.zeros(len(value)) for name, value in parameters.items()}
    parameters = parameters | biases | {"sharpness": torch.tensor(2.3)}
    return {name: value.requires_grad_() for name, value in parameters.items()}


def extract(p, pictures, kind=torch.bfloat16):
    """Return the features (n, FEATURES, CELLS) of pictures (n, h, w).

    Convolutions in bfloat16 take a tenth of the time on processors that have them.
    """

    def filtered(x, name, **shape):
        kernel = p[name].to(kind).contiguous(memory_format=torch.channels_last)
        return conv2d(x, kernel, p[name + "0"].to(kind), **shape)

    x = pictures[:, None]
    x = (x - x.mean((2, 3), keepdim=True)) / (x.std((2, 3), keepdim=True, correction=0) + 4)
    x = filtered(
        x.to(kind).contiguous(memory_format=torch.channels_last), "a", stride=2, padding=2
    ).relu()
    x = filtered(x, "b", stride=2, padding=1).relu()
    x = x + filtered(x, "c", padding=1).relu()
    x = x + filtered(x, "d", padding=2, dilation=2).relu()
    x = filtered(x, "e", padding=1)
    return normalize(x.flatten(2).float(), dim=1)


PLACES = torch.tensor(network.PLACES, dtype=torch.float32)
PITCH = CELL / FOCAL
LAST = torch.tensor([COLUMNS - 1.0, ROWS - 1.0])


WINDOWS, INSIDE = torch.from_numpy(network.WINDOWS), torch.from_numpy(network.INSIDE)


def match(p, goal, seen):
    """Return the logarithms of matches (n, CELLS, CELLS), the matched places and weights."""
    correlation = torch.einsum("nfi,nfj->nij", goal, seen)
    logs = (correlation * p["sharpness"].exp()).log_softmax(2)
    best = logs.detach().argmax(2)
    near = WINDOWS[best]
    shares = torch.gather(logs, 2, near).exp() * INSIDE[best]
    total = shares.sum(2)
    shares = shares / (total[..., None] + 1e-9)
    around = PLACES[near]
    places = (shares[..., None] * around).sum(2)
    spread = (shares * (around - places[:, :, None]).square().sum(3)).sum(2)
    peak = torch.gather(correlation, 2, best[..., None])[..., 0]
    hints = torch.stack([total, spread / PITCH**2, peak, total * peak], dim=2)
    hidden = (torch.cat([goal.transpose(1, 2), hints], 2) @ p["p"].T + p["p0"]).relu()
    return logs, places, torch.sigmoid(hidden @ p["q"].T + p["q0"])[..., 0]


def fit(cells, places, weights):
    """Return the homography (n, 3, 3) from places (c, 2) at the goal to places (n, c, 2)."""
    (x, y), (u, v) = cells.T, places.unbind(2)
    x, y = x.expand_as(u), y.expand_as(u)
    one, zero = torch.ones_like(u), torch.zeros_like(u)
    first = torch.stack([x, y, one, zero, zero, zero, -u * x, -u * y], 2)
    second = torch.stack([zero, zero, zero, x, y, one, -v * x, -v * y], 2)
    rows = torch.cat([first, second], 1).double()
    aims = torch.cat([u - x, v - y], 1).double()
    weighted = rows * torch.cat([weights, weights], 1)[..., None].double()
    weighted = weighted / len(cells)
    normal = weighted.transpose(1, 2) @ rows + RIDGE * torch.eye(8, dtype=torch.float64)
    change = torch.linalg.solve(normal, (weighted * aims[..., None]).sum(1))
    matrix = torch.eye(3, dtype=torch.float64) + torch.cat(
        [change, torch.zeros(len(change), 1, dtype=torch.float64)], 1
    ).reshape(-1, 3, 3)
    return matrix


def decode(H):
    """Return the pose (n, 6) of the camera from H = R' - R' t e3' up to a factor."""
    scale = 0.5 * (H[:, :, 0].norm(dim=1) + H[:, :, 1].norm(dim=1)) + 1e-9
    h1, h2, h3 = (H / scale[:, None, None]).unbind(2)
    r3 = normalize(torch.linalg.cross(h1, h2), dim=1)
    c = normalize(h1 + h2, dim=1)
    d = torch.linalg.cross(c, r3)
    r1, r2 = (c + d) / 2**0.5, (c - d) / 2**0.5
    axis = 0.5 * torch.stack(  # of R, the transpose of (r1, r2, r3)
        [-r2[:, 2] + r3[:, 1], -r3[:, 0] + r1[:, 2], -r1[:, 1] + r2[:, 0]], 1
    )
    sine = (axis.square().sum(1) + 1e-12).sqrt()
    cosine = 0.5 * (r1[:, 0] + r2[:, 1] + r3[:, 2] - 1)
    return torch.cat([r3 - h3, axis * (torch.atan2(sine, cosine) / sine)[:, None]], 1)


class Batch(NamedTuple):
    """Pictures of goals and starts, and the truth of each start.

    `pictures` are (GROUP, 1 + STARTS, h, w), the homographies `H` from the goal to the start
    (GROUP, STARTS, 3, 3), the `poses` (p, theta u) of the starts (GROUP, STARTS, 6), and `inside`
    (GROUP, CELLS) are the cells of the goal that see the poster.
    """

    pictures: np.ndarray
    H: np.ndarray
    poses: np.ndarray
    inside: np.ndarray


class Data:
    """Batches of rendered pictures."""

    def __init__(self, seed):
        self.rng = np.random.default_rng(seed)
        self.pictures = [draw_poster(TRAINED[k % len(TRAINED)], 10_000 + k) for k in range(POSTERS)]

    def draw_goals(self, count):
        """Return poses (count, 4, 4) of posters in the camera at the goal, about 1 m away."""
        rng = self.rng
        vectors = rng.normal(0, np.radians(3), (count, 3))
        vectors[:, 2] = rng.uniform(-np.pi, np.pi, count) * (rng.random(count) < 0.7)
        shift = np.column_stack([rng.uniform(-0.08, 0.08, (count, 2)), np.ones(count)])
        return build_poses(shift, vectors)

    def draw_moves(self, count):
        """Return positions and rotation vectors (count, 3), of the camera in axes of the goal."""
        rng = self.rng
        small = rng.random(count) < 0.35
        scale = np.where(small, 10 ** rng.uniform(-2, -0.5, count), 1)[:, None]
        vectors = np.radians([24, 24, 28]) * rng.uniform(-1, 1, (count, 3)) * scale
        positions = rng.uniform(-0.13, 0.13, (count, 3))
        positions[:, 2] = np.where(
            small, rng.uniform(-0.5, 0.5, count), rng.uniform(-0.6, 0.2, count)
        )
        return positions * scale, vectors

    def draw(self):
        """Return a `Batch`, with another light, contrast and noise in each picture."""
        pairs = [self.draw_group(T) for T in self.draw_goals(GROUP)]
        pictures, *truth = (np.array(column) for column in zip(*pairs, strict=True))
        return Batch(self.spoil(pictures), *truth)

    def draw_group(self, T):
        """Return the arrays of one goal of a `Batch`, with the poster at T in its camera."""
        width = self.rng.uniform(0.45, 1.1)
        poster = self.pictures[self.rng.integers(POSTERS)]
        renderer = make_renderer(poster, width, self.rng.uniform(60, 200))
        positions, vectors = self.draw_moves(STARTS)
        moves = invert(build_poses(positions, vectors))
        pictures = renderer.draw_many(np.concatenate([T[None], moves @ T])[:, None])
        normal = T[:3, 2] / (T[:3, 2] @ T[:3, 3])
        H = moves[:, :3, :3] + moves[:, :3, 3:] * normal
        poses = np.column_stack([-moves[:, :3, 3], vectors])
        rays = np.column_stack([PLACES.numpy(), np.ones(CELLS)])
        points = (rays / (rays @ normal)[:, None] - T[:3, 3]) @ T[:3, :3]
        half = 0.5 * width * np.array([1, poster.shape[0] / poster.shape[1]])
        return pictures, H, poses, (np.abs(points[:, :2]) < half).all(axis=1)

    def draw_cells(self):
        """Return some of the cells of the goal."""
        return torch.from_numpy(self.rng.choice(CELLS, SAMPLED, replace=False))

    def spoil(self, pictures):
        """Return pictures with another light, contrast and noise."""
        rng, shape = self.rng, (*pictures.shape[:2], 1, 1)
        x, y = np.linspace(-1, 1, WIDTH), np.linspace(-1, 1, HEIGHT)[:, None]
        slope = rng.normal(0, 0.1, (2, *shape)) * (rng.random((2, *shape)) < 0.5)
        light = 1 + slope[0] * x + slope[1] * y
        gamma, gain = rng.uniform(0.75, 1.3, shape), rng.uniform(0.6, 1.2, shape)
        values = (255 * (pictures / 255) ** gamma.astype(np.float32) * gain * light).astype(
            np.float32
        )
        deviation = rng.uniform(0, 3, shape) * (rng.random(shape) < 0.5)
        values += rng.standard_normal(values.shape, dtype=np.float32) * deviation.astype(np.float32)
        return np.clip(np.rint(values), 0, 255).astype(np.float32)


def find_true_places(H, cells):
    """Return the columns and rows (n, c, 2) of cells of the goal in pictures, and if they exist."""
    aims = (torch.from_numpy(H) @ torch.cat([cells, torch.ones(len(cells), 1)], 1).double().T).mT
    in_front = aims[..., 2] > 0.1
    at = (aims[..., :2] / aims[..., 2:].clamp(min=0.1)).float()
    at = (at - PLACES[0]) / PITCH
    return at, in_front & (at >= 0).all(2) & (at <= LAST).all(2)


def interpolate(logs, at):
    """Return the logarithms (n, c) of matches at columns and rows (n, c, 2)."""
    low = torch.minimum(at.clamp(min=0), LAST - 1e-3).floor()
    x, y = (at - low).clamp(0, 1).unbind(2)
    first = (low[..., 1] * COLUMNS + low[..., 0]).long().clamp(0, CELLS - COLUMNS - 2)
    corners = first[..., None] + torch.tensor([0, 1, COLUMNS, COLUMNS + 1])
    shares = torch.stack([(1 - x) * (1 - y), x * (1 - y), (1 - x) * y, x * y], 2)
    return (shares * torch.gather(logs, 2, corners)).sum(2)


def measure_poses(found, true):
    """Return the relative errors (n,) of poses (n, 6), of their well determined parts.

    A narrow field hardly tells a translation along x from a rotation about y. A loss of both would
    teach the network to underestimate them, so that the loop would correct them slowly. The loss
    has the shifts of the picture, p_x + theta u_y and p_y - theta u_x, instead.
    """
    error = found - true
    shift = [error[:, 0] + error[:, 4], error[:, 1] - error[:, 3]]
    terms = torch.stack([*shift, error[:, 2], error[:, 5]], 1)
    terms = terms / (0.01 + true.abs().mean(1, keepdim=True))
    return (torch.sqrt(0.01 + terms**2) - 0.1).clamp(max=20).mean(1)


def compute_loss(p, cells, batch):
    """Return the loss of a batch for some cells of the goals, and numbers to print."""
    features = extract(p, torch.from_numpy(batch.pictures).flatten(0, 1))
    features = features.unflatten(0, (GROUP, 1 + STARTS))
    goal = features[:, :1, :, cells].expand(-1, STARTS, -1, -1).flatten(0, 1)
    logs, places, weights = match(p, goal, features[:, 1:].flatten(0, 1))
    at, valid = find_true_places(batch.H.reshape(-1, 3, 3), PLACES[cells])
    valid = valid & torch.from_numpy(batch.inside)[:, cells].repeat_interleave(STARTS, 0)
    count = valid.sum().clamp(min=1)
    surprise = -(interpolate(logs, at) * valid).sum() / count
    miss = ((places - PLACES[0]) / PITCH - at).abs().sum(2)
    miss = (miss / (1 + miss) * valid).sum() / count
    found, true = decode(fit(PLACES[cells], places, weights)), batch.poses.reshape(-1, 6)
    true, enough = torch.from_numpy(true), valid.sum(1) > 12
    wrong = (measure_poses(found, true) * enough).sum() / enough.sum().clamp(min=1)
    numbers = [float(each.detach()) for each in (surprise, miss, wrong)]
    for group in (true[:, 5].abs() > 0.3, true[:, 5].abs() <= 0.3):
        error = (found - true)[group & enough].detach()
        numbers += [float(error[:, k : k + 3].norm(dim=1).median()) for k in (0, 3)]
    return surprise + miss + 0.5 * wrong, numbers


@torch.no_grad()
def store(path, p, data):
    """Store the weights, and a pair of pictures with the pose of this network for tests."""
    data.rng = np.random.default_rng(0)
    pictures = data.draw().pictures[0, :2]
    goal, seen = extract(p, torch.from_numpy(pictures), torch.float32).split(1)
    _, places, weights = match(p, goal, seen)
    pose = decode(fit(PLACES, places, weights))[0]
    check = {"check_pictures": pictures.astype(np.uint8), "check_pose": pose.numpy()}
    np.savez_compressed(path, **{name: value.numpy() for name, value in p.items()}, **check)


def train(steps, seed, path):
    """Train for a number of steps, and store the weights."""
    began = time.perf_counter(), time.process_time()
    data, p = Data(seed), make_parameters(seed)
    optimiser = torch.optim.AdamW(p.values(), lr=0.0, weight_decay=1e-4, betas=(0.9, 0.98))
    sums = []
    for step in range(steps):
        descent = 0.02 + 0.98 * 0.5 * (1 + np.cos(np.pi * step / steps))
        for group in optimiser.param_groups:
            group["lr"] = RATE * min(1, step / 50) * descent
        loss, numbers = compute_loss(p, data.draw_cells(), data.draw())
        optimiser.zero_grad()
        loss.backward()
        torch.nn.utils.clip_grad_norm_(p.values(), 1.0)
        optimiser.step()
        sums.append(numbers)
        if (step + 1) % 50 == 0:
            spent = time.perf_counter() - began[0], time.process_time() - began[1]
            row = " ".join(f"{each:7.3f}" for each in np.mean(sums, axis=0))
            print(f"{spent[0]:5.0f} s {spent[1]:5.0f} s {step + 1:6d} {row}", flush=True)
            sums = []
    store(path, p, data)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--steps", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--weights", default=WEIGHTS)
    chosen = parser.parse_args()
    torch.set_num_threads(chosen.threads)
    train(chosen.steps, chosen.seed, chosen.weights)
