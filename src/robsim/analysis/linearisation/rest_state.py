"""Where a task comes to rest, near its goal."""

from __future__ import annotations

from dataclasses import fields
from typing import Any

import numpy as np

from robsim.analysis.equilibrium_search import equilibria
from robsim.analysis.newton_method import refine_equilibria
from robsim.analysis.task_tree import map_servo_tasks, replace_fields
from robsim.analysis.vector_fields import VectorField
from robsim.base.arrays import Array, move_runs_last
from robsim.base.errors import InputError
from robsim.run.experiment import Experiment
from robsim.servo.laws.gain import AdaptiveGain
from robsim.servo.tasks.task import ServoTask, Task

REST_TOLERANCE = 1e-9  # of the pace: a command below it is none


def make_steady(task: Task, factor: float = 1.0) -> Task:
    """Return the task as it is at rest: gains as at zero error, times a factor; no smooth start.

    Gains of other names, those of `Placing`, stay.
    """

    def leaf(one: ServoTask) -> ServoTask:
        gain: Any = one.gain.at_zero if isinstance(one.gain, AdaptiveGain) else one.gain
        return replace_fields(one, smooth_start=None, gain=factor * gain)

    return map_servo_tasks(task, leaf)


def has_single_gain(leaf: ServoTask) -> bool:
    """Return whether the gain of a servo task can be set."""
    return "gain" in (each.name for each in fields(leaf))


def find_rest_state(field: VectorField, experiment: Experiment) -> Array:
    """Return the state of rest q (nq, 1): at the goal, or where a run without errors would end.

    InputError: neither is a state of rest.
    """
    with np.errstate(all="ignore"):  # unusable states give NaN
        q = _find_near_goal(field, experiment)
        return field.within_limits(_simulate_to_rest(experiment) if q is None else q)


def _find_near_goal(field: VectorField, experiment: Experiment) -> Array | None:
    """Return the state of rest nearest to a goal that was shown, if there is one."""
    if field.goal is None:
        return None
    q = _start_coordinates(experiment)
    rows = _find_commanded_rows(field)
    q[rows] = field.goal[rows]
    if np.abs(field.rates(q)).max() <= REST_TOLERANCE * field.controller.pace:
        return q
    found = refine_equilibria(field, q)
    return found[:, :1] if found.size else None


def _find_commanded_rows(field: VectorField) -> Array:
    """Return the rows of the coordinates that the commanded velocities move."""
    q = move_runs_last(field.scene.home, 1)
    moved = [field.moved(q, np.full((field.n, 1), amount)) != q for amount in (0.1, -0.2)]
    return np.asarray(np.logical_or(*moved)[:, 0])


def _simulate_to_rest(experiment: Experiment) -> Array:
    """Return where a run from the start ends, without errors of images and joints."""
    found = equilibria(
        experiment.scene, make_steady(experiment.task), starts=_start_coordinates(experiment).T
    )
    if found.ends[0] < 0:
        raise InputError(
            "advise: from its start the task comes to rest nowhere, even with images and joints "
            "without errors: its goal may be out of reach; see explain of the run"
        )
    return move_runs_last(np.array(found[int(found.ends[0])].q), 1)


def _start_coordinates(experiment: Experiment) -> Array:
    """Return the coordinates (nq, 1) at which an experiment starts."""
    start = experiment.scene.home if experiment.start is None else experiment.start
    return move_runs_last(np.array(start), 1)
