"""Checks of what a law is given, before any of it reaches compiled code."""

from __future__ import annotations

from typing import Any, get_args

from numpy.typing import ArrayLike

from robsim.base.arrays import Array, flag, frozen, number, numbers, runs_last
from robsim.base.errors import InputError, said
from robsim.features.checked import sized
from robsim.servo.laws.inverse import Inverse

SHAPES = {
    "error_last": ("k", "B"),
    "interaction_last": ("k", 6, "B"),
    "jacobian_last": (6, "n", "B"),
    "task_jacobian_last": ("k", "n", "B"),
    "s_last": ("k", "B"),
    "q_last": ("nq", "B"),
}


def last_of(value: ArrayLike, what: str, shape: tuple[int | str, ...]) -> Array:
    """Return an array (*shape, B) of one (B, *shape), or (*shape,) of a single run."""
    array = numbers(value, what, shape)
    if array.ndim > len(shape) + 1:
        raise InputError(f"{what}: expected at most one axis of runs, got {array.shape}")
    return runs_last(array, len(shape))


def checked_state(given: dict[str, Any]) -> dict[str, Any]:
    """Return the parts of a state with arrays that are read-only and of one size."""
    sizes: dict[str, int] = {}
    made: dict[str, Any] = {}
    for name, shape in SHAPES.items():
        if name not in ("s_last", "q_last") or given[name] is not None:
            made[name] = sized(given[name], name, shape, sizes)
    for what in ("time", "dt"):
        made[what] = number(given[what], what)
    made["gain"] = _checked_gain(given["gain"], sizes["B"])
    if not isinstance(given["inverse"], get_args(Inverse)):
        raise InputError(f"inverse: expected an inverse, got {said(given['inverse'])}")
    if not isinstance(given["memory"], dict):
        raise InputError(f"memory: expected a dictionary, got {said(given['memory'])}")
    made["one_motion"] = flag(given["one_motion"], "one_motion")
    return made


def _checked_gain(gain: Any, runs: int) -> Any:
    """Return a gain as a number, or as (B, 1)."""
    given = numbers(gain, "gain", ())
    if given.size not in (1, runs) or given.ndim > 2:
        raise InputError(f"gain: expected a number, or one for each of {runs} runs")
    return float(given) if not given.ndim else frozen(given.reshape(-1, 1))
