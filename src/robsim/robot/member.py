"""The joints of a tree that have coordinates of their own, of built-in and of the user's kinds."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from robsim.base.arrays import Array, frozen
from robsim.base.errors import InputError, said
from robsim.robot.joints.kind import JointKind


class Member(NamedTuple):
    """A joint that has coordinates of its own."""

    body: int
    kind: JointKind
    q: slice  # its rows among the coordinates of the tree
    v: slice  # and among the velocities
    rolls: bool  # whether it is a wheel that rolls under its vehicle


class OwnMotion(NamedTuple):
    """A joint of a user's kind, whose motion its stage or Python writes where the stages read it.

    The twist of each of its velocities is six moves along and about the axes of its body, whose
    ratios are the components of the twist.
    """

    member: Member
    first: int  # row of the first of these ratios

    @property
    def moves(self) -> list[tuple[int, int, int, int, int]]:
        """The rows (velocity, body, whether it turns, axis, ratio) of the twists' components."""
        body, v = self.member.body, self.member.v
        return [
            (j, body, c // 3, c % 3, self.first + 6 * (j - v.start) + c)
            for j in range(v.start, v.stop)
            for c in range(6)
        ]

    def at(self, q: Array) -> tuple[Array, Array]:
        """Return the motion (3, 4, B) and the twists (6 nv, B) of the joint at q[n, b]."""
        some, nv = _rows(q, self.member.q), self.member.v.stop - self.member.v.start
        T = _called(self.member.kind, "motion", (4, 4), some)
        twists = _called(self.member.kind, "twists", (nv, 6), some)
        return T[:, :3].transpose(1, 2, 0), twists.reshape(len(some), 6 * nv).T

    @property
    def constants(self) -> Array:
        """The numbers that the stages of its kind are given."""
        return np.array(self.member.kind.constants or (0.0,))

    @property
    def twists(self) -> int:
        """The number of the components of all twists."""
        return 6 * len(range(self.member.v.start, self.member.v.stop))

    def rows(self, q: Array) -> tuple[Array, Array]:
        """Return the motion (12, B) and the twists (6 nv, B) at q[n, b]."""
        motion, twists = self.at(q)
        return motion.reshape(12, -1), twists

    def advance(self, q: Array, v: Array, dt: float) -> None:
        """Move its rows of q[n, b] by velocities v[m, b] held for dt seconds, in place."""
        some, rates = _rows(q, self.member.q), _rows(v, self.member.v)
        kind = self.member.kind
        q[self.member.q] = _called(kind, "integrate", some.shape[1:], some, rates, dt).T


def _rows(values: Array, rows: slice) -> Array:
    """Return a contiguous copy of some rows with the run first."""
    return np.ascontiguousarray(values[rows].T)


def _called(kind: JointKind, method: str, shape: tuple[int, ...], q: Array, *others: Any) -> Array:
    """Return the results of a method for each run, NaN for runs that ended or failed.

    InputError if it is of another shape.
    """
    for array in (q, *others[:-1]):
        frozen(array)
    fine = np.isfinite(q).all(axis=1)
    for other in others[:-1]:
        fine &= np.isfinite(other).all(axis=1)
    if fine.all():
        return _returned(kind, method, getattr(kind, method)(q, *others), (len(q), *shape))
    out = np.full((len(q), *shape), np.nan)
    if fine.any():
        some = (frozen(array[fine]) for array in (q, *others[:-1]))
        given = getattr(kind, method)(*some, *others[-1:])
        out[fine] = _returned(kind, method, given, (int(fine.sum()), *shape))
    return out


def _returned(kind: JointKind, method: str, given: Any, shape: tuple[int, ...]) -> Array:
    """Return the result of a method as an array; raise InputError if its shape is wrong."""
    try:
        values = np.asarray(given, dtype=np.float64)
    except (TypeError, ValueError):  # no numbers, or rows of unequal lengths
        values = np.empty(())
    if values.shape != shape:
        got = f"shape {values.shape}" if values.ndim else f"{said(given)}"
        raise InputError(f"{type(kind).__name__}.{method}: expected shape {shape}, got {got}")
    return values
