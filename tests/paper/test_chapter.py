"""The chapter's robot and its errata: the printed equations, the right ones, and the reasons.

Numbers come from "A Modeling and Simulation Platform for Robot Kinematics aiming Visual Servo
Control". Erratum 1 (eq. 10) is in test_classic.py and laws/test_camera.py, 5 and 6 belong to
section 6.2.
"""

import numpy as np
import pytest

import robsim as rs

SQUARE = 0.1 * np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])
GOAL = rs.Pose.at(0, 0, -0.6)
START = rs.Pose.at(0.1, -0.05, -0.8, rotvec=(0.1, -0.1, 0.3))


def close(a, b, tolerance):
    np.testing.assert_allclose(a, b, rtol=0, atol=tolerance)


def slopes(errors, steps):
    return np.diff(np.log(errors)) / np.diff(np.log(steps))


def outcome(run):
    return rs.Outcome(int(run.outcome))


def image(T_w_c, points):
    """Points in camera axes, and s = (x1, y1, x2, ...) at unit depth."""
    X = rs.Pose(T_w_c).inv() @ points
    return X, (X[:, :2] / X[:, 2:]).ravel()


def interaction(X):
    """Eq. (14) with f = 1 for points X (N, 3) in camera axes, stacked."""
    x, y, Z = X[:, 0] / X[:, 2], X[:, 1] / X[:, 2], X[:, 2]
    zero = 0 * x
    rows = [
        [-1 / Z, zero, x / Z, x * y, -(1 + x**2), y],
        [zero, -1 / Z, y / Z, 1 + y**2, -x * y, -x],
    ]
    return np.moveaxis(np.array(rows), 2, 0).reshape(-1, 6)


# section 4.2: the Rhino XR4

DH_CM_DEG = {  # Schilling, Fundamentals of Robotics: d, a in cm, alpha and home in degrees
    "shoulder": (26.04, 0, -90, 0),
    "upper_arm": (0, 22.86, 0, -90),
    "forearm": (0, 22.86, 0, 90),
    "wrist": (0, 0.95, -90, 0),
    "tool": (16.83, 0, 0, -90),
}


def dh(theta, d, a, alpha):
    """Eq. (3) of the chapter."""
    c, s, ca, sa = np.cos(theta), np.sin(theta), np.cos(alpha), np.sin(alpha)
    return np.array(
        [[c, -ca * s, sa * s, a * c], [s, ca * c, -sa * c, a * s], [0, sa, ca, d], [0, 0, 0, 1]]
    )


@pytest.fixture(scope="module")
def rhino():
    return rs.robots.rhino_xr4()


def test_the_rhino_s_tool_is_at_home_where_the_table_puts_it(rhino):
    T = rs.Pose(rhino.fk(rhino.home))
    close(T.position * 100, [22.86 + 0.95, 0, 26.04 + 22.86 - 16.83], 1e-13)
    close(T.position * 100, [23.81, 0, 32.07], 1e-13)
    close(T.rotation, [[0, 1, 0], [1, 0, 0], [0, 0, -1]], 1e-15)


@pytest.mark.parametrize("k", range(5))
def test_each_link_of_the_rhino_is_its_row_of_the_table(rhino, k):
    names = [link.name for link in rhino.links]
    assert names == ["base", *DH_CM_DEG]
    d, a, alpha, home = DH_CM_DEG[names[k + 1]]
    assert np.degrees(rhino.home[k]) == pytest.approx(home, abs=1e-13)
    for angle in (0.0, 0.7, -2.0):
        q = rhino.home.copy()
        q[k] = angle
        T = rhino.frames(q)
        link = rs.Pose(T[k]).inv() @ T[k + 1]
        close(link, dh(angle, d / 100, a / 100, np.radians(alpha)), 1e-15)


def test_the_rhino_s_travels_are_centred_on_home(rhino):
    """350, 150, 180, 250, 360 degrees in a user guide: approximate."""
    low, high = np.degrees(rhino.limits).T
    close(high - low, [350, 150, 180, 250, 360], 1e-12)
    close((high + low) / 2, np.degrees(rhino.home), 1e-12)
    assert (rhino.nq, rhino.nv, rhino.coordinate_units) == (5, 5, ("rad",) * 5)


