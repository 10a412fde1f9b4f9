"""Stages that integrate the coordinates of a tree over a step of constant velocities."""

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
    """Add the stages that move coordinates q (nq,) by velocities, each in a row, over dt.

    A velocity without a row (None) is zero. Dependent coordinates follow from their sources.
    Rolling wheels and joints of Python kinds are moved by other stages.
    """
    straight: list[tuple[Any, Any]] = []
    coordinates = list(q)
    for member in joints.members:
        stage, v = member.kind.moving, rates[member.v]
        if member.is_called or not v or v[0] is None:
            continue
        if stage is None:
            straight += zip(coordinates[member.q], v, strict=True)
            continue
        arguments = {
            "dt": dt,
            "q": q[member.q][: member.kind.moved],
            "v": BlockRows(v[0], (len(v),)),
        }
        if "numbers" in stage.signature.given:
            arguments["numbers"] = program.constant(member.constants)
        program.add(stage, **arguments)
    if straight:
        program.add(integration.integrate_coordinates, dt=dt, moves=straight)


def add_python_integration(
    program: Program,
    joints: JointTables,
    q: BlockRows,
    rates: Sequence[BlockRows | None],
    dt: BlockRows,
) -> None:
    """Add a Python call that moves the coordinates of joints of Python kinds over dt."""
    python_joints = [member for member in joints.members if member.is_called]

    def move(blocks: Blocks, step: int) -> None:
        times, x, v = blocks.get(dt), blocks.get(q), np.zeros((len(rates), blocks.runs))
        for i, rate in enumerate(rates):
            if rate is not None:
                v[i] = blocks.get(rate)
        for seconds in np.unique(times):
            selected = times == seconds
            columns = x[:, selected]
            for each in python_joints:
                each.advance(columns, v[:, selected], float(seconds))
            x[:, selected] = columns
        blocks.put(q, x)

    if python_joints:
        program.call(move)


def add_wheel_rolling(
    program: Program,
    joints: JointTables,
    q: BlockRows,
    v: BlockRows,
    ratio: BlockRows,
    dt: BlockRows,
) -> None:
    """Add the stages that roll the wheels of vehicles, with the ratios of the start of the step."""
    for wheel in joints.wheels:
        m, k = wheel.v, wheel.ratio
        program.add(
            integration.roll_wheel, dt=dt, angle=q[wheel.q], v=v[m : m + 2], ratio=ratio[k : k + 2]
        )
