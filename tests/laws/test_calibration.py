"""Calibration of a camera on a robot: exact views, rates by their order, covariance, next views."""

from dataclasses import replace

import numpy as np
import pytest

import robsim as rs
from robsim.calibration.calibration_model import (
    CalibrationModel,
    predict_pixels,
    predict_rates,
    select_unknowns,
)
from robsim.statistics.fisher_distribution import fisher_quantile
from robsim.vision.camera import Visibility

METHODS = "tsai_lenz", "park_martin", "daniilidis"
LENS = ("focal", "center", "distortion")
LOOK = rs.starts.LookAt("board", distance=(0.3, 0.9), cone=0.9, aside=0.1)


@pytest.fixture(scope="module")
def bench():
    return rs.load_scenario(rs.examples.path("calibration_bench"))


@pytest.fixture(scope="module")
def exact(bench):
    """The bench without noise, with a controller that believes the true values."""
    return bench.at({"belief": None, "sensing.noise": 0.0})


@pytest.fixture(scope="module")
def q(bench):
    """Coordinates with the whole board in view."""
    return rs.calibration.sample_viewpoints(bench, 200, LOOK, seed=3)


@pytest.fixture
def to_hand():
    """A camera on a tripod that looks at a plate in the hand of a Puma, and coordinates."""
    scene = rs.load_scenario(rs.examples.path("eye_to_hand")).scene
    home = np.radians([19, 69, -198, -3, -40, -21])
    turns = np.random.default_rng(5).uniform(-0.25, 0.25, (8, 6))
    return scene, home + turns


def poses(count, seed, mount=None):
    """Exact poses of views T_m_f and T_c_o, and the mount and the place that they come from."""
    rng = np.random.default_rng(seed)
    A = rs.Pose.at(*rng.normal(size=(3, count)), rotvec=rng.normal(0, 0.6, (count, 3)))
    X = mount or rs.Pose.at(*rng.normal(size=3), rotvec=rng.normal(size=3))
    Z = rs.Pose.at(*rng.normal(size=3), rotvec=rng.normal(size=3))
    return A, X.inv() @ A @ Z, X, Z


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("count", [3, 4, 20])
def test_a_mount_follows_from_exact_poses(method, count):
    A, B, X, _ = poses(count, count)
    np.testing.assert_allclose(
        rs.calibration.solve_hand_eye(A, B, method).matrix, X.matrix, atol=1e-10
    )


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("axis", np.eye(3).tolist())
def test_a_camera_may_be_mounted_by_half_a_turn(method, axis):
    """There the tangent of half the angle, which Tsai and Lenz use, is infinite."""
    mount = rs.Pose.at(0.1, 0.2, 0.3, rotvec=np.pi * np.array(axis))
    A, B, X, _ = poses(5, 7, mount)
    np.testing.assert_allclose(
        rs.calibration.solve_hand_eye(A, B, method).matrix, X.matrix, atol=1e-10
    )


@pytest.mark.parametrize("count", [3, 4, 20])
def test_mount_and_place_follow_from_exact_poses(count):
    A, B, X, Z = poses(count, 10 + count)
    for found, true in zip(rs.calibration.solve_robot_world(A, B), (X, Z), strict=True):
        np.testing.assert_allclose(found.matrix, true.matrix, atol=1e-10)


def test_views_that_are_all_half_a_turn_apart_serve():
    """Nearly: then no motion is short of a half turn, and all of them are taken."""
    turns = np.radians([[0, 0, 0], [174, 0, 0], [0, 174, 0]])
    A = rs.Pose.at([0.1, 0.3, 0.2], [0.5, 0.1, 0.4], [0.2, 0.3, 0.1], rotvec=turns)
    _, _, X, Z = poses(3, 1)
    found, _ = rs.calibration.solve_robot_world(A, X.inv() @ A @ Z)
    np.testing.assert_allclose(found.matrix, X.matrix, atol=1e-10)
    half = rs.Pose.at(rotvec=np.pi / np.radians(174) * turns)
    with pytest.raises(rs.errors.InputError, match="half turns only"):
        rs.calibration.solve_robot_world(half, X.inv() @ half @ Z)


