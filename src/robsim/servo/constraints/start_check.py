"""Check of the starts of a run: constraints that no command satisfies are reported before it."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array
from robsim.base.errors import InputError
from robsim.servo.single_step import SingleStepController
from robsim.servo.task_controller import TaskController

PERIOD = 1.0  # seconds
MOST_STARTS = 1024  # starts that are checked
MOST_NAMES = 3  # names in a message


def check_constrained_start(controller: TaskController, q0: Array) -> None:
    """Raise InputError if rows of constraints contradict one another at every start.

    The images at the starts q0 (B, nq) are exact, and the joints are free: limits of speeds only
    delay the return from a violated constraint. Laws and constraints in Python are not called,
    pictures are not drawn, and programs with numbers of each run are not checked.
    """
    check_constraints(controller)
    bound: Any = getattr(controller, "constraints", None)
    if bound is None:
        for part in getattr(controller, "parts", ()):
            check_constrained_start(part, q0)
    elif bound.row_constraints and not controller.pictured_pairs:
        rows = replace(bound, constraints=tuple(bound.row_constraints))
        _check_rows(replace(cast(Any, controller), constraints=rows), q0[:MOST_STARTS])


def _check_rows(controller: TaskController, q0: Array) -> None:
    """Raise InputError if no command satisfies all rows at any of the starts (B, nq)."""
    single = SingleStepController(controller, PERIOD)
    if not single.program.compiled or single.program.runs > 1 or not len(q0):
        return
    q = np.ascontiguousarray(q0.T)
    blocks, seen = single.begin(q.shape[1]), [sight.project(q) for sight in controller.sights]
    keys = [sight.key for sight in controller.sights]
    pixels = {key: each.pixels for key, each in zip(keys, seen, strict=True)}
    depth = {key: each.depth for key, each in zip(keys, seen, strict=True)}
    single.decide(blocks, 0, q, pixels, depth)
    assert single.outputs.slack is not None and single.outputs.active is not None
    slack, active = blocks.get(single.outputs.slack), blocks.get(single.outputs.active)
    if (slack > 0.0).any(axis=0).all():
        labels = controller.constraint_labels
        yields, holds = slack[:, 0] > 0.0, (active[:, 0] > 0.0) & ~(slack[:, 0] > 0.0)
        against = f" against {_list_names(labels, holds)}" if holds.any() else ""
        whole = "the start" if q.shape[1] == 1 else "any start"
        raise InputError(
            f"law: no command satisfies the constraints at {whole}: "
            f"{_list_names(labels, yields)}{against}"
        )


def check_constraints(controller: TaskController) -> None:
    """Raise InputError if a constraint of a controller cannot act in its scene."""
    bound = getattr(controller, "constraints", None)
    if bound is not None:
        bound.check()
    for part in (*getattr(controller, "parts", ()), *getattr(controller, "candidates", ())):
        check_constraints(part)


def _list_names(labels: tuple[str, ...], chosen: NDArray[np.bool_]) -> str:
    """Return the first chosen names as text."""
    names = [labels[i] for i in np.flatnonzero(chosen)]
    more = f" and {len(names) - MOST_NAMES} more" if len(names) > MOST_NAMES else ""
    return ", ".join(names[:MOST_NAMES]) + more
