"""`ros2 run robsim_ros play FILE` and `ros2 run robsim_ros drive FILE`."""

import sys

from robsim.cli import main


def play():
    """Run a simulated robot cell."""
    _run("play")


def drive():
    """Run the controller of an experiment."""
    _run("drive")


def _run(command):
    sys.argv = ["robsim", "ros2", command, *sys.argv[1:]]
    main()
