"""The camera: perspective, both pixel conventions, the lens, the border, batches, refusals."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robsim.base.errors import InputError
from robsim.geometry.pose import Pose
from robsim.geometry.primitives import CameraBody
from robsim.kernels.formulas import perspective as kernels
from robsim.vision.camera import Camera, Visibility
from robsim.vision.chapter import T_CHAPTER_CAMERA, chapter_intrinsics, intrinsics_from_chapter

steady = settings(derandomize=True, max_examples=30, deadline=None)

K = np.array([[800.0, 3.0, 320.0], [0.0, 780.0, 240.0], [0.0, 0.0, 1.0]])
HERE = Pose.at()
SOMEWHERE = Pose.at(0.3, -2.0, 1.0, rpy=(0.4, -1.0, 2.0))
LENSES = [
    (-0.3, 0.1, 1e-3, -5e-4),  # radial and tangential
    (0.2, -0.05, 0.0, 0.0, 0.01),
    (-0.28, 0.07, 2e-4, 2e-5, 0.0),  # as in common calibration examples
    (0.1, 0.02, 1e-4, 1e-4, 0.003, 0.2, 0.03, 0.001),  # rational
]
CHAPTER = (8e-3, 1.1e-5, 0.9e-5, 0.05, 240.0, 320.0)  # f, px, py, alpha, u0, v0


def close(a, b, tolerance):
    np.testing.assert_allclose(a, b, rtol=0, atol=tolerance)


def scattered(n, seed=0, front=1.0):
    """(n, 3) points between one and three metres in front of the camera."""
    rng = np.random.default_rng(seed)
    return rng.uniform([-0.6, -0.6, front], [0.6, 0.6, front + 2], (n, 3))


# perspective


def test_a_pixel_is_column_and_row_with_skew():
    [[X, Y, Z]] = point = np.array([[0.3, -0.2, 1.7]])
    [[column, row]] = Camera(K).project(point, HERE)
    assert column == pytest.approx(800 * X / Z + 3 * Y / Z + 320, rel=1e-15)
    assert row == pytest.approx(780 * Y / Z + 240, rel=1e-15)


def test_a_point_on_the_optical_axis_is_at_the_principal_point():
    close(Camera(K).project([[0, 0, 0.1], [0, 0, 100]], HERE), [[320, 240]] * 2, 0)


@steady
@given(st.integers(0, 2**32), st.floats(0.1, 10))
def test_points_on_one_ray_share_a_pixel(seed, stretch):
    points = scattered(5, seed)
    a, b = (Camera(K, distortion=LENSES[0]).project(s * points, HERE) for s in (1.0, stretch))
    close(a, b, 1e-9)


@steady
@given(st.integers(0, 2**32))
def test_moving_camera_and_points_together_changes_nothing(seed):
    points, camera = scattered(5, seed), Camera(K, distortion=LENSES[0])
    away = Pose.exp(np.random.default_rng(seed).normal(size=6))
    close(camera.project(away @ points, away), camera.project(points, HERE), 1e-9)


# the chapter's convention


def test_the_intrinsics_agree_with_equation_10():
    """u = u0 - X f / (Z px cos a), v = v0 + Y f / (Z py) + X f tan a / (Z py)."""
    f, px, py, a, u0, v0 = CHAPTER
    X, Y, Z = 0.12, -0.34, 1.7
    u = u0 - X / Z * f / (px * np.cos(a))
    v = v0 + Y / Z * f / py + X / Z * f * np.tan(a) / py
    close(chapter_intrinsics(*CHAPTER) @ [X / Z, Y / Z, 1], [u, v, 1], 1e-10)


@steady
@given(st.integers(0, 2**32))
def test_from_chapter_gives_column_and_row_as_v_and_u_of_equation_10(seed):
    """The chapter's axes have x up and y to the right; ours have x right and y down."""
    points = scattered(8, seed)  # in the chapter's camera axes
    u_v = points / points[:, 2:] @ chapter_intrinsics(*CHAPTER)[:2].T
    column_row = Camera.from_chapter(*CHAPTER).project(points, T_CHAPTER_CAMERA)
    close(column_row, u_v[:, ::-1], 1e-10)


