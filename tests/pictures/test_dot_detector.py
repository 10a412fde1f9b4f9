"""Centroids of dots against the exact centroids of their projected rims."""

import numpy as np
import pytest

import robsim as rs
from robsim.vision import DotDetector, DotPattern, MarkSearch
from robsim.vision.detectors.dot_centers import find_rim_centroids as dot_centers

LENSES = {
    "pinhole": {},
    "barrel": {"distortion": (-0.25, 0.06, 0.001, -0.002)},
    "fisheye": {"distortion": (-0.02, 0.01, 0.0, 0.0), "lens": "fisheye"},
}
K = np.array([[410.0, 1.8, 150.0], [0.0, 395.0, 126.0], [0.0, 0.0, 1.0]])  # skew, off centre
RADIUS, SIZE = 0.012, (320, 240)
FULL = rs.shapes.Light(ambient=1.0)


def build_camera(lens="pinhole"):
    return rs.Camera(K, SIZE, **LENSES[lens])


def take_picture(camera, thing, samples=2):
    """Return the picture of an object; the camera is at the origin."""
    scene = rs.Scene(objects=thing, cameras=rs.MountedCamera("eye", camera))
    return scene.picture(samples=samples, light=FULL)


def find_rim_centroids(camera, T_c_o, points, radius=RADIUS):
    """Return the centroids (N, 2) of dots whose rims are sampled densely and projected."""
    angle = 2 * np.pi * np.arange(1000) / 1000
    found = []
    for x, y in points:
        rim = np.column_stack([x + radius * np.cos(angle), y + radius * np.sin(angle), 0 * angle])
        u, v = camera.project(T_c_o @ rim, rs.Pose.at()).T
        cross = u * np.roll(v, -1) - np.roll(u, -1) * v
        sums = [((w + np.roll(w, -1)) * cross).sum() for w in (u, v)]
        found.append(np.array(sums) / (3 * cross.sum()))
    return np.array(found)


def take_pictures(camera, dots, samples=2, seed=0, count=12):
    """Return pictures (B, h, w) of dots at random poses, and the exact centroids (B, N, 2)."""
    rng, pictures, exact = np.random.default_rng(seed), [], []
    while len(pictures) < count:
        turn = (*rng.uniform(-0.6, 0.6, 2), rng.uniform(-3, 3))
        T_c_o = rs.Pose.at(*rng.uniform(-0.03, 0.03, 2), rng.uniform(0.45, 0.8), rpy=turn)
        centres = find_rim_centroids(camera, T_c_o, dots.points)
        if (centres > 14).all() and (centres < np.array(SIZE) - 15).all():
            plate = rs.Object("plate", dots=dots, pose=T_c_o)
            pictures.append(take_picture(camera, plate, samples))
            exact.append(centres)
    return np.array(pictures), np.array(exact)


def search(dots, camera, last):
    return MarkSearch(dots, dots.marks, camera, np.asarray(last, dtype=float))


@pytest.mark.parametrize(("bright", "samples"), [(False, 1), (True, 1), (False, 2)])
@pytest.mark.parametrize("lens", LENSES)
def test_centroids_are_exact_to_thousandths_of_a_pixel(lens, bright, samples):
    camera, dots = build_camera(lens), DotPattern.grid(4, 3, 0.06, RADIUS, bright)
    pictures, exact = take_pictures(camera, dots, samples)
    shifts = np.random.default_rng(1).uniform(-8, 8, exact.shape)
    detector = DotDetector(bright=bright)
    found = detector.find(pictures, search(dots, camera, np.round(exact + shifts)))
    error = found - exact
    assert np.sqrt(np.mean(error**2)) < 0.002
    assert (abs(error.mean(axis=(0, 1))) < 2e-4).all()


def find_ellipse_centre(K, T_c_o, point, radius):
    """Return the centre of the image of a disc: that of the dual conic H Q H' of its rim."""
    x, y = point
    H = K @ T_c_o.matrix[:3][:, [0, 1, 3]] @ [[radius, 0, x], [0, radius, y], [0, 0, 1.0]]
    conic = H @ np.diag([1.0, 1.0, -1.0]) @ H.T
    return conic[:2, 2] / conic[2, 2]


@pytest.mark.parametrize("tilt", [0.0, 0.4, 0.8])
def test_the_bias_of_a_centroid_is_that_of_the_centre_of_an_ellipse(tilt):
    """f (r/Z)^2 sin(a) cos(a) / (1 - (r/Z)^2 sin(a)^2) on the optical axis."""
    camera = rs.Camera([[800.0, 0, 319.5], [0, 800, 239.5], [0, 0, 1]], (640, 480))
    T_c_o = rs.Pose.at(0, 0, 0.5, rpy=(0, tilt, 0))
    bias = find_ellipse_centre(camera.K, T_c_o, (0, 0), 0.02) - [319.5, 239.5]
    share = (0.02 / 0.5) ** 2
    expected = 800 * share * np.sin(tilt) * np.cos(tilt) / (1 - share * np.sin(tilt) ** 2)
    np.testing.assert_allclose(abs(bias), [expected, 0.0], rtol=0, atol=1e-9)
    found = find_rim_centroids(camera, T_c_o, [(0, 0)], 0.02)[0]
    np.testing.assert_allclose(found - [319.5, 239.5], bias, rtol=0, atol=1e-5)
    dots = DotPattern.grid(3, 3, 0.06, 0.02)
    H = T_c_o.matrix[:3][:, [0, 1, 3]]
    for point, ours in zip(dots.points, dot_centers(dots.discs, H, camera), strict=True):
        exact = find_ellipse_centre(camera.K, T_c_o, point, 0.02)
        np.testing.assert_allclose(ours, exact, rtol=0, atol=2e-4)


