"""State of a control loop at one instant, the input of a law."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, cast

import numpy as np
from numpy.typing import ArrayLike

from robsim.base.arrays import Array, view_for_user
from robsim.base.errors import InputError
from robsim.servo.laws.control_state_checks import check_state_fields, put_runs_last
from robsim.servo.laws.inverse import InverseKind, PseudoInverse, multiply_batches


@dataclass(frozen=True, eq=False)
class ControlState:
    """Input of a control law: error, interaction matrix and Jacobian at one instant.

    All quantities follow the model of the controller, which may differ from the true scene.
    `ControlState.of` makes a state from arrays with the run first. The fields that end in `_last`
    have the run last, as the kernels do; the properties are run-first views. All arrays are
    read-only. J maps the commanded joint velocities to the twist of the camera relative to the
    target, so that sdot = L J qdot.

    Attributes
    ----------
    error_last : ndarray of shape (k, B)
        Error e, weighted.
    interaction_last : ndarray of shape (k, 6, B)
        Interaction matrix L.
    jacobian_last : ndarray of shape (6, n, B)
        Jacobian J of the camera relative to the target.
    task_jacobian_last : ndarray of shape (k, n, B)
        L J, the change of the features by the commanded joints.
    gain : float or ndarray of shape (B, 1)
        Gain in 1/s; one for each run if it depends on the error.
    inverse : PseudoInverse, DampedInverse or JacobianTranspose
        Inverse for the law.
    s_last : ndarray of shape (k, B), optional
        Measured features.
    q_last : ndarray of shape (nq, B), optional
        Coordinates of all robots.
    time : float, default 0.0
        Time since the start, in seconds.
    dt : float, default 0.04
        Period of the loop, during which the command is constant, in seconds.
    memory : dict
        Memory of the law. It is empty at the start and keeps arrays, with the run first, until the
        next instant of the same runs.
    one_motion : bool, default False
        Whether L J is the product of `interaction` and `jacobian`.

    Raises
    ------
    InputError
        If the numbers of runs, features or joints differ, or if a number is not finite.

    Examples
    --------
    >>> state = ControlState.of([1.0, 2.0], 2 * np.eye(2, 6), np.eye(6, 3), gain=0.5)
    >>> state.task_jacobian
    array([[[2., 0., 0.],
            [0., 2., 0.]]])
    """

    error_last: Array
    interaction_last: Array
    jacobian_last: Array
    task_jacobian_last: Array
    gain: float | Array
    inverse: InverseKind
    s_last: Array | None = None
    q_last: Array | None = None
    time: float = 0.0
    dt: float = 0.04
    memory: dict[str, Any] = field(default_factory=dict)  # Any: a law may store any values
    one_motion: bool = False

    def __post_init__(self) -> None:
        vars(self).update(check_state_fields(vars(self)))

    @classmethod
    def of(
        cls,
        error: ArrayLike,
        interaction: ArrayLike,
        jacobian: ArrayLike,
        *,
        gain: ArrayLike = 1.0,
        inverse: InverseKind | None = None,
        s: ArrayLike | None = None,
        q: ArrayLike | None = None,
        time: float = 0.0,
        dt: float = 0.04,
    ) -> ControlState:
        """Return a state from an error, L and J of B runs, or of one run without the axis of runs.

        Parameters
        ----------
        error : array_like of shape (B, k) or (k,)
            Feature error e.
        interaction : array_like of shape (B, k, 6) or (k, 6)
            Interaction matrix L.
        jacobian : array_like of shape (B, 6, n) or (6, n)
            Jacobian J of the camera relative to the target.
        gain : float or array_like of shape (B,), default 1.0
            Gain in 1/s.
        inverse : PseudoInverse, DampedInverse or JacobianTranspose, optional
            Inverse for the law. Default: the pseudo-inverse.
        s : array_like of shape (B, k), optional
            Features, for laws that read them.
        q : array_like of shape (B, nq), optional
            Coordinates of all robots, for laws that read them.
        time : float, default 0.0
            Time since the start, in seconds.
        dt : float, default 0.04
            Period of the loop, in seconds.

        Returns
        -------
        ControlState
            The state.

        Raises
        ------
        InputError
            If the numbers of runs, features or joints differ, or if a number is not finite.

        Examples
        --------
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
            cast(Array, gain),  # checked and converted by `__post_init__`
            PseudoInverse() if inverse is None else inverse,
            None if s is None else put_runs_last(s, "s", ("k",)),
            None if q is None else put_runs_last(q, "q", ("nq",)),
            time,
            dt,
            one_motion=True,
        )

    @property
    def error(self) -> Array:
        """Error e (B, k), weighted; with feed-forward it contains the motion of the target."""
        return view_for_user(self.error_last)

    @property
    def interaction(self) -> Array:
        """Interaction matrix L (B, k, 6), weighted."""
        return view_for_user(self.interaction_last)

    @property
    def jacobian(self) -> Array:
        """Jacobian J (B, 6, n) of the camera twist (v, omega) in camera axes."""
        return view_for_user(self.jacobian_last)

    @property
    def task_jacobian(self) -> Array:
        """Task Jacobian L J (B, k, n); each row belongs to the camera of its feature."""
        return view_for_user(self.task_jacobian_last)

    @property
    def s(self) -> Array:
        """Measured features s (B, k)."""
        return view_for_user(_require_array(self.s_last, "features s"))

    @property
    def q(self) -> Array:
        """Coordinates q (B, nq) of all robots of the scene."""
        return view_for_user(_require_array(self.q_last, "coordinates q"))


def _require_array(array: Array | None, what: str) -> Array:
    """Return an array; raise InputError if it is None."""
    if array is None:
        raise InputError(f"the law reads {what}, which the state does not have")
    return array