def test_the_two_conventions_differ_by_a_quarter_turn_of_the_camera():
    """x = Y and y = -X of the chapter, z the same; so det Ki < 0 and det K > 0."""
    close(T_CHAPTER_CAMERA.inv() @ [1.0, 2.0, 3.0], [2.0, -1.0, 3.0], 0)
    f, px, py, a, u0, v0 = CHAPTER
    camera = Camera.from_chapter(*CHAPTER)
    by_hand = [[f / py, -f * np.tan(a) / py, v0], [0, f / (px * np.cos(a)), u0], [0, 0, 1]]
    close(camera.K, by_hand, 1e-12)
    assert np.linalg.det(chapter_intrinsics(*CHAPTER)) < 0 < np.linalg.det(camera.K)
    close(intrinsics_from_chapter(chapter_intrinsics(*CHAPTER)), camera.K, 0)


def test_up_for_the_chapter_s_camera_is_in_a_smaller_row():
    up, right = np.array([[0.1, 0, 1]]), np.array([[0, 0.1, 1]])  # x up, y to the right
    camera = Camera.from_chapter(8e-3, 1e-5, 1e-5, 0, u0=240, v0=320)
    close(camera.project(up, T_CHAPTER_CAMERA), [[320, 160]], 1e-12)
    close(camera.project(right, T_CHAPTER_CAMERA), [[400, 240]], 1e-12)


def test_only_the_ratios_of_f_px_py_matter():
    f, px, py, *rest = CHAPTER
    centimetres = Camera.from_chapter(100 * f, 100 * px, 100 * py, *rest)
    close(centimetres.K, Camera.from_chapter(*CHAPTER).K, 1e-12)


def test_the_body_keeps_the_chapter_s_axes():
    """Seen from the world: its z the optical axis, its x up (our -y), its y our x."""
    body = CameraBody(0.08, 0.05, 0.03)
    drawn = Camera(K, body=body).drawn(SOMEWHERE)
    x, y, z = (SOMEWHERE.rotation @ axis for axis in np.eye(3))
    close(drawn.pose.rotation, np.stack([-y, x, z], axis=1), 1e-15)
    close(drawn.pose.position, SOMEWHERE.position, 0)
    assert drawn == body.at(SOMEWHERE @ T_CHAPTER_CAMERA.inv())
    assert Camera(K).drawn(SOMEWHERE) is None


# the lens


@pytest.mark.parametrize("lens", LENSES)
def test_distortion_is_brown_s_model(lens):
    k1, k2, p1, p2, k3, k4, k5, k6 = np.pad(lens, (0, 8 - len(lens)))
    x, y, _ = scattered(1, 5, front=0.0)[0]
    r2 = x * x + y * y
    f = (1 + k1 * r2 + k2 * r2**2 + k3 * r2**3) / (1 + k4 * r2 + k5 * r2**2 + k6 * r2**3)
    bent = [
        x * f + 2 * p1 * x * y + p2 * (r2 + 2 * x * x),
        y * f + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y,
    ]
    close(Camera(np.eye(3), distortion=lens).project([[x, y, 1]], HERE), [bent], 1e-15)


@pytest.mark.parametrize("lens", LENSES)
def test_the_derivative_of_the_lens_is_met_by_differences_of_second_order(lens):
    k = tuple(np.pad(lens, (0, 8 - len(lens))))
    x, y, steps = 0.7, -0.4, np.array([4e-2, 2e-2, 1e-2])
    xx, xy, yy = kernels.distort_jacobian(x, y, k)
    for (dx, dy), column in (((1, 0), (xx, xy)), ((0, 1), (xy, yy))):
        ahead, behind = (
            np.array([kernels.distort(x + s * h * dx, y + s * h * dy, k) for h in steps])
            for s in (1, -1)
        )
        errors = np.abs((ahead - behind) / (2 * steps[:, None]) - column).max(axis=1)
        assert (np.diff(np.log(errors)) / np.diff(np.log(steps)) >= 1.8).all()


@pytest.mark.parametrize("lens", LENSES)
@steady
@given(radius=st.floats(0, 0.9), angle=st.floats(-np.pi, np.pi))
def test_normalise_undoes_the_lens_within_its_valid_radius(lens, radius, angle):
    """The valid radius of the lens, but at most 0.8 (77 degrees of view)."""
    camera = Camera(K, distortion=lens)
    r = radius * min(camera.valid_radius, 0.8)
    x = np.array([[r * np.cos(angle), r * np.sin(angle)]])
    pixels = camera.project([[*x[0], 1.0]], HERE)
    close(camera.normalise(pixels), x, 1e-13)


