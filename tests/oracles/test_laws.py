"""Control laws against plain evaluations of their equations by NumPy, one run at a time.

The references contain nothing of RobSim, except the poses of its robots in two tests.
"""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import robsim as rs
from robsim.base.arrays import move_runs_last
from robsim.kernels.control.control_law import estimate_drift
from robsim.kernels.machine.program import Blocks, Program
from robsim.servo.camera_target import adjoint, compute_relative_pose
from robsim.servo.controller_rows import allocate_inputs
from robsim.servo.laws.control_state import ControlState
from robsim.servo.laws.inverse import (
    DampedInverse,
    JacobianTranspose,
    PseudoInverse,
    multiply_batches,
)
from robsim.servo.laws.law import CameraLaw, JointLaw
from robsim.servo.laws.partitioned_law import PartitionedLaw
from robsim.servo.tasks.docking_task import DockingLaw
from robsim.servo.tasks.placing_task import Placing, PlacingLaw

steady = settings(derandomize=True, max_examples=25, deadline=None)
seeds = st.integers(0, 2**32)
RUNS = 6
SQUARE = np.array([[-0.1, -0.1, 0], [0.1, -0.1, 0], [0.1, 0.1, 0], [-0.1, 0.1, 0]])


def close(a, b, tolerance):
    np.testing.assert_allclose(a, b, rtol=0, atol=tolerance)


def hat(w):
    return np.cross(w, np.eye(3)).T  # columns w x e_i


def turn(w):
    """Rotation matrix of a rotation vector, by Rodrigues."""
    turns, K = np.linalg.norm(w) / np.pi, hat(w)
    return np.eye(3) + np.sinc(turns) * K + 0.5 * np.sinc(turns / 2) ** 2 * K @ K


def rigid(p, w):
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = turn(np.asarray(w)), p
    return T


def point_rows(X):
    """L (2N, 6) of image points X/Z: the quotient rule on Xdot = -v - omega x X."""
    rows = []
    for p in X:
        rate = np.hstack([-np.eye(3), hat(p)])
        rows += [(rate[i] * p[2] - p[i] * rate[2]) / p[2] ** 2 for i in range(2)]
    return np.array(rows)


# least squares in joints, and over a twist


def states(seed, inverse, k=8, n=6, gain=0.7):
    rng = np.random.default_rng(seed)
    e, L, J = (rng.normal(size=(*shape, RUNS)) for shape in [(k,), (k, 6), (6, n)])
    return ControlState(e, L, J, multiply_batches(L, J), gain, inverse)


def agree(a, b, tolerance):
    """The same to within a share of the largest number, and of its square in ill-posed runs."""
    close(a, b, tolerance * (1 + np.abs(b).max()) ** 2)


def inverted(A, inverse):
    """The matrix that stands for A^-1, by LAPACK."""
    match inverse:
        case PseudoInverse(rcond):
            return np.linalg.pinv(A, rcond=rcond)
        case DampedInverse(damping):
            below = np.vstack([A, damping * np.eye(A.shape[1])])
            return np.linalg.lstsq(below, np.eye(len(below)), rcond=None)[0][:, : len(A)]
    return A.T


INVERSES = [
    PseudoInverse(),
    PseudoInverse(0.3),
    DampedInverse(0.05),
    DampedInverse(1.0),
    JacobianTranspose(),
]


@pytest.mark.parametrize("inverse", INVERSES, ids=repr)
@pytest.mark.parametrize(("k", "n"), [(8, 6), (8, 5), (6, 6), (2, 6), (6, 7)])
def test_the_joint_law_is_minus_gain_times_the_inverse_times_the_error(inverse, k, n):
    state = states(1, inverse, k, n)
    for b, qd in enumerate(JointLaw().command(state)):
        A = state.interaction[b] @ state.jacobian[b]
        agree(qd, -0.7 * inverted(A, inverse) @ state.error[b], 1e-12)


