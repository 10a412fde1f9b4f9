"""The state of rest of a task near its goal."""

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

REST_TOLERANCE = 1e-9  # largest command at rest, relative to the slowest rate of the controller
PICTURE_TOLERANCE = 1e-3  # the same with pictures, as the grey values at the goal are rounded


def make_steady(task: Task, factor: float = 1.0) -> Task:
    """Return the task with constant gains, times a factor, and without smooth start.

    Adaptive gains take their value at zero error. Gains with other names, as in `Placing`, are
    kept.
    """

    def make_leaf_steady(leaf: ServoTask) -> ServoTask:
        gain: Any = leaf.gain.at_zero if isinstance(leaf.gain, AdaptiveGain) else leaf.gain
        return replace_fields(leaf, smooth_start=None, gain=factor * gain)

    return map_servo_tasks(task, make_leaf_steady)


def has_single_gain(leaf: ServoTask) -> bool:
    """Return whether a servo task has a field `gain`."""
    return "gain" in (each.name for each in fields(leaf))


def find_rest_state(field: VectorField, experiment: Experiment) -> Array:
    """Return the state of rest q (nq, 1), at the goal or at the end of a run without errors.

    Raises InputError if neither is a state of rest.
    """
    with np.errstate(all="ignore"):  # invalid states give NaN
        q = _find_near_goal(field, experiment)
        return field.within_limits(_simulate_to_rest(experiment) if q is None else q)


def _find_near_goal(field: VectorField, experiment: Experiment) -> Array | None:
    """Return the state of rest nearest to a taught goal; None if there is none."""
    if field.goal is None:
        return None
    q = _start_coordinates(experiment)
    rows = _find_commanded_rows(field)
    q[rows] = field.goal[rows]
    tolerance = PICTURE_TOLERANCE if field.controller.pictured_pairs else REST_TOLERANCE
    if np.abs(field.rates(q)).max() <= tolerance * field.controller.pace:
        return q
    equilibria_near = refine_equilibria(field, q)
    return equilibria_near[:, :1] if equilibria_near.size else None


def _find_commanded_rows(field: VectorField) -> Array:
    """Return which coordinates (nq,) the commanded velocities move."""
    q = move_runs_last(field.scene.home, 1)
    changes = [field.displace(q, np.full((field.n, 1), amount)) != q for amount in (0.1, -0.2)]
    return np.asarray(np.logical_or(*changes)[:, 0])


def _simulate_to_rest(experiment: Experiment) -> Array:
    """Return the final state of a run from the start, without image and joint errors."""
    result = equilibria(
        experiment.scene, make_steady(experiment.task), starts=_start_coordinates(experiment).T
    )
    if result.ends[0] < 0:
        raise InputError(
            "advise: from its start the task does not come to rest, even with exact images and "
            "joints: its goal may be out of reach; call explain on the run"
        )
    return move_runs_last(np.array(result[int(result.ends[0])].q), 1)


def _start_coordinates(experiment: Experiment) -> Array:
    """Return the start (nq, 1) of an experiment."""
    start = experiment.scene.home if experiment.start is None else experiment.start
    return move_runs_last(np.array(start), 1)
