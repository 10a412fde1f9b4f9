"""The stages of the weights of marks, and of the numbers of s that are made of them."""

from __future__ import annotations

from collections.abc import Sequence
from functools import reduce
from typing import Any

import numpy as np

from robsim.base.arrays import Array, frozen
from robsim.base.errors import InputError, said
from robsim.features.rows import joined
from robsim.kernels.control import commanding
from robsim.kernels.control import weighting as kernels
from robsim.kernels.machine.program import Blocks, Program
from robsim.kernels.machine.rows import Rows
from robsim.kernels.machine.stage import Stage
from robsim.servo.given import Given, View
from robsim.servo.returned import returned
from robsim.servo.sight import Key
from robsim.servo.weightings.made_of import MadeOf
from robsim.servo.weightings.weighting import Group, MarksSeen, Residuals, WeightsOfMarks


def of_marks(
    weightings: tuple[Any, ...], given: Given, view: View, points: Rows, camera: Rows, goal: Array
) -> Rows:
    """Add the stages of the weights of marks, see `MarksSeen`; return their rows (N,).

    They are zero where nothing is measured, and where a mark is hidden unless a weighting fades.
    """
    ours = [each for each in weightings if isinstance(each, WeightsOfMarks)]
    program, N = given.program, view.depth.size
    image = {"pixels": view.pixels, "points": points, "camera": camera}
    found = program.result(kernels.there, "out", N, **image, hidden=view.hidden)
    seen = MarksSeen(given, N, view, camera, found, goal)
    if view.hidden is not None and any(each.fades for each in ours):
        found = program.result(kernels.there, "out", N, **image)
    for each in ours:
        found = weighed(program, found, each.marks(seen))
    return found


def of_numbers(program: Program, marks: dict[Key, Rows], made_of: list[MadeOf]) -> Rows:
    """Add the stages of the weights (k,) by marks, whose rows are given; return their rows.

    That of a number is the smallest of its marks. Those of a pose are 1 where enough are there.
    """
    return joined(program, [_of_block(program, marks, each) for each in made_of])


def _of_block(program: Program, marks: dict[Key, Rows], each: MadeOf) -> Rows:
    rows = [[marks[key][n] for key, n in each.of_number(i)] for i in range(len(each.marks))]
    if each.posed:
        given = {"needed": each.needed, "weights": rows[0]}
        return program.result(kernels.enough, "out", len(rows), **given)
    return program.result(kernels.least, "weights", len(rows), numbers=rows)


def by_error(
    program: Program,
    weightings: Sequence[Any],
    error: Rows,
    weights: Rows,
    tolerances: Array,
    groups: tuple[Group, ...],
) -> Rows:
    """Add the stage of users' weightings, times the weights (k,) by marks; return its rows (k,).

    It is in Python, and shows each of them the `Residuals`: the error is zero where nothing is.
    """
    k = weights.size

    def ask(blocks: Blocks, step: int) -> Array:
        by_marks = frozen(blocks.get(weights))
        now = Residuals(frozen(blocks.get(error)), by_marks, tolerances, groups)
        each = [_checked(one.weigh(now), type(one).__name__, blocks.runs, k) for one in weightings]
        return reduce(np.multiply, each, by_marks)

    return program.asked(ask, k)


def weighed(program: Program, A: Rows, weights: Rows) -> Rows:
    """Add the stage of the entries (n, ...) of A, each times its own weight; return its rows."""
    return _each_entry(program, commanding.weigh, "B", A, weights=weights)


def masked(program: Program, A: Rows, hidden: Rows) -> Rows:
    """Add the stage of the entries (n, ...) of A, or zeros where hidden; return its rows."""
    return _each_entry(program, commanding.masked, "out", A, hidden=hidden)


def _each_entry(program: Program, stage: Stage, to: str, A: Rows, **by: Rows) -> Rows:
    whole = A.reshape(A.shape[0], -1)
    return program.result(stage, to, *whole.shape, A=whole, **by).reshape(*A.shape)


def _checked(value: Any, name: str, runs: int, k: int) -> Array:
    """Return the weights (k, B) that a user's class gave; InputError unless they are in 0..1."""
    weights = returned(value, f"{name}.weigh", (runs, k))
    if not ((weights >= 0.0) & (weights <= 1.0)).all():
        raise InputError(f"{name}.weigh: expected weights from 0 to 1, got {said(value)}")
    return np.ascontiguousarray(weights.T)