def test_the_rhino_is_made_of_blocks_with_three_for_the_gripper(rhino):
    assert all(isinstance(shape, rs.Block) for link in rhino.links for shape in link.shapes)
    assert all(link.shapes for link in rhino.links)
    assert len(rhino.links[-1].shapes) == 3


# eqs. 11 to 14


def test_erratum_3_the_rate_of_an_image_point_needs_the_focal_length():
    """Eq. (11) is xdot = (f Xdot - x Zdot) / Z; the printed one lost f, and is right for f = 1."""
    P, rate, steps = np.array([0.3, -0.2, 1.7]), np.array([0.5, 0.4, -0.6]), [0.1, 0.05, 0.025]
    for f in (0.8, 0.008, 1.0):
        x, corrected = f * P[0] / P[2], (f * rate[0] - f * P[0] / P[2] * rate[2]) / P[2]
        printed = (rate[0] - x * rate[2]) / P[2]
        ends = [[f * (P + h * rate)[0] / (P + h * rate)[2] for h in (d, -d)] for d in steps]
        differences = np.subtract(*np.transpose(ends)) / (2 * np.array(steps))
        assert (slopes(np.abs(differences - corrected), steps) >= 1.8).all()
        assert (abs(printed - corrected) < 1e-15) == (f == 1.0)


def test_equations_12_to_14_from_a_camera_that_moves():
    """Pdot = -v - omega x P, and with the corrected (11) the L of (14)."""
    P, V = np.array([0.3, -0.2, 1.7]), np.array([0.2, -0.1, 0.3, 0.4, -0.5, 0.6])
    steps = np.array([0.1, 0.05, 0.025])
    ahead, behind = (
        np.array([rs.Pose.exp(sign * h * V).inv() @ P for h in steps]) for sign in (1, -1)
    )
    Pdot = -V[:3] - np.cross(V[3:], P)
    sdot = interaction(P[None]) @ V
    for rate, of in ((Pdot, lambda p: p), (sdot, lambda p: p[:, :2] / p[:, 2:])):
        differences = (of(ahead) - of(behind)) / (2 * steps[:, None])
        assert (slopes(np.abs(differences - rate).max(axis=1), steps) >= 1.8).all()


# eq. 8


def test_erratum_2_the_pseudo_inverse_is_the_inverse_of_the_gram_matrix_times_the_transpose(
    free_scene,
):
    """After eq. (8): L^+ = (L'L)^-1 L'. The printed one lost the inverse, and inverts nothing."""
    run = rs.simulate(free_scene(SQUARE), rs.IBVS(goal=GOAL, gain=0.7), START, duration=0.04)
    X, _ = image(START, SQUARE)
    L, e = interaction(X), run.error.values[0]
    inverse = np.linalg.inv(L.T @ L) @ L.T
    printed = (L.T @ L) @ L.T
    close(run.camera_velocity[0], -0.7 * inverse @ e, 1e-12)
    close(inverse @ L, np.eye(6), 1e-11)
    assert np.abs(printed @ L - np.eye(6)).max() > 1


def test_erratum_2_the_law_minimises_the_distance_from_exponential_decay(free_scene):
    """V minimises ||edot + gain e||: any other twist is farther from edot = -gain e."""
    run = rs.simulate(free_scene(SQUARE), rs.IBVS(goal=GOAL, gain=0.7), START, duration=0.04)
    X, _ = image(START, SQUARE)
    L, e, V = interaction(X), run.error.values[0], run.camera_velocity.values[0]
    least = np.linalg.norm(L @ V + 0.7 * e)
    assert least > 1e-3  # eight features, six motions: exact decay is out of reach
    for change in np.random.default_rng(0).normal(scale=0.01, size=(100, 6)):
        assert np.linalg.norm(L @ (V + change) + 0.7 * e) > least


