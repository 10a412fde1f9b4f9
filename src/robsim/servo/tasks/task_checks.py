"""Checks of a task in a scene: contradictions are errors, weaknesses are warnings."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np

from robsim.base.arrays import Array
from robsim.base.errors import GoalError, InputError, RankWarning
from robsim.base.unit_warnings import find_user_stacklevel
from robsim.declare.problems import prefix_path
from robsim.features.feature import Feature
from robsim.features.points import PixelPoints, Points
from robsim.servo.bound_features import BoundFeatures
from robsim.servo.goals.goal import GoalFeatures, GoalKind
from robsim.servo.laws.broyden_rule import Broyden
from robsim.servo.laws.command_quantity import check_torque_task
from robsim.servo.laws.depth_model import DepthModel
from robsim.servo.laws.feed_forward import EstimatedMotion
from robsim.servo.laws.inverse import CAMERA_TWIST, JacobianTranspose, compute_rank
from robsim.servo.servo_controller import ServoController
from robsim.vision.camera import Camera


def check_servo_fields(task: Any) -> None:
    """Raise InputError for fields of a servo task that contradict one another in any scene."""
    _check_law_fields(task)
    check_torque_task(task)
    _check_depth_fields(task)
    _check_goal_fields(task)
    _check_weighting_fields(task)


def _check_law_fields(task: Any) -> None:
    """Raise InputError for contradictions of law, inverse, interaction and feed-forward."""
    name, broyden = type(task.law).__name__, isinstance(task.interaction, Broyden)
    if task.feed_forward is not None and isinstance(task.inverse, JacobianTranspose):
        raise InputError(
            "the transpose gives a direction, not the motion that cancels the target motion: "
            "use inverse='pseudo_inverse' or 'damped' with feed_forward"
        )
    if broyden and getattr(task.law, "in_camera", False):
        raise InputError(
            f"Broyden's rule estimates how the joints move the features, and {name} needs the "
            "motion of the camera: use law='joint'"
        )
    if broyden and isinstance(task.feed_forward, EstimatedMotion):
        raise InputError(
            "Broyden's rule and feed_forward='estimated' both explain the error of the model: "
            "use one of them"
        )
    constant = isinstance(task.interaction, np.ndarray)
    if constant and not compute_rank(np.ascontiguousarray(task.interaction[..., None]))[0]:
        raise InputError("interaction: a constant matrix of zeros commands nothing")


def _check_depth_fields(task: Any) -> None:
    """Raise InputError for features and depths that do not fit together."""
    features, depths = [block.feature for block in task.blocks], task.depths
    measuring_depth = [each for each in features if getattr(each, "measures_depth", False)]
    if measuring_depth and not depths.follows_marks:
        with prefix_path("features"):
            raise InputError(
                f"{type(measuring_depth[0]).__name__} measures the depth of the marks, and depth="
                f"{depths.which!r} does not: use depth='true' or a DepthFilter"
            )
    if not task.needs_depth and depths != DepthModel():
        names = ", ".join(type(each).__name__ for each in features)
        raise InputError(f"{names} use no depth: leave depth and depth_scale out")


def _check_goal_fields(task: Any) -> None:
    """Raise InputError or GoalError for fields that need an image of the goal, if it is numbers."""
    if not isinstance(task.goal, GoalFeatures):
        return
    by_name = isinstance(task.interaction, str)
    if any(getattr(block.feature, "uses_pose", False) for block in task.blocks):
        raise GoalError("the goal of a pose is a pose: give GoalPose(T_c_o), not GoalFeatures(s)")
    if task.depth == "goal" or (by_name and task.interaction != "current"):
        raise InputError(
            "a goal given as numbers has no image: L desired or mean and depth='goal' need a "
            "goal that is shown or computed"
        )


def _check_weighting_fields(task: Any) -> None:
    """Raise InputError for weightings that contradict feed-forward, depth or interaction."""
    if task.weighting and isinstance(task.feed_forward, EstimatedMotion):
        raise InputError(
            "weighting: changes of the weights would enter the estimate of the target motion: "
            "use feed_forward='known'"
        )
    follows = task.depths.filtered or isinstance(task.interaction, Broyden)
    if follows and any(getattr(each, "excuses", False) for each in task.weighting):
        kept = "a depth filter" if task.depths.filtered else "Broyden's rule"
        raise InputError(
            f"weighting: {kept} follows every mark from the start on, and marks that may be out of "
            "the image cannot be followed: use another depth or interaction"
        )


def check_bound_law(law: object, interaction: object, regulated: BoundFeatures) -> None:
    """Raise InputError for a law and an interaction matrix that do not fit the scene."""
    if getattr(law, "in_camera", False) and not regulated.has_single_motion:
        raise InputError(
            f"{type(law).__name__} commands the twist of one camera, and the cameras of this task "
            "do not move as one against their targets: use law='joint'"
        )
    if isinstance(interaction, Broyden):
        _check_broyden_shape(interaction, regulated)
    elif isinstance(interaction, np.ndarray):
        _check_constant_interaction(interaction, regulated)


def _check_broyden_shape(rule: Broyden, regulated: BoundFeatures) -> None:
    """Raise InputError unless the first estimate of a Broyden rule has the shape (k, n)."""
    k, n = regulated.k, regulated.columns.size
    if rule.start is not None and np.shape(rule.start) != (k, n):
        raise InputError(
            f"Broyden start: expected shape ({k}, {n}), {k} features by {n} commanded "
            f"velocities, got {np.shape(rule.start)}"
        )


def _check_constant_interaction(L: Array, regulated: BoundFeatures) -> None:
    """Raise InputError unless a constant interaction matrix has the shape (k, 6)."""
    if not regulated.has_single_motion:
        raise InputError(
            "a constant interaction matrix is for cameras that move as one; these do not"
        )
    if L.shape != (regulated.k, 6):
        raise InputError(
            f"interaction: expected shape ({regulated.k}, 6), a row for each of the "
            f"{regulated.k} features, got {L.shape}"
        )


def check_goal_interaction(goal: GoalKind, regulated: BoundFeatures) -> None:
    """Raise GoalError if L is not finite at a goal that has an image."""
    if not isinstance(goal, GoalFeatures) and not np.isfinite(regulated.at_goal.L).all():
        raise GoalError(f"{regulated.names}: L at the goal is not finite{regulated.reasons}")


def check_feature_tolerance(tolerances: Array, regulated: BoundFeatures) -> None:
    """Raise InputError if a tolerance (k,) exceeds every possible error of its feature.

    Only image points in an image of known size have a largest error, the size of the image.
    """
    first = 0
    for part in regulated.parts:
        own, first = tolerances[first : first + part.size], first + part.size
        widest = _get_image_width(part.feature, part.sights[0].eye.camera)
        if len(own) and own.min() >= widest:
            unit = "" if part.feature.unit == "1" else f" {part.feature.unit}"
            raise InputError(
                f"a tolerance of {own.min():g}{unit} for {part.name}, and no two points of the "
                f"image are more than {widest:g}{unit} apart: every start would have converged"
            )


def _get_image_width(feature: Feature, camera: Camera) -> float:
    """Return the largest distance of two points along an axis of the image; infinity if unknown."""
    if camera.size is None or camera.differs_by_run or type(feature) not in (Points, PixelPoints):
        return np.inf
    return float(max(camera.size)) if type(feature) is PixelPoints else camera.normalised_width


def count_fixed_motions(controller: ServoController) -> tuple[int, int]:
    """Return how many motions the features fix at the goal, and how many the joints can make."""
    regulated = controller.bound_features
    full = min(6 * regulated.motions, controller.columns.size)
    fixed = int(np.min(controller.full_rank))
    shown = regulated.goal_views.q_shown is not None
    if not shown and regulated.goal_values is None and regulated.has_single_motion:
        # there is no Jacobian at the goal
        fixed = min(fixed, int(compute_rank(regulated.at_goal.L, CAMERA_TWIST)[0]))
    return fixed, full


def warn_of_rank(controller: ServoController) -> None:
    """Issue a RankWarning if the features leave motions of the joints free."""
    first, (fixed, full) = controller.sights[0], count_fixed_motions(controller)
    if fixed < full:
        marks = np.unique(np.atleast_3d(first.target.marks)[..., 0], axis=0)
        cause = "its marks lie on one line; " if is_collinear(marks) else ""
        advice = "more features, or command fewer joints"
        if cause or len(marks) < 3:
            advice = "at least three marks that are not on one line"
        warnings.warn(
            f"the features of '{first.target.name}' fix only {fixed} of the {full} "
            f"motions of camera '{first.eye.name}' at the goal: {cause}"
            f"use {advice}",
            RankWarning,
            stacklevel=find_user_stacklevel(),
        )


def warn_of_wheels(controller: ServoController) -> None:
    """Issue a RankWarning if wheels alone have more features than velocities."""
    columns = controller.columns
    if controller.k <= columns.size:
        return
    kinds = controller.scene.tree.kinds(columns)
    if all(kind.wheeled for kind in kinds):
        steers = any(kind.needs == "steering" for kind in kinds)
        warnings.warn(
            f"a {'car' if steers else 'unicycle'} cannot move sideways, and no smooth law drives "
            f"it to a pose (Brockett 1983): use {'' if steers else 'Docking, or '}no more features "
            "than it has velocities",
            RankWarning,
            stacklevel=find_user_stacklevel(),
        )


def is_collinear(marks: Array) -> bool:
    """Return whether marks (N, 3) lie on one line, or marks (N, 3, B) in any run."""
    each = np.moveaxis(marks, (0, 1), (-2, -1))
    return bool((np.linalg.matrix_rank(each - each[..., :1, :], tol=1e-9) < 2).any())
