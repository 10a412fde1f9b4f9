"""L of `Scene.interaction` and L J of a task: the chapter's formula, and differences of images."""

import numpy as np
import pytest

import robsim as rs
from robsim.features import FeatureBlock, Observation

MARKS = [[-0.1, -0.09, 0], [0.11, -0.1, 0.02], [0.1, 0.1, 0], [-0.09, 0.11, 0.03]]
Q = rs.Pose.at(0.05, -0.06, -0.7, rpy=(0.1, 0.15, 0.3)).q
GOAL = rs.Pose.at(0.02, 0.01, 0.6, rpy=(0.05, -0.1, 0.15))
FEATURES = [
    *("points", "pixels", "log_depth", "points_3d", "polar", "spherical", "segments"),
    "point_moments",
    rs.features.ThetaU(T_goal_o=GOAL),
    rs.features.Translation("camera", T_goal_o=GOAL),
]


def make_scene(marks=MARKS):
    free = rs.robots.free_camera()
    lens = rs.Camera([[500, 2, 320], [0, 480, 240], [0, 0, 1]], distortion=(-0.1, 0.02, 0, 0))
    eyes = [
        rs.MountedCamera("eye", lens, f"{free.name}.body"),
        rs.MountedCamera("second", lens, f"{free.name}.body", rs.Pose.at(0.1, 0, 0)),
    ]
    return rs.Scene([free], rs.Object("dots", marks=marks), eyes)


def transform(scene, q):
    """Return the marks in axes of the camera."""
    return rs.Pose(scene.pose("eye", q).matrix).inv() @ scene.object().marks


def test_rows_of_points_are_the_formula_of_the_chapter():
    scene = make_scene()
    L = scene.interaction(Q, "eye")
    for n, (X, Y, Z) in enumerate(transform(scene, Q)):
        x, y = X / Z, Y / Z
        rows = [-1 / Z, 0, x / Z, x * y, -(1 + x**2), y], [0, -1 / Z, y / Z, 1 + y**2, -x * y, -x]
        np.testing.assert_allclose(L.matrix[2 * n : 2 * n + 2], rows, atol=1e-9)
    assert L.rows[:3] == ("x of mark 0", "y of mark 0", "x of mark 1")
    assert L.columns == ("v_x", "v_y", "v_z", "omega_x", "omega_y", "omega_z")


def measure(scene, feature, q):
    """Return the feature of the image at q, with the true depths and pose."""
    view = scene.view(q, "eye", "dots")
    T_c_o = rs.Pose(scene.pose("eye", q).matrix).inv() @ rs.Pose(scene.pose("dots", q).matrix)
    eye = scene.camera("eye").camera
    seen = Observation.of(view.pixels, view.depth, eye, model=scene.object().marks, pose=T_c_o)
    return np.asarray(feature.measure(seen))[0]


def difference(scene, feature, step):
    """Return central differences of a feature along the six motions of the camera."""
    T = rs.Pose(scene.pose("eye", Q).matrix)
    columns = []
    for axis in range(6):
        twist = step * np.eye(6)[axis]
        ahead, behind = (
            measure(scene, feature, (T @ rs.Pose.exp(sign * twist)).q) for sign in (1, -1)
        )
        columns.append((ahead - behind) / (2 * step))
    return np.stack(columns, axis=1)


@pytest.mark.parametrize("kind", FEATURES, ids=str)
def test_differences_of_images_converge_with_order_2(kind):
    scene = make_scene()
    feature = rs.IBVS(features=kind).blocks[0].feature
    L = scene.interaction(Q, "eye", features=kind)
    errors = [np.abs(difference(scene, feature, h) - L.matrix).max() for h in (0.004, 0.002)]
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.1)
    assert errors[1] < 0.002 * np.abs(L.matrix).max()


def test_features_of_a_stereo_pair_move_with_the_first_camera():
    scene = make_scene()
    L = scene.interaction(Q, ("eye", "second"), features="stereo_points")
    for n, (X, Y, Z) in enumerate(transform(scene, Q)):
        skew = [[0, -Z, Y], [Z, 0, -X], [-Y, X, 0]]
        np.testing.assert_allclose(L.matrix[3 * n : 3 * n + 3], np.c_[-np.eye(3), skew], atol=1e-8)


def test_a_batch_is_its_single_configurations():
    scene = make_scene()
    several = np.stack([Q, rs.Pose.at(0, 0, -1).q])[None]
    L = scene.interaction(several, "eye", features=["points", "log_depth"])
    assert L.shape == (1, 2, 12, 6)
    for i in range(2):
        one = scene.interaction(several[0, i], "eye", features=["points", "log_depth"])
        assert np.array_equal(L.matrix[0, i], one.matrix)
        assert L.condition[0, i] == one.condition
        assert L.rank[0, i] == one.rank == 6


