"""The stages that move the coordinates of a tree by velocities that are held."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from robsim.kernels.bodies import moving
from robsim.kernels.formulas import joints as kinds
from robsim.kernels.formulas.tree import IQ, IV, KIND, Joints
from robsim.kernels.machine.program import Program
from robsim.kernels.machine.rows import Rows

IN_PLANE = {kinds.PLANAR: 3, kinds.UNICYCLE: 2, kinds.CAR: 2}  # velocities


def add_motion(
    program: Program, joints: Joints, q: Rows, rates: Sequence[Rows | None], dt: Rows
) -> None:
    """Add the stages that move coordinates q (nq,) by velocities, each in a row, for dt.

    One without a row, None, is zero. What depends on others moves with them, and wheels that roll
    (see `add_rolling`) and joints of the user's kinds in Python are not moved here.
    """
    steady: list[tuple[Any, Any]] = []
    for row in joints.rows[1:].tolist():
        kind, first, at = row[KIND], row[IQ], row[IV]
        rate = rates[at] if at >= 0 else None
        if rate is None or kind == kinds.OWN:
            continue
        if kind == kinds.FLOATING:
            program.add(moving.fly, dt=dt, q=q[first : first + 7], v=Rows(rate, (6,)))
        elif kind in IN_PLANE:
            v = Rows(rate, (IN_PLANE[kind],))
            program.add(moving.glide, dt=dt, q=q[first : first + 3], v=v)
        else:
            steady.append((q[first], rate))
    for each in joints.staged:
        member = each.member
        own, v = q[member.q], rates[member.v]
        if v[0] is None:
            continue
        if member.kind.moving is not None:
            given = {"dt": dt, "q": own, "v": Rows(v[0], (len(v),))}
            program.add(member.kind.moving, **given, numbers=program.constant(each.constants))
        else:
            steady += zip(own, v, strict=True)
    if steady:
        program.add(moving.run, dt=dt, moves=steady)


def add_rolling(program: Program, joints: Joints, q: Rows, v: Rows, ratio: Rows, dt: Rows) -> None:
    """Add the stages that roll the wheels of vehicles, by ratios in rows that hold before."""
    for n, m, _, k in joints.wheels.rows:
        program.add(moving.roll, dt=dt, angle=q[n], v=v[m : m + 2], ratio=ratio[k : k + 2])
