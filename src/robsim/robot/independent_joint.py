"""Joints of a tree with independent coordinates, of built-in kinds or of the user's kinds."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from robsim.base.arrays import Array, make_read_only
from robsim.base.errors import InputError, format_value
from robsim.robot.joints.joint_kind import JointKind


class IndependentJoint(NamedTuple):
    """Joint with independent coordinates.

    For a user's kind, a compiled stage or a Python method writes the motion to rows that later
    stages read. The twist of each velocity is the sum of six moves along and about the axes of the
    body, with the components of the twist as ratios.
    """

    body: int
    kind: JointKind
    q: slice  # rows of the coordinates of the tree
    v: slice  # rows of the velocities of the tree
    rolls: bool  # whether the joint is a wheel that rolls below its vehicle
    first: int  # index of the first ratio of the twists

    @property
    def is_called(self) -> bool:
        """Whether the joint is of a user's kind that is computed in Python."""
        return self.kind.own and self.kind.placing is None

    @property
    def moves(self) -> list[tuple[int, int, int, int, int]]:
        """Moves (velocity, body, whether it turns, axis, ratio) of all components of the twists."""
        return [
            (self.v.start + i // 6, self.body, i % 6 // 3, i % 3, self.first + i)
            for i in range(self.twists)
        ]

    def at(self, q: Array) -> tuple[Array, Array]:
        """Return the motion (12, B), row by row, and the twists (6 nv, B) at q[n, b]."""
        own, runs = [_copy_runs_first(q, self.q)], q.shape[1]
        T = _call_kind_method(self.kind, "motion", (4, 4), own)
        twists = _call_kind_method(self.kind, "twists", (self.twists // 6, 6), own)
        return T[:, :3].reshape(runs, 12).T, twists.reshape(runs, self.twists).T

    @property
    def constants(self) -> Array:
        """Numbers for the stages of the kind."""
        return np.array(self.kind.constants or (0.0,))

    @property
    def twists(self) -> int:
        """Number of components of all twists."""
        return 6 * len(self.kind.velocities)

    def advance(self, q: Array, v: Array, dt: float) -> None:
        """Move the rows of q[n, b] by velocities v[m, b] over dt seconds, in place."""
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
    """Return the results (B, *shape) of a method, with NaN for runs that are not finite.

    Raise InputError if the method returns another shape.
    """
    is_finite = np.all([np.isfinite(array).all(axis=1) for array in arrays], axis=0)
    out = np.full((len(is_finite), *shape), np.nan)
    if is_finite.any():
        result = getattr(kind, method)(
            *(make_read_only(array[is_finite]) for array in arrays), *more
        )
        out[is_finite] = _check_method_result(kind, method, result, (int(is_finite.sum()), *shape))
    return out


def _check_method_result(
    kind: JointKind, method: str, result: Any, shape: tuple[int, ...]
) -> Array:
    """Return the result of a method as an array; raise InputError if its shape is wrong."""
    try:
        values = np.asarray(result, dtype=np.float64)
    except (TypeError, ValueError):  # not numbers, or rows of unequal lengths
        values = np.empty(())
    if values.shape != shape:
        actual = f"shape {values.shape}" if values.ndim else f"{format_value(result)}"
        raise InputError(f"{type(kind).__name__}.{method}: expected shape {shape}, got {actual}")
    return values
