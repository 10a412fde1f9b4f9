"""Stages of the weights of marks, and of the components of s that depend on them."""

from __future__ import annotations

from collections.abc import Sequence
from functools import reduce
from typing import Any

import numpy as np

from robsim.base.arrays import Array, make_read_only
from robsim.base.errors import InputError, format_value
from robsim.features.feature_rows import concatenate_rows
from robsim.kernels.control import control_law
from robsim.kernels.control import mark_weights as kernels
from robsim.kernels.machine.block_rows import BlockRows
from robsim.kernels.machine.program import Blocks, Program
from robsim.kernels.machine.stages import CompiledStage
from robsim.servo.camera_target import PairKey
from robsim.servo.controller_rows import ControllerInputs, ViewRows
from robsim.servo.user_return import check_returned_array
from robsim.servo.weightings.mark_dependencies import MarkDependencies
from robsim.servo.weightings.weighting_protocol import (
    ComponentGroup,
    MarkRows,
    MarkWeighting,
    Residuals,
    Weighting,
)


def add_mark_weights(
    weightings: Sequence[Weighting | MarkWeighting],
    inputs: ControllerInputs,
    view: ViewRows,
    points: BlockRows,
    camera: BlockRows,
    goal: Array,
) -> BlockRows:
    """Add the stages of the weights of marks, see `MarkRows`; return their rows (N,).

    The weight of a mark is 0 if the mark has no measurement, or if the mark is hidden and no
    weighting fades marks.
    """
    ours = [each for each in weightings if isinstance(each, MarkWeighting)]
    program, N = inputs.program, view.depth.size
    image = {"pixels": view.pixels, "points": points, "camera": camera}
    weights = program.result(kernels.flag_measured_marks, "out", N, **image, hidden=view.hidden)
    rows = MarkRows(inputs, N, view, camera, weights, goal)
    if view.hidden is not None and any(each.fades for each in ours):
        weights = program.result(kernels.flag_measured_marks, "out", N, **image)
    for each in ours:
        weights = scale_entries(program, weights, each.marks(rows))
    return weights


def add_component_weights(
    program: Program, marks: dict[PairKey, BlockRows], dependencies: list[MarkDependencies]
) -> BlockRows:
    """Add the stages of the weights (k,) of components, from weights of marks; return their rows.

    The weight of a component is the smallest weight of its marks. The weights of a pose are 1 if
    enough marks are measured.
    """
    return concatenate_rows(
        program, [_add_block_weights(program, marks, each) for each in dependencies]
    )


def add_maximum(program: Program, rows: Sequence[BlockRows | None]) -> BlockRows | None:
    """Return the row of the maximum of rows that exist, such as the worst status; None if none."""
    given = [each for each in rows if each is not None]
    if len(given) < 2:
        return given[0] if given else None
    return program.result(kernels.compute_row_maximum, "out", rows=given)


def _add_block_weights(
    program: Program, marks: dict[PairKey, BlockRows], each: MarkDependencies
) -> BlockRows:
    """Return the rows of the weights of the components of one block."""
    rows = [[marks[key][n] for key, n in each.of_number(i)] for i in range(len(each.marks))]
    if each.uses_pose:
        arguments = {"least_count": each.least_marks, "weights": rows[0]}
        return program.result(kernels.require_enough_marks, "out", len(rows), **arguments)
    return program.result(kernels.compute_smallest_weights, "weights", len(rows), numbers=rows)


def add_user_weights(
    program: Program,
    weightings: Sequence[Weighting],
    error: BlockRows,
    weights: BlockRows,
    tolerances: Array,
    groups: tuple[ComponentGroup, ...],
) -> BlockRows:
    """Add the stage of users' weightings, times the weights (k,) from the marks; return its rows.

    The stage runs in Python and passes `Residuals` to each weighting, with a zero error for
    components without a measurement.
    """
    k = weights.size

    def ask(blocks: Blocks, step: int) -> Array:
        by_marks = make_read_only(blocks.get(weights))
        now = Residuals(make_read_only(blocks.get(error)), by_marks, tolerances, groups)
        each = [
            _check_user_weights(one.weigh(now), type(one).__name__, blocks.runs, k)
            for one in weightings
        ]
        return reduce(np.multiply, each, by_marks)

    return program.add_python_rows(ask, k)


def scale_entries(program: Program, A: BlockRows, weights: BlockRows) -> BlockRows:
    """Add the stage that multiplies each entry (n, ...) of A by its own weight; return its rows."""
    return _apply_to_entries(program, control_law.weight_matrix_rows, "B", A, weights=weights)


def mask_entries(program: Program, A: BlockRows, hidden: BlockRows) -> BlockRows:
    """Add the stage that sets hidden entries (n, ...) of A to zero; return its rows."""
    return _apply_to_entries(program, control_law.mask_hidden_rows, "out", A, hidden=hidden)


def _apply_to_entries(
    program: Program, stage: CompiledStage, to: str, A: BlockRows, **by: BlockRows
) -> BlockRows:
    """Add a stage that acts on each entry (n, ...) of A; return its rows."""
    whole = A.reshape(A.shape[0], -1)
    return program.result(stage, to, *whole.shape, A=whole, **by).reshape(*A.shape)


def _check_user_weights(value: Any, name: str, runs: int, k: int) -> Array:
    """Return the weights (k, B) of a user's weighting; raise InputError unless they are in 0..1."""
    weights = check_returned_array(value, f"{name}.weigh", (runs, k))
    if not ((weights >= 0.0) & (weights <= 1.0)).all():
        raise InputError(f"{name}.weigh: expected weights from 0 to 1, got {format_value(value)}")
    return np.ascontiguousarray(weights.T)
