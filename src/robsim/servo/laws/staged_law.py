"""Built-in laws, which are stages of a program and can be asked in Python as well."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from robsim.base.arrays import Array, first_view
from robsim.base.errors import InputError, said
from robsim.kernels.control import commanding
from robsim.kernels.machine.program import Function, Program
from robsim.kernels.machine.rows import Rows
from robsim.servo.laws.control_state import ControlState
from robsim.servo.laws.inverse import Inverse, solved

AtGain = Callable[[Rows], Rows]  # adds stages for the row of a gain, and returns velocities (n,)


class LawRows(NamedTuple):
    """The rows of a program that a law reads, and what else it is given; see `ControlState`.

    Rows that are not given are -1.
    """

    program: Program
    k: int
    n: int
    error: Rows  # (k,)
    L: Rows  # (k, 6)
    J: Rows  # (6, n)
    A: Rows  # (k, n) L J
    s: Rows | None  # (k,)
    q: Rows | None  # (nq,)
    inverse: Inverse
    one_motion: bool  # whether A is the product of L and J


class StagedLaw(ABC):
    """The base of laws whose velocities are computed by stages of a program."""

    @abstractmethod
    def stages(self, of: LawRows) -> AtGain:
        """Add the stages that do not depend on the gain; return what adds the others for one."""

    def command(self, state: ControlState) -> Array:
        """Return velocities (B, n) of the commanded joints in rad/s or m/s."""
        if not hasattr(state, "error_last"):
            name = type(self).__name__
            raise InputError(f"{name}.command: expected a ControlState, got {said(state)}")
        runs = state.error_last.shape[-1]
        L, J, A = state.interaction_last, state.jacobian_last, state.task_jacobian_last
        gain, none = np.empty((1, runs)), np.empty((0, runs))
        gain[:] = np.ravel(state.gain)
        more = (none if x is None else x for x in (state.s_last, state.q_last))
        rows = [x.reshape(-1, runs) for x in (gain, state.error_last, L, J, A, *more)]
        what = A.shape[1], tuple(map(len, rows)), state.inverse, state.one_motion
        try:
            function = _kept_function(self, *what)
        except TypeError:  # from a user's subclass with a field that has no hash
            function = _function(self, *what)
        return first_view(function(np.concatenate(rows)))


def _function(
    law: StagedLaw, n: int, sizes: tuple[int, ...], inverse: Inverse, one_motion: bool
) -> Function:
    """Return the velocities of a law (n,) as a function of so many rows: gain, e, L, J, L J, s, q.

    What has no rows is None.
    """
    program, k = Program(), sizes[1]
    shapes = (), (k,), (k, 6), (6, n), (k, n), sizes[5:6], sizes[6:]
    rows = [program.rows(*shape) for shape in shapes]
    first, error, L, J, A, *more = rows
    s, q = (each if each.size else None for each in more)
    of = LawRows(program, k, n, error, L, J, A, s, q, inverse, one_motion)
    qd = law.stages(of)(first)
    assert program.compiled
    return Function(program, first, qd, n)


_kept_function = lru_cache(maxsize=64)(_function)


def staged(law: Any) -> StagedLaw | None:
    """Return a law that is made of stages; None if a user's class commands in Python."""
    own = not isinstance(law, StagedLaw) or type(law).command is not StagedLaw.command
    return None if own else law


def times_gain(of: LawRows, unit: Rows) -> AtGain:
    """Return what adds the stage of -gain times some velocities."""
    return lambda gain: of.program.result(commanding.commanded, "qd", of.n, gain=gain, x=unit)


def realised(of: LawRows, V: Rows, length: Rows) -> Rows:
    """Add the stages of J^+ V, with |v| in units of a length (eq. 19); return the rows (n,)."""
    program, how = of.program, {"length": length, "how": 0}
    program.add(commanding.in_units, A=V.column, **how, B=V.column)
    J = program.result(commanding.in_units, "B", 6, of.n, A=of.J, **how)
    _, damping, rcond = of.inverse.numbers
    return solved(program, J, V, damping, rcond, J)
