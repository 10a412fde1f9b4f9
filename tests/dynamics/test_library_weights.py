"""Weights of the library: printed numbers of the Puma, and dynamics of every arm with masses."""

import numpy as np
import pytest

import robsim as rs

NOMINAL = [0, np.pi / 4, np.pi, 0, np.pi / 4, 0]  # Corke's pose qn
ARMS = ("kinova_gen3", "lbr_iiwa14", "panda", "planar_2r", "planar_3r", "puma560", "rhino_xr4")


def test_the_puma_has_the_printed_gravity_load():
    """P. I. Corke, Robotics, Vision and Control, 2011, section 9.2; all printed digits."""
    load = rs.robots.puma560().gravity(NOMINAL)
    np.testing.assert_allclose(load, [0, 31.6399, 6.0351, 0, 0.0283, 0], rtol=0, atol=5e-5)


def test_the_puma_has_the_printed_mass_matrix():
    """P. I. Corke, Robotics, Vision and Control, 2011, section 9.2.2; all printed digits."""
    M = rs.robots.puma560().mass_matrix(NOMINAL)
    diagonal = [3.6594, 4.4137, 0.9378, 0.1925, 0.1713, 0.1941]
    np.testing.assert_allclose(M.diagonal(), diagonal, rtol=0, atol=5e-5)
    np.testing.assert_allclose(M[0, 1:3], [-0.4044, 0.1006], rtol=0, atol=5e-5)


@pytest.mark.parametrize("name", [*ARMS, "ur5e", "gantry", "pan_tilt", "rhino_gripper"])
def test_the_mass_matrix_of_an_arm_is_positive(name):
    robot = rs.robots.load(name)
    some = np.random.default_rng(0).uniform(-3, 3, (50, robot.nq))
    assert np.linalg.eigvalsh(robot.mass_matrix(some)).min() > 1e-6


@pytest.mark.parametrize("name", ["scara", "stanford_arm"])
def test_a_robot_without_masses_refuses_dynamics_by_its_name(name):
    robot = rs.robots.load(name)
    with pytest.raises(rs.errors.InputError, match=name):
        robot.gravity(robot.home)


def test_an_arm_of_solids_with_a_density_has_its_dynamics():
    """A homogeneous rod of mass m and length l: M = m l^2/3 + m r^2/4, g = m 9.81 l/2 cos q."""
    rod = rs.Wheel(0.02, 0.8, density=2700.0).at(rs.Pose.at(0.4, 0, 0, rpy=(0, np.pi / 2, 0)))
    turn = rs.joints.Joint("revolute", rs.Pose.at(rpy=(np.pi / 2, 0, 0)))
    links = [rs.joints.Link("base"), rs.joints.Link("rod", "base", turn, rod)]
    arm, m = rs.Robot("pendulum", links), 2700.0 * np.pi * 0.02**2 * 0.8
    expected = m * 0.8**2 / 3 + m * 0.02**2 / 4
    np.testing.assert_allclose(arm.mass_matrix([0.3]), [[expected]], rtol=1e-14)
    np.testing.assert_allclose(arm.gravity([0.3]), m * 9.81 * 0.4 * np.cos(0.3), rtol=1e-14)
