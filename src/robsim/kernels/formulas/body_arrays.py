"""The poses of the moving bodies of a kinematic tree.

A joint is `place . motion(x) . tail`. `robsim.robot.tree` includes tails and fixed joints in
constants, so a moving body has a parent body, a constant `place`, and coordinates among x. The
vector x holds the coordinates q of the tree, followed by the dependent coordinates.
"""

from typing import Any, NamedTuple


class Bodies(NamedTuple):
    """The poses of the moving bodies, and the ratios of their moves. The run is last."""

    poses: Any  # (bodies, 3, 4, B) in the world
    ratio: Any  # (ratios, B)
