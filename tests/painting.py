"""A painted wall in front of a free camera, for features of pictures."""

import numpy as np

import robsim as rs

OCTAVES = (4, 8, 16, 32)
GOAL = np.asarray(rs.Pose.at(0, 0, -1).q)
DT = 0.04


def paint(seed=0, shape=(258, 360), octaves=OCTAVES):
    """Return a smooth random picture of several octaves of value noise."""
    rng, picture = np.random.default_rng(seed), np.zeros(shape)
    y, x = np.mgrid[: shape[0], : shape[1]] / shape[1]
    for n in octaves:
        grid = rng.normal(size=(n + 2, n + 2))
        i, j = (n * y).astype(int), (n * x).astype(int)
        u, v = n * y - i, n * x - j
        u, v = (t * t * (3.0 - 2.0 * t) for t in (u, v))
        top = grid[i, j] * (1 - v) + grid[i, j + 1] * v
        below = grid[i + 1, j] * (1 - v) + grid[i + 1, j + 1] * v
        picture += (top * (1 - u) + below * u) / np.sqrt(n)
    picture -= picture.min()
    return np.rint(picture / picture.max() * 255.0).astype(np.uint8)


def make_camera(width=80, height=60, focal=80.0, **lens):
    """Return a camera with the centre of its image in the middle."""
    centre = (width - 1) / 2, (height - 1) / 2
    K = [[focal, 0, centre[0]], [0, focal, centre[1]], [0, 0, 1]]
    return rs.Camera(K, (width, height), **lens)


def make_scene(picture=None, camera=None, width=0.6, optics=None):
    """Return the scene of a free camera before a wall at the origin."""
    picture = paint() if picture is None else picture
    wall = rs.Object("wall", rs.shapes.Poster(picture, width=width))
    lens = make_camera() if camera is None else camera
    eye = rs.MountedCamera("eye", lens, on="free_camera.body", optics=optics)
    light = rs.shapes.Light(ambient=1.0)
    return rs.Scene((rs.robots.free_camera(),), (wall,), (eye,), light=light)


def place_camera(x, y, z, *degrees):
    """Return the coordinates of a camera that sees the wall at a position and a rotation vector."""
    return np.asarray(rs.Pose.at(x, y, z, rotvec=np.radians(degrees)).inv().q)


def make_task(goal=GOAL, interaction="desired", gain=10.0, depth="goal", **luminance):
    """Return photometric servoing with pictures of 80 x 60 pixels."""
    feature = rs.features.Luminance(border=4, **luminance)
    return rs.IBVS(goal, features=feature, interaction=interaction, gain=gain, depth=depth)
