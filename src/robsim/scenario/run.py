"""From the tables [start] and [run] to a start and settings."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any

from robsim.base.arrays import Array
from robsim.base.errors import InputError
from robsim.geometry.pose import Pose
from robsim.robot.joint import KINDS
from robsim.run.record import LONGEST, Record
from robsim.scenario import schema
from robsim.scenario.build import configuration
from robsim.scenario.place import pose
from robsim.scenario.problems import under
from robsim.world.actuation import Actuation
from robsim.world.scene import Scene
from robsim.world.sensing import Sensing

_PERFECT, _EXACT = Sensing(), Actuation()


@dataclass(frozen=True)
class Settings:
    """What `simulate` is told beside the scene, the task and the start; the same defaults.

    >>> Settings(dt=0.02).duration
    10.0
    """

    dt: float = 0.04
    duration: float = 10.0
    seed: int = 0
    sensing: Sensing = _PERFECT
    actuation: Actuation = _EXACT
    record: Record = "all"
    hold: bool = False

    @property
    def keywords(self) -> dict[str, Any]:
        """For `simulate`."""
        return {each.name: getattr(self, each.name) for each in fields(self)}


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
    """dt, duration, seed, hold, record."""
    made = Settings(**{key: value for key, value in table if value is not None})
    if made.duration / made.dt > LONGEST:
        raise InputError(
            f"duration {made.duration:g} s in periods of {made.dt:g} s are more than "
            f"{LONGEST} steps"
        )
    return made


def _floating(scene: Scene, where: Pose, what: str) -> Array:
    if scene.coordinate_units != KINDS["floating"].units:
        raise InputError(
            f"a pose is for a scene whose only joint floats; give q, of "
            f"{', '.join(scene.coordinate_names) or 'no coordinates'}"
        )
    return scene.coordinates(where.q, what)
