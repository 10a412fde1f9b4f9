"""The state of a controller in words, and as a diagnostic message."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from robsim.ros2.middleware import load_message_type
from robsim.run.control.drive_command import DriveCommand

OK, WARN, ERROR = b"\0", b"\1", b"\2"  # levels of diagnostic_msgs/DiagnosticStatus
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


def make_diagnostics(
    name: str, state: str, command: DriveCommand | None, problems: Sequence[str], stamp: Any
) -> Any:
    """Return a DiagnosticArray of a node with the health of its controller."""
    status = load_message_type("diagnostic_msgs/msg/DiagnosticStatus")(name=name, hardware_id=name)
    words = "no command yet" if command is None else describe_command(command)
    status.message = "; ".join([f"{state}, {words}", *problems])
    status.level = _find_level(command, problems)
    if command is not None:
        health = command.health
        values = {
            "phase": command.phase,
            "error": f"{float(abs(command.error).max(initial=0.0)):.6g}",
            "age of the images (s)": f"{health.age:.3g}",
            "lost marks": ", ".join(health.lost),
            "active limits": ", ".join(health.limits),
            "unused data": ", ".join(health.unused),
        }
        pair = load_message_type("diagnostic_msgs/msg/KeyValue")
        status.values = [pair(key=key, value=value) for key, value in values.items()]
    message = load_message_type("diagnostic_msgs/msg/DiagnosticArray")(status=[status])
    message.header.stamp = stamp
    return message


def _find_level(command: DriveCommand | None, problems: Sequence[str]) -> bytes:
    """Return the level of a diagnosis: an error if the robot is stopped."""
    if command is not None and command.phase == "stopped":
        return ERROR
    good = command is not None and command.phase in ("moving", "converged")
    return OK if good and not problems else WARN
