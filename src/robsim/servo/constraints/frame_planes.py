"""Rows of planes that the origin of a frame must not cross."""

from __future__ import annotations

from robsim.base.arrays import Array
from robsim.base.errors import InputError
from robsim.kernels.control.space_barriers import bound_planes
from robsim.servo.constraints.constraint import ConstraintInputs, ConstraintPlace, ConstraintRows
from robsim.servo.constraints.frame_motion import (
    add_motion_in_world,
    check_frames,
    is_moved_relative,
)


def check_moving_frame(who: str, place: ConstraintPlace, frame: str) -> None:
    """Raise InputError unless a frame exists and a commanded joint moves it."""
    check_frames(who, place, [frame])
    if not is_moved_relative(place, frame):
        raise InputError(f"{who}: no commanded joint moves frame '{frame}'")


def add_planes(
    of: ConstraintInputs, frame: str, rate: float | Array, planes: Array
) -> ConstraintRows:
    """Add the stage of the rows of planes (m, 4), a unit normal and an offset each."""
    program, motion, m = of.inputs.program, add_motion_in_world(of, frame), len(planes)
    rows = ConstraintRows(program.rows(m, of.columns.size), program.rows(m))
    program.add(
        bound_planes,
        **motion._asdict(),
        planes=program.constant(planes),
        rate=program.number(rate),
        dt=of.inputs.dt,
        **rows._asdict(),
    )
    return rows
