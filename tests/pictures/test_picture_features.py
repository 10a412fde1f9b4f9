"""Features of pictures: L against pictures after small motions, closed forms, goals, and bits."""

import numpy as np
import pytest

import robsim as rs
from robsim.features.feature import Observation
from robsim.shapes import Light, Poster

F = rs.features
FULL = Light(ambient=1.0)
CAMERA = rs.Camera([[80, 0, 39.5], [0, 80, 29.5], [0, 0, 1]], (80, 60))
GOAL = rs.Pose.at(0.02, -0.03, 1.2, rpy=(0.15, -0.1, 0.2))  # of the poster in the camera
BESIDE = rs.Pose.at(0.012, -0.01, 0.02, rotvec=(0.01, 0.012, 0.02)).inv() @ GOAL
MARKS = np.array([[-0.3, -0.2, 0], [0.3, -0.2, 0], [0.3, 0.2, 0], [-0.3, 0.2, 0]])
LINEAR = {
    "cosines": F.CosineCoefficients(),
    "components": F.PrincipalComponents(),
    "moments": F.PhotometricMoments(),
    "decoupled": F.PhotometricMoments(form="decoupled"),
}
DENSE = {
    "mixture": F.PhotometricMixture(border=8, extension=4.0, final_extension=4.0),
    "defocus": F.Defocus(border=8, focus=0.8),
    "histogram": F.Histogram(border=6),
    "information": F.MutualInformation(border=6),
}


def draw_smooth_picture(seed=0):
    """Return a picture whose shortest wave is 40 texels long."""
    y, x = np.mgrid[:480, :640]
    random = np.random.default_rng(seed)
    waves = np.zeros(x.shape)
    for length in (40, 50, 60, 80, 110, 150, 220, 300):
        turn, phase = random.uniform(0, 2 * np.pi, 2)
        k = 2 * np.pi / length
        waves += length**0.5 * np.cos(k * (np.cos(turn) * x + np.sin(turn) * y) + phase)
    return np.rint(np.clip(127.5 + 45 * waves / waves.std(), 0, 255)).astype(np.uint8)


POSTER = Poster(draw_smooth_picture(), 3.0)


def see(*poses, poster=POSTER):
    """Return the observation of a poster at poses in the camera, with its true depth."""
    seen = [one_view(pose, poster) for pose in poses]
    pixels, depth, pictures = (np.stack(each) for each in zip(*seen, strict=True))
    return Observation.of(pixels, depth, CAMERA, pictures=pictures)


def one_view(pose, poster):
    """Return pixels and depths of the marks, and the picture."""
    wall = rs.Object("wall", poster, pose=pose)
    eye = rs.MountedCamera("eye", CAMERA)
    picture = rs.Scene(objects=wall, cameras=eye).picture(samples=2, light=FULL)
    X = MARKS @ pose.rotation.T + pose.position
    return CAMERA.project(X, rs.Pose.at()), X[:, 2], picture


def differentiate(measure, pose, step):
    """Return the derivatives (k, 6) by the twist of the camera, from pictures on both sides."""
    columns = []
    for axis in np.eye(6):
        ends = [
            measure(see(rs.Pose.at(*h * axis[:3], rotvec=h * axis[3:]).inv() @ pose))
            for h in (step, -step)
        ]
        columns.append((ends[0] - ends[1]) / (2 * step))
    return np.stack(columns, axis=-1)


def compare(found, expected):
    """Return correlation and gain of found numbers, each row over its own size."""
    size = np.sqrt((expected**2).sum(axis=-1, keepdims=True))
    a, b = (found / size).ravel(), (expected / size).ravel()
    return np.corrcoef(a, b)[0, 1], a @ b / (b @ b)


@pytest.mark.parametrize("name", LINEAR)
@pytest.mark.few(2)
def test_linear_features_change_with_L(name):
    feature = LINEAR[name].towards(see(GOAL))
    L = feature.interaction(see(BESIDE))[0]
    slopes = [differentiate(lambda s: feature.measure(s)[0], BESIDE, h) for h in (0.01, 0.02)]
    correlation, gain = compare(L, slopes[0])
    assert correlation > 0.999
    assert abs(gain - 1) < 0.01
    farther = np.abs(L - slopes[1]).max(axis=-1) / np.abs(slopes[1]).max()
    nearer = np.abs(L - slopes[0]).max(axis=-1) / np.abs(slopes[0]).max()
    assert np.median(nearer) < max(np.median(farther), 0.02)  # of second order, above the noise


