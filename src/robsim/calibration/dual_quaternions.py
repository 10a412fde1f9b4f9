"""Hand-eye calibration by dual quaternions, with rotation and translation solved together."""

from __future__ import annotations

import numpy as np

from robsim.base.arrays import Array
from robsim.calibration.relative_motions import RelativeMotions, cross_matrix
from robsim.geometry.pose import Pose


def daniilidis(motions: RelativeMotions) -> Pose:
    """Return the mount by the method of Daniilidis 1999.

    A pose is a dual quaternion q + eps q' with q' = t q / 2. For the mount (q, q'), the vector
    parts of A and B give six equations S (q, q') = 0 for each motion. The equations of all motions
    have two null vectors; the mount is their combination with |q| = 1 and q . q' = 0.
    """
    (a, a_dual), (b, b_dual) = _vector_parts(motions.A), _vector_parts(motions.B)
    real, dual = _quaternion_rows(a, b), _quaternion_rows(a_dual, b_dual)
    S = np.block([[real, np.zeros_like(real)], [dual, real]])
    u, v = np.linalg.svd(S.reshape(-1, 8), full_matrices=False)[2][-2:]
    return _pose_from_dual(*_combine_null_vectors(u, v))


def _vector_parts(T: Pose) -> tuple[Array, Array]:
    """Return the vector parts (n, 3) of q and of q' = t q / 2."""
    q, t = T.quaternion, T.position
    w, xyz = q[:, 3:], q[:, :3]
    return xyz, 0.5 * (w * t + np.cross(t, xyz))


def _quaternion_rows(a: Array, b: Array) -> Array:
    """Return the rows (n, 3, 4) [a - b, [a + b]x] of equations in a quaternion (w, x, y, z)."""
    return np.concatenate([(a - b)[..., None], cross_matrix(a + b)], axis=-1)


def _combine_null_vectors(u: Array, v: Array) -> tuple[Array, Array]:
    """Return q and q' of l u + m v with |q| = 1 and q . q' = 0.

    Two ratios l / m satisfy q . q' = 0; the ratio with the larger |q| is the mount.
    """
    a, b, c = (
        float(each) for each in (u[:4] @ u[4:], u[:4] @ v[4:] + u[4:] @ v[:4], v[:4] @ v[4:])
    )
    ratios = [(1.0, 0.0)] if a == b == 0.0 else _quadratic_ratios(a, b, c)
    lengths = [np.sqrt(np.square(l * u[:4] + m * v[:4]).sum()) for l, m in ratios]
    best = int(np.argmax(lengths))
    l, m = ratios[best]
    both = (l * u + m * v) / lengths[best]
    return both[:4], both[4:]


def _quadratic_ratios(a: float, b: float, c: float) -> list[tuple[float, float]]:
    """Return unit vectors (l, m) with a l^2 + b l m + c m^2 = 0, or nearly if none is real."""
    root = np.sqrt(max(b * b - 4 * a * c, 0.0))
    far = -0.5 * (b + np.copysign(root, b))
    pairs = [(far, a), (c, far)]  # without cancellation
    return [(x / size, y / size) for x, y in pairs if (size := np.hypot(x, y)) > 0.0]


def _pose_from_dual(q: Array, dual: Array) -> Pose:
    """Return the pose of a dual quaternion, scalars first: t = 2 q' conj(q)."""
    (w, xyz), (w_dual, xyz_dual) = (q[0], q[1:]), (dual[0], dual[1:])
    t = 2 * (-w_dual * xyz + w * xyz_dual - np.cross(xyz_dual, xyz))
    return Pose.from_quaternion(t, [*xyz, w])
