"""The pose of a camera relative to a goal, from two pictures, by a small network in NumPy.

1. Five convolutions give each cell of 4 x 4 pixels a feature of 32 numbers.
2. The goal has these features for several rolls of its picture; the roll with the most similar
   cells is used.
3. Each cell of the goal is matched with the cells of the picture; the match is the mean place of
   the 5 x 5 cells around the most similar one, weighted by the softmax of the similarities.
4. A layer of 16 neurons weights each match.
5. The weighted matches give a homography by least squares, and the homography gives the pose
   for a plane that faces the goal: H = R' - R' t e3', in units of the distance of the goal.

Pictures have 80 x 60 pixels and a focal length of 80 pixels. Larger pictures of the same view are
reduced by the mean of their pixels.
"""

from pathlib import Path
from typing import NamedTuple

import numpy as np

WIDTH, HEIGHT, FOCAL, CELL = 80, 60, 80.0, 4
ROWS, COLUMNS = HEIGHT // CELL, WIDTH // CELL
CELLS = ROWS * COLUMNS
RIDGE = 1e-7  # of the normal equations, so that few matches give a homography, too
ROLLS = np.radians(np.arange(-100, 101, 20))
WEIGHTS = Path(__file__).parent / "weights.npz"


def list_places():
    """Return the normalised coordinates (CELLS, 2) of the middles of the cells."""
    x = (np.arange(COLUMNS) * CELL + (CELL - WIDTH) / 2) / FOCAL
    y = (np.arange(ROWS) * CELL + (CELL - HEIGHT) / 2) / FOCAL
    return np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)


def list_windows():
    """Return the cells (CELLS, 25) around each cell, and which of them are in the picture."""
    offset = np.arange(-2, 3)
    row, column = np.divmod(np.arange(CELLS), COLUMNS)
    row, column = row[:, None, None] + offset[:, None], column[:, None, None] + offset
    inside = (row >= 0) & (row < ROWS) & (column >= 0) & (column < COLUMNS)
    index = row.clip(0, ROWS - 1) * COLUMNS + column.clip(0, COLUMNS - 1)
    return index.reshape(CELLS, 25), inside.reshape(CELLS, 25)


class RolledGoal(NamedTuple):
    """The picture at the goal, seen by a camera rolled by an angle.

    `features` are (32, CELLS), `inside` (CELLS,) are the cells that the picture covers, and
    `offset` (6,) is the pose that the network finds between this picture and itself.
    """

    angle: float
    features: np.ndarray
    inside: np.ndarray
    offset: np.ndarray


PLACES = list_places()
WINDOWS, INSIDE = list_windows()


