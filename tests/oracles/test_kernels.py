"""The kernels against stored numbers of other programs (each with its generator beside it)."""

import json
from pathlib import Path

import numpy as np
import pytest

import robsim as rs
from robsim.kernels.estimation import pose_fit
from robsim.kernels.formulas import random, se3
from robsim.kernels.linear_algebra import pseudoinverse
from robsim.robot.frame import Frame
from robsim.robot.joint import Joint
from robsim.robot.tree import Tree

HERE = Path(__file__).parent


def stored(name):
    return json.loads((HERE / name).read_text())


def close(a, b, tolerance):
    np.testing.assert_allclose(a, b, rtol=0, atol=tolerance)


def test_exponential_and_its_inverses_agree_with_60_digits_at_every_angle():
    for case in stored("se3_mpmath.json")["cases"]:
        w = np.array(case["omega"])
        T = np.empty((3, 4, 1))
        se3.exp_se3(np.r_[case["v"], w][:, None], T)
        close(T[:, :, 0], case["T"], 1e-15 * (1 + np.linalg.norm(case["v"])) * 2)
        quaternion, back = np.empty((4, 1)), np.empty((3, 1))
        se3.rotation_to_quaternion(T, quaternion)
        expected = np.array(case["quaternion"])
        sign = 1.0 if quaternion[:, 0] @ expected > 0 else -1.0
        close(sign * quaternion[:, 0], expected, 4e-16)
        se3.rotation_vector(quaternion, back)
        near_pi = np.pi - np.linalg.norm(w) < 1e-7  # there the axis may come out reversed
        sign = -1.0 if near_pi and back[:, 0] @ w < 0 else 1.0
        close(sign * back[:, 0], w, 1e-8 if near_pi else 4e-15)


def test_a_small_rotation_keeps_its_relative_accuracy():
    for case in stored("se3_mpmath.json")["cases"]:
        w = np.array(case["omega"])
        if 0 < np.linalg.norm(w) < 1e-3:
            T, quaternion, back = np.empty((3, 4, 1)), np.empty((4, 1)), np.empty((3, 1))
            se3.exp_se3(np.r_[0, 0, 0, w][:, None], T)
            se3.rotation_to_quaternion(T, quaternion)
            se3.rotation_vector(quaternion, back)
            np.testing.assert_allclose(back[:, 0], w, rtol=1e-14, atol=1e-15 * np.linalg.norm(w))


def test_the_coefficient_of_log_agrees_with_60_digits_at_every_angle():
    for angle, expected in stored("se3_mpmath.json")["log_coefficients"]:
        close(se3.log_coefficient(angle), expected, 1e-15 * expected)
    assert se3.log_coefficient(0.0) == 1 / 12


def test_a_held_body_twist_moves_a_floating_joint_as_pinocchio_does():
    tree = Tree([Frame("free", "world", Joint("floating"))])
    for case in stored("pinocchio_freeflyer.json")["cases"]:
        q, V = np.array(case["q"])[:, None].copy(), np.array(case["V"])[:, None]
        tree.flow(q, V, case["dt"])
        expected = np.array(case["q_next"])
        close(q[:3, 0], expected[:3], 2e-13)  # Pinocchio itself is off by 5e-14 near 1e-4 rad
        close(q[3:, 0] * np.sign(q[3:, 0] @ expected[3:]), expected[3:], 1e-14)


def test_a_held_velocity_in_the_plane_is_an_arc_to_the_last_digits():
    """Turns of 0, and of 1e-300 to 20 rad; a unicycle without any sideways motion."""
    planar, unicycle = (
        Tree([Frame("cart", "world", Joint(kind))]) for kind in ("planar", "unicycle")
    )
    for case in stored("arcs_mpmath.json")["cases"]:
        v = np.array(case["v"])[:, None]
        kinds = [(planar, v)] + ([(unicycle, v[::2].copy())] if v[1] == 0 else [])
        for tree, held in kinds:
            q = np.array(case["q"])[:, None]
            tree.flow(q, held, case["dt"])
            close(q[:, 0], case["q_next"], 2e-15 + 1e-16 * abs(case["q_next"][2]))


