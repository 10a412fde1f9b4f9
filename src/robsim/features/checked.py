"""Checks of what an observation is made of, before any of it reaches compiled code."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from robsim.base.arrays import Array, frozen, numbers, runs_last
from robsim.base.errors import InputError, said
from robsim.geometry.pose import as_pose
from robsim.vision.camera import Camera

MARKS = {"pixels_last": ("N", 2, "B"), "points_last": ("N", 2, "B"), "depth_last": ("N", "B")}
POSES = "guess_last", "between_last"


def image_of_marks(pixels: ArrayLike, depth: ArrayLike, camera: Any) -> tuple[Array, Array, Array]:
    """Return pixels and points (N, 2, B) and depths (N, B) of pixels (B, N, 2), depths (B, N)."""
    if not isinstance(camera, Camera):
        raise InputError(f"camera: expected a Camera, got {said(camera)}")
    x = numbers(pixels, "pixels", ("N", 2), gaps=True)
    Z = numbers(depth, "depth", ("N",), gaps=True)
    if x.ndim > 3 or not x.size or Z.shape != x.shape[:-1]:
        raise InputError(
            "expected pixels (B, N, 2) with depths (B, N), or (N, 2) with (N,), of at least one "
            f"mark and run, got {x.shape} with {Z.shape}"
        )
    last = runs_last(x, 2)
    return last, camera.points_of(last), runs_last(Z, 1)


def poses_last(pose: Any, what: str, runs: int) -> Array | None:
    """Return poses (3, 4, B) from a pose (4, 4) or (B, 4, 4); None of None."""
    if pose is None:
        return None
    try:
        T = as_pose(pose).matrix
    except InputError as error:
        raise InputError(f"{what}: {error}") from None
    if T.ndim > 3 or (T.ndim == 3 and len(T) != runs):
        raise InputError(f"{what}: expected a pose, or one for each of {runs} runs, got {T.shape}")
    return frozen(runs_last(np.broadcast_to(T[..., :3, :], (runs, 3, 4)), 2).copy())


def checked_parts(given: dict[str, Any]) -> dict[str, Any]:
    """Return the parts of an observation with arrays that are read-only and of one size."""
    if not isinstance(given["camera"], Camera):
        raise InputError(f"camera: expected a Camera, got {said(given['camera'])}")
    made = {name: _exactly(given[name], name, shape) for name, shape in MARKS.items()}
    N, _, B = made["pixels_last"].shape
    for name in POSES:
        made[name] = given[name] if given[name] is None else _exactly(given[name], name, (3, 4, B))
    if given["weights_last"] is not None:
        made["weights_last"] = _exactly(given["weights_last"], "weights_last", (N, B))
    if given["model"] is not None:
        each = numbers(given["model"], "model", (), gaps=True).ndim > 2
        made["model"] = _exactly(given["model"], "model", (N, 3, B) if each else (N, 3))
    sizes = {name: made[name].shape for name in MARKS}
    other = given["other"]
    if other is not None:
        if type(other).__name__ != "Observation":
            raise InputError(f"other: expected an Observation, got {said(other)}")
        sizes |= {"pixels_last of the other": other.pixels_last.shape}
        if given["between_last"] is None:
            raise InputError("other: a second camera needs `between`, its pose in the first")
    if not N or not B or any((s[0], s[-1]) != (N, B) for s in sizes.values()):
        listed = ", ".join(f"{name} {shape}" for name, shape in sizes.items())
        raise InputError(f"an observation is of N marks and B runs throughout, got {listed}")
    return made


def _exactly(value: Any, what: str, shape: tuple[int | str, ...]) -> Array:
    """Return a read-only copy of an array with as many axes as `shape`; NaN are gaps."""
    array = numbers(value, what, shape, gaps=True)
    if array.ndim != len(shape):
        raise InputError(f"{what}: expected {len(shape)} axes, got shape {array.shape}")
    return frozen(np.ascontiguousarray(array))
