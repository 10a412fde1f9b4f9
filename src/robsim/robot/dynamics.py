"""Dynamics of a robot: mass matrix, gravity load, inverse and forward dynamics, energies."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from robsim.base.arrays import Array, as_floats, as_positive, is_kernel_array
from robsim.base.errors import InputError
from robsim.geometry.pose import Pose, broadcast_leading_shape
from robsim.robot.kinematics import Kinematics
from robsim.robot.rigid_bodies import GRAVITY, Gravity
from robsim.robot.robot_coordinates import Coordinates
from robsim.robot.robot_origin import RobotOrigin
from robsim.robot.robot_weights import describe_source

if TYPE_CHECKING:  # not imported before use, to keep the start of RobSim quick
    from robsim.robot.dynamics_evaluator import DynamicsEvaluator, PreparedDynamics

_FLOAT = np.dtype(np.float64)
STEP_SLACK = 1e-9  # relative error of a time that is a whole number of steps
_NONE = np.empty(0)
_ABSENT: Any = object()  # of an argument that a quantity does not have
_OTHERS = "v", "a"  # names of the arguments after q


class FreeMotion(NamedTuple):
    """Motion of a robot under given forces, at each step.

    Attributes
    ----------
    times : ndarray of shape (steps + 1,)
        Times in seconds.
    q : ndarray of shape (..., steps + 1, nq)
        Coordinates in rad and m.
    v : ndarray of shape (..., steps + 1, nv)
        Velocities in rad/s and m/s.

    Examples
    --------
    >>> from robsim import Robot
    >>> from robsim.shapes import Ball
    >>> arm = Robot.from_dh([[0, 0, 1, 0]], shapes=[[], [Ball(0.1, mass=2.0)]])
    >>> arm.swing([0.0], seconds=0.1).times[-1]
    np.float64(0.1)
    """

    times: Array
    q: Array
    v: Array


class Dynamics(Kinematics):
    """Dynamics of a `Robot` of rigid links, without friction.

    The equation of motion is (Craig, Introduction to Robotics, section 6.8)

        M(q) a + c(q, v) + g(q) = tau,

    with the mass matrix M, the velocity product forces c, the gravity load g, and the forces tau of
    the joints. The inertia of links that do not move has no effect, and the armature of each joint
    is a part of M. Damping and friction of joints are not included. Joints are revolute, prismatic
    or floating, or mimic such a joint; the forces and the accelerations of a floating joint are in
    the axes of the moved frame, first linear and then angular.
    """

    base: Pose
    origin: RobotOrigin | None

    def mass_matrix(self, q: Coordinates) -> Array:
        """Return the mass matrix of the joints.

        The composite-rigid-body algorithm (Walker and Orin 1982; Featherstone, Rigid Body Dynamics
        Algorithms, 2008, table 6.2) computes M of the kinetic energy v' M v / 2. The armatures of
        the joints are on its diagonal.

        Parameters
        ----------
        q : array_like of shape (..., nq)
            Coordinates in rad and m. Their limits are not checked.

        Returns
        -------
        ndarray of shape (..., nv, nv)
            Symmetric matrices in kg m^2, kg m and kg.

        Raises
        ------
        InputError
            If no link has an inertia, or a joint has no dynamics.

        Examples
        --------
        >>> from robsim import Robot
        >>> from robsim.shapes import Ball
        >>> ball = Ball(0.1, mass=2.0)
        >>> arm = Robot.from_dh([[0, 0, 1, 0]], shapes=[[], [ball]])
        >>> arm.mass_matrix([0.0]).round(3)
        array([[2.008]])
        """
        return self._evaluate_dynamics("add_mass_matrix", GRAVITY, q)

    def gravity(self, q: Coordinates, *, gravity: Gravity = GRAVITY) -> Array:
        """Return the gravity load: the forces of the joints that hold the robot at rest.

        Parameters
        ----------
        q : array_like of shape (..., nq)
            Coordinates in rad and m. Their limits are not checked.
        gravity : array_like of shape (3,), default (0, 0, -9.81)
            Acceleration of gravity in m/s^2, in the axes of the frame that carries the base.

        Returns
        -------
        ndarray of shape (..., nv)
            Forces g(q) in N m and N.

        Raises
        ------
        InputError
            If no link has an inertia, or a joint has no dynamics.

        Examples
        --------
        >>> from robsim import Robot
        >>> from robsim.shapes import Ball
        >>> rows = [[0, 0, 1, 0]]
        >>> arm = Robot.from_dh(rows, shapes=[[], [Ball(0.1, mass=2.0)]])
        >>> arm.gravity([0.0], gravity=(0, -9.81, 0))
        array([19.62])
        """
        return self._evaluate_dynamics("add_gravity", gravity, q)

    def inverse_dynamics(
        self, q: Coordinates, v: ArrayLike, a: ArrayLike, *, gravity: Gravity = GRAVITY
    ) -> Array:
        """Return the forces of the joints that a motion needs.

        The recursive Newton-Euler algorithm (Luh, Walker and Paul 1980; Featherstone 2008, table
        5.1) computes tau = M(q) a + c(q, v) + g(q).

        Parameters
        ----------
        q : array_like of shape (..., nq)
            Coordinates in rad and m. Their limits are not checked.
        v : array_like of shape (..., nv)
            Velocities in rad/s and m/s.
        a : array_like of shape (..., nv)
            Accelerations in rad/s^2 and m/s^2.
        gravity : array_like of shape (3,), default (0, 0, -9.81)
            Acceleration of gravity in m/s^2, in the axes of the frame that carries the base.

        Returns
        -------
        ndarray of shape (..., nv)
            Forces in N m and N.

        Raises
        ------
        InputError
            If the shapes do not fit, no link has an inertia, or a joint has no dynamics.

        Examples
        --------
        >>> from robsim import Robot
        >>> from robsim.shapes import Ball
        >>> arm = Robot.from_dh([[0, 0, 1, 0]], shapes=[[], [Ball(0.1, mass=2.0)]])
        >>> arm.inverse_dynamics([0.0], [1.0], [10.0]).round(3)
        array([20.08])
        """
        return self._evaluate_dynamics("add_inverse", gravity, q, v, a)

    def forward_dynamics(
        self, q: Coordinates, v: ArrayLike, tau: ArrayLike, *, gravity: Gravity = GRAVITY
    ) -> Array:
        """Return the accelerations of the joints under forces.

        The articulated-body algorithm (Featherstone 2008, section 7.3 and table 7.1) solves
        M(q) a = tau - c(q, v) - g(q). Robots with floating or mimicking joints are solved with the
        mass matrix.

        Parameters
        ----------
        q : array_like of shape (..., nq)
            Coordinates in rad and m. Their limits are not checked.
        v : array_like of shape (..., nv)
            Velocities in rad/s and m/s.
        tau : array_like of shape (..., nv)
            Forces of the joints in N m and N.
        gravity : array_like of shape (3,), default (0, 0, -9.81)
            Acceleration of gravity in m/s^2, in the axes of the frame that carries the base.

        Returns
        -------
        ndarray of shape (..., nv)
            Accelerations in rad/s^2 and m/s^2.

        Raises
        ------
        InputError
            If the shapes do not fit, a joint has no dynamics, or the mass matrix is not positive
            definite at q. The message names the joint and its links.

        Examples
        --------
        >>> from robsim import Robot
        >>> from robsim.shapes import Ball
        >>> arm = Robot.from_dh([[0, 0, 1, 0]], shapes=[[], [Ball(0.1, mass=2.0)]])
        >>> arm.forward_dynamics([0.0], [1.0], [20.08]).round(3)
        array([10.])
        """
        return self._evaluate_dynamics("add_forward", gravity, q, v, tau)

    def kinetic_energy(self, q: Coordinates, v: ArrayLike) -> Array:
        """Return the kinetic energy v' M(q) v / 2 of the links and rotors, in J.

        Parameters
        ----------
        q : array_like of shape (..., nq)
            Coordinates in rad and m. Their limits are not checked.
        v : array_like of shape (..., nv)
            Velocities in rad/s and m/s.

        Returns
        -------
        ndarray of shape (...)
            Energies in J.

        Raises
        ------
        InputError
            If the shapes do not fit, no link has an inertia, or a joint has no dynamics.

        Examples
        --------
        >>> from robsim import Robot
        >>> from robsim.shapes import Ball
        >>> arm = Robot.from_dh([[0, 0, 1, 0]], shapes=[[], [Ball(0.1, mass=2.0)]])
        >>> float(arm.kinetic_energy([0.0], [2.0]))
        4.016
        """
        return self._evaluate_dynamics("add_kinetic_energy", GRAVITY, q, v)

    def potential_energy(self, q: Coordinates, *, gravity: Gravity = GRAVITY) -> Array:
        """Return the potential energy -sum(m g'c) of the moving links, in J.

        Parameters
        ----------
        q : array_like of shape (..., nq)
            Coordinates in rad and m. Their limits are not checked.
        gravity : array_like of shape (3,), default (0, 0, -9.81)
            Acceleration g of gravity in m/s^2, in the axes of the frame that carries the base.

        Returns
        -------
        ndarray of shape (...)
            Energies in J, with the centres of mass c from the origin of the base link.

        Raises
        ------
        InputError
            If no link has an inertia, or a joint has no dynamics.

        Examples
        --------
        >>> from robsim import Robot
        >>> from robsim.shapes import Ball
        >>> arm = Robot.from_dh([[0, 0, 1, 0]], shapes=[[], [Ball(0.1, mass=2.0)]])
        >>> float(arm.potential_energy([0.0], gravity=(-9.81, 0, 0)))
        19.62
        """
        return self._evaluate_dynamics("add_potential_energy", gravity, q)

    def swing(
        self,
        q: Coordinates,
        v: ArrayLike | None = None,
        *,
        seconds: float,
        step: float = 1e-3,
        torque: ArrayLike | None = None,
        gravity: Gravity = GRAVITY,
    ) -> FreeMotion:
        """Return the motion of the joints under forces, without drives, friction and limits.

        The Runge-Kutta method of order 4 integrates the forward dynamics. Its error decreases with
        the fourth power of the step.

        Parameters
        ----------
        q : array_like of shape (..., nq)
            Coordinates at the start, in rad and m.
        v : array_like of shape (..., nv), optional
            Velocities at the start. Default: at rest.
        seconds : float
            Duration, a whole number of steps.
        step : float, default 0.001
            Step of the integration, in seconds.
        torque : array_like of shape (nv,) or (..., steps, nv), optional
            Forces of the joints in N m and N: constant, or held during each step. Default: none.
        gravity : array_like of shape (3,), default (0, 0, -9.81)
            Acceleration of gravity in m/s^2, in the axes of the frame that carries the base.

        Returns
        -------
        FreeMotion
            Times, coordinates and velocities.

        Raises
        ------
        InputError
            If the shapes do not fit, the step does not divide the duration, the result is not
            finite, or `forward_dynamics` raises.

        Examples
        --------
        >>> from robsim import Robot
        >>> from robsim.shapes import Ball
        >>> arm = Robot.from_dh([[0, 0, 1, 0]], shapes=[[], [Ball(0.1, mass=2.0)]])
        >>> arm.swing([0.0], [1.0], seconds=0.5).q[-1]  # about a vertical axis
        array([0.5])
        """
        _ = self._has_positive_mass
        start = self.coordinates(q, limits=False)
        rate = np.zeros(self.nv) if v is None else as_floats(v, "v", (self.nv,))
        h, count = as_positive(step, "step"), _count_steps(seconds, step)
        tau = _read_torque(torque, self.nv, count)
        lead = broadcast_leading_shape(start.shape[:-1], rate.shape[:-1], "q and v")
        lead = broadcast_leading_shape(lead, tau.shape[:-2], "q, v and torque")
        arrays = [
            np.ascontiguousarray(np.broadcast_to(x, lead + x.shape[-axes:])).reshape(
                -1, *x.shape[-axes:]
            )
            for x, axes in ((start, 1), (rate, 1), (tau, 2))
        ]
        runs = len(arrays[0])
        results = np.empty((runs, count + 1, self.nq)), np.empty((runs, count + 1, self.nv))
        prepared = self._dynamics.prepare("add_runge_kutta", gravity, h)
        if runs:
            prepared.fill(prepared.fill_motion, count, *arrays, *results)
        if not all(self._dynamics.are_valid(x).all() for x in results):
            raise InputError(f"step of {h:g} s: too large, so that the motion is not finite")
        shaped = (x.reshape(*lead, count + 1, x.shape[-1]) for x in results)
        return FreeMotion(np.arange(count + 1) * np.float64(h), *shaped)

    def _evaluate_dynamics(
        self, quantity: str, gravity: Gravity, q: Any, v: Any = _ABSENT, a: Any = _ABSENT
    ) -> Array:
        """Return a quantity at q (..., nq), v and a (..., nv), of other types Any if convertible.

        The kernel checks the numbers while it evaluates them, as in `Kinematics`. A single
        configuration takes the short path.
        """
        prepared = self._usual_dynamics.get(quantity) if gravity is GRAVITY else None
        if (
            prepared is not None
            and _is_dense(q)
            and q.shape == prepared.q_shape
            and (v is _ABSENT or (_is_dense(v) and v.shape == prepared.v_shape))
            and (a is _ABSENT or (_is_dense(a) and a.shape == prepared.v_shape))
        ):
            out = np.empty(prepared.shape)
            flat = out if out.ndim == 1 else out.reshape(-1)
            if v is _ABSENT:
                usual = prepared.fill(prepared.fill_positions, 1, q, flat)
            else:
                usual = prepared.fill(
                    prepared.fill_dynamics, 1, q, v, _NONE if a is _ABSENT else a, flat
                )
            if usual:
                return out
        if prepared is None:
            prepared = self._prepare_dynamics(quantity, gravity)
        return self._evaluate_batch(prepared, [x for x in (q, v, a) if x is not _ABSENT])

    def _evaluate_batch(self, prepared: PreparedDynamics, values: Sequence[Any]) -> Array:
        """Return a quantity at numbers of any shape and type."""
        arrays = self._read_values(values)
        lead = arrays[0].shape[:-1]
        if any(x.shape[:-1] != lead for x in arrays):
            lead, arrays = _broadcast_runs(arrays)
        out, runs = np.empty(lead + prepared.shape), math.prod(lead)
        flat = [x.reshape(-1) for x in arrays]
        flat += [_NONE] if len(flat) == 2 else []
        kernel = prepared.fill_positions if len(flat) == 1 else prepared.fill_dynamics
        if runs and not prepared.fill(kernel, runs, *flat, out.reshape(-1)):
            self._check_values(arrays, out, self._is_plain)
        return out

    def _prepare_dynamics(self, quantity: str, gravity: Gravity) -> PreparedDynamics:
        """Return the compiled dynamics of a quantity; forces need a positive mass matrix."""
        if quantity == "add_forward":
            _ = self._has_positive_mass
        prepared = self._dynamics.prepare(quantity, gravity)
        if gravity is GRAVITY and self._is_plain:
            self._usual_dynamics[quantity] = prepared
        return prepared

    @cached_property
    def _usual_dynamics(self) -> dict[str, PreparedDynamics]:
        """Cache of `_prepare_dynamics` at the usual gravity, by quantity."""
        return {}

    def _read_values(self, values: Sequence[Any]) -> list[Array]:
        """Return coordinates and velocities as arrays that kernels can read."""
        q, nq, nv = values[0], self.nq, self.nv
        if not self._is_plain:
            first = self.coordinates(q, limits=False)
        else:
            first = q if is_kernel_array(q, nq) else as_floats(q, "q", (nq,))
        rest = [
            x if is_kernel_array(x, nv) else as_floats(x, name, (nv,))
            for x, name in zip(values[1:], _OTHERS, strict=False)
        ]
        return [first, *rest]

    def _check_values(self, arrays: Sequence[Array], out: Array, is_plain: bool) -> None:
        """Check numbers that the kernel finds unusual; raise InputError for invalid ones."""
        if is_plain:
            self.coordinates(arrays[0], limits=False)
        for x, name in zip(arrays[1:], _OTHERS, strict=False):
            as_floats(x, name, (self.nv,))
        invalid = ~self._dynamics.are_valid(out).reshape((*arrays[0].shape[:-1], -1))
        if invalid.any():
            self._dynamics.check_positive(arrays[0][invalid.any(axis=-1)][:1])
            raise InputError("q, v and a: too large, so that the result is not finite")

    @cached_property
    def _dynamics(self) -> DynamicsEvaluator:
        """Compiled dynamics, built once."""
        from robsim.robot.dynamics_evaluator import DynamicsEvaluator  # here, for a quick start

        source = describe_source(self.name, self.origin)
        return DynamicsEvaluator(source, self.links, self.tree, self.base.rotation)

    @cached_property
    def _has_positive_mass(self) -> bool:
        """True; InputError unless the mass matrix is positive definite in some configuration."""
        dynamics = self._dynamics
        home = np.broadcast_to(self.home, (len(dynamics.probes), self.nq))
        dynamics.check_positive(self.integrate(home, dynamics.probes, 1.0))
        return True


def _is_dense(x: Any) -> bool:
    """Return whether a value is an array of float64 whose last axis is contiguous."""
    return type(x) is np.ndarray and x.dtype is _FLOAT and x.strides == (8,)


def _broadcast_runs(values: Sequence[Array]) -> tuple[tuple[int, ...], list[Array]]:
    """Return the common leading shape of arrays, and the arrays with this shape."""
    lead = values[0].shape[:-1]
    for name, other in zip(_OTHERS, values[1:], strict=False):
        lead = broadcast_leading_shape(lead, other.shape[:-1], f"q and {name}")
    full = [np.broadcast_to(x, lead + x.shape[-1:]) for x in values]
    return lead, [np.ascontiguousarray(x) for x in full]


def _count_steps(seconds: float, step: float) -> int:
    """Return the number of steps in a time; InputError unless it is a whole number."""
    time = as_positive(seconds, "seconds")
    count = round(time / step)
    if count < 1 or abs(count * step - time) > STEP_SLACK * time:
        raise InputError(f"step of {step:g} s does not divide the duration of {time:g} s")
    return count


def _read_torque(torque: ArrayLike | None, nv: int, steps: int) -> Array:
    """Return forces (..., 1, nv) or (..., steps, nv)."""
    tau = as_floats(np.zeros(nv) if torque is None else torque, "torque", (nv,))
    if tau.ndim == 1:
        return tau[None]
    if tau.shape[-2] != steps:
        raise InputError(f"torque: expected shape ({nv},) or (..., {steps}, {nv}), got {tau.shape}")
    return tau
