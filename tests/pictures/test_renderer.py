"""The renderer of a camera: many pictures in a call, pixels at edges, and what is kept."""

import numpy as np
import pytest
from numba.core.runtime import _nrt_python, rtsys
from ray_casting import cast_picture, find_psnr

import robsim as rs
from robsim.kernels.machine.kernel import kernel
from robsim.kernels.raster.edge_coverage import divide_square
from robsim.rendering.rendered_face import list_shape_faces, list_target_faces
from robsim.rendering.renderer import Renderer
from robsim.shapes import Ball, Block, Light, Poster

K = np.array([[84.0, 1.8, 46.9], [0.0, 90.0, 36.7], [0.0, 0.0, 1.0]])  # with skew, off centre
LENSES = {
    "pinhole": {},
    "barrel": {"distortion": (-0.25, 0.06, 0.001, -0.002)},
    "fisheye": {"distortion": (-0.02, 0.01, 0.0, 0.0), "lens": "fisheye"},
}
FULL, SIDE = Light(ambient=1.0), Light((0.3, 0.4, 0.87), ambient=0.4)


def draw_waves(rows=229, columns=320):
    """Return a smooth picture."""
    x, y = np.meshgrid(np.arange(columns), np.arange(rows))
    return np.rint(127 + 60 * np.sin(x / 9) * np.cos(y / 13)).astype(np.uint8)


def build_bodies():
    """Return the faces of a poster, a block and a pattern of dots."""
    poster = list_shape_faces(Poster(draw_waves(), 1.0))
    block = list_shape_faces(Block(0.2, 0.3, 0.1, albedo=0.4))
    return [poster, block, list_target_faces(rs.vision.DotPattern.grid(3, 2, 0.03, 0.01))]


def build_poses(count):
    """Return poses (count, 3, 4, 4) of these bodies, and light (count, 4)."""
    random = np.random.default_rng(1)
    poses = [
        [
            rs.Pose.at(
                *random.uniform(-0.2, 0.2, 2), depth, rpy=random.uniform(-0.5, 0.5, 3)
            ).matrix
            for depth in (1.5, 1.2, 0.9)
        ]
        for _ in range(count)
    ]
    light = np.column_stack([random.normal(size=(count, 3)), random.uniform(size=count)])
    light[:, :3] /= np.linalg.norm(light[:, :3], axis=1, keepdims=True)
    return np.array(poses), light


@pytest.mark.parametrize("samples", [1, 2])
@pytest.mark.parametrize("lens", ["pinhole", "barrel"])
def test_many_pictures_have_the_bits_of_single_ones(lens, samples):
    camera = rs.Camera(K, (96, 72), **LENSES[lens])
    renderer = Renderer(camera, build_bodies(), samples)
    poses, light = build_poses(4)
    many = renderer.draw_many(poses, light)
    assert many.shape == (4, 72, 96)
    assert many.dtype == np.float32
    assert len(np.unique(many.reshape(4, -1).std(axis=1))) == 4
    for k in (3, 0, 2, 1):
        np.testing.assert_array_equal(renderer.draw(poses[k], light[k]), many[k])
    fresh = Renderer(camera, build_bodies(), samples)
    np.testing.assert_array_equal(fresh.draw_many(poses[1:3], light[1:3]), many[1:3])
    full = renderer.draw_many(poses[:1])
    np.testing.assert_array_equal(full[0], renderer.draw(poses[0], (0, 0, 1, 1)))


def test_poses_of_another_number_of_bodies_are_refused():
    renderer = Renderer(rs.Camera(K, (96, 72)), build_bodies())
    poses, light = build_poses(2)
    for wrong in ((poses[:, :2], light), (poses, light[:1]), (poses[:1], light)):
        with pytest.raises(AssertionError):
            renderer.draw_many(*wrong)


def test_no_pictures_and_no_bodies():
    renderer = Renderer(rs.Camera(K, (96, 72)), build_bodies())
    assert renderer.draw_many(np.empty((0, 3, 4, 4)), np.empty((0, 4))).shape == (0, 72, 96)
    empty = Renderer(rs.Camera(K, (96, 72)), [], background=7)
    assert (empty.draw(np.empty((0, 4, 4))) == 7).all()


def test_the_kernels_free_all_memory():
    renderer = Renderer(rs.Camera(K, (96, 72)), build_bodies())
    poses, light = build_poses(3)
    renderer.draw_many(poses, light)
    _nrt_python.memsys_enable_stats()
    try:
        before = rtsys.get_allocation_stats()
        renderer.draw_many(poses, light)
        after = rtsys.get_allocation_stats()
    finally:
        _nrt_python.memsys_disable_stats()
    assert after.alloc - before.alloc == after.free - before.free


def integrate_square(value, right, down, places=600):
    """Return area and moments by many places in the square."""
    line = (np.arange(places) + 0.5) / places - 0.5
    x, y = np.meshgrid(line, line)
    inside = value + right * x + down * y >= 0
    return np.array([inside.mean(), (inside * x).mean(), (inside * y).mean()])


