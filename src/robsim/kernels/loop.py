"""The closed loop of the built-in schemes, compiled: a chunk of runs until one of them ends.

It is the same sequence of kernels as in `robsim.run.loop`, which runs anybody's features and
laws step by step; both give the same bits.
"""

from typing import Any, NamedTuple

import numpy as np

from robsim.kernels import (
    camera,
    endings,
    features,
    jacobian,
    laws,
    random,
    record,
    sight,
    solve,
    tree,
)
from robsim.kernels.jit import kernel, part

JOINT, CAMERA = 0, 1  # laws


class Scheme(NamedTuple):
    """The constants of a built-in scheme."""

    in_pixels: bool
    interaction: int  # features.CURRENT, DESIRED, MEAN
    depth: int  # features.TRUE, GOAL, CONSTANT
    metres: float
    depth_scale: Any  # (N, 1)
    Z_goal: Any  # (N, 1)
    s_goal: Any  # (k, 1)
    L_goal: Any  # (k, 6, 1)
    law: int  # JOINT, CAMERA
    length: float
    gain: float
    pace: float
    transposed: bool
    damping: float
    rcond: float
    tolerance: float


class Noise(NamedTuple):
    """Pixel noise: standard deviation, seed, and the run numbers of the chunk."""

    sigma: float
    seed: Any  # uint64
    runs: Any


class Command(NamedTuple):
    """An instant of control, with the run last."""

    s: Any  # (k, B)
    error: Any  # (k, B)
    qd: Any  # (n, B) of the commanded joints
    task_jacobian: Any  # (k, n, B) L J: how the commanded joints move the features


@part
def measure(pixels, noise, step, out):
    """Compute out = pixels[n, 2, b] with the noise of this step."""
    if noise.sigma > 0.0:
        random.normal_pairs(noise.seed, noise.runs, step, 0, out)
    for n in range(out.shape[0]):
        for r in range(2):
            for b in range(out.shape[2]):
                extra = noise.sigma * out[n, r, b] if noise.sigma > 0.0 else 0.0
                out[n, r, b] = pixels[n, r, b] + extra


@part
def control(scheme, eye, moves, projection, pixels, x, Z, L, J, command):
    """Compute the measurement and the command of the controller at an instant."""
    camera.normalise(pixels, eye.K, eye.lens, eye.valid_radius, x)
    features.choose_depth(
        scheme.depth, scheme.metres, scheme.depth_scale, scheme.Z_goal, projection.depth, Z
    )
    features.points_interaction(x, Z, L)
    if scheme.in_pixels:
        features.to_pixels(x, eye.K, command.s)
        features.to_pixel_rates(eye.K, L)
    else:
        features.flat(x, command.s)
    features.choose_interaction(scheme.interaction, scheme.L_goal, L)
    jacobian.camera_jacobian(projection.bodies, projection.T_w_c, moves, J)
    solve.product(L, J, command.task_jacobian)
    features.difference(command.s, scheme.s_goal, command.error)
    if scheme.law == JOINT:
        laws.joint_of_product(
            L,
            J,
            command.task_jacobian,
            command.error,
            scheme.gain,
            scheme.transposed,
            scheme.damping,
            scheme.rcond,
            command.qd,
        )
    else:
        laws.camera(
            L,
            J,
            command.error,
            scheme.length,
            scheme.gain,
            scheme.transposed,
            scheme.damping,
            scheme.rcond,
            command.qd,
        )


@part
def settle(
    step,
    steps,
    limits,
    hold,
    drift,
    columns,
    pace,
    tolerance,
    watch,
    rows,
    every,
    track,
    q,
    rates,
    projection,
    T,
    command,
    qd,
    outcome,
):
    """Complete an instant after its command; return how many runs have ended.

    Fills qd of all joints, where those that are not commanded have the velocities `drift`, and
    outcome; keeps every so many steps in `track`, with the velocities `rates` of the joints, which
    has no rows where they are those commanded. T is the pose whose way is measured; hold[b] says
    which runs go on though they have converged or stalled.
    """
    jacobian.spread(columns, command.qd, drift, qd)
    if step == 0:
        endings.begin(command.error, projection.depth, T, tolerance, hold, watch)
    ended = endings.judge(
        q,
        limits,
        projection.visibility,
        projection.depth,
        T,
        command.error,
        command.qd,
        command.task_jacobian,
        pace,
        tolerance,
        step == steps,
        hold,
        watch,
        outcome,
    )
    if every > 0 and step % every == 0:
        record.store(rows, step // every, q, qd, rates, command.s, projection.pixels, track)
    return ended


@kernel
def stride(
    step,
    until,
    steps,
    dt,
    joints,
    limits,
    hold,
    drift,
    eye,
    moves,
    scheme,
    noise,
    watch,
    rows,
    every,
    track,
    q,
    rates,
    projection,
    command,
    qd,
    outcome,
):
    """Simulate from `step` until a run ends or `until` is reached; return the step reached.

    q, projection, command, qd (of all joints) and outcome hold that instant; q is not moved on
    from it. Every so many steps are kept in `track`, none if `every` is 0.
    """
    pixels, x = np.empty(projection.pixels.shape), np.empty(projection.pixels.shape)
    Z = np.empty(projection.depth.shape)
    L = np.empty((command.s.shape[0], 6, rows.size))
    J = np.empty((6, moves.columns.size, rows.size))
    while True:
        sight.project(joints, eye, q, projection)
        measure(projection.pixels, noise, step, pixels)
        control(scheme, eye, moves, projection, pixels, x, Z, L, J, command)
        ended = settle(
            step,
            steps,
            limits,
            hold,
            drift,
            moves.columns,
            scheme.pace,
            scheme.tolerance,
            watch,
            rows,
            every,
            track,
            q,
            rates,
            projection,
            projection.T_w_c if eye.moves else projection.T_w_o,
            command,
            qd,
            outcome,
        )
        if ended > 0 or step >= until:
            return step
        tree.integrate(joints, qd, dt, q)
        step += 1
