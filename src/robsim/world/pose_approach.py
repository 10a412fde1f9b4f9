"""Coordinates of a scene near others, at which a frame is at a pose."""

from __future__ import annotations

import numpy as np

from robsim.base.arrays import Array
from robsim.geometry.pose import Pose
from robsim.world.scene import Scene

STEPS = 60
REACHED = 1e-8  # largest error at the pose, metres and radians
LONGEST = 0.3  # largest error that one step removes, metres and radians
DAMPING = 1e-3  # of the singular values, relative to the largest error


def approach_pose(scene: Scene, frame: str, pose: Pose, q: Array) -> Array | None:
    """Return coordinates (nq,) near q (nq,) that bring a frame to a pose in the world.

    Damped least-squares steps begin at q, without limits of the joints and without a second
    attempt. They need no kernels but those of a simulation. None if they do not reach the pose.

    Examples
    --------
    >>> import numpy as np
    >>> from robsim import Robot
    >>> arm = Scene(Robot.from_dh([[0, 0, 1, 0], [0, 0, 1, 0]], name="arm"))
    >>> goal = arm.pose("arm.link2", [0.3, 0.4])
    >>> approach_pose(arm, "arm.link2", goal, np.zeros(2)).round(6)
    array([0.3, 0.4])
    >>> approach_pose(arm, "arm.link2", Pose.at(0, 0, 1), np.zeros(2)) is None
    True
    """
    columns, tree = np.array(q, dtype=float)[:, None], scene.tree
    for _ in range(STEPS):
        bodies = tree.bodies(columns)
        error = _measure_error(tree.frame(bodies, frame)[..., 0], pose)
        largest = float(np.abs(error).max())
        if largest < REACHED:
            return np.asarray(columns[:, 0])
        error *= min(1.0, LONGEST / largest)
        J = tree.jacobian(bodies, frame)[..., 0]
        damping = (DAMPING * largest) ** 2 * np.eye(len(error))
        rates = J.T @ np.linalg.lstsq(J @ J.T + damping, error, rcond=1e-12)[0]
        tree.advance(columns, np.ascontiguousarray(rates[:, None]), 1.0)
    return None


def _measure_error(T: Array, pose: Pose) -> Array:
    """Return the motion (6,) in the axes of the world from T (3, 4) to a pose."""
    turn = np.eye(4)
    turn[:3, :3] = pose.rotation @ T[:, :3].T
    return np.concatenate([pose.position - T[:, 3], Pose(turn).rotvec])
