"""Checks that law, drive and safety of a simulation agree on the quantity of the command."""

from __future__ import annotations

from typing import TYPE_CHECKING

from robsim.base.errors import InputError
from robsim.servo.safety.guard import SafetyGuard
from robsim.servo.task_controller import TaskController

if TYPE_CHECKING:
    from robsim.engine.driven_joints import DrivenJoints


def check_command_quantity(
    controller: TaskController, driven: DrivenJoints | None, guard: SafetyGuard | None
) -> None:
    """Raise InputError if the drive of the joints does not take the commands of the task.

    Safety limits of velocities are refused for commands of torques, too.
    """
    accepted = "velocity" if driven is None else driven.drive.commanded
    if controller.command_quantity == "torque":
        if driven is None or accepted == "velocity":
            raise InputError(
                "the law of the task commands torques, and the joints take velocities: use "
                "actuation=Actuation(drive=drives.TorqueInput(...)), or a law of velocities"
            )
        _check_columns(controller, driven)
    elif driven is not None and accepted == "torque":
        raise InputError(
            f"{driven.drive.label} takes torques, and the task commands velocities: use "
            "law='torque', or a drive that takes velocities"
        )
    if guard is not None:
        guard.check_command_quantity(controller)


def _check_columns(controller: TaskController, driven: DrivenJoints) -> None:
    """Raise InputError if torques command a joint that no drive moves."""
    others = set(controller.columns.tolist()) - set(driven.velocities)
    if others:
        names = ", ".join(driven.scene.velocity_names[i] for i in sorted(others))
        raise InputError(
            f"the law of the task commands torques, and no drive moves {names}: drives move "
            "revolute and prismatic joints; give the others in no task, by `joints`"
        )
