"""The fisheye lens in every place that a lens touches: pixels, texts, beliefs, runs, messages."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import robsim as rs
from robsim.analysis.linearisation.perturbations import generate_perturbations
from robsim.calibration.calibration_model import lens_rates
from robsim.kernels.formulas import fisheye as kernels
from robsim.plot.camera_frustum import compute_corner_rays, list_border_corners
from robsim.servo.camera_target import make_camera_target
from robsim.vision.pixel_measurement import pixel_rate_matrices

HERE = rs.Pose.at()
K = np.array([[300.0, 1.5, 320.0], [0.0, 295.0, 240.0], [0.0, 0.0, 1.0]])
LENSES = [(), (-0.008, 0.045, -0.043, 0.008), (0.05, -0.02, 0.004, -0.0005), (-0.2, 0.02, -0.01, 0)]
FOLDING = LENSES[3]


def make(lens=LENSES[1], size=(640, 480)):
    return rs.Camera(K, size, distortion=lens, lens="fisheye")


def ray(theta, around=0.0, length=1.0):
    """A point at the angle theta to the optical axis."""
    direction = [np.sin(theta) * np.cos(around), np.sin(theta) * np.sin(around), np.cos(theta)]
    return length * np.array(direction)


# pixels


@pytest.mark.parametrize("lens", LENSES)
def test_the_distance_in_the_image_is_the_polynomial_of_the_angle(lens):
    camera = rs.Camera(np.eye(3), distortion=lens, lens="fisheye")
    k = np.array([1, *(lens or (0,) * 4)])
    for theta in (0.0, 1e-5, 0.3, 0.9, 1.2):
        distance = k @ theta ** np.array([1, 3, 5, 7, 9])
        pixel = camera.project([ray(theta, 0.7, 3.0)], HERE)
        expected = distance * np.array([np.cos(0.7), np.sin(0.7)])
        np.testing.assert_allclose(pixel, [expected], rtol=0, atol=1e-15)


def test_an_equidistant_lens_has_equal_distances_for_equal_angles():
    angles = np.radians(np.arange(0, 90, 10))
    columns = make(()).project([ray(a) for a in angles], HERE)[:, 0]
    np.testing.assert_allclose(np.diff(columns), 300 * np.radians(10), rtol=1e-13)


@settings(derandomize=True, max_examples=50, deadline=None)
@given(
    lens=st.sampled_from(LENSES),
    share=st.floats(0, 0.98),
    around=st.floats(-np.pi, np.pi),
    length=st.floats(1e-3, 1e3),
)
def test_normalise_undoes_the_lens(lens, share, around, length):
    camera = make(lens)
    theta = share * min(np.arctan(camera.valid_radius), np.radians(89.9))
    point = ray(theta, around, length)
    x = point[:2] / point[2]
    (found,) = camera.normalise(camera.project([point], HERE))
    assert np.abs(found - x).max() <= 1e-12 * (1 + x @ x)


def test_pixels_beyond_the_lens_are_images_of_no_point():
    """Beyond the image of 90 degrees, or beyond the fold."""
    end = 300 * np.pi / 2
    inside, beyond = make(()).normalise([[320 + 0.999 * end, 240], [320 + 1.001 * end, 240]])
    assert inside[0] > 500 and np.isnan(beyond).all()
    fold = np.arctan(make(FOLDING).valid_radius)
    largest = 300 * kernels.fisheye_distance(fold, FOLDING)
    pixels = [[320 + 0.9999 * largest, 240], [320 + 1.0001 * largest, 240]]
    assert np.isfinite(make(FOLDING).normalise(pixels)).all(axis=1).tolist() == [True, False]


def test_visibility_ends_at_90_degrees_and_at_the_fold():
    camera = make((), size=None)
    points = [ray(np.radians(a)) for a in (0, 89, 89.99, 90.01, 120, 180)]
    assert camera.visibility(points, HERE).tolist() == [0, 0, 0, 2, 2, 2]
    assert np.isnan(camera.project(points, HERE)).all(axis=1).tolist() == [False] * 3 + [True] * 3
    fold = np.arctan(make(FOLDING).valid_radius)
    points = [ray(0.999 * fold), ray(1.001 * fold)]
    assert make(FOLDING, None).visibility(points, HERE).tolist() == [0, 1]
    assert make(()).visibility([ray(1.0), ray(1.1)], HERE).tolist() == [0, 1]  # the right border


@pytest.mark.parametrize("lens", LENSES)
def test_derivatives_are_met_by_differences_of_second_order(lens):
    """By the point, and by the intrinsics and coefficients."""
    camera, x, steps = make(lens, None), np.array([[0.9, -0.5], [0.02, 0.03]]), (2e-2, 1e-2)
    pixels = camera.project(np.c_[x, [1, 1]], HERE)
    J = np.concatenate([pixel_rate_matrices(x, camera), lens_rates(x, pixels, camera, 4)], axis=-1)

    def predict(axis, h):
        if axis < 2:
            return camera.project(np.c_[x + h * np.eye(2)[axis], [1, 1]], HERE)
        matrix, bends = np.array(camera.K), np.array(camera.distortion)
        if axis < 6:
            matrix[[(0, 0), (1, 1), (0, 2), (1, 2)][axis - 2]] += h
        else:
            bends[axis - 6] += h
        other = rs.Camera(matrix, distortion=bends, lens="fisheye")
        return other.project(np.c_[x, [1, 1]], HERE)

    for axis in range(J.shape[-1]):
        errors = [
            np.abs((predict(axis, h) - predict(axis, -h)) / (2 * h) - J[..., axis]).max()
            for h in steps
        ]
        if axis < 2:
            assert errors[0] / errors[1] == pytest.approx(4, rel=0.1)
        else:
            assert max(errors) < 1e-9  # pixels are linear in the other numbers


def test_at_the_centre_the_lens_does_nothing():
    [J] = pixel_rate_matrices(np.zeros((1, 2)), make())
    np.testing.assert_array_equal(J, K[:2, :2])
    np.testing.assert_array_equal(make().project([[0, 0, 2]], HERE), [[320, 240]])
    np.testing.assert_array_equal(make().normalise([[320, 240]]), [[0, 0]])


def test_points_at_the_ends_of_the_numbers_are_seen_at_the_centre_or_outside():
    points = [[1e-200, 0, 1], [5e-324, 0, 1], [1e140, 0, 1], [1e200, 0, 1], [1e300, 1e300, 1e-8]]
    assert make(()).visibility(points, HERE).tolist() == [0, 0, 1, 1, 1]
    pixels = make(()).project(points, HERE)
    np.testing.assert_array_equal(pixels[:2], [[320, 240]] * 2)
    np.testing.assert_allclose(pixels[2], [320 + 150 * np.pi, 240], rtol=1e-15)
    centre = make().normalise([[320 + 1e-12, 240], [320, 240]])
    np.testing.assert_allclose(centre, [[1e-12 / 300, 0], [0, 0]], rtol=0, atol=1e-16)


def test_a_batch_is_a_loop():
    points = np.random.default_rng(1).uniform([-2, -2, -0.5], [2, 2, 1], (200, 3, 3))
    whole, status = make().project(points, HERE), make().visibility(points, HERE)
    assert set(np.unique(status)) == {0, 1, 2}
    for i in (0, 17, 199):
        np.testing.assert_array_equal(whole[i], make().project(points[i], HERE))


def test_a_resized_and_cropped_camera_has_the_same_lens():
    small = make().resized(320, 240)
    part = make().cropped(10, 20, 300, 200)
    assert small.lens == part.lens == "fisheye" and small.distortion == make().distortion
    points = [ray(0.6, 1.0), ray(1.1, 2.0)]
    expected = (make().project(points, HERE) + 0.5) / 2 - 0.5
    np.testing.assert_allclose(small.project(points, HERE), expected, rtol=0, atol=1e-12)


def test_a_fisheye_is_another_value_with_four_coefficients():
    assert make(()).distortion == (0, 0, 0, 0) and make(()) == make((0, 0, 0, 0))
    assert make() != rs.Camera(K, (640, 480), distortion=LENSES[1])
    assert make().revised(lens="perspective") == rs.Camera(K, (640, 480), distortion=LENSES[1])
    for shape in ((1, 4), (4, 1)):
        assert make(np.reshape(LENSES[1], shape)) == make()
    assert "lens='fisheye'" in repr(make())


# runs


def fly(camera, belief=None, distance=1.4, duration=4.0, **options):
    """A free camera that approaches a plate to some distance; at 0.8 m marks are 58 degrees off."""
    robot = rs.robots.free_camera()
    marks = [[-1, -0.8, 0], [1, -0.8, 0.1], [1, 0.8, 0], [-1, 0.8, 0.2]]
    scene = rs.Scene(
        robot,
        rs.Object("plate", marks=marks),
        rs.MountedCamera("eye", camera, on=f"{robot.name}.body"),
    )
    goal, start = (
        rs.GoalPose(rs.Pose.at(0, 0, distance)),
        rs.Pose.at(0.1, -0.1, -1.7, rpy=(0.1, 0, 0.2)),
    )
    options = {"features": "points", **options}
    task = rs.IBVS(goal, belief=belief(scene) if belief else None, **options)
    return rs.Experiment(scene, task, start.q, duration=duration)


@pytest.mark.parametrize("features", ["points", "pixels", "polar"])
def test_a_controller_that_knows_the_lens_converges_as_with_a_pinhole(features):
    """Features are of undistorted points: the joints move as if the lens were perspective."""
    options = {"features": features, "distance": 0.8, "duration": 16.0}
    one, two = (fly(camera, **options) for camera in (make(size=None), rs.Camera(K)))
    runs = [one.run(), two.run()]
    for run in runs:
        assert run.outcome == rs.Outcome.CONVERGED
    np.testing.assert_allclose(runs[0].q, runs[1].q, rtol=0, atol=1e-9)
    assert np.abs(runs[0].pixels - runs[1].pixels).max() > 100


def test_a_belief_in_another_lens_shifts_the_goal_by_value():
    """With a goal of points the camera stops where the believed points are those of the goal."""
    camera = make(size=None)

    def wrong(scene):
        return scene.believe(distortion=(0.03, 0, 0, 0), lens="perspective")

    run = fly(camera, wrong).run()
    believed = rs.Camera(K, distortion=(0.03, 0, 0, 0))
    s = believed.normalise(run.pixels.values[-1])
    np.testing.assert_allclose(s.ravel(), run.s.values[-1], rtol=0, atol=1e-12)
    assert not np.allclose(camera.normalise(run.pixels.values[-1]).ravel(), run.s[-1], atol=0.1)


def test_a_run_is_replayed_from_its_text():
    run = fly(make(), lambda scene: scene.believe(distortion=(0.1, 0, 0, 0))).run()
    assert 'lens = "fisheye"' in run.attrs["scenario"]
    assert rs.replay(run).identical(run)


def test_coefficients_vary_from_run_to_run_with_the_bits_of_single_runs():
    case, key = fly(make()), "cameras.eye.distortion"
    values = np.array([LENSES[1], LENSES[2], (0.0, 0.0, 0.0, 0.0), FOLDING])
    rows = case.vary({key: values}).run()
    for i, lens in enumerate(values):
        single = case.at(key, lens.tolist()).run()
        for name in ("q_end", "s_goal"):
            np.testing.assert_array_equal(rows[name].values[i], single[name].values)
        last = single.sizes["time"]
        np.testing.assert_array_equal(rows.pixels.values[i, :last], single.pixels.values)


def test_the_text_and_the_toml_give_the_camera_again(tmp_path):
    case = fly(make(), lambda scene: scene.believe(lens="perspective", distortion=()))
    assert rs.Experiment.from_text(case.run().attrs["scenario"]) == case
    text = case.to_toml()
    assert text.count('lens = "fisheye"') == 1
    (tmp_path / "case.toml").write_text(text)
    again = rs.load_scenario(tmp_path / "case.toml")
    assert again.scene.camera().camera == make()
    assert again.task.belief.camera().camera == rs.Camera(K, (640, 480))
    changed = rs.load_scenario(tmp_path / "case.toml", ["cameras.eye.distortion=[0.1, 0, 0, 0]"])
    assert changed.scene.camera().camera == make((0.1, 0, 0, 0))
    (tmp_path / "own.toml").write_text(
        fly(make()).to_toml()
        + '[[belief.cameras]]\nname = "eye"\nlens = "perspective"\ndistortion = [0.1, 0, 0, 0, 0]\n'
    )
    believed = rs.load_scenario(tmp_path / "own.toml").task.belief.camera().camera
    assert believed == rs.Camera(K, (640, 480), distortion=(0.1, 0, 0, 0, 0))
    plain = case.at("cameras.eye.lens", "perspective")
    assert plain.scene.camera().camera == rs.Camera(K, (640, 480), distortion=LENSES[1])


def test_a_perspective_lens_is_not_named_in_a_file():
    assert "lens" not in fly(rs.Camera(K)).to_toml()


def test_the_studio_has_a_control_of_the_model():
    case = fly(make(), lambda scene: scene.believe(lens="perspective", distortion=()))
    controls = {each.path: each for each in case.controls()}
    for path, value in (
        ("cameras.eye.lens", "fisheye"),
        ("belief.cameras.eye.lens", "perspective"),
    ):
        control = controls[path]
        assert control.form == "choice" and control.value == value
        assert tuple(control.options) == ("perspective", "fisheye")


def test_the_wrong_model_is_explained():
    explanation = rs.explain(
        fly(make(), lambda s: s.believe(lens="perspective", distortion=())).run()
    )
    (cause,) = [each for each in explanation.causes if each.about == "intrinsics"]
    words = (
        "intrinsics of 'eye' are wrong: lens perspective, true fisheye; distortion none, true "
        "(-0.008, 0.045, -0.043, 0.008)"
    )
    assert words in cause.sentence


def test_the_unit_error_of_advice_is_of_the_first_coefficient():
    case = fly(make())
    sights = [make_camera_target(case.scene, "eye", "plate")]
    each = {p.name: p for p in generate_perturbations(case.task, case.scene, sights)}
    wrong = each["cameras.eye.distortion.k1"].apply(case.task, case.scene).belief.camera().camera
    assert wrong == make((0.012, *LENSES[1][1:]))


# beliefs


def test_a_belief_keeps_the_model_unless_another_is_given():
    scene = fly(make()).scene
    longer = scene.believe(center=(1, 2)).camera().camera
    assert longer == make().revised(center=(321, 242))
    other = scene.believe(lens="perspective", distortion=(0.1, 0, 0, 0)).camera().camera
    assert other == rs.Camera(K, (640, 480), distortion=(0.1, 0, 0, 0))
    bare = fly(make(())).scene
    assert bare.believe(lens="perspective").camera().camera.lens == "perspective"
    with pytest.raises(rs.errors.InputError, match="coefficients of a fisheye lens are not those"):
        scene.believe(lens="perspective")
    for odd in (3, np.zeros(2), "equidistant", float("nan")):
        with pytest.raises(rs.errors.InputError, match="lens: "):
            scene.believe(lens=odd)
        with pytest.raises(rs.errors.InputError, match="lens: "):
            rs.calibration.calibrate_lens(np.eye(3), np.zeros((3, 3, 2)), (4, 4), lens=odd)


# pictures


def test_a_wide_field_of_view_is_drawn_within_72_degrees():
    """The corners of this image are beyond 90 degrees, and have no points."""
    wide = rs.Camera([[200, 0, 319.5], [0, 200, 239.5], [0, 0, 1]], (640, 480), lens="fisheye")
    assert np.isnan(wide.normalise([[0, 0]])).all()
    rays = compute_corner_rays(wide)
    expected = 3 * np.array([[-0.8, -0.6], [0.8, -0.6], [0.8, 0.6], [-0.8, 0.6]])
    np.testing.assert_allclose(rays, np.c_[expected, np.ones(4)], rtol=0, atol=1e-12)
    narrow = make().cropped(160, 120, 320, 240)
    corners = narrow.normalise(list_border_corners(narrow))
    assert np.linalg.norm(corners, axis=1).max() < 3
    np.testing.assert_array_equal(compute_corner_rays(narrow)[:, :2], corners)


# calibrations


def test_a_hand_eye_calibration_finds_the_coefficients():
    bench = rs.load_scenario(rs.examples.path("calibration_bench"))
    true = [0.02, -0.01, 0.004, -0.001]
    case = bench.at({"sensing.noise": 0.0, "belief": None, "cameras.camera.lens": "fisheye"})
    case = case.at("cameras.camera.distortion", true)
    wrong = case.at({"belief.cameras.camera.distortion": [0.0] * 4})
    look = rs.starts.LookAt("board", distance=(0.3, 0.8), cone=0.8, aside=0.1)
    q = rs.calibration.sample_viewpoints(case, 8, look, seed=3)
    found = rs.calibrate(rs.calibration.simulate_views(wrong, q), ["focal", "distortion"])
    assert list(found.names)[-4:] == ["k1", "k2", "k3", "k4"]
    np.testing.assert_allclose(found.camera.distortion, true, rtol=0, atol=1e-7)
    text = found.to_toml()
    assert 'lens = "fisheye"' in text
    with pytest.raises(
        rs.errors.InputError, match="its lens is perspective, and a lens that is fi"
    ):
        found.cost(bench)


def test_a_lens_alone_is_found_without_opencv():
    """Of two marks fewer in one view, and of a field of view that is not known."""
    marks = np.array([[x, y, 0.0] for x in range(5) for y in range(4)]) / 20
    rng = np.random.default_rng(8)
    turns, places = rng.uniform(-0.6, 0.6, (9, 3)), rng.uniform(-0.15, 0.0, (2, 9))
    poses = rs.Pose.at(*places, rng.uniform(0.12, 0.2, 9), rotvec=turns)
    straight = np.array([[300.0, 0, 320], [0, 295, 240], [0, 0, 1]])
    camera = make().revised(K=straight)
    pixels = camera.project(marks, poses.inv())
    assert np.isfinite(pixels).all()
    pixels[2, :2] = np.nan
    found = rs.calibration.calibrate_lens(marks, pixels, (640, 480), lens="fisheye")
    assert found.camera.lens == "fisheye" and found.rms < 1e-6
    np.testing.assert_allclose(found.camera.K, straight, rtol=0, atol=1e-5)
    np.testing.assert_allclose(found.camera.distortion, camera.distortion, rtol=0, atol=1e-6)
    level = rs.Pose.at(*places, rng.uniform(0.12, 0.2, 9))
    pixels = camera.project(marks, level.inv())
    with pytest.raises(rs.errors.InputError, match="the planes of all 9 are parallel within 5"):
        rs.calibration.calibrate_lens(marks, pixels, (640, 480), lens="fisheye")