@pytest.mark.parametrize("inverse", INVERSES, ids=repr)
@pytest.mark.parametrize(("k", "n"), [(8, 6), (8, 5), (6, 6), (2, 6), (6, 7)])
@pytest.mark.parametrize("length", [1.0, 0.01, 3.0])
def test_the_camera_law_takes_both_inverses_in_its_unit_of_length(inverse, k, n, length):
    """In units of `length`: L_u = L U, V_u = U^-1 V, J_u = U^-1 J with U = diag(length, 1)."""
    state = states(2, inverse, k, n)
    U = np.diag([length] * 3 + [1.0] * 3)
    back = PseudoInverse() if isinstance(inverse, JacobianTranspose) else inverse
    for b, qd in enumerate(CameraLaw(length).command(state)):
        V = inverted(state.interaction[b] @ U, inverse) @ state.error[b]
        expected = -0.7 * inverted(np.linalg.inv(U) @ state.jacobian[b], back) @ V
        agree(qd, expected, 1e-12)


@steady
@given(seed=seeds, length=st.sampled_from([0.01, 1.0, 5.0]))
def test_the_twist_of_the_camera_law_is_the_least_by_its_own_measure(seed, length):
    """|v|^2/length^2 + |omega|^2, by Lagrange's multipliers for two features that are met."""
    state = states(seed, PseudoInverse(), 2, 6)
    W = np.diag([length**2] * 3 + [1.0] * 3)  # inverse of the weight
    for b, qd in enumerate(CameraLaw(length).command(state)):
        L = state.interaction[b]
        V = -0.7 * W @ L.T @ np.linalg.solve(L @ W @ L.T, state.error[b])
        close(state.jacobian[b] @ qd, V, 1e-9 * (1 + np.abs(V).max()))


def flying(marks, focal=500.0):
    """A free camera that starts at the origin of the world, and marks in axes of the world."""
    eye = rs.MountedCamera("eye", rs.Camera(np.diag([focal, focal, 1.0])), on="free_camera.body")
    return rs.Scene([rs.robots.free_camera()], [rs.Object("dots", marks=marks)], [eye])


def seen_from(T, marks):
    """Marks in axes of a camera at T."""
    return (marks - T[:3, 3]) @ T[:3, :3]


MARKS = np.array([[-0.1, -0.12, 1.0], [0.13, -0.1, 1.1], [0.1, 0.12, 0.9], [-0.11, 0.09, 1.05]])


def test_weights_are_on_the_rows_of_the_least_squares():
    """V = -gain (W L)^+ W e, W = 3 for the first two marks and 1/2 for the angle of the camera."""
    goal, start = rigid([0, 0, 0.1], [0.1, 0, 0]), rigid([0.1, 0.05, -0.1], [0.1, -0.1, 0.4])
    parts = [
        rs.features.FeatureBlock("points", marks=(0, 1), weight=3.0),
        rs.features.FeatureBlock("theta_u", components=(2,), weight=0.5),
        rs.features.FeatureBlock("points", marks=(2, 3)),
    ]
    task = rs.IBVS(goal=rs.Pose(goal), features=parts, gain=0.8)
    run = rs.simulate(flying(MARKS), task, rs.Pose(start), duration=0.04, hold=True)
    now, wanted = seen_from(start, MARKS), seen_from(goal, MARKS)
    e = (now[:, :2] / now[:, 2:] - wanted[:, :2] / wanted[:, 2:]).ravel()
    R = goal[:3, :3].T @ start[:3, :3]
    angle = np.arccos((np.trace(R) - 1) / 2)
    w = (
        angle
        / (2 * np.sin(angle))
        * np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]])
    )
    J = sum(  # right Jacobian of exp
        np.linalg.matrix_power(-hat(w), i) / np.prod(np.arange(1.0, i + 2)) for i in range(25)
    )
    L = point_rows(now)
    A = np.vstack([3 * L[:4], 0.5 * np.r_[np.zeros(3), np.linalg.inv(J)[2]][None], L[4:]])
    y = np.r_[3 * e[:4], 0.5 * w[2], e[4:]]
    close(run.qd[0], -0.8 * np.linalg.pinv(A) @ y, 1e-12)


# the partitioned scheme


def polygon_area(x):
    return 0.5 * abs(
        sum(a[0] * b[1] - a[1] * b[0] for a, b in zip(x, np.roll(x, -1, 0), strict=True))
    )


