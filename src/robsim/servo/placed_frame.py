"""The rows of the bodies of a scene at the coordinates that a controller measures."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array
from robsim.kernels.machine.program import Blocks, Program
from robsim.kernels.machine.rows import Rows
from robsim.robot.placed import Placed
from robsim.robot.tree import Tree
from robsim.servo.given import Given
from robsim.world.scene import Scene


def placed_at(program: Program, tree: Tree, q: Rows) -> Placed:
    """Add the stages that place the bodies of a tree at coordinates in rows from q."""
    placed = Placed(program, tree.joints, q)
    placed.add()
    return placed


def prescribed_rates(given: Given, scene: Scene, columns: NDArray[np.int64]) -> Rows:
    """Return the rows of prescribed velocities of a scene, as they are at each step."""
    rows = given.program.constant(scene.drift(0.0)[columns])
    if scene.varies:

        def ask(blocks: Blocks, step: int) -> None:
            rates: Array = scene.drift(step * given.seconds)[columns, None]
            blocks.put(rows, np.repeat(rates, blocks.runs, axis=1))

        given.program.call(ask)
    return rows
