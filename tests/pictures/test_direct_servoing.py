"""Servoing on whole pictures, without marks."""

from dataclasses import replace

import numpy as np
import pytest
from painting import DT, GOAL, make_camera, make_scene, make_task, paint, place_camera

import robsim as rs
from robsim.features.feature import Observation
from robsim.features.images.inverse_depth import fit_inverse_depth
from robsim.features.images.picture_plane import build_picture_plane
from robsim.features.images.picture_warp import warp_pictures
from robsim.features.numeric_interaction import difference_interaction
from robsim.kernels.control.damped_rows import damp_normal_rows
from robsim.kernels.image_features.luminance_rows import CENTRAL, compute_luminance_rows
from robsim.kernels.image_features.normal_equations import factor_normal_equations
from robsim.kernels.machine.program import evaluate_stages
from robsim.run.control.frame_input import read_frame
from robsim.testing import check_feature
from robsim.world.scene_picture import CameraPictures

NEAR = place_camera(0.03, -0.02, 1.08, 4, -3, 8)
STARTS = np.array([NEAR, place_camera(-0.02, 0.03, 0.95, -3, 2, -6), GOAL])


@pytest.fixture(scope="module")
def scene():
    return make_scene()


def outcome(run):
    return rs.Outcome(int(run.outcome))


def simulate(scene, task, start=NEAR, duration=6.0, **settings):
    return rs.simulate(scene, task, start, dt=DT, duration=duration, **settings)


def test_normal_equations_become_seven_numbers_with_the_same_solution_and_norm():
    rng = np.random.default_rng(1)
    rows, e = rng.normal(size=(3, 40, 6)), rng.normal(size=(3, 40))
    H, g = np.swapaxes(rows, 1, 2) @ rows, np.einsum("bni,bn->bi", rows, e)
    s, L = np.empty((3, 7)), np.empty((3, 7, 6))
    factor_normal_equations(H, g, (e**2).sum(axis=1), s, L)
    np.testing.assert_allclose((s**2).sum(axis=1), (e**2).sum(axis=1), rtol=1e-12)
    for b in range(3):
        np.testing.assert_allclose(L[b].T @ L[b], H[b], rtol=1e-12, atol=1e-12)
        expected = np.linalg.lstsq(rows[b], e[b], rcond=None)[0]
        np.testing.assert_allclose(np.linalg.pinv(L[b]) @ s[b], expected, rtol=1e-9)

    def damp(program, *given):
        error, matrix = program.rows(7), program.rows(7, 6)
        names = dict(zip(("error", "L", "damping"), given, strict=True))
        program.add(damp_normal_rows, **names, damped_error=error, damped_L=matrix)
        return [error, matrix]

    damping = np.array([0.0, 0.1, 2.0])
    last = np.ascontiguousarray(s.T), np.ascontiguousarray(np.moveaxis(L, 0, -1)), damping
    error, matrix = evaluate_stages(damp, last, [(7,), (7, 6)])
    for b in range(3):
        damped = H[b] + damping[b] * np.diag(np.diag(H[b]))
        R = matrix[..., b]
        np.testing.assert_allclose(R.T @ R, damped, rtol=1e-12, atol=1e-12)
        expected = np.linalg.solve(damped, g[b])
        np.testing.assert_allclose(np.linalg.pinv(R) @ error[:, b], expected, rtol=1e-9)


def test_a_motion_that_the_picture_does_not_show_has_no_command():
    H = np.diag([4.0, 0.0, 1.0, 1.0, 1.0, 1.0])[None]
    s, L = np.empty((1, 7)), np.empty((1, 7, 6))
    factor_normal_equations(H, np.ones((1, 6)), np.array([9.0]), s, L)
    assert s[0, 1] == 0.0 and not L[0, 1].any()
    np.testing.assert_allclose(s[0], [0.5, 0, 1, 1, 1, 1, np.sqrt(9 - 4.25)])


