"""Checks of the fields of a control state, before compiled code reads them."""

from __future__ import annotations

from typing import Any, get_args

from numpy.typing import ArrayLike

from robsim.base.arrays import Array, as_bool, as_float, as_floats, make_read_only, move_runs_last
from robsim.base.errors import InputError, format_value
from robsim.features.observation_checks import check_array_shape
from robsim.servo.laws.inverse import InverseKind

STATE_SHAPES = {
    "error_last": ("k", "B"),
    "interaction_last": ("k", 6, "B"),
    "jacobian_last": (6, "n", "B"),
    "task_jacobian_last": ("k", "n", "B"),
    "s_last": ("k", "B"),
    "q_last": ("nq", "B"),
}


def put_runs_last(value: ArrayLike, what: str, shape: tuple[int | str, ...]) -> Array:
    """Return an array (*shape, B) from an array (B, *shape), or (*shape,) of one run."""
    array = as_floats(value, what, shape)
    if array.ndim > len(shape) + 1:
        raise InputError(f"{what}: expected at most one axis of runs, got {array.shape}")
    return move_runs_last(array, len(shape))


def check_state_fields(fields: dict[str, Any]) -> dict[str, Any]:
    """Return the fields of a state as read-only arrays of consistent sizes."""
    sizes: dict[str, int] = {}
    checked: dict[str, Any] = {}
    for name, shape in STATE_SHAPES.items():
        if name not in ("s_last", "q_last") or fields[name] is not None:
            checked[name] = check_array_shape(fields[name], name, shape, sizes)
    for what in ("time", "dt"):
        checked[what] = as_float(fields[what], what)
    checked["gain"] = _check_state_gain(fields["gain"], sizes["B"])
    if not isinstance(fields["inverse"], get_args(InverseKind)):
        raise InputError(f"inverse: expected an inverse, got {format_value(fields['inverse'])}")
    if not isinstance(fields["memory"], dict):
        raise InputError(f"memory: expected a dictionary, got {format_value(fields['memory'])}")
    checked["one_motion"] = as_bool(fields["one_motion"], "one_motion")
    return checked


def _check_state_gain(gain: Any, runs: int) -> float | Array:
    """Return a gain as a number, or as an array (B, 1)."""
    values = as_floats(gain, "gain", ())
    if values.size not in (1, runs) or values.ndim > 2:
        raise InputError(f"gain: expected a number, or one for each of {runs} runs")
    return float(values) if not values.ndim else make_read_only(values.reshape(-1, 1))
