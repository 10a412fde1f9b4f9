"""Colours that people with any colour vision tell apart (Okabe and Ito, 2008), and line styles.

The one-letter colours of the primitives become the nearest of the eight; what must stay readable
in black and white differs in line style or marker as well.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from matplotlib.colors import is_color_like, to_hex, to_rgb

from robsim.base.errors import InputError
from robsim.engine.outcome import Outcome

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
GOAL = "#d6007a"  # reserved for goals
MORE = ("#332288", "#8a5a00", "#f0e442", "#882255")  # used when the others are taken
TINTS = (0.0, 0.5, -0.4)  # share of white in each seven colours; below 0 of black
OUTCOMES = {  # colour and hatch: blue for success, else warm; lightness differs too
    Outcome.CONVERGED: (BLUE, ""),
    Outcome.TIME_LIMIT: ("#f5d3b3", ""),
    Outcome.OUT_OF_IMAGE: (ORANGE, "///"),
    Outcome.BEHIND_CAMERA: ("#f0e442", "..."),
    Outcome.LOCAL_MINIMUM: (VERMILLION, "\\\\\\"),
    Outcome.JOINT_LIMIT: (PURPLE, "---"),
    Outcome.SINGULAR: ("#882255", "xxx"),
    Outcome.DIVERGED: ("#5c1a00", ""),
    Outcome.NOT_FINITE: (BLACK, ""),
    Outcome.ENDED: ("#b3a36b", "+++"),
    Outcome.RUNNING: (LIGHT_GREY, "|||"),
}
ASTERISK = (6, 2, 0)  # a marker of six strokes
LINES = ("-", "--", "-.", ":")
COMPONENTS = tuple(zip((BLUE, VERMILLION, GREEN), LINES, strict=False))  # of a vector: x, y, z


def convert_color(name: str) -> str:
    """Return the colour in which a primitive's `convert_color` is drawn: "#rrggbb".

    InputError: not a colour of Matplotlib.

    >>> convert_color("r"), convert_color("tab:blue")
    ('#d55e00', '#1f77b4')
    """
    if name in _LETTERS:
        return _LETTERS[name]
    if not is_color_like(name):
        raise InputError(
            f"no colour {name!r}: expected one of {' '.join(_LETTERS)}, or any of Matplotlib"
        )
    return to_hex(name)


def cycle_color(i: int) -> str:
    """Return the colour of the i-th mark or link, from 0; colours repeat after twenty-one.

    After seven colours come seven lighter ones, then seven darker ones.

    >>> cycle_color(0), cycle_color(7), cycle_color(21)
    ('#0072b2', '#80b9d8', '#0072b2')
    """
    turn, place = divmod(i, len(CYCLE))
    return tint_color(CYCLE[place], TINTS[turn % len(TINTS)])


def cycle_link_color(i: int) -> str:
    """Return the colour of the i-th link of a robot without colours; only the base, 0, is black.

    >>> cycle_link_color(0), cycle_link_color(1) == cycle_color(0), cycle_link_color(7) == cycle_color(7)
    ('#000000', True, True)
    """
    black = CYCLE.index(BLACK)
    return BLACK if i == 0 else cycle_color(i - 1 if i <= black else i)


def tint_color(color: str, share: float) -> str:
    """Return a colour mixed with a share of white, or of black below 0.

    Black itself becomes grey where it is to be darkened.

    >>> tint_color("#0072b2", 0.5), tint_color("#0072b2", -1), tint_color(BLACK, -0.4)
    ('#80b9d8', '#000000', '#666666')
    """
    rgb = np.array(to_rgb(color))
    if share < 0 and not rgb.any():
        return to_hex(tuple(rgb - share))
    return to_hex(tuple(rgb + share * (1 - rgb) if share >= 0 else rgb * (1 + share)))


def find_unused_color(taken: Iterable[str]) -> str:
    """Return the first colour that is not taken: black, or one of `cycle_color`; black if all are.

    >>> find_unused_color([]), find_unused_color([BLACK])
    ('#000000', '#d55e00')
    """
    order = (BLACK, VERMILLION, PURPLE, BLUE, GREEN, ORANGE, SKY_BLUE)
    every = [*order, *MORE, *(cycle_color(i) for i in range(7, 21))]
    gone = set(taken)
    return next((each for each in every if each not in gone), BLACK)
