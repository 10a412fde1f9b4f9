"""From the tables [task], [start] and [run] to a task, a start and settings."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from robsim.arrays import Array
from robsim.errors import InputError
from robsim.pose import Pose
from robsim.record import LONGEST, Record
from robsim.scenario import schema
from robsim.scenario.build import configuration, pose
from robsim.scenario.problems import Problems, under
from robsim.scene import Scene
from robsim.servo import IBVS, CameraLaw, Computed, Damped, Truncated
from robsim.tree import COORDINATE_UNITS

_AS_THEY_ARE = (
    "camera",
    "target",
    "features",
    "interaction",
    "depth",
    "depth_scale",
    "gain",
    "tolerance",
)


@dataclass(frozen=True)
class Settings:
    """What `simulate` is told beside the scene, the task and the start; the same defaults.

    >>> Settings(dt=0.02).duration
    10.0
    """

    dt: float = 0.04
    duration: float = 10.0
    seed: int = 0
    noise: float = 0.0
    record: Record = "all"


def task(table: schema.TaskTable, scene: Scene, belief: Scene | None, problems: Problems) -> IBVS:
    """The task; FileError with all that is wrong."""
    given = {key: getattr(table, key) for key in _AS_THEY_ARE if getattr(table, key) is not None}
    with problems.at("task", "camera"):
        scene.camera(table.camera)
    with problems.at("task", "target"):
        scene.object(table.target)
    with problems.at("task"):
        given |= _law(table)
        given |= _inverse(table)
    with problems.at("task", "goal"):
        given["goal"] = _goal(table.goal, scene)
    problems.stop()
    made = None
    with problems.at("task"):
        made = IBVS(belief=belief, **given)
    return problems.settled(made)


def start(table: schema.StartTable, scene: Scene, what: str = "q") -> Array | None:
    """Coordinates of the robots; None where nothing is said, which is home."""
    stands = table.model_fields_set & schema.PoseKeys.model_fields.keys()
    if table.q is None:
        return _floating(scene, pose(table), what) if stands else None
    if stands:
        raise InputError("q and a pose: give one of the two only")
    with under("q"):
        q = configuration(table.q, scene.coordinate_units, scene.coordinate_names)
        return scene.coordinates(q, what)


def settings(table: schema.RunTable) -> Settings:
    """dt, duration, seed, noise, record."""
    given = {key: value for key, value in table if value is not None}
    made = Settings(**given)
    if made.duration / made.dt > LONGEST:
        raise InputError(
            f"duration {made.duration:g} s in periods of {made.dt:g} s are more than "
            f"{LONGEST} steps"
        )
    return made


def _floating(scene: Scene, where: Pose, what: str) -> Array:
    if list(scene.coordinate_units) != COORDINATE_UNITS["floating"]:
        raise InputError(
            f"a pose is for a scene whose only joint floats; give q, of "
            f"{', '.join(scene.coordinate_names) or 'no coordinates'}"
        )
    return scene.coordinates(where.q, what)


def _goal(table: schema.GoalTable, scene: Scene) -> Any:
    if table.computed is None:
        return start(table, scene, "goal q")
    if table.model_fields_set != {"computed"}:
        raise InputError("computed and a q or pose: give one of the two only")
    with under("computed"):
        return Computed(pose(table.computed))


def _law(table: schema.TaskTable) -> dict[str, Any]:
    if table.length is None:
        return {} if table.law is None else {"law": table.law}
    if table.law != "camera":
        raise InputError('length is for law = "camera" only')
    return {"law": CameraLaw(table.length)}


def _inverse(table: schema.TaskTable) -> dict[str, Any]:
    name = table.inverse or "truncated"
    if table.rcond is not None and name != "truncated":
        raise InputError('rcond is for inverse = "truncated" only')
    if table.damping is not None and name != "damped":
        raise InputError('damping is for inverse = "damped" only')
    if table.rcond is not None:
        return {"inverse": Truncated(table.rcond)}
    return {"inverse": name if table.damping is None else Damped(table.damping)}
