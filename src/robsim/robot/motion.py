"""The stages that move the coordinates of a tree by velocities that are held."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from robsim.kernels.bodies import moving
from robsim.kernels.formulas import joints as kinds
from robsim.kernels.formulas.tree import IQ, IV, KIND, Joints
from robsim.kernels.machine.program import Program

IN_PLANE = {kinds.PLANAR: 3, kinds.UNICYCLE: 2, kinds.CAR: 2}  # velocities


def add_motion(program: Program, joints: Joints, q: int, rates: ArrayLike, dt: int) -> None:
    """Add the stages that move coordinates, in rows from q, by velocities in rows `rates` for dt.

    A row is -1 where a velocity is zero. What depends on others moves with them, and wheels that
    roll (see `add_rolling`) and joints of the user's kinds in Python are not moved here.
    """
    steady: list[int] = []
    v = np.asarray(rates)
    for row in joints.rows[1:]:
        kind, first, rate = row[KIND], q + row[IQ], v[row[IV]]
        if row[IV] < 0 or rate < 0 or kind == kinds.OWN:
            continue
        if kind == kinds.FLOATING:
            program.add(moving.fly, dt, first, rate)
        elif kind in IN_PLANE:
            program.add(moving.glide, dt, first, rate, IN_PLANE[kind])
        else:
            steady += [first, rate]
    for each in joints.staged:
        member = each.member
        first, rate = q + member.q.start, v[member.v.start]
        if rate < 0:
            continue
        if member.kind.moving is not None:
            program.add(member.kind.moving, dt, first, rate, program.constant(each.constants))
        else:
            steady += [row for i in range(len(v[member.v])) for row in (first + i, rate + i)]
    if steady:
        program.add(moving.run, dt, len(steady) // 2, *steady)


def add_rolling(program: Program, joints: Joints, q: int, v: int, ratio: int, dt: int) -> None:
    """Add the stages that roll the wheels of vehicles, by ratios in rows that hold before."""
    for n, m, _, k in joints.wheels.rows:
        program.add(moving.roll, dt, q + n, v + m, ratio + k)
