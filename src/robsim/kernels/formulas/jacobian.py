"""Moves of bodies by velocities, the common input of Jacobians for all kinds of joints.

A velocity of a tree moves one or several bodies. Each move is a translation along an axis of the
body's frame, or a rotation about it, times a ratio. The ratio with index 0 is the
constant 1. The other ratios are derivatives of dependent coordinates, curvatures of rails, wheel
ratios of vehicles, and twists of user-defined joints.
"""

from typing import Any, NamedTuple


class BodyMoves(NamedTuple):
    """The moves of selected velocities of a tree, one row for each pair of velocity and body."""

    columns: Any  # indices of the velocities
    # (moves, 5): index among `columns`, in ascending order; body; 1 for a rotation; axis; row of
    # its ratio
    rows: Any
    # (moves,): 1 if the move carries the frame, else 0; for a motion relative to another frame, the
    # difference of both values, with the motions taken at the same point
    sign: Any
