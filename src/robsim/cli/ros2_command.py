"""Commands `ros2 play` and `ros2 drive`: a simulated cell and a controller as nodes of ROS 2."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import click

from robsim.cli.options import set_option
from robsim.cli.scenarios import load_with_changes

BAG, ROS_WORDS = click.Path(path_type=Path), click.UNPROCESSED
ROS_ARGUMENTS = {"ignore_unknown_options": True, "allow_interspersed_args": True}


def check_ros_arguments(arguments: tuple[str, ...]) -> None:
    """Raise a usage error unless the arguments that are left begin with --ros-args.

    >>> check_ros_arguments(("--steped",))
    Traceback (most recent call last):
    ...
    click.exceptions.UsageError: no option --steped; arguments of ROS follow --ros-args
    """
    if arguments and arguments[0] != "--ros-args":
        raise click.UsageError(f"no option {arguments[0]}; arguments of ROS follow --ros-args")


def node_options(command: Callable[..., None]) -> Callable[..., None]:
    """Add the options that all nodes share to a command."""
    for add in (
        click.argument("ros_arguments", nargs=-1, type=ROS_WORDS, metavar="[--ros-args ...]"),
        click.option("--record", type=BAG, metavar="BAG", help="Bag to record."),
        click.option("--network", is_flag=True, help="Reach nodes on other machines, too."),
    ):
        command = add(command)
    return command


@click.group("ros2")
def serve_ros2() -> None:
    """Play a scenario as a robot cell on ROS 2, or drive a robot by its controller."""


@serve_ros2.command("play", context_settings=ROS_ARGUMENTS)
@click.argument("file", type=click.Path(path_type=Path))
@set_option
@click.option("--stepped", is_flag=True, help="One period for each command, not real time.")
@node_options
def play_cell(
    file: Path,
    changes: tuple[str, ...],
    stepped: bool,
    network: bool,
    record: Path | None,
    ros_arguments: tuple[str, ...],
) -> None:
    """Play the scenario in FILE as a robot cell.

    The cell publishes joints, marks, pictures and poses, and takes velocities. The topics are in
    the table [ros2] of the scenario.
    """
    from robsim.ros2.play import play_experiment

    check_ros_arguments(ros_arguments)
    experiment = load_with_changes(file, changes)
    how = {"stepped": stepped, "network": network}
    play_experiment(experiment, record=record, arguments=ros_arguments, **how)


@serve_ros2.command("drive", context_settings=ROS_ARGUMENTS)
@click.argument("file", type=click.Path(path_type=Path))
@set_option
@click.option("--stepped", is_flag=True, help="Answer each instant of a stepped, played cell.")
@node_options
def drive_robot(
    file: Path,
    changes: tuple[str, ...],
    stepped: bool,
    network: bool,
    record: Path | None,
    ros_arguments: tuple[str, ...],
) -> None:
    """Drive a robot by the controller of the scenario in FILE.

    The controller reads joints and marks, or pictures, and publishes velocities. The topics are in
    the table [ros2] of the scenario, and are parameters of the node. A signal ends the node; the
    robot brakes first.
    """
    from robsim.ros2.drive import drive_experiment

    check_ros_arguments(ros_arguments)
    experiment = load_with_changes(file, changes)
    how = {"stepped": stepped, "network": network}
    drive_experiment(experiment, record=record, arguments=ros_arguments, **how)