@pytest.mark.parametrize("start", ["shah", *METHODS])
def test_a_bench_without_noise_is_found_exactly(exact, q, start):
    found = rs.calibrate(rs.calibration.simulate_views(exact, q[:6]), start=start)
    assert np.abs(found.errors(exact.scene)).max() < 1e-10 and found.rms < 1e-9


def test_a_wrong_lens_is_found_with_the_mount(bench, q):
    """The belief at first is a lens 2 percent too long without its distortion."""
    still = bench.at({"sensing.noise": 0.0, "belief.cameras.camera.distortion": [0, 0, 0, 0]})
    found = rs.calibrate(rs.calibration.simulate_views(still, q[:8]), LENS)
    scale = np.maximum(np.abs(found.model.numbers(found.free)), 1.0)
    errors = found.errors(bench.scene)
    assert np.abs(errors[:12]).max() < 1e-10 and (np.abs(errors[12:]) < 1e-9 * scale).all()
    np.testing.assert_allclose(found.camera.K, bench.scene.camera().camera.K, rtol=1e-10)


def test_a_camera_on_a_tripod_is_found_alike(to_hand):
    """Eye-to-hand: the camera stands in the world and the target is in the hand."""
    scene, q = to_hand
    seen = scene.view(q)
    assert (seen.visibility == Visibility.IN_IMAGE).all()
    found = rs.calibrate(rs.calibration.CalibrationViews(_without_places(scene), q, seen.pixels))
    assert np.abs(found.errors(scene)).max() < 1e-10
    there = found.scene.camera().pose.matrix
    np.testing.assert_allclose(there, scene.camera().pose.matrix, atol=1e-12)


def _without_places(scene):
    eye, thing = scene.camera(), scene.object()
    return scene.replacing(
        *(replace(each, pose=rs.Pose.at(0.3, 0.2, 0.1)) for each in (eye, thing))
    )


def test_offsets_of_encoders_are_found(bench, exact, q):
    """The first and the last joint are left out: place and mount absorb their offsets."""
    offsets = np.radians([0, 0.4, -0.3, 0.2, -0.5, 0])
    views = rs.calibration.simulate_views(exact, q[:8])
    told = rs.calibration.CalibrationViews(views.scene, q[:8] - offsets, views.pixels)
    joints = [exact.scene.coordinate_names[i] for i in (1, 2, 3, 4)]
    found = rs.calibrate(told, joints)
    np.testing.assert_allclose(found.offsets, offsets, atol=1e-10)
    assert np.abs(found.errors(exact.scene)[:12]).max() < 1e-10
    with pytest.raises(rs.errors.InputError, match=r"do not determine .* separately"):
        rs.calibrate(told, exact.scene.coordinate_names)


def test_marks_that_are_not_seen_are_left_out(exact, q):
    views = rs.calibration.simulate_views(exact, q[:6])
    some = views.pixels.copy()
    some[0, 10:], some[3, ::2] = np.nan, np.nan
    found = rs.calibrate(rs.calibration.CalibrationViews(views.scene, q[:6], some))
    assert np.abs(found.errors(exact.scene)).max() < 1e-10
    assert (np.isnan(found.residuals) == np.isnan(some)).all()


def test_rates_of_pixels_agree_with_finite_differences(exact, q):
    """Of all unknowns at once, with eight coefficients: the error of a step h is of order h^2."""
    lens = exact.at("cameras.camera.distortion", [-0.1, 0.05, 1e-3, -2e-3, 0.02, 0.01, -0.02, 0.03])
    views = rs.calibration.simulate_views(lens, q[:3])
    free = select_unknowns(views, [*LENS, "scale", *views.scene.coordinate_names])
    eye, thing = lens.scene.camera(), lens.scene.object()
    at = CalibrationModel(eye.pose, thing.pose, eye.camera, np.zeros(6), 1.1)
    J = predict_rates(at, thing.marks, views.chain, views.q, free)
    errors = []
    for h in (1e-3, 1e-4):
        numeric = np.stack(
            [
                np.subtract(
                    *(
                        predict_pixels(
                            at.add_step(s * h * e, free), thing.marks, views.chain, views.q
                        )
                        for s in (1, -1)
                    )
                )
                / (2 * h)
                for e in np.eye(len(free.names))
            ],
            axis=-1,
        )
        errors.append(np.abs(numeric - J).max(axis=(0, 1, 2)))
    assert (errors[1] < 0.02 * errors[0] + 1e-6).all() and errors[0].max() > 1e-3


