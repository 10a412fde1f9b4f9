"""The error that a pixel of noise leaves: e <- (1 - g) e - g L^+ n, with g = gain dt.

Statistics of N runs with their own noise; a variance of N normal numbers has the standard error
sqrt(2/N) of itself, and each is asserted within 4.5 of these.
"""

import numpy as np
import pytest

import robsim as rs

DT, N, GOAL = 0.04, 2000, rs.Pose.at(0, 0, -0.5)


def runs(gain_dt, *changes, **more):
    changes = [f"task.gain={gain_dt / DT!r}", *changes]
    scenario = rs.load_scenario(rs.examples.path("noise_floor"), changes)
    return scenario.run(start=np.tile(GOAL.q, (N, 1)), **more)


def L_goal():
    """Of pixels, at the goal: the chapter's eq. 14 times the focal length."""
    rows = []
    for X, Y in 0.1 * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]):
        x, y, Z = X / 0.5, Y / 0.5, 0.5
        rows += [
            [-1 / Z, 0, x / Z, x * y, -(1 + x * x), y],
            [0, -1 / Z, y / Z, 1 + y * y, -x * y, -x],
        ]
    return 600 * np.array(rows)


@pytest.mark.parametrize(("features", "sigma"), [("pixels", 1.0), ("points", 1 / 600)])
def test_the_noise_of_s_agrees_with_a_pixel(features, sigma):
    s = runs(0.2, f"task.features={features}", duration=DT).error.values[:, 0]
    share = np.cov(s.T) / sigma**2
    np.testing.assert_allclose(np.diag(share), 1.0, atol=4.5 * np.sqrt(2 / N))
    np.testing.assert_allclose(share - np.diag(np.diag(share)), 0.0, atol=4.5 / np.sqrt(N))


@pytest.mark.parametrize("gain_dt", [0.1, 0.2, 0.5, 1.0, 1.5])
def test_the_floor_in_the_image(gain_dt):
    """Of the marks 6 sigma^2 g/(2 - g) in all: six motions answer eight numbers of noise.

    Three percent are for the curvature of the image, which shows from g = 1 on.
    """
    end = runs(gain_dt, duration=4 * DT / gain_dt + 10 * DT, record="summary")
    square = ((end.pixels_end - end.pixels_goal).values ** 2).sum(axis=(1, 2)).mean()
    assert square / 6 == pytest.approx(
        gain_dt / (2 - gain_dt), rel=4.5 * np.sqrt(2 / (6 * N)) + 0.03
    )


@pytest.mark.parametrize("gain_dt", [0.1, 0.5])
def test_the_jitter_of_the_pose_agrees_with_its_information(gain_dt):
    """Covariance sigma^2 g/(2 - g) (L'L)^-1 of (v, omega) in camera axes; whitened, it is 1."""
    end = runs(gain_dt, duration=4 * DT / gain_dt + 10 * DT, record="summary").q_end.values
    away = np.column_stack([end[:, :3] - GOAL.position, 2 * end[:, 3:6]])  # R of the goal is 1
    covariance = gain_dt / (2 - gain_dt) * np.linalg.inv(L_goal().T @ L_goal())
    white = np.linalg.solve(np.linalg.cholesky(covariance), away.T)
    np.testing.assert_allclose(np.cov(white), np.eye(6), atol=4.5 * np.sqrt(2 / N) + 0.02)
    sideways, along = 1000 * end[:, [0, 2]].std(axis=0)
    assert 6 < sideways / along < 9  # 7.4: the image hardly distinguishes a step from a turn
