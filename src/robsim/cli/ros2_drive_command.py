"""Command `ros2 drive`: the controller of a scenario as a node of ROS 2."""

from __future__ import annotations

import signal
from pathlib import Path

import click

from robsim.cli.console import print_text
from robsim.cli.options import set_option
from robsim.cli.scenarios import load_with_changes


@click.command(
    "drive",
    context_settings={"ignore_unknown_options": True, "help_option_names": ["-h", "--help"]},
)
@click.argument("file", type=click.Path(path_type=Path))
@click.argument("ros", nargs=-1, type=click.UNPROCESSED, metavar="[--ros-args ...]")
@set_option
@click.option("--stepped", is_flag=True, help="Answer each instant of a stepped, played cell.")
@click.option("--network", is_flag=True, help="Reach nodes on other machines, too.")
def drive_robot(
    file: Path, ros: tuple[str, ...], changes: tuple[str, ...], stepped: bool, network: bool
) -> None:
    """Drive a robot by the controller of the scenario in FILE, as a node of ROS 2.

    The node robsim_drive reads joints and marks, or pictures, and publishes commands. Topics and
    names are in the table [ros2] of the scenario, and are parameters of the node. The node ends by
    SIGINT, SIGTERM or SIGHUP, and brakes the robot first.
    """
    from robsim.ros2.drive_node import DriveNode
    from robsim.ros2.middleware import require_rclpy
    from robsim.ros2.node_process import join_ros, spin_until_signal

    require_rclpy()
    experiment = load_with_changes(file, changes)
    with join_ros(ros, network) as reach:
        drive = DriveNode(experiment, stepped)
        drive.start()
        print_text(f"driving by {file}; {reach}")
        number = spin_until_signal(drive.node, drive.stop, lambda: None)
        print_text(f"stopped by {signal.Signals(number).name}")
        drive.node.destroy_node()
