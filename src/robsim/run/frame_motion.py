"""Poses and twists of a frame at all recorded instants."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from robsim.base.arrays import Array
from robsim.geometry.pose import homogeneous_matrix
from robsim.world.scene import Scene

BLOCK = 65536  # number of instants in one evaluation of poses and velocities


def compute_frame_motion(scene: Scene, frame: str, q: Array, qd: Array) -> tuple[Array, Array]:
    """Return poses (runs, instants, 4, 4) and twists (runs, instants, 6) of a frame.

    Twists are in the axes of the frame. After the end of a run, where q is NaN, poses and twists
    are NaN.
    """
    joints, shape = scene.tree, q.shape[:2]
    poses, twists = np.full((q[..., 0].size, 4, 4), np.nan), np.full((q[..., 0].size, 6), np.nan)
    rows, rates = q.reshape(len(poses), -1), qd.reshape(len(poses), -1)
    still = not joints.flag_moves(frame).any()  # a frame that no joint moves
    live = np.flatnonzero(still | ~np.isnan(rows).any(axis=1))
    for part in _split_into_blocks(len(live)):
        some = live[part]
        q_some, rates_some = (np.ascontiguousarray(part[some].T) for part in (rows, rates))
        T, V = joints.motion(frame, q_some, rates_some, some // shape[1])
        poses[some], twists[some] = homogeneous_matrix(T), V.T
    return poses.reshape(*shape, 4, 4), twists.reshape(*shape, 6)


def _split_into_blocks(count: int) -> Iterator[slice]:
    return (slice(i, i + BLOCK) for i in range(0, count, BLOCK))
