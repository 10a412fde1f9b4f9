"""Odd images, joints, times and permissions: a controller never raises, and brakes gently."""

from functools import cache

import numpy as np
from attack.doors.odd import odd
from attack.harness import Wrong

import robsim as rs

NAME, STEPS = "drives", 40
DT, ACCELERATION, SPEED = 0.02, 1.5, 0.8


class Unconvertible:
    """A value that raises an error of its own, however it is read."""

    def __float__(self):
        raise RuntimeError("no number")

    __array__ = __len__ = __iter__ = __bool__ = __index__ = __float__


@cache
def arm():
    return rs.load_scenario(rs.examples.path("eye_in_hand")).with_(dt=DT)


def draw_safety(rng):
    """A safety with limits of speed and acceleration, and some others."""
    at = arm().scene.pose("camera", arm().start).position
    return rs.Safety(
        speed=SPEED,
        acceleration=ACCELERATION,
        margin=0.0 if rng.random() < 0.5 else None,
        fence=rs.control.Fence("camera", at - 0.1, at + 0.1) if rng.random() < 0.5 else None,
        watchdog=rs.control.Watchdog(0.1) if rng.random() < 0.3 else None,
        ramp=0.1 if rng.random() < 0.3 else None,
        call_interval=0.03 if rng.random() < 0.5 else None,
        driver_holds=True,
    )


def draw_time(rng, t):
    """A time, most often near the right one; the others leap, or are no times."""
    kind = rng.random()
    if kind < 0.7:
        return t + rng.uniform(-0.3, 0.3) * DT
    if kind < 0.85:
        return t + rng.choice([-1e9, -1.0, -DT, 0.0, 0.1, 1.0, 1e9, 1e18])
    return Unconvertible() if kind < 0.9 else odd(rng)


def case(seed):
    rng = np.random.default_rng(seed)
    controller, q = rs.Controller(arm().with_(safety=draw_safety(rng))), arm().start
    pixels = arm().scene.view(q, points="plate").pixels
    last = controller.step(pixels, q, 0.0).velocities
    for step in range(1, STEPS):
        image = pixels + rng.normal(0, 2, pixels.shape) if rng.random() < 0.7 else odd(rng)
        joints = q if rng.random() < 0.8 else odd(rng)
        run = True if rng.random() < 0.9 else odd(rng)
        command = controller.step(image, joints, draw_time(rng, step * DT), run=run)
        check(command, last)
        q, last = q + DT * command.velocities, command.velocities
        if len(controller.row()["fault"]) > 2000:
            raise Wrong("a fault without end")
    return True


def check(command, last):
    """Raise Wrong unless the command is finite and within the limits."""
    qd = command.velocities
    if qd.shape != (7,) or not np.isfinite(qd).all() or np.abs(qd).max() > SPEED * (1 + 1e-9):
        raise Wrong(f"velocities {qd}")
    change = np.abs(qd - last).max()
    if change > ACCELERATION * DT * (1 + 1e-9):
        raise Wrong(f"a velocity changed by {change}: {command.phase}, {command.health}")
