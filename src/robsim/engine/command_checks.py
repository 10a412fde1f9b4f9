"""Checks that law, drive and safety of a simulation agree on the quantity of the command."""

from __future__ import annotations

from robsim.base.errors import InputError
from robsim.servo.laws.command_quantity import CommandQuantity
from robsim.servo.safety.guard import SafetyGuard
from robsim.servo.task_controller import TaskController
from robsim.world.actuation import Actuation


def check_command_quantity(
    controller: TaskController, actuation: Actuation, guard: SafetyGuard | None
) -> None:
    """Raise InputError if the drive does not take the commands of the task.

    Safety limits of velocities are refused for commands of torques, too.
    """
    drive = getattr(actuation, "drive", None)
    accepted: CommandQuantity = getattr(drive, "command_quantity", "velocity")
    if controller.command_quantity == "torque" and accepted == "velocity":
        raise InputError(
            "the law of the task commands torques, and the joints take velocities: use "
            "actuation=Actuation(drive=drives.TorqueInput(...)), or a law of velocities"
        )
    if controller.command_quantity == "velocity" and accepted == "torque":
        raise InputError(
            f"{type(drive).__name__} takes torques, and the task commands velocities: use "
            "law='torque', or a drive that takes velocities"
        )
    if guard is not None:
        guard.check_command_quantity(controller)
