"""Scenes over time: where all frames are at each instant of a run or a mission."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from robsim.base.arrays import Array
from robsim.plot.picture import FRUSTUM
from robsim.plot.wireframe import displayed
from robsim.run.mission_run import MissionRun
from robsim.world.scene import Scene


@dataclass(frozen=True)
class Moving:
    """A scene over time: at q (T, nq), or several scenes of the same things, one after another."""

    spells: tuple[tuple[Scene, Array], ...]

    @classmethod
    def of(cls, scene: Scene, q: Array) -> Moving:
        """Return one scene at q (T, nq)."""
        return cls(((scene, q),))

    @classmethod
    def of_mission(cls, mission: MissionRun) -> Moving:
        """Return the motion of all phases, at the instants of `mission.run`."""
        joined, legs = mission.run, mission.legs
        counts = [int(sum(joined["phase"].values == leg.name)) for leg in legs]
        spells = np.split(joined["q"].values, np.cumsum(counts)[:-1])
        return cls(tuple(zip([leg.scene for leg in legs], spells, strict=True)))

    @property
    def scene(self) -> Scene:
        """The scene at the start."""
        return self.spells[0][0]

    @property
    def things(self) -> list[str]:
        """The names of cameras and objects."""
        scene = self.scene
        return [eye.name for eye in scene.cameras] + [thing.name for thing in scene.objects]

    def poses(self, frame: str) -> Array:
        """Return the poses (T, 4, 4) of a frame in that of the figures."""
        return np.concatenate([displayed(scene, frame, q) for scene, q in self.spells])

    def at_start(self) -> Moving:
        """Return the scene as it stands at the start, for as long."""
        count = sum(len(q) for _, q in self.spells)
        scene, q = self.spells[0]
        return Moving.of(scene, np.repeat(q[:1], count, axis=0))


def frustum_depth(moving: Moving) -> float:
    """Return how deep the view of a camera is drawn, in metres."""
    robots = moving.scene.robots
    links = [f"{robot.name}.{link.name}" for robot in robots for link in robot.links]
    at = [moving.poses(name)[:, :3, 3] for name in (*moving.things, *links)]
    points = np.concatenate([np.empty((0, 3)), *at])
    return FRUSTUM * (float(np.ptp(points, axis=0).max()) if len(points) else 0.0) or FRUSTUM
