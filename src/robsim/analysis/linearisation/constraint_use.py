"""The constraint of a law that is nearest at a start."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from robsim.base.arrays import Array
from robsim.kernels.machine.program import Blocks, Program
from robsim.servo.constraints.joint_accelerations import JointAccelerations
from robsim.servo.controller_rows import allocate_inputs, put_exact_images
from robsim.servo.servo_controller import ServoController
from robsim.servo.servo_stages import ServoStages
from robsim.servo.task_controller import TaskController


def find_nearest_constraint(
    controller: TaskController, q: Array | None, dt: float
) -> tuple[str, float] | None:
    """Return the constraint that the wish of the law uses most at coordinates q (nq,).

    The share is the rate of the wish towards the constraint over the largest permitted rate, above
    1 if the constraint acts. The result is None without constraints, and if none is approached. The
    acceleration from rest is left out.
    """
    if not isinstance(controller, ServoController) or controller.constraints is None or q is None:
        return None
    if controller.pictured_pairs:
        return None
    bound = controller.constraints
    others = tuple(one for one in bound.constraints if not isinstance(one, JointAccelerations))
    case = replace(controller, constraints=replace(bound, constraints=others))
    shares = _measure_shares(case, q, dt)
    i = int(np.argmax(shares)) if shares.size else -1
    return (case.constraint_labels[i], float(shares[i])) if i >= 0 and shares[i] > 0.0 else None


def _measure_shares(controller: ServoController, q: Array, dt: float) -> Array:
    """Return the share (c,) of each constraint at coordinates q (nq,), with an exact image."""
    program = Program()
    inputs = allocate_inputs(program, controller.sights, q.size, dt)
    stages = ServoStages(controller, inputs)
    stages.assess()
    stages.command()
    rows = stages.constrained
    assert rows is not None
    blocks = Blocks(program, np.zeros(1, dtype=np.int64))
    put_exact_images(blocks, inputs, controller.sights, np.ascontiguousarray(q[:, None]))
    for part in program.segments():
        part(blocks, 0)
    wish, low, high, C, b = map(
        blocks.first, (rows.of.wish, rows.low, rows.high, rows.C, rows.bounds)
    )
    each = (
        [_divide_rates(-wish, -low), _divide_rates(wish, high)] if rows.bound.joint_limits else []
    )
    return np.concatenate([*each, _divide_rates(-(C @ wish), -b)])


def _divide_rates(rates: Array, most: Array) -> Array:
    """Return rates over their largest values: 0 away from a constraint, inf beyond it."""
    with np.errstate(divide="ignore", invalid="ignore"):
        shares = np.where(most > 0.0, rates / most, np.where(rates > most, np.inf, 0.0))
    return np.where(np.isfinite(most), np.maximum(shares, 0.0), 0.0)