def test_a_damped_step_is_not_the_remaining_step(scene):
    """With constant damping the command is short where the camera is still far."""
    slow = make_task(damping=1.0, switch_time=100.0, tolerance=50.0, gain=1.0)
    run = simulate(scene, slow, place_camera(0.03, 0, 1, 0, 0, 0), duration=20.0)
    assert outcome(run) is rs.Outcome.LOCAL_MINIMUM and run.distance_to_goal > 0.01
    assert run.error_norm.values[-1] < 1.0 and np.abs(run.qd.values[-1]).max() < 1e-4


LENSES = {
    "pinhole": make_camera(160, 120, 160.0),
    "lens": make_camera(160, 120, 160.0, distortion=(-0.2, 0.05, 0.001, -0.001, 0.0)),
}


@pytest.mark.parametrize("name", LENSES)
def test_luminance_rows_are_the_derivative_of_rendered_pictures(name):
    """Correlation 0.999 and gain 1 within a hundredth, for waves that fill the view."""
    camera = LENSES[name]
    v, u = np.mgrid[:645, :900] / 900
    waves = np.sin(70 * u + 10 * v) + np.cos(20 * u - 60 * v) + np.sin(45 * (u + v) + 1)
    picture = np.rint(127.5 + 40 * waves).astype(np.uint8)
    scene = make_scene(picture, camera, width=2.5)
    q = place_camera(0.05, -0.1, 1.0, 8, -6, 10)[:, None]
    sight = rs.IBVS(GOAL, features="points").sights(scene)[0][0]
    pictures, projection = CameraPictures(scene, scene.camera(), samples=4), sight.project(q)
    image, T_c_o = pictures.draw(q)[0], rs.Pose.from_quaternion(q[:3, 0], q[3:, 0]).inv()
    X = (T_c_o @ np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0.0]]))[..., None]
    plane = fit_inverse_depth(X[:, :2] / X[:, 2:], X[:, 2])[:, 0]
    assert projection.depth.min() > 0.3
    window = build_picture_plane(camera, 6)
    rows = np.empty((6, window.padded_count), dtype=np.float32)
    buffer = np.empty((2, camera.size[0] - 12), dtype=np.float32)
    arrays = window.points, window.slopes, plane, buffer, rows
    compute_luminance_rows(image, 6, CENTRAL, *arrays)
    for axis in range(6):
        twist, views = np.zeros(6), []
        for step in (2e-3, -2e-3):
            twist[axis] = step
            moved = q.copy()
            scene.tree.flow(moved, twist[:, None].copy(), 1.0)
            views.append(pictures.draw(moved)[0, 6:-6, 6:-6].ravel())
        derivative = (views[0] - views[1]) / 4e-3
        own = rows[axis, : window.pixel_count].astype(float)
        correlation = np.corrcoef(own, derivative)[0, 1]
        gain = (own @ derivative) / (derivative @ derivative)
        assert correlation > 0.999, (axis, correlation)
        assert abs(gain - 1.0) < 0.01, (axis, gain)


def test_inverse_depth_of_a_tilted_plane_is_exact():
    normal = np.array([0.2, -0.3, 1.1])
    points = np.random.default_rng(2).uniform(-0.4, 0.4, (7, 2))
    depth = 1.0 / (points @ normal[:2] + normal[2])
    found = fit_inverse_depth(points[..., None], depth[:, None])
    np.testing.assert_allclose(found[:, 0], normal, rtol=1e-12)
    line = np.array([[0.0, 0], [0.1, 0.1], [0.2, 0.2]])[..., None]
    flat = fit_inverse_depth(line, np.array([[1.0], [0.5], [0.25]]))
    np.testing.assert_allclose(flat[:, 0], [0, 0, 7 / 3])


def test_a_warped_picture_is_the_picture_of_the_moved_camera():
    scene = make_scene(paint(octaves=(4, 8)))
    q = place_camera(0.02, 0.01, 1.0, 5, 3, 4)
    T = rs.Pose.at(0.01, -0.02, 0.03, rotvec=(0.02, -0.01, 0.05))
    X = rs.Pose.from_quaternion(q[:3], q[3:]).inv() @ scene.object("wall").marks
    plane = fit_inverse_depth((X[:, :2] / X[:, 2:])[..., None], X[:, 2:].copy())
    picture = scene.picture(q, camera="eye")
    moved = scene.picture((rs.Pose.from_quaternion(q[:3], q[3:]) @ T.inv()).q, camera="eye")
    warped = warp_pictures(picture[None], scene.camera().camera, plane, T.matrix[:3, :, None])[0]
    inside = np.s_[20:-20, 26:-26]  # the wall; interpolation smooths its edges
    assert np.abs(warped[inside] - moved[inside]).max() < 4.0
    assert np.abs(picture[inside] - moved[inside].astype(float)).mean() > 8.0


