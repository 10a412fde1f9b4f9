"""Whether a task makes sense in a scene: contradictions are refused, weaknesses are told."""

from __future__ import annotations

import warnings
from typing import TYPE_CHECKING, Any

import numpy as np

from robsim.base.arrays import Array
from robsim.base.errors import GoalError, InputError, RankWarning
from robsim.base.warned import callers
from robsim.kernels.tree import CAR, UNICYCLE
from robsim.servo.controller import Servo
from robsim.servo.goals.goal import GoalFeatures
from robsim.servo.laws.broyden import Broyden
from robsim.servo.laws.feed_forward import EstimatedMotion
from robsim.servo.laws.inverse import JacobianTranspose, PseudoInverse, rank
from robsim.servo.regulated import Regulated

if TYPE_CHECKING:
    from robsim.servo.tasks.task import ServoTask


def check_sense(task: ServoTask, regulated: Regulated) -> None:
    """InputError for what contradicts itself in this scene."""
    if task.own_law:
        _check_own_law(task)
    in_camera = bool(getattr(task.law, "in_camera", False))
    law = type(task.law).__name__
    if task.feed_forward is not None and isinstance(task.inverse, JacobianTranspose):
        raise InputError(
            "the transpose gives a direction, not the motion that cancels what the target does: "
            "use inverse='pseudo_inverse' or 'damped' with feed_forward"
        )
    if in_camera and not regulated.as_one:
        raise InputError(
            f"{law} commands the twist of one camera, and the cameras of this task do not move "
            "as one against their targets: use law='joint'"
        )
    if isinstance(task.interaction, Broyden):
        if in_camera:
            raise InputError(
                f"Broyden's rule learns how the joints move the features, and {law} asks how "
                "the camera does: use law='joint'"
            )
        _check_broyden(task, task.interaction, regulated)
    elif isinstance(task.interaction, np.ndarray):
        _check_constant(task.interaction, regulated)


def _check_own_law(task: ServoTask) -> None:
    """What such a law would pass over in silence."""
    name = type(task).__name__
    if task.feed_forward is not None:
        raise InputError(f"{name} has a law of its own, which knows no feed_forward: leave it out")
    if not isinstance(task.inverse, PseudoInverse):
        raise InputError(f"{name} has a law of its own, whose inverses are truncated: leave it so")
    if isinstance(task.interaction, Broyden):
        raise InputError(f"{name} has a law of its own, which has no use for Broyden's rule")


def _check_broyden(task: ServoTask, rule: Broyden, regulated: Regulated) -> None:
    k, n = regulated.k, regulated.columns.size
    if rule.start is not None and rule.start.shape != (k, n):
        raise InputError(
            f"Broyden start: expected shape ({k}, {n}), {k} features by {n} commanded "
            f"velocities, got {rule.start.shape}"
        )
    if isinstance(task.feed_forward, EstimatedMotion):
        raise InputError(
            "Broyden's rule and feed_forward='estimated' both explain what the model does not: "
            "use one of them"
        )


def _check_constant(L: Array, regulated: Regulated) -> None:
    if not regulated.as_one:
        raise InputError(
            "a constant interaction matrix is for cameras that move as one; these do not"
        )
    if L.shape != (regulated.k, 6):
        raise InputError(
            f"interaction: expected shape ({regulated.k}, 6), a row for each of the "
            f"{regulated.k} features, got {L.shape}"
        )
    if not rank(np.ascontiguousarray(L[..., None]))[0]:
        raise InputError("interaction: a constant matrix of zeros commands nothing")


def check_goal(task: ServoTask, regulated: Regulated) -> None:
    """InputError if the goal cannot be what the task wants of it."""
    by_name = isinstance(task.interaction, str)
    if not isinstance(task.goal, GoalFeatures):
        if not np.isfinite(regulated.at_goal.L).all():
            raise GoalError(f"{regulated.names}: L at the goal is not finite{regulated.reasons}")
    elif any(getattr(part.feature, "uses_pose", False) for part in regulated.parts):
        raise GoalError("the goal of a pose is a pose: give GoalPose(T_c_o), not GoalFeatures(s)")
    elif task.depth == "goal" or (by_name and task.interaction != "current"):
        raise InputError(
            "a goal given as numbers has no image: L desired or mean and depth='goal' need a "
            "goal that is shown or computed"
        )


def warn_of_rank(controller: Servo) -> None:
    """RankWarning if the features leave motions free that the joints can make."""
    regulated, first = controller.regulated, controller.sights[0]
    full = min(6 * regulated.motions, controller.columns.size)
    found = controller.full_rank
    if regulated.q_goal is None and regulated.given is None and regulated.as_one:
        found = min(found, int(rank(regulated.at_goal.L)[0]))  # there is no Jacobian at the goal
    if found < full:
        marks = np.unique(first.target.marks, axis=0)
        cause = "its marks lie on one line; " if collinear(marks) else ""
        few = cause or len(marks) < 3
        advice = "at least three marks that are not on one line"
        if not few:
            advice = "more features, or command fewer joints"
        warnings.warn(
            f"the features of '{first.target.name}' fix only {found} of the {full} "
            f"motions of camera '{first.eye.name}' at the goal: {cause}"
            f"use {advice}",
            RankWarning,
            stacklevel=callers(),
        )


def warn_of_wheels(controller: Servo) -> None:
    """RankWarning if a unicycle or a car alone is asked for more than two numbers."""
    kinds, columns = controller.scene.tree.kinds[controller.columns], controller.columns
    if np.isin(kinds, (UNICYCLE, CAR)).all() and controller.k > columns.size:
        steers = (kinds == CAR).any()
        warnings.warn(
            f"a {'car' if steers else 'unicycle'} cannot move sideways, and no smooth law drives "
            f"it to a pose (Brockett 1983): use {'' if steers else 'Docking, or '}no more features "
            "than it has velocities",
            RankWarning,
            stacklevel=callers(),
        )


def collinear(marks: Any) -> bool:
    """Whether marks (N, 3) lie on one line."""
    return int(np.linalg.matrix_rank(marks - marks[:1], tol=1e-9)) < 2
