"""Colours that are distinct for any colour vision (Okabe and Ito, 2008), and line styles.

A one-letter colour of a primitive is drawn in the nearest of the eight colours. Curves also differ
in line style or marker, so that they are distinct in black and white.
"""

from __future__ import annotations

from collections.abc import Iterable
from functools import lru_cache

import numpy as np
from matplotlib.colors import to_hex, to_rgb

from robsim.base.colors import check_color
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
    "y": ORANGE,  # yellow is too faint on white
    "w": LIGHT_GREY,
}
CYCLE = (BLUE, VERMILLION, GREEN, PURPLE, ORANGE, SKY_BLUE, BLACK)
GOAL = "#d6007a"  # reserved for goals
MORE = ("#332288", "#8a5a00", "#f0e442", "#882255")  # used if the other colours are taken
TINTS = (0.0, 0.5, -0.4)  # share of white in each group of seven colours; below 0, of black
OUTCOMES = {  # colour and hatch: blue for success, warm for failures, of different lightness
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
    Outcome.UNDETECTED: ("#e39a8b", "ooo"),
    Outcome.NO_GRADIENT: ("#a8664f", "***"),
    Outcome.NOTHING_IN_VIEW: ("#d9a441", "OO"),
    Outcome.UNSTABLE: ("#7a0019", "xx"),
    Outcome.RUNNING: (LIGHT_GREY, "|||"),
}
ASTERISK = (6, 2, 0)  # a marker of six strokes
LINES = ("-", "--", "-.", ":")
COMPONENTS = tuple(zip((BLUE, VERMILLION, GREEN), LINES, strict=False))  # x, y, z of a vector


@lru_cache
def convert_color(name: str) -> str:
    """Return the display colour "#rrggbb" of a primitive of colour `name`.

    Raise InputError unless `name` is a colour of Matplotlib.

    >>> convert_color("r"), convert_color("tab:blue")
    ('#d55e00', '#1f77b4')
    """
    if name in _LETTERS:
        return _LETTERS[name]
    return to_hex(check_color(name))


def cycle_color(i: int) -> str:
    """Return the colour of the i-th feature point or link, from 0; colours repeat after 21.

    Seven colours are followed by seven lighter and seven darker ones.

    >>> cycle_color(0), cycle_color(7), cycle_color(21)
    ('#0072b2', '#80b9d8', '#0072b2')
    """
    turn, place = divmod(i, len(CYCLE))
    return tint_color(CYCLE[place], TINTS[turn % len(TINTS)])


def cycle_link_color(i: int) -> str:
    """Return the colour of the i-th link of a robot without colours; only link 0 is black.

    >>> cycle_link_color(0), cycle_link_color(1), cycle_link_color(1) == cycle_color(0)
    ('#000000', '#0072b2', True)
    """
    black = CYCLE.index(BLACK)
    return BLACK if i == 0 else cycle_color(i - 1 if i <= black else i)


@lru_cache
def tint_color(original: str, share: float) -> str:
    """Return a colour mixed with a share of white, or of black if the share is negative.

    Black becomes grey if the share is negative, because it cannot become darker.

    >>> tint_color("#0072b2", 0.5), tint_color("#0072b2", -1), tint_color(BLACK, -0.4)
    ('#80b9d8', '#000000', '#666666')
    """
    rgb = np.array(to_rgb(original))
    if share < 0 and not rgb.any():
        return to_hex(tuple(rgb - share))
    return to_hex(tuple(rgb + share * (1 - rgb) if share >= 0 else rgb * (1 + share)))


def find_unused_color(taken: Iterable[str]) -> str:
    """Return the first colour that is not taken, or black if all are taken.

    >>> find_unused_color([]), find_unused_color([BLACK])
    ('#000000', '#d55e00')
    """
    order = (BLACK, VERMILLION, PURPLE, BLUE, GREEN, ORANGE, SKY_BLUE)
    every = [*order, *MORE, *(cycle_color(i) for i in range(7, 21))]
    excluded = set(taken)
    return next((each for each in every if each not in excluded), BLACK)