@pytest.mark.parametrize("lens", LENSES)
def test_unbiased_dots_are_at_the_images_of_their_centres(lens):
    camera, dots = build_camera(lens), DotPattern.grid(4, 3, 0.06, RADIUS)
    rng, errors, count = np.random.default_rng(4), {True: [], False: []}, 0
    while count < 8:
        turn = (*rng.uniform(-0.8, 0.8, 2), rng.uniform(-3, 3))
        T_c_o = rs.Pose.at(*rng.uniform(-0.03, 0.03, 2), rng.uniform(0.35, 0.5), rpy=turn)
        true = camera.project(T_c_o @ dots.marks, rs.Pose.at())
        if (true < 14).any() or (true > np.array(SIZE) - 15).any():
            continue
        picture, count = take_picture(camera, rs.Object("plate", dots=dots, pose=T_c_o)), count + 1
        for unbiased, some in errors.items():
            found = DotDetector(unbiased=unbiased).find(
                picture[None], search(dots, camera, true[None])
            )
            some.append(found[0] - true)
    assert 0.05 < np.sqrt(np.mean(np.square(errors[False]))) < 0.5
    assert np.sqrt(np.mean(np.square(errors[True]))) < 0.005


def test_three_dots_remain_biased():
    camera, dots = build_camera(), DotPattern.grid(2, 2, 0.06, RADIUS)
    T_c_o = rs.Pose.at(0, 0, 0.4, rpy=(0.5, 0.4, 0.1))
    picture = take_picture(camera, rs.Object("plate", dots=dots, pose=T_c_o))
    last = camera.project(T_c_o @ dots.marks, rs.Pose.at())
    for hidden, same in (([], False), ([2], True)):
        last[hidden] = np.nan
        found = [
            DotDetector(unbiased=unbiased).find(picture[None], search(dots, camera, last[None]))[0]
            for unbiased in (False, True)
        ]
        assert np.isfinite(found[1][:, 0]).sum() == 4 - len(hidden)
        assert np.array_equal(*found, equal_nan=True) == same


def test_a_batch_has_the_bits_of_each_picture_alone():
    camera, dots = build_camera(), DotPattern.grid(4, 3, 0.06, RADIUS)
    pictures, exact = take_pictures(camera, dots, count=4)
    noise = np.random.default_rng(2).normal(0, 3, pictures.shape)
    pictures = np.clip(np.rint(pictures + noise), 0, 255).astype(np.uint8)
    last, detector = np.round(exact) + 4, DotDetector()
    batch = detector.find(pictures, search(dots, camera, last))
    assert np.sqrt(np.mean((batch - exact) ** 2)) < 0.02
    for picture, places, found in zip(pictures, last, batch, strict=True):
        alone = detector.find(picture[None], search(dots, camera, places[None]))
        np.testing.assert_array_equal(alone[0], found)


def draw_dots(*dots, size=(140, 100), fine=8):
    """Return a picture with dots (x, y, radius), the mean over places in each pixel."""
    y, x = (np.mgrid[: size[1] * fine, : size[0] * fine] + 0.5) / fine - 0.5
    ink = np.zeros(x.shape, dtype=bool)
    for column, row, radius in dots:
        ink |= np.hypot(x - column, y - row) < radius
    share = ink.reshape(size[1], fine, size[0], fine).mean(axis=(1, 3))
    return np.rint(225 - 195 * share).astype(np.uint8)


def find_places(picture, *last, **options):
    camera = rs.Camera(K, picture.shape[::-1])
    marks = MarkSearch(None, np.zeros((len(last), 3)), camera, np.array([last], dtype=float))
    return DotDetector(**options).find(picture[None], marks)[0]


@pytest.mark.full
def test_the_detector_alone_is_exact_to_two_thousandths_of_a_pixel():
    """In pictures with 256 places a pixel."""
    rng, errors = np.random.default_rng(6), []
    for radius in (6.0, 8.0, 12.0):
        middles = np.array([[35, 30], [100, 30], [35, 70], [100, 70]]) + rng.uniform(-1, 1, (4, 2))
        picture = draw_dots(*((x, y, radius) for x, y in middles), fine=16)
        errors.append(find_places(picture, *np.round(middles)) - middles)
    assert np.sqrt(np.mean(np.square(errors))) < 0.002


