"""Motion of a scene: the poses of all frames at each instant of a run or a mission."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from robsim.base.arrays import Array, move_runs_last
from robsim.geometry.pose import homogeneous_matrix
from robsim.kernels.formulas.body_arrays import Bodies
from robsim.plot import wireframe
from robsim.plot.wireframe import compute_display_pose
from robsim.robot.robot import Robot
from robsim.run.mission_run import MissionRun
from robsim.world.scene import Scene

if TYPE_CHECKING:
    import xarray as xr

STILL = 1e-6  # metres; smaller motions count as standing still
FRUSTUM, LEAST = 0.12, 0.03  # depth of a frustum, and its least value, as shares of the scene


@dataclass(frozen=True)
class SceneMotion:
    """Motion of a scene, or of several scenes of the same bodies, one after another.

    Attributes
    ----------
    phases : tuple of (Scene, array)
        Scenes and their configurations (T, nq), in order of time.
    second : SceneMotion or None
        Motion of the same scene under another scheme, with as many instants.
    """

    phases: tuple[tuple[Scene, Array], ...]
    second: SceneMotion | None = None

    @classmethod
    def of(cls, scene: Scene, q: Array, second: SceneMotion | None = None) -> SceneMotion:
        """Return the motion of one scene at q (T, nq)."""
        return cls(((scene, q),), second)

    @classmethod
    def of_mission(cls, mission: MissionRun, run: xr.Dataset) -> SceneMotion:
        """Return the motion of all phases at the instants of the joined record, `mission.run`."""
        legs = mission.legs
        counts = [int(sum(run["phase"].values == leg.name)) for leg in legs]
        phases = np.split(run["q"].values, np.cumsum(counts)[:-1])
        return cls(tuple(zip([leg.scene for leg in legs], phases, strict=True)))

    @property
    def scene(self) -> Scene:
        """The scene at the start."""
        return self.phases[0][0]

    def poses(self, frame: str) -> Array:
        """Return the poses (T, 4, 4) of a frame relative to the frame of the figures."""
        return np.concatenate(
            [
                scene.display.matrix @ homogeneous_matrix(scene.tree.frame(bodies, frame))
                for (scene, _), bodies in zip(self.phases, self._bodies, strict=True)
            ]
        )

    @cached_property
    def _bodies(self) -> list[Bodies]:
        """The poses of all bodies of each phase, which all frames share."""
        return [
            scene.tree.bodies(move_runs_last(scene.coordinates(q, limits=False), 1))
            for scene, q in self.phases
        ]

    def within(self, scene: Scene) -> SceneMotion:
        """Return the motion of another scene, such as the believed one, at the same coordinates."""
        if not self._others or self._others[0].scene is not scene:
            self._others[:] = [SceneMotion(tuple((scene, q) for _, q in self.phases))]
        return self._others[0]

    @cached_property
    def _others(self) -> list[SceneMotion]:
        """The last motion that `within` returned."""
        return []

    @property
    def paths(self) -> dict[str, Array]:
        """The paths (T, 3) of the cameras and objects that move."""
        every = {name: self.poses(name)[:, :3, 3] for name in list_cameras_and_objects(self.scene)}
        return {name: path for name, path in every.items() if np.ptp(path, axis=0).max() > STILL}

    @property
    def count(self) -> int:
        """The number of instants."""
        return sum(len(q) for _, q in self.phases)


def choose_frustum_depth(motion: SceneMotion) -> float:
    """Return the depth in metres of the drawn frustum of a camera without a body.

    The depth is a share of the extent of the scene. It is at most half the size of the largest
    robot, and at least a smaller share of the extent of the scene.
    """
    scene, q = motion.phases[-1]
    frames = [motion.poses(name)[:, :3, 3] for name in wireframe.list_scene_shapes(scene)]
    size = (
        _compute_longest_side(np.concatenate([wireframe.place_scene_marks(scene, q[-1]), *frames]))
        or 1.0
    )
    own = max(
        [
            _compute_longest_side(_compute_link_origins(scene, robot, q[-1]))
            for robot in scene.robots
        ],
        default=0.0,
    )
    return min(FRUSTUM * size, max(own / 2, LEAST * size))


def list_cameras_and_objects(scene: Scene) -> list[str]:
    """Return the names of cameras and objects."""
    return [eye.name for eye in scene.cameras] + [obj.name for obj in scene.objects]


def _compute_link_origins(scene: Scene, robot: Robot, q: Array) -> Array:
    """Return the origins (N, 3) of the links of a robot without the base, which may be mobile."""
    names = [f"{robot.name}.{link.name}" for link in robot.links[1:]]
    return np.array([compute_display_pose(scene, name, q)[:3, 3] for name in names])


def _compute_longest_side(points: Array) -> float:
    """Return the longest side in metres of the box around points (N, 3); 0 without points."""
    return float(np.ptp(points, axis=0).max()) if len(points) else 0.0