@pytest.mark.parametrize("interaction", ["desired", "current", "mean"])
def test_the_camera_reaches_the_picture(scene, interaction):
    run = simulate(scene, make_task(interaction=interaction))
    assert outcome(run) is rs.Outcome.CONVERGED
    assert run.distance_to_goal < 5e-4 and run.angle_to_goal < 5e-4
    norms = run.error_norm.values[np.isfinite(run.error_norm.values)]
    picture, goal = (scene.picture(q, camera="eye")[4:-4, 4:-4].astype(float) for q in (NEAR, GOAL))
    assert norms[0] == pytest.approx(np.sqrt(np.mean((picture - goal) ** 2)), rel=1e-6)
    assert norms[-1] < 1.0 and norms[0] > 10.0


@pytest.mark.parametrize("field", [{"level": 1}, {"robust": True}, {"derivative": "seven_taps"}])
def test_options_of_the_luminance_reach_the_picture(scene, field):
    run = simulate(scene, make_task(**field))
    assert outcome(run) is rs.Outcome.CONVERGED and run.distance_to_goal < 2e-3


def test_an_arm_servoes_on_pictures():
    arm = rs.load_scenario(rs.examples.path("eye_in_hand"))
    plate, eye = arm.scene.object("plate"), arm.scene.camera()
    pose = plate.pose @ rs.Pose.at(0, 0, 0, rpy=(np.pi, 0, 0))
    wall = rs.Object("plate", rs.shapes.Poster(paint(), width=0.3), pose=pose, on=plate.on)
    scene = rs.Scene(arm.scene.robots, wall, replace(eye, camera=eye.camera.resized(80, 80)))
    start = scene.home + 0.02 * np.array([1, -1, 1, 0, -1, 1, 0])
    run = simulate(scene, make_task(None), start)
    assert outcome(run) is rs.Outcome.CONVERGED and run.distance_to_goal < 5e-4


def test_bits_do_not_depend_on_batch_chunk_or_threads(scene):
    task = make_task(interaction="current")
    alone = [simulate(scene, task, q) for q in STARTS]
    for settings in ({}, {"chunk": 1}, {"chunk": 2, "threads": 2}):
        batch = simulate(scene, task, STARTS, **settings)
        for i, one in enumerate(alone):
            for name in ("q", "qd", "error", "normal_factor", "picture_hash", "outcome"):
                np.testing.assert_array_equal(batch[name].values[i], one[name].values, name)


def test_a_stored_run_has_few_numbers_and_is_replayed(scene, tmp_path):
    experiment = rs.Experiment(scene, make_task(), NEAR, dt=DT, duration=16.0)
    run = experiment.run()
    assert run.sizes["feature"] + run.sizes["factor"] == 28
    rs.save_run(run, tmp_path / "run.nc")
    assert (tmp_path / "run.nc").stat().st_size < 1_000_000
    again = rs.open_run(tmp_path / "run.nc")
    report = rs.replay(again)
    np.testing.assert_array_equal(report.q.values, run.q.values)
    R = np.zeros((6, 6))
    R[np.triu_indices(6)] = run.normal_factor.values[0]
    LJ = experiment.task.task_jacobian(scene, NEAR).matrix
    np.testing.assert_allclose(LJ[:6], R, rtol=1e-6, atol=1e-9)


