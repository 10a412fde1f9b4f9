"""Whole schemes against loops in plain NumPy, and against closed forms.

The loops of NumPy have the true pose of the camera and compute features, L and the exponential of a
held twist on their own; RobSim measures pixels and estimates the pose from them.
"""

import numpy as np
import pytest

import robsim as rs

MARKS = np.array([[-0.1, -0.12, 0.0], [0.13, -0.1, 0.1], [0.1, 0.12, -0.1], [-0.11, 0.09, 0.05]])
FOCAL, GAIN = 500.0, 0.9


def close(a, b, tolerance):
    np.testing.assert_allclose(a, b, rtol=0, atol=tolerance)


def hat(w):
    return np.array([[0, -w[2], w[1]], [w[2], 0, -w[0]], [-w[1], w[0], 0]])


def exponential(A):
    """Of a small matrix: its series after halving, squared as often."""
    total, term, B = np.eye(len(A)), np.eye(len(A)), A / 16
    for i in range(1, 20):
        term = term @ B / i
        total = total + term
    return np.linalg.matrix_power(total, 16)


def pose(p, w):
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = exponential(hat(w)), p
    return T


def rotation_vector(R):
    """By the axis of R - R' and the angle of both its sine and its cosine."""
    s = 0.5 * np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]])
    sine = np.linalg.norm(s)
    return s * (np.arctan2(sine, (np.trace(R) - 1) / 2) / sine if sine > 0 else 1.0)


def rates_of_rotation_vector(w):
    """L (3, 3) of theta u for the turn of the camera: the right Jacobian of exp, inverted."""
    term, total = np.eye(3), np.zeros((3, 3))
    for i in range(1, 40):
        total, term = total + term, term @ -hat(w) / (i + 1)
    return np.linalg.inv(total)


GOAL = pose([0.05, -0.02, -0.9], [0.1, -0.05, 0.2])
START = pose([0.25, -0.2, -1.3], [-0.15, -0.2, -0.9])


def pbvs_goal(T, goal):
    """e and L of the form "goal": the camera in axes of the goal camera."""
    D = np.linalg.inv(goal) @ T
    w = rotation_vector(D[:3, :3])
    L = np.zeros((6, 6))
    L[:3, :3], L[3:, 3:] = D[:3, :3], rates_of_rotation_vector(w)
    return np.r_[D[:3, 3], w], L


def pbvs_camera(T, goal):
    """e and L of the form "camera": the target's origin in camera axes."""
    e, L = pbvs_goal(T, goal)
    t, t_goal = (np.linalg.inv(pose_)[:3, 3] for pose_ in (T, goal))
    e[:3], L[:3] = t - t_goal, np.hstack([-np.eye(3), hat(t)])
    return e, L


def hybrid(T, goal, mark=2):
    """e and L of (x, y, log Z/Z*, theta u), from Pdot = -v - omega x P."""
    e, L = pbvs_goal(T, goal)
    P, P_goal = (np.linalg.inv(pose_)[:3] @ [*MARKS[mark], 1.0] for pose_ in (T, goal))
    rates = np.hstack([-np.eye(3), hat(P)])
    e[:3] = *(P[:2] / P[2] - P_goal[:2] / P_goal[2]), np.log(P[2] / P_goal[2])
    L[:2] = (rates[:2] * P[2] - P[:2, None] * rates[2]) / P[2] ** 2
    L[2] = rates[2] / P[2]
    return e, L


SCHEMES = {
    "pbvs goal": (rs.PBVS, {}, pbvs_goal),
    "pbvs camera": (rs.PBVS, {"form": "camera"}, pbvs_camera),
    "hybrid": (rs.Hybrid, {"mark": 2}, hybrid),
}


def flying():
    """A free camera and the marks, which stand in the world."""
    eye = rs.MountedCamera("eye", rs.Camera(np.diag([FOCAL, FOCAL, 1.0])), on="free_camera.body")
    return rs.Scene([rs.robots.free_camera()], [rs.Object("dots", marks=MARKS)], [eye])


