"""The constants of a kinematic tree, and the poses of its moving bodies.

A joint is `place . motion(x) . tail`. Tails and fixed joints are folded into constants before
they come here (see `robsim.robot.tree`), so a moving body i has a parent body, a constant `place`,
a kind, and its first coordinate `ix` among x: those of the tree, q, then those that depend on them.
"""

from typing import Any, NamedTuple

from robsim.kernels.formulas import curve
from robsim.kernels.formulas.ties import Ties, Wheels

# Columns of `Joints.rows`
PARENT, KIND, IX, IQ, IV, CURVE, BEND = range(7)


class Joints(NamedTuple):
    """The constants of a tree, body by body; body 0 is the world."""

    # (bodies, 7): parent; kind; first coordinate among x; the same where it is one of the tree's
    # own, or -1; first velocity, or -1; the curve of a rail; row of its curvature among the ratios
    rows: Any
    place: Any  # (bodies, 3, 4)
    ties: Ties
    wheels: Wheels
    curves: curve.Curves
    ratios: int  # how many
    staged: Any  # the joints of kinds of the user's own that are compiled


class Bodies(NamedTuple):
    """The poses of the moving bodies, and the ratios by which velocities move them; run last."""

    poses: Any  # (bodies, 3, 4, B) in the world
    ratio: Any  # (ratios, B)
