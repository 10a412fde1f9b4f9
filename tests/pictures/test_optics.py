"""The errors of pictures against the linear model of a sensor, exact blurs and closed forms."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import ndimage, stats

import robsim as rs
from robsim.kernels.sensor.separable_blur import blur_image
from robsim.rendering.development import BAND_ROWS, EXPOSED_BAND_ROWS, EXPOSURE_TIMES, Development
from robsim.rendering.rendered_face import list_shape_faces
from robsim.rendering.renderer import FULL_LIGHT, Renderer
from robsim.rendering.sensor import Sensor
from robsim.rendering.sensor_tables import build_blur_weights, build_sensor_arrays
from robsim.shapes import Block, Light, Poster
from robsim.vision import Optics

K = np.array([[200.0, 1.5, 101.2], [0.0, 210.0, 73.4], [0.0, 0.0, 1.0]])
CAMERA = rs.Camera(K, (200, 150))
WIDE = rs.Camera(K, (400, 300))  # 120,000 pixels
RNG = np.random.default_rng(3)
CLOUDS = ndimage.gaussian_filter(RNG.uniform(0, 255, (150, 200)), 2).astype(np.float32)
NOISY = Optics(full_well=8000, read_noise=1.2)
DEPTH = 2.0  # of the board with a moving edge
TOP, BACKGROUND = 51.0, 200.0  # grey values of the board and behind it


def develop(light, optics, camera=CAMERA, **key):
    return Sensor(optics, camera).develop(np.asarray(light, dtype=np.float32), **key)


def flat(grey, camera=WIDE):
    return np.full(camera.size[::-1], grey, dtype=np.float32)


def find_noise(deviation=20.0, **key):
    """Return the noise of a grey picture in standard deviations, rounded by a twentieth."""
    return (develop(flat(127), Optics(read_noise=deviation), WIDE, **key) - 127.0) / deviation


def test_optics_without_errors_change_no_bit():
    for light in (CLOUDS, flat(300, CAMERA), flat(127.5, CAMERA)):
        clean = np.clip(np.rint(light), 0, 255).astype(np.uint8)
        np.testing.assert_array_equal(develop(light, Optics()), clean)
    eye = rs.MountedCamera("eye", CAMERA)
    wall = rs.Object("wall", Poster(CLOUDS.astype(np.uint8), 2.0), pose=rs.Pose.at(0, 0, 1.5))
    pictures = [rs.Scene(objects=wall, cameras=replace(eye, optics=x)) for x in (None, Optics())]
    np.testing.assert_array_equal(*(scene.picture() for scene in pictures))


@pytest.mark.parametrize("gain", [0.7, 1.0, 2.5])
@pytest.mark.parametrize("light", [12.0, 25.0, 50.0, 90.0])
def test_the_variance_is_the_photon_transfer_curve(light, gain):
    """EMVA 1288: variance = K mean + dark variance + 1/12 of quantisation."""
    optics = Optics(full_well=8000, read_noise=1.2, gain=gain)
    image = develop(flat(light), optics, WIDE, seed=5).astype(float)
    mean, system_gain = gain * light, gain * 255 / 8000
    variance = system_gain * mean + (gain * 1.2) ** 2 + 1 / 12
    assert image.mean() == pytest.approx(mean, abs=4.5 * np.sqrt(variance / image.size))
    assert image.var() == pytest.approx(variance, rel=4.5 * np.sqrt(2 / image.size))


def test_normal_numbers_have_the_moments_and_tails_of_the_normal():
    table = build_sensor_arrays(NOISY, CAMERA).quantiles.astype(float)
    assert len(table) == 4096
    assert abs(table.mean()) < 1e-8 and 2 * (table**2).mean() == pytest.approx(1, abs=1e-6)
    excess = (table**4).mean() / (table**2).mean() ** 2 - 3
    assert abs(excess / 2) < 0.005  # of the sum of two entries
    assert 2 * table.max() == pytest.approx(5.29, abs=0.01)
    sums = abs(np.add.outer(table, table))
    for limit, bound in {1.0: 1e-3, 2.0: 1e-3, 3.0: 2e-3, 4.0: 0.07, 5.0: 0.4}.items():
        expected = 2 * stats.norm.sf(limit)
        assert (sums > limit).mean() == pytest.approx(expected, rel=bound)


def test_the_noise_of_pixels_has_the_distribution_of_the_table():
    noise = np.concatenate([find_noise(run=run) for run in range(4)])
    count = noise.size
    assert abs(noise.mean()) < 4.5 / np.sqrt(count)
    assert stats.kurtosis(noise, axis=None) == pytest.approx(0, abs=4.5 * np.sqrt(24 / count))
    for limit in (1.025, 2.025, 3.025, 3.525):  # between two grey values
        share = 2 * stats.norm.sf(limit)
        bound = 4.5 * np.sqrt(share / count) + 0.02 * share
        assert (abs(noise) > limit).mean() == pytest.approx(share, abs=bound)


def test_noise_is_independent_between_pixels_images_runs_and_seeds():
    noise = find_noise(seed=1, run=2, step=3)
    pairs = [(noise[:, k:], noise[:, :-k]) for k in (1, 2, 3)]
    pairs += [(noise[k:], noise[:-k]) for k in (1, 2, 3)]
    keys = (2, 2, 3), (1, 3, 3), (1, 2, 4), (2, 1, 3), (3, 2, 1), (1 << 63, 2, 3), (1, 1 << 61, 3)
    pairs += [(noise, find_noise(seed=s, run=r, step=k)) for s, r, k in keys]
    for one, other in pairs:
        for power in (1, 2):
            r = np.corrcoef(one.ravel() ** power, other.ravel() ** power)[0, 1]
            assert abs(r) < 4.5 / np.sqrt(one.size)


@pytest.mark.parametrize("width", [1, 2, 7, 8])
def test_every_pixel_of_an_image_of_any_width_has_noise(width):
    camera = rs.Camera(K, (width, 900))
    image = develop(flat(127, camera), Optics(read_noise=10), camera)
    assert image.std() == pytest.approx(10, rel=0.1)
    assert len(np.unique(image[:, -1])) > 20


def test_the_noise_of_an_image_depends_on_its_key_alone():
    sensor, light = Sensor(NOISY, CAMERA), CLOUDS
    keys = [(7, run, step) for run in range(3) for step in (0, 5)]
    first = [sensor.develop(light, *key) for key in keys]
    for key, image in reversed(list(zip(keys, first, strict=True))):
        np.testing.assert_array_equal(Sensor(NOISY, CAMERA).develop(light, *key), image)


@pytest.mark.parametrize("deviation", [0.1, 0.6, 1.0, 2.3, 6.0])
@pytest.mark.parametrize("size", [(150, 200), (4, 9), (1, 1)])
def test_defocus_is_a_gaussian_filter(deviation, size):
    image = RNG.uniform(0, 255, size).astype(np.float32)
    exact = ndimage.gaussian_filter(image.astype(float), deviation, mode="nearest", truncate=4.0)
    weights = build_blur_weights(deviation)
    blur_image(image, weights, np.empty(size[1] + 2 * len(weights) - 2, np.float32), image * 0)
    np.testing.assert_allclose(image, exact, atol=2e-4)


def test_blur_comes_before_noise():
    light = np.where(np.arange(200) < 100, 50.0, 150.0) * np.ones((150, 1))
    image = develop(light, Optics(defocus=2.0, read_noise=4.0)).astype(float)
    assert image[:, :80].std() == pytest.approx(4.0, rel=0.05)
    middle = image[:, 90:110].mean(axis=0)
    exact = 50 + 100 * stats.norm.cdf((np.arange(90, 110) - 99.5) / 2.0)
    np.testing.assert_allclose(middle, exact, atol=1.6)


@pytest.mark.parametrize("gamma", [0.45, 1.8, 2.2, 3.0])
def test_gamma_is_a_power_of_the_grey_value(gamma):
    light = np.linspace(0, 255, 30_000).reshape(150, 200).astype(np.float32)
    exact = 255 * (light.astype(float) / 255) ** (1 / gamma)
    error = develop(light, Optics(gamma=gamma)) - exact
    assert abs(error).max() < 0.5 + 0.02
    assert abs(error[exact > 20]).max() < 0.5 + 0.001


def test_vignetting_is_a_power_of_the_cosine():
    grey = develop(flat(250, CAMERA), Optics(vignetting=4.0))
    rays = np.linalg.inv(K) @ np.array([[0.0, 199.0, 101.0], [0.0, 149.0, 73.0], [1.0, 1.0, 1.0]])
    expected = 250 * (rays[2] / np.linalg.norm(rays, axis=0)) ** 4
    np.testing.assert_allclose(grey[[0, 149, 73], [0, 199, 101]], expected, atol=0.51)


def test_vignetting_of_a_fisheye_is_by_its_angle():
    lens = rs.Camera([[60.0, 0, 100], [0, 60, 75], [0, 0, 1]], (200, 150), lens="fisheye")
    grey = develop(flat(250, CAMERA), Optics(vignetting=2.0), lens)
    assert grey[75, 160] == round(250 * np.cos(60 / 60) ** 2)  # an angle of 1 rad
    assert grey[75, 199] == 0  # more than 90 degrees


def test_gain_saturates_at_white():
    grey = develop(CLOUDS, Optics(gain=2.0))
    np.testing.assert_array_equal(grey, np.clip(np.rint(2 * CLOUDS), 0, 255))
    assert develop(flat(250, CAMERA), Optics(gain=2.0, read_noise=0.01)).min() == 255


@pytest.mark.parametrize("bits", range(1, 9))
def test_bits_are_the_number_of_levels(bits):
    light = np.linspace(0, 255, 30_000).reshape(150, 200).astype(np.float32)
    top = 2**bits - 1
    exact = np.rint(np.rint(light.astype(float) * top / 255) * 255 / top)
    grey = develop(light, Optics(bits=bits))
    assert (grey != exact).mean() < 1e-3 and len(np.unique(grey)) == 2**bits
    assert grey.min() == 0 and grey.max() == 255


def build_edge(optics, lens=(), samples=1):
    """Return the development of a camera that sees a board to the left of an edge."""
    K = [[300.0, 0, 79.5], [0, 300.0, 59.5], [0, 0, 1]]
    camera = rs.Camera(K, (160, 120), distortion=lens)
    board = Poster(np.full((4, 4), TOP, np.uint8), 4.0, albedo=1.0)
    renderer = Renderer(camera, [list_shape_faces(board)], samples, BACKGROUND)
    return Development(renderer, optics, camera)


def draw_edge(optics, speed, column=80.0, **options):
    """Return the picture of a vertical edge at a column that moves by `speed` columns a second."""
    development = build_edge(optics, **options)
    columns = column - speed * development.offsets
    x = (columns - 79.5) / 300.0 * DEPTH
    poses = [rs.Pose.at(each - 2.0, 0, DEPTH).matrix[None] for each in x]
    return development.draw(np.array(poses), [FULL_LIGHT] * len(x), seed=0, run=0, step=0)


def find_edges(image):
    """Return the column of the edge in each row."""
    return (BACKGROUND - image.astype(float)).sum(axis=1) / (BACKGROUND - TOP) - 0.5


def test_an_exposure_turns_an_edge_into_a_ramp():
    travel, time = 24.0, 0.02  # columns in an exposure
    image = draw_edge(Optics(exposure=time), travel / time).astype(float)
    assert (image == image[0]).all()
    x = np.arange(160)
    share = np.clip((x - (80.0 - travel)) / travel, 0, 1)  # of the exposure before the edge came
    ramp = TOP + (BACKGROUND - TOP) * share
    step = (BACKGROUND - TOP) / EXPOSURE_TIMES
    assert abs(image[0] - ramp).max() <= 0.5 * step + (BACKGROUND - TOP) / travel / 2 + 1
    np.testing.assert_allclose(find_edges(image), 80.0 - travel / 2, atol=0.05)


def test_a_rolling_shutter_slants_a_moving_edge():
    travel, time = 30.0, 0.03
    edges = find_edges(draw_edge(Optics(readout=time), travel / time))
    y = np.arange(120)
    exact = 80.0 - travel * (119 - y) / 120
    assert abs(edges - exact).max() <= travel / 120 * BAND_ROWS / 2 + 0.1
    assert np.polyfit(y, edges, 1)[0] == pytest.approx(travel / 120, rel=0.01)
    bands = (edges - exact).reshape(-1, BAND_ROWS).mean(axis=1)
    np.testing.assert_allclose(bands, 0, atol=0.1)


def test_a_rolling_shutter_with_an_exposure_shifts_by_half_of_it():
    optics = Optics(readout=0.02, exposure=0.01)
    edges, y = find_edges(draw_edge(optics, 1000.0)), np.arange(120)
    exact = 80.0 - 1000.0 * (0.02 * (119 - y) / 120 + 0.005)
    assert abs(edges - exact).max() <= 20.0 / 120 * EXPOSED_BAND_ROWS / 2 + 0.1
    assert abs((edges - exact).mean()) < 0.05


def test_offsets_are_the_times_before_the_end_of_the_last_row():
    assert build_edge(Optics()).offsets.tolist() == [0.0]
    assert build_edge(NOISY).duration == 0
    exposed = build_edge(Optics(exposure=0.016))
    np.testing.assert_allclose(exposed.offsets, (np.arange(8) + 0.5) * 0.002)
    both = build_edge(Optics(exposure=0.016, readout=0.12))
    assert len(both.offsets) == 8 * 8 and both.duration == 0.136
    assert both.offsets.min() >= 0 and both.offsets.max() <= both.duration
    np.testing.assert_allclose(both.offsets[:8] - 0.001 * (119 - 7.5), exposed.offsets)
    np.testing.assert_allclose(both.offsets[-8:] - 0.001 * 3.5, exposed.offsets)


@pytest.mark.parametrize("lens", [(), (-0.25, 0.06, 0.001, -0.002)])
@pytest.mark.parametrize("samples", [1, 2])
def test_a_shutter_without_motion_draws_the_whole_picture(lens, samples):
    camera = rs.Camera(K, (200, 150), distortion=lens)
    block = list_shape_faces(Block(0.3, 0.2, 0.4, albedo=0.9))
    poster = list_shape_faces(Poster(CLOUDS.astype(np.uint8), 2.0))
    renderer = Renderer(camera, [block, poster], samples)
    poses = [rs.Pose.at(-0.2, 0, 1.4, rpy=(0.5, 0.7, 0.2)), rs.Pose.at(0, 0, 2, rpy=(0.2, 0.1, 0))]
    T_c_b, light = np.array([pose.matrix for pose in poses]), (0.0, 0.0, 1.0, 0.4)
    whole = renderer.draw(T_c_b, light)
    rows = [renderer.draw_rows(T_c_b, light, top, top + 10) for top in range(0, 150, 10)]
    difference = abs(np.concatenate(rows) - whole)
    assert (difference > 0.01).mean() < 2e-4  # an edge that passes a place in a pixel


def test_pictures_of_a_scene_have_their_noise_alone_and_in_a_batch():
    camera = rs.load_scenario(rs.examples.path("eye_in_hand")).scene.camera()
    noisy = replace(camera, optics=replace(NOISY, defocus=0.8, exposure=0.01, readout=0.01))
    scene = rs.load_scenario(rs.examples.path("eye_in_hand")).scene.replacing(noisy)
    q = np.array(scene.home) + 0.01 * np.arange(3)[:, None]
    batch, again = scene.picture(q, seed=4), scene.picture(q[:2], seed=4)
    np.testing.assert_array_equal(batch[:2], again)
    np.testing.assert_array_equal(batch[0], scene.picture(q[0], seed=4))
    assert (batch[0] != scene.picture(q[0], seed=5)).mean() > 0.5
    light = scene.picture(q[0], exact=True)
    np.testing.assert_array_equal(light, scene.replacing(camera).picture(q[0], exact=True))
    expected = Sensor(noisy.optics, camera.camera).develop(light, seed=4)
    np.testing.assert_array_equal(batch[0], expected)


def test_a_scene_with_light_and_vignetting():
    wall = rs.Object("wall", Block(4, 4, 0.1, albedo=0.8), pose=rs.Pose.at(0, 0, 2))
    eye = rs.MountedCamera("eye", CAMERA, optics=Optics(vignetting=4.0, gain=0.5))
    image = rs.Scene(objects=wall, cameras=eye).picture(light=Light(ambient=1.0))
    assert image[73, 101] == 102 and image[0, 0] < 85


TEXT = """
schema = 1
robots = [{ model = "free_camera" }]
task = { kind = "ibvs" }
start = { q = ["2 cm", "1 cm", "-10 cm", 0, 0, 0, 1] }
run = { duration = "200 ms" }
[[objects]]
name = "plate"
position = "0, 0, 50 cm"
marks = ["-5, -5, 0 cm", "5, -5, 0 cm", "5, 5, 0 cm", "-5, 5, 0 cm"]
[[cameras]]
name = "eye"
on = "free_camera.body"
size = [640, 480]
focal = 800
optics = { full_well = 10000, read_noise = 1.5, exposure = "2 ms" }
"""


def test_optics_in_a_scenario_file_are_read_changed_and_varied():
    experiment = rs.Experiment.from_text(TEXT)
    assert experiment.scene.camera().optics == Optics(10_000, 1.5, exposure=0.002)
    assert "optics = { full_well = 10000, read_noise = 1.5" in experiment.to_toml()
    run = experiment.run()
    assert rs.Experiment.of(run) == experiment and rs.replay(run).identical(run)
    changed = experiment.at("cameras.eye.optics.exposure", "3 ms")
    assert changed.scene.camera().optics.exposure == 0.003
    varied = experiment.vary({"cameras.eye.optics.gain": [1.0, 2.0, 4.0]})
    assert [varied.of_run(k).scene.camera().optics.gain for k in range(3)] == [1.0, 2.0, 4.0]
    stacked = Optics(defocus=1.0)
    object.__setattr__(stacked, "gain", np.array([1.0, 2.0]))
    assert stacked.of_run(1) == Optics(defocus=1.0, gain=2.0)


def test_a_belief_has_no_optics_of_its_own():
    experiment = rs.Experiment.from_text(TEXT)
    believed = experiment.at("belief.cameras.eye.focal", 700.0)
    believed.at("cameras.eye.optics.gain", 2.0).run()  # the belief follows
    with pytest.raises(rs.errors.InputError, match="optics of camera 'eye': a controller does not"):
        believed.at("belief.cameras.eye.optics.gain", 2.0).run()
    scene = experiment.scene
    blind = scene.believe(focal=1.1).replacing(replace(scene.camera(), optics=None))
    experiment.with_(task=rs.IBVS(belief=blind)).run()


@pytest.mark.parametrize(
    ("given", "text"),
    [
        ({"full_well": 0}, "full_well must be a positive number"),
        ({"read_noise": -1}, "read_noise must be"),
        ({"defocus": np.nan}, "defocus: nan; every number must be finite"),
        ({"defocus": 101}, "defocus must be"),
        ({"vignetting": -1}, "vignetting must be"),
        ({"exposure": -0.1}, "exposure must be"),
        ({"readout": "long"}, "readout: expected a number"),
        ({"gain": 0}, "gain must be"),
        ({"gamma": 0.1}, "gamma must be"),
        ({"bits": 0}, "bits must be a whole number from 1 to 8"),
        ({"bits": 7.5}, "bits must be a whole number from 1 to 8"),
        ({"gain": [1.0, 2.0]}, "gain must be"),
        ({"blur": 1.0}, "no parameter 'blur'"),
    ],
)
def test_optics_that_do_not_exist(given, text):
    with pytest.raises(rs.errors.InputError, match=text):
        Optics(**given)


def test_what_is_no_optics_is_refused():
    with pytest.raises(rs.errors.InputError, match="optics of 'eye': expected Optics, got 'dark'"):
        rs.MountedCamera("eye", CAMERA, optics="dark")
    eye = rs.MountedCamera("eye", CAMERA, optics=NOISY)
    for seed in (-1, 2**64, 0.5, "a"):
        with pytest.raises(rs.errors.InputError, match="seed"):
            rs.Scene(cameras=eye).picture(seed=seed)
    with pytest.warns(rs.errors.UnitWarning, match="Optics.exposure"):
        Optics(exposure=20)
