"""The command of a controller on its own, and how the controller is."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal, NamedTuple

from robsim.base.arrays import Array
from robsim.kernels.control import command_limits

Doing = Literal["waiting", "moving", "holding", "stopped", "converged"]

LIMITS = {
    command_limits.STOPPED: "stopped by the watchdog",
    command_limits.OLD_IMAGE: "watchdog",
    command_limits.NOT_RELEASED: "not released",
    command_limits.FEW_MARKS: "too few marks",
    command_limits.NOT_FINITE: "not finite",
    command_limits.SPEED: "speed",
    command_limits.ACCELERATION: "acceleration",
    command_limits.FENCE: "fence",
}


class Health(NamedTuple):
    """What a controller knows of its images, its joints and its limits.

    converged  every error is below its tolerance, no mark is lost, and nothing is old or held
    lost       marks that the last image does not have: "plate[2]", or "left: plate[2]" where there
               are several cameras
    stale      whether the watchdog finds the images too old
    age        seconds since the oldest image in use was taken; one without a mark, or without one
               that a feature of all marks needs, is not in use
    limits     what changes the command: "speed", "acceleration", "fence", "joint limit of elbow",
               or holds the robot: "watchdog", "stopped by the watchdog", "not released", "too few
               marks", "not finite"
    unused     what was given and is not used: names of other targets, doubtful ones, images that
               are older than the last or were taken in the future
    fault      what was wrong with what was given now, in a sentence; "" if nothing
    """

    converged: bool = False
    lost: tuple[str, ...] = ()
    stale: bool = False
    age: float = 0.0
    limits: tuple[str, ...] = ()
    unused: tuple[str, ...] = ()
    fault: str = ""


class DriveCommand(NamedTuple):
    """What a controller commands for the period that begins.

    velocities  (n,) in rad/s and m/s, in the order of `Controller.velocity_names`
    error       (k,) of the features, in their units; empty while the controller waits
    phase       what it does: "waiting" until all marks have been seen once, "moving", "holding"
                while it may not move, "stopped" until a reset, "converged"
    health      what it knows of images, joints and limits
    """

    velocities: Array
    error: Array
    phase: Doing
    health: Health


def list_active_limits(why: int, at_limit: Array, names: Sequence[str]) -> tuple[str, ...]:
    """Return the names of the limits that change a command, from its bits."""
    found = [name for bit, name in LIMITS.items() if why & bit]
    if why & command_limits.JOINT_LIMIT:
        pairs = zip(names, at_limit, strict=True)
        found += [f"joint limit of {name}" for name, there in pairs if there]
    return tuple(found)


def classify_activity(why: int, converged: bool) -> Doing:
    """Return what a controller does whose command has these bits."""
    if why & command_limits.STOPPED:
        return "stopped"
    if why & command_limits.HELD:
        return "holding"
    return "converged" if converged else "moving"