@pytest.mark.parametrize("radius", [3, 5, 8, 15])
def test_a_dot_that_is_not_whole_is_not_found(radius):
    two = draw_dots((60, 50, radius), (60 + 2 * radius, 50, radius))
    assert np.isnan(find_places(two, (60, 50), (60 + 2 * radius, 50))).all()  # merged
    assert np.isnan(find_places(draw_dots((radius - 1, 50, radius)), (3, 50))).all()  # cut
    hidden = draw_dots((60, 50, radius))
    hidden[:, 60 + radius // 3 :] = 225
    if radius > 5:
        assert np.isnan(find_places(hidden, (60, 50))).all()


def test_a_small_far_or_faint_dot_is_not_found():
    assert np.isfinite(find_places(draw_dots((60, 50, 3)), (60, 50))).all()
    assert np.isnan(find_places(draw_dots((60, 50, 1.5)), (60, 50))).all()
    assert np.isnan(find_places(draw_dots((60, 50, 3)), (60, 50), least_area=60.0)).all()
    assert np.isnan(find_places(draw_dots((60, 50, 3)), (90, 50))).all()
    assert np.isfinite(find_places(draw_dots((60, 50, 3)), (90, 50), reach=35.0)).all()
    faint = (225 - (225 - draw_dots((60, 50, 8)).astype(int)) // 13).astype(np.uint8)
    assert np.isnan(find_places(faint, (60, 50))).all()
    assert np.isfinite(find_places(faint, (60, 50), least_contrast=10.0)).all()
    assert np.isnan(find_places(draw_dots((60, 50, 8)), (np.nan, 50))).all()
    assert np.isnan(find_places(draw_dots((60, 50, 8)), (-1e9, 1e300))).all()


def test_the_window_grows_in_a_large_dot():
    found = find_places(draw_dots((70, 50, 29.5)), (75, 48), reach=6.0)
    np.testing.assert_allclose(found, [[70, 50]], atol=0.002)


def test_a_dot_belongs_to_the_nearest_mark():
    found = find_places(draw_dots((60, 50, 6)), (68, 50), (57, 50))
    assert np.isnan(found[0]).all() and np.isfinite(found[1]).all()


def test_the_polygons_of_dots_have_the_area_and_the_centroid_of_discs():
    camera, dots = build_camera("barrel"), DotPattern([(0.01, -0.02)], 0.02)
    T_c_o = rs.Pose.at(0.02, 0.01, 0.3, rpy=(0.7, 0.3, 0.4))
    x, y = dots.discs[0].T
    area = 0.5 * (x * np.roll(y, -1) - np.roll(x, -1) * y).sum()
    assert abs(area / (np.pi * 0.02**2) - 1) < 1e-12
    whole = find_rim_centroids(camera, T_c_o, dots.points, 0.02)[0]
    fine = [
        np.linspace(a, b, 30, endpoint=False)
        for a, b in zip(dots.discs[0], np.roll(dots.discs[0], -1, axis=0), strict=True)
    ]
    u, v = camera.project(T_c_o @ np.insert(np.concatenate(fine), 2, 0.0, axis=1), rs.Pose.at()).T
    cross = u * np.roll(v, -1) - np.roll(u, -1) * v
    middle = [((w + np.roll(w, -1)) * cross).sum() / (3 * cross.sum()) for w in (u, v)]
    assert np.linalg.norm(middle - whole) < 1e-4


@pytest.mark.parametrize(
    ("make", "told"),
    [
        (lambda: DotPattern([(0, 0, 0)], 0.01), "points of a dot pattern"),
        (lambda: DotPattern([], 0.01), "points of a dot pattern: expected shape"),
        (lambda: DotPattern([(0, 0), (0.01, 0)], 0.01), "points 0 and 1 .* dots overlap"),
        (lambda: DotPattern([(0, 0)], 0.0), "radius of a dot in metres"),
        (lambda: DotPattern.grid(0, 2, 0.1, 0.01), "columns of a dot pattern"),
        (lambda: DotDetector(reach=0), "DotDetector.reach"),
        (
            lambda: DotDetector().check(DotPattern([(0, 0)], 0.01, bright=True), None, CAMERA),
            "DotDetector with bright=False, and the object has bright dots",
        ),
        (
            lambda: DotDetector(unbiased=True).check(None, None, CAMERA),
            "DotDetector needs a DotPattern",
        ),
        (
            lambda: DotDetector(unbiased=True).check(
                DotPattern.grid(5, 1, 0.1, 0.01), None, CAMERA
            ),
            "needs dots that are not on one line",
        ),
        (lambda: DotDetector().check(None, None, rs.Camera(K)), "needs the size of the camera"),
        (
            lambda: DotDetector().check(None, None, rs.Camera(K, (12, 12))),
            "pictures of 16 pixels on a side or more",
        ),
    ],
)
def test_what_is_wrong_is_named(make, told):
    with pytest.raises(rs.errors.InputError, match=told):
        make()


CAMERA = build_camera()
