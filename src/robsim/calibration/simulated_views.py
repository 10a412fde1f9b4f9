"""Views of a target by a simulated camera, and coordinates from which it sees all of it."""

from __future__ import annotations

import math
from functools import partial
from typing import Any

import numpy as np

from robsim.base.arrays import Array, as_integer, make_read_only
from robsim.base.errors import InputError, prefix_errors
from robsim.calibration.calibration_views import CalibrationViews, is_off_image
from robsim.run.beliefs import find_common_belief
from robsim.run.experiment import Experiment
from robsim.run.run_checks import check_instance
from robsim.statistics.random_numbers import RandomNumbers
from robsim.studies.row_simulator import RowSimulator
from robsim.studies.study_plan import START_NAME, make_plan
from robsim.vision.camera import Visibility
from robsim.world.scene import Scene
from robsim.world.sensing import Sensing

NOISE_STREAM = "calibration"  # the name of the random numbers of noise


def simulate_views(
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
    >>> simulate_views(bench, bench.start + np.zeros((3, 6)))
    <CalibrationViews 3 of 'board' by 'camera', 105 marks seen>
    """
    check_instance(experiment, Experiment, "experiment")
    scene = experiment.scene
    values = scene.coordinates(q)
    if values.ndim != 2 or not len(values):
        raise InputError(f"q: expected a row for each view, (V, {scene.nq}), got {values.shape}")
    view = _visible_pixels(scene, values, camera, target)
    seed = experiment.seed if seed is None else as_integer(seed, "seed", 0, 2**64)
    pixels = _add_image_errors(view, experiment.sensing, seed)
    pixels[is_off_image(pixels, scene.camera(camera).camera)] = np.nan  # which no image shows
    believed = find_common_belief(experiment.task) or scene
    return CalibrationViews(believed, values, pixels, camera, target)


def _visible_pixels(scene: Scene, q: Array, camera: str | None, target: str | None) -> Array:
    """Return the pixels (V, N, 2) of the marks, NaN outside the image."""
    view = scene.view(q, scene.camera(camera).name, scene.object(target).name)
    inside = view.visibility == Visibility.IN_IMAGE
    return np.where(inside[..., None], view.pixels, np.nan)


def _add_image_errors(pixels: Array, sensing: Sensing, seed: int) -> Array:
    """Return pixels as the images have them; InputError for what views are not given."""
    for each in sorted(sensing.acting(), key=lambda one: one.effect.place):
        with prefix_errors(f"sensing.{each.field}"):
            name = f"{NOISE_STREAM}{each.stream or ''}"
            pixels = each.effect.in_views(pixels, partial(_sample_normal, seed, name, pixels.shape))
    return pixels


def _sample_normal(seed: int, name: str, shape: tuple[int, ...]) -> Array:
    """Return standard normal numbers (V, ...), keyed by the number of the view."""
    return (
        RandomNumbers(seed, name, np.arange(shape[0])).normal(math.prod(shape[1:])).reshape(shape)
    )


def sample_viewpoints(
    experiment: Experiment, count: int, start: Any, *, seed: int | None = None
) -> Array:
    """Return coordinates (n, nq), n at most `count`, from which the camera sees its whole target.

    start  a sampler of a study: `LookAt`, `About`, `Anywhere` ...
    seed   of what is drawn; None: that of the experiment

    They are within the limits of the joints. What none of a thousand tries finds is left out.
    InputError: none of them sees the target.

    >>> from robsim.starts import LookAt
    >>> from robsim import examples, load_scenario
    >>> bench = load_scenario(examples.path("calibration_bench"))
    >>> sample_viewpoints(bench, 4, LookAt("board", distance=(0.4, 0.6))).shape
    (4, 6)
    """
    plan = make_plan(experiment, as_integer(count, "count", 1), seed, start)
    if plan.start is None:
        raise InputError(
            f"{START_NAME}: expected a sampler such as rs.LookAt(...), which draws them"
        )
    q, _, fits = RowSimulator(plan).starts(np.arange(plan.draws))
    if not fits.any():
        raise InputError(
            f"viewpoints: none of {plan.draws} sees the whole target: widen {START_NAME}"
        )
    return make_read_only(np.ascontiguousarray(q[fits]))