@steady
@given(st.integers(0, 2**32))
def test_normalise_undoes_a_pinhole_with_skew(seed):
    points = scattered(5, seed)
    x = Camera(K).normalise(Camera(K).project(points, HERE))
    close(x, points[:, :2] / points[:, 2:], 1e-15)


def test_how_a_pixel_moves_with_its_point_is_the_derivative_with_skew_and_lens():
    camera = Camera([[800, 3, 320], [0, 700, 240], [0, 0, 1]], distortion=(-0.2, 0.05, 0.01, -0.02))
    x = np.random.default_rng(3).uniform(-0.4, 0.4, (9, 2, 1))
    J, step = np.empty((9, 2, 2, 1)), 1e-6
    kernels.pixel_jacobian(x, camera.K, camera.lens_kind, camera.coefficients, J)
    for c in range(2):
        ahead, behind = (
            camera.project(np.c_[x[:, :, 0] + d * np.eye(2)[c], np.ones(9)], Pose.at())
            for d in (step, -step)
        )
        np.testing.assert_allclose(J[:, :, c, 0], (ahead - behind) / (2 * step), atol=1e-6)


@pytest.mark.parametrize(
    ("lens", "radius"),
    [
        ((), np.inf),
        ((0.3, 0.0, 0, 0), np.inf),
        ((-0.3, 0.0, 0, 0), 1 / np.sqrt(0.9)),  # 1 + 3 k1 r^2 = 0
        ((0.0, -0.2, 0, 0), 1.0),  # 1 + 5 k2 r^4 = 0
        ((0.0, 0.0, 0, 0, -1 / 7), 1.0),  # 1 + 7 k3 r^6 = 0
        ((0.0, 0.0, 0, 0, 0, -4.0, 0, 0), 0.5),  # the denominator vanishes
    ],
)
def test_the_lens_reaches_to_where_it_folds_back(lens, radius):
    assert Camera(K, distortion=lens).valid_radius == pytest.approx(radius, rel=1e-14)


@pytest.mark.parametrize("lens", [(-0.3, 0.0), (-0.4, 0.05), (0.1, -0.2)])
def test_the_image_grows_with_the_radius_up_to_where_it_folds_and_not_beyond(lens):
    camera = Camera(np.eye(3), distortion=(*lens, 0, 0))
    r = camera.valid_radius * np.array([0.99, 0.999, 1.0, 1.001, 1.01])
    seen = camera.project(np.stack([r, 0 * r, 1 + 0 * r], axis=1), HERE)[:, 0]
    assert (np.diff(seen)[:2] > 0).all()
    assert (np.diff(seen)[2:] < 0).all()


def test_points_that_a_lens_folds_back_into_the_image_are_outside():
    camera = Camera(K, size=(640, 480), distortion=(-0.3, 0, 0, 0))
    points = [[0.3, 0, 1], [1.0, 0, 1], [1.7, 0, 1]]  # the last lies beyond 1.054
    columns = camera.project(points, HERE)[:, 0]
    assert 320 < columns[2] < 640  # its pixel lies in the image all the same
    assert camera.visibility(points, HERE).tolist() == [0, 1, 1]
    assert Camera(K, distortion=(-0.3, 0, 0, 0)).visibility(points, HERE).tolist() == [0, 0, 1]


# visibility


@pytest.mark.parametrize("depth", [0.0, 1e-10, -1e-10, -1.0, -1e6])
@pytest.mark.parametrize("lens", [(), LENSES[0]])
def test_points_behind_the_camera_are_nan_and_flagged_and_never_mirrored(depth, lens):
    camera = Camera(K, size=(640, 480), distortion=lens)
    points = [[0.0, 0, 1], [0.1 * depth, -0.1 * depth, depth]]
    pixels = camera.project(points, HERE)
    close(pixels[0], [320, 240], 0)
    assert np.isnan(pixels[1]).all()
    assert camera.visibility(points, HERE).tolist() == [
        Visibility.IN_IMAGE,
        Visibility.BEHIND_CAMERA,
    ]


