"""Simulated views of a target, and samples of coordinates that see the whole target."""

from __future__ import annotations

import math
from functools import partial
from typing import cast

import numpy as np
from numpy.typing import ArrayLike

from robsim.base.arrays import Array, as_integer, make_read_only
from robsim.base.errors import InputError, prefix_errors
from robsim.calibration.calibration_views import CalibrationViews, is_off_image
from robsim.calibration.view_goal import make_goal_visible
from robsim.run.beliefs import find_common_belief
from robsim.run.experiment import Experiment
from robsim.run.run_checks import check_instance
from robsim.starts.start_samplers import Start
from robsim.statistics.random_numbers import RandomNumbers
from robsim.studies.row_simulator import RowSimulator
from robsim.studies.samplers import Uniform
from robsim.studies.study_plan import START_NAME, make_plan
from robsim.vision.camera import Visibility
from robsim.vision.detectors.mark_detector import DETECTOR, MarkDetector, MarkSearch, Picture
from robsim.world.scene import Scene
from robsim.world.sensing import Sensing

NOISE_STREAM = "calibration"  # name of the stream of random noise


def simulate_views(
    experiment: Experiment,
    q: ArrayLike,
    *,
    camera: str | None = None,
    target: str | None = None,
    seed: int | None = None,
    detector: MarkDetector | str | None = None,
) -> CalibrationViews:
    """Return simulated views of a target by a camera of an experiment, with noise.

    The pixels are projections in the true scene, with `sensing.noise` and `sensing.quantisation`,
    and NaN outside the image. The scene of the views is the scene that the controller believes. The
    noise of a view depends only on the seed and the index of the view.

    Parameters
    ----------
    experiment : Experiment
        Experiment with the true scene, the belief of the controller, and `sensing`.
    q : array_like of shape (V, nq)
        Coordinates, one row for each view. The robot is at rest in each view.
    camera : str, optional
        Name of the camera. Default: the only camera.
    target : str, optional
        Name of an object. Default: the only object with marks.
    seed : int, optional
        Seed of the noise. Default: the seed of the experiment.
    detector : MarkDetector or str, optional
        Detector that measures the marks in rendered pictures of the true scene, with the `optics`
        of the camera. Default: exact image coordinates.

    Returns
    -------
    CalibrationViews
        Coordinates and pixels for `calibrate`.

    Raises
    ------
    InputError
        If `sensing` contains errors that single views do not have, such as delays, if fewer than
        four marks are seen in a view, or if the detector cannot detect the marks.

    Examples
    --------
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
    seed = experiment.seed if seed is None else as_integer(seed, "seed", 0, 2**64)
    believed = find_common_belief(experiment.task) or scene
    view = _visible_pixels(scene, values, camera, target)
    if detector is not None:
        view = _detect_marks(scene, believed, values, camera, target, detector, seed)
    pixels = _add_image_errors(view, experiment.sensing, seed)
    pixels[is_off_image(pixels, scene.camera(camera).camera)] = np.nan  # outside the image
    return CalibrationViews(believed, values, pixels, camera, target)


def _visible_pixels(scene: Scene, q: Array, camera: str | None, target: str | None) -> Array:
    """Return the pixels (V, N, 2) of the marks, NaN outside the image."""
    view = scene.view(q, scene.camera(camera).name, scene.object(target).name)
    inside = view.visibility == Visibility.IN_IMAGE
    return np.where(inside[..., None], view.pixels, np.nan)


def _detect_marks(
    scene: Scene,
    believed: Scene,
    q: Array,
    camera: str | None,
    target: str | None,
    detector: MarkDetector | str,
    seed: int,
) -> Array:
    """Return the pixels (V, N, 2) that a detector measures in pictures, NaN for missed marks."""
    eye, thing = scene.camera(camera), scene.object(target)
    found = cast(MarkDetector, DETECTOR.check(detector, "detector"))
    with prefix_errors("detector"):
        found.check(thing.mark_target, thing.marks, eye.camera)
    pictures = scene.picture(q, eye.name, seed=seed)
    places = np.rint(scene.view(q, eye.name, thing.name).pixels)
    thing, eye = believed.object(thing.name), believed.camera(eye.name)
    search = MarkSearch(thing.mark_target, thing.marks, eye.camera, places)
    return found.find(cast(Picture, pictures), search)


def _add_image_errors(pixels: Array, sensing: Sensing, seed: int) -> Array:
    """Return pixels with the image errors; raise InputError for errors that views do not have."""
    for each in sorted(sensing.list_active(), key=lambda error: error.effect.place):
        with prefix_errors(f"sensing.{each.field}"):
            name = f"{NOISE_STREAM}{each.stream or ''}"
            pixels = each.effect.in_views(pixels, partial(_sample_normal, seed, name, pixels.shape))
    return pixels


def _sample_normal(seed: int, name: str, shape: tuple[int, ...]) -> Array:
    """Return standard normal samples (V, ...), which depend on the index of the view."""
    return (
        RandomNumbers(seed, name, np.arange(shape[0])).normal(math.prod(shape[1:])).reshape(shape)
    )


def sample_viewpoints(
    experiment: Experiment | Scene, count: int, start: Start | Uniform, *, seed: int | None = None
) -> Array:
    """Return samples (n, nq) of coordinates that see the whole target, with n at most `count`.

    The coordinates are within the limits of the joints. A sample is left out if none of a thousand
    attempts sees the whole target. No goal is needed: samplers about a goal, such as `About`, use a
    view of the whole target from the front if the experiment has no goal that the camera sees.

    Parameters
    ----------
    experiment : Experiment or Scene
        Experiment with the scene, or a scene with one camera and one object with marks.
    count : int
        Number of samples.
    start : Start or Uniform
        Sampler of configurations from `robsim.starts`: `LookAt`, `About`, `Anywhere` ...
    seed : int, optional
        Seed of the samples. Default: the seed of the experiment, 0 for a scene.

    Returns
    -------
    ndarray of shape (n, nq)
        Coordinates of the views.

    Raises
    ------
    InputError
        If no sample sees the whole target.

    Examples
    --------
    >>> from robsim.starts import LookAt
    >>> from robsim import examples, load_scenario
    >>> bench = load_scenario(examples.path("calibration_bench"))
    >>> sample_viewpoints(bench, 4, LookAt("board", distance=(0.4, 0.6))).shape
    (4, 6)
    """
    plan = make_plan(make_goal_visible(experiment), as_integer(count, "count", 1), seed, start)
    if plan.start is None:
        raise InputError(
            f"{START_NAME}: expected a sampler of configurations such as rs.starts.LookAt(...)"
        )
    rows = RowSimulator(plan)
    q, _, usable = rows.starts(np.arange(plan.draws))
    if not usable.any():
        raise InputError(
            f"viewpoints: none of {plan.draws} samples sees the whole target: "
            f"{rows.describe_rejections()}"
        )
    return make_read_only(np.ascontiguousarray(q[usable]))