def simulated(name, dt, duration, **what):
    made, given, _ = SCHEMES[name]
    task = made(goal=rs.Pose(GOAL), gain=GAIN, **given, **what)
    return rs.simulate(flying(), task, rs.Pose(START), dt=dt, duration=duration, hold=True)


def loop(name, dt, steps):
    """Poses, errors and twists of the same in plain NumPy."""
    T, path, errors, twists = START, [], [], []
    for _ in range(steps):
        e, L = SCHEMES[name][2](T, GOAL)
        V = -GAIN * np.linalg.pinv(L) @ e
        path, errors, twists = [*path, T], [*errors, e], [*twists, V]
        generator = np.zeros((4, 4))
        generator[:3, :3], generator[:3, 3] = hat(V[3:]) * dt, V[:3] * dt
        T = T @ exponential(generator)
    return np.array(path), np.array(errors), np.array(twists)


@pytest.mark.parametrize("name", SCHEMES)
def test_the_whole_path_agrees_with_a_plain_loop(name):
    run = simulated(name, 0.04, 6.0)
    path, errors, twists = loop(name, 0.04, len(run.time))
    assert np.linalg.norm(errors[-1]) < 1e-2 * np.linalg.norm(errors[0])
    close(run.camera_pose, path, 1e-10)
    close(run.error, errors, 1e-10)
    close(run.qd, twists, 1e-10)


CONSTANT = np.random.default_rng(0).normal(size=(6, 6)) + 3 * np.eye(6)


@pytest.mark.parametrize("which", ["current", "desired", "mean", "constant"])
@pytest.mark.parametrize("name", SCHEMES)
def test_the_interaction_matrix_is_the_one_that_was_chosen(name, which):
    (e, L), (_, L_goal) = (SCHEMES[name][2](T, GOAL) for T in (START, GOAL))
    L = {"current": L, "desired": L_goal, "mean": (L + L_goal) / 2, "constant": CONSTANT}[which]
    chosen = CONSTANT if which == "constant" else which
    run = simulated(name, 0.04, 0.04, interaction=chosen)
    close(run.qd[0], -GAIN * np.linalg.solve(L, e), 1e-11)


def test_levels_are_served_in_nested_null_spaces():
    """V = V1 + N (A2 N)^+ (r2 - A2 V1), with N a basis of the motions that level 1 leaves free."""
    first, second = hybrid(START, GOAL, 1), pbvs_goal(START, GOAL)
    e1, A1, e2, A2 = first[0][:2], first[1][:2], *second
    goal = rs.Pose(GOAL)
    points = rs.IBVS(goal=goal, features=[rs.features.FeatureBlock("points", marks=(1,))], gain=2.0)
    task = rs.Priorities([points, rs.PBVS(goal=goal, gain=0.7)])
    run = rs.simulate(flying(), task, rs.Pose(START), duration=0.04, hold=True)
    V1, N = -2.0 * np.linalg.pinv(A1) @ e1, np.linalg.svd(A1)[2][2:].T
    V = V1 + N @ np.linalg.lstsq(A2 @ N, -0.7 * e2 - A2 @ V1, rcond=None)[0]
    close(run.qd[0], V, 1e-11)


def test_the_pace_of_the_transpose_is_the_gain_times_the_least_eigenvalue():
    """edot = -gain A A' e: the slowest part of e decays at gain times the least eigenvalue."""
    _, L = pbvs_camera(GOAL, GOAL)
    controller = rs.PBVS(goal=rs.Pose(GOAL), form="camera", gain=GAIN, inverse="transpose")
    pace = controller.bind(flying()).pace
    assert pace == pytest.approx(GAIN * np.linalg.eigvalsh(L @ L.T)[0], rel=1e-9)


# closed form, in the limit of small periods

PERIODS = (0.02, 0.01, 0.005)


def halves(misses):
    """Half the period, half the miss: a method of first order."""
    ratios = np.array(misses[:-1]) / misses[1:]
    assert (np.abs(ratios - 2.0) < 0.1).all(), misses


