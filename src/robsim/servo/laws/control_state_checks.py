"""Checks of what a law is given, before any of it reaches compiled code."""

from __future__ import annotations

from typing import Any, get_args

from numpy.typing import ArrayLike

from robsim.base.arrays import Array, as_bool, as_float, as_floats, make_read_only, move_runs_last
from robsim.base.errors import InputError, format_value
from robsim.features.observation_checks import check_array_shape
from robsim.servo.laws.inverse import Inverse

STATE_SHAPES = {
    "error_last": ("k", "B"),
    "interaction_last": ("k", 6, "B"),
    "jacobian_last": (6, "n", "B"),
    "task_jacobian_last": ("k", "n", "B"),
    "s_last": ("k", "B"),
    "q_last": ("nq", "B"),
}


def put_runs_last(value: ArrayLike, what: str, shape: tuple[int | str, ...]) -> Array:
    """Return an array (*shape, B) of one (B, *shape), or (*shape,) of a single run."""
    array = as_floats(value, what, shape)
    if array.ndim > len(shape) + 1:
        raise InputError(f"{what}: expected at most one axis of runs, got {array.shape}")
    return move_runs_last(array, len(shape))


def check_state_fields(given: dict[str, Any]) -> dict[str, Any]:
    """Return the parts of a state with arrays that are read-only and of one size."""
    sizes: dict[str, int] = {}
    made: dict[str, Any] = {}
    for name, shape in STATE_SHAPES.items():
        if name not in ("s_last", "q_last") or given[name] is not None:
            made[name] = check_array_shape(given[name], name, shape, sizes)
    for what in ("time", "dt"):
        made[what] = as_float(given[what], what)
    made["gain"] = _check_state_gain(given["gain"], sizes["B"])
    if not isinstance(given["inverse"], get_args(Inverse)):
        raise InputError(f"inverse: expected an inverse, got {format_value(given['inverse'])}")
    if not isinstance(given["memory"], dict):
        raise InputError(f"memory: expected a dictionary, got {format_value(given['memory'])}")
    made["one_motion"] = as_bool(given["one_motion"], "one_motion")
    return made


def _check_state_gain(gain: Any, runs: int) -> Any:
    """Return a gain as a number, or as (B, 1)."""
    given = as_floats(gain, "gain", ())
    if given.size not in (1, runs) or given.ndim > 2:
        raise InputError(f"gain: expected a number, or one for each of {runs} runs")
    return float(given) if not given.ndim else make_read_only(given.reshape(-1, 1))
