"""The message with the matrices L and L J of a controller at an instant of the run.

{"type": "interaction", index, time, reason, matrices: [{title, matrix, rows, columns, rank, full,
tolerance, condition, singular, free, left_out}]}. Each servo task has two matrices: L (k, 6) for
the twist of the camera, and L J (k, n) for the commanded velocities. `free` are the motions that
change no feature, in words. Numbers that are not finite are null.
"""

from __future__ import annotations

import math
import warnings
from typing import TYPE_CHECKING, Any

import numpy as np

from robsim.base.errors import InputError, RobSimError, format_value
from robsim.features.interaction_matrix import InteractionMatrix
from robsim.servo.controller_matrices import compute_controller_matrices, list_servo_controllers
from robsim.servo.nested_tasks import list_servo_parts
from robsim.servo.servo_controller import ServoController
from robsim.studio.control_values import is_json_integer

if TYPE_CHECKING:
    from robsim.run.experiment import Experiment
    from robsim.studio.workbench import Workbench

MOST_ROWS = 40  # largest number of rows of a matrix in a message
MOST_TASKS = 4  # largest number of servo tasks in a message
DIGITS = 5  # significant digits of numbers


class InteractionMessages:
    """Builder of the messages; it keeps the controllers of the last experiment."""

    def __init__(self) -> None:
        self._last: tuple[Experiment, list[ServoController]] | None = None

    def build(self, bench: Workbench | None, index: object) -> dict[str, Any]:
        """Return the message of the instant `index`, or a message with the reason without one."""
        message = {
            "type": "interaction",
            "index": index,
            "time": None,
            "matrices": [],
            "reason": "",
        }
        try:
            return message | self._describe_instant(bench, index)
        except Exception as error:  # noqa: BLE001  such as an error in a user's feature
            known = index if is_json_integer(index) else None
            kind = "" if isinstance(error, RobSimError) else f"{type(error).__name__}: "
            return message | {"index": known, "reason": f"{kind}{error}"}

    def _describe_instant(self, bench: Workbench | None, index: Any) -> dict[str, Any]:
        """Return time and matrices of an instant; raise InputError if there are none."""
        if bench is None or bench.pair is None:
            raise InputError("only a run that is simulated step by step has a matrix")
        live = bench.pair.live
        if not is_json_integer(index) or not 0 <= index < len(live.instants):
            raise InputError(
                f"interaction: expected the number of an instant, 0 to {len(live.instants) - 1}, "
                f"got {format_value(index)}"
            )
        instant = live.instants[index]
        controllers = self._bind(live.experiment)
        if not controllers:
            raise InputError("this task follows no features, so it has no interaction matrix")
        names = [type(each).__name__ for each in list_servo_parts(live.experiment.task)]
        q = np.ascontiguousarray(instant.q[:, None])
        matrices = [
            entry
            for i, one in enumerate(controllers[:MOST_TASKS])
            for entry in _describe_controller(one, q, _name_task(names, i))
        ]
        return {"time": instant.time, "matrices": matrices}

    def _bind(self, experiment: Experiment) -> list[ServoController]:
        """Return the controllers of the servo tasks of an experiment."""
        if self._last is None or self._last[0] is not experiment:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")  # the run gave them
                controller = experiment.task.bind(experiment.scene)
            self._last = experiment, list(list_servo_controllers(controller))
        return self._last[1]


def _name_task(names: list[str], i: int) -> str:
    """Return the end of a title that names one of several tasks."""
    return f" of task {i + 1}, {names[i]}" if len(names) > 1 else ""


def _describe_controller(controller: ServoController, q: Any, owner: str) -> list[dict[str, Any]]:
    """Return the entries of L and L J of a controller at q (nq, 1)."""
    matrices = compute_controller_matrices(controller, q)
    most = 6 * controller.bound_features.motions
    titled = (
        (f"L{owner}: by the twist of the camera", matrices.interaction),
        (f"L J{owner}: by the velocities of the joints", matrices.task_jacobian),
    )
    return [_describe_matrix(title, each, most) for title, each in titled if each is not None]


def _describe_matrix(title: str, several: InteractionMatrix, most: int) -> dict[str, Any]:
    """Return the entry of a matrix (1, k, n) of at most rank `most`."""
    one = InteractionMatrix(several.matrix[0], several.rows, several.columns, several.tolerance)
    finite = bool(np.isfinite(one.matrix).all())
    return {
        "title": title,
        "matrix": [[_round(x) for x in row] for row in one.matrix[:MOST_ROWS].tolist()],
        "rows": one.rows[:MOST_ROWS],
        "columns": one.columns,
        "rank": one.rank if finite else None,
        "full": min(*one.shape, most),
        "tolerance": one.tolerance,
        "condition": _round(one.condition),
        "singular": [_round(x) for x in one.singular_values.tolist()],
        "free": list(one.free_motions()) if finite else [],
        "left_out": max(len(one.rows) - MOST_ROWS, 0),
    }


def _round(x: float) -> float | None:
    """Return a number with few digits; None if it is not finite."""
    return float(f"{x:.{DIGITS}g}") if math.isfinite(x) else None
