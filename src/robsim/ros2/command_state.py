"""The state of a controller in words, for logs and diagnostics."""

from __future__ import annotations

from collections.abc import Sequence

from robsim.ros2.diagnostics import ERROR, OK, WARN
from robsim.run.control.drive_command import DriveCommand

REASONS = {
    "watchdog": "the images are too old",
    "stopped by the watchdog": "the watchdog has stopped the robot until a reset",
    "not released": "no permission to move",
    "late call": "the joints came late",
    "too few marks": "too few marks are seen",
    "not finite": "the command was not finite",
}


def describe_command(command: DriveCommand) -> str:
    """Return the activity of a controller and its reasons, as in "holding: too few marks are seen".

    >>> import numpy as np
    >>> from robsim.run.control.drive_command import Health
    >>> health = Health(limits=("watchdog", "speed"))
    >>> describe_command(DriveCommand(np.zeros(6), np.zeros(8), "holding", health))
    'holding: the images are too old'
    """
    health = command.health
    reasons = [REASONS[limit] for limit in health.limits if limit in REASONS]
    if command.phase == "waiting":
        reasons.append("not all marks have been seen yet")
    if health.fault:
        reasons.append(health.fault)
    return ": ".join(filter(None, (command.phase, "; ".join(reasons))))


def list_health_values(command: DriveCommand) -> dict[str, str]:
    """Return the health of a command by the names of its parts, for diagnostics."""
    health = command.health
    return {
        "phase": command.phase,
        "error": f"{float(abs(command.error).max(initial=0.0)):.6g}",
        "age of the images (s)": f"{health.age:.3g}",
        "lost marks": ", ".join(health.lost),
        "active limits": ", ".join(health.limits),
        "unused data": ", ".join(health.unused),
    }


def find_level(command: DriveCommand | None, problems: Sequence[str]) -> bytes:
    """Return the level of a diagnosis: an error if the robot is stopped."""
    if command is not None and command.phase == "stopped":
        return ERROR
    good = command is not None and command.phase in ("moving", "converged")
    return OK if good and not problems else WARN
