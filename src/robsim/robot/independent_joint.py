"""The joints of a tree that have coordinates of their own, of built-in and of the user's kinds."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from robsim.base.arrays import Array, make_read_only
from robsim.base.errors import InputError, format_value
from robsim.robot.joints.joint_kind import JointKind


class IndependentJoint(NamedTuple):
    """A joint that has coordinates of its own.

    The motion of one of a user's kind is written by its stage or Python, where the stages read it.
    The twist of each of its velocities is six moves along and about the axes of its body, whose
    ratios are the components of the twist.
    """

    body: int
    kind: JointKind
    q: slice  # its rows among the coordinates of the tree
    v: slice  # and among the velocities
    rolls: bool  # whether it is a wheel that rolls under its vehicle
    first: int  # row of the first of these ratios

    @property
    def is_called(self) -> bool:
        """Whether it is of a user's kind in Python."""
        return self.kind.own and self.kind.placing is None

    @property
    def moves(self) -> list[tuple[int, int, int, int, int]]:
        """The rows (velocity, body, whether it turns, axis, ratio) of the twists' components."""
        return [
            (self.v.start + i // 6, self.body, i % 6 // 3, i % 3, self.first + i)
            for i in range(self.twists)
        ]

    def at(self, q: Array) -> tuple[Array, Array]:
        """Return the motion (12, B), row by row, and the twists (6 nv, B) at q[n, b]."""
        some, runs = [_copy_runs_first(q, self.q)], q.shape[1]
        T = _call_kind_method(self.kind, "motion", (4, 4), some)
        twists = _call_kind_method(self.kind, "twists", (self.twists // 6, 6), some)
        return T[:, :3].reshape(runs, 12).T, twists.reshape(runs, self.twists).T

    @property
    def constants(self) -> Array:
        """The numbers that the stages of its kind are given."""
        return np.array(self.kind.constants or (0.0,))

    @property
    def twists(self) -> int:
        """The number of the components of all twists."""
        return 6 * len(self.kind.velocities)

    def advance(self, q: Array, v: Array, dt: float) -> None:
        """Move its rows of q[n, b] by velocities v[m, b] held for dt seconds, in place."""
        both, shape = (
            [_copy_runs_first(q, self.q), _copy_runs_first(v, self.v)],
            (len(self.kind.coordinates),),
        )
        q[self.q] = _call_kind_method(self.kind, "integrate", shape, both, dt).T


def _copy_runs_first(values: Array, rows: slice) -> Array:
    """Return a contiguous copy of some rows with the run first."""
    return np.ascontiguousarray(values[rows].T)


def _call_kind_method(
    kind: JointKind, method: str, shape: tuple[int, ...], arrays: Sequence[Array], *more: Any
) -> Array:
    """Return the results of a method for each run, NaN for runs that ended or failed.

    InputError if it is of another shape.
    """
    fine = np.all([np.isfinite(array).all(axis=1) for array in arrays], axis=0)
    out = np.full((len(fine), *shape), np.nan)
    if fine.any():
        given = getattr(kind, method)(*(make_read_only(array[fine]) for array in arrays), *more)
        out[fine] = _check_method_result(kind, method, given, (int(fine.sum()), *shape))
    return out


def _check_method_result(kind: JointKind, method: str, given: Any, shape: tuple[int, ...]) -> Array:
    """Return the result of a method as an array; raise InputError if its shape is wrong."""
    try:
        values = np.asarray(given, dtype=np.float64)
    except (TypeError, ValueError):  # no numbers, or rows of unequal lengths
        values = np.empty(())
    if values.shape != shape:
        got = f"shape {values.shape}" if values.ndim else f"{format_value(given)}"
        raise InputError(f"{type(kind).__name__}.{method}: expected shape {shape}, got {got}")
    return values
