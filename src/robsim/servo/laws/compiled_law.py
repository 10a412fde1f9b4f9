"""Built-in laws: stages of a compiled program that Python can evaluate as well."""

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
from robsim.servo.laws.inverse import InverseKind, add_solve
from robsim.servo.task_product import TaskProduct

CommandAtGain = Callable[
    [BlockRows], BlockRows
]  # adds stages for the row of a gain and returns velocities (n,)


class LawRows(NamedTuple):
    """Rows of a program that a law reads, with its settings; see `ControlState`.

    A row that does not exist is -1.
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
    inverse: InverseKind
    product: TaskProduct | None  # A as L J, or None if A is no such product

    @property
    def one_motion(self) -> bool:
        """Whether A is the product of L and J."""
        return self.product is not None


class CompiledLaw(ABC):
    """Base of laws with velocities computed by the stages of a compiled program."""

    @abstractmethod
    def stages(self, of: LawRows) -> CommandAtGain:
        """Add the stages that do not depend on the gain; return a function that adds the others."""

    def command(self, state: ControlState) -> Array:
        """Return the velocities of the commanded joints.

        Parameters
        ----------
        state : ControlState
            Error, interaction matrix and Jacobian of B runs.

        Returns
        -------
        ndarray of shape (B, n)
            Velocities in rad/s or m/s.

        Raises
        ------
        InputError
            Unless `state` is a ControlState.
        """
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
        except TypeError:  # a user's subclass may have a field without a hash
            function = _build_law_function(self, *what)
        return view_runs_first(function(np.concatenate(rows)))


def _build_law_function(
    law: CompiledLaw, n: int, sizes: tuple[int, ...], inverse: InverseKind, one_motion: bool
) -> ProgramFunction:
    """Return the velocities (n,) of a law as a function of rows: gain, e, L, J, L J, s, q.

    `sizes` are the numbers of rows; s and q without rows are None.
    """
    program, k = Program(), sizes[1]
    shapes = (), (k,), (k, 6), (6, n), (k, n), sizes[5:6], sizes[6:]
    rows = [program.rows(*shape) for shape in shapes]
    first, error, L, J, A, *more = rows
    s, q = (each if each.size else None for each in more)
    product = TaskProduct(program, L, J, A) if one_motion else None
    of = LawRows(program, k, n, error, L, J, A, s, q, inverse, product)
    qd = law.stages(of)(first)
    assert program.compiled
    return ProgramFunction(program, first, qd, n)


_cached_law_function = lru_cache(maxsize=64)(_build_law_function)


def as_compiled_law(law: Any) -> CompiledLaw | None:
    """Return a law that consists of stages, or None if its `command` is Python code."""
    overridden = not isinstance(law, CompiledLaw) or type(law).command is not CompiledLaw.command
    return None if overridden else law


def scale_by_gain(of: LawRows, unit: BlockRows) -> CommandAtGain:
    """Return a function that adds the stage of -gain times the velocities `unit`."""
    return lambda gain: of.program.result(
        control_law.compute_joint_command, "qd", of.n, gain=gain, x=unit
    )


def add_joint_velocities(of: LawRows, V: BlockRows, length: BlockRows) -> BlockRows:
    """Add the stages of J^+ V (eq. 19), with v in units of `length`; return the rows (n,)."""
    program, options = of.program, {"length": length, "mode": 0}
    program.add(control_law.scale_length_unit, A=V.column, **options, B=V.column)
    J = program.result(control_law.scale_length_unit, "B", 6, of.n, A=of.J, **options)
    _, damping, rcond = of.inverse.numbers
    return add_solve(program, J, V, damping, rcond, J)
