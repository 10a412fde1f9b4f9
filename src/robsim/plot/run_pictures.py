"""Pictures that the camera of a run saw, drawn again from the run."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from robsim.base.errors import InputError
from robsim.plot import run_data
from robsim.plot.goal_outlines import read_goal_pose
from robsim.world.mounted_camera import MountedCamera
from robsim.world.scene_picture import round_greys

if TYPE_CHECKING:
    import xarray as xr

    from robsim.world.scene import Scene

EQUAL = 127.0  # grey value of a difference of zero


def draw_end_picture(run: xr.Dataset, scene: Scene, camera: str) -> NDArray[np.uint8]:
    """Return the picture (h, w) of a camera at the end of a single run, without noise."""
    q = run_data.read_configurations(run, scene)[-1]
    return round_greys(np.asarray(scene.picture(q, camera, exact=True), dtype=float))


def draw_goal_difference(run: xr.Dataset, scene: Scene, camera: str) -> NDArray[np.uint8]:
    """Return half of the end picture minus the goal picture, plus 127, of a camera of a run.

    The goal picture shows the camera, or the target of a fixed camera, at its pose at the goal, and
    all other bodies at the end of the run. Raise InputError if the goal of the run has no pose.
    """
    q = run_data.read_configurations(run, scene)[-1]
    end = np.asarray(scene.picture(q, camera, exact=True), dtype=float)
    goal = _place_goal(run, scene).picture(q, camera, exact=True)
    return round_greys(EQUAL + 0.5 * (end - goal))


def _place_goal(run: xr.Dataset, scene: Scene) -> Scene:
    """Return a scene whose camera or target stands at the goal of a run."""
    poses = read_goal_pose(run)
    if not poses:
        raise InputError("picture: the goal of the run has no pose, so there is no picture of it")
    ((name, pose),) = poses.items()
    parts: dict[str, MountedCamera] = {each.name: each for each in scene.cameras}
    moved = parts[name] if name in parts else scene.object(name)
    return scene.replacing(replace(moved, on="world", pose=pose))