def test_a_size_of_the_target_is_found(exact, q):
    """The board is 0.9 times as large as the scene has it; each closed form may start."""
    board = exact.scene.object("board")
    larger = exact.scene.replacing(replace(board, marks=board.marks / 0.9))
    pixels = rs.calibration.simulate_views(exact, q[:6]).pixels
    views = rs.calibration.CalibrationViews(larger, q[:6], pixels)
    for start in ("shah", "daniilidis"):
        found = rs.calibrate(views, ["scale"], start=start)
        assert abs(found.model.scale - 0.9) < 1e-12 and found.names[-1] == "scale"
        assert np.abs(found.errors(exact.scene)).max() < 1e-10 and "scale" in str(found)
        np.testing.assert_allclose(found.scene.object().marks, board.marks, atol=1e-12)


def test_viewpoints_need_no_goal(bench):
    """The board is behind the camera at home, and a scene has no task."""
    scene = rs.load_scenario(rs.examples.path("calibration_bench")).scene
    blind = rs.Experiment(scene, rs.IBVS())
    with pytest.raises(rs.errors.GoalError):
        blind.loop()
    q = rs.calibration.sample_viewpoints(blind, 5, LOOK, seed=3)
    np.testing.assert_array_equal(q, rs.calibration.sample_viewpoints(scene, 5, LOOK, seed=3))
    assert len(q) == 5 and (scene.view(q).visibility == Visibility.IN_IMAGE).all()
    with_goal = rs.calibration.sample_viewpoints(bench, 5, LOOK, seed=3)
    np.testing.assert_allclose(q, with_goal, atol=1e-12)
    near = rs.calibration.sample_viewpoints(scene, 3, rs.starts.About(rpy=[0.1, 0.1, 0.1]))
    assert (scene.view(near).visibility == Visibility.IN_IMAGE).all()


def test_rates_with_joints_where_the_camera_stands(to_hand):
    scene, q = to_hand
    views = rs.calibration.CalibrationViews(scene, q, scene.view(q).pixels)
    free = select_unknowns(views, scene.coordinate_names)
    at = CalibrationModel(
        scene.camera().pose, scene.object().pose, scene.camera().camera, np.zeros(6)
    )
    J = predict_rates(at, scene.object().marks, views.chain, q, free)[..., 12:]
    h = 1e-5
    for i in range(6):
        moved = (scene.view(q + s * h * np.eye(6)[i]).pixels for s in (1, -1))
        np.testing.assert_allclose(np.subtract(*moved) / (2 * h), J[..., i], atol=1e-4)


@pytest.mark.parametrize(
    ("level", "n", "m", "value"),
    [  # as tables print them
        (0.95, 6, 100, 2.1906),
        (0.95, 1, 10, 2.228139**2),
        (0.99, 4, 20, 4.4307),
        (0.95, 6, np.inf, 12.5916 / 6),
        (0.5, 2, np.inf, np.log(2)),
    ],
)
def test_quantiles_agree_with_tables(level, n, m, value):
    assert abs(fisher_quantile(level, n, m) / value - 1) < 3e-5


def normalised_squares(bench, q, trials, also):
    """d' C^-1 d of the mount for views with other noise in each trial, and the fixed parameters."""
    found = [
        rs.calibrate(rs.calibration.simulate_views(bench, q, seed=i), also) for i in range(trials)
    ]
    squares = [
        d @ np.linalg.solve(each.covariance[:6, :6], d)
        for each in found
        for d in [each.errors(bench.scene)[:6]]
    ]
    return np.array(squares), found


