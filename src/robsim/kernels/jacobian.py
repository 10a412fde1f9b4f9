"""Jacobians of frames by velocities, written once for every kind of joint.

A velocity of a tree moves one or several bodies: each such move is along or about an axis of that
body's own frame, times a ratio. Ratio 0 is 1; the others are derivatives of coordinates that
depend on others, curvatures of rails, what turns the wheels of vehicles, and the twists of joints
of the user's own kinds.
"""

from typing import Any, NamedTuple

from robsim.kernels.jit import kernel


class Moves(NamedTuple):
    """The moves of some velocities of a tree: one row for each body that each of them moves."""

    columns: Any  # the velocities
    # (moves, 5): the number of its velocity among them, in order; body, whether it turns, axis,
    # row of its ratio. One table, because each array that a kernel is given costs time
    rows: Any
    sign: Any


@kernel
def jacobian(bodies, point, moves, J):
    """Compute J[6, j, b] of a frame at point[3, b], rows (v, omega) in world axes.

    `sign` is 1 where a move carries the frame and 0 where not; for the motion of one frame
    relative to another it is the difference of the two, both taken at the same point.
    An axis a through o gives v = a x (p - o), omega = a; a slide along a gives v = a.
    """
    M = bodies.poses
    for m in range(moves.sign.size):
        j, i, turns, c, k = moves.rows[m]
        s, more = float(moves.sign[m]), m > 0 and moves.rows[m - 1, 0] == j
        for r in range(3):
            u, w = (r + 1) % 3, (r + 2) % 3
            for b in range(M.shape[3]):
                ratio = s * bodies.ratio[k, b]
                if turns:
                    v = ratio * (
                        M[i, u, c, b] * (point[w, b] - M[i, w, 3, b])
                        - M[i, w, c, b] * (point[u, b] - M[i, u, 3, b])
                    )
                    omega = ratio * M[i, r, c, b]
                else:
                    v, omega = ratio * M[i, r, c, b], 0.0
                J[r, j, b] = J[r, j, b] + v if more else v
                J[r + 3, j, b] = J[r + 3, j, b] + omega if more else omega


@kernel
def spread(columns, some, drift, qd):
    """Compute qd: some[j, b] in rows columns[j], and drift[i] for the other velocities."""
    for i in range(qd.shape[0]):
        for b in range(qd.shape[1]):
            qd[i, b] = drift[i]
    for j in range(columns.size):
        for b in range(qd.shape[1]):
            qd[columns[j], b] = some[j, b]
