"""Rows of constraints in the image, against differences of the projected marks."""

import numpy as np
import pytest

import robsim as rs
from robsim.kernels.machine.program import Blocks, Program
from robsim.servo.constraints.constraint import ConstraintInputs
from robsim.servo.controller_rows import allocate_inputs
from robsim.servo.feature_stages import BoundFeatureRows

SQUARE = 0.1 * np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0.2]])
LENSES = {
    "pinhole": rs.Camera([[600, 3, 330], [0, 590, 250], [0, 0, 1]], size=(640, 480)),
    "brown": rs.Camera(
        [[600, 0, 330], [0, 590, 250], [0, 0, 1]],
        size=(640, 480),
        distortion=[-0.2, 0.05, 1e-3, -2e-3],
    ),
    "fisheye": rs.Camera(
        [[300, 0, 330], [0, 300, 250], [0, 0, 1]],
        size=(640, 480),
        distortion=[0.05, -0.01, 0.002, 0.0],
        lens="fisheye",
    ),
}


def hand_scene(camera):
    """An arm with a camera, and a target that another joint carries."""
    arm = rs.robots.panda()
    eye = rs.MountedCamera("eye", camera, on="panda." + arm.links[-1].name)
    T = rs.Scene([arm], [], [eye]).pose("eye", arm.home) @ rs.Pose.at(0.02, -0.03, 0.5)
    return rs.Scene([arm], [rs.Object("plate", marks=SQUARE, pose=T)], [eye])


def rows_at(scene, one, q, wish=None):
    """Return C (m, n) and bound (m,) of a constraint at coordinates q, with exact images."""
    task = rs.IBVS(goal=scene.home)
    controller = task.bind(scene)
    program = Program()
    inputs = allocate_inputs(program, controller.sights, scene.nq, 0.02)
    features = BoundFeatureRows(controller.bound_features, inputs)
    n = controller.columns.size
    more = features.placed, features.views(), program.rows(n), program.rows(1, n)
    rows = one.stages(ConstraintInputs(inputs, scene, controller.columns, *more))
    assert rows.bound.size == len(one.label(controller.constraint_place))
    blocks = Blocks(program, np.zeros(1, dtype=np.int64))
    blocks.put(inputs.q, q[:, None])
    for sight in controller.sights:
        seen = sight.project(q[:, None])
        blocks.put(inputs.views[sight.key].pixels, seen.pixels)
        blocks.put(inputs.views[sight.key].depth, seen.depth)
    for part in program.segments():
        part(blocks, 0)
    return blocks.get(rows.C)[..., 0], blocks.get(rows.bound)[..., 0]


def image_at(scene, q):
    """Return pixels (N, 2) and depths (N,) of the marks, by the scene alone."""
    T = scene.pose("eye", q).matrix
    marks = scene.pose("plate", q).matrix
    X = SQUARE @ marks[:3, :3].T + marks[:3, 3]
    P = (X - T[:3, 3]) @ T[:3, :3]
    return scene.camera("eye").camera.project(P, np.eye(4)), P[:, 2]


def distances(scene, q):
    """Return the distances (N, 4) of the marks from left, right, top and bottom."""
    pixels, _ = image_at(scene, q)
    (left, right), (top, bottom) = scene.camera("eye").camera.border
    u, v = pixels.T
    return np.stack([u - left, right - u, v - top, bottom - v], axis=1)


def camera_jacobian(scene, q, h=1e-6):
    """Return the Jacobian (6, n) of the camera in its axes, by differences of its pose."""
    inverse, columns = np.linalg.inv(scene.pose("eye", q).matrix), []
    for d in h * np.eye(7):
        change = scene.pose("eye", q + d).matrix - scene.pose("eye", q - d).matrix
        V = inverse @ change / (2 * h)
        columns.append([*V[:3, 3], V[2, 1], V[0, 2], V[1, 0]])
    return np.transpose(columns)


