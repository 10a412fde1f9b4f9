"""Recorded poses as a CSV table, which a spreadsheet can change."""

from __future__ import annotations

import csv
import io

import numpy as np

from robsim.base.errors import InputError, prefix_errors
from robsim.robot.robot import Robot
from robsim.studio.pendant.coordinate_fields import (
    CoordinateField,
    list_coordinate_fields,
    round_coordinates,
)
from robsim.studio.pendant.recorded_poses import MOST_POSES, RecordedPose, check_pose_name

FIRST_COLUMN = "pose"


def format_pose_table(robot: Robot, poses: list[RecordedPose]) -> str:
    """Return the recorded poses as CSV, with a column for each coordinate and its unit."""
    fields, text = list_coordinate_fields(robot), io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(_list_columns(fields))
    for pose in poses:
        shown = (round(float(x) / f.size, 6) + 0.0 for x, f in zip(pose.q, fields, strict=True))
        writer.writerow([pose.name, *(f"{x:.9g}" for x in shown)])
    return text.getvalue()


def read_pose_table(robot: Robot, text: str) -> list[RecordedPose]:
    """Return the poses of a CSV table, as `format_pose_table` writes it.

    Raise InputError if the columns do not fit the robot, or if a name or number is not valid.
    """
    fields = list_coordinate_fields(robot)
    head, *rows = [row for row in csv.reader(io.StringIO(text)) if row] or [[]]
    if [name.strip() for name in head] != _list_columns(fields):
        raise InputError(f"poses: expected the columns {', '.join(_list_columns(fields))}")
    if len(rows) > MOST_POSES:
        raise InputError(f"poses: at most {MOST_POSES} poses, got {len(rows)}")
    poses: list[RecordedPose] = []
    for number, row in enumerate(rows, 2):
        with prefix_errors(f"poses, line {number}"):
            poses.append(_read_row(robot, fields, row, [pose.name for pose in poses]))
    return poses


def _read_row(
    robot: Robot, fields: list[CoordinateField], row: list[str], others: list[str]
) -> RecordedPose:
    """Return the pose of a row; `others` are the names of the rows before it."""
    if len(row) != len(fields) + 1:
        raise InputError(f"expected {len(fields) + 1} columns, got {len(row)}")
    q = np.empty(len(fields))
    for i, (field, text) in enumerate(zip(fields, row[1:], strict=True)):
        try:
            value = float(text)
        except ValueError:
            raise InputError(f"{field.name}: expected a number, got {text!r}") from None
        q[i] = field.convert_number(value) if field.unit else value
    checked = robot.coordinates(q, "q", limits=False)
    return RecordedPose(check_pose_name(row[0], others), round_coordinates(fields, checked))


def _list_columns(fields: list[CoordinateField]) -> list[str]:
    """Return the names of the columns."""
    return [FIRST_COLUMN, *(f"{field.name} [{field.unit or '1'}]" for field in fields)]
