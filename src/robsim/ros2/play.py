"""Playing of an experiment as a robot cell on ROS 2, until a signal ends it."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import ExitStack
from pathlib import Path

from robsim.ros2.node_process import open_ros
from robsim.run.experiment import Experiment
from robsim.run.run_checks import check_instance


def play_experiment(
    experiment: Experiment,
    *,
    stepped: bool = False,
    network: bool = False,
    record: Path | None = None,
    arguments: Sequence[str] = (),
) -> None:
    """Play an experiment as a robot cell on ROS 2, until a signal ends the process.

    Parameters
    ----------
    experiment : Experiment
        Experiment with a single run.
    stepped : bool, default False
        Whether time passes with commands only. Default: real time.
    network : bool, default False
        Whether nodes on other machines are reached.
    record : Path, optional
        Bag to record.
    arguments : sequence of str, optional
        Arguments of ROS, such as ["--ros-args", "-r", "/joint_states:=/arm/joint_states"].

    Raises
    ------
    InputError
        If ROS 2 is not installed, or the experiment has several runs.

    Examples
    --------
    >>> play_experiment("cell.toml")
    Traceback (most recent call last):
    ...
    robsim.base.errors.InputError: experiment: expected an Experiment, got 'cell.toml'
    """
    check_instance(experiment, Experiment, "experiment")
    with open_ros(arguments, network) as (rclpy, stop, reach), ExitStack() as stack:
        from robsim.ros2.bag_recorder import BagRecorder
        from robsim.ros2.play_node import NAME, PlayNode, spin_cell

        node = rclpy.create_node(NAME)
        stack.callback(node.destroy_node)
        executor = rclpy.executors.SingleThreadedExecutor()
        stack.callback(executor.shutdown)
        executor.add_node(node)
        recorder = stack.enter_context(BagRecorder(record))
        play = PlayNode(node, experiment, stepped, recorder)
        node.get_logger().info(reach)
        way = "one period for each command" if stepped else "in real time"
        node.get_logger().info(f"plays {experiment.source or 'the experiment'} {way}")
        spin_cell(play, executor, lambda: not stop.received)
        node.get_logger().info(f"ends by {stop.received}")
