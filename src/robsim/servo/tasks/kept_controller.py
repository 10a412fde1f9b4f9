"""The last controller in a scene. Later tasks use its parts again."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

from robsim.declare.fields import is_identical
from robsim.servo.task_controller import LAST_STEPS
from robsim.world.scene import LAST_CONTROLLER, Scene

if TYPE_CHECKING:
    from robsim.servo.servo_controller import ServoController

# fields of servo tasks that do not change the bound features
OTHER_FIELDS = frozenset(
    (
        *("tolerance", "gain", "law", "inverse", "feed_forward"),
        *("smooth_start", "limit", "secondary", "projection"),
    )
)
OF_GAIN = "gain", "pace"  # fields of a controller that are numbers of two rows of its stages


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
        return {each for each in _list_fields(task) if not _has_same(self.task, task, each)}

    def share_steps(self, controller: ServoController) -> None:
        """Let a controller use the stages of the last run if it differs in a constant gain only."""
        old = self.controller
        if type(controller) is not type(old) or not isinstance(controller.gain, float):
            return
        names = [name for name in _list_fields(old) if name not in OF_GAIN]
        if isinstance(old.gain, float) and all(_has_same(old, controller, name) for name in names):
            vars(controller)[LAST_STEPS] = vars(old)[LAST_STEPS]


def get_kept_controller(scene: Scene) -> KeptController | None:
    """Return the last controller in a scene, or None."""
    kept: KeptController | None = vars(scene).get(LAST_CONTROLLER)
    return kept


def keep_controller(task: Any, controller: ServoController) -> None:
    """Let the scene of a controller keep it, unless it has large arrays: of runs or pictures."""
    bound = controller.bound_features
    if bound.runs == 1 and not (controller.picture_sights or bound.pictured_pairs):
        vars(controller.scene)[LAST_CONTROLLER] = KeptController(task, controller)


def _list_fields(value: Any) -> list[str]:
    """Return the names of the fields of a dataclass."""
    return list(value.__dataclass_fields__)


def _has_same(a: Any, b: Any, name: str) -> bool:
    """Return whether two objects have the same bits in a field."""
    one, other = getattr(a, name), getattr(b, name)
    return one is other or is_identical(one, other)
