"""The check of colours, which have the names that Matplotlib gives them."""

from __future__ import annotations

import difflib
import re
from typing import TypeVar

from robsim.base.errors import InputError, format_value

T = TypeVar("T")
LETTERS = "k r g b c m y w"  # drawn in colours that are distinct for any colour vision
_COMMON = re.compile(r"[krgbcmyw]|#[0-9a-fA-F]{6}|0\.[0-9]+|C[0-9]")


def check_color(color: T, subject: str = "") -> T:
    """Return a colour; InputError with the nearest name unless it is a colour of Matplotlib.

    `subject` is the beginning of the message. A few forms are recognised without Matplotlib, whose
    import is slow.

    >>> check_color("0.4"), check_color("tab:blue")
    ('0.4', 'tab:blue')
    """
    if isinstance(color, str) and _COMMON.fullmatch(color):
        return color
    from matplotlib.colors import CSS4_COLORS, is_color_like

    if not is_color_like(color):
        near = difflib.get_close_matches(str(color).lower(), CSS4_COLORS, 1)
        guess = f"did you mean {near[0]!r}? " if near else ""
        raise InputError(
            f"{subject}no colour {format_value(color)}; {guess}colours: {LETTERS}, and the names "
            "of Matplotlib, such as 'orange' and '#e69f00'"
        )
    return color
