"""The present image of a controller as the goal of its task."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from robsim.base.errors import InputError
from robsim.run.control.standalone_controller import Controller
from robsim.run.experiment import Experiment
from robsim.servo.goals.goal import GoalFeatures


def teach_goal(controller: Controller) -> Experiment:
    """Return the experiment with the present features as the goal, for a servo task.

    Raises
    ------
    InputError
        If no image has been used yet, or if the task has no goal of features.

    Examples
    --------
    >>> import robsim as rs
    >>> controller = rs.Controller.from_file(rs.examples.path("visp_tutorial"))
    >>> run = controller.experiment.run(duration=0.4)
    >>> command = controller.step(run.pixels.values[0], run.q.values[0], t=0.0)
    >>> teach_goal(controller).task.goal.s.shape
    (8,)
    """
    experiment = controller.experiment
    task: Any = experiment.task
    if not hasattr(task, "goal"):
        raise InputError(f"the task {type(task).__name__} has no goal to teach")
    basis = controller.last_decision().basis
    if basis is None or basis.state.s_last is None:
        raise InputError(f"the task {type(task).__name__} has no features to teach")
    goal = GoalFeatures(basis.state.s_last[:, 0].copy())
    return experiment.with_(task=replace(task, goal=goal))
