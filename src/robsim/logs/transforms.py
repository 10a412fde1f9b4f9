"""Poses of frames from the transforms in /tf and /tf_static."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np

from robsim.base.arrays import Array
from robsim.base.errors import raise_file_errors
from robsim.geometry.pose import Pose
from robsim.logs.message_types import Message, header_time


class FrameTransforms:
    """The tree of frames: the last pose of each frame in its parent."""

    def __init__(self) -> None:
        self._edges: dict[str, tuple[str, Array]] = {}
        self._moving_frames: set[str] = set()

    @property
    def frames(self) -> list[str]:
        """The frames that have a parent."""
        return list(self._edges)

    def take(self, what: str, transforms: Iterable[Message], moving: bool = True) -> dict[str, int]:
        """Store the transforms of a message, and return the time of each frame in nanoseconds.

        A time is zero without a stamp. FileError is raised for an invalid pose.
        """
        times = {}
        for each in transforms:
            child = each.child_frame_id.removeprefix("/")
            parent = each.header.frame_id.removeprefix("/")
            move, turn = each.transform.translation, each.transform.rotation
            with raise_file_errors(f"{what}: frame '{child}'"):
                place, axes = (move.x, move.y, move.z), (turn.x, turn.y, turn.z, turn.w)
                self._edges[child] = parent, Pose.from_quaternion(place, axes).matrix
            times[child] = header_time(each) or 0
        self._moving_frames |= times.keys() if moving else set()
        return times

    def pose(self, frame: str, root: str) -> Array | None:
        """Return the pose (4, 4) of a frame in another frame, or None if they are not connected."""
        T = np.eye(4)
        for child in self._ancestors(frame, root):
            if child == root:
                return T
            if child in self._edges:
                T = self._edges[child][1] @ T
        return None

    def moves_with(self, frame: str, root: str) -> str | None:
        """Return the first moving frame on the path from a frame to the root, or None."""
        return next(
            (child for child in self._ancestors(frame, root) if child in self._moving_frames), None
        )

    def _ancestors(self, frame: str, root: str) -> Iterator[str]:
        """Yield a frame and its ancestors, up to the root or to a frame without a parent."""
        seen: set[str] = set()
        while frame not in seen:
            seen.add(frame)
            yield frame
            if frame == root or frame not in self._edges:
                return
            frame = self._edges[frame][0]