def test_the_area_of_a_divided_pixel():
    @kernel
    def divide(value, right, down):
        return divide_square(value, right, down)

    random = np.random.default_rng(0)
    for _ in range(60):
        right, down = random.normal(size=2) * 10.0 ** random.uniform(-3, 3, 2)
        value = random.uniform(-0.5, 0.5) * (abs(right) + abs(down))
        expected = integrate_square(value, right, down)
        np.testing.assert_allclose(divide(value, right, down), expected, atol=2e-3)
    np.testing.assert_allclose(divide(0.0, 2.0, 0.0), [0.5, 0.125, 0.0], atol=1e-15)
    np.testing.assert_allclose(divide(-0.5, 1.0, 1.0), [0.125, 1 / 24, 1 / 24], atol=1e-15)
    np.testing.assert_allclose(divide(0.25, 0.0, -1.0), [0.75, 0.0, -0.09375], atol=1e-15)


@pytest.mark.parametrize("radius", [0.75, 1.1, 6.3])  # pixels
def test_the_part_of_a_pixel_that_a_face_with_many_sides_covers(radius):
    points = [[0.0013, 0.0021], [-0.08, -0.08], [0.08, 0.08]]
    dots = rs.vision.DotPattern(points, radius=radius / 200)
    plate = rs.Object("plate", dots=dots, pose=rs.Pose.at(0, 0, 1.0))
    eye = rs.MountedCamera("eye", rs.Camera([[200, 0, 20], [0, 200, 20], [0, 0, 1]], (41, 41)))
    scene = rs.Scene(objects=plate, cameras=eye)
    one, many = (scene.picture(samples=n, light=FULL, exact=True) for n in (1, 8))
    np.testing.assert_allclose(one, many, rtol=0, atol=1e-3)
    ink, paper = 30.0, 225.0
    dark = (paper - one[12:30, 12:30]) / (paper - ink)
    np.testing.assert_allclose(dark.sum(), np.pi * radius**2, rtol=1e-5)


@pytest.mark.full
@pytest.mark.parametrize("tilt", [0.0, 0.4, np.pi / 4])
@pytest.mark.parametrize("lens", LENSES)
def test_the_edges_of_a_poster_are_as_by_144_rays(lens, tilt):
    pose = rs.Pose.at(0.05, -0.02, 1.6, rpy=(tilt, 0, 0.2))
    camera = rs.MountedCamera("eye", rs.Camera(K, (96, 72), **LENSES[lens]))
    scene = rs.Scene(
        objects=rs.Object("wall", Poster(draw_waves(), 1.2), pose=pose), cameras=camera
    )
    exact = cast_picture(scene, "eye", [], FULL, background=50.0)
    for samples, least in ((1, 44.0), (2, 50.0)):
        image = scene.picture(samples=samples, light=FULL, exact=True)
        assert find_psnr(image, exact) > least


@pytest.mark.full
@pytest.mark.parametrize("lens", LENSES)
def test_an_edge_between_two_faces_is_exact(lens):
    block = Block(0.5, 0.5, 0.5, albedo=0.8)
    thing = rs.Object("block", block, pose=rs.Pose.at(0.02, 0.01, 1.6, rpy=(0.6, 0.4, 0.3)))
    camera = rs.MountedCamera("eye", rs.Camera(K, (96, 72), **LENSES[lens]))
    scene = rs.Scene(objects=thing, cameras=camera)
    exact = cast_picture(scene, "eye", [], SIDE, background=50.0, places=16)
    image = scene.picture(light=SIDE, exact=True)
    assert np.quantile(abs(image - exact), 0.995) < 2.0  # corners are by 16 places
    assert find_psnr(image, exact) > 51


def test_a_second_picture_has_the_bits_of_the_first():
    wall = rs.Object("wall", Poster(draw_waves(), 1.2), pose=rs.Pose.at(0, 0, 1.6))
    camera = rs.MountedCamera("eye", rs.Camera(K, (96, 72), **LENSES["barrel"]))
    scene = rs.Scene(objects=wall, cameras=camera)
    first = scene.picture(exact=True)
    for change in ({"samples": 2}, {"background": 3.0}, {"light": FULL}):
        assert not np.array_equal(scene.picture(exact=True, **change), first)
    np.testing.assert_array_equal(scene.picture(exact=True), first)
    other = rs.Object("wall", Poster(draw_waves()[::-1], 1.2), pose=rs.Pose.at(0, 0, 1.6))
    assert not np.array_equal(scene.replacing(other).picture(exact=True), first)
    moved = rs.MountedCamera("eye", rs.Camera(K * [[1, 1, 1.1], [1, 1, 1], [1, 1, 1]], (96, 72)))
    assert not np.array_equal(scene.replacing(moved).picture(exact=True), first)
    np.testing.assert_array_equal(rs.Scene(objects=wall, cameras=camera).picture(exact=True), first)


def test_threads_draw_the_bits_of_one():
    from concurrent.futures import ThreadPoolExecutor

    thing = rs.Object("ball", Ball(0.3), pose=rs.Pose.at(0, 0, 1.6))
    scene = rs.Scene(objects=thing, cameras=rs.MountedCamera("eye", rs.Camera(K, (96, 72))))
    angles = np.linspace(0, 1, 12)
    lights = [Light((np.sin(a), 0, np.cos(a)), ambient=0.2) for a in angles]
    alone = [scene.picture(light=light, exact=True) for light in lights]
    with ThreadPoolExecutor(4) as pool:
        together = list(pool.map(lambda light: scene.picture(light=light, exact=True), lights))
    np.testing.assert_array_equal(together, alone)