@pytest.mark.parametrize("lens", LENSES)
def test_rows_of_the_border_are_the_derivative_of_the_distances(lens):
    scene = hand_scene(LENSES[lens])
    q = scene.home + 0.03 * np.arange(7) - 0.1
    C, bound = rows_at(scene, rs.constraints.FieldOfView(margin=5, rate=3), q)
    np.testing.assert_allclose(bound, -3 * (distances(scene, q).ravel() - 5), rtol=1e-12)
    errors = []
    for h in 1e-3, 5e-4:
        steps = h * np.eye(7)
        slopes = [
            (distances(scene, q + d) - distances(scene, q - d)).ravel() / (2 * h) for d in steps
        ]
        errors.append(np.abs(np.transpose(slopes) - C).max())
    assert errors[0] < 2e-2
    assert 3.9 < errors[0] / errors[1] < 4.1  # second order


def test_rows_of_the_depth_are_its_derivative():
    scene = hand_scene(LENSES["pinhole"])
    q = scene.home + 0.03 * np.arange(7) - 0.1
    C, bound = rows_at(scene, rs.constraints.MarkDepth(0.2, rate=2), q)
    np.testing.assert_allclose(bound, -2 * (image_at(scene, q)[1] - 0.2), rtol=1e-12)
    h = 1e-5
    slopes = [
        (image_at(scene, q + d)[1] - image_at(scene, q - d)[1]) / (2 * h) for d in h * np.eye(7)
    ]
    np.testing.assert_allclose(C, np.transpose(slopes), atol=1e-9)


def test_rows_hold_for_every_depth_and_focal_length_within_the_declared_errors():
    """The true rate of a distance is at least the least of the four rows of its side."""
    scene = hand_scene(LENSES["pinhole"])
    q, rng = scene.home + 0.03 * np.arange(7) - 0.1, np.random.default_rng(1)
    robust = rs.constraints.FieldOfView(margin=5, rate=3, depth_error=0.2, focal_error=0.05)
    C, _ = rows_at(scene, robust, q)
    ends = C.reshape(4, 4, 4, 7)  # mark, side, end, joint
    image, Z = image_at(scene, q)
    K = np.array(scene.camera("eye").camera.K)
    jacobian = camera_jacobian(scene, q)
    for _ in range(200):
        scale, longer = 1 + rng.uniform(-0.2, 0.2, 4), 1 + rng.uniform(-0.05, 0.05)
        other = K.copy()
        other[:2, :2] *= longer
        x = np.linalg.solve(other, np.c_[image, np.ones(4)].T)[:2].T
        true = []
        for (a, b), i in zip(x, scale / Z, strict=True):
            L = np.array(
                [[-i, 0, a * i, a * b, -(1 + a * a), b], [0, -i, b * i, 1 + b * b, -a * b, -a]]
            )
            pixel = other[:2, :2] @ L
            true.append([pixel[0], -pixel[0], pixel[1], -pixel[1]])
        rates = np.array(true) @ jacobian
        qd = rng.normal(size=7)
        assert (rates @ qd >= (ends @ qd).min(axis=2) - 1e-9).all()


def test_rows_of_the_depth_hold_for_every_depth_within_the_declared_error():
    """The excess of a row over its bound is affine in Z; a true depth lies between both ends."""
    scene, rng = hand_scene(LENSES["pinhole"]), np.random.default_rng(4)
    q = scene.home + 0.03 * np.arange(7) - 0.1
    C, bound = rows_at(scene, rs.constraints.MarkDepth(0.2, rate=1.0, depth_error=0.2), q)
    ends, limits = C.reshape(4, 2, 7), bound.reshape(4, 2)
    image, Z = image_at(scene, q)
    K = np.array(scene.camera("eye").camera.K)
    x = np.linalg.solve(K, np.c_[image, np.ones(4)].T)[:2].T
    jacobian = camera_jacobian(scene, q)
    for _ in range(100):
        true, qd = Z / (1 + rng.uniform(-0.2, 0.2, 4)), 3.0 * rng.normal(size=7)
        v, w = jacobian[:3] @ qd, jacobian[3:] @ qd
        rate = -v[2] + true * (x[:, 0] * w[1] - x[:, 1] * w[0])
        assert (rate + (true - 0.2) >= (ends @ qd - limits).min(axis=1) - 1e-6).all()
