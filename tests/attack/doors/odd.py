"""Odd arguments that nobody should pass, and somebody will."""

from decimal import Decimal
from fractions import Fraction
from pathlib import Path

import numpy as np

import robsim as rs

ODD = (
    None, "", "é", "points", "1e400", 10**400, -(10**400), float("nan"), float("inf"),
    -float("inf"), -1, 0, 1, 2**63, 1e308, 5e-324, -0.0, 3.7, True, False, b"bytes", 1j,
    Path("nowhere"), [], (), {}, set(), {1, 2}, {"a": 1}, [[]], [None], ["a"], [1, [2, 3]],
    [[1, 2], [3]], [10**400], [float("nan")] * 6, "a" * 5000, "\0", "../..", object, object(), len,
    type, ..., NotImplemented, range(3), slice(2), Decimal("1.5"), Fraction(1, 3), Exception(),
    np.ones(0), np.ones((0, 2)), np.ones((1, 0, 2)), np.ones((2, 0)), np.ones(1), np.ones(2),
    np.ones(3), np.ones(6), np.ones(7), np.ones((4, 4)), np.eye(4), np.eye(3), np.ones((3, 3)),
    np.zeros((4, 2)), np.zeros((4, 3)), np.zeros((2, 4, 3)), np.full((4, 2), np.nan),
    np.full(6, 1e308), np.full((4, 3), -1e300), np.ones((2, 2, 2, 2)), np.ones(6, dtype=object),
    np.array([None] * 6), np.array(["a", "b"]), np.array(3.0), np.array("x"), np.ones(6, bool),
    np.ones(6, complex), np.ones(6, np.float32), np.arange(6), np.ma.masked_array([1.0] * 6),
    np.array(["2020-01-01"], dtype="datetime64[D]"), np.zeros((2, 6)), np.zeros((0, 6)),
    np.zeros(6, dtype=[("a", float)]), np.ones((4, 2))[::2], np.float32(2), np.int8(3),
    rs.Pose.at(1, 2, 3), rs.IBVS(), rs.features.Points, rs.features.Points(), rs.Camera(np.eye(3)),
    rs.shapes.Ball(1.0),
    rs.Outcome.CONVERGED, rs.robots.pan_tilt(), rs.errors.InputError("given"), rs.laws.JointLaw(),
    rs,
)  # fmt: skip


def odd(rng):
    """Return an odd value."""
    if rng.random() < 0.03:
        return (i for i in (1.0, 2.0, 3.0))
    value = ODD[rng.integers(len(ODD))]
    return np.array(value) if type(value) is np.ndarray and rng.random() < 0.5 else value