def off_the_chord(points):
    """The farthest from the line between the ends, relative to its length."""
    along = points[-1] - points[0]
    length = np.linalg.norm(along)
    away = points - points[0]
    across = away - np.outer(away @ along, along) / length**2
    return np.linalg.norm(across, axis=1).max() / length


def marks_in_camera(run, mark):
    T = np.linalg.inv(run.camera_pose.values)
    return T[:, :3, :3] @ mark + T[:, :3, 3]


def decays(run, values):
    """values(t) against exp(-gain t) values(0), relative."""
    expected = np.exp(-GAIN * run.time.values)[:, None] * values[0]
    return np.abs(values - expected).max() / np.linalg.norm(values[0])


def test_the_camera_goes_straight_in_axes_of_the_goal():
    """Form "goal": its centre stays on the chord, and e decays exponentially, as dt goes to 0."""
    off, slow = [], []
    for dt in PERIODS:
        run = simulated("pbvs goal", dt, 5.0)
        centres = (np.linalg.inv(GOAL) @ run.camera_pose.values)[:, :3, 3]
        off.append(off_the_chord(np.vstack([centres, np.zeros(3)])))
        slow.append(decays(run, run.error.values))
    assert off[-1] < 3e-3 and slow[-1] < 2e-3
    halves(off)
    halves(slow)


def test_a_pure_translation_stays_on_the_chord_whatever_the_period():
    """Nothing turns, so a held velocity is straight as well."""
    start = GOAL @ pose([0.3, -0.2, -0.4], [0.0, 0.0, 0.0])
    task = rs.PBVS(goal=rs.Pose(GOAL), gain=GAIN)
    run = rs.simulate(flying(), task, rs.Pose(start), dt=0.1, duration=10.0, hold=True)
    assert off_the_chord(np.vstack([run.camera_pose.values[:, :3, 3], GOAL[:3, 3]])) < 1e-9
    e = run.error.values
    close(e, np.outer((1 - GAIN * 0.1) ** np.arange(len(e)), e[0]), 1e-12)


def test_the_angle_is_multiplied_by_one_minus_gain_dt_in_every_period():
    """omega = -gain theta u keeps the axis u, so that theta decays so for any period."""
    for dt in (0.1, 0.02):
        w = simulated("pbvs goal", dt, 6.0).error.values[:, 3:]
        close(w, np.outer((1 - GAIN * dt) ** np.arange(len(w)), w[0]), 1e-11)


def test_the_target_goes_straight_in_the_camera_and_in_the_image():
    """Form "camera": the origin of the target, in space and in its projection."""
    off, flat, slow = [], [], []
    for dt in PERIODS:
        run = simulated("pbvs camera", dt, 5.0)
        t = np.vstack([marks_in_camera(run, np.zeros(3)), np.linalg.inv(GOAL)[:3, 3]])
        off.append(off_the_chord(t))
        flat.append(off_the_chord(t[:, :2] / t[:, 2:]))
        slow.append(decays(run, run.error.values))
    assert off[-1] < 3e-3 and flat[-1] < 3e-3 and slow[-1] < 2e-3
    halves(off)
    halves(flat)
    halves(slow)


def test_the_mark_of_the_hybrid_scheme_goes_straight_in_the_image():
    """And log Z/Z* decays exponentially, as theta u does."""
    off, depth, slow = [], [], []
    P_goal = np.linalg.inv(GOAL)[:3] @ [*MARKS[2], 1.0]
    for dt in PERIODS:
        run = simulated("hybrid", dt, 5.0)
        P = np.vstack([marks_in_camera(run, MARKS[2]), P_goal])
        off.append(off_the_chord(P[:, :2] / P[:, 2:]))
        depth.append(decays(run, np.log(P[:-1, 2:] / P_goal[2])))
        slow.append(decays(run, run.error.values))
    assert off[-1] < 5e-3 and depth[-1] < 5e-3 and slow[-1] < 5e-3
    halves(off)
    halves(depth)
    halves(slow)