@pytest.mark.parametrize(
    ("pixel", "seen"),
    [
        ((0, 0), True),
        ((-0.5, -0.5), True),
        ((639, 479), True),
        ((639.4999, 479.4999), True),
        ((np.nextafter(-0.5, -1), 0), False),
        ((0, np.nextafter(-0.5, -1)), False),
        ((639.5, 0), False),
        ((0, 479.5), False),
        ((np.nextafter(639.5, 0), np.nextafter(479.5, 0)), True),
        ((1e9, 0), False),
    ],
)
def test_pixel_centres_are_whole_numbers_and_the_image_is_half_open(pixel, seen):
    """An image of w x h covers [-0.5, w - 0.5) x [-0.5, h - 0.5)."""
    camera = Camera(np.eye(3), size=(640, 480))
    [status] = camera.visibility([[*pixel, 1.0]], HERE)
    assert status == (Visibility.IN_IMAGE if seen else Visibility.OUT_OF_IMAGE)
    assert Camera(np.eye(3)).visibility([[*pixel, 1.0]], HERE) == [Visibility.IN_IMAGE]


def test_without_a_size_there_is_no_border():
    close(Camera(K).border, [[-np.inf, np.inf]] * 2, 0)
    close(Camera(K, size=(640, 480)).border, [[-0.5, 639.5], [-0.5, 479.5]], 0)


# batches


def test_a_batch_of_poses_is_a_loop_over_them():
    camera = Camera(K, size=(640, 480), distortion=LENSES[3])
    poses = Pose.exp(np.random.default_rng(1).normal(scale=0.8, size=(2, 6, 6)))
    points = scattered(4)
    pixels, status = camera.project(points, poses), camera.visibility(points, poses)
    assert pixels.shape == (2, 6, 4, 2)
    assert status.shape == (2, 6, 4)
    assert set(np.unique(status)) == {0, 1, 2}
    for index in np.ndindex(2, 6):
        close(pixels[index], camera.project(points, poses[index]), 1e-9)
        np.testing.assert_array_equal(status[index], camera.visibility(points, poses[index]))


def test_points_and_poses_broadcast():
    camera, poses = Camera(K), Pose.exp(np.random.default_rng(2).normal(scale=0.1, size=(6, 6)))
    points = scattered(24).reshape(6, 4, 3)
    rows, table = camera.project(points, poses), camera.project(points[:, None], poses)
    assert camera.project(points, HERE).shape == (6, 4, 2)
    assert table.shape == (6, 6, 4, 2)
    for i in range(6):
        close(rows[i], camera.project(points[i], poses[i]), 1e-10)
        close(table[3, i], camera.project(points[3], poses[i]), 1e-10)


def test_a_pose_may_be_an_array():
    points = SOMEWHERE @ scattered(4)
    camera = Camera(K)
    close(camera.project(points, SOMEWHERE.matrix), camera.project(points, SOMEWHERE), 0)


def test_normalise_takes_leading_dimensions():
    pixels = np.random.default_rng(3).uniform(0, 480, (2, 3, 5, 2))
    whole = Camera(K, distortion=LENSES[0]).normalise(pixels)
    assert whole.shape == (2, 3, 5, 2)
    close(whole[1, 2], Camera(K, distortion=LENSES[0]).normalise(pixels[1, 2]), 0)


def test_one_column_of_a_batch_does_not_depend_on_the_others():
    camera, points = Camera(K, distortion=LENSES[3]), scattered(300).reshape(100, 3, 3)
    whole = camera.project(points, HERE)
    np.testing.assert_array_equal(whole[17], camera.project(points[17], HERE))


# refusals


@pytest.mark.parametrize(
    ("K", "words"),
    [
        ([[0, 0, 320], [0, 800, 240], [0, 0, 1]], "focal lengths must be above zero, got 0.0 and"),
        ([[800, 0, 320], [0, 0, 240], [0, 0, 1]], "focal lengths must be above zero"),
        ([[-800, 0, 320], [0, 800, 240], [0, 0, 1]], "focal lengths must be above zero"),
        ([[800, 0, 320], [1, 800, 240], [0, 0, 1]], "K must be [[fx, skew, cx], [0, fy, cy], "),
        ([[800, 0, 320], [0, 800, 240], [0, 0, 2]], "K must be [[fx, skew, cx], [0, fy, cy], "),
        ([[800, 0, 320], [0, 800, 240], [1, 0, 1]], "K must be [[fx, skew, cx], [0, fy, cy], "),
        ([np.eye(3)], "K must be [[fx, skew, cx], [0, fy, cy], "),
        (chapter_intrinsics(*CHAPTER), "K must be [[fx, skew, cx], [0, fy, cy], "),
        (np.full((3, 3), np.nan), "K: nan at index (0, 0)"),
        (np.eye(4), "K: expected shape (..., 3, 3), got (4, 4)"),
        (800, "K: expected shape"),
        (None, "K: "),
    ],
)
def test_intrinsics_have_their_form(K, words):
    with pytest.raises(InputError) as caught:
        Camera(K)
    assert words in str(caught.value)