@pytest.mark.filterwarnings("ignore::robsim.errors.RankWarning")  # two marks fix four motions
def test_erratum_2_and_then_the_twist_is_the_shortest(free_scene):
    marks = SQUARE[:2]
    run = rs.simulate(free_scene(marks), rs.IBVS(goal=GOAL, gain=0.7), START, duration=0.04)
    X, _ = image(START, marks)
    L, e, V = interaction(X), run.error.values[0], run.camera_velocity.values[0]
    close(L @ V, -0.7 * e, 1e-12)
    free = np.linalg.svd(L)[2][4:]  # two motions that no feature sees
    close(L @ free.T, 0, 1e-12)
    close(free @ V, 0, 1e-12)
    assert np.linalg.norm(V + 0.01 * free[0]) > np.linalg.norm(V)


# eqs. 16 to 18


def test_erratum_4_the_rate_of_the_lyapunov_function_is_negative(free_scene):
    """Eq. (17): Vdot = -gain e' L L^+ e <= 0. A held command meets it to first order in dt."""
    X, _ = image(START, SQUARE)
    L, steps, errors = interaction(X), np.array([0.02, 0.01, 0.005]), []
    for dt in steps:
        task = rs.IBVS(goal=GOAL, gain=0.7)
        run = rs.simulate(free_scene(SQUARE), task, START, dt=dt, duration=dt)
        e, V = run.error.values[0], run.lyapunov.values
        assert V[0] == pytest.approx(e @ e / 2, rel=1e-14)  # eq. (16)
        rate = -0.7 * e @ L @ np.linalg.pinv(L) @ e
        errors.append(abs((V[1] - V[0]) / dt - rate))
    assert rate < 0
    assert (slopes(errors, steps) >= 0.9).all()


@pytest.mark.parametrize("law", ["joint", "camera"])
def test_erratum_4_with_exact_l_the_lyapunov_function_never_grows(free_scene, law):
    starts = [
        (GOAL @ rs.Pose.exp(np.append(0.1 * twist[:3], 0.4 * twist[3:]))).q
        for twist in np.random.default_rng(1).uniform(-1, 1, (40, 6))
    ]
    task = rs.IBVS(goal=GOAL, law=law)
    run = rs.simulate(free_scene(SQUARE), task, starts, dt=0.01, duration=8)
    V = run.lyapunov.values
    rises = np.diff(V, axis=1) / V[:, :-1]
    assert np.nanmax(rises) <= 0
    assert np.nanmin(rises) >= -2 * 0.01 * (1 + 0.01)  # nor does it fall faster than e = e0 exp(-t)


def test_erratum_4_l_times_its_pseudo_inverse_has_rank_six_at_most():
    """Eq. (18) requires L L^+ > 0. It is a projection: for k = 8 two directions of e are unseen."""
    X, _ = image(START, SQUARE)
    for marks, k in ((3, 6), (4, 8)):
        L = interaction(X[:marks])
        eigenvalues = np.linalg.eigvalsh(L @ np.linalg.pinv(L))
        close(eigenvalues, [0] * (k - 6) + [1] * 6, 1e-11)


def test_erratum_4_with_three_points_the_lyapunov_function_decays_exponentially(free_scene):
    """For k = 6, L L^+ = I and V = V0 exp(-2 gain t), to first order in dt."""
    ratios, steps = [], np.array([0.004, 0.002, 0.001])
    for dt in steps:
        task = rs.IBVS(goal=GOAL, gain=0.7)
        run = rs.simulate(free_scene(SQUARE[:3]), task, START, dt=dt, duration=1)
        ratios.append(float(run.lyapunov[-1] / run.lyapunov[0]))
    errors = np.abs(np.array(ratios) / np.exp(-1.4) - 1)
    assert errors[-1] < 1e-3
    assert (slopes(errors, steps) >= 0.9).all()


TILTED = rs.Pose.at(0.70711, 0, -0.70711, rotvec=(0, -0.7854, 0))


def test_erratum_4_the_null_space_permits_local_minima(free_scene):
    """k = 8: the run rests where L'e = 0 while e is not, so V stays above zero."""
    start = rs.Pose.at(-0.70711, 0, -0.70711, rotvec=(0, 0.7854, 0))
    run = rs.simulate(free_scene(SQUARE), rs.IBVS(goal=TILTED), start, duration=60)
    assert outcome(run) == rs.Outcome.LOCAL_MINIMUM
    e = run.error.dropna("time").values[-1]
    X, _ = image(rs.Pose.from_quaternion(run.q_end[:3], run.q_end[3:]), SQUARE)
    L = interaction(X)
    assert np.linalg.norm(e) == pytest.approx(0.02755, rel=3e-3)
    assert np.linalg.norm(np.linalg.pinv(L) @ e) < 1e-4
    assert np.linalg.norm(L @ np.linalg.pinv(L) @ e) < 1e-3 * np.linalg.norm(e)