def test_an_adaptive_gain_arrives_by_its_scalar_equation():
    """Without rotation, x' = (1 - gain(x) dt) x for x = ||e||, and it ends before gain(x0)."""
    start, dt = GOAL @ pose([0.3, -0.2, -0.4], [0.0, 0.0, 0.0]), 0.02
    adaptive, ends = rs.laws.AdaptiveGain(at_zero=4.0, at_infinity=0.5, slope=10.0), {}
    x = [np.linalg.norm([0.3, -0.2, -0.4])]
    slow = 3.5 * np.exp(-10.0 * x[0] / 3.5) + 0.5
    for gain in (adaptive, float(slow)):
        task = rs.PBVS(goal=rs.Pose(GOAL), gain=gain)
        ends[gain] = rs.simulate(flying(), task, rs.Pose(start), dt=dt, duration=60)
        assert rs.Outcome(int(ends[gain].outcome)) is rs.Outcome.CONVERGED
    run = ends[adaptive]
    for _ in range(len(run.time) - 1):
        x.append(x[-1] * (1 - dt * (3.5 * np.exp(-10.0 * x[-1] / 3.5) + 0.5)))
    close(run.error_norm.dropna("time"), x[: int(run.error_norm.notnull().sum())], 1e-11)
    close(run.qd[0], ends[float(slow)].qd[0], 1e-12)
    assert float(run.end_time) < 0.5 * float(ends[float(slow)].end_time)


# quantities that are learnt during the run


def image(T):
    """x (N, 2) and X (N, 3) of the marks."""
    X = (MARKS - T[:3, 3]) @ T[:3, :3]
    return X[:, :2] / X[:, 2:], X


def point_rows(x, Z):
    """L (2N, 6) of image points at depths Z."""
    rows = [
        [[-1 / z, 0, u / z, u * v, -1 - u * u, v], [0, -1 / z, v / z, 1 + v * v, -u * v, -u]]
        for (u, v), z in zip(x, Z, strict=True)
    ]
    return np.array(rows).reshape(-1, 6)


def exp_twist(V, dt):
    """exp([V] dt), 4x4."""
    generator = np.zeros((4, 4))
    generator[:3, :3], generator[:3, 3] = hat(V[3:]) * dt, V[:3] * dt
    return exponential(generator)


def moved_mark(state, T):
    X = T[:3, :3] @ np.array([state[0], state[1], 1.0]) / state[2] + T[:3, 3]
    return np.array([X[0] / X[2], X[1] / X[2], 1 / X[2]])


def filtered(state, P, x, V, dt, sigma):
    """One step of the textbook's extended Kalman filter of a mark (x, y, 1/Z)."""
    T = exp_twist(-V, dt)
    F = np.stack([moved_mark(state + h, T).imag / 1e-30 for h in 1e-30j * np.eye(3)], axis=1)
    state = moved_mark(state, T)
    P = F @ P @ F.T + dt * np.diag([1e-4, 1e-4, 1e-2 * state[2]]) ** 2
    gain = P[:, :2] @ np.linalg.inv(P[:2, :2] + sigma**2 * np.eye(2))
    return state + gain @ (x - state[:2]), P - gain @ P[:2]


def test_a_loop_with_filtered_depths_agrees_with_a_plain_loop():
    """The filter receives the commanded twist, and its depths go into L."""
    dt, steps, sigma = 0.04, 100, 2.0 / FOCAL
    task = rs.IBVS(goal=rs.Pose(GOAL), gain=GAIN, depth=rs.laws.DepthFilter(0.8, 0.6, noise=2.0))
    run = rs.simulate(flying(), task, rs.Pose(START), dt=dt, duration=dt * steps, hold=True)
    T, (x_goal, _), V, marks = START, image(GOAL), None, None
    for k in range(steps + 1):
        x, X = image(T)
        if marks is None:
            P = np.diag([sigma, sigma, 0.6 / 0.8]) ** 2
            marks = [(np.r_[each, 1 / 0.8], P) for each in x]
        else:
            marks = [filtered(*m, each, V, dt, sigma) for m, each in zip(marks, x, strict=True)]
        Z = np.array([1 / state[2] for state, _ in marks])
        V = -GAIN * np.linalg.pinv(point_rows(x, Z)) @ (x - x_goal).ravel()
        close(run.camera_pose[k], T, 1e-10)
        close(run.qd[k], V, 1e-10)
        T = T @ exp_twist(V, dt)
    close(Z, X[:, 2], 0.02)  # it has learnt them


