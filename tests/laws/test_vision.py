"""Properties of poses, points and planes that are estimated from images, in any view."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import integrate

import robsim as rs
from robsim.vision.nonlinear_covariance import second_moment

steady = settings(derandomize=True, max_examples=20, deadline=None)
seeds = st.integers(0, 2**32)
PLAIN = rs.Camera([[800, 0, 320], [0, 800, 240], [0, 0, 1]])
BENT = rs.Camera(
    [[800, 3, 320], [0, 700, 240], [0, 0, 1]], distortion=(-0.2, 0.05, 1e-3, -5e-4, 0.01)
)
SQUARE = np.array([[-0.1, -0.1, 0], [0.1, -0.1, 0], [0.1, 0.1, 0], [-0.1, 0.1, 0]])


def close(a, b, tolerance):
    np.testing.assert_allclose(a, b, rtol=0, atol=tolerance)


def views(seed, marks=6, runs=20, thick=1.0):
    """Marks (N, 3) and poses T_c_o of them before the camera."""
    rng = np.random.default_rng(seed)
    p = rng.uniform(-0.15, 0.15, (marks, 3)) * (1, 1, thick)
    turn = rs.Pose.exp(np.concatenate([np.zeros((runs, 3)), rng.uniform(-1, 1, (runs, 3))], 1))
    T = turn.matrix.copy()
    T[:, :3, 3] = rng.uniform([-0.2, -0.15, 0.6], [0.2, 0.15, 2.0], (runs, 3))
    return p, rs.Pose(T)


def project(camera, p, T_c_o):
    return camera.project(p, T_c_o.inv())


def twist(T):
    """(v, omega) of small motions (..., 4, 4), to first order."""
    W = (T[..., :3, :3] - np.swapaxes(T[..., :3, :3], -1, -2)) / 2
    turn = np.stack([W[..., 2, 1], W[..., 0, 2], W[..., 1, 0]], axis=-1)
    return np.concatenate([T[..., :3, 3], turn], axis=-1)


# poses


@steady
@given(
    seed=seeds,
    marks=st.integers(4, 12),
    thick=st.sampled_from([0.0, 1e-3, 0.1, 1.0]),
    camera=st.sampled_from([PLAIN, BENT]),
)
def test_an_exact_image_gives_the_pose(seed, marks, thick, camera):
    p, T = views(seed, marks, thick=thick)
    found = rs.vision.estimate_pose(p, project(camera, p, T), camera)
    close(found.T_c_o, T.matrix, 1e-9)  # targets that are nearly a line are among them
    assert found.rms.max() < 1e-10


@steady
@given(seed=seeds)
def test_the_pose_is_one_of_those_that_three_marks_have(seed):
    p, T = views(seed, 3)
    found = rs.vision.estimate_pose(p, project(PLAIN, p, T), PLAIN)
    apart = np.abs(found.candidates - T.matrix[:, None]).max((-1, -2))
    assert (np.nanmin(apart, axis=1) < 1e-5).all() and found.ambiguous.all()
    poses = found.candidates[np.isfinite(found.candidates).all((-1, -2))]
    again = np.repeat(project(PLAIN, p, T), np.isfinite(apart).sum(1), axis=0)
    close(project(PLAIN, p, rs.Pose(poses)), again, 1e-4)  # each puts the marks at their image


@steady
@given(seed=seeds, marks=st.sampled_from([4, 6]), thick=st.sampled_from([0.0, 1.0]))
def test_it_does_not_matter_where_the_axes_of_the_target_are(seed, marks, thick):
    """T_c_n = T_c_o T_o_n for other axes n; twice the size is twice as far."""
    p, T = views(seed, marks, thick=thick)
    pixels = project(PLAIN, p, T) + np.random.default_rng(seed).normal(size=(20, marks, 2)) * 0.1
    T_n_o = rs.Pose.at(0.3, -0.2, 0.5, rotvec=(0.4, -2.0, 0.7))
    here, there = (rs.vision.estimate_pose(m, pixels, PLAIN) for m in (p, T_n_o @ p))
    sure = ~here.ambiguous & (here.rms < 0.99 * np.nan_to_num(here.other_rms, nan=np.inf))
    close(here.rms[sure], there.rms[sure], 1e-7)
    close(there.T_c_o[sure], (rs.Pose(here.T_c_o[sure]) @ T_n_o.inv()).matrix, 1e-6)
    double = rs.vision.estimate_pose(2 * p, pixels, PLAIN)
    close(double.T_c_o[sure, :3, 3], 2 * here.T_c_o[sure, :3, 3], 1e-6)


@pytest.mark.parametrize(("marks", "thick"), [(3, 1.0), (4, 0.0), (5, 1.0), (12, 0.1)])
def test_a_pose_has_the_same_bits_alone_and_in_any_batch(marks, thick):
    p, T = views(3, marks, 300, thick)
    pixels = project(BENT, p, T) + np.random.default_rng(1).normal(size=(300, marks, 2))
    pixels[7, 1] = np.nan
    batch = rs.vision.estimate_pose(p, pixels, BENT)
    shaped = rs.vision.estimate_pose(p, pixels.reshape(3, 100, marks, 2), BENT)
    fields = ("T_c_o", "rms", "ambiguous", "other", "other_rms", "covariance", "candidates")
    for name in fields:
        whole = getattr(batch, name)
        np.testing.assert_array_equal(getattr(shaped, name).reshape(whole.shape), whole)
    for i in (0, 7, 150, 299):
        alone = rs.vision.estimate_pose(p, pixels[i], BENT)
        for name in fields:
            np.testing.assert_array_equal(getattr(alone, name), getattr(batch, name)[i])


def test_a_mark_that_is_not_seen_costs_its_own_run_only():
    p, T = views(4, 5)
    pixels = project(PLAIN, p, T)
    gap = pixels.copy()
    gap[3, 2, 0] = np.nan
    found, whole = rs.vision.estimate_pose(p, gap, PLAIN), rs.vision.estimate_pose(p, pixels, PLAIN)
    rest = np.arange(20) != 3
    np.testing.assert_array_equal(found.T_c_o[rest], whole.T_c_o[rest])
    assert np.isnan(found.T_c_o[3]).all() and np.isnan(found.covariance[3]).all()
    assert found.ambiguous[3] and np.isnan(found.rms[3]) and not whole.ambiguous.any()


@pytest.mark.parametrize("scale", [2.0**-100, 2.0**-33, 2.0**33, 2.0**100])
def test_the_unit_of_length_changes_no_digit(scale):
    """Metres and radians must not be weighed against each other: a target may be tiny or huge."""
    p, T = views(3)
    x = project(PLAIN, p, T) + np.random.default_rng(4).normal(0, 0.5, (20, 6, 2))
    for noise in (None, 0.5):
        one, other = (rs.vision.estimate_pose(m, x, PLAIN, noise=noise) for m in (p, scale * p))
        np.testing.assert_array_equal(other.T_c_o[..., :3, 3], scale * one.T_c_o[..., :3, 3])
        np.testing.assert_array_equal(other.T_c_o[..., :3, :3], one.T_c_o[..., :3, :3])
        units = np.repeat([scale, 1.0], 3)
        rescaled = one.covariance * units[:, None] * units
        np.testing.assert_array_equal(other.covariance, rescaled)
        np.testing.assert_array_equal(other.ambiguous, one.ambiguous)


def test_an_image_that_is_one_point_has_no_pose():
    found = rs.vision.estimate_pose(SQUARE, np.full((4, 2), 100.0), PLAIN)
    assert np.isnan(found.T_c_o).all() and found.ambiguous


def test_of_a_target_in_the_far_distance_the_depth_is_flagged():
    near, far = (
        rs.vision.estimate_pose(
            SQUARE, project(PLAIN, SQUARE, rs.Pose.at(0, 0, Z)), PLAIN, noise=0.5
        )
        for Z in (1, 300)
    )
    assert far.ambiguous and not near.ambiguous
    close(far.T_c_o[2, 3], 300, 1e-6)


@pytest.mark.parametrize("tilt", [0.0, 0.5, np.pi / 2])
def test_symmetric_views_and_views_along_the_plane_are_no_trouble(tilt):
    T = rs.Pose.at(0, 0, 1, rpy=(tilt, 0, 0))
    found = rs.vision.estimate_pose(SQUARE, project(PLAIN, SQUARE, T), PLAIN)
    close(found.T_c_o, T.matrix, 1e-12)
    assert not found.ambiguous


def test_three_of_four_marks_may_be_on_a_line_or_two_in_one_place():
    T = rs.Pose.at(0.05, 0, 0.8, rpy=(0.5, 0.2, 1))
    p = np.array([[0, 0, 0], [0.1, 0, 0], [0.2, 0, 0], [0, 0.15, 0]])
    close(rs.vision.estimate_pose(p, project(PLAIN, p, T), PLAIN).T_c_o, T.matrix, 1e-12)
    p[2] = p[1]
    found = rs.vision.estimate_pose(p, project(PLAIN, p, T), PLAIN)
    close(np.nanmin(np.abs(found.candidates - T.matrix).max((-1, -2))), 0, 1e-12)
    assert found.ambiguous  # as it is of three


def test_the_second_pose_of_a_plane_is_a_minimum_too():
    """A small far plane is tilted to one side or to the other; noise hides the side."""
    T = rs.Pose.at(0, 0, 2, rpy=(0.6, 0, 0))
    exact = project(PLAIN, 0.3 * SQUARE, T)
    found = rs.vision.estimate_pose(0.3 * SQUARE, exact, PLAIN)
    assert not found.ambiguous and found.rms < 1e-10 and 0.01 < found.other_rms < 0.2
    close(found.other[:3, 2] * (-1, -1, 1), T.rotation[:, 2], 0.02)
    noisy = rs.vision.estimate_pose(0.3 * SQUARE, exact, PLAIN, noise=0.5)
    assert noisy.ambiguous
    close(noisy.T_c_o, T.matrix, 1e-12)
    again = rs.vision.estimate_pose(
        0.3 * SQUARE, project(PLAIN, 0.3 * SQUARE, rs.Pose(found.other)), PLAIN
    )
    close(again.T_c_o, found.other, 1e-12)


@pytest.mark.full
@pytest.mark.parametrize("camera", [PLAIN, BENT])
def test_the_covariance_agrees_with_many_noisy_images(camera):
    """Truth = exp(V) estimate; variances and correlations within 6 percent."""
    p, T = views(11, 7, 1)
    sigma, exact = 0.2, project(camera, p, T)
    noise = sigma * np.random.default_rng(2).normal(size=(4000, 7, 2))
    found = rs.vision.estimate_pose(p, exact + noise, camera)
    V = twist(T.matrix @ rs.Pose(found.T_c_o).inv().matrix)
    C = rs.vision.estimate_pose(p, exact, camera, noise=sigma).covariance[0]
    deviations = np.sqrt(np.diag(C))
    scale = np.outer(deviations, deviations)
    close(np.cov(V.T) / scale, C / scale, 0.06)
    close(found.covariance.mean(0), C, 0.05 * np.abs(C).max())  # sigma from the residuals
    assert np.abs(V.mean(0)).max() < 0.1 * deviations.max()
    expected = sigma * np.sqrt((14 - 6) / 14)
    close(np.sqrt(np.square(found.rms).mean()), expected, 0.02 * expected)


def chi_squares(tilt, distance, runs=2000, spread=False):
    """Errors V of poses of a square at 1 px by their covariance, V' C^-1 V, for sure poses only.

    The square is turned by `tilt` degrees about any axis across the view, or by up to that.
    """
    rng = np.random.default_rng(11)
    axis = np.stack([np.cos(a := rng.uniform(0, 2 * np.pi, runs)), np.sin(a)], axis=1)
    size = np.radians(tilt) * (np.sqrt(rng.uniform(size=(runs, 1))) if spread else 1.0)
    still = np.zeros((runs, 3))
    T = np.array(rs.Pose.exp(np.concatenate([still, size * axis, still[:, :1]], axis=1)).matrix)
    T[:, :3, 3] = 0.03, -0.02, distance
    pixels = PLAIN.project(SQUARE @ np.swapaxes(T[:, :3, :3], 1, 2) + T[:, None, :3, 3], np.eye(4))
    noisy = pixels + rng.normal(size=pixels.shape)
    found = rs.vision.estimate_pose(SQUARE, noisy, PLAIN, noise=1.0)
    off = rs.Pose(T) @ rs.Pose(found.T_c_o).inv()
    v = off.position - np.cross(off.rotvec, off.position) / 2
    V = np.concatenate([v, off.rotvec], axis=1)[~found.ambiguous]
    C = found.covariance[~found.ambiguous]
    return np.einsum("bi,bij,bj->b", V, np.linalg.inv(C), V)


@pytest.mark.full
@pytest.mark.parametrize(
    ("tilt", "distance"), [(30, 1.0), (0, 0.5), (0, 0.75), (10, 1.0), (50, 1.0)]
)
def test_the_pose_of_a_square_is_as_certain_as_its_covariance(tilt, distance):
    """The mean over 2000 images is 6, the degrees of freedom."""
    assert 5.5 < chi_squares(tilt, distance).mean() < 6.6


@pytest.mark.full
def test_of_all_tilts_together_the_covariance_of_a_square_is_right():
    """The covariance covers all poses that the image leaves likely, so it is right on average.

    Of squares at a metre that face the camera exactly, with the least foreshortening, the mean
    is up to 6.9; to first order it is 8.2.
    """
    assert chi_squares(25, 1.0, spread=True).mean() == pytest.approx(6.0, abs=0.3)
    assert 6.0 < chi_squares(0, 1.0).mean() < 7.0


def noisy_squares(noise, runs=167, least=0.3, most=12.0):
    """Pixels of squares in all directions and distances, tilted by up to 85 degrees, with noise."""
    rng = np.random.default_rng(int(100 * noise))
    turn, tilt = rng.uniform(-np.pi, np.pi, runs), np.radians(rng.uniform(0, 85, runs))
    axis = np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=1)
    depth = least * (most / least) ** rng.uniform(size=runs)
    aside = rng.uniform(-0.2, 0.2, (2, runs)) * depth
    T = rs.Pose.at(*aside, depth, rotvec=axis * tilt[:, None]).matrix
    pixels = PLAIN.project(SQUARE @ np.swapaxes(T[:, :3, :3], 1, 2) + T[:, None, :3, 3], np.eye(4))
    return pixels + noise * rng.normal(size=pixels.shape)


def count_singular(covariance):
    """Number of covariances (B, 6, 6) without a Cholesky factor of their correlations."""
    deviations = np.sqrt(np.einsum("bii->bi", covariance))
    correlations = covariance / deviations[:, :, None] / deviations[:, None]
    return int((np.linalg.eigvalsh(correlations)[:, 0] < 1e-12).sum())


@pytest.mark.full
def test_the_covariance_of_a_plane_is_never_singular():
    """1,002 views with noise of 0.1 to 10 px, and a noise that is given or unknown."""
    for noise in (0.1, 0.3, 1.0, 2.0, 4.0, 10.0):
        pixels = noisy_squares(noise)
        for sigma in (noise, None):
            found = rs.vision.estimate_pose(SQUARE, pixels, PLAIN, noise=sigma)
            valid = np.isfinite(found.rms)
            assert valid.mean() > 0.95 and count_singular(found.covariance[valid]) == 0


@pytest.mark.parametrize("factor", [0.0, 1.0, 1e2, 1e4])
def test_the_moment_of_a_narrow_likelihood_agrees_with_quadrature(factor):
    """r = z + a z^3 in the last two directions: with one grid the moment was 0 for a = 100."""

    def residuals(rows, z):
        r = z.copy()
        r[..., 2:] += factor * z[..., 2:] ** 3
        return r

    def weight(z):
        return np.exp(-((z + factor * z**3) ** 2) / 2)

    end = min(8.0, 3 * factor ** (-1 / 3)) if factor else 8.0
    mass, square = (
        integrate.quad(lambda z, n=n: z**n * weight(z), -end, end, epsabs=1e-13)[0] for n in (0, 2)
    )
    moment = second_moment(residuals, -np.eye(4)[None])[0]
    close(moment, np.diag([1.0, 1.0, square / mass, square / mass]), 0.13 * square / mass)


def test_no_pose_fits_the_image_better():
    """The pixels of a pinhole with square pixels: the estimate is the maximum of likelihood."""
    p, T = views(5, 5)
    rng = np.random.default_rng(5)
    pixels = project(PLAIN, p, T) + rng.normal(size=(20, 5, 2))
    found = rs.vision.estimate_pose(p, pixels, PLAIN)
    both = np.isfinite(found.other_rms)
    assert both.sum() > 5 and (found.other_rms[both] > found.rms[both]).all()
    for T, least, u in (
        (found.T_c_o, found.rms, pixels),
        (found.other[both], found.other_rms[both], pixels[both]),
    ):
        for _ in range(20):
            moved = rs.Pose.exp(rng.normal(size=(len(T), 6)) * 1e-3) @ rs.Pose(T)
            rms = np.sqrt(np.square(project(PLAIN, p, moved) - u).mean((-1, -2)))
            assert (rms > least).all()


def test_of_a_thick_target_far_away_there_is_no_other_pose():
    """Its mirror image leads back to it, slowly."""
    p, T = views(3, 12, 40)
    far = T.matrix.copy()
    far[:, :3, 3] *= 5
    pixels = project(PLAIN, p, rs.Pose(far)) + np.random.default_rng(3).normal(size=(40, 12, 2))
    found = rs.vision.estimate_pose(p, pixels, PLAIN)
    assert np.isnan(found.other_rms).all() and not found.ambiguous.any()


# points


def rig(seed, runs=8, points=5):
    """Points (runs, points, 3) before two cameras that squint, and the pose of the second."""
    rng = np.random.default_rng(seed)
    X = rng.uniform([-0.4, -0.3, 1.0], [0.4, 0.3, 3.0], (runs, points, 3))
    low, high = [0.1, -0.05, -0.05, -0.1, -0.3, -0.1], [0.4, 0.05, 0.05, 0.1, 0.0, 0.1]
    return X, rs.Pose.exp(rng.uniform(low, high, (runs, 6)))


def in_both(X, T, left=PLAIN, right=BENT):
    return left.project(X, rs.Pose.at()), right.project(X, T)


@steady
@given(seed=seeds)
def test_exact_images_give_the_points(seed):
    X, T = rig(seed)
    a, b = in_both(X, T)
    close(rs.vision.triangulate(a, b, PLAIN, BENT, T).points, X, 1e-12)
    back = rs.vision.triangulate(b, a, BENT, PLAIN, T.inv())
    close(T @ back.points, X, 1e-12)


@steady
@given(seed=seeds)
def test_no_point_fits_both_images_better(seed):
    X, T = rig(seed)
    rng = np.random.default_rng(seed)
    a, b = (p + rng.normal(size=p.shape) for p in in_both(X, T, right=PLAIN))
    found = rs.vision.triangulate(a, b, PLAIN, PLAIN, T).points

    def miss(points):
        one, two = in_both(points, T, right=PLAIN)
        return np.square(one - a).sum(-1) + np.square(two - b).sum(-1)

    for _ in range(10):
        assert (miss(found + rng.normal(size=X.shape) * 1e-3) > miss(found)).all()


def test_the_covariance_of_points_agrees_with_many_noisy_images():
    X, T = rig(3, 1)
    a, b = in_both(X[0], T[0])
    rng, sigma = np.random.default_rng(4), 0.2
    noisy = [p + sigma * rng.normal(size=(8000, *p.shape)) for p in (a, b)]
    found = rs.vision.triangulate(*noisy, PLAIN, BENT, T[0], noise=sigma)
    C = rs.vision.triangulate(a, b, PLAIN, BENT, T[0], noise=sigma).covariance
    deviations = np.sqrt(np.diagonal(C, axis1=1, axis2=2))
    for n in range(len(C)):
        scale = np.outer(deviations[n], deviations[n])
        close(np.cov(found.points[:, n].T) / scale, C[n] / scale, 0.06)
    assert (np.abs(found.points.mean(0) - X[0]) < 0.1 * deviations).all()


def test_a_parallel_rig_has_the_depth_error_of_the_textbook():
    """sigma_Z = Z^2 sigma sqrt 2 / (f b) for a point on the midline."""
    Z, base, sigma = np.array([0.5, 1.0, 4.0, 20.0]), 0.12, 0.3
    X = np.stack([np.full(4, base / 2), np.zeros(4), Z], axis=-1)
    T = rs.Pose.at(base, 0, 0)
    a, b = in_both(X, T, right=PLAIN)
    C = rs.vision.triangulate(a, b, PLAIN, PLAIN, T, noise=sigma).covariance
    expected = Z**2 * sigma * np.sqrt(2) / (800 * base)
    np.testing.assert_allclose(np.sqrt(C[:, 2, 2]), expected, rtol=1e-12)


def test_a_point_off_the_epipolar_line_is_a_miss_and_one_along_it_is_not():
    """In a parallel rig of equal cameras an offset d of a row is shared: d/2 in each image."""
    T, X = rs.Pose.at(0.12, 0, 0), np.array([[0.1, 0.05, 1.5]])
    a, b = in_both(X, T, right=PLAIN)
    across = rs.vision.triangulate(a, b + np.array([0, 30]), PLAIN, PLAIN, T)
    np.testing.assert_allclose(across.miss, 30 / np.sqrt(2), rtol=1e-9)
    along = rs.vision.triangulate(a, b + np.array([30, 0]), PLAIN, PLAIN, T)
    assert along.miss < 1e-9
    assert np.linalg.norm(along.points - X) > 0.5


def test_the_miss_of_noise_is_as_large_as_the_noise_of_a_coordinate():
    X, T = rig(9, 1, 2000)
    rng = np.random.default_rng(9)
    a, b = (p + 0.3 * rng.normal(size=p.shape) for p in in_both(X, T))
    found = rs.vision.triangulate(a, b, PLAIN, BENT, T)
    np.testing.assert_allclose(np.sqrt(np.square(found.miss).mean()), 0.3, rtol=0.05)


def test_points_at_infinity_or_beyond_are_nan_and_the_others_are_not():
    T = rs.Pose.at(0.1, 0, 0)
    a = np.array([[340.0, 240], [340, 240], [340, 240], [np.nan, 240]])
    b = np.array([[300.0, 240], [340, 240], [342, 240], [300, 240]])
    found = rs.vision.triangulate(a, b, PLAIN, PLAIN, T)
    close(found.points[0], [0.05, 0, 2], 1e-14)
    for each in (found.points, found.covariance, found.miss):
        assert np.isnan(each[1:]).all()


def test_points_have_the_same_bits_alone_and_in_a_batch():
    X, T = rig(6, 40)
    rng = np.random.default_rng(6)
    a, b = (p + rng.normal(size=p.shape) for p in in_both(X, T))
    a[5, 2] = np.nan
    batch = rs.vision.triangulate(a, b, PLAIN, BENT, T)
    for i in (0, 5, 39):
        alone = rs.vision.triangulate(a[i], b[i], PLAIN, BENT, T[i])
        one = rs.vision.triangulate(a[i, :1], b[i, :1], PLAIN, BENT, T[i])
        for name in ("points", "covariance", "miss"):
            np.testing.assert_array_equal(getattr(alone, name), getattr(batch, name)[i])
            np.testing.assert_array_equal(getattr(one, name), getattr(batch, name)[i, :1])


# planes


def planes(seed, runs=20, points=6):
    """R_b_a, t / d, n and normalised points of planes before both cameras."""
    rng = np.random.default_rng(seed)
    turn = rs.Pose.exp(rng.uniform(-0.4, 0.4, (runs, 6))).rotation
    t = rng.uniform(-0.3, 0.3, (runs, 3))
    n = rng.uniform([-0.5, -0.5, 1], [0.5, 0.5, 1], (runs, 3))
    n /= np.linalg.norm(n, axis=1, keepdims=True)
    a = rng.uniform(-0.4, 0.4, (runs, points, 2))
    rays = np.concatenate([a, np.ones((runs, points, 1))], axis=-1)
    X = rays / (rays @ n[..., None])
    Y = X @ np.swapaxes(turn, 1, 2) + t[:, None]
    assert (X[..., 2] > 0).all() and (Y[..., 2] > 0).all()
    return turn, t, n, a, Y[..., :2] / Y[..., 2:]


@steady
@given(seed=seeds, points=st.sampled_from([4, 5, 30]))
def test_a_homography_agrees_with_the_motion_itself(seed, points):
    R, t, n, a, b = planes(seed, points=points)
    expected = R + t[:, :, None] * n[:, None]
    H = rs.vision.estimate_homography(a, b)
    close(H, expected, 1e-9)  # four points that are nearly three are among them
    H = rs.vision.estimate_homography(800 * a + 3, 700 * b - 5)  # pixels: up to scale
    K, M = np.diag([700.0, 700, 1]), np.diag([800.0, 800, 1])
    K[:2, 2], M[:2, 2] = -5, 3
    mapped = np.linalg.inv(K) @ H @ M
    close(mapped / np.linalg.svd(mapped, compute_uv=False)[:, 1, None, None], expected, 1e-8)


@steady
@given(seed=seeds)
def test_the_motion_is_among_the_motions_of_its_homography(seed):
    R, t, n, a, b = planes(seed)
    found = rs.vision.decompose_homography(3.0 * rs.vision.estimate_homography(a, b), a)
    whole = np.concatenate([R.reshape(-1, 9), t, n], axis=1)
    mine = [found.rotations.reshape(-1, 4, 9), found.translations, found.normals]
    apart = np.abs(np.concatenate(mine, axis=-1) - whole[:, None]).max(-1)
    assert (np.where(found.in_front, apart, np.inf).min(1) < 1e-6).all()
    assert (found.in_front.sum(1) <= 2).all()
    rebuilt = found.rotations + found.translations[..., None] * found.normals[..., None, :]
    close(rebuilt, np.repeat(rs.vision.estimate_homography(a, b)[:, None], 4, axis=1), 1e-12)
    close(found.rotations @ np.swapaxes(found.rotations, -1, -2), np.eye(3) + 0 * rebuilt, 1e-13)


def test_a_rotation_alone_is_one_motion_without_translation():
    R = rs.Pose.at(rotvec=(0.3, -0.2, 0.5)).rotation
    found = rs.vision.decompose_homography([2 * R, R + np.outer([0.2, 0.1, 0], [0, 0, 1])])
    close(found.rotations[0, 0], R, 1e-14)
    close(found.translations[0, 0], np.zeros(3), 0)
    assert found.in_front[0].tolist() == [True, False, False, False]
    assert np.isnan(found.rotations[0, 1:]).all() and np.isfinite(found.rotations[1]).all()


def test_a_translation_along_the_normal_is_found():
    """Twice: a double root, which rounding moves by the root of itself."""
    n = np.array([0.6, 0, 0.8])
    found = rs.vision.decompose_homography(np.eye(3) + np.outer(-0.3 * n, n))
    ahead = found.in_front
    close(found.translations[ahead], np.tile(-0.3 * n, (2, 1)), 1e-7)
    close(found.normals[ahead], np.tile(n, (2, 1)), 1e-7)


def test_a_homography_has_the_same_bits_alone_and_in_a_batch():
    _, _, _, a, b = planes(9, 50)
    H = rs.vision.estimate_homography(a, b)
    found = rs.vision.decompose_homography(H, a)
    for i in (0, 17, 49):
        np.testing.assert_array_equal(rs.vision.estimate_homography(a[i], b[i]), H[i])
        alone = rs.vision.decompose_homography(H[i], a[i])
        for name in ("rotations", "translations", "normals", "in_front"):
            np.testing.assert_array_equal(getattr(alone, name), getattr(found, name)[i])


def test_three_of_four_points_on_a_line_leave_the_homography_open():
    a = np.array([[0.0, 0], [0.1, 0], [0.2, 0], [0, 0.1]])
    _, _, _, good, other = planes(1, 1, 4)
    H = rs.vision.estimate_homography([a, good[0]], [a, other[0]])
    assert np.isnan(H[0]).all() and np.isfinite(H[1]).all()
    assert np.isnan(
        rs.vision.estimate_homography([good[0], a], [a, good[0]])
    ).all()  # there is none at all
    square = np.array([[-1.0, -1], [1, -1], [1, 1], [-1, 1]])
    for one, twice in ((square, square[[0, 0, 2, 3]]), (square, a)):
        assert np.isnan(rs.vision.estimate_homography(one, twice)).all()
        assert np.isnan(rs.vision.estimate_homography(twice, one)).all()
    for close_by in (1e-300, 1e-320, 0.0):
        assert np.isnan(rs.vision.estimate_homography(square, close_by * square)).all()
    gap = np.array([good[0], good[0]])
    gap[0, 1] = np.nan
    H = rs.vision.estimate_homography(gap, other[0])
    assert np.isnan(H[0]).all() and np.isfinite(H[1]).all()