@pytest.mark.full
def test_errors_are_as_large_as_the_covariance_predicts(bench, q):
    """Of 20 trials the mean of d' C^-1 d is 6 m / (m - 2), to 3 of its standard deviations."""
    squares, found = normalised_squares(bench, q[:8], 20, ["focal", "center"])
    m = found[0].freedom
    assert m == 2 * 8 * 35 - 16
    assert abs(squares.mean() - 6 * m / (m - 2)) < 3 * np.sqrt(12 / 20)
    assert abs(np.mean([each.sigma for each in found]) - 0.2) < 3 * 0.2 / np.sqrt(2 * m * 20)


@pytest.mark.full
@pytest.mark.parametrize("also", [(), ("focal", "center"), LENS])
def test_the_ellipsoid_of_95_percent_holds_the_truth_in_95_of_100_trials(bench, q, also):
    known = bench if also else bench.at("belief", None)
    parts = ("mount", "target", "lens") if also else ("mount", "target")
    _, found = normalised_squares(known, q[:10], 100, also)
    for part in parts:
        share = np.mean([each.holds(bench.scene, part) for each in found])
        assert 0.92 <= share <= 0.98, (part, share)


def test_the_covariance_agrees_with_the_noise_that_is_given(bench, q):
    views = rs.calibration.simulate_views(bench, q[:5])
    also = ["focal", "center"]
    own, given = rs.calibrate(views, also), rs.calibrate(views, also, noise=0.4)
    np.testing.assert_allclose(
        given.covariance * (own.sigma / 0.4) ** 2, own.covariance, rtol=1e-12
    )
    assert given.freedom == np.inf and given.sigma == 0.4 and given.mount == own.mount


def spreads(found):
    """The standard deviations of position and orientation, roots of sums, for 0.2 px."""
    C = np.diag(found.covariance) * (0.2 / found.sigma) ** 2
    return np.sqrt([C[:3].sum(), C[3:6].sum()])


def planned(bench, q, some, seed):
    """A calibration from three views and the seven next views that it proposes."""
    first = rs.calibrate(
        rs.calibration.simulate_views(bench, q[some[:3]], seed=seed), ["focal", "center"]
    )
    more = first.next_poses(q, 7)
    return rs.calibrate(
        rs.calibration.simulate_views(bench, np.concatenate([q[some[:3]], more.q]), seed=seed),
        ["focal", "center"],
    ), more


@pytest.mark.full
def test_ten_chosen_views_are_worth_more_than_twenty_random_ones(bench, q):
    """In five trials, by the covariance."""
    rng = np.random.default_rng(2)
    pairs = []
    for i in range(5):
        some = rng.permutation(len(q))
        random = rs.calibrate(
            rs.calibration.simulate_views(bench, q[some[:20]], seed=i), ["focal", "center"]
        )
        chosen, more = planned(bench, q, some, 100 + i)
        pairs.append((spreads(chosen), spreads(random)))
        expected = np.array([more.position[-1], more.angle[-1]])
        first_sigma = 0.2 / spreads(chosen) * expected  # as the first three views had it
        np.testing.assert_allclose(first_sigma, first_sigma[0], rtol=0.2)
    chosen, random = np.median(pairs, axis=0)
    assert (chosen < random).all()


@pytest.mark.full
def test_ten_chosen_views_reach_the_error_of_twenty_random_ones(bench, q):
    """The medians of the true errors of position and orientation, over 50 trials."""
    rng = np.random.default_rng(4)
    sizes = []
    for i in range(50):
        some = rng.permutation(len(q))
        random = rs.calibrate(
            rs.calibration.simulate_views(bench, q[some[:20]], seed=i), ["focal", "center"]
        )
        errors = [each.errors(bench.scene) for each in (planned(bench, q, some, i)[0], random)]
        sizes.append([[np.linalg.norm(e[:3]), np.linalg.norm(e[3:6])] for e in errors])
    chosen, random = np.median(sizes, axis=0)
    assert (chosen <= random).all()


