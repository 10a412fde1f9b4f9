"""Caveats of advice, in words: properties that the linear loop neglects."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from robsim.analysis.equilibrium_search import is_within_bounds
from robsim.analysis.explanation.text_format import format_count, format_list, format_quantity
from robsim.analysis.linearisation.constraint_use import find_nearest_constraint
from robsim.analysis.linearisation.linear_loop import LinearLoop
from robsim.analysis.task_tree import has_robust_weighting, list_servo_tasks
from robsim.base.arrays import is_any_nonzero
from robsim.run.experiment import Experiment
from robsim.servo.laws.gain import AdaptiveGain
from robsim.world.imperfections.image_effect import ImageTiming


def generate_caveats(experiment: Experiment, linear: LinearLoop) -> Iterator[str]:
    """Yield the properties of an experiment that the advice neglects."""
    free = linear.field.n - linear.response.basis.shape[1]
    if free:
        yield f"{format_count(free, 'motion')} that the features leave free are not considered"
    if linear.field.unactuated:
        yield "wheels cannot move sideways: the sideways distance at the start is not corrected"
    if not is_within_bounds(experiment.task.bind(experiment.scene), linear.q).all():
        yield "at rest a joint is beyond its limits, or a mark outside of its image"
    residual = _residual_error(linear)
    if residual:
        yield f"the error at rest is {residual}: the goal is out of reach, or beliefs are wrong"
    if any(isinstance(leaf.gain, AdaptiveGain) for leaf in list_servo_tasks(experiment.task)):
        yield "the gain at zero error stands for an adaptive gain"
    is_covered = linear.gain_dependence.is_image_only and linear.drives is None
    if linear.timing.lost and not is_covered:
        yield "lost images are not considered in the largest gain"
    yield from _imperfection_caveats(experiment)
    if linear.drives is not None:
        from robsim.analysis.linearisation.drive_advice import generate_drive_caveats

        yield from generate_drive_caveats(linear)
    controller = experiment.task.bind(experiment.scene)
    nearest = find_nearest_constraint(controller, experiment.start, experiment.dt)
    if nearest is not None:
        name, share = nearest
        acts = "it acts there" if share > 1.0 else f"the law uses {100 * share:.2g} % of its bound"
        yield f"the constraint nearest at the start is {name}: {acts}"


def _residual_error(linear: LinearLoop) -> str:
    """Return the largest error at rest with its unit; empty if it is below the tolerance."""
    controller = linear.field.controller
    size = float(np.abs(linear.field.command(linear.q).error).max())
    return "" if size < controller.tolerance else format_quantity(size, controller.units[0])


def _imperfection_caveats(experiment: Experiment) -> Iterator[str]:
    """Yield the caveats of the image and joint imperfections."""
    images = experiment.sensing.list_active()
    robust = has_robust_weighting(experiment.task)
    for one in images:
        beside = [each.effect.deviation(True) for each in images if each is not one]
        yield from one.effect.caveats(robust, math.hypot(*beside))
    ignored = dict.fromkeys(_ignored_imperfections(experiment))
    if ignored:
        yield f"{format_list(list(ignored))} are not considered"


def _ignored_imperfections(experiment: Experiment) -> Iterator[str]:
    """Yield the nouns of the imperfections that the linear loop neglects."""
    scene = experiment.scene
    for effect in (each.effect for each in experiment.sensing.list_active()):
        timed = effect.timing(experiment.dt) != ImageTiming()
        if effect.left_out and not (timed or effect.deviation(robust=False)):
            yield effect.left_out
    for other in (each.effect for each in experiment.actuation.list_active()):
        lags = is_any_nonzero(other.response(scene.nv).lag)
        if other.left_out and not (lags or other.deviation(scene).any()):
            yield other.left_out