def test_erratum_4_but_local_minima_need_not_result(free_scene):
    """The same marks, goal and law from a start nearer the goal: "will result" is too strong."""
    start = TILTED @ rs.Pose.exp([0.1, 0.1, -0.1, 0.1, -0.1, 0.3])
    run = rs.simulate(free_scene(SQUARE), rs.IBVS(goal=TILTED), start, duration=60)
    assert outcome(run) == rs.Outcome.CONVERGED


TRIANGLE = 0.2 * np.array([[np.cos(t), np.sin(t), 0] for t in np.radians([0, 120, 240])])
ABOVE = rs.Pose.at(0, 0, -0.5)


def axes_of(points):
    """A pose made of three points: first point, direction to the second, normal."""
    x, y = points[1] - points[0], points[2] - points[0]
    z = np.cross(x, y)
    x, z = x / np.linalg.norm(x), z / np.linalg.norm(z)
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = np.column_stack([x, np.cross(z, x), z]), points[0]
    return rs.Pose(T)


def with_mark_drawn_nearer(n):
    """The pose that sees mark n on the same ray at 17/29 of its distance.

    On the rays of `ABOVE` (length^2 0.29, product 0.23) the triangle (side^2 0.12) fits again
    where 0.29 k^2 - 0.46 k + 0.17 = 0: k = 1 or 17/29.
    """
    X, _ = image(ABOVE, TRIANGLE)
    X[n] *= 17 / 29
    return axes_of(TRIANGLE) @ axes_of(X).inv()


@pytest.mark.parametrize("n", [0, 1, 2])
def test_erratum_4_three_points_look_the_same_from_four_poses(free_scene, n):
    """k = 6 is local: beside `ABOVE` there are three poses with e = 0, and runs end there."""
    there = with_mark_drawn_nearer(n)
    _, s = image(there, TRIANGLE)
    close(s, image(ABOVE, TRIANGLE)[1], 1e-14)
    assert np.linalg.norm(there.position - ABOVE.position) > 0.3
    start = there @ rs.Pose.exp([0.01, -0.02, 0.01, 0.03, 0.02, -0.02])
    run = rs.simulate(free_scene(TRIANGLE), rs.IBVS(goal=ABOVE), start, duration=30)
    assert outcome(run) == rs.Outcome.CONVERGED
    close(run.q_end[:3], there.position, 1e-4)


def test_erratum_4_a_fourth_point_separates_the_four_poses():
    four = np.vstack([TRIANGLE, [[0, 0, 0]]])
    for n in range(3):
        away = image(with_mark_drawn_nearer(n), four)[1] - image(ABOVE, four)[1]
        assert np.abs(away[:6]).max() < 1e-14
        assert np.abs(away[6:]).max() > 0.05


@pytest.mark.parametrize("turn", np.radians([10, 100, 250]))
def test_erratum_4_three_points_are_singular_on_a_cylinder(turn):
    """The camera on the cylinder through the points, its axis normal to their plane: rank 5."""

    def smallest(radius):
        place = np.array([radius * np.cos(turn), radius * np.sin(turn), -0.5])
        X = TRIANGLE - place  # how the camera is turned does not change the rank
        return np.linalg.svd(interaction(X))[1][-1]

    assert smallest(0.2) < 1e-14
    for radius in (0.1, 0.15, 0.25):
        assert smallest(radius) > 1e-3


# section 6.1: an arm with five joints

CUBE_TOP = 0.025 * np.array([[-1, -1, 1], [1, -1, 1], [1, 1, 1], [-1, 1, 1]])
CUBE = rs.Pose.at(0.28, 0, 0.025)
HAND_EYE = rs.Pose.at(0, 0.05, -0.10)
FROM = np.radians([-6, -61, 61, 33, -118])


