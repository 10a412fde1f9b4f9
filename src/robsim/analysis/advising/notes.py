"""What advice leaves out, or cannot say, in words."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from robsim.analysis.advising.linear import Linear
from robsim.analysis.equilibria import inside
from robsim.analysis.explanation.wording import counted, listed, number
from robsim.analysis.leaves import leaves, weighs_robustly
from robsim.run.experiment import Experiment
from robsim.servo.laws.gain import AdaptiveGain

COARSE = 0.5  # noise over a step of rounding, below which rounding is no noise


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
    unit = "" if controller.units[0] == "1" else f" {controller.units[0]}"
    return "" if size < controller.tolerance else f"{number(size)}{unit}"


def _imperfections(experiment: Experiment) -> Iterator[str]:
    s, a = experiment.sensing, experiment.actuation
    if s.quantisation and s.noise < COARSE * s.quantisation:
        yield "rounded pixels count as noise, and with less noise than this the loop may stick"
    if s.outliers and weighs_robustly(experiment.task):
        yield "outliers have no part in the noise, as if robust weights left out all of them"
    left = [
        name
        for name, there in (
            ("occlusions", s.occlusions),
            ("effects of your own", s.effects or a.effects),
            ("limits of velocity and acceleration", a.velocity or a.acceleration),
        )
        if there
    ]
    if left:
        yield f"{listed(left)} have no part in it"