@pytest.mark.parametrize("name", DENSE)
def test_the_gradient_of_dense_features_is_L_times_the_error(name):
    feature = DENSE[name].towards(see(GOAL))
    found = feature.compute_normal_equations(see(BESIDE))
    slope = differentiate(lambda s: feature.compute_normal_equations(s).c, BESIDE, 0.01) / 2
    correlation, gain = compare(found.g, slope)
    assert correlation > 0.999
    assert abs(gain - 1) < 0.02


@pytest.mark.parametrize("name", DENSE)
def test_the_error_of_seven_numbers_keeps_the_norm_and_the_step(name):
    feature, seen = DENSE[name].towards(see(GOAL)), see(BESIDE)
    H, g, c = (each[0] for each in feature.compute_normal_equations(seen))
    s, L = feature.measure(seen)[0], feature.interaction(seen)[0]
    np.testing.assert_allclose(np.linalg.lstsq(L, s)[0], np.linalg.solve(H, g), rtol=1e-6)
    np.testing.assert_allclose(s @ s, c, rtol=1e-9)


@pytest.mark.parametrize("name", [*LINEAR, *DENSE])
def test_pictures_alone_have_the_bits_of_a_batch(name):
    feature = {**LINEAR, **DENSE}[name].towards(see(GOAL))
    poses = GOAL, BESIDE, rs.Pose.at(0, 0, -0.1) @ GOAL
    together, alone = see(*poses), [see(pose) for pose in poses]
    for read in (feature.measure, feature.interaction, feature.find_faults):
        np.testing.assert_array_equal(read(together), np.concatenate([read(s) for s in alone]))
    again = {**LINEAR, **DENSE}[name].towards(see(GOAL))
    np.testing.assert_array_equal(again.measure(together), feature.measure(together))


@pytest.mark.parametrize("name", [*LINEAR, *DENSE])
def test_goals_that_differ_from_run_to_run(name):
    feature = {**LINEAR, **DENSE}[name]
    goals, seen = (GOAL, BESIDE, GOAL), (BESIDE, GOAL, GOAL)
    together = feature.towards(see(*goals)).measure(see(*seen))
    for b, (goal, now) in enumerate(zip(goals, seen, strict=True)):
        np.testing.assert_array_equal(feature.towards(see(goal)).measure(see(now))[0], together[b])


@pytest.mark.parametrize("name", [*LINEAR, *DENSE])
@pytest.mark.parametrize(
    "model",
    ["current", *(pytest.param(each, marks=pytest.mark.full) for each in ("desired", "mean"))],
)
def test_features_of_pictures_servo(name, model):
    near = "decoupled" if name == "decoupled" else "clouds"
    scene = build_flying_scene(near)
    feature = {**LINEAR, **DENSE, "decoupled": DECOUPLED}[name]
    start = rs.Pose.at(0.03, -0.02, -1.03, rotvec=(0.01, 0.02, 0.05))
    task = rs.IBVS(FLYING_GOAL.q, features=feature, interaction=model, gain=4.0)
    run = rs.simulate(scene, task, start.q, dt=0.04, duration=6.0, record="summary")
    assert run.outcome == rs.Outcome.CONVERGED
    assert run.distance_to_goal < 3e-3


FLYING_GOAL = rs.Pose.at(0, 0, -1.0)
DECOUPLED = F.PhotometricMoments(form="decoupled", tolerance=1e-4)


def build_flying_scene(kind):
    """Return a flying camera before a poster: a smooth one, or bright blobs on black."""
    poster = Poster(draw_blobs(), 1.6) if kind == "decoupled" else Poster(draw_smooth_picture(), 3)
    eye = rs.MountedCamera("eye", CAMERA, on="free_camera.body")
    wall = rs.Object("wall", poster, marks=MARKS)
    return rs.Scene(rs.robots.load("free_camera"), wall, eye, background=0, light=FULL)


