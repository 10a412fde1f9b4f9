"""Conversion of shapes to the shapes of a file format, and of colours."""

from __future__ import annotations

import re
from collections.abc import Container, Iterator

from robsim.geometry.primitives import Primitive
from robsim.robot.urdf.urdf_link import COLOR_LETTERS

GREY = "#808080"  # for names of colours that only figures support
_CODE = re.compile(r"#(?:[0-9a-fA-F]{3}|[0-9a-fA-F]{6}|[0-9a-fA-F]{8})")


def split_into_solids(shape: Primitive, kinds: Container[type[Primitive]]) -> Iterator[Primitive]:
    """Yield the shape if its type is one of these, else the simpler shapes that replace it."""
    if type(shape) in kinds:
        yield shape
    else:
        for each in shape.simpler():
            yield from split_into_solids(each, kinds)


def color_to_rgba(color: str) -> tuple[float, float, float, float]:
    """Return red, green, blue and opacity of a letter or of a code such as "#1f77b4".

    >>> color_to_rgba("r"), color_to_rgba("#ff000000")[3]
    ((1.0, 0.0, 0.0, 1.0), 0.0)
    """
    code = COLOR_LETTERS.get(color, color)
    code = code[1:] if _CODE.fullmatch(code) else GREY[1:]
    digits = "".join(2 * digit for digit in code) if len(code) == 3 else code
    r, g, b, a = (int(f"{digits}ff"[i : i + 2], 16) / 255 for i in (0, 2, 4, 6))
    return r, g, b, a
