"""ViT-500 with a poster of 40 marks; a start need not see all of them.

Starts, goal, camera, gain, length and criterion are the same as in `vit_500`, with 88 starts that
do not see all four marks of the square. The poster is chosen here: 8 x 5 marks in the plane z = 0
that fill the image of the goal to 32 pixels from its sides. All schemes have the weighting
`Border`, except one scheme that needs every mark.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from robsim.base.arrays import Array, make_read_only
from robsim.servo.tasks.schemes import IBVS
from robsim.servo.weightings.border import Border
from robsim.suites.builtin_schemes import BUILT_IN
from robsim.suites.camera_poses import make_flying_scene
from robsim.suites.published import vit_500
from robsim.suites.suite import Suite

COLUMNS, ROWS = 8, 5
WIDTH, HEIGHT = 0.7, 0.506  # metres, from the first mark to the last


def suite() -> Suite:
    """Return the suite."""
    square = vit_500.suite()
    schemes = {
        name: replace(task, weighting=Border())
        for name, task in BUILT_IN.items()
        if name != "partitioned"  # its area needs all marks
    }
    return replace(
        square,
        name="vit_500_poster",
        title="the starts of vit_500 above a poster of 40 marks, which may leave the image",
        scene=make_flying_scene(vit_500.FOCAL, poster_marks()),
        groups={"square": label_visibility(square)},
        schemes={**schemes, "IBVS, every mark": IBVS()},
    )


def poster_marks() -> Array:
    """Return the marks (40, 3), row by row, in metres."""
    x = np.linspace(-0.5, 0.5, COLUMNS) * WIDTH
    y = np.linspace(-0.5, 0.5, ROWS) * HEIGHT
    marks = np.array([[a, b, 0.0] for b in y for a in x])
    return make_read_only(marks)


def label_visibility(square: Suite) -> list[str]:
    """Return for each start (500,) whether it sees all four marks of the square of `vit_500`."""
    visibility = square.scene.view(square.starts).visibility
    return ["sees less than the square" if each.any() else "sees the square" for each in visibility]