def draw_blobs():
    """Return a picture of three bright blobs on a black ground."""
    y, x = np.mgrid[:480, :640]
    values = np.zeros(x.shape)
    for u, v, wide, high, grey in ((300, 240, 60, 35, 200), (370, 200, 25, 30, 150)):
        values += grey * np.exp(-((x - u) ** 2) / (2 * wide**2) - (y - v) ** 2 / (2 * high**2))
    values += 120 * np.exp(-((x - 260) ** 2) / 648 - (y - 290) ** 2 / 648)
    return np.rint(np.clip(values, 0, 255)).astype(np.uint8)


def test_the_centre_of_a_blob_is_the_centre_of_its_moments():
    y, x = np.mgrid[:60, :80]
    picture = np.rint(240 * np.exp(-((x - 39.5) ** 2 + (y - 29.5) ** 2) / 32)).astype(np.uint8)
    seen = Observation.of(
        np.array([[20, 20], [60, 20], [60, 40], [20, 40]]),
        np.full(4, 1.5),
        CAMERA,
        pictures=picture,
    )
    moments = F.PhotometricMoments(form="decoupled").towards(seen)
    centre, mu, R = moments._centre(seen)
    np.testing.assert_allclose(centre[:, 0], 0, atol=1e-6)
    # a Gaussian of 4 px times the window, whose second moment is that of the Gaussian to 5 %
    np.testing.assert_allclose(mu[[3, 5], 0] / mu[0, 0], (4 / 80) ** 2, rtol=0.08)
    np.testing.assert_allclose(moments.measure(seen)[0, 2], 1.5)  # an = Z* at the goal
    np.testing.assert_allclose(R[1, :2, 0], [-1 / 1.5, 0], rtol=0.08, atol=1e-4)


def test_cosines_of_a_ramp_have_a_closed_form():
    ramp = np.tile(np.arange(80, dtype=np.uint8), (60, 1))
    seen = Observation.of([[20, 20]], [1.0], CAMERA, pictures=ramp)
    s = F.CosineCoefficients(coefficients=9).towards(seen).measure(seen)[0]
    n, p = 72, 1  # type II of u: -sqrt(2/n) cos(pi p / 2n) / (2 sin(pi p / 2n)^2), for odd p
    expected = -np.cos(np.pi * p / (2 * n)) / (2 * np.sin(np.pi * p / (2 * n)) ** 2)
    np.testing.assert_allclose(s[0], np.sqrt(2 / n) * expected / np.sqrt(n), rtol=1e-6)
    np.testing.assert_allclose(s[[1, 2, 3, 4]], 0, atol=1e-4)


def test_principal_components_are_the_singular_vectors_of_the_warped_pictures():
    from robsim.kernels.image_features.principal_pictures import find_principal_pictures

    pictures = np.random.default_rng(2).normal(size=(24, 320)).astype(np.float32)
    pictures[:, :40] *= np.linspace(8, 2, 24)[:, None].astype(np.float32)
    basis, squares = np.empty((5, 320), dtype=np.float32), np.empty(24)
    centred = pictures - pictures.mean(axis=0)
    find_principal_pictures(pictures, basis, squares)
    _, sizes, Vt = np.linalg.svd(centred.astype(float), full_matrices=False)
    np.testing.assert_allclose(squares[:23], sizes[:23] ** 2, rtol=1e-4)
    np.testing.assert_allclose(np.abs((basis * Vt[:5]).sum(axis=1)), 1, atol=1e-4)


def test_warped_pictures_equal_rendered_ones():
    from robsim.features.images.picture_plane import build_picture_plane
    from robsim.features.images.plane_motions import list_small_motions, warp_picture

    plane, goal = build_picture_plane(CAMERA, 8), see(GOAL)
    for R, t in list(list_small_motions(6, 0.05, 0.05))[1:]:
        moved = rs.Pose(np.block([[R, t[:, None]], [np.zeros(3), 1.0]]))
        rendered = see(moved.inv() @ GOAL).pictures[0, 8:-8, 8:-8].ravel().astype(float)
        warped = warp_picture(
            goal.pictures[0].astype(np.float32), plane, goal.plane_last[:, 0], R, t
        )
        inside = np.abs(rendered - warped)
        assert np.quantile(inside, 0.8) < 2.5  # the rest left the picture at the goal


