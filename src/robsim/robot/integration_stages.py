"""The stages that move the coordinates of a tree by velocities that are held."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from robsim.kernels.bodies import integration
from robsim.kernels.machine.block_rows import BlockRows
from robsim.kernels.machine.program import Blocks, Program
from robsim.robot.assembly import JointTables


def add_integration(
    program: Program,
    joints: JointTables,
    q: BlockRows,
    rates: Sequence[BlockRows | None],
    dt: BlockRows,
) -> None:
    """Add the stages that move coordinates q (nq,) by velocities, each in a row, for dt.

    One without a row, None, is zero. What depends on others moves with them, and wheels that roll
    (see `add_wheel_rolling`) and joints of the user's kinds in Python (see `add_python_integration`) are not moved
    here.
    """
    steady: list[tuple[Any, Any]] = []
    each = list(q)
    for member in joints.members:
        stage, v = member.kind.moving, rates[member.v]
        if member.is_called or not v or v[0] is None:
            continue
        if stage is None:
            steady += zip(each[member.q], v, strict=True)
            continue
        given = {"dt": dt, "q": q[member.q][: member.kind.moved], "v": BlockRows(v[0], (len(v),))}
        if "numbers" in stage.signature.given:
            given["numbers"] = program.constant(member.constants)
        program.add(stage, **given)
    if steady:
        program.add(integration.integrate_coordinates, dt=dt, moves=steady)


def add_python_integration(
    program: Program,
    joints: JointTables,
    q: BlockRows,
    rates: Sequence[BlockRows | None],
    dt: BlockRows,
) -> None:
    """Let Python move the coordinates of joints of the user's kinds, likewise."""
    called = [member for member in joints.members if member.is_called]

    def move(blocks: Blocks, step: int) -> None:
        times, x, v = blocks.get(dt), blocks.get(q), np.zeros((len(rates), blocks.runs))
        for i, rate in enumerate(rates):
            if rate is not None:
                v[i] = blocks.get(rate)
        for seconds in np.unique(times):
            some = times == seconds
            moved = x[:, some]
            for each in called:
                each.advance(moved, v[:, some], float(seconds))
            x[:, some] = moved
        blocks.put(q, x)

    if called:
        program.call(move)


def add_wheel_rolling(
    program: Program,
    joints: JointTables,
    q: BlockRows,
    v: BlockRows,
    ratio: BlockRows,
    dt: BlockRows,
) -> None:
    """Add the stages that roll the wheels of vehicles, by ratios in rows that hold before."""
    for wheel in joints.wheels:
        m, k = wheel.v, wheel.ratio
        program.add(
            integration.roll_wheel, dt=dt, angle=q[wheel.q], v=v[m : m + 2], ratio=ratio[k : k + 2]
        )
