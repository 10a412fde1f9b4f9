"""Conversion of shapes to boxes, cylinders, spheres and meshes, which the formats have."""

from __future__ import annotations

import re
from collections.abc import Iterator

from robsim.geometry.pose import Pose
from robsim.geometry.primitives import Ball, Block, CameraBody, Mesh, Primitive, Wheel
from robsim.robot.urdf.parts import LETTERS

GREY = "#808080"  # for colours that only figures know by their names
_CODE = re.compile(r"#(?:[0-9a-fA-F]{3}|[0-9a-fA-F]{6}|[0-9a-fA-F]{8})")


def plain(shape: Primitive) -> Iterator[Block | Wheel | Ball | Mesh]:
    """Yield the shape, or two boxes for the body of a camera: its box and its flare."""
    if isinstance(shape, Block | Wheel | Ball | Mesh):
        yield shape
    if isinstance(shape, CameraBody):
        for start, end, scale in ((0.0, 0.75, 1.0), (0.75, 1.0, 1.25)):
            middle = Pose.at(0, 0, shape.length * (start + end) / 2)
            sides = scale * shape.height, scale * shape.width, shape.length * (end - start)
            yield Block(*sides, shape.color).at(shape.pose @ middle)


def rgba(color: str) -> tuple[float, float, float, float]:
    """Return red, green, blue and opacity of a letter or of a code such as "#1f77b4".

    >>> rgba("r"), rgba("#ff000000")[3]
    ((1.0, 0.0, 0.0, 1.0), 0.0)
    """
    code = LETTERS.get(color, color)
    code = code[1:] if _CODE.fullmatch(code) else GREY[1:]
    digits = "".join(2 * digit for digit in code) if len(code) == 3 else code
    r, g, b, a = (int(f"{digits}ff"[i : i + 2], 16) / 255 for i in (0, 2, 4, 6))
    return r, g, b, a
