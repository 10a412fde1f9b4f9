"""Checks of the parts of an observation, before compiled code reads them."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from robsim.base.arrays import Array, as_floats, make_read_only, move_runs_last
from robsim.base.errors import InputError, format_value
from robsim.geometry.pose import PoseLike, as_pose
from robsim.vision.camera import Camera

MARK_SHAPES = {"pixels_last": ("N", 2, "B"), "points_last": ("N", 2, "B"), "depth_last": ("N", "B")}
OPTIONAL_SHAPES = {  # optional parts
    "guess_last": (3, 4, "B"),
    "between_last": (3, 4, "B"),
    "weights_last": ("N", "B"),
    "model": ("N", 3),
}


def check_image(pixels: ArrayLike, depth: ArrayLike, camera: Camera) -> tuple[Array, Array, Array]:
    """Return pixels and points (N, 2, B) and depths (N, B) from pixels (B, N, 2), depths (B, N)."""
    if not isinstance(camera, Camera):
        raise InputError(f"camera: expected a Camera, got {format_value(camera)}")
    x = as_floats(pixels, "pixels", ("N", 2), gaps=True)
    Z = as_floats(depth, "depth", ("N",), gaps=True)
    if x.ndim > 3 or not x.size or Z.shape != x.shape[:-1]:
        raise InputError(
            "expected pixels (B, N, 2) with depths (B, N), or (N, 2) with (N,), of at least one "
            f"mark and run, got {x.shape} with {Z.shape}"
        )
    last = move_runs_last(x, 2)
    return last, camera.points_of(last), move_runs_last(Z, 1)


def check_pictures(pictures: ArrayLike, runs: int) -> NDArray[np.uint8]:
    """Return pictures (B, h, w) as a read-only array of uint8; InputError for others."""
    grey = np.asarray(pictures)
    if grey.dtype != np.uint8 or grey.ndim not in (2, 3):
        raise InputError(
            "pictures: expected grey values of type uint8 and shape (B, h, w), got "
            f"{grey.dtype} of shape {grey.shape}"
        )
    many = grey if grey.ndim == 3 else grey[None]
    if len(many) != runs:
        raise InputError(f"pictures: expected one for each of {runs} runs, got {len(many)}")
    return make_read_only(many.copy())


def convert_poses(pose: PoseLike | None, what: str, runs: int) -> Array | None:
    """Return poses (3, 4, B) from a pose (4, 4) or (B, 4, 4), or None without a pose."""
    if pose is None:
        return None
    try:
        T = as_pose(pose).matrix
    except InputError as error:
        raise InputError(f"{what}: {error}") from None
    if T.ndim > 3 or (T.ndim == 3 and len(T) != runs):
        raise InputError(f"{what}: expected a pose, or one for each of {runs} runs, got {T.shape}")
    return make_read_only(move_runs_last(np.broadcast_to(T[..., :3, :], (runs, 3, 4)), 2).copy())


def check_observation_fields(fields: dict[str, Any]) -> dict[str, Any]:
    """Return the parts of an observation as read-only arrays of consistent sizes."""
    if not isinstance(fields["camera"], Camera):
        raise InputError(f"camera: expected a Camera, got {format_value(fields['camera'])}")
    shapes = MARK_SHAPES | {
        name: shape for name, shape in OPTIONAL_SHAPES.items() if fields[name] is not None
    }
    if "model" in shapes and as_floats(fields["model"], "model", (), gaps=True).ndim > 2:
        shapes["model"] = ("N", 3, "B")
    sizes: dict[str, int] = {}
    arrays = {
        name: check_array_shape(fields[name], name, shape, sizes, True)
        for name, shape in shapes.items()
    }
    other = fields["other"]
    if other is not None:
        if type(other).__name__ != "Observation":
            raise InputError(f"other: expected an Observation, got {format_value(other)}")
        check_array_shape(
            other.pixels_last, "pixels_last of the other", MARK_SHAPES["pixels_last"], sizes, True
        )
        if fields["between_last"] is None:
            raise InputError("other: a second camera needs `between`, its pose in the first")
    return arrays


def check_array_shape(
    value: Any, what: str, shape: tuple[int | str, ...], sizes: dict[str, int], gaps: bool = False
) -> Array:
    """Return a read-only copy of an array; raise InputError unless its named axes fit `sizes`.

    `sizes` maps the names of axes to the sizes found so far, and is extended. With `gaps`, NaN is
    allowed for missing numbers.
    """
    array = as_floats(value, what, shape, gaps=gaps)
    expected = tuple(sizes.get(n, n) if isinstance(n, str) else n for n in shape)
    fits = array.ndim == len(shape) and array.size > 0
    if not fits or any(
        isinstance(n, int) and n != size for n, size in zip(expected, array.shape, strict=True)
    ):
        raise InputError(f"{what}: expected shape {expected}, got {array.shape}".replace("'", ""))
    sizes |= {n: size for n, size in zip(shape, array.shape, strict=True) if isinstance(n, str)}
    return make_read_only(np.ascontiguousarray(array))
