"""The view of one object by one camera on the tree: all that follows from q at an instant."""

from typing import Any, NamedTuple

from robsim.kernels import camera, tree
from robsim.kernels.jit import kernel, part


class Eye(NamedTuple):
    """The constants of a camera and its target."""

    body: int  # that carries the camera
    hand_eye: Any  # pose of the camera on it
    target: int  # body that carries the target
    offset: Any  # pose of the target on it
    marks: Any  # (N, 3) in axes of the target
    K: Any
    lens: Any
    border: Any
    valid_radius: float
    moves: bool  # whether a joint carries the camera


class Projection(NamedTuple):
    """The poses of a camera and its target, and the image of the marks, at one instant."""

    bodies: tree.Bodies
    T_w_c: Any  # (3, 4, B)
    T_w_o: Any  # (3, 4, B)
    points: Any  # (N, 3, B) marks in camera axes
    depth: Any  # (N, B)
    pixels: Any  # (N, 2, B), NaN behind the camera
    visibility: Any  # (N, B)


@part
def project(joints, eye, q, projection):
    """Fill `projection` for coordinates q[n, b]."""
    tree.bodies(joints, q, projection.bodies)
    tree.frame(projection.bodies.poses, eye.body, eye.hand_eye, projection.T_w_c)
    tree.frame(projection.bodies.poses, eye.target, eye.offset, projection.T_w_o)
    camera.into_camera(projection.T_w_c, projection.T_w_o, eye.marks, projection.points)
    camera.project(projection.points, eye.K, eye.lens, projection.pixels)
    camera.visibility(
        projection.points, projection.pixels, eye.border, eye.valid_radius, projection.visibility
    )
    for n in range(projection.depth.shape[0]):
        for b in range(projection.depth.shape[1]):
            projection.depth[n, b] = projection.points[n, 2, b]


@kernel
def relative(A, B, out):
    """Compute out[3, 4, b] = A^-1 B: the pose of frame b in frame a, from both in the world."""
    for r in range(3):
        for c in range(4):
            for b in range(out.shape[2]):
                x, y, z = B[0, c, b], B[1, c, b], B[2, c, b]
                if c == 3:
                    x, y, z = x - A[0, 3, b], y - A[1, 3, b], z - A[2, 3, b]
                out[r, c, b] = A[0, r, b] * x + A[1, r, b] * y + A[2, r, b] * z
