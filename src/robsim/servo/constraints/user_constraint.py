"""Constraints of a user: any object that returns the rows of its inequalities."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Protocol, cast, runtime_checkable

import numpy as np

from robsim.base.arrays import Array, make_read_only, view_for_user
from robsim.base.errors import CodeError, format_value
from robsim.declare import KindOf, ListOf
from robsim.kernels.machine.program import Blocks
from robsim.servo.constraints.constraint import (
    CONSTRAINTS,
    HARD,
    SPACE,
    VIEW,
    Constraint,
    ConstraintInputs,
    ConstraintPlace,
    ConstraintRows,
    JointConstraint,
    RowConstraint,
)
from robsim.servo.user_return import check_returned_array
from robsim.world.scene import Scene


@dataclass(frozen=True, eq=False)
class ConstraintState:
    """Input of a user's constraint at one instant, for B runs.

    Attributes
    ----------
    q_last : ndarray of shape (nq, B)
        Measured coordinates of all robots.
    wish_last : ndarray of shape (n, B)
        Command of the law without constraints.
    time : float
        Time since the start, in seconds.
    dt : float
        Period of the loop, in seconds.
    scene : Scene
        Scene as the controller models it.
    velocity_names : tuple of str
        Names of the n commanded velocities.

    Examples
    --------
    >>> import robsim as rs
    >>> scene = rs.load_scenario(rs.examples.path("eye_in_hand")).scene
    >>> q, wish = scene.home[:, None], np.zeros((7, 1))
    >>> ConstraintState(q, wish, 0.0, 0.04, scene, scene.velocity_names).wish.shape
    (1, 7)
    """

    q_last: Array
    wish_last: Array
    time: float
    dt: float
    scene: Scene
    velocity_names: tuple[str, ...]

    @property
    def q(self) -> Array:
        """Coordinates (B, nq)."""
        return view_for_user(self.q_last)

    @property
    def wish(self) -> Array:
        """Command of the law without constraints (B, n)."""
        return view_for_user(self.wish_last)


@runtime_checkable
class UserConstraint(Protocol):
    """Protocol of a user's constraint: the names of its rows, and the rows.

    The attribute `level` is 0 for rows that give way last, 1 (the default) for rows that give way
    as those of space, and 2 for rows that give way first, as those of the field of view. A class
    with compiled stages derives from `RowConstraint` and registers a kind, as the built-in ones.

    Examples
    --------
    The velocities of two joints differ by at most 0.1 rad/s:

    >>> import robsim as rs
    >>> class Together:
    ...     names = "joint 1 is faster", "joint 2 is faster"
    ...     def rows(self, state):
    ...         C = np.zeros((len(state.q), 2, len(state.velocity_names)))
    ...         C[:, 0, :2], C[:, 1, :2] = (-1.0, 1.0), (1.0, -1.0)
    ...         return C, np.full((len(state.q), 2), -0.1)
    >>> scenario = rs.load_scenario(rs.examples.path("eye_in_hand"))
    >>> for law in "joint", rs.laws.ConstrainedLaw([Together()]):
    ...     run = scenario.at("task.law", law).run()
    ...     print(f"{float(abs(run.qd[:, 0] - run.qd[:, 1]).max()):.2f}")
    0.49
    0.10
    """

    @property
    def names(self) -> Sequence[str]:
        """Names of the m rows, for `run.active` and `run.slack`."""

    def rows(self, state: ConstraintState) -> tuple[Array, Array]:
        """Return the inequalities C qdot >= bound.

        Parameters
        ----------
        state : ConstraintState
            Coordinates and wished command of B runs.

        Returns
        -------
        C : ndarray of shape (B, m, n)
            Factors of the commanded velocities.
        bound : ndarray of shape (B, m)
            Least values; -inf where a row does not act.
        """


class UserRows(RowConstraint):
    """The rows of a user's constraint, which a stage in Python asks for at each step."""

    def __init__(self, own: UserConstraint) -> None:
        self.own, self.who = own, type(own).__name__
        names = own.names
        if isinstance(names, str) or not isinstance(names, Sequence) or not names:
            raise CodeError(f"{self.who}.names: expected names of rows, got {format_value(names)}")
        if not all(isinstance(name, str) and name for name in names):
            raise CodeError(f"{self.who}.names: expected texts, got {format_value(names)}")
        if not callable(own.rows):
            got = format_value(own.rows)
            raise CodeError(f"{self.who}.rows: expected a method rows(state), got {got}")
        self.names = list(names)
        self.level: int = getattr(own, "level", SPACE)  # type: ignore[misc]
        if self.level not in (HARD, SPACE, VIEW):
            got = format_value(self.level)
            raise CodeError(f"{self.who}.level: expected 0, 1 or 2, got {got}")

    def label(self, place: ConstraintPlace) -> list[str]:
        """Return the names of the rows."""
        return self.names

    def stages(self, of: ConstraintInputs) -> ConstraintRows:
        """Add the stage of the rows, which runs in Python; return them."""
        program, m, n = of.inputs.program, len(self.names), of.columns.size
        names = tuple(of.scene.velocity_names[i] for i in of.columns)

        def ask(blocks: Blocks, step: int) -> Array:
            q, wish = (make_read_only(blocks.get(rows)) for rows in (of.inputs.q, of.wish))
            seconds = of.inputs.seconds
            state = ConstraintState(q, wish, step * seconds, seconds, of.scene, names)
            return self._ask_rows(state)

        rows = program.add_python_rows(ask, m * n + m)
        return ConstraintRows(rows[: m * n].reshape(m, n), rows[m * n :])

    def _ask_rows(self, state: ConstraintState) -> Array:
        """Return C and bound (m n + m, B); raise CodeError for wrong shapes and values."""
        who, m, (n, B) = f"{self.who}.rows", len(self.names), state.wish_last.shape
        value = self.own.rows(state)
        if not isinstance(value, tuple | list) or len(value) != 2:
            raise CodeError(f"{who} returned {format_value(value)} where C and bound are needed")
        C = check_returned_array(value[0], f"{who}: C", (B, m, n))
        bound = check_returned_array(value[1], f"{who}: bound", (B, m))
        going = np.isfinite(state.q_last).all(axis=0)  # ended runs may hold NaN
        if not np.isfinite(C[going]).all():
            raise CodeError(f"{who}: C must be finite, got {format_value(C.tolist())}")
        if not (bound[going] < np.inf).all():
            raise CodeError(
                f"{who}: bound must be finite or -inf, got {format_value(bound.tolist())}"
            )
        return np.concatenate([C.reshape(B, m * n), bound], axis=1).T


def adapt_constraint(one: Any) -> Constraint:
    """Return a constraint; a user's becomes one with a stage in Python.

    Raises CodeError if its names or its level are invalid.
    """
    if isinstance(one, RowConstraint | JointConstraint):
        return cast(Constraint, one)
    return UserRows(one)


ConstraintLike = RowConstraint | JointConstraint | UserConstraint | str  # or its name
CONSTRAINT_LIST = ListOf(
    KindOf(CONSTRAINTS, protocol=UserConstraint), 1, 32, alone=True, growing=True
)
