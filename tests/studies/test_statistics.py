"""Numbers with intervals, and random numbers, which all analyses share."""

import numpy as np
import pytest

from robsim.geometry.pose import Pose
from robsim.geometry.rotation import random_quaternions
from robsim.statistics.estimate import Estimate
from robsim.statistics.proportions import estimate_share
from robsim.statistics.random_numbers import STUDIES, SUITES, RandomNumbers, uniform


def test_a_share_is_an_estimate_in_percent_with_its_count():
    found = estimate_share(713, 1000)
    assert (found.value, found.of, found.count, str(found)) == (
        0.713,
        1000,
        713,
        "71.3 % [68.4, 74.0]",
    )
    assert [estimate_share(count, 977).count for count in range(978)] == list(range(978))
    nothing = estimate_share(0, 0)
    assert (nothing.count, nothing.low, nothing.high, str(nothing)) == (0, 0.0, 1.0, "-")
    assert str(Estimate(0.12, -np.inf, np.inf, 3)) == "+0.12 [-]"


def test_a_row_of_random_numbers_depends_on_no_other_row():
    rows = np.array([40, 3, 17])
    np.testing.assert_array_equal(uniform(7, SUITES, rows, 5), uniform(7, SUITES, 50, 5)[rows])
    assert not np.isin(uniform(7, SUITES, 50, 5), uniform(7, STUDIES, 50, 5)).any()
    draws = RandomNumbers(7, "start", rows, attempt=2)
    np.testing.assert_array_equal(
        draws.uniform(4), RandomNumbers(7, "start", np.arange(50), attempt=2).uniform(4)[rows]
    )
    assert not np.isin(
        draws.uniform(4), RandomNumbers(7, "start", rows, attempt=3).uniform(4)
    ).any()


def test_random_rotations_are_uniform():
    """The mean of R is zero, and the mean angle is pi/2 + 2/pi (Haar measure)."""
    q = random_quaternions(uniform(0, SUITES, 20_000, 3))
    np.testing.assert_allclose(np.linalg.norm(q, axis=1), 1.0, rtol=1e-14)
    R = Pose.from_quaternion(np.zeros(3), q).rotation
    assert np.abs(R.mean(axis=0)).max() < 4 * np.sqrt(1 / 3 / 20_000)
    angle = 2 * np.arccos(np.abs(q[:, 3]))
    assert angle.mean() == pytest.approx(np.pi / 2 + 2 / np.pi, abs=4 * angle.std() / 141)