class PoseNetwork:
    """The trained network: `extract` the features of pictures, then `compare` them."""

    def __init__(self, path=WEIGHTS):
        with np.load(path) as stored:
            names = [name for name in stored.files if not name.startswith("check")]
            self.p = {name: stored[name].astype(np.float32) for name in names}

    def prepare_goal(self, picture):
        """Return the rolled goals of the picture (h, w) at the goal."""
        return [self._roll_goal(reduce_picture(picture), angle) for angle in ROLLS]

    def _roll_goal(self, picture, angle):
        """Return a picture (60, 80) at the goal for a camera rolled by an angle."""
        rolled, inside = roll_picture(picture, angle)
        features = self.extract(rolled)
        goal = RolledGoal(angle, features, inside, np.zeros(6))
        # A copy, as BLAS rounds a matrix times its own transpose in another way than two matrices.
        return goal._replace(offset=self.compare(goal, features.copy()))

    def measure_pose(self, goal, picture):
        """Return the pose (6,) of the camera of a picture (h, w) relative to the goal.

        The pose is (p, theta u): the position of the camera minus the position of the goal, in axes
        of the camera and in units of the distance of the goal, and the rotation vector.
        """
        seen = self.extract(reduce_picture(picture))
        best = self.choose_roll(goal, seen)
        pose = self.compare(best, seen) - best.offset
        return np.concatenate([pose[:3], add_roll(pose[3:], best.angle)])

    def choose_roll(self, goal, seen):
        """Return the rolled goal that is most similar to the features (32, CELLS) of a picture."""
        return goal[int(np.argmax([score_similarity(each, seen) for each in goal]))]

    def extract(self, picture):
        """Return the features (32, CELLS) of a picture (60, 80)."""
        x = ((picture - picture.mean()) / (picture.std() + np.float32(4)))[None]
        x = np.maximum(self._filter(x, "a", stride=2), 0)
        x = np.maximum(self._filter(x, "b", stride=2), 0)
        x = x + np.maximum(self._filter(x, "c"), 0)
        x = x + np.maximum(self._filter(x, "d", dilation=2), 0)
        x = self._filter(x, "e").reshape(-1, CELLS)
        return x / np.sqrt((x * x).sum(axis=0))

    def _filter(self, x, name, stride=1, dilation=1):
        """Return the convolution of x (channels, h, w) with the kernel of a name, same size."""
        kernel = self.p[name]
        size = dilation * (kernel.shape[2] - 1) + 1
        padded = np.pad(x, ((0, 0), (size // 2, size // 2), (size // 2, size // 2)))
        windows = np.lib.stride_tricks.sliding_window_view(padded, (size, size), axis=(1, 2))
        windows = windows[:, ::stride, ::stride, ::dilation, ::dilation]
        columns = windows.transpose(0, 3, 4, 1, 2).reshape(kernel[0].size, -1)
        values = kernel.reshape(len(kernel), -1) @ columns + self.p[name + "0"][:, None]
        return values.reshape(len(kernel), *windows.shape[1:3])

    def compare(self, goal, seen):
        """Return the pose (6,) relative to a rolled goal, from features (32, CELLS)."""
        places, weights = self.match(goal.features, seen)
        return decode_homography(fit_homography(places, weights * goal.inside))

    def match(self, goal, seen):
        """Return the places (CELLS, 2) in the picture of the cells of the goal, and weights."""
        similarity = goal.T @ seen
        best = similarity.argmax(axis=1)
        shares = np.exp(similarity * np.exp(self.p["sharpness"]))
        sums = shares.sum(axis=1)
        near = np.take_along_axis(shares, WINDOWS[best], axis=1) * INSIDE[best]
        total = near.sum(axis=1)
        around, near = PLACES[WINDOWS[best]], near / total[:, None]
        places = (near[..., None] * around).sum(axis=1)
        spread = (near * ((around - places[:, None]) ** 2).sum(axis=2)).sum(axis=1)
        total, peak = total / sums, similarity.max(axis=1)
        hints = [total, spread / (CELL / FOCAL) ** 2, peak, total * peak]
        inputs = np.concatenate([goal, hints]).astype(np.float32)
        hidden = np.maximum(self.p["p"] @ inputs + self.p["p0"][:, None], 0)
        level = (self.p["q"] @ hidden + self.p["q0"][:, None])[0].astype(float)
        return places, 1 / (1 + np.exp(-level))


def reduce_picture(picture):
    """Return a picture as float32 (60, 80), the means of blocks of a larger one."""
    rows, columns = np.shape(picture)
    n = columns // WIDTH
    if n < 1 or (rows, columns) != (n * HEIGHT, n * WIDTH):
        raise ValueError(f"a picture of {columns} x {rows} pixels; expected multiples of 80 x 60")
    blocks = np.asarray(picture, dtype=np.float32).reshape(HEIGHT, n, WIDTH, n)
    return blocks.mean(axis=(1, 3))


def roll_picture(picture, angle):
    """Return the picture (60, 80) of a camera rolled by an angle, and the cells inside (CELLS,)."""
    c, s = np.cos(angle), np.sin(angle)
    x, y = np.meshgrid(np.arange(WIDTH) - (WIDTH - 1) / 2, np.arange(HEIGHT) - (HEIGHT - 1) / 2)
    u, v = c * x - s * y + (WIDTH - 1) / 2, s * x + c * y + (HEIGHT - 1) / 2
    inside = (u >= 0) & (u <= WIDTH - 1) & (v >= 0) & (v <= HEIGHT - 1)
    column, row = u.clip(0, WIDTH - 1.001), v.clip(0, HEIGHT - 1.001)
    i, j = row.astype(int), column.astype(int)
    below, right = row - i, column - j
    upper = picture[i, j] * (1 - right) + picture[i, j + 1] * right
    lower = picture[i + 1, j] * (1 - right) + picture[i + 1, j + 1] * right
    border = np.concatenate([picture[0], picture[-1], picture[:, 0], picture[:, -1]])
    rolled = np.where(inside, upper * (1 - below) + lower * below, np.median(border))
    blocks = inside.reshape(ROWS, CELL, COLUMNS, CELL).mean(axis=(1, 3)).ravel()
    return rolled.astype(np.float32), blocks > 0.9


def score_similarity(goal, seen):
    """Return the mean similarity of the cells of a rolled goal to their matches."""
    peaks = (goal.features.T @ seen).max(axis=1)
    return peaks @ goal.inside / goal.inside.sum()


def add_roll(vector, angle):
    """Return the rotation vector of a roll by an angle, followed by a rotation vector (3,)."""
    size = np.linalg.norm(vector)
    q, p = np.cos(size / 2), 0.5 * np.sinc(size / (2 * np.pi)) * vector
    c, s = np.cos(angle / 2), np.sin(angle / 2)
    w, xyz = c * q - s * p[2], c * p + s * np.array([-p[1], p[0], q])
    xyz, w = (xyz, w) if w > 0 else (-xyz, -w)
    sine = np.linalg.norm(xyz)
    return xyz * (2 * np.arctan2(sine, w) / sine if sine > 1e-12 else 2.0)


def fit_homography(places, weights):
    """Return the homography (3, 3) from the cells of the goal to places, by least squares."""
    (x, y), (u, v) = PLACES.T, places.T
    one, zero = np.ones(CELLS), np.zeros(CELLS)
    first = np.array([x, y, one, zero, zero, zero, -u * x, -u * y]).T
    second = np.array([zero, zero, zero, x, y, one, -v * x, -v * y]).T
    rows, aims = np.concatenate([first, second]), np.concatenate([u - x, v - y])
    weighted = rows * np.concatenate([weights, weights])[:, None] / CELLS
    normal = weighted.T @ rows + RIDGE * np.eye(8)
    change = np.linalg.solve(normal, weighted.T @ aims)
    return np.eye(3) + np.append(change, 0.0).reshape(3, 3)


def decode_homography(H):
    """Return the pose (p, theta u) of a homography H = R' - R' t e3' up to a factor, p = R' t."""
    h1, h2, h3 = (H / np.mean(np.linalg.norm(H[:, :2], axis=0))).T
    r3, c = normalise(np.cross(h1, h2)), normalise(h1 + h2)
    d = np.cross(c, r3)
    r1, r2 = (c + d) / np.sqrt(2), (c - d) / np.sqrt(2)
    axis = 0.5 * np.array([r3[1] - r2[2], r1[2] - r3[0], r2[0] - r1[1]])
    sine = np.sqrt(axis @ axis + 1e-24)
    angle = np.arctan2(sine, 0.5 * (r1[0] + r2[1] + r3[2] - 1))
    return np.concatenate([r3 - h3, axis * angle / sine])


def normalise(vector):
    """Return the unit vector of a vector."""
    return vector / np.linalg.norm(vector)
