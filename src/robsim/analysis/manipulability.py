"""Manipulability of a link, its condition number, and its distance from singularities."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from robsim.base.arrays import Array, as_positive
from robsim.base.errors import InputError, format_value, suggest_names
from robsim.robot.robot import Robot
from robsim.statistics.random_numbers import PROBES, uniform

VelocityAxes = Literal["all", "linear", "angular"]
AXIS_ROWS = {"all": slice(0, 6), "linear": slice(0, 3), "angular": slice(3, 6)}  # of (v, omega)
RANK_PROBES, PROBE_DISTANCE = 8, 2.0  # configurations for the rank, and their spread (m, rad)
ZERO_SHARE = 1e-9  # singular values below this share of the largest count as zero


def manipulability(
    robot: Robot,
    q: ArrayLike,
    link: str | None = None,
    axes: VelocityAxes = "all",
    length: float = 1.0,
) -> Array:
    """Return the product of the singular values of a link's Jacobian.

        w = s_1 s_2 ... s_r

    Up to a constant the product is the volume of the ellipsoid of link velocities that joint
    velocities of unit length produce. It is zero at singularities. For a Jacobian with no more rows
    than columns it equals the measure sqrt(det(J J^T)) of Yoshikawa 1985, "Manipulability of
    robotic mechanisms", International Journal of Robotics Research 4(2). This determinant is always
    zero for a Jacobian with more rows than columns. The product therefore covers the r largest
    singular values, with r the generic rank of J: all n values of an arm with n < 6 joints, or the
    values in the plane of a planar arm.

    Parameters
    ----------
    robot : Robot
        The robot.
    q : array_like of shape (..., nq)
        Configurations.
    link : str, optional
        Link. Default: the tip.
    axes : {"all", "linear", "angular"}, default "all"
        Rows of the Jacobian: all six velocities, or the linear or angular velocity alone.
    length : float, default 1.0
        Unit of length in metres: a displacement by `length` counts as much as a turn by one radian.

    Returns
    -------
    ndarray of shape (...)
        Manipulability; 0 for a link that never moves along the axes.

    Raises
    ------
    InputError
        If the link or the axes do not exist, or an argument is invalid.

    Examples
    --------
    >>> from robsim.files import robots
    >>> arm = robots.planar_2r()  # manipulability l1 l2 |sin q2|, of two links of 1 m
    >>> manipulability(arm, [[0.3, np.pi / 2], [0.3, 0.0]], axes="linear").round(9)
    array([1., 0.])
    """
    values = jacobian_singular_values(robot, q, link, axes, length)
    product: Array = values.prod(axis=-1) if values.shape[-1] else np.zeros(values.shape[:-1])
    return product


def singularity_distance(
    robot: Robot,
    q: ArrayLike,
    link: str | None = None,
    axes: VelocityAxes = "all",
    length: float = 1.0,
) -> Array:
    """Return the smallest singular value of a link's Jacobian, zero at a singularity.

    It is the distance from J to the nearest singular matrix in the spectral norm (Eckart and Young
    1936), and the speed of the link in its slowest direction for joint velocities of unit length.
    Directions along which the link never moves are left out. With axes="all" the value depends on
    `length`, because metres and radians are not comparable; a usual choice is the reach of the arm.

    Parameters
    ----------
    robot, q, link, axes, length
        As in `manipulability`.

    Returns
    -------
    ndarray of shape (...)
        Smallest singular value; 0 for a link that never moves along the axes.

    Raises
    ------
    InputError
        If the link or the axes do not exist, or an argument is invalid.

    Examples
    --------
    >>> from robsim.files import robots
    >>> puma = robots.puma560()  # its wrist is singular where q5 is 0
    >>> for q5 in (-60, -6, 0):
    ...     print(f"{singularity_distance(puma, np.radians([0, 80, -200, 0, q5, 0])):.4f}")
    0.2524
    0.0342
    0.0000
    """
    values = jacobian_singular_values(robot, q, link, axes, length)
    smallest: Array = values[..., -1] if values.shape[-1] else np.zeros(values.shape[:-1])
    return smallest


def condition_number(
    robot: Robot,
    q: ArrayLike,
    link: str | None = None,
    axes: VelocityAxes = "all",
    length: float = 1.0,
) -> Array:
    """Return the ratio of the largest to the smallest singular value of a link's Jacobian.

    The ratio is 1 at isotropic configurations, with equal velocities in all directions (Salisbury
    and Craig 1982, "Articulated hands: force control and kinematic issues"). It grows without bound
    near singularities, and is infinite if the smallest singular value is zero.

    Parameters
    ----------
    robot, q, link, axes, length
        As in `manipulability`.

    Returns
    -------
    ndarray of shape (...)
        Condition number; infinite for a link that never moves along the axes.

    Raises
    ------
    InputError
        If the link or the axes do not exist, or an argument is invalid.

    Examples
    --------
    >>> arm = Robot.from_dh([[0, 0, np.sqrt(2), 0], [0, 0, 1, 0]])  # the isotropic finger
    >>> float(condition_number(arm, np.radians([20, 135]), axes="linear").round(9))
    1.0
    """
    values = jacobian_singular_values(robot, q, link, axes, length)
    infinite = np.full(values.shape[:-1], np.inf)
    if not values.shape[-1]:
        return infinite
    largest, smallest = values[..., 0], values[..., -1]
    return np.asarray(np.divide(largest, smallest, out=infinite, where=smallest > 0))


def jacobian_singular_values(
    robot: Robot,
    q: ArrayLike,
    link: str | None = None,
    axes: VelocityAxes = "all",
    length: float = 1.0,
) -> Array:
    """Return the r largest singular values (..., r) of a link's Jacobian, in descending order.

    r is the generic rank of the Jacobian. Arguments as in `manipulability`.
    """
    if not isinstance(robot, Robot):
        raise InputError(f"expected a Robot, got {format_value(robot)}")
    if not isinstance(axes, str) or axes not in AXIS_ROWS:
        raise InputError(f"no axes {format_value(axes)}; {suggest_names(axes, AXIS_ROWS, 'axes')}")
    unit = as_positive(length, "length (metres)")
    q = robot.coordinates(q, limits=False)
    rank = _generic_rank(_all_singular_values(robot, _probe_configurations(robot), link, axes, 1.0))
    return _all_singular_values(robot, q, link, axes, unit)[..., :rank]


def _all_singular_values(
    robot: Robot, q: Array, link: str | None, axes: VelocityAxes, unit: float
) -> Array:
    """Return all singular values of J, with lengths in units of `unit` metres."""
    J = robot.jacobian(q, link)
    with np.errstate(over="ignore", invalid="ignore"):
        J[..., :3, :] /= unit
        J[..., [name == "m/s" for name in robot.velocity_units]] *= unit
    if not np.isfinite(J).all():
        raise InputError(f"length (metres): {unit:g} gives a Jacobian that is not finite")
    return np.asarray(np.linalg.svd(J[..., AXIS_ROWS[axes], :], compute_uv=False), dtype=np.float64)


def _probe_configurations(robot: Robot) -> Array:
    """Return (TRIED, nq) fixed configurations around home."""
    rates = PROBE_DISTANCE * (2 * uniform(0, PROBES, RANK_PROBES, robot.nv) - 1)
    return robot.integrate(robot.home, rates, 1.0)


def _generic_rank(values: Array) -> int:
    """Return the highest rank among several configurations, from their singular values."""
    if not values.size:
        return 0
    largest = values.max()
    return int((values > ZERO_SHARE * largest).sum(axis=-1).max()) if largest > 0 else 0