def test_a_photograph_is_a_goal(scene, tmp_path):
    photograph = scene.picture(GOAL, camera="eye")
    shown = simulate(scene, make_task(depth=1.0))
    goal = rs.tasks.TaughtGoal(GOAL, picture=photograph)
    run = simulate(scene, make_task(goal, depth=1.0))
    np.testing.assert_array_equal(run.q.values, shown.q.values)
    computed = simulate(scene, make_task(rs.tasks.GoalPose(rs.Pose.at(0, 0, 1)), depth=1.0))
    np.testing.assert_allclose(computed.q_end, shown.q_end, atol=1e-6)
    experiment = rs.Experiment(scene, make_task(goal), NEAR, dt=DT, duration=1.0)
    experiment.write_stored_data(tmp_path)
    (tmp_path / "photograph.toml").write_text(experiment.to_toml(folder=tmp_path))
    assert rs.load_scenario(tmp_path / "photograph.toml") == experiment


def test_the_controller_computes_the_velocities_of_the_run_from_pictures(scene):
    experiment = rs.Experiment(scene, make_task(), NEAR, dt=DT, duration=1.0)
    run, controller = experiment.run(), rs.Controller(experiment)
    for k in range(10):
        grey = scene.picture(run.q.values[k], camera="eye")
        frame = grey if k % 2 else np.repeat(grey[..., None], 3, axis=2)
        command = controller.step(None, run.q.values[k], DT * k, images={"eye": frame})
        np.testing.assert_array_equal(command.velocities, run.qd.values[k])
        assert command.phase == "moving" and command.health.age == 0.0
    late = controller.step(None, run.q.values[10], DT * 10)
    assert late.health.age == pytest.approx(DT)
    wrong = controller.step(None, run.q.values[11], DT * 11, images={"eye": grey[:, 1:]})
    assert "expected uint8 of shape (60, 80)" in wrong.health.fault


def test_a_controller_waits_for_its_first_picture(scene):
    controller = rs.Controller(rs.Experiment(scene, make_task(), NEAR, dt=DT, duration=1.0))
    assert controller.step(None, NEAR, 0.0).phase == "waiting"


@pytest.mark.parametrize(
    ("images", "words"),
    [
        ({"ey": np.zeros((60, 80), np.uint8)}, "did you mean 'eye'"),
        ({"eye": np.zeros((60, 80))}, "got float64 of shape"),
        ({"eye": np.zeros((80, 60), np.uint8)}, r"got uint8 of shape \(80, 60\)"),
        (np.zeros((60, 80), np.uint8), "expected a dict"),
    ],
)
def test_wrong_pictures_at_the_controller_are_refused(scene, images, words):
    controller = rs.Controller(rs.Experiment(scene, make_task(), NEAR, dt=DT, duration=1.0))
    with pytest.raises(rs.errors.InputError, match=words):
        controller.step(None, NEAR, 0.0, images=images)


def test_colours_become_grey_by_their_luminance():
    colours = np.array([[[255, 0, 0], [0, 255, 0], [0, 0, 255]]], np.uint8)
    assert read_frame(colours, "frame", (3, 1)).tolist() == [[76, 150, 29]]


@pytest.mark.full
def test_a_camera_that_loses_the_wall_has_nothing_in_view(scene):
    away = simulate(scene, make_task(), np.asarray(rs.Pose.at(0, 0, 1).q))
    assert outcome(away) is rs.Outcome.NOTHING_IN_VIEW and away.end_time == 0.0
    task = make_task(damping=0.0, level=0)
    lost = simulate(scene, task, place_camera(0.1, 0.1, 1.3, 10, -15, 40))
    assert outcome(lost) is rs.Outcome.NOTHING_IN_VIEW and lost.end_time > 0.0
    text = str(rs.explain(lost))
    assert "The start is outside the basin of the difference of pictures" in text


def test_a_picture_without_gradient_ends_the_run(scene):
    """One straight edge determines two motions, and the picture of the goal all six."""
    halves = np.zeros((40, 40), np.uint8)
    halves[:, 20:] = 200
    edge = make_scene(halves, width=4.0)
    goal = rs.tasks.TaughtGoal(GOAL, picture=scene.picture(GOAL, camera="eye"))
    run = simulate(edge, make_task(goal, interaction="current"))
    assert outcome(run) is rs.Outcome.NO_GRADIENT and run.end_time == 0.0


