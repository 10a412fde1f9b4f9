"""Image points as features: L is the derivative of s, and scales and turns as it must."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import robsim as rs

steady = settings(derandomize=True, max_examples=40, deadline=None)
seeds = st.integers(0, 2**32)

K = np.array([[800.0, 12.0, 320.0], [0.0, 760.0, 240.0], [0.0, 0.0, 1.0]])
PINHOLE = rs.Camera(K)
BENT = rs.Camera(K, distortion=(-0.2, 0.05, 1e-3, -5e-4))
FEATURES = pytest.mark.parametrize(
    "feature", [rs.features.Points(), rs.features.PixelPoints()], ids=lambda f: type(f).__name__
)
HERE = rs.Pose.at(0.3, -0.2, 0.1, rpy=(0.2, -0.1, 0.4))


def close(a, b, tolerance):
    np.testing.assert_allclose(a, b, rtol=0, atol=tolerance)


def scattered(seed=0, marks=4, runs=3):
    """(runs, marks, 3) points in camera axes, between one and two metres away."""
    rng = np.random.default_rng(seed)
    return rng.uniform([-0.5, -0.5, 1.0], [0.5, 0.5, 2.0], (runs, marks, 3))


def observed(camera, points, T_w_c):
    """The image of world points (runs, marks, 3) in the camera at T_w_c: through the projection."""
    pixels = camera.project(points, T_w_c)
    depth = (rs.Pose(T_w_c).inv() @ points)[..., 2]
    return rs.features.Observation.of(pixels, depth, camera)


def seen_from_here(camera, X):
    return observed(camera, HERE @ X, HERE)


# L is the derivative of s


@FEATURES
@pytest.mark.parametrize("camera", [PINHOLE, BENT], ids=["skew", "skew_and_lens"])
def test_the_interaction_matrix_is_a_derivative_of_second_order(feature, camera):
    """Central differences through the real projection miss by the square of the step."""
    X = scattered()
    points, L = HERE @ X, feature.interaction(seen_from_here(camera, X))
    steps, scale = np.array([2e-2, 1e-2, 5e-3]), np.abs(L).max()
    for axis, along in enumerate(np.eye(6)):
        errors = []
        for h in steps:
            ahead, behind = (
                feature.measure(observed(camera, points, HERE @ rs.Pose.exp(d * along)))
                for d in (h, -h)
            )
            errors.append(np.abs((ahead - behind) / (2 * h) - L[..., axis]).max() / scale)
        if axis in (0, 1):  # a sideways motion moves the image by as much
            assert errors[0] < 1e-11
        else:
            assert (np.diff(np.log(errors)) / np.diff(np.log(steps)) >= 1.8).all()
            assert errors[0] < 1e-2


def chapter_equation_14(x, y, Z, f):
    """L_p of a point (x, y) = f (X, Y) / Z, in the unit of length of f."""
    return np.array(
        [
            [-f / Z, 0, x / Z, x * y / f, -(f**2 + x**2) / f, y],
            [0, -f / Z, y / Z, (f**2 + y**2) / f, -x * y / f, -x],
        ]
    )


@pytest.mark.parametrize("f", [1.0, 0.008, 0.8])
def test_the_interaction_matrix_is_equation_14_of_the_chapter(f):
    """On the image plane x = f X / Z (eq. 9), so its L is f times the L of X / Z.

    Eq. (14) is right although eq. (11), its origin, lost its f.
    """
    X = scattered(marks=1)
    L = rs.features.Points().interaction(seen_from_here(PINHOLE, X))
    for run in range(3):
        x, y, Z = X[run, 0]
        close(f * L[run], chapter_equation_14(f * x / Z, f * y / Z, Z, f), 1e-13)


def test_pixels_have_equation_14_with_the_focal_length_in_pixels():
    square = rs.Camera([[800, 0, 320], [0, 800, 240], [0, 0, 1]])
    X = scattered(marks=1)
    L = rs.features.PixelPoints().interaction(seen_from_here(square, X))
    for run in range(3):
        x, y, Z = X[run, 0]
        close(L[run], chapter_equation_14(800 * x / Z, 800 * y / Z, Z, 800), 1e-9)


@pytest.mark.parametrize(
    ("twist", "rate"),
    [
        ([1, 0, 0, 0, 0, 0], [-0.5, 0]),  # the camera goes right, the image left
        ([0, 1, 0, 0, 0, 0], [0, -0.5]),
        ([0, 0, 1, 0, 0, 0], [0.05, 0.1]),  # it comes nearer, the image spreads
        ([0, 0, 0, 0, 0, 1], [0.2, -0.1]),  # it turns clockwise, the image anticlockwise
    ],
)
def test_signs_agree_with_a_camera_that_moves(twist, rate):
    seen = seen_from_here(PINHOLE, np.array([[[0.2, 0.4, 2.0]]]))  # (0.1, 0.2) at unit depth
    close(rs.features.Points().interaction(seen)[0] @ twist, rate, 1e-14)


# scales and symmetries


@FEATURES
@steady
@given(seed=seeds, k=st.floats(0.1, 10))
def test_a_scaled_depth_divides_the_translational_columns_only(feature, seed, k):
    X = scattered(seed)
    L, far = (feature.interaction(seen_from_here(PINHOLE, s * X)) for s in (1.0, k))
    scale = np.abs(L).max() * max(1, 1 / k)
    close(far[..., :3], L[..., :3] / k, 1e-13 * scale)
    close(far[..., 3:], L[..., 3:], 1e-13 * scale)


@FEATURES
@steady
@given(seed=seeds, order=st.permutations(range(4)))
def test_the_order_of_the_marks_is_the_order_of_the_rows(feature, seed, order):
    X = scattered(seed)
    seen, other = (seen_from_here(BENT, Y) for Y in (X, X[:, order]))
    rows = np.ravel([[2 * n, 2 * n + 1] for n in order])
    np.testing.assert_array_equal(feature.measure(other), feature.measure(seen)[:, rows])
    np.testing.assert_array_equal(feature.interaction(other), feature.interaction(seen)[:, rows])


@FEATURES
@steady
@given(seed=seeds)
def test_moving_the_whole_world_changes_nothing(feature, seed):
    X, away = scattered(seed), rs.Pose.exp(np.random.default_rng(seed).normal(size=6))
    here, there = seen_from_here(BENT, X), observed(BENT, away @ HERE @ X, away @ HERE)
    np.testing.assert_allclose(feature.measure(there), feature.measure(here), 1e-12, 1e-12)
    np.testing.assert_allclose(feature.interaction(there), feature.interaction(here), 1e-11, 1e-11)


@steady
@given(seed=seeds)
def test_turning_the_camera_about_its_axis_turns_points_and_columns_alike(seed):
    """Quarter turn: x' = y, y' = -x, and the twist written in the turned axes."""
    X, quarter = scattered(seed), rs.Pose.at(rpy=(0, 0, np.pi / 2))
    Q, zero = quarter.rotation, np.zeros((3, 3))
    L, turned = (
        rs.features.Points().interaction(observed(PINHOLE, HERE @ X, T))
        for T in (HERE, HERE @ quarter)
    )
    image = np.kron(np.eye(4), Q[:2, :2].T)
    close(turned, image @ L @ np.block([[Q, zero], [zero, Q]]), 1e-12)


@steady
@given(seed=seeds)
def test_a_rotation_of_the_camera_moves_the_image_the_same_at_any_depth(seed):
    X = scattered(seed)
    near, far = (seen_from_here(PINHOLE, Y) for Y in (X, 7 * X))
    close(
        rs.features.Points().interaction(near)[..., 3:],
        rs.features.Points().interaction(far)[..., 3:],
        1e-13,
    )


# pixels and normalised points


@steady
@given(seed=seeds)
def test_one_twist_moves_pixels_and_normalised_points_consistently(seed):
    """The rate of a pixel is K times the rate of its point at unit depth."""
    seen = seen_from_here(PINHOLE, scattered(seed))
    twist = np.random.default_rng(seed).normal(size=6)
    points = (rs.features.Points().interaction(seen) @ twist).reshape(-1, 2)
    pixels = (rs.features.PixelPoints().interaction(seen) @ twist).reshape(-1, 2)
    np.testing.assert_allclose(pixels, points @ K[:2, :2].T, rtol=1e-12, atol=1e-10)


@pytest.mark.parametrize("camera", [PINHOLE, BENT], ids=["pinhole", "lens"])
def test_normalised_points_are_the_points_at_unit_depth(camera):
    X = scattered()
    s = rs.features.Points().measure(seen_from_here(camera, X))
    close(s.reshape(3, 4, 2), X[..., :2] / X[..., 2:], 1e-13)


def test_pixel_points_of_a_distorted_camera_are_the_pixels_without_the_lens():
    X = scattered()
    bent, straight = (seen_from_here(camera, X) for camera in (BENT, PINHOLE))
    assert np.abs(bent.pixels - straight.pixels).max() > 5  # the lens matters
    for feature in (rs.features.Points(), rs.features.PixelPoints()):
        close(feature.measure(bent), feature.measure(straight), 1e-10)
        close(feature.interaction(bent), feature.interaction(straight), 1e-9)
    close(rs.features.PixelPoints().measure(bent).reshape(3, 4, 2), straight.pixels, 1e-10)


@steady
@given(seed=seeds)
def test_pixel_points_of_a_pinhole_are_its_pixels(seed):
    seen = seen_from_here(PINHOLE, scattered(seed))
    close(rs.features.PixelPoints().measure(seen).reshape(3, 4, 2), seen.pixels, 1e-10)


# observations


def test_run_first_names_are_views_of_the_run_last_arrays():
    seen = seen_from_here(PINHOLE, scattered(runs=3, marks=5))
    assert seen.pixels.shape == seen.points.shape == (3, 5, 2)
    assert seen.depth.shape == (3, 5)
    for first, last in (
        (seen.pixels, seen.pixels_last),
        (seen.points, seen.points_last),
        (seen.depth, seen.depth_last),
    ):
        assert np.shares_memory(first, last)
        np.testing.assert_array_equal(first, np.moveaxis(last, -1, 0))


@FEATURES
def test_each_run_of_a_batch_has_the_bits_that_it_has_alone(feature):
    X = scattered(runs=7)
    camera = BENT
    pixels, depth = camera.project(HERE @ X, HERE), X[..., 2]

    def of(runs):
        seen = rs.features.Observation.of(pixels[runs], depth[runs], camera)
        return feature.measure(seen), feature.interaction(seen)

    s, L = of(slice(None))
    assert (s.shape, L.shape) == ((7, 8), (7, 8, 6))
    for b in range(7):
        alone = of(slice(b, b + 1))
        np.testing.assert_array_equal(alone[0][0], s[b])
        np.testing.assert_array_equal(alone[1][0], L[b])


def test_units_and_tolerances():
    assert (rs.features.Points().unit, rs.features.Points().tolerance) == ("1", 1e-5)
    assert (rs.features.PixelPoints().unit, rs.features.PixelPoints().tolerance) == ("px", 0.01)


# rank


@pytest.mark.parametrize(("marks", "rank"), [(1, 2), (2, 4), (3, 6), (4, 6), (8, 6)])
def test_each_mark_fixes_two_motions_up_to_all_six(marks, rank):
    L = rs.features.Points().interaction(seen_from_here(PINHOLE, scattered(1, marks, 1)))[0]
    assert np.linalg.matrix_rank(L) == rank


def test_marks_on_one_line_fix_five_motions_at_most():
    X = np.array([[[-0.3, 0.1, 1.5], [0.0, 0.2, 1.7], [0.3, 0.3, 1.9], [0.6, 0.4, 2.1]]])
    sigma = np.linalg.svd(rs.features.Points().interaction(seen_from_here(PINHOLE, X))[0])[1]
    assert sigma[4] > 1e-3
    assert sigma[5] < 1e-14
