"""Your own schemes on a published suite, beside the schemes of the textbooks.

As a command: robsim bench vit_500 --task bench_my_scheme.py:Damped
                                   --task bench_my_scheme.py:switching
"""

from dataclasses import dataclass, field
from typing import Any

import numpy as np

import robsim as rs


class DampedLaw:
    """Damped least squares: (A'A + 1e-4 I) qdot = -gain A'e, with A = L J."""

    def command(self, state):
        A, e = state.task_jacobian, state.error
        squares = np.einsum("bki,bkj->bij", A, A) + 1e-4 * np.eye(A.shape[2])
        wish = np.linalg.solve(squares, np.einsum("bki,bk->bi", A, e)[..., None])
        return -state.gain * wish[..., 0]


@dataclass(frozen=True, eq=False)
class Damped(rs.IBVS):
    """Image-based servoing with its own law; called as Damped(goal, gain=1.0)."""

    law: Any = field(default_factory=DampedLaw)
    interaction: Any = "mean"


def switching(goal, gain):
    """Position-based servoing, and image-based servoing while a mark is near the border."""
    inside, near = rs.PBVS(goal, gain=gain), rs.IBVS(goal, gain=gain, interaction="mean")
    return rs.Switch(inside, near, when=rs.tasks.NearBorder(40.0, (640, 480)))


if __name__ == "__main__":
    found = rs.bench("vit_500", {"mine: damped": Damped, "mine: switching": switching})
    print(found)
    best = found.table.sort_values("low", ascending=False).iloc[0]
    print(f"surest: {best.scheme}, at least {100 * best.low:.1f} % (95 % interval)")
