"""The two poses of a target under scaled orthography, as starts of a pose estimate."""

from __future__ import annotations

import numpy as np

from robsim.base.arrays import Array
from robsim.vision.p3p import unit_vectors
from robsim.vision.plane import append_one


def orthographic_poses(marks: Array, x: Array) -> Array:
    """Return both poses T_c_o (B, 2, 3, 4) of marks (N, 3) at normalised points x (B, N, 2).

    The marks are projected to their least-squares plane. About its centroid d the image is
    approximated by an affine map, x - d = J p, with points p of the plane relative to the centroid
    of the marks, which is at depth Z.

    J = B A / Z, with the projection B along the ray (d, 1). The matrix A contains the first two
    rows and columns of the rotation from the plane to axes along this ray, so A = U diag(1, c) V'
    with the cosine c of the tilt. The depth Z follows from the larger singular value. The image
    does not determine the sign of the tilt, which gives two poses (Oberkampf, DeMenthon and Davis
    1996; in this form Collins and Bartoli 2014, section 4).
    """
    centre = marks.mean(0)
    plane = plane_axes(marks)
    ray = x.mean(1)
    J = np.swapaxes(np.linalg.pinv((marks - centre) @ plane[:2].T) @ (x - ray[:, None]), -1, -2)
    along = _shortest_rotations(unit_vectors(append_one(ray)))
    project = along[:, :2, :2] - ray[:, :, None] * along[:, 2:, :2]
    U, scale, Vt = np.linalg.svd(np.linalg.solve(project, J))
    depth = 1.0 / scale[:, 0]
    c = scale[:, 1] * depth
    s = np.sqrt((1.0 - c) * (1.0 + c))
    R = [
        along @ _embed_rotations(U) @ _tilt_rotations(c, sign * s) @ _embed_rotations(Vt) @ plane
        for sign in (1, -1)
    ]
    R_c_o = np.stack(R, axis=1)
    middle = append_one(ray) * depth[:, None]
    t = middle[:, None] - R_c_o @ centre
    return np.concatenate([R_c_o, t[..., None]], axis=-1)


def mirror_pose(marks: Array, T_c_o: Array) -> Array:
    """Return the poses (B, 3, 4) of opposite tilt, which have nearly the same images.

    The target is reflected along the ray to its centroid, and then in its own plane. Under
    orthographic projection the image of a flat target does not change.
    """
    centre, normal = marks.mean(0), plane_axes(marks)[2]
    middle = T_c_o[..., :3] @ centre + T_c_o[..., 3]
    R = _reflection_matrices(unit_vectors(middle)) @ T_c_o[..., :3] @ _reflection_matrices(normal)
    return np.concatenate([R, (middle - R @ centre)[..., None]], axis=-1)


def plane_axes(marks: Array) -> Array:
    """Return a rotation (3, 3) with rows along two axes in the plane of the marks, and normal."""
    axes = np.linalg.svd(marks - marks.mean(0), full_matrices=False)[2]
    signs: Array = np.array([1.0, 1.0, np.copysign(1.0, np.linalg.det(axes))])
    return np.asarray(axes * signs[:, None])


def _reflection_matrices(n: Array) -> Array:
    """Return reflections I - 2 n n' (..., 3, 3) for unit vectors n (..., 3)."""
    return np.eye(3) - 2.0 * n[..., :, None] * n[..., None, :]


def _shortest_rotations(d: Array) -> Array:
    """Return the shortest rotations (B, 3, 3) from z to unit vectors d with d_z > 0."""
    x, y, z = d.T
    k = 1.0 / (1.0 + z)
    rows = [1 - k * x * x, -k * x * y, x, -k * x * y, 1 - k * y * y, y, -x, -y, z]
    return np.stack(rows, axis=-1).reshape(-1, 3, 3)


def _embed_rotations(A: Array) -> Array:
    """Return rotations (B, 3, 3) with orthogonal matrices A (B, 2, 2) as first rows and columns."""
    out = np.zeros((len(A), 3, 3))
    out[:, :2, :2] = A
    out[:, 2, 2] = A[:, 0, 0] * A[:, 1, 1] - A[:, 0, 1] * A[:, 1, 0]
    return out


def _tilt_rotations(c: Array, s: Array) -> Array:
    """Return rotations (B, 3, 3) about x with cosine c and sine s."""
    zero, one = np.zeros_like(c), np.ones_like(c)
    rows = [one, zero, zero, zero, c, -s, zero, s, c]
    return np.stack(rows, axis=-1).reshape(-1, 3, 3)