def test_a_loop_with_a_learnt_jacobian_agrees_with_a_plain_loop():
    """Broyden's rule from a start that is wrong by a third, in the camera's own axes."""
    dt, steps, (x, X), (x_goal, _) = 0.04, 100, image(START), image(GOAL)
    A = point_rows(x, X[:, 2]) * np.random.default_rng(0).uniform(0.7, 1.3, (8, 6))
    task = rs.IBVS(goal=rs.Pose(GOAL), gain=GAIN, interaction=rs.laws.Broyden(A))
    run = rs.simulate(flying(), task, rs.Pose(START), dt=dt, duration=dt * steps, hold=True)
    T, before, V = START, None, np.zeros(6)
    for k in range(steps + 1):
        x, _ = image(T)
        if before is not None:
            dq, ds = V * dt, (x - before).ravel()
            A = A + np.outer(ds - A @ dq, dq) / (dq @ dq)
        V = -GAIN * np.linalg.pinv(A) @ (x - x_goal).ravel()
        close(run.camera_pose[k], T, 1e-11)
        T, before = T @ exp_twist(V, dt), x


def test_a_loop_with_estimated_motion_agrees_with_a_plain_loop():
    """The marks are carried at a constant rate; e + d/gain in place of e."""
    dt, lag, rates = 0.04, 0.1, np.array([0.05, -0.02, 0.03, 0.1, -0.05, 0.2])
    home = rs.robots.free_camera().home
    target = rs.robots.free_camera().named("target")
    dots = rs.Object("dots", marks=MARKS, on="target.body")
    eye = rs.MountedCamera("eye", rs.Camera(np.diag([FOCAL, FOCAL, 1.0])), on="free_camera.body")
    motions = [rs.Motion("target", rates)]
    scene = rs.Scene([rs.robots.free_camera(), target], [dots], [eye], motions)
    goal, q0 = (np.r_[q_of(T), home] for T in (GOAL, START))
    task = rs.IBVS(goal=goal, gain=GAIN, feed_forward=rs.laws.EstimatedMotion(lag))
    run = rs.simulate(scene, task, q0, dt=dt, duration=4.0, hold=True)
    T, O, (x_goal, _), e, d, explained = START, np.eye(4), image(GOAL), None, np.zeros(8), 0.0
    for k in range(len(run.time)):
        x, X = image(np.linalg.inv(O) @ T)
        L, before, e = point_rows(x, X[:, 2]), e, (x - x_goal).ravel()
        if before is not None:
            d = d + dt / (lag + dt) * ((e - before) / dt - explained - d)
        V = -GAIN * np.linalg.pinv(L) @ (e + d / GAIN)
        explained = L @ V
        close(run.error[k], e, 1e-10)
        close(run.qd[k, :6], V, 1e-10)
        T, O = T @ exp_twist(V, dt), O @ exp_twist(rates, dt)
    assert np.abs(d).max() > 0.01


def q_of(T):
    """Coordinates of a free camera: position and quaternion (x, y, z, w) by half the angle."""
    w = rotation_vector(T[:3, :3])
    half = np.linalg.norm(w) / 2
    return np.r_[T[:3, 3], 0.5 * w * np.sinc(half / np.pi), np.cos(half)]


