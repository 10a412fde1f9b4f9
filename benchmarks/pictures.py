"""Pictures of cameras beside other programs (see README.md).

Run `python benchmarks/pictures.py [--cold]`. Each peer is left out if it is not installed.
"""

import argparse
import os
import subprocess
import sys
import tempfile
from typing import Any, NamedTuple

import numpy as np
import peer_pictures
from peer_pictures import least

import robsim as rs
from robsim.rendering.development import Development
from robsim.rendering.rendered_face import RenderedFace, list_shape_faces, list_target_faces
from robsim.rendering.renderer import Renderer
from robsim.rendering.sensor import Sensor
from robsim.shapes import GreyPicture, Poster

LENS = (-0.25, 0.06, 0.001, -0.002)
LIGHT = (0.32, 0.42, 0.85, 0.4)  # of a direction, and from everywhere
FIRST = """
import time
import numpy as np
import robsim as rs
from robsim.shapes import Poster
start = time.process_time()
wall = rs.Object("wall", Poster(np.full((40, 60), 90, np.uint8), 0.6), pose=rs.Pose.at(0, 0, 1))
eye = rs.MountedCamera("eye", rs.Camera([[80, 0, 31.5], [0, 80, 23.5], [0, 0, 1]], (64, 48)))
rs.Scene(objects=wall, cameras=eye).picture()
print(time.process_time() - start)
"""


class BenchmarkScene(NamedTuple):
    """A poster and a ball of triangles before a camera, as our renderer and its peers take them."""

    size: tuple[int, int]
    focal: float
    grey: Any
    corners: Any
    poses: Any
    triangles: Any

    @property
    def K(self):
        """The camera matrix."""
        width, height = self.size
        return np.array(
            [[self.focal, 0, width / 2 - 0.5], [0, self.focal, height / 2 - 0.5], [0, 0, 1]]
        )

    @property
    def directions(self):
        """The rays (n, 3) of all pixels in camera axes."""
        x, y = np.meshgrid(np.arange(self.size[0]), np.arange(self.size[1]))
        pixels = np.stack([x, y, np.ones_like(x)], axis=-1).reshape(-1, 3)
        return pixels @ np.linalg.inv(self.K).T

    def build_renderer(self, samples=1, lens=()):
        """Return the renderer of the bodies."""
        bodies = [list_shape_faces(Poster(GreyPicture(self.grey), 0.6))]
        if len(self.triangles):
            bodies.append([RenderedFace(each, 200.0) for each in self.triangles])
        return Renderer(rs.Camera(self.K, self.size, distortion=lens), bodies, samples)


def build_scene(depth=1.0, size=(320, 240), rounds=None):
    """Return a poster of 640 x 458 texels that is 0.6 m wide, before it a ball of triangles."""
    x, y = np.meshgrid(np.arange(640), np.arange(458))
    grey = np.rint(127 + 60 * np.sin(x / 9) * np.cos(y / 13)).astype(np.uint8)
    high = 0.6 * 458 / 640 / 2
    corners = np.array([[-0.3, -high, 0], [0.3, -high, 0], [0.3, high, 0], [-0.3, high, 0]])
    wall = rs.Pose.at(0, 0, depth, rpy=(0.1, -0.1, 0.2)).matrix
    if rounds is None:
        return BenchmarkScene(size, 870 * size[0] / 320, grey, corners, wall[None], ())
    ball = rs.Pose.at(0, 0, depth - 0.1, rpy=(0.7, 0.3, 0.2)).matrix
    poses = np.stack([wall, ball])
    return BenchmarkScene(size, 870 * size[0] / 320, grey, corners, poses, divide_ball(rounds))


def divide_ball(rounds, radius=0.08):
    """Return the triangles (n, 3, 3) of an icosahedron whose sides are halved `rounds` times."""
    golden = (1 + 5**0.5) / 2
    signs = np.array([[a, b * golden, 0] for a in (-1, 1) for b in (-1, 1)])
    points = np.concatenate([signs, np.roll(signs, 1, axis=1), np.roll(signs, 2, axis=1)])
    gaps = np.linalg.norm(points[:, None] - points, axis=-1)
    near = np.isclose(gaps, 2)
    faces = [
        (a, b, c)
        for a in range(12)
        for b in range(a + 1, 12)
        for c in range(b + 1, 12)
        if near[a, b] and near[b, c] and near[a, c]
    ]
    triangles = np.array([points[list(face)] for face in faces])
    inward = np.linalg.det(triangles) < 0
    triangles[inward] = triangles[inward][:, ::-1]
    for _ in range(rounds):
        a, b, c = np.moveaxis(triangles, 1, 0)
        ab, bc, ca = (a + b) / 2, (b + c) / 2, (c + a) / 2
        parts = ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))
        triangles = np.concatenate([np.stack(each, axis=1) for each in parts])
        triangles /= np.linalg.norm(triangles, axis=-1, keepdims=True)
    return radius * triangles / np.linalg.norm(triangles, axis=-1, keepdims=True)


