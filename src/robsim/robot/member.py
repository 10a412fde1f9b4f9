"""The joints of a tree that have coordinates of their own, and those of kinds of the user's own."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from robsim.base.arrays import Array
from robsim.base.errors import InputError
from robsim.kernels.tree import Bodies
from robsim.robot.joints.kind import JointKind


class Member(NamedTuple):
    """A joint that has coordinates of its own."""

    body: int
    kind: JointKind
    q: slice  # its rows among the coordinates of the tree
    v: slice  # and among the velocities
    rolls: bool  # whether it is a wheel that rolls under its vehicle


class OwnMotion(NamedTuple):
    """A joint whose kind is the user's own: what it does is written where the kernels read it.

    The twist of each of its velocities is six moves along and about the axes of its body, whose
    ratios are the components of the twist.
    """

    member: Member
    first: int  # row of the first of these ratios

    @property
    def moves(self) -> list[tuple[int, int, int, int, int]]:
        """Of each velocity and each component: velocity, body, whether it turns, axis, ratio."""
        body, v = self.member.body, self.member.v
        return [
            (j, body, c // 3, c % 3, self.first + 6 * (j - v.start) + c)
            for j in range(v.start, v.stop)
            for c in range(6)
        ]

    def put(self, q: Array, out: Bodies) -> None:
        """Write its motion at coordinates q[n, b] where its pose will be, and its ratios."""
        kind, some = self.member.kind, self._rows(q, self.member.q)
        runs, nv = len(some), self.member.v.stop - self.member.v.start
        T = _returned(kind, "motion", kind.motion(some), (runs, 4, 4))
        out.poses[self.member.body] = T[:, :3].transpose(1, 2, 0)
        twists = _returned(kind, "twists", kind.twists(some), (runs, nv, 6))
        out.ratio[self.first : self.first + 6 * nv] = twists.reshape(runs, 6 * nv).T

    def advance(self, q: Array, v: Array, dt: float) -> None:
        """Move its rows of q[n, b] by velocities v[m, b] held for dt, in place."""
        kind, rows = self.member.kind, self.member.q
        some, rates = self._rows(q, rows), self._rows(v, self.member.v)
        moved = kind.integrate(some, rates, dt)
        q[rows] = _returned(kind, "integrate", moved, some.shape).T

    @staticmethod
    def _rows(values: Array, rows: slice) -> Array:
        """A copy with the run first."""
        return np.ascontiguousarray(values[rows].T)


def _returned(kind: JointKind, method: str, given: Any, shape: tuple[int, ...]) -> Array:
    """What a method returned; InputError if it is of another shape."""
    try:
        values = np.asarray(given, dtype=np.float64)
    except (TypeError, ValueError):  # no numbers, or rows of unequal lengths
        values = np.empty(())
    if values.shape != shape:
        got = f"shape {values.shape}" if values.ndim else f"{given!r:.80}"
        raise InputError(f"{type(kind).__name__}.{method}: expected shape {shape}, got {got}")
    return values
