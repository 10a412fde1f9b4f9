"""The moves of bodies by velocities, of which Jacobians are made for every kind of joint alike.

A velocity of a tree moves one or several bodies: each such move is along or about an axis of that
body's own frame, times a ratio. Ratio 0 is 1; the others are derivatives of coordinates that
depend on others, curvatures of rails, what turns the wheels of vehicles, and the twists of joints
of the user's own kinds.
"""

from typing import Any, NamedTuple


class BodyMoves(NamedTuple):
    """The moves of some velocities of a tree: one row for each body that each of them moves."""

    columns: Any  # the velocities
    # (moves, 5): the number of its velocity among them, in order; body, whether it turns, axis,
    # row of its ratio
    rows: Any
    # of each move: 1 where it carries the frame and 0 where not; for the motion of one frame
    # relative to another the difference of the two, both taken at the same point
    sign: Any
