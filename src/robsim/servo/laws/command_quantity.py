"""The physical quantity that a law commands: velocities or torques of the joints."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Literal

from robsim.base.errors import InputError
from robsim.servo.laws.broyden_rule import Broyden
from robsim.servo.laws.gain import AdaptiveGain
from robsim.servo.laws.inverse import PseudoInverse

CommandQuantity = Literal["velocity", "torque"]
UNITS: dict[CommandQuantity, tuple[str, str]] = {  # of revolute and of prismatic joints
    "velocity": ("rad/s", "m/s"),
    "torque": ("N m", "N"),
}


def get_command_quantity(law: object) -> CommandQuantity:
    """Return the quantity that a law commands; a law without a declaration commands velocities."""
    quantity: CommandQuantity = getattr(law, "command_quantity", "velocity")
    if quantity not in UNITS:
        raise InputError(
            f"{type(law).__name__}.command_quantity: expected 'velocity' or 'torque', got "
            f"{quantity!r}"
        )
    return quantity


def require_velocity_laws(laws: Sequence[object], who: str) -> None:
    """Raise InputError if one of several laws commands torques.

    `who` uses the laws, and needs velocities.
    """
    for law in laws:
        if get_command_quantity(law) == "torque":
            raise InputError(
                f"{who} needs a law of velocities, and {type(law).__name__} commands torques"
            )


def check_equal_quantities(quantities: Sequence[CommandQuantity]) -> None:
    """Raise InputError if the quantities that several tasks command differ."""
    if len(set(quantities)) > 1:
        raise InputError(
            "one of the tasks commands torques and another velocities, and the joints have one "
            "drive: use laws of one quantity"
        )


def check_torque_task(task: Any) -> None:
    """Raise InputError if a task with a law of torques has a field that acts on velocities."""
    name = type(task.law).__name__
    if get_command_quantity(task.law) == "velocity":
        return
    gain = task.gain
    needs_velocities = {
        "interaction": isinstance(task.interaction, Broyden),
        "depth": task.depths.filtered,
        "feed_forward": task.feed_forward is not None,
        "limit": task.limit is not None,
        "secondary": task.secondary is not None,
        "gain": isinstance(gain, AdaptiveGain) and gain.of == "command",
    }
    for field, found in needs_velocities.items():
        if found:
            raise InputError(
                f"{field}: {_describe(getattr(task, field))} works with commanded velocities, and "
                f"{name} commands torques: leave {field} out"
            )
    if not isinstance(task.inverse, PseudoInverse):
        raise InputError(f"inverse: {name} uses the transpose of L J: leave inverse out")


def _describe(value: object) -> str:
    """Return the name of the class of a value of a field."""
    return type(value).__name__
