"""A camera that is mounted somewhere in a scene."""

from __future__ import annotations

from dataclasses import dataclass

from robsim.base.errors import InputError
from robsim.base.names import checked_name
from robsim.geometry.pose import IDENTITY, Pose, one_pose
from robsim.vision.camera import Camera


@dataclass(frozen=True)
class MountedCamera:
    """A camera in the scene, its axes at `pose` (the hand-eye pose) on the frame `on`.

    >>> MountedCamera("eye", Camera([[800, 0, 320], [0, 800, 240], [0, 0, 1]]), on="arm.tool").on
    'arm.tool'
    """

    name: str
    camera: Camera
    on: str = "world"
    pose: Pose = IDENTITY

    def __post_init__(self) -> None:
        checked_name(self.name, "camera")
        if not isinstance(self.camera, Camera):
            raise InputError(f"camera '{self.name}' needs a Camera, got {self.camera!r:.80}")
        object.__setattr__(self, "pose", one_pose(self.pose, f"pose of '{self.name}'"))
