"""Poses and Jacobians of frames at many configurations, with the run first, as users have them.

All arrays but the constants of frames are flat. The runs are placed some at a time, so that what
belongs to them stays in the cache however many there are.
"""

import numpy as np

from robsim.kernels import tree
from robsim.kernels.jacobian import Moves, jacobian
from robsim.kernels.jit import kernel, part
from robsim.kernels.packed import unpack

CHUNK = 128  # runs placed at once
USUAL = 12.0  # metres or radians: below two turns, from where on an angle may be in degrees


@part
def _are_usual(q):
    """Return whether all numbers are finite and small, so that nobody needs to look at them."""
    unusual = 0
    for b in range(q.shape[0]):
        for i in range(q.shape[1]):
            unusual += 0 if abs(q[b, i]) <= USUAL else 1
    return unusual == 0


@kernel
def _placed(joints, q):
    """Return the Bodies at configurations q[run, n]."""
    runs = q.shape[0]
    x = np.empty((q.shape[1], runs))
    for i in range(q.shape[1]):
        for b in range(runs):
            x[i, b] = q[b, i]
    poses = np.empty((joints.rows.shape[0], 3, 4, runs))
    placed = tree.Bodies(poses, np.empty((joints.ratios, runs)))
    tree.bodies(joints, x, placed)
    return placed


@kernel
def poses(integers, numbers, body, offset, q, out):
    """Compute homogeneous out[run, frame, 4, 4] of frames at offset[frame, 3, 4] on bodies.

    Return whether all coordinates are usual: else they are for Python to check.
    """
    joints, frames = unpack(integers, numbers), body.size
    runs, usual = out.size // (16 * frames), True
    rows, placed = q.reshape(runs, q.size // max(runs, 1)), out.reshape(runs, frames, 4, 4)
    for start in range(0, runs, CHUNK):
        count = min(CHUNK, runs - start)
        some, T = rows[start : start + count], np.empty((3, 4, count))
        usual = _are_usual(some) and usual
        bodies = _placed(joints, some)
        for f in range(frames):
            tree.frame(bodies.poses, body[f], offset[f], T)
            for b in range(count):
                for c in range(4):
                    for r in range(3):
                        placed[start + b, f, r, c] = T[r, c, b]
                    placed[start + b, f, 3, c] = 1.0 if c == 3 else 0.0
    return usual


@kernel
def jacobians(integers, numbers, body, offset, columns, moved, sign, q, out):
    """Compute out[run, 6, j] of the origin of the first frame, (v, omega) in the world's axes.

    Return as `poses` does.
    """
    joints, nv = unpack(integers, numbers), columns.size
    runs, usual = out.size // (6 * nv) if nv else 0, True
    rows, found = q.reshape(runs, q.size // max(runs, 1)), out.reshape(runs, 6, nv)
    for start in range(0, runs, CHUNK):
        count = min(CHUNK, runs - start)
        some = rows[start : start + count]
        usual = _are_usual(some) and usual
        bodies = _placed(joints, some)
        T, J = np.empty((3, 4, count)), np.empty((6, nv, count))
        tree.frame(bodies.poses, body[0], offset[0], T)
        jacobian(bodies, T[:, 3], Moves(columns, moved, sign), J)
        for b in range(count):
            for r in range(6):
                for j in range(nv):
                    found[start + b, r, j] = J[r, j, b]
    return usual
