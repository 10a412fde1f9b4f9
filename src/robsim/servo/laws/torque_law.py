"""The law of Kelly, which commands joint torques without a velocity loop."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from robsim.base.arrays import Array, as_floats
from robsim.declare import DeclaredValue, Number, PerRun, register
from robsim.kernels.control import control_law
from robsim.servo.laws.command_quantity import CommandQuantity
from robsim.servo.laws.compiled_law import CommandAtGain, CompiledLaw, LawRows, scale_by_gain


@register("law", "torque")
@dataclass(frozen=True)
class TorqueLaw(CompiledLaw, DeclaredValue):
    """Torque law: descend a potential energy of the error by torques, tau = -gain (L J)' K f(e).

    The drive of the joints adds damping and compensates gravity (`rs.drives.TorqueInput`), so the
    joints obey

        tau = -gain (L J)' K f(e) - Kv qdot + g(q),

    without a velocity loop (fixed camera: Kelly 1996, "Robust asymptotically stable visual servoing
    of planar robots"; camera in the hand: Kelly, Carelli, Nasisi, Kuchen and Reyes 2000, "Stable
    visual servoing of camera-in-hand robotic systems"). The energy

        V = 1/2 qdot' M(q) qdot + U(e)

    is a Lyapunov function: it falls at the rate qdot' Kv qdot, as long as L J, gravity and the
    torque limits of the model are true, and the robot comes to rest where (L J)' K f(e) = 0.

    Without `saturation`, f(e) = e and U = 1/2 gain K e'e. With a saturation w,
    f(e) = w tanh(e/w) and U = gain K w^2 sum ln cosh(e/w): a feature pulls with at most w K, so
    large errors need no large torques, and the stiffness near the goal may be higher.

    The error does not decay at the rate `gain`. A joint with the inertia m and the stiffness
    k = gain K (L J)'(L J) oscillates at about sqrt(k/m) rad/s, and its damping ratio is
    Kv/(2 sqrt(k m)). With little damping, or with control periods that are long beside
    Kv/k, the loop oscillates. Unmodelled gravity dg leaves an error with gain (L J)' K e = dg.

    Raises
    ------
    InputError
        By the task, with an inverse, `feed_forward`, `limit`, `secondary`, Broyden's rule, a depth
        filter, or an adaptive gain of the command; by `simulate`, if the drive of the joints takes
        no torques, or with limits of `Safety` for velocities.

    Examples
    --------
    >>> from robsim.laws import ControlState
    >>> state = ControlState.of([0.1, -0.2], np.eye(2, 6), 0.5 * np.eye(6, 2))
    >>> TorqueLaw(stiffness=40.0).command(state)
    array([[-2.,  4.]])
    >>> TorqueLaw(stiffness=40.0, saturation=0.01).command(state).round(3)
    array([[-0.2,  0.2]])
    """

    stiffness: Annotated[
        float,
        Number(above=0),
        PerRun(()),
        "Stiffness K at a gain of 1/s: the torque in N m for each unit of the error and of L J.",
    ] = 1.0
    saturation: Annotated[
        float | None,
        Number(above=0),
        PerRun(()),
        "Error w beyond which the pull of a feature grows no more, in its unit; None: no limit.",
    ] = None
    command_quantity: ClassVar[CommandQuantity] = "torque"
    in_camera: ClassVar[bool] = False

    def stages(self, of: LawRows) -> CommandAtGain:
        """Add the stages of (L J)' K f(e); return a function that adds the command for a gain."""
        program = of.program
        force = program.result(
            control_law.compute_error_force,
            "force",
            of.k,
            errors=of.error,
            stiffness=program.number(self.stiffness),
            width=None if self.saturation is None else program.number(self.saturation),
        )
        pull = program.result(control_law.multiply_transpose, "x", of.n, A=of.A, y=force)
        return scale_by_gain(of, pull)

    def potential_energy(self, error: ArrayLike, gain: ArrayLike = 1.0) -> Array:
        """Return the potential energy U(e) of an error.

        Parameters
        ----------
        error : array_like of shape (..., k)
            Weighted error e.
        gain : float or array_like of shape (...), default 1.0
            Gain in 1/s.

        Returns
        -------
        ndarray of shape (...)
            Energy in joules, if the command is in N m and N.

        Raises
        ------
        InputError
            If an error is not finite.

        Examples
        --------
        >>> float(TorqueLaw(stiffness=40.0).potential_energy([0.1, -0.2]).round(12))
        1.0
        """
        e, w = as_floats(error, "error", ("k",)), self.saturation
        if w is None:
            unit = 0.5 * (e * e).sum(axis=-1)
        else:  # ln cosh x = |x| + ln((1 + exp(-2 |x|)) / 2), which does not overflow
            x = np.abs(e) / np.asarray(w)[..., None]
            unit = np.square(w) * (x + np.log1p(np.exp(-2.0 * x)) - np.log(2.0)).sum(axis=-1)
        energy: Array = np.asarray(gain) * np.asarray(self.stiffness) * unit
        return energy
