"""Built-in laws, which are stages of a program and can be asked in Python as well."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from robsim.base.arrays import Array, view_runs_first
from robsim.base.errors import InputError, format_value
from robsim.kernels.control import control_law
from robsim.kernels.machine.block_rows import BlockRows
from robsim.kernels.machine.program import Program, ProgramFunction
from robsim.servo.laws.control_state import ControlState
from robsim.servo.laws.inverse import Inverse, add_solve

CommandAtGain = Callable[
    [BlockRows], BlockRows
]  # adds stages for the row of a gain, and returns velocities (n,)


class LawRows(NamedTuple):
    """The rows of a program that a law reads, and what else it is given; see `ControlState`.

    Rows that are not given are -1.
    """

    program: Program
    k: int
    n: int
    error: BlockRows  # (k,)
    L: BlockRows  # (k, 6)
    J: BlockRows  # (6, n)
    A: BlockRows  # (k, n) L J
    s: BlockRows | None  # (k,)
    q: BlockRows | None  # (nq,)
    inverse: Inverse
    one_motion: bool  # whether A is the product of L and J


class CompiledLaw(ABC):
    """The base of laws whose velocities are computed by stages of a program."""

    @abstractmethod
    def stages(self, of: LawRows) -> CommandAtGain:
        """Add the stages that do not depend on the gain; return what adds the others for one."""

    def command(self, state: ControlState) -> Array:
        """Return velocities (B, n) of the commanded joints in rad/s or m/s."""
        if not hasattr(state, "error_last"):
            name = type(self).__name__
            raise InputError(f"{name}.command: expected a ControlState, got {format_value(state)}")
        runs = state.error_last.shape[-1]
        L, J, A = state.interaction_last, state.jacobian_last, state.task_jacobian_last
        gain, none = np.empty((1, runs)), np.empty((0, runs))
        gain[:] = np.ravel(state.gain)
        more = (none if x is None else x for x in (state.s_last, state.q_last))
        rows = [x.reshape(-1, runs) for x in (gain, state.error_last, L, J, A, *more)]
        what = A.shape[1], tuple(map(len, rows)), state.inverse, state.one_motion
        try:
            function = _cached_law_function(self, *what)
        except TypeError:  # from a user's subclass with a field that has no hash
            function = _build_law_function(self, *what)
        return view_runs_first(function(np.concatenate(rows)))


def _build_law_function(
    law: CompiledLaw, n: int, sizes: tuple[int, ...], inverse: Inverse, one_motion: bool
) -> ProgramFunction:
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
    return ProgramFunction(program, first, qd, n)


_cached_law_function = lru_cache(maxsize=64)(_build_law_function)


def as_compiled_law(law: Any) -> CompiledLaw | None:
    """Return a law that is made of stages; None if a user's class commands in Python."""
    own = not isinstance(law, CompiledLaw) or type(law).command is not CompiledLaw.command
    return None if own else law


def scale_by_gain(of: LawRows, unit: BlockRows) -> CommandAtGain:
    """Return what adds the stage of -gain times some velocities."""
    return lambda gain: of.program.result(
        control_law.compute_joint_command, "qd", of.n, gain=gain, x=unit
    )


def add_joint_velocities(of: LawRows, V: BlockRows, length: BlockRows) -> BlockRows:
    """Add the stages of J^+ V, with |v| in units of a length (eq. 19); return the rows (n,)."""
    program, how = of.program, {"length": length, "how": 0}
    program.add(control_law.scale_length_unit, A=V.column, **how, B=V.column)
    J = program.result(control_law.scale_length_unit, "B", 6, of.n, A=of.J, **how)
    _, damping, rcond = of.inverse.numbers
    return add_solve(program, J, V, damping, rcond, J)