def test_each_view_that_is_chosen_is_the_best_there_is(bench, q):
    """Against the determinants of the covariances of `calibrate`, from first principles."""
    found = rs.calibrate(rs.calibration.simulate_views(bench.at("belief", None), q[:4]))
    more = found.next_poses(q[4:14], 2)
    known = np.linalg.inv(found.covariance)
    J = predict_rates(found.model, found.views.thing.marks, found.views.chain, q[4:14], found.free)
    J = J.reshape(10, -1, 12) / found.sigma
    for number, position in zip(more.number, more.position, strict=True):
        each = [np.linalg.inv(known + j.T @ j) for j in J]
        assert np.argmin([np.linalg.det(C[:6, :6]) for C in each]) == number
        assert abs(position / np.sqrt(np.trace(each[number][:3, :3])) - 1) < 1e-9
        known = np.linalg.inv(each[number])
        J[number] = 0.0
    assert (np.diff(more.angle) < 0).all()


def test_the_cost_of_a_wrong_lens_is_the_shift_of_the_pose(bench, exact, q):
    """The camera stops where the believed lens shows the goal: from `estimate_pose` instead."""
    still = exact.at({"task.tolerance": 1e-6, "run.duration": 25})
    found = rs.calibrate(rs.calibration.simulate_views(bench, q[:6]), ["focal", "center"])
    cost = found.cost(still, 30, seed=1)
    table, eye = cost.study.table, still.scene.camera().camera
    assert cost.converged.value == 1.0 and cost.metres[1] < 1e-5 < cost.metres[0]
    marks, goal = still.scene.object().marks, rs.Pose.at(-0.12, -0.09, 0.5)
    pixels = eye.project(marks, goal.inv())
    lens = dict(zip(cost.names, cost.errors.T, strict=True))
    for i in (0, 7, 20):
        K = np.array(eye.K)
        K[[0, 1, 0, 1], [0, 1, 2, 2]] += [lens[name][i] for name in ("fx", "fy", "cx", "cy")]
        believed = rs.Camera(K, eye.size, distortion=eye.distortion)
        off = goal @ rs.Pose(rs.vision.estimate_pose(marks, pixels, believed).T_c_o).inv()
        wanted = np.linalg.norm(off.position)
        assert abs(table["distance_to_goal"][i] / wanted - 1) < 0.05


@pytest.mark.full
def test_a_cost_agrees_with_the_covariance(bench, q):
    """Draws have its moments, and do not depend on how many there are."""
    found = rs.calibrate(rs.calibration.simulate_views(bench, q[:6]), ["focal", "center"])
    short = bench.with_(duration=0.04)
    many, few = found.cost(short, 4000), found.cost(short, 50)
    np.testing.assert_array_equal(many.errors[:50], few.errors)
    C = found.covariance[np.ix_(np.r_[0:6, 12:16], np.r_[0:6, 12:16])]
    white = np.linalg.solve(np.linalg.cholesky(C), many.errors.T)
    np.testing.assert_allclose(white @ white.T / 4000, np.eye(10), atol=0.08)
    own = "belief.cameras.camera"
    table = many.study.table
    np.testing.assert_allclose(
        table[f"{own}.center[0]"] - 646, many.errors[:, many.names.index("cx")], atol=1e-9
    )
    turns = table[[f"{own}.rpy[{i}]" for i in range(3)]].to_numpy()
    true = bench.scene.camera().pose
    there = true.inv() @ rs.Pose.at(*true.position, rpy=turns)
    np.testing.assert_allclose(there.rotvec, many.errors[:, 3:6], atol=1e-9)


@pytest.mark.full
@pytest.mark.parametrize("marks", [[0, 6, 28, 34], list(range(35))])
def test_noise_alone_is_no_misfit(exact, q, marks):
    """Of 300 calibrations with given and with estimated noise, none has a misfit."""
    noisy, others = exact.at("sensing.noise", 0.3), np.delete(np.arange(35), marks)
    for seed in range(40):
        views = rs.calibration.simulate_views(noisy, q[seed : seed + 5], seed=seed)
        pixels = views.pixels.copy()
        pixels[:, others] = np.nan
        some = rs.calibration.CalibrationViews(views.scene, views.q, pixels)
        assert rs.calibrate(some).misfit == rs.calibrate(some, noise=0.3).misfit == ""
