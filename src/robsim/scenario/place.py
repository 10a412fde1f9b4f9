"""From the keys of a pose to the pose."""

from __future__ import annotations

import numpy as np

from robsim.base.errors import InputError
from robsim.geometry.pose import IDENTITY, Pose
from robsim.scenario import schema
from robsim.scenario.problems import under


def pose(table: schema.PoseKeys) -> Pose:
    """A pose; InputError for two rotations at once."""
    given = [key for key in ("rpy", "rotvec", "rotation") if getattr(table, key) is not None]
    if len(given) > 1:
        raise InputError(f"{' and '.join(given)}: give one rotation only")
    if not given and table.position is None:
        return IDENTITY
    T = np.eye(4)
    if table.rotation is not None:
        T[:3, :3] = table.rotation
    elif table.rpy is not None:
        T = np.array(Pose.at(rpy=table.rpy))
    elif table.rotvec is not None:
        T = np.array(Pose.at(rotvec=table.rotvec))
    if table.position is not None:
        T[:3, 3] = table.position
    with under("rotation"):
        return Pose(T)
