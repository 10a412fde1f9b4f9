"""The intrinsics that messages of a camera say."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from robsim.base.arrays import Array
from robsim.base.errors import FileError
from robsim.logs.bag_files import TimedMessage
from robsim.vision.camera import Camera


def check_camera_info(
    what: str, found: Iterable[TimedMessage], name: str, camera: Camera
) -> Array | None:
    """Return the intrinsics (3, 3) of a camera's messages; None where they say of none.

    FileError: it changes them or its size, or has another size than the camera of the experiment.
    """
    first: tuple[Any, ...] | None = None
    for each in found:
        now = int(each.message.width), int(each.message.height), tuple(each.message.k.tolist())
        if first is None:
            first = now
        for was, is_now, part in zip(first, now, ("width", "height", "K"), strict=True):
            if was != is_now:
                raise FileError(
                    f"{what}: camera '{name}' changes its {part}, {each.said}: {is_now} after {was}"
                )
    if first is None:
        return None
    if camera.size and first[:2] not in ((0, 0), tuple(camera.size)):
        raise FileError(
            f"{what}: camera '{name}' has images of {first[0]} x {first[1]} pixels, and "
            f"{camera.size[0]} x {camera.size[1]} in the experiment"
        )
    K = np.array(first[2]).reshape(3, 3)
    return K if K[0, 0] and np.isfinite(K).all() else None  # 0: of a camera without calibration