@pytest.mark.parametrize(
    "size", [(0, 480), (-640, 480), (640.5, 480), (640,), 640, (1, 2, 3), (np.nan, 1), "640x480"]
)
def test_an_image_has_a_width_and_a_height_in_whole_pixels(size):
    with pytest.raises(InputError, match="image size"):
        Camera(K, size=size)


@pytest.mark.parametrize("lens", [(), *LENSES])
def test_a_lens_is_taken_in_every_shape_that_opencv_writes(lens):
    """Flat, a row, a column; with a thin prism (12) and a tilted sensor (14) that are not there."""
    flat, camera = np.array(lens), Camera(K, distortion=lens)
    for shape in ((-1,), (1, -1), (-1, 1)):
        again = Camera(K, distortion=flat.reshape((1, 0) if not lens and 1 in shape else shape))
        assert again == camera and again.distortion == lens
    for more in (12, 14):
        padded = np.pad(flat, (0, more - len(flat)))
        for row in (padded, padded[None], padded[:, None]):
            np.testing.assert_array_equal(
                Camera(K, distortion=row).coefficients, camera.coefficients
            )


def test_a_lens_that_is_not_modelled_is_refused():
    lens = np.zeros((1, 14))
    lens[0, 9] = 1e-4
    with pytest.raises(
        InputError, match=r"tau_x .* not supported: .* must be zero, got \[0.0, 0.00"
    ):
        Camera(K, distortion=lens)
    with pytest.raises(InputError, match=r"flat, in a row or in a column, got shape \(1, 1, 5\)"):
        Camera(K, distortion=np.zeros((1, 1, 5)))
    with pytest.raises(InputError, match=r"expected one row or column, got shape \(2, 4\)"):
        Camera(K, distortion=np.zeros((2, 4)))


@pytest.mark.parametrize("lens", [(0.1,), (0.1, 0.2, 0.3), (0,) * 6, (0,) * 9, (np.nan,) * 4, "k1"])
def test_a_lens_has_four_five_or_eight_numbers(lens):
    with pytest.raises(InputError, match="distortion: "):
        Camera(K, distortion=lens)


@pytest.mark.parametrize(
    ("place", "bad", "words"),
    [
        (0, 0, "f must be a positive number"),
        (0, -8e-3, "f must be a positive number"),
        (1, 0, "px must be a positive number"),
        (2, -1e-5, "py must be a positive number"),
        (3, np.pi / 2, "alpha is the skew angle in radians"),
        (3, 90, "alpha is the skew angle in radians"),
        (4, np.inf, "alpha, u0, v0: inf"),
    ],
)
def test_the_chapter_s_parameters_are_checked_by_name(place, bad, words):
    parameters = [*CHAPTER[:place], bad, *CHAPTER[place + 1 :]]
    with pytest.raises(InputError, match=words):
        Camera.from_chapter(*parameters)


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda c: c.project([0, 0, 1], HERE), r"points: expected shape \(..., N, 3\), got \(3,\)"),
        (lambda c: c.project([[0, 0]], HERE), "points: expected shape"),
        (lambda c: c.project([[0, 0, np.nan]], HERE), r"points: nan at index \(0, 2\)"),
        (lambda c: c.project([[0, 0, 1]], np.eye(3)), "pose: expected shape"),
        (lambda c: c.project([[0, 0, 1]], 2 * np.eye(4)), "not a rotation"),
        (lambda c: c.visibility("dots", HERE), "points: expected numbers"),
        (lambda c: c.normalise([1, 2]), "pixels: expected shape"),
        (lambda c: c.normalise([[1, np.inf]]), "pixels: inf at index"),
    ],
)
def test_points_pixels_and_poses_are_checked_by_name(call, words):
    with pytest.raises(InputError, match=words):
        call(Camera(K))


# values


def test_a_camera_is_a_value():
    given = K.copy()
    camera = Camera(given, size=(640, 480))
    given[0, 0] = 1.0
    same = Camera(K.tolist(), size=[640, 480])
    assert same == camera
    assert hash(same) == hash(camera)
    assert Camera(K, size=(640, 481)) != camera
    assert Camera(K, size=(640, 480), distortion=LENSES[0]) != camera
    with pytest.raises(ValueError, match="read-only"):
        camera.K[0, 0] = 1.0
    with pytest.raises(AttributeError):
        camera.size = None