def corke_hutchinson(now, goal, gain, roll, advance):
    """The twist of Corke and Hutchinson 2001, from marks in camera axes now and at the goal."""
    x, wanted = (X[:, :2] / X[:, 2:] for X in (now, goal))
    angle, angle_goal = (np.arctan2(*(p[1] - p[0])[::-1]) for p in (x, wanted))
    difference = np.angle(np.exp(1j * (angle - angle_goal)))
    sigma, sigma_goal = (np.sqrt(polygon_area(p)) for p in (x, wanted))
    Vz = np.array([advance * np.log(sigma_goal / sigma), roll * difference])
    L = point_rows(now)
    Lz, Lxy = L[:, [2, 5]], L[:, [0, 1, 3, 4]]
    Vxy = np.linalg.lstsq(Lxy, -gain * (x - wanted).ravel() - Lz @ Vz, rcond=None)[0]
    return np.array([Vxy[0], Vxy[1], Vz[0], Vxy[2], Vxy[3], Vz[1]])


@settings(derandomize=True, max_examples=20, deadline=None)
@given(seed=seeds)
def test_the_partitioned_scheme_commands_the_law_of_corke_and_hutchinson(seed):
    rng = np.random.default_rng(seed)
    goal = rigid(rng.uniform(-0.1, 0.1, 3), rng.uniform(-0.1, 0.1, 3))
    starts = [
        rigid(rng.uniform(-0.2, 0.2, 3), [*rng.uniform(-0.2, 0.2, 2), rng.uniform(-3, 3)])
        for _ in range(RUNS)
    ]
    gain, roll, advance = rng.uniform(0.2, 2, 3)
    task = rs.Partitioned(goal=rs.Pose(goal), gain=gain, roll=roll, advance=advance)
    run = rs.simulate(flying(MARKS), task, rs.Pose(starts), duration=0.04, hold=True)
    for T, V in zip(starts, run.qd.values[:, 0], strict=True):
        now, wanted = seen_from(T, MARKS), seen_from(goal, MARKS)
        close(V, corke_hutchinson(now, wanted, gain, roll, advance), 1e-11)


@pytest.mark.parametrize("inverse", INVERSES, ids=repr)
def test_the_partitioned_law_gives_its_twist_to_five_joints_in_its_unit_of_length(inverse):
    rng = np.random.default_rng(3)
    state = states(3, inverse, 10, 5)
    area, wanted = rng.uniform(0.1, 0.2, (2, RUNS))
    error = np.vstack([state.error_last[:-1], area - wanted])
    state = replace(state, s_last=np.vstack([np.zeros((9, RUNS)), area]), error_last=error)
    back = PseudoInverse() if isinstance(inverse, JacobianTranspose) else inverse
    U = np.diag([0.1] * 3 + [1.0] * 3)
    for b, qd in enumerate(PartitionedLaw(2.0, 0.5, 0.1).command(state)):
        e, L, V = state.error[b], state.interaction[b, :-2], np.zeros(6)
        V[[2, 5]] = 0.25 * np.log(wanted[b] / area[b]), 2.0 * e[-2]
        rest = -0.7 * e[:-2] - L @ V
        V[[0, 1, 3, 4]] = inverted(L[:, [0, 1, 3, 4]], inverse) @ rest
        expected = inverted(np.linalg.inv(U) @ state.jacobian[b], back) @ np.linalg.inv(U) @ V
        agree(qd, expected, 1e-12)


def test_a_pure_roll_goes_by_pure_omega_z():
    """The angle is multiplied by 1 - roll dt in every period.

    Only for small angles: at larger ones the way of pure roll is unstable in the law itself, and
    rounding grows into a motion across until the angle is small again.
    """
    task = rs.Partitioned(goal=rs.Pose.at(0, 0, -1), roll=0.7, gain=1.3)
    start = rs.Pose.at(0, 0, -1, rotvec=(0, 0, 0.5))
    run = rs.simulate(flying(SQUARE), task, start, dt=0.02, duration=3, hold=True)
    close(run.qd[:, :5], 0, 1e-12)
    R = run.camera_pose.values
    angle = np.arctan2(R[:, 1, 0], R[:, 0, 0])
    close(angle, 0.5 * (1 - 0.7 * 0.02) ** np.arange(len(angle)), 1e-12)
    close(R[:, :3, 3], [[0, 0, -1]] * len(R), 1e-13)