def measure_posters(scene):
    """Yield name, samples and milliseconds of pictures of a poster."""
    for samples in (1, 2):
        for lens in ((), LENS):
            draw = scene.build_renderer(samples, lens).draw
            kind = "lens" if lens else "pinhole"
            yield f"poster, {kind}", samples, least(lambda d=draw: d(scene.poses))


def measure_calls(scene):
    """Yield name, samples and milliseconds of calls that draw a poster."""
    renderer, T = scene.build_renderer(), np.repeat(scene.poses[None], 20, axis=0)
    many = least(lambda: renderer.draw_many(T))
    yield "20 posters in a call, each", 1, (many[0] / 20, many[1] / 20)
    wall = rs.Object("wall", Poster(GreyPicture(scene.grey), 0.6), pose=rs.Pose(scene.poses[0]))
    eye = rs.MountedCamera("eye", rs.Camera(scene.K, scene.size))
    yield "scene.picture, the second", 1, least(rs.Scene(objects=wall, cameras=eye).picture)


def measure_optics():
    """Yield name, samples and milliseconds of optics on the poster that fills the view."""
    scene = build_scene(1.0)
    camera, renderer = rs.Camera(scene.K, scene.size), scene.build_renderer()
    light = renderer.draw(scene.poses)
    yield "the picture alone", 1, least(lambda: renderer.draw(scene.poses))
    noise, response = {"full_well": 10_000, "read_noise": 1.5}, {"gamma": 2.2, "vignetting": 4.0}
    parts = {"noise": noise, "blur of 1 px": {"defocus": 1.0}, "gamma, vignetting": response}
    parts["noise, blur, development"] = {**noise, "defocus": 1.0, **response, "bits": 6}
    for name, fields in parts.items():
        sensor = Sensor(rs.vision.Optics(**fields), camera)
        yield f"{name}, beside the picture", 1, least(lambda s=sensor: s.develop(light))
    for name in ("exposure", "readout"):
        development = Development(renderer, rs.vision.Optics(**{name: 0.01}), camera)
        poses = np.repeat(scene.poses[None], len(development.offsets), axis=0)
        lights = np.tile(LIGHT, (len(poses), 1))
        call = least(lambda d=development, T=poses, x=lights: d.draw(T, x, 0, 0, 0))
        yield f"{name}, with the picture", 1, call


def measure_large():
    """Yield name, samples and milliseconds of pictures of 640 x 480 pixels."""
    wide = build_scene(1.0, (640, 480), 5)
    tag = [list_target_faces(rs.vision.Tag("tag36h11", 7, 0.1))]
    for samples in (1, 2):
        renderer = wide.build_renderer(samples)
        call = least(lambda r=renderer: r.draw(wide.poses, LIGHT))
        yield f"{len(wide.triangles)} triangles on a poster", samples, call
        renderer = Renderer(rs.Camera(wide.K, wide.size), tag, samples)
        yield "tag", samples, least(lambda r=renderer: r.draw(wide.poses[:1]))


def measure_first():
    """Seconds of CPU of the first picture of a process without cached kernels."""
    with tempfile.TemporaryDirectory() as folder:
        empty = {**os.environ, "ROBSIM_CACHE_DIR": folder}
        call = [sys.executable, "-c", FIRST]
        done = subprocess.run(call, env=empty, capture_output=True, check=True, text=True)
    return float(done.stdout)


def print_table(title, ours, scene, names):
    """Print our rows, and how many times as long the peers take."""
    print(f"\n{title:38}{'samples':>8}{'ms':>9}{'median':>9}")
    found = {}
    for name, samples, (low, median) in ours:
        found[name, samples] = low
        print(f"{name:38}{samples:8}{low:9.3f}{median:9.3f}", flush=True)
    reference = next(iter(found.values()))
    for name, samples, (low, median) in peer_pictures.measure(scene, names):
        ratio = f"{low / reference:6.2f} times the first row"
        print(f"{name:38}{samples:8}{low:9.3f}{median:9.3f}{ratio}", flush=True)


def main(cold=False):
    """Print the tables."""
    posters = ("cv2.warpPerspective", "riley", "MuJoCo, GL in software", "TinyRenderer")
    close, away = build_scene(1.0), build_scene(2.3)
    ours = [*measure_posters(close), *measure_calls(close)]
    print_table("a poster that fills 320 x 240 pixels", ours, close, posters)
    print_table("the same, its edges in view", measure_posters(away), away, posters[:1])
    print_table("optics, 320 x 240", measure_optics(), build_scene(), ())
    wide = ("MuJoCo, GL in software", "TinyRenderer", "embreex, only ids")
    scene = build_scene(1.0, (640, 480), 5)
    print_table("pictures, 640 x 480", measure_large(), scene, wide)
    if cold:
        print(f"first picture, no kernel cached: {measure_first():.1f} s of CPU")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cold", action="store_true", help="also the first picture")
    main(parser.parse_args().cold)
