"""The matrices L and L J of a controller at given configurations."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

from robsim.base.arrays import Array, move_runs_first
from robsim.features.interaction_matrix import TWIST, InteractionMatrix, name_components
from robsim.servo.bound_block import BoundBlock
from robsim.servo.bound_features import BoundFeatures
from robsim.servo.feature_stages import evaluate_features
from robsim.servo.servo_controller import ServoController


class ControllerMatrices(NamedTuple):
    """Matrices as a controller models them, with rows times the weights of their features."""

    interaction: InteractionMatrix | None  # L (B, k, 6); None unless all cameras move as one
    task_jacobian: InteractionMatrix  # L J (B, k, n) for the commanded velocities


def compute_controller_matrices(controller: ServoController, q: Array) -> ControllerMatrices:
    """Return the matrices of a controller at q (nq, B), with exact images and its belief.

    With Broyden's rule they are those of the model, from which the estimate starts.
    """
    regulated = controller.bound_features
    _, L, A = evaluate_features(regulated, q)
    rows, W = name_rows(regulated), regulated.weights[..., None]
    columns = tuple(controller.scene.velocity_names[i] for i in controller.columns)
    tolerance = controller.rcond
    task_jacobian = InteractionMatrix(move_runs_first(W * A), rows, columns, tolerance)
    if not regulated.has_single_motion:
        return ControllerMatrices(None, task_jacobian)
    interaction = InteractionMatrix(move_runs_first(W * L), rows, TWIST, tolerance)
    return ControllerMatrices(interaction, task_jacobian)


def list_servo_controllers(controller: Any) -> Iterator[ServoController]:
    """Yield the controllers of the servo tasks in a controller, in the order of the tasks."""
    if isinstance(controller, ServoController):
        yield controller
    for part in getattr(controller, "parts", ()):
        yield from list_servo_controllers(part)


def name_rows(regulated: BoundFeatures) -> tuple[str, ...]:
    """Return the names of all regulated features (k,), with camera and target if several."""
    several = len(regulated.sights) > 1
    return tuple(name for part in regulated.parts for name in _name_block_rows(part, several))


def _name_block_rows(part: BoundBlock, several: bool) -> list[str]:
    """Return the names of the chosen components of a block."""
    marks = range(len(part.sights[0].target.marks)) if part.marks is None else part.marks.tolist()
    names = name_components(part.feature, part.k or 0, marks)
    chosen = names if part.components is None else [names[i] for i in part.components]
    pairs = ", ".join(f"{eye} sees {target}" for eye, target in (each.key for each in part.sights))
    return [f"{name} ({pairs})" for name in chosen] if several else chosen