def test_the_information_is_least_missing_at_the_goal():
    feature = F.MutualInformation(border=6).towards(see(GOAL))
    at_goal = feature.compute_normal_equations(see(GOAL))
    np.testing.assert_allclose(np.linalg.solve(at_goal.H[0], at_goal.g[0]), 0, atol=1e-6)
    hessian = differentiate(lambda s: feature.compute_normal_equations(s).g[0], GOAL, 0.005)
    correlation, gain = compare(at_goal.H[0], hessian)
    assert correlation > 0.999
    assert abs(gain - 1) < 0.05
    assert (np.linalg.eigvalsh(at_goal.H[0]) > 0).all()


def test_the_extension_shrinks_towards_the_goal():
    feature = F.PhotometricMixture(extension=6.0, border=8).towards(see(GOAL))
    poses = [rs.Pose.at(x, 0, 0) @ GOAL for x in (0.0, 0.03, 0.1, 0.3)]
    extensions = feature.find_extensions(see(*poses))
    assert extensions[0] == 1.0
    assert (np.diff(extensions) >= 0).all()
    assert extensions[-1] == 6.0


def test_the_blur_of_a_thin_lens():
    lens = F.Defocus(focal_length=0.01, f_number=2.0, focus=1.0, pixel=1e-5)
    assert lens.find_blur(1.0)[0] == 0.0
    depths = np.array([0.5, 0.8, 1.5])
    blur, rate = np.array([lens.find_blur(Z) for Z in depths]).T
    disc = 0.01**2 * np.abs(depths - 1.0) / (2.0 * depths * (1.0 - 0.01)) / 1e-5
    np.testing.assert_allclose(blur, disc / 4)
    nearer = np.array([lens.find_blur(Z - 1e-6)[0] for Z in depths])
    np.testing.assert_allclose(rate, (blur - nearer) / 1e-6, rtol=1e-4)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: F.PhotometricMixture(final_extension=9.0), "larger than extension"),
        (lambda: F.Defocus(focus=0.01), "focal length"),
    ],
)
def test_fields_that_contradict_each_other(make, message):
    with pytest.raises(rs.errors.InputError, match=message):
        make()


@pytest.mark.parametrize(
    ("feature", "message"),
    [
        (F.PrincipalComponents(count=8, pictures=8), "need more than 8 pictures"),
        (F.CosineCoefficients(coefficients=1000, level=2), "1000 coefficients"),
        (F.Histogram(columns=90), "cells of"),
    ],
)
def test_too_much_for_a_picture(feature, message):
    with pytest.raises(rs.errors.GoalError, match=message):
        feature.towards(see(GOAL))


@pytest.mark.parametrize("name", [*LINEAR, *DENSE])
def test_goals_without_texture(name):
    feature = {**LINEAR, **DENSE}[name]
    blank = np.full((60, 80), 90, dtype=np.uint8)
    seen = Observation.of([[20, 20]], [1.0], CAMERA, pictures=blank)
    with pytest.raises(rs.errors.GoalError, match="constant"):
        feature.towards(seen)
    with pytest.raises(rs.errors.GoalError, match="no picture"):
        feature.towards(Observation.of([[20, 20]], [1.0], CAMERA))
    with pytest.raises(rs.errors.InputError, match="towards"):
        feature.measure(seen)


@pytest.mark.parametrize("change", [lambda grey: 255 - grey, lambda grey: 0.55 * grey + 60])
def test_information_needs_no_equal_light(change):
    scene = build_flying_scene("clouds")
    shown = np.rint(change(scene.picture(FLYING_GOAL.q).astype(float))).astype(np.uint8)
    goal = rs.tasks.TaughtGoal(FLYING_GOAL.q, picture=shown)
    start = rs.Pose.at(0.03, -0.02, -1.03, rotvec=(0.01, 0.02, 0.05))
    task = rs.IBVS(goal, features=F.MutualInformation(border=6), gain=4.0)
    run = rs.simulate(scene, task, start.q, dt=0.04, duration=8.0, record="summary")
    assert run.outcome == rs.Outcome.CONVERGED
    assert run.distance_to_goal < 1e-3
