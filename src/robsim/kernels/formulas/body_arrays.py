"""The poses of the moving bodies of a kinematic tree.

A joint is `place . motion(x) . tail`. Tails and fixed joints are folded into constants before
they come here (see `robsim.robot.tree`), so a moving body has a parent body, a constant `place`,
and coordinates among x: those of the tree, q, then those that depend on them.
"""

from typing import Any, NamedTuple


class Bodies(NamedTuple):
    """The poses of the moving bodies, and the ratios by which velocities move them; run last."""

    poses: Any  # (bodies, 3, 4, B) in the world
    ratio: Any  # (ratios, B)
