"""Rows of the bodies of a scene at the measured coordinates."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array
from robsim.kernels.machine.block_rows import BlockRows
from robsim.kernels.machine.program import Blocks, Program
from robsim.robot.fk_stages import FKStages
from robsim.robot.tree import Tree
from robsim.servo.controller_rows import ControllerInputs
from robsim.world.scene import Scene


def add_body_poses(program: Program, tree: Tree, q: BlockRows) -> FKStages:
    """Add the stages of forward kinematics of a tree, at coordinates in the rows q."""
    placed = FKStages(program, tree.joints, q)
    placed.add()
    return placed


def add_prescribed_velocities(
    inputs: ControllerInputs, scene: Scene, columns: NDArray[np.int64]
) -> BlockRows:
    """Return the rows of the prescribed velocities of a scene, updated at each step."""
    rows = inputs.program.constant(scene.drift(0.0)[columns])
    if scene.varies:

        def ask(blocks: Blocks, step: int) -> None:
            rates: Array = scene.drift(step * inputs.seconds)[columns, None]
            blocks.put(rows, np.repeat(rates, blocks.runs, axis=1))

        inputs.program.call(ask)
    return rows
