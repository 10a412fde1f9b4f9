"""ViT-500 in pictures: marks are detected on a poster, plain and perturbed.

Starts, goal, camera and criterion are the same as in `vit_500`. Published for image-based servoing
with SIFT: 89.6 % of 500 starts, and 58.4 % with perturbed pictures. From the paper and its code
(github.com/alessandroscherl/ViT-VS): the poster of 0.8 x 0.6 m, 640 x 480 pixels, and the
perturbation of its picture. With probability 0.5 a rectangle of 2 to 33 % of the picture is black,
the brightness has a factor of 0.4 to 1.6, the contrast of 0.6 to 1.4, and Gaussian noise has a
standard deviation of 0.05.

Chosen here: the picture, with 7 x 5 dots on random boxes; a gain of 1, 20 Hz and 15 s; true depths,
as in the paper; the weightings `Border` and `Tukey`. The perturbation changes the pictures: a black
card of 29 x 29 cm (17.5 % of the poster, the mean of the paper) lies on it with probability 0.5,
the gain of the camera is 0.4 to 1.6, and its noise differs from picture to picture. The contrast
does not change. The paper matches the 24 most similar keypoints with a picture from the goal,
without a test for outliers; `KeypointDetector` matches with the poster and tests a plane.
"""

from __future__ import annotations

from dataclasses import replace
from importlib.util import find_spec

import numpy as np

from robsim.base.arrays import Array
from robsim.geometry.pose import Pose
from robsim.geometry.primitives import Block, Poster
from robsim.servo.tasks.schemes import IBVS
from robsim.servo.weightings.border import Border
from robsim.servo.weightings.robust_weightings import Tukey
from robsim.statistics.random_numbers import SUITES, uniform
from robsim.suites.camera_poses import interpolate_range
from robsim.suites.published import vit_500
from robsim.suites.suite import Suite
from robsim.vision.detectors.dot_detector import DotDetector
from robsim.vision.detectors.keypoint_detector import KeypointDetector
from robsim.vision.detectors.mark_detector import Picture
from robsim.vision.optics import Optics
from robsim.world.object import Object
from robsim.world.scene import Scene

WIDTH, HEIGHT = 0.8, 0.6  # of the poster, metres
PIXEL = 0.001  # metres
COLUMNS, ROWS, SPACING, RADIUS = 7, 5, 0.11, 0.018  # of the dots
BOXES, BOX_SIDES = 1500, (4, 34)  # pixels
INK, PAPER = 25, 230
CARD = 0.29  # side of the card, metres
SEED = 489
NOISE = 0.05 * 255
TOLERANCE = 0.003  # 0.2 px (rms) of 35 marks


def suite() -> Suite:
    """Return the suite."""
    square = vit_500.suite()
    return replace(
        square,
        name="vit_500_images",
        title="the starts of vit_500 above a poster in pictures, plain and perturbed",
        scene=make_picture_scene(square.scene),
        starts=np.tile(np.asarray(square.starts), (2, 1)),
        draws=np.tile(np.arange(square.runs), 2),
        groups={"picture": ["plain"] * square.runs + ["perturbed"] * square.runs},
        varied=perturb_half(square.runs),
        dt=0.05,
        duration=15.0,
        schemes=list_picture_schemes(),
    )


def list_picture_schemes() -> dict[str, IBVS]:
    """Return the schemes; keypoints need OpenCV, of the extra `vision`."""
    task = IBVS(weighting=(Border(), Tukey()), tolerance=TOLERANCE)
    schemes = {"IBVS, exact marks": task, "IBVS, dots": replace(task, detector=DotDetector(25.0))}
    if find_spec("cv2"):
        schemes["IBVS, keypoints"] = replace(task, detector=KeypointDetector())
    return schemes


def make_picture_scene(scene: Scene) -> Scene:
    """Return a scene with the poster instead of the square, and a card behind the poster."""
    marks = list_dots()
    poster = Poster(draw_poster(marks), width=WIDTH)
    facing = Pose.at(rpy=(np.pi, 0, 0))
    card = Block(CARD, CARD, PIXEL, albedo=0.0)
    return Scene(
        scene.robots,
        (
            Object("poster", poster, marks=marks, pose=facing),
            Object("card", card, marks=np.empty((0, 3)), on="poster", pose=Pose.at(0, 0, 0.01)),
        ),
        replace(scene.camera(), optics=Optics()),
    )


def list_dots() -> Array:
    """Return the centres (35, 3) of the dots in axes of the poster, row by row, in metres."""
    x, y = (SPACING * (np.arange(n) - (n - 1) / 2) for n in (COLUMNS, ROWS))
    across, down = np.meshgrid(x, y)
    return np.column_stack([across.ravel(), down.ravel(), np.zeros(COLUMNS * ROWS)])


def draw_poster(dots: Array) -> Picture:
    """Return the picture (600, 800) of dots in white rings on random boxes."""
    width, height = round(WIDTH / PIXEL), round(HEIGHT / PIXEL)
    grey = np.full((height, width), 150.0)
    for x, y, a, b, shade in uniform(SEED, SUITES, BOXES, 5):
        column, row = int(x * width), int(y * height)
        across, down = (int(interpolate_range(side, *BOX_SIDES)) for side in (a, b))
        grey[row : row + down, column : column + across] = 60 + 190 * shade
    y, x = np.mgrid[:height, :width] * PIXEL
    for left, top in dots[:, :2] + [(WIDTH - PIXEL) / 2, (HEIGHT - PIXEL) / 2]:
        distance = np.hypot(x - left, y - top)
        grey[distance < 2 * RADIUS] = PAPER
        share = np.clip((RADIUS - distance) / PIXEL + 0.5, 0, 1)  # of a pixel within the dot
        grey -= share * (PAPER - INK)
    return np.round(grey).astype(np.uint8)


def perturb_half(runs: int) -> dict[str, Array]:
    """Return the varied values (2 runs, ...) of plain runs, and then of perturbed runs."""
    u = uniform(SEED + 1, SUITES, runs, 4)
    half = np.array([WIDTH, HEIGHT]) / 2 - CARD / 2  # the card is within the poster
    on = np.column_stack([half * interpolate_range(u[:, :2], -1, 1), np.full(runs, -PIXEL)])
    behind = np.array([0.0, 0.0, 0.01])
    card = np.where(u[:, 2:3] < 0.5, on, behind)
    plain, ones = np.broadcast_to(behind, (runs, 3)), np.ones(runs)
    return {
        "objects.card.position": np.concatenate([plain, card]),
        "cameras.eye.optics.gain": np.concatenate([ones, interpolate_range(u[:, 3], 0.4, 1.6)]),
        "cameras.eye.optics.read_noise": np.concatenate([0 * ones, NOISE * ones]),
    }