def test_a_pure_scale_goes_by_pure_v_z():
    """Z' = Z - dt advance ln(Z/Z*), for a square that faces the camera."""
    task = rs.Partitioned(goal=rs.Pose.at(0, 0, -1), advance=0.6, gain=1.3)
    run = rs.simulate(flying(SQUARE), task, rs.Pose.at(0, 0, -1.8), dt=0.02, duration=6, hold=True)
    close(run.qd[:, [0, 1, 3, 4, 5]], 0, 1e-12)
    Z = [1.8]
    for _ in range(len(run.time) - 1):
        Z.append(Z[-1] - 0.02 * 0.6 * np.log(Z[-1]))
    close(-run.camera_pose[:, 2, 3], Z, 1e-12)


# the placing law


def triangle(rng):
    """a, b, c that are not on one line, of any size."""
    while True:
        points = rng.normal(size=(3, 3)) * rng.uniform(0.02, 0.5)
        b, c = points[1:] - points[0]
        if np.linalg.norm(np.cross(b, c)) > 0.2 * np.linalg.norm(b) * np.linalg.norm(c):
            return points


def chapter(now, goal, k1, k2, variant):
    """T and Omega of section 6.2: all four vectors are normalized, their products are not."""
    a1, a2 = now[0], goal[0]
    P = [
        (points[i] - points[0]) / np.linalg.norm(points[i] - points[0])
        for points in (now, goal)
        for i in (1, 2)
    ]
    omega = k1 * np.cross(np.cross(P[0], P[1]), np.cross(P[2], P[3]))
    lever = np.cross(omega, a1)
    return k2 * (a2 - a1) + (lever if variant == "printed" else -lever), omega


def placing(variant, **what):
    task = Placing(camera=("left", "right"), variant=variant, **what)
    return PlacingLaw(None, None, None, task)


@pytest.mark.parametrize("variant", ["corrected", "printed"])
@steady
@given(seed=seeds)
def test_the_placing_law_agrees_with_section_6_2_for_any_triangle(variant, seed):
    rng = np.random.default_rng(seed)
    now, goal = (np.stack([triangle(rng) for _ in range(RUNS)], axis=-1) for _ in range(2))
    k1, k2 = rng.uniform(0.2, 2, 2)
    T, omega = placing(variant, rotation=k1, translation=k2).twist(now, goal)
    for b in range(RUNS):
        expected = chapter(now[..., b], goal[..., b], k1, k2, variant)
        close(T[:, b], expected[0], 1e-13)
        close(omega[:, b], expected[1], 1e-14 * 4)


@steady
@given(seed=seeds)
def test_the_completed_law_turns_any_triangle_by_the_sine_about_the_axis(seed):
    """sin(theta) u is the skew part of the rotation that carries the marks to their goal."""
    rng = np.random.default_rng(seed)
    now, goal, R = [], [], []
    for _ in range(RUNS):
        now.append(triangle(rng))
        T = rigid(rng.normal(size=3), rng.normal(size=3))
        R.append(T[:3, :3])
        goal.append(now[-1] @ R[-1].T + T[:3, 3])
    now, goal = np.stack(now, axis=-1), np.stack(goal, axis=-1)
    T, omega = placing("completed", rotation=1.7, translation=0.6).twist(now, goal)
    for b in range(RUNS):
        S = (R[b] - R[b].T) / 2
        sine = np.array([S[2, 1], S[0, 2], S[1, 0]])
        close(omega[:, b], 1.7 * sine, 1e-13)
        a = now[0, :, b]
        close(T[:, b], 0.6 * (goal[0, :, b] - a) - np.cross(1.7 * sine, a), 1e-12)


# docking


@steady
@given(seed=seeds)
def test_a_docking_unicycle_localises_itself_with_its_camera_anywhere(seed):
    """T_goal_c = T_b_c^-1 (x, y, heading) T_b_c, and its rotation vector is heading R_b_c' z."""
    rng = np.random.default_rng(seed)
    T_b_c = rigid(rng.uniform(-1, 1, 3), rng.normal(size=3))
    place = rng.uniform([-2, -2, -3.1], [2, 2, 3.1], (RUNS, 3))
    error = np.empty((6, RUNS))
    for b, (x, y, heading) in enumerate(place):
        T = np.linalg.inv(T_b_c) @ rigid([x, y, 0], [0, 0, heading]) @ T_b_c
        error[:, b] = *T[:3, 3], *(heading * T_b_c[2, :3])
    found = DockingLaw(rs.Pose(T_b_c), 3.0, 2.0).planar(error)
    close(np.array(found).T, place, 3e-14)