@pytest.fixture(scope="module")
def workbench(rhino):
    """A camera beside the gripper, looking at the four top vertices of a cube of 5 cm."""
    eye = rs.MountedCamera("eye", rs.Camera(np.eye(3)), on="rhino_xr4.tool", pose=HAND_EYE)
    return rs.Scene([rhino], [rs.Object("cube", marks=CUBE_TOP, pose=CUBE)], [eye])


@pytest.fixture(scope="module")
def guided(workbench):
    """The run from one start to home, by a law."""

    def run(law, start=FROM):
        return rs.simulate(workbench, rs.IBVS(law=law), start, duration=40)

    return run


def test_erratum_7_the_two_laws_take_different_paths_on_an_arm_of_five_joints(guided):
    """v = -gain L^+ e then qdot = J^+ v is not qdot = -gain (L J)^+ e."""
    joint, camera = guided("joint"), guided("camera")
    assert outcome(joint) == outcome(camera) == rs.Outcome.CONVERGED
    assert float(camera.path_length) > 2 * float(joint.path_length)


def test_erratum_7_the_camera_law_can_raise_the_error_and_the_joint_law_does_not(guided):
    """No joint velocity realises the twist of the camera law."""
    start = np.radians([-13, -63, 69, 12, -121])
    joint, camera = (guided(law, start).lyapunov.dropna("time") for law in ("joint", "camera"))
    assert (np.diff(joint) < 0).all()
    assert camera.max() > 1.5 * camera[0]


def test_erratum_7_the_camera_law_depends_on_the_unit_of_length(guided):
    """J^+ of a 6 x 5 matrix weighs |dv|^2 / length^2 against |domega|^2."""
    metre, centimetre = guided(rs.laws.CameraLaw(1.0)), guided(rs.laws.CameraLaw(0.01))
    assert float(metre.path_length) > 2 * float(centimetre.path_length)
    np.testing.assert_array_equal(metre.q, guided("camera").q)  # a metre by default


def camera_by_hand(q, unit):
    """Pose of the camera and its Jacobian in its own axes, lengths in `unit` metres."""
    T, axes = np.eye(4), []
    for angle, (d, a, alpha, _) in zip(q, DH_CM_DEG.values(), strict=True):
        axes.append((T[:3, 2], T[:3, 3]))
        T = T @ dh(angle, d * 0.01 / unit, a * 0.01 / unit, np.radians(alpha))
    T[:3, 3] += T[:3, :3] @ HAND_EYE.position / unit
    J = np.array([[*np.cross(z, T[:3, 3] - o), *z] for z, o in axes]).T
    return T, np.kron(np.eye(2), T[:3, :3].T) @ J


def path_by_hand(law, unit, steps, dt=0.04, gain=1.0):
    """Eqs. (3), (4), (8), (14) and (19) in plain NumPy, every length in `unit` metres."""
    marks, path = (CUBE @ CUBE_TOP) / unit, [FROM]
    home = np.radians([row[3] for row in DH_CM_DEG.values()])
    _, s_goal = image(camera_by_hand(home, unit)[0], marks)
    for _ in range(steps):
        T, J = camera_by_hand(path[-1], unit)
        X, s = image(T, marks)
        L, e = interaction(X), s - s_goal
        pinv = np.linalg.pinv
        rate = pinv(L @ J) @ e if law == "joint" else pinv(J) @ (pinv(L) @ e)
        path.append(path[-1] - dt * gain * rate)
    return np.array(path)


@pytest.mark.parametrize("unit", [1.0, 0.01, 0.1])
def test_erratum_7_the_length_is_the_unit_in_which_all_is_computed_by_hand(guided, unit):
    """`CameraLaw(0.01)` is the chapter, which computes in centimetres."""
    by_hand = path_by_hand("camera", unit, 100)
    close(guided(rs.laws.CameraLaw(unit)).q[:101], by_hand, 1e-9)


@pytest.mark.parametrize("unit", [1.0, 0.01])
def test_erratum_7_the_joint_law_is_the_same_in_every_unit(guided, unit):
    """L J maps joints to features: the unit of length cancels."""
    close(guided("joint").q[:101], path_by_hand("joint", unit, 100), 1e-9)
