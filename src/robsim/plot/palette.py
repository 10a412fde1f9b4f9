"""Colours that people with any colour vision tell apart (Okabe and Ito, 2008), and line styles.

The one-letter colours of the primitives become the nearest of the eight; what must stay readable
in black and white differs in line style or marker as well.
"""

from __future__ import annotations

from matplotlib.colors import is_color_like, to_hex

from robsim.base.errors import InputError

BLACK = "#000000"
ORANGE = "#e69f00"
SKY_BLUE = "#56b4e9"
GREEN = "#009e73"
BLUE = "#0072b2"
VERMILLION = "#d55e00"
PURPLE = "#cc79a7"
GREY = "#8c8c8c"
LIGHT_GREY = "#d4d4d4"
FAINT = "#f2f2f2"

_LETTERS = {
    "k": BLACK,
    "r": VERMILLION,
    "g": GREEN,
    "b": BLUE,
    "c": SKY_BLUE,
    "m": PURPLE,
    "y": ORANGE,  # yellow itself is too faint on white
    "w": LIGHT_GREY,
}
CYCLE = (BLUE, VERMILLION, GREEN, PURPLE, ORANGE, SKY_BLUE, BLACK)
ASTERISK = (6, 2, 0)  # a marker of six strokes
LINES = ("-", "--", "-.", ":")
COMPONENTS = tuple(zip((BLUE, VERMILLION, GREEN), LINES, strict=False))  # of a vector: x, y, z


def color(name: str) -> str:
    """The colour in which a primitive's `color` is drawn: "#rrggbb".

    InputError: not a colour of Matplotlib.

    >>> color("r"), color("tab:blue")
    ('#d55e00', '#1f77b4')
    """
    if name in _LETTERS:
        return _LETTERS[name]
    if not is_color_like(name):
        raise InputError(
            f"no colour {name!r}: expected one of {' '.join(_LETTERS)}, or any of Matplotlib"
        )
    return to_hex(name)


def nth(i: int) -> str:
    """The colour of the i-th mark or link, from 0; they repeat after seven.

    >>> nth(0), nth(7)
    ('#0072b2', '#0072b2')
    """
    return CYCLE[i % len(CYCLE)]
