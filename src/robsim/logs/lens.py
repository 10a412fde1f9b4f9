"""The intrinsics in CameraInfo messages."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from robsim.base.arrays import Array
from robsim.base.errors import FileError
from robsim.logs.bag_files import TimedMessage
from robsim.vision.camera import Camera


def check_camera_info(
    what: str, messages: Iterable[TimedMessage], name: str, camera: Camera
) -> Array | None:
    """Return the intrinsics (3, 3) in the messages of a camera, or None if it is not calibrated.

    FileError is raised if the size or the intrinsics change between messages, or the size differs
    from the size of the camera in the experiment.
    """
    first: tuple[Any, ...] | None = None
    for each in messages:
        now = int(each.message.width), int(each.message.height), tuple(each.message.k.tolist())
        if first is None:
            first = now
        for was, is_now, part in zip(first, now, ("width", "height", "K"), strict=True):
            if was != is_now:
                raise FileError(
                    f"{what}: camera '{name}' changes its {part}, {each.when}: {is_now} after {was}"
                )
    if first is None:
        return None
    if camera.size and first[:2] not in ((0, 0), tuple(camera.size)):
        raise FileError(
            f"{what}: camera '{name}' has images of {first[0]} x {first[1]} pixels, and "
            f"{camera.size[0]} x {camera.size[1]} in the experiment"
        )
    K = np.array(first[2]).reshape(3, 3)
    return K if K[0, 0] and np.isfinite(K).all() else None  # 0: the camera is not calibrated
