"""A thing in a scene, with marks to look at."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from robsim.base.arrays import frozen, numbers
from robsim.base.errors import InputError
from robsim.base.names import checked_name
from robsim.base.values import Value
from robsim.geometry.pose import IDENTITY, Pose, one_pose
from robsim.robot.link import checked_shapes


@dataclass(frozen=True, eq=False)
class Object(Value):
    """A thing in the scene: shapes to draw and `marks` (N, 3) to look at, in its own axes.

    It stands at `pose` on the frame `on`: "world", another object, or a link such as
    "rhino_xr4.tool". Without marks given, the vertices of its shapes are its marks.

    >>> from robsim.geometry.primitives import Block
    >>> Object("cube", Block(0.05, 0.05, 0.05)).marks.shape
    (8, 3)
    """

    name: str
    shapes: Any = ()
    marks: Any = None
    pose: Pose = IDENTITY
    on: str = "world"

    def __post_init__(self) -> None:
        checked_name(self.name, "object")
        shapes = checked_shapes(self.shapes, f"object '{self.name}'")
        marks = self.marks
        if marks is None:
            marks = np.concatenate([np.empty((0, 3)), *(shape.vertices for shape in shapes)])
        marks = numbers(marks, f"marks of '{self.name}'", ("N", 3))
        if marks.ndim != 2:
            raise InputError(f"marks of '{self.name}': expected shape (N, 3), got {marks.shape}")
        object.__setattr__(self, "shapes", shapes)
        object.__setattr__(self, "marks", frozen(marks))
        object.__setattr__(self, "pose", one_pose(self.pose, f"pose of '{self.name}'"))
