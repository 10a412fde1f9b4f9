"""Group `ros2` of commands: nodes of ROS 2."""

from __future__ import annotations

import click

from robsim.cli.ros2_drive_command import drive_robot


@click.group("ros2")
def ros2() -> None:
    """Play a scenario as a robot cell of ROS 2, or drive a robot by it."""


ros2.add_command(drive_robot)