@pytest.mark.parametrize(
    ("goal", "words"),
    [
        (rs.tasks.TaughtGoal(GOAL, picture=np.full((60, 80), 9, np.uint8)), "is constant"),
        (rs.tasks.TaughtGoal(GOAL, picture=np.zeros((60, 81), np.uint8)), "81 x 60 pixels"),
        (rs.tasks.GoalFeatures(np.zeros(7)), "no image|needs a picture"),
    ],
)
def test_impossible_goals_are_refused(scene, goal, words):
    with pytest.raises(rs.RobSimError, match=words):
        simulate(scene, make_task(goal))


def test_a_camera_without_size_and_a_border_without_pixels_are_refused(scene):
    eye = scene.camera()
    blind = scene.replacing(replace(eye, camera=replace(eye.camera, size=None)))
    with pytest.raises(rs.errors.InputError, match="size"):
        simulate(blind, make_task())
    feature = rs.features.Luminance(border=29)
    with pytest.raises(rs.errors.InputError, match="too few pixels inside a border of 29"):
        simulate(scene, rs.IBVS(GOAL, features=feature))
    with pytest.raises(rs.errors.InputError, match="a filter follows marks"):
        simulate(scene, make_task(depth=rs.laws.DepthFilter(start=1.0)))
    with pytest.raises(rs.errors.InputError, match="takes 'current', 'desired' or 'mean'"):
        simulate(scene, make_task(interaction=np.ones((7, 6))))


@pytest.mark.parametrize(
    ("fields", "words"),
    [
        ({"interaction": "broyden"}, "Luminance takes 'current', 'desired' or 'mean'"),
        ({"weighting": "tukey"}, "weighting: it weighs marks"),
        ({"detector": "dots"}, "detector: it detects marks"),
        ({"marks": [0]}, "marks: Luminance uses the whole picture"),
        ({"components": [0, 1]}, "components: the numbers of Luminance act together"),
    ],
)
def test_fields_for_marks_are_refused(scene, fields, words):
    of_block = {key: value for key, value in fields.items() if key in ("marks", "components")}
    part = rs.features.FeatureBlock(rs.features.Luminance(border=4), **of_block)
    of_task = {key: value for key, value in fields.items() if key not in of_block}
    with pytest.raises(rs.errors.InputError, match=words):
        simulate(scene, rs.IBVS(GOAL, features=part, **of_task))


