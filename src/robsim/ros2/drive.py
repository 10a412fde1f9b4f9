"""Driving of a robot by the controller of an experiment on ROS 2, until a signal ends it."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from robsim.ros2.node_process import open_ros, spin_until_signal
from robsim.run.experiment import Experiment
from robsim.run.run_checks import check_instance


def drive_experiment(
    experiment: Experiment,
    *,
    stepped: bool = False,
    network: bool = False,
    record: Path | None = None,
    arguments: Sequence[str] = (),
) -> None:
    """Drive a robot by the controller of an experiment, until a signal ends the process.

    The robot brakes within the limits of the experiment before the process ends.

    Parameters
    ----------
    experiment : Experiment
        Experiment with a single run.
    stepped : bool, default False
        Whether commands answer the instants of a stepped, played cell. Default: joint states.
    network : bool, default False
        Whether nodes on other machines are reached.
    record : Path, optional
        Bag to record.
    arguments : sequence of str, optional
        Arguments of ROS, such as ["--ros-args", "-p", "patience:=0.2"].

    Raises
    ------
    InputError
        If ROS 2 is not installed, or the experiment has several runs.

    Examples
    --------
    >>> drive_experiment("cell.toml")
    Traceback (most recent call last):
    ...
    robsim.base.errors.InputError: experiment: expected an Experiment, got 'cell.toml'
    """
    check_instance(experiment, Experiment, "experiment")
    from robsim.ros2.bag_recorder import BagRecorder
    from robsim.ros2.drive_node import DriveNode

    bag = BagRecorder(record, experiment)
    with open_ros(arguments, network) as (_, flag, reach), bag as recorder:
        drive = DriveNode(experiment, stepped, recorder)
        drive.log.info(reach)
        drive.start()
        drive.log.info(f"drives by {experiment.source or 'the experiment'}")
        try:
            spin_until_signal(drive.data, drive.node, flag, drive.watch, drive.period)
            drive.log.info(f"ends by {flag.received}")
        finally:  # the robot brakes also after an error
            drive.stop()
            drive.close()
