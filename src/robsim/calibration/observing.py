"""Views of a target by a simulated camera, and coordinates from which it sees all of it."""

from __future__ import annotations

import math
from functools import partial
from typing import Any

import numpy as np

from robsim.base.arrays import Array, frozen, whole
from robsim.base.errors import InputError, naming
from robsim.calibration.views import CalibrationViews, off_image
from robsim.run.beliefs import common_belief
from robsim.run.checks import of_kind
from robsim.run.experiment import Experiment
from robsim.statistics.random_numbers import Draws
from robsim.studies.plan import START, planned
from robsim.studies.rows import Rows
from robsim.vision.camera import Visibility
from robsim.world.scene import Scene
from robsim.world.sensing import Sensing

PIXELS = "calibration"  # the name of the random numbers of noise


def observe(
    experiment: Experiment,
    q: Any,
    *,
    camera: str | None = None,
    target: str | None = None,
    seed: int | None = None,
) -> CalibrationViews:
    """Return what a camera of an experiment truly sees of a target, with its noise.

    q       (V, nq) coordinates, one row for each view; the robot stands still in each
    camera  its name; None: the only one
    target  the name of an object; None: the only one with marks
    seed    of the noise; None: that of the experiment

    The pixels come from the true scene with `sensing.noise` and `sensing.quantisation`, NaN outside
    the image; what the views say is known is what the experiment believes. The noise of a view
    depends on the seed and its number alone. InputError: other errors of images, too few marks.

    >>> from robsim import examples, load_scenario
    >>> bench = load_scenario(examples.path("calibration_bench"))
    >>> observe(bench, bench.start + np.zeros((3, 6)))
    <CalibrationViews 3 of 'board' by 'camera', 105 marks seen>
    """
    of_kind(experiment, Experiment, "experiment")
    scene = experiment.scene
    values = scene.coordinates(q)
    if values.ndim != 2 or not len(values):
        raise InputError(f"q: expected a row for each view, (V, {scene.nq}), got {values.shape}")
    view = _seen(scene, values, camera, target)
    seed = experiment.seed if seed is None else whole(seed, "seed", 0, 2**64)
    pixels = _measured(view, experiment.sensing, seed)
    pixels[off_image(pixels, scene.camera(camera).camera)] = np.nan  # which no image shows
    believed = common_belief(experiment.task) or scene
    return CalibrationViews(believed, values, pixels, camera, target)


def _seen(scene: Scene, q: Array, camera: str | None, target: str | None) -> Array:
    """Return the pixels (V, N, 2) of the marks, NaN outside the image."""
    view = scene.view(q, scene.camera(camera).name, scene.object(target).name)
    inside = view.visibility == Visibility.IN_IMAGE
    return np.where(inside[..., None], view.pixels, np.nan)


def _measured(pixels: Array, sensing: Sensing, seed: int) -> Array:
    """Return pixels as the images have them; InputError for what views are not given."""
    for each in sorted(sensing.acting(), key=lambda one: one.effect.place):
        with naming(f"sensing.{each.field}"):
            name = f"{PIXELS}{each.stream or ''}"
            pixels = each.effect.in_views(pixels, partial(_normal, seed, name, pixels.shape))
    return pixels


def _normal(seed: int, name: str, shape: tuple[int, ...]) -> Array:
    """Return standard normal numbers (V, ...), keyed by the number of the view."""
    return Draws(seed, name, np.arange(shape[0])).normal(math.prod(shape[1:])).reshape(shape)


def viewpoints(experiment: Experiment, count: int, start: Any, *, seed: int | None = None) -> Array:
    """Return coordinates (n, nq), n at most `count`, from which the camera sees its whole target.

    start  a sampler of a study: `LookAt`, `About`, `Anywhere` ...
    seed   of what is drawn; None: that of the experiment

    They are within the limits of the joints. What none of a thousand tries finds is left out.
    InputError: none of them sees the target.

    >>> from robsim import LookAt, examples, load_scenario
    >>> bench = load_scenario(examples.path("calibration_bench"))
    >>> viewpoints(bench, 4, LookAt("board", distance=(0.4, 0.6))).shape
    (4, 6)
    """
    plan = planned(experiment, whole(count, "count", 1), seed, start)
    if plan.start is None:
        raise InputError(f"{START}: expected a sampler such as rs.LookAt(...), which draws them")
    q, _, fits = Rows(plan).starts(np.arange(plan.draws))
    if not fits.any():
        raise InputError(f"viewpoints: none of {plan.draws} sees the whole target: widen {START}")
    return frozen(np.ascontiguousarray(q[fits]))
