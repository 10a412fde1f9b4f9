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
from robsim.servo.returned import returned
from robsim.servo.sight import Key
from robsim.servo.weightings.made_of import MadeOf
from robsim.servo.weightings.weighting import Group, MarksSeen, Residuals, WeightsOfMarks


class Rows(NamedTuple):
    """The rows of what a user's weighting is shown, see `Residuals`."""

    k: int
    error: int  # (k,) zero where nothing is there
    weights: int  # (k,) by marks
    tolerances: Array
    groups: tuple[Group, ...]


def of_marks(weightings: tuple[Any, ...], seen: MarksSeen, points: int) -> int:
    """Add the stages of the weights of the marks of a sight; return their rows (N,).

    They are zero where nothing is measured, and where a mark is hidden unless a weighting fades.
    """
    ours = [each for each in weightings if isinstance(each, WeightsOfMarks)]
    program, view = seen.given.program, seen.view
    found = seen.there
    if view.hidden >= 0 and any(each.fades for each in ours):
        found = program.rows(seen.N)
        image = view.pixels, points, seen.camera
        program.add(kernels.there, seen.N, *image, found, -1)
    for each in ours:
        found = _product(program, seen.N, found, each.marks(seen))
    return found


def of_numbers(program: Program, marks: dict[Key, int], made_of: list[MadeOf]) -> int:
    """Add the stages of the weights (k,) by marks, whose rows are given; return their rows.

    That of a number is the smallest of its marks. Those of a pose are 1 where enough are there.
    """
    row = found = program.rows(sum(len(each.marks) for each in made_of))
    for each in made_of:
        rows = [[marks[key] + n for key, n in each.of_number(i)] for i in range(len(each.marks))]
        if each.posed:
            count = len(rows[0])
            program.add(kernels.enough, len(rows), row, each.needed, count, *rows[0])
        else:
            numbers = [n for own in rows for n in (len(own), *own)]
            program.add(kernels.least, len(rows), row, *numbers)
        row += len(rows)
    return found


def by_error(program: Program, weightings: Sequence[Any], seen: Rows) -> int:
    """Add the stages of a user's weightings, times the weights by marks; return their rows (k,)."""
    found = seen.weights
    for each in weightings:
        found = _product(program, seen.k, found, _asked(program, each, seen))
    return found


def _product(program: Program, n: int, x: int, y: int) -> int:
    """Add the stage of the product of two rows of n numbers; return its rows."""
    found = program.rows(n)
    program.add(commanding.weigh, x, n, 1, y, found)
    return found


def _asked(program: Program, weighting: Any, seen: Rows) -> int:
    """Add the stage in Python that asks a user's weighting; return its rows (k,)."""
    k, found = seen.k, program.rows(seen.k)

    def ask(blocks: Blocks, step: int) -> None:
        error, weights = (frozen(blocks.get(row, k)) for row in (seen.error, seen.weights))
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
