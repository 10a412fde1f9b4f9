"""What advice leaves out, or cannot say, in words."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from robsim.analysis.advising.linear import Linear
from robsim.analysis.equilibria import inside
from robsim.analysis.explanation.wording import counted, in_unit, listed
from robsim.analysis.leaves import leaves, weighs_robustly
from robsim.base.arrays import is_any
from robsim.run.experiment import Experiment
from robsim.servo.laws.gain import AdaptiveGain
from robsim.world.imperfections.image_effect import ImageTiming


def notes(experiment: Experiment, linear: Linear) -> Iterator[str]:
    """Yield what is not in the advice."""
    free = linear.field.n - linear.response.basis.shape[1]
    if free:
        yield f"{counted(free, 'motion')} that the features leave free have no part in it"
    if linear.field.unreached:
        yield "wheels cannot move sideways: the sideways distance at the start is not corrected"
    if not inside(experiment.task.bind(experiment.scene), linear.q).all():
        yield "it would come to rest outside of the limits of a joint or of an image"
    left = _left(linear)
    if left:
        yield f"it comes to rest with an error of {left}: the goal is out of reach, or not believed"
    if any(isinstance(leaf.gain, AdaptiveGain) for leaf in leaves(experiment.task)):
        yield "of an adaptive gain the one at zero error counts"
    if linear.timing.lost and not linear.scaled.plain:
        yield "lost images have no part in the largest gain"
    yield from _imperfections(experiment)


def _left(linear: Linear) -> str:
    """Return the largest error at rest, where it is above the tolerance."""
    controller = linear.field.controller
    size = float(np.abs(linear.field.command(linear.q).error).max())
    return "" if size < controller.tolerance else in_unit(size, controller.units[0])


def _imperfections(experiment: Experiment) -> Iterator[str]:
    images = experiment.sensing.acting()
    robust = weighs_robustly(experiment.task)
    for one in images:
        beside = [each.effect.deviation(True) for each in images if each is not one]
        yield from one.effect.caveats(robust, math.hypot(*beside))
    left = dict.fromkeys(_left_out(experiment))
    if left:
        yield f"{listed(list(left))} have no part in it"


def _left_out(experiment: Experiment) -> Iterator[str]:
    """Yield the nouns of the imperfections that the linear loop does not have."""
    scene = experiment.scene
    for effect in (each.effect for each in experiment.sensing.acting()):
        timed = effect.timing(experiment.dt) != ImageTiming()
        if effect.left_out and not (timed or effect.deviation(robust=False)):
            yield effect.left_out
    for other in (each.effect for each in experiment.actuation.acting()):
        lags = is_any(other.response(scene.nv).lag)
        if other.left_out and not (lags or other.deviation(scene).any()):
            yield other.left_out
