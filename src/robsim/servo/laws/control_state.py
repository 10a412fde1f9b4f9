"""The state of a control loop at one instant, as a law is given it."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from robsim.base.arrays import Array, view_for_user
from robsim.base.errors import InputError
from robsim.servo.laws.control_state_checks import check_state_fields, put_runs_last
from robsim.servo.laws.inverse import Inverse, PseudoInverse, multiply_batches


@dataclass(frozen=True, eq=False)
class ControlState:
    """What a law is given: error, interaction matrix and Jacobian, as the controller models them.

    `ControlState.of` makes one. Names that end in `_last` have the run last, as the kernels do;
    the others are run-first views, all read-only. J maps the commanded joint velocities to the
    camera's twist relative to the target, so that sdot = L J qdot. `memory` keeps what a law puts
    there, arrays with the run first, until the next instant of the same runs; it is empty at the
    start.

    InputError: arrays of unequal numbers of runs, features or joints, or not finite.
    """

    error_last: Array  # (k, B)
    interaction_last: Array  # (k, 6, B)
    jacobian_last: Array  # (6, n, B)
    task_jacobian_last: Array  # (k, n, B) L J: how the commanded joints move the features
    gain: Any  # per second: a number, or (B, 1) where it depends on the error
    inverse: Inverse
    s_last: Array | None = None  # (k, B)
    q_last: Array | None = None  # (nq, B) coordinates of all robots
    time: float = 0.0  # seconds since the start
    dt: float = 0.04  # seconds for which the command is held
    memory: dict[str, Any] = field(default_factory=dict)
    one_motion: bool = False  # whether L J is the product of `interaction` and `jacobian`

    def __post_init__(self) -> None:
        vars(self).update(check_state_fields(vars(self)))

    @classmethod
    def of(
        cls,
        error: ArrayLike,
        interaction: ArrayLike,
        jacobian: ArrayLike,
        *,
        gain: Any = 1.0,
        inverse: Inverse | None = None,
        s: ArrayLike | None = None,
        q: ArrayLike | None = None,
        time: float = 0.0,
        dt: float = 0.04,
    ) -> ControlState:
        """Return a state from an error (B, k), L (B, k, 6) and J (B, 6, n); of one run without B.

        gain      per second, or (B,) of each run its own
        inverse   by default the pseudo-inverse
        s, q      features (B, k) and coordinates (B, nq), for laws that read them
        time, dt  seconds since the start, and of the period

        InputError: unequal numbers of runs, features or joints, or a number that is not finite.

        >>> from robsim.laws import JointLaw
        >>> state = ControlState.of([1.0, 2.0], np.eye(2, 6), np.eye(6, 2), gain=0.5)
        >>> JointLaw().command(state)
        array([[-0.5, -1. ]])
        """
        e = put_runs_last(error, "error", ("k",))
        L = put_runs_last(interaction, "interaction", ("k", 6))
        J = put_runs_last(jacobian, "jacobian", (6, "n"))
        if L.shape[::2] != e.shape or J.shape[2] != e.shape[1]:
            raise InputError(
                "expected error (B, k), interaction (B, k, 6) and jacobian (B, 6, n), got "
                f"{np.shape(error)}, {np.shape(interaction)} and {np.shape(jacobian)}"
            )
        return cls(
            e,
            L,
            J,
            multiply_batches(L, J),
            gain,
            PseudoInverse() if inverse is None else inverse,
            None if s is None else put_runs_last(s, "s", ("k",)),
            None if q is None else put_runs_last(q, "q", ("nq",)),
            time,
            dt,
            one_motion=True,
        )

    @property
    def error(self) -> Array:
        """The error e (B, k), weighted, and with feed-forward the motion of the target in it."""
        return view_for_user(self.error_last)

    @property
    def interaction(self) -> Array:
        """The interaction matrix L (B, k, 6), weighted."""
        return view_for_user(self.interaction_last)

    @property
    def jacobian(self) -> Array:
        """The Jacobian J (B, 6, n) of the camera's twist (v, omega) in its own axes."""
        return view_for_user(self.jacobian_last)

    @property
    def task_jacobian(self) -> Array:
        """The task Jacobian L J (B, k, n), whose rows are each of their own camera."""
        return view_for_user(self.task_jacobian_last)

    @property
    def s(self) -> Array:
        """The features s (B, k) as measured."""
        return view_for_user(_require_array(self.s_last, "features s"))

    @property
    def q(self) -> Array:
        """The coordinates q (B, nq) of all robots of the scene."""
        return view_for_user(_require_array(self.q_last, "coordinates q"))


def _require_array(array: Array | None, what: str) -> Array:
    """Return an array, or raise InputError where there is none."""
    if array is None:
        raise InputError(f"the law reads {what}, and the state has none")
    return array