def test_it_is_an_array_for_numpy():
    L = make_scene().interaction(Q, "eye")
    np.testing.assert_allclose(np.linalg.pinv(L) @ np.asarray(L), np.eye(6), atol=1e-9)
    np.testing.assert_allclose(L @ np.ones(6), L.matrix.sum(axis=1), atol=1e-14)
    assert L.condition == pytest.approx(np.linalg.cond(L))


def test_a_mark_behind_the_camera_has_no_row():
    L = make_scene().interaction(rs.Pose.at(0, 0, 1).q, "eye")
    assert np.isnan(L.matrix).all() and L.rank == 0 and np.isnan(L.condition)
    with pytest.raises(rs.errors.InputError, match="finite"):
        L.free_motions()


@pytest.mark.parametrize(
    ("marks", "rank", "first"),
    [
        ([[0, 0, 0]], 2, "the camera may move along its z axis"),
        ([[-0.1, 0, 0], [0.1, 0, 0]], 4, "the camera may turn about the axis parallel to x"),
        ([[-0.1, 0, 0], [0.1, 0, 0], [0, 0.1, 0]], 6, ""),
    ],
)
def test_free_motions_change_no_image(marks, rank, first):
    scene = make_scene(marks)
    L = scene.interaction(rs.Pose.at(0, 0, -0.5).q, "eye")
    assert L.rank == rank
    free = L.null_space()
    assert free.shape == (6, 6 - rank)
    assert np.linalg.matrix_rank(free) == 6 - rank
    assert np.abs(L @ free).max(initial=0) < 1e-12
    words = L.free_motions()
    assert len(words) == 6 - rank
    assert not first or words[0].startswith(first)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"features": "pints"}, "did you mean 'points'"),
        ({"features": []}, "at least one"),
        ({"features": 3}, "expected a feature"),
        ({"features": "stereo_points"}, "needs 2 camera"),
        ({"features": "segments", "target": "dot"}, "no object 'dot'.*did you mean 'dots'"),
        ({"camera": "ey"}, "did you mean 'eye'"),
        ({"q": [0.0]}, "expected shape"),
    ],
)
def test_wrong_arguments_are_refused(given, message):
    with pytest.raises(rs.errors.InputError, match=message):
        make_scene().interaction(**{"q": Q, "camera": "eye", **given})


def test_the_task_jacobian_is_the_rate_of_the_features():
    one = rs.load_scenario(rs.examples.path("eye_in_hand"))
    LJ = one.task.task_jacobian(one.scene, one.start)
    L = one.scene.interaction(one.start)
    assert LJ.columns == tuple(one.scene.velocity_names)
    assert one.task.interaction == "mean"  # of L now and at the goal
    mean = 0.5 * (L.matrix + one.scene.interaction().matrix)
    J = np.linalg.lstsq(mean, LJ.matrix, rcond=None)[0]
    exact = one.at("task.interaction", "current").task.task_jacobian(one.scene, one.start)
    np.testing.assert_allclose(L @ J, exact.matrix, atol=1e-9)
    h, feature = 1e-4, rs.features.Points()
    for j in range(one.scene.nv):
        ahead, behind = (
            one.scene.view(np.asarray(one.start) + sign * h * np.eye(7)[j]) for sign in (1, -1)
        )
        eye = one.scene.camera().camera
        s = [feature.measure(Observation.of(v.pixels, v.depth, eye))[0] for v in (ahead, behind)]
        np.testing.assert_allclose((s[0] - s[1]) / (2 * h), exact.matrix[:, j], atol=1e-6)


def test_a_task_jacobian_has_the_rows_of_its_blocks():
    scene = make_scene()
    blocks = [
        FeatureBlock("points", marks=[2], weight=3.0, camera="eye"),
        FeatureBlock("points", components=[1], camera="second"),
    ]
    LJ = rs.IBVS(GOAL.inv().q, features=blocks).task_jacobian(scene, np.stack([Q, Q]))
    assert LJ.shape == (2, 3, 6)
    assert LJ.rows[0] == "x of mark 2 (eye sees dots)"
    assert LJ.rows[2] == "y of mark 0 (second sees dots)"
    L = scene.interaction(Q, "eye")
    np.testing.assert_allclose(LJ.matrix[0, :2], 3 * L.matrix[4:6], atol=1e-9)