# frames


def random_poses(seed, runs=RUNS):
    rng = np.random.default_rng(seed)
    return np.stack([rigid(rng.normal(size=3), rng.normal(size=3)) for _ in range(runs)])


@steady
@given(seed=seeds)
def test_the_adjoint_writes_a_twist_in_other_axes(seed):
    """T exp(V) T^-1 = exp(A V) for twists of any size, and so for their 4x4 matrices."""
    (T,), V = random_poses(seed, 1), np.random.default_rng(seed + 1).normal(size=6)
    A = adjoint(T[:3, :, None])[..., 0]
    close((T @ rs.Pose.exp(V).matrix) @ np.linalg.inv(T), rs.Pose.exp(A @ V).matrix, 1e-13 * 5)
    matrix = np.vstack([np.hstack([hat(V[3:]), V[:3, None]]), np.zeros(4)])
    moved = T @ matrix @ np.linalg.inv(T)
    close(A @ V, [*moved[:3, 3], moved[2, 1], moved[0, 2], moved[1, 0]], 1e-13)


@steady
@given(seed=seeds)
def test_the_relative_pose_is_the_inverse_of_one_times_the_other(seed):
    A, B = random_poses(seed), random_poses(seed + 1)
    found = np.moveaxis(
        compute_relative_pose(move_runs_last(A[:, :3], 2), move_runs_last(B[:, :3], 2)), -1, 0
    )
    close(found, (np.linalg.inv(A) @ B)[:, :3], 1e-13)


# depth and motion that are estimated, step by step


def after(state, T):
    """(x, y, 1/Z) of a mark after its axes moved by T: also for complex numbers."""
    x, y, chi = state
    X = T[:3, :3] @ np.array([x, y, 1.0]) / chi + T[:3, 3]
    return np.array([X[0] / X[2], X[1] / X[2], 1 / X[2]])


def extended_kalman(first, chi, images, twists, dt, sigma, start_sigma):
    """The textbook's filter with both coordinates at once, and Jacobians by a complex step."""
    state, P = np.r_[first, chi], np.diag([sigma, sigma, start_sigma * chi]) ** 2
    R, H, path = np.eye(2) * sigma**2, np.eye(3)[:2], []
    for x, V in zip(images, twists, strict=True):
        T = rigid_exponential(-V * dt)
        steps = np.eye(3) * 1e-30j
        F = np.stack([after(state + h, T).imag / 1e-30 for h in steps], axis=1)
        state = after(state, T)
        P = F @ P @ F.T + dt * np.diag([1e-4, 1e-4, 1e-2 * state[2]]) ** 2
        gain = P @ H.T @ np.linalg.inv(H @ P @ H.T + R)
        state = state + gain @ (x - H @ state)
        P = (np.eye(3) - gain @ H) @ P
        path.append((state, P))
    return path


def rigid_exponential(V):
    """exp of a twist (v, omega) by its series in 4x4 matrices."""
    matrix = np.vstack([np.hstack([hat(V[3:]), V[:3, None]]), np.zeros(4)])
    total, term = np.eye(4), np.eye(4)
    for i in range(1, 25):
        term = term @ matrix / i
        total = total + term
    return total


