"""Views of a target by a simulated camera, and coordinates from which it sees all of it."""

from __future__ import annotations

from typing import Any

import numpy as np

from robsim.base.arrays import Array, frozen, whole
from robsim.base.errors import InputError
from robsim.calibration.impossible import off_image
from robsim.calibration.views import CalibrationViews
from robsim.run.checks import of_kind
from robsim.run.experiment import Experiment
from robsim.run.text import common_belief
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
    _check(experiment.sensing)
    scene = experiment.scene
    values = scene.coordinates(q)
    if values.ndim != 2 or not len(values):
        raise InputError(f"q: expected a row for each view, (V, {scene.nq}), got {values.shape}")
    view = _seen(scene, values, camera, target)
    seed = experiment.seed if seed is None else whole(seed, "seed", 0, 2**64)
    pixels = _spoilt(view, experiment.sensing, seed)
    pixels[off_image(pixels, scene.camera(camera).camera)] = np.nan  # which no image shows
    believed = common_belief(experiment.task) or scene
    return CalibrationViews(believed, values, pixels, camera, target)


def _check(sensing: Sensing) -> None:
    """Raise InputError for errors of images that views are not given."""
    for name in ("outliers", "dropped", "occlusions", "effects"):
        if getattr(sensing, name):
            raise InputError(
                f"sensing.{name}: views have noise and quantisation only; leave it out"
            )


def _seen(scene: Scene, q: Array, camera: str | None, target: str | None) -> Array:
    """Return the pixels (V, N, 2) of the marks, NaN outside the image."""
    view = scene.view(q, scene.camera(camera).name, scene.object(target).name)
    inside = view.visibility == Visibility.IN_IMAGE
    return np.where(inside[..., None], view.pixels, np.nan)


def _spoilt(pixels: Array, sensing: Sensing, seed: int) -> Array:
    """Return pixels with noise, rounded to whole steps."""
    draws = Draws(seed, PIXELS, np.arange(len(pixels)))
    noise = draws.normal(2 * pixels.shape[1]).reshape(pixels.shape)
    noisy = pixels + sensing.noise * noise
    step = sensing.quantisation
    return np.asarray(step * np.round(noisy / step) if step else noisy)


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