def test_a_computed_goal_is_the_expected_view_of_each_camera_on_the_hand():
    """T_right_o = T_right_left T_left_o: the second camera's view follows from the first's."""
    hand = {"left": pose([-0.06, 0, 0.02], [0, 0.1, 0.3]), "right": pose([0.07, 0, 0], [0.1, 0, 0])}
    lens = rs.Camera(np.diag([FOCAL, FOCAL, 1.0]))
    eyes = [
        rs.MountedCamera(n, lens, on="free_camera.body", pose=rs.Pose(T)) for n, T in hand.items()
    ]
    scene = rs.Scene([rs.robots.free_camera()], [rs.Object("dots", marks=MARKS)], eyes)
    T_left_o = pose([0.05, -0.03, 1.2], [0.2, -0.1, 0.4])
    parts = [rs.features.FeatureBlock("points", camera=n) for n in hand]
    servo = rs.IBVS(goal=rs.GoalPose(rs.Pose(T_left_o)), features=parts).bind(scene)
    T_right_o = np.linalg.inv(hand["right"]) @ hand["left"] @ T_left_o
    expected = [image(np.linalg.inv(T))[0].ravel() for T in (T_left_o, T_right_o)]
    close(servo.s_goal[:, 0], np.concatenate(expected), 1e-13)


# the placing law of section 6.2


def watched(marks):
    """A body that flies with three marks, and two cameras that stand."""
    eyes = [
        rs.MountedCamera(name, rs.Camera(np.diag([FOCAL, FOCAL, 1.0])), pose=rs.Pose.at(x, 0, -1))
        for name, x in (("left", -0.2), ("right", 0.2))
    ]
    body = rs.Object("part", marks=marks, on="free_camera.body")
    return rs.Scene([rs.robots.free_camera()], [body], eyes)


def placed(T, goal, marks, k1, k2, variant, dt, steps):
    """Section 6.2 in plain NumPy; the twist of the body is held in its own axes."""
    path, twists = [], []
    b = goal[:3, :3] @ marks.T + goal[:3, 3:]
    for _ in range(steps):
        a = T[:3, :3] @ marks.T + T[:3, 3:]
        if variant == "completed":
            R = goal[:3, :3] @ T[:3, :3].T
            omega = 0.5 * k1 * np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]])
        else:
            unit = [(p[:, [1, 2]] - p[:, :1]).T for p in (a, b)]
            unit = [[v / np.linalg.norm(v) for v in pair] for pair in unit]
            omega = k1 * np.cross(np.cross(*unit[0]), np.cross(*unit[1]))
        lever = np.cross(omega, a[:, 0])
        velocity = k2 * (b - a)[:, 0] + (lever if variant == "printed" else -lever)
        v = velocity + np.cross(omega, T[:3, 3])
        V = np.r_[T[:3, :3].T @ v, T[:3, :3].T @ omega]
        path, twists = [*path, T], [*twists, V]
        generator = np.zeros((4, 4))
        generator[:3, :3], generator[:3, 3] = hat(V[3:]) * dt, V[:3] * dt
        T = T @ exponential(generator)
    return np.array(path), np.array(twists)


@pytest.mark.parametrize("variant", ["corrected", "printed", "completed"])
def test_the_whole_path_of_a_placed_body_agrees_with_a_plain_loop(variant):
    """With an angle of 53 degrees at mark a."""
    marks = np.array([[0, 0, 0], [0.1, 0, 0], [0.06, 0.08, 0.0]])
    start, goal = pose([0.1, -0.1, 0.2], [0.3, -0.4, 0.5]), pose([-0.05, 0.05, 0.0], [0, 0.1, 0])
    task = rs.Placing(
        goal=rs.Pose(goal), camera=("left", "right"), variant=variant, rotation=1.5, translation=0.8
    )
    run = rs.simulate(watched(marks), task, rs.Pose(start), duration=4.0, hold=True)
    path, twists = placed(start, goal, marks, 1.5, 0.8, variant, 0.04, len(run.time))
    close(run.qd, twists, 1e-11)
    close(watched(marks).pose("part", run.q.values).matrix, path, 1e-11)
