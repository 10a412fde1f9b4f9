"""The feature of a task that measures the pose of the camera by the network."""

from dataclasses import dataclass, field, replace

import numpy as np
from pose_network.network import PoseNetwork

import robsim as rs


@dataclass(frozen=True, eq=False)
class LearnedPose:
    """Pose (p, theta u) of the camera relative to the goal, from the pictures of both.

    The six numbers are zero at the goal. They approximate the feature whose camera moves straight,
    so that the interaction matrix is the identity and the law is V_c = -gain (p, theta u).
    `distance` is the distance of the target at the goal in metres, which scales p.
    """

    distance: float = 1.0
    tolerance: float = 2e-3  # metres and radians
    network: PoseNetwork = field(default_factory=PoseNetwork)
    goal: tuple = ()

    unit = "m, rad"
    uses_pictures = True
    uses_depth = False

    def towards(self, goal):
        """Return the feature relative to the pictures at the goal."""
        return replace(self, goal=tuple(map(self.network.prepare_goal, goal.pictures)))

    def measure(self, seen):
        """Return the poses (B, 6) of the camera."""
        runs = np.arange(len(seen.pictures)) if seen.runs is None else seen.runs
        scale = np.array([self.distance] * 3 + [1.0] * 3)
        poses = np.empty((len(seen.pictures), 6))
        for b, picture in enumerate(seen.pictures):
            goal = self.goal[runs[b] if len(self.goal) > 1 else 0]
            poses[b] = self.network.measure_pose(goal, picture)
        return poses * scale

    def interaction(self, seen):
        """Return the interaction matrix (B, 6, 6)."""
        return np.tile(np.eye(6), (len(seen.pictures), 1, 1))


def make_luminance(level=0):
    """Return the luminance of all pixels, which ends by the step of the camera."""
    return rs.features.Luminance(1.0, step=1e-5, border=4, level=level)


def make_task(gain=2.0, switch_below=0.03, network=None, goal=None):
    """Return the network far from the goal and the luminance of all pixels near it."""
    learned = LearnedPose(tolerance=switch_below, network=network or PoseNetwork())
    far = rs.IBVS(goal, features=learned, gain=gain)
    near = rs.IBVS(goal, features=make_luminance(), gain=gain)
    return rs.Switch(far, near, when=rs.tasks.ErrorBelow(switch_below))
