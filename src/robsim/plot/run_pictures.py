"""Pictures that the camera of a run saw, drawn again from the run."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array
from robsim.base.errors import InputError
from robsim.geometry.pose import Pose
from robsim.plot import run_data
from robsim.plot.goal_outlines import read_goal_pose
from robsim.world.pose_approach import approach_pose
from robsim.world.scene import Scene
from robsim.world.scene_picture import CameraPictures, NoiseKey, round_greys

if TYPE_CHECKING:
    import xarray as xr

EQUAL = 127.0  # grey value of a difference of zero


def draw_end_picture(run: xr.Dataset, scene: Scene, camera: str) -> NDArray[np.uint8]:
    """Return the picture (h, w) of a camera at the end of a single run, without noise."""
    q = run_data.read_configurations(run, scene)[-1]
    return round_greys(np.asarray(scene.picture(q, camera, exact=True), dtype=float))


def draw_goal_difference(run: xr.Dataset, scene: Scene, camera: str) -> NDArray[np.uint8]:
    """Return half of the end picture minus the goal picture, plus 127, of a camera of a run.

    Raise InputError if `place_goal` cannot place the goal of the run.
    """
    q = run_data.read_configurations(run, scene)[-1]
    end = np.asarray(scene.picture(q, camera, exact=True), dtype=float)
    goal_scene, q_goal = place_goal(read_goal_pose(run), scene, q, camera)
    return subtract_greys(end, goal_scene.picture(q_goal, camera, exact=True))


def subtract_greys(picture: NDArray[np.floating], goal: NDArray[np.generic]) -> NDArray[np.uint8]:
    """Return half of the difference of two pictures plus 127, as whole grey values."""
    return round_greys(EQUAL + 0.5 * (picture - np.asarray(goal, dtype=float)))


def place_goal(
    goal: Mapping[str, Pose], scene: Scene, q: Array, camera: str
) -> tuple[Scene, Array]:
    """Return a scene and its coordinates (nq,) that `camera` sees at the goal of a run.

    `goal` has the goal pose of a camera or a target in the world by its name. The robot that
    carries it approaches the pose from q (nq,). If it does not reach the pose, camera or target
    stand there alone, and all other bodies are at q. Raise InputError if there is no goal pose, or
    if it does not determine the pose of `camera`.
    """
    if not goal:
        raise InputError("picture: the goal of the run has no pose, so there is no picture of it")
    ((name, pose),) = goal.items()
    if (q_goal := approach_pose(scene, name, pose, q)) is not None:
        return scene, q_goal
    eyes = {each.name: each for each in scene.cameras}
    if name not in eyes:
        return scene.replacing(replace(scene.object(name), on="world", pose=pose)), q
    if name != camera and scene.tree.flag_moves(camera).any():
        raise InputError(f"picture: the goal has a pose of camera '{name}', not of '{camera}'")
    return scene.replacing(replace(eyes[name], on="world", pose=pose)), q


@dataclass(frozen=True, eq=False)
class CameraInstants:
    """The coordinates of a run at its instants, at which cameras take pictures.

    Attributes
    ----------
    q : array of shape (T, nq)
        Coordinates.
    time : array of shape (T,)
        Times in seconds.
    seed, number : int
        Seed of the noise, and number of the run in its batch.
    dt : float
        Period of the steps in seconds.
    start : float
        Time of step 0 in seconds.
    """

    q: Array
    time: Array
    seed: int = 0
    number: int = 0
    dt: float = 1.0
    start: float = 0.0

    @classmethod
    def of(cls, run: xr.Dataset) -> CameraInstants:
        """Return the instants of a single run."""
        seed, dt = int(run.attrs.get("seed", 0)), float(run.attrs.get("dt", 1.0))
        number = int(np.atleast_1d(run["run"].values)[0])
        return cls(run["q"].values, run["time"].values, seed, number, dt)

    def take(self, pictures: CameraPictures, t: int) -> NDArray[np.uint8]:
        """Return the picture (h, w) that a camera takes at instant number t.

        It is the picture in which a task detected its marks, if its images were on time and all
        instants are recorded: with the same noise, and with the motion since the instant before.
        """
        rates = np.zeros_like(self.q[t])
        elapsed = self.time[t] - self.time[t - 1] if t > 0 else 0.0
        if elapsed > 0 and self.time[t - 1] >= self.start:
            rates = (self.q[t] - self.q[t - 1]) / elapsed
        return self._take(pictures, t, self.q[t], rates)

    def take_still(self, pictures: CameraPictures, t: int, q: Array) -> NDArray[np.uint8]:
        """Return the picture (h, w) at coordinates q (nq,), with the noise of instant number t."""
        return self._take(pictures, t, q, np.zeros_like(q))

    def _take(self, pictures: CameraPictures, t: int, q: Array, rates: Array) -> NDArray[np.uint8]:
        """Return the picture (h, w) at q (nq,) with rates (nq,)."""
        step = round(float(self.time[t] - self.start) / self.dt)
        key = NoiseKey(self.seed, np.array([self.number], dtype=np.uint64), step)
        with pictures.lock:
            picture: NDArray[np.uint8] = pictures.take(_make_column(q), _make_column(rates), key)[0]
        return picture


def _make_column(values: Array) -> Array:
    return np.ascontiguousarray(values[:, None], dtype=float)
