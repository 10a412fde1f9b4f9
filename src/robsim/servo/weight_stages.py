"""The stages of the weights of marks, and of the numbers of s that are made of them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from robsim.base.arrays import Array, frozen
from robsim.base.errors import InputError, said
from robsim.kernels.control import commanding
from robsim.kernels.control import weighting as kernels
from robsim.kernels.machine.program import Blocks, Program
from robsim.kernels.machine.rows import Rows
from robsim.servo.returned import returned
from robsim.servo.sight import Key
from robsim.servo.weightings.made_of import MadeOf
from robsim.servo.weightings.weighting import Group, MarksSeen, Residuals, WeightsOfMarks


class ResidualRows(NamedTuple):
    """The rows of what a user's weighting is shown, see `Residuals`."""

    k: int
    error: Rows  # (k,) zero where nothing is there
    weights: Rows  # (k,) by marks
    tolerances: Array
    groups: tuple[Group, ...]


def of_marks(weightings: tuple[Any, ...], seen: MarksSeen, points: Rows) -> Rows:
    """Add the stages of the weights of the marks of a sight; return their rows (N,).

    They are zero where nothing is measured, and where a mark is hidden unless a weighting fades.
    """
    ours = [each for each in weightings if isinstance(each, WeightsOfMarks)]
    program, view = seen.given.program, seen.view
    found = seen.there
    if view.hidden is not None and any(each.fades for each in ours):
        found = program.rows(seen.N)
        image = {"pixels": view.pixels, "points": points, "camera": seen.camera}
        program.add(kernels.there, **image, out=found)
    for each in ours:
        found = _product(program, found, each.marks(seen))
    return found


def of_numbers(program: Program, marks: dict[Key, Rows], made_of: list[MadeOf]) -> Rows:
    """Add the stages of the weights (k,) by marks, whose rows are given; return their rows.

    That of a number is the smallest of its marks. Those of a pose are 1 where enough are there.
    """
    found, row = program.rows(sum(len(each.marks) for each in made_of)), 0
    for each in made_of:
        rows = [[marks[key][n] for key, n in each.of_number(i)] for i in range(len(each.marks))]
        mine = found[row : row + len(rows)]
        if each.posed:
            program.add(kernels.enough, out=mine, needed=each.needed, weights=rows[0])
        else:
            program.add(kernels.least, weights=mine, numbers=rows)
        row += len(rows)
    return found


def by_error(program: Program, weightings: Sequence[Any], seen: ResidualRows) -> Rows:
    """Add the stages of a user's weightings, times the weights by marks; return their rows (k,)."""
    found = seen.weights
    for each in weightings:
        found = _product(program, found, _asked(program, each, seen))
    return found


def _product(program: Program, x: Rows, y: Rows) -> Rows:
    """Add the stage of the products of n numbers with others; return its rows."""
    found = program.rows(*x.shape)
    program.add(commanding.weigh, A=x.column, weights=y, B=found.column)
    return found


def _asked(program: Program, weighting: Any, seen: ResidualRows) -> Rows:
    """Add the stage in Python that asks a user's weighting; return its rows (k,)."""
    k, found = seen.k, program.rows(seen.k)

    def ask(blocks: Blocks, step: int) -> None:
        error, weights = (frozen(blocks.get(row)) for row in (seen.error, seen.weights))
        now = Residuals(error, weights, seen.tolerances, seen.groups)
        blocks.put(found, _checked(weighting.weigh(now), type(weighting).__name__, blocks.runs, k))

    program.call(ask)
    return found


def _checked(value: Any, name: str, runs: int, k: int) -> Array:
    """Return the weights (k, B) that a user's class gave; InputError unless they are in 0..1."""
    weights = returned(value, f"{name}.weigh", (runs, k))
    if not ((weights >= 0.0) & (weights <= 1.0)).all():
        raise InputError(f"{name}.weigh: expected weights from 0 to 1, got {said(value)}")
    return np.ascontiguousarray(weights.T)
