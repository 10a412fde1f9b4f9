"""The stages that move the coordinates of a tree by velocities that are held."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from robsim.kernels.bodies import moving
from robsim.kernels.machine.program import Program
from robsim.kernels.machine.rows import Rows
from robsim.robot.assembly import Joints


def add_motion(
    program: Program, joints: Joints, q: Rows, rates: Sequence[Rows | None], dt: Rows
) -> None:
    """Add the stages that move coordinates q (nq,) by velocities, each in a row, for dt.

    One without a row, None, is zero. What depends on others moves with them, and wheels that roll
    (see `add_rolling`) and joints of the user's kinds in Python are not moved here.
    """
    steady: list[tuple[Any, Any]] = []
    for member in joints.members:
        stage, own, v = member.kind.moving, q[member.q], rates[member.v]
        called = member.kind.own and member.kind.placing is None
        if called or not v or v[0] is None:
            continue
        if stage is None:
            steady += zip(own, v, strict=True)
            continue
        given = {"dt": dt, "q": own, "v": Rows(v[0], (len(v),))}
        if "numbers" in stage.signature.given:
            given["numbers"] = program.constant(member.constants)
        program.add(stage, **given)
    if steady:
        program.add(moving.run, dt=dt, moves=steady)


def add_rolling(program: Program, joints: Joints, q: Rows, v: Rows, ratio: Rows, dt: Rows) -> None:
    """Add the stages that roll the wheels of vehicles, by ratios in rows that hold before."""
    for wheel in joints.wheels:
        m, k = wheel.v, wheel.ratio
        program.add(moving.roll, dt=dt, angle=q[wheel.q], v=v[m : m + 2], ratio=ratio[k : k + 2])
