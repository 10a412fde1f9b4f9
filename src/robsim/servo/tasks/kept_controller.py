"""The last controller in a scene. Later tasks use its parts again."""

from __future__ import annotations

from typing import Any, NamedTuple

from robsim.base.value import copy_cached, replace_unchecked
from robsim.declare.fields import is_identical
from robsim.servo.laws.gain import AdaptiveGain
from robsim.servo.servo_controller import ServoController, compute_decay_rate
from robsim.servo.task_controller import LAST_STEPS
from robsim.world.scene import LAST_CONTROLLER, Scene

# fields of servo tasks that do not change the bound features
OTHER_FIELDS = frozenset(
    (
        *("tolerance", "gain", "law", "inverse", "feed_forward"),
        *("smooth_start", "limit", "secondary", "projection"),
    )
)


class KeptController(NamedTuple):
    """A controller in a scene, with its task; both are immutable.

    Attributes
    ----------
    task : ServoTask
        The task.
    controller : ServoController
        The controller of the task in the scene.
    """

    task: Any
    controller: ServoController

    def find_changes(self, task: Any) -> set[str] | None:
        """Return the names of the fields that differ in a task; None for a task of another kind."""
        if type(task) is not type(self.task):
            return None
        names = task.__dataclass_fields__
        return {each for each in names if not _has_same(self.task, task, each)}

    def replace_gain(self, gain: float | AdaptiveGain) -> ServoController | None:
        """Return the controller with another constant gain, which uses the stages of the last run.

        None if the gain is not constant, or if other parts of the controller depend on it.
        """
        old = self.controller
        gains_are_constant = isinstance(gain, float) and isinstance(old.gain, float)
        if not gains_are_constant or type(old) is not ServoController:
            return None
        pace = compute_decay_rate(old.bound_features, gain, old.inverse)
        new = replace_unchecked(old, gain=gain, pace=pace)
        copy_cached(old, new, (LAST_STEPS, "picture_sights"))
        return new


def get_kept_controller(scene: Scene) -> KeptController | None:
    """Return the last controller in a scene, or None."""
    kept: KeptController | None = vars(scene).get(LAST_CONTROLLER)
    return kept


def keep_controller(task: Any, controller: ServoController) -> None:
    """Let the scene of a controller keep it, unless it has large arrays: of runs or pictures."""
    bound = controller.bound_features
    if bound.runs == 1 and not (controller.picture_sights or bound.pictured_pairs):
        vars(controller.scene)[LAST_CONTROLLER] = KeptController(task, controller)


def _has_same(a: Any, b: Any, name: str) -> bool:
    """Return whether two objects have the same bits in a field."""
    one, other = getattr(a, name), getattr(b, name)
    return one is other or is_identical(one, other)
