"""Names (a, b) of the frames of a pose T_a_b."""

from __future__ import annotations

from typing import Any

from robsim.base.errors import FrameError

FrameNames = tuple[str, str]


def check_frame_names(frames: Any) -> FrameNames | None:
    """Return None or a tuple of two names; raise FrameError for any other value."""
    is_pair = isinstance(frames, tuple | list) and [type(f) for f in frames] == [str, str]
    if frames is not None and not is_pair:
        raise FrameError(f"frames are two names (a, b) for the pose of b in a, got {frames!r}")
    return (frames[0], frames[1]) if is_pair else None


def join_frame_names(left: FrameNames | None, right: FrameNames | None) -> FrameNames | None:
    """Return the names of T_a_b @ T_b_c; raise FrameError if the inner names differ."""
    if left is None or right is None:
        return None
    if left[1] != right[0]:
        raise FrameError(
            f"cannot join {left[0]}<-{left[1]} with {right[0]}<-{right[1]}: "
            f"'{left[1]}' does not meet '{right[0]}'"
        )
    return left[0], right[1]
