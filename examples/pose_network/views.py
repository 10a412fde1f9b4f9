"""Rendered pictures of posters, and the poses of cameras in front of them."""

import numpy as np
from pose_network.network import FOCAL, HEIGHT, WIDTH

import robsim as rs
from robsim.rendering.rendered_face import list_shape_faces
from robsim.rendering.renderer import Renderer
from robsim.shapes import Poster

CAMERA = rs.Camera(
    [[FOCAL, 0, (WIDTH - 1) / 2], [0, FOCAL, (HEIGHT - 1) / 2], [0, 0, 1]], (WIDTH, HEIGHT)
)
POSTER_WIDTH = 0.6  # metres, at a distance of one metre


def rotate(vectors):
    """Return the rotation matrices (n, 3, 3) of rotation vectors (n, 3), by Rodrigues' formula."""
    vectors = np.asarray(vectors, dtype=float)
    angle = np.linalg.norm(vectors, axis=1)[:, None, None]
    x, y, z = vectors.T
    zero = np.zeros_like(x)
    skew = np.array([[zero, -z, y], [z, zero, -x], [-y, x, zero]]).transpose(2, 0, 1)
    safe = np.maximum(angle, 1e-12)
    return np.eye(3) + np.sin(angle) / safe * skew + (1 - np.cos(angle)) / safe**2 * skew @ skew


def build_poses(positions, vectors):
    """Return the poses (n, 4, 4) with positions (n, 3) and rotation vectors (n, 3)."""
    poses = np.tile(np.eye(4), (len(positions), 1, 1))
    poses[:, :3, :3], poses[:, :3, 3] = rotate(vectors), positions
    return poses


def invert(poses):
    """Return the inverse of poses (n, 4, 4)."""
    inverse = np.tile(np.eye(4), (len(poses), 1, 1))
    inverse[:, :3, :3] = R = poses[:, :3, :3].transpose(0, 2, 1)
    inverse[:, :3, 3] = -(R @ poses[:, :3, 3:])[..., 0]
    return inverse


def draw_starts(rng, count, roll, aside, further, nearer=0.0):
    """Return random poses (count, 4, 4) of the camera in axes of the camera at the goal.

    The roll is within +- `roll` degrees, and the rotations about x and y within a third of it; the
    camera is up to `aside` metres beside the goal along x and y, and up to `further` behind it.
    """
    vectors = np.radians(roll) * rng.uniform(-1, 1, (count, 3)) * [1 / 3, 1 / 3, 1]
    positions = rng.uniform(-aside, aside, (count, 3))
    positions[:, 2] = rng.uniform(-further, nearer, count)
    return build_poses(positions, vectors)


def make_renderer(picture, width=POSTER_WIDTH, background=128.0, camera=CAMERA):
    """Return the renderer of a poster; its poses are (n, 1, 4, 4), of the poster in the camera."""
    return Renderer(camera, [list_shape_faces(Poster(picture, width=width))], 1, background)
