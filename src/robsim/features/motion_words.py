"""Motions of a camera and of joints in words."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from robsim.base.arrays import Array

NEAR = 1e-4  # metres that words do not mention
SMALL = 1e-6  # relative size of components that count as zero
MINOR = 0.01  # relative size of joint velocities that are not listed
DIGITS = 3  # significant digits of numbers in words


def reduce_motions(basis: Array, is_twist: bool) -> Array:
    """Return a basis (n, m) of the same motions with as many zeros as possible.

    Of camera twists (v, omega), motions without rotation come first, and rotations have the
    shortest v: their axes pass the nearest points.
    """
    if not basis.size:
        return basis
    if not is_twist:
        return _reduce_columns(basis)
    _, sigma, Vt = np.linalg.svd(basis[3:])
    rank = int((sigma > SMALL).sum())
    shifts, turns = basis @ Vt[rank:].T, basis @ Vt[:rank].T
    if shifts.size:
        Q, _ = np.linalg.qr(shifts[:3])
        turns[:3] -= Q @ (Q.T @ turns[:3])
        shifts = np.concatenate([_reduce_columns(Q), np.zeros((3, Q.shape[1]))])
    if turns.size:
        turns = _reduce_columns(turns[[3, 4, 5, 0, 1, 2]])[[3, 4, 5, 0, 1, 2]]  # omega decides
    return np.concatenate([shifts, turns], axis=1)


def _reduce_columns(basis: Array) -> Array:
    """Return the columns combined so that each has a 1 where the others have a 0."""
    reduced, used = basis.copy(), list[int]()
    for j in range(reduced.shape[1]):
        sizes = np.abs(reduced[:, j])
        sizes[used] = 0.0
        pivot = int(np.argmax(sizes > 0.5 * sizes.max()))
        reduced[:, j] /= reduced[pivot, j]
        others = np.arange(reduced.shape[1]) != j
        reduced[:, others] -= reduced[:, [j]] * reduced[pivot, others]
        used.append(pivot)
    reduced[np.abs(reduced) < SMALL * np.abs(reduced).max(axis=0)] = 0.0
    return reduced[:, np.argsort(used)]


def describe_twist(V: Array) -> str:
    """Return a camera twist (6,) in words: a translation, or a rotation about an axis.

    >>> describe_twist(np.array([0, 0, 1.0, 0, 0, 0]))
    'the camera may move along its z axis'
    >>> describe_twist(np.array([0, 0.5, 0, 1.0, 0, 0]))
    'the camera may turn about the axis parallel to x through (0, 0, 0.5) m'
    """
    v, omega = V[:3], V[3:]
    size = np.linalg.norm(omega)
    if size <= SMALL * np.linalg.norm(v):
        return f"the camera may move along {_name_direction(v, 'its {} axis')}"
    point, pitch = np.cross(omega, v) / size**2, omega @ v / size**2
    if np.linalg.norm(point) < NEAR:
        axis = _name_direction(omega, "its {} axis")
    else:
        where = ", ".join(_format_number(round(x, 4)) for x in point)
        axis = f"the axis parallel to {_name_direction(omega, '{}')} through ({where}) m"
    text, advance = f"the camera may turn about {axis}", np.radians(10) * abs(pitch)
    if advance < NEAR:
        return text
    return f"{text} and move {_format_number(1000 * advance)} mm along it per 10 degrees"


def describe_joint_motion(qd: Array, names: Sequence[str]) -> str:
    """Return joint velocities (n,) in words, relative to the largest.

    >>> describe_joint_motion(np.array([0.0, 2.0, -1.0, 0.001]), ["a", "b", "c", "d"])
    'b 1, c -0.5, others below 0.01'
    """
    ratio = qd / qd[np.argmax(np.abs(qd))]
    sizes = np.abs(ratio)
    if (sizes > SMALL).sum() == 1:
        return f"{names[int(np.argmax(sizes))]} alone"
    pairs = [
        f"{names[i]} {_format_number(ratio[i])}" for i in np.flatnonzero(sizes >= MINOR).tolist()
    ]
    rest = ["others below 0.01"] if ((sizes > SMALL) & (sizes < MINOR)).any() else []
    return ", ".join([*pairs, *rest])


def _name_direction(d: Array, axis: str) -> str:
    """Return the name of an axis, or the unit vector of a direction in camera axes."""
    unit = d / np.linalg.norm(d)
    unit = unit * np.sign(unit[np.argmax(np.abs(unit))])
    if np.abs(unit).max() > 1 - SMALL:
        return axis.format("xyz"[int(np.argmax(np.abs(unit)))])
    return f"({', '.join(_format_number(x) for x in unit)})"


def _format_number(x: float) -> str:
    """Return a number with few digits, without an exponent for usual sizes."""
    return f"{0.0 if abs(x) < SMALL else x:.{DIGITS}g}"