def mean_greys(pictures, goal_pictures):
    """Return the means of 20 blocks of the pictures."""
    B, h, w = pictures.shape
    return pictures.reshape(B, 4, h // 4, 5, w // 5).mean(axis=(2, 4)).reshape(B, 20)


@pytest.mark.full
def test_an_own_function_of_pictures_servoes_with_an_estimated_interaction(scene):
    feature = rs.features.PictureFunction(mean_greys, "grey", 0.5)
    run = simulate(scene, rs.IBVS(GOAL, features=feature, gain=2.0), NEAR)
    assert outcome(run) is rs.Outcome.CONVERGED and run.distance_to_goal < 5e-3


def test_estimated_interaction_of_an_own_function_matches_rendered_pictures(scene):
    feature = rs.features.PictureFunction(mean_greys, "grey", 0.5)
    LJ = rs.IBVS(GOAL, features=feature).task_jacobian(scene, NEAR).matrix
    pictures = CameraPictures(scene, scene.camera())
    for axis in range(6):
        twist, means = np.zeros((6, 1)), []
        for step in (2e-3, -2e-3):
            twist[axis] = step
            q = NEAR[:, None].copy()
            scene.tree.flow(q, twist, 1.0)
            means.append(mean_greys(pictures.draw(q), None)[0])
        expected = (means[0] - means[1]) / 4e-3
        assert np.corrcoef(LJ[:, axis], expected)[0, 1] > 0.99


def test_an_own_law_of_pictures_commands_its_twist(scene):
    twist = np.array([0.01, 0.02, 0.03, 0.1, 0.0, -0.1])

    def steer(pictures, goal_pictures):
        assert pictures.shape == goal_pictures.shape
        return np.tile(twist, (len(pictures), 1))

    feature = rs.features.PictureTwist(steer)
    run = simulate(scene, rs.IBVS(GOAL, features=feature, gain=1.0), STARTS, duration=0.2)
    np.testing.assert_allclose(run.qd.values[:, :5], np.broadcast_to(twist, (3, 5, 6)), atol=1e-15)


def test_wrong_results_of_own_functions_are_refused(scene):
    def bad(pictures, goal_pictures):
        return np.full((len(pictures), 6), np.nan)

    run = simulate(scene, rs.IBVS(GOAL, features=rs.features.PictureTwist(bad)), duration=0.2)
    assert outcome(run) is rs.Outcome.NOT_FINITE
    short = rs.features.PictureFunction(mean_greys, interaction_function=lambda p, g: np.ones(3))
    with pytest.raises(rs.errors.InputError, match=r"shape \(3,\) where"):
        simulate(scene, rs.IBVS(GOAL, features=short))
    with pytest.raises(rs.errors.InputError, match="expected a function"):
        rs.features.PictureTwist(3)


def test_robust_pixels_ignore_an_object_before_the_wall(scene):
    hand = rs.Object("hand", rs.Block(0.12, 0.12, 0.02, color="w"), pose=rs.Pose.at(0.1, 0, -0.1))
    wall = scene.object("wall")
    hidden = rs.Scene(scene.robots, (wall, hand), scene.cameras, light=scene.light)
    goal = rs.tasks.TaughtGoal(GOAL, picture=scene.picture(GOAL, camera="eye"))
    ends = {}
    for robust in (False, True):
        task = replace(make_task(goal, robust=robust), target="wall")
        run = simulate(hidden, task, place_camera(0.01, 0, 1.02, 1, -1, 2), duration=8.0)
        ends[robust] = float(run.distance_to_goal)
    assert ends[True] < 0.2 * ends[False] and ends[True] < 2e-3


def test_explain_names_the_exposure_of_another_picture(scene):
    photograph = scene.picture(GOAL, camera="eye")
    eye = replace(scene.camera(), optics=rs.vision.Optics(gain=0.5))
    goal = rs.tasks.TaughtGoal(GOAL, picture=photograph)
    run = rs.Experiment(scene.replacing(eye), make_task(goal), NEAR, dt=DT, duration=2.0).run()
    text = str(rs.explain(run, trials=False))
    assert "differs by 0 grey without the gain (gain = 0.5)" in text


@pytest.mark.full
def test_advise_finds_the_largest_gain_of_a_loop_with_pictures(scene):
    experiment = rs.Experiment(scene, make_task(), NEAR, dt=DT, duration=4.0)
    advice = rs.advise(experiment)
    assert 25.0 < advice.largest_gain < 2.0 / DT + 1.0
    stable = experiment.at("task.gain", 0.8 * advice.largest_gain).run()
    unstable = experiment.at("task.gain", 1.6 * advice.largest_gain).run()
    assert outcome(stable) is rs.Outcome.CONVERGED
    assert outcome(unstable) is not rs.Outcome.CONVERGED


def test_pictures_that_arrive_late_or_rarely_still_lead_to_the_goal(scene):
    sensing = rs.Sensing(latency=2 * DT, period=2 * DT)
    run = simulate(scene, make_task(gain=2.0), sensing=sensing, duration=10.0)
    assert outcome(run) is rs.Outcome.CONVERGED and run.distance_to_goal < 1e-3
    errors = run.error.values[:20]
    same = (errors[1::2] == errors[0::2][: len(errors[1::2])]).all(axis=1)
    assert same.mean() > 0.8  # between pictures the error keeps its value


def test_the_check_of_features_of_marks_refuses_pictures():
    with pytest.raises(rs.errors.InputError, match="Luminance uses pictures"):
        check_feature(rs.features.Luminance())


def test_difference_interaction_needs_no_picture_of_marks(scene):
    seen = Observation.of([[0.1, 0.2]], [1.0], make_camera())
    L = difference_interaction(rs.features.Points(), seen)
    np.testing.assert_allclose(L, rs.features.Points().interaction(seen), atol=1e-8)