def test_the_depth_filter_is_the_extended_kalman_filter_of_the_textbook():
    """Fifty steps with a pixel of noise and twists that change; state and covariance."""
    rng = np.random.default_rng(4)
    depth, K, dt = rs.laws.DepthFilter(0.7, 0.4, 1.5), np.diag([500.0, 500.0, 1.0]), 0.04
    for _ in range(RUNS):
        X, images, V = rng.uniform([-0.2, -0.2, 0.9], [0.2, 0.2, 1.4]), [], []
        for k in range(51):
            images.append(X[:2] / X[2] + rng.normal(scale=1.5 / 500, size=2))
            V.append(0.2 * np.sin(0.3 * k + np.arange(6)))
            X = (rigid_exponential(-V[-1] * dt) @ [*X, 1.0])[:3]
        expected = extended_kalman(images[0], 1 / 0.7, images[1:], V[:-1], dt, 1.5 / 500, 0.4)
        program = Program()
        points, twists = program.rows(1, 2), program.rows(6)
        given = allocate_inputs(program, [], 0, dt)
        found = depth.stages(given, points, twists, K)
        (p,), (act,) = (call[1] for call in program.calls), program.segments()
        blocks = Blocks(program, np.zeros(1, dtype=np.int64))
        for k, x in enumerate(images):
            blocks.put(points, x[:, None])
            blocks.put(twists, V[max(k - 1, 0)][:, None])
            act(blocks, k)
            if k > 0:
                s, C = expected[k - 1]
                close(blocks.get(p[5], 3)[:, 0], s, 1e-12)
                close(blocks.get(p[6], 3, 3)[..., 0], C, 1e-13)
        assert abs(blocks.get(found, 1).item() - 0.7) > 0.02  # it has learnt something


def test_estimated_motion_is_a_filter_of_the_residual_of_the_command():
    """d <- d + dt/(lag + dt) ((e - e_before)/dt - A qd - d), from zero."""
    rng, dt = np.random.default_rng(5), 0.05
    program = Program()
    error, last, by_command, drift = (program.rows(4) for _ in range(4))
    rows = {"errors": error, "last_errors": last, "predicted_change": by_command, "drifts": drift}
    program.add(estimate_drift, **rows, lag=program.constant(0.3), dt=program.constant(dt))
    (act,), blocks = program.segments(), Blocks(program, np.zeros(RUNS, dtype=np.int64))
    d = before = moved = None
    for k in range(30):
        e, A, qd = (rng.normal(size=(*shape, RUNS)) for shape in [(4,), (4, 3), (3,)])
        blocks.put(error, e)
        act(blocks, k)
        d = np.zeros_like(e) if d is None else d + (dt / 0.35) * ((e - before) / dt - moved - d)
        close(blocks.get(drift, 4), d, 1e-13)
        before, moved = e, np.einsum("knb,nb->kb", A, qd)
        blocks.put(by_command, moved)


CARRIED = np.array([[-0.1, -0.12, 1.0], [0.13, -0.1, 1.1], [0.1, 0.12, 0.9]])


def carried(rates):
    """A free camera, and marks that a second free body carries at prescribed rates."""
    target = rs.robots.free_camera().named("target")
    eye = rs.MountedCamera("eye", rs.Camera(np.diag([500.0, 500.0, 1.0])), on="free_camera.body")
    dots = rs.Object("dots", marks=CARRIED, on="target.body")
    motions = [rs.Motion("target", rates)]
    return rs.Scene([rs.robots.free_camera(), target], [dots], [eye], motions)


@pytest.mark.parametrize(("law", "gain"), [("joint", 0.5), ("camera", 2.0)])
def test_known_motion_is_added_as_it_moves_the_image(law, gain):
    """V = -L^+ (gain e + de/dt), de/dt from Xdot = v + omega x X of the body that is carried."""
    rates = np.array([0.1, -0.05, 0.2, 0.3, -0.2, 0.4])
    start = np.r_[rs.robots.free_camera().home, rs.robots.free_camera().home]
    task = rs.IBVS(goal=start, feed_forward="known", law=law, gain=gain)
    T = rigid([0.05, -0.1, -0.15], [0.1, 0.2, -0.3])
    q0 = np.r_[rs.Pose(T).position, rs.Pose(T).quaternion, start[7:]]
    run = rs.simulate(carried(rates), task, q0, duration=0.04, hold=True)
    now = seen_from(T, CARRIED)
    e = (now[:, :2] / now[:, 2:] - CARRIED[:, :2] / CARRIED[:, 2:]).ravel()
    speed = (rates[:3] + np.cross(rates[3:], CARRIED)) @ T[:3, :3]  # in axes of the camera
    drift = (speed[:, :2] - now[:, :2] / now[:, 2:] * speed[:, 2:]) / now[:, 2:]
    V = -np.linalg.pinv(point_rows(now)) @ (gain * e + drift.ravel())
    close(run.qd[0, :6], V, 1e-11)
    close(run.qd[0, 6:], rates, 0)