@pytest.mark.parametrize("spec", stored("opencv_project.json")["cameras"], ids=lambda c: c["name"])
def test_projection_and_its_inverse_agree_with_opencv(spec):
    eye = rs.Camera(spec["K"], distortion=spec["distortion"])
    for view in spec["views"]:
        T_w_c, points = np.array(view["T_w_c"]), np.array(view["points"])
        X = (points - T_w_c[:3, 3]) @ T_w_c[:3, :3]
        pixels = eye.project(points, rs.Pose(T_w_c))
        close(pixels, view["pixels"], 1e-9)
        close(eye.normalise(pixels), X[:, :2] / X[:, 2:], 1e-13)


@pytest.mark.parametrize("target", ["triangle", "square", "roof", "cloud"])
def test_the_pose_of_a_target_agrees_with_opencv_without_and_with_noise(target):
    """OpenCV's own last digits are 3e-11 m or rad, because it minimises a sum of noise."""
    data = stored("pnp_opencv.json")
    marks = np.array(data["targets"][target])
    for case in data["cases"]:
        if case["target"] == target:
            x, guess = np.array(case["points"])[..., None], np.array(case["T_c_o"])[..., None]
            T, fitted = np.empty((3, 4, 1)), np.array(case["fitted"])
            pose_fit.fit_pose(marks[..., None].copy(), x, guess, T)
            close(T[..., 0], fitted, 1e-10 if case["noise"] else 1e-12)
            pose_fit.fit_pose(marks[..., None].copy(), x, guess + [[[0]] * 3 + [[0.01]]] * 3, T)
            close(T[..., 0], fitted, 1e-10 if case["noise"] else 1e-12)


def test_philox_gives_the_published_words():
    data = stored("philox.json")
    for case in data["published"] + data["further"]:
        words = [np.uint64(int(w, 16)) for w in case["counter"] + case["key"]]
        assert [f"{int(w):08x}" for w in random.philox(*words)] == case["output"]


@pytest.mark.parametrize("shape", [(8, 6), (6, 6), (6, 5), (2, 6), (6, 7), (1, 1)])
def test_least_squares_is_the_pseudo_inverse_of_lapack(shape):
    rng = np.random.default_rng(7)
    A, y = rng.normal(size=(*shape, 40)), rng.normal(size=(shape[0], 40))
    A[:, -1, 20:] = A[:, 0, 20:] * (shape[1] > 1)  # half of them without full column rank
    x, rank = np.empty((shape[1], 40)), np.empty(40, dtype=np.int64)
    pseudoinverse.least_squares(A, y, 0.0, 1e-8, x, rank)
    for b in range(40):
        close(x[:, b], np.linalg.pinv(A[:, :, b], rcond=1e-8) @ y[:, b], 1e-10)
        assert rank[b] == np.linalg.matrix_rank(A[:, :, b], tol=1e-8)


@pytest.mark.parametrize("shape", [(8, 6), (6, 6), (2, 6)])
def test_damped_least_squares_solves_the_regularised_normal_equations(shape):
    rng = np.random.default_rng(8)
    A, y = rng.normal(size=(*shape, 9)), rng.normal(size=(shape[0], 9))
    A[:, -1] = A[:, 0]
    x, rank = np.empty((shape[1], 9)), np.empty(9, dtype=np.int64)
    pseudoinverse.least_squares(A, y, 0.1, 1e-8, x, rank)
    for b in range(9):
        M = A[:, :, b].T @ A[:, :, b] + 0.01 * np.eye(shape[1])
        close(x[:, b], np.linalg.solve(M, A[:, :, b].T @ y[:, b]), 1e-12)
