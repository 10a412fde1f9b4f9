"""A node that plays an experiment as a robot cell: measurements go out, and commands come in."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from typing import Any

import numpy as np

from robsim.base.arrays import Array
from robsim.base.errors import InputError
from robsim.declare.joint_numbers import broadcast_limits
from robsim.engine.simulated_cell import SimulatedCell
from robsim.logs.bag_files import TimedMessage
from robsim.logs.command_reader import CommandReader, check_command_names
from robsim.ros2.bag_recorder import BagRecorder
from robsim.ros2.cell_publishers import CellPublishers
from robsim.ros2.command_gate import CommandGate
from robsim.ros2.connection_parameters import declare_connection
from robsim.ros2.diagnostics import OK, PERIOD, WARN, DiagnosticPublisher
from robsim.ros2.middleware import load_message_type
from robsim.run.control.standalone_controller import Controller
from robsim.run.experiment import Experiment
from robsim.run.log import NANO
from robsim.run.ros_connection import RosConnection

NAME = "robsim_cell"
STEPPED_START = NANO  # ns on the clock of a stepped cell: a time of zero means no time
BEHIND = 0.5  # seconds behind real time that are reported, and no longer made up
AGAIN = 0.5  # seconds after which a stepped cell repeats an instant, for nodes that missed it
SILENCE = 5.0  # seconds without a command in which a stepped cell reports that it waits
QUEUE = 10  # commands that wait: more than one, so that two publishers are noticed
TRIGGER, SET_BOOL = "std_srvs/srv/Trigger", "std_srvs/srv/SetBool"


class PlayNode:
    """A simulated cell on the network.

    In real time an instant is published every period, and the latest command acts. A stepped cell
    waits for one command after each instant.

    Parameters
    ----------
    node : rclpy.node.Node
        Node of the cell.
    experiment : Experiment
        Experiment that is played, with a single run.
    stepped : bool
        Whether time passes with commands only.
    recorder : BagRecorder
        Bag of the measurements and the commands.

    Raises
    ------
    InputError
        If the experiment has several runs, or names that do not fit the scene.
    """

    def __init__(
        self, node: Any, experiment: Experiment, stepped: bool, recorder: BagRecorder
    ) -> None:
        self._node, self._stepped, self._recorder = node, stepped, recorder
        self.cell, controller = experiment.cell(), Controller(experiment)
        connection = experiment.ros2 or RosConnection()
        self._told = declare_connection(node, connection, self.cell.scene)
        self._publishers = CellPublishers(node, self.cell, controller, self._told, recorder)
        self._diagnostics, self._refused = DiagnosticPublisher(node), 0
        kind, order = self._told.command_type, self._told.order
        names = dict(self._told.names)
        self._reader = CommandReader(controller, kind, names, order)
        self._commanded = [names.get(each, each) for each in controller.velocity_names]
        self._gate = CommandGate(
            self.cell.scene,
            self.cell.columns,
            self.cell.dt,
            math.inf if stepped else self._told.timeout,
            _find_acceleration(experiment, self.cell),
            controller.command_quantity == "torque",
        )
        self._paused, self._fresh, self._said = False, False, ""
        self._others: set[str] = set()  # reported names
        self._waits_since = time.monotonic()
        self._start_clock(STEPPED_START if stepped else time.time_ns())
        node.create_subscription(
            load_message_type(kind), self._told.commands, self._on_command, QUEUE
        )
        node.create_timer(PERIOD, self._diagnose)
        node.create_service(load_message_type(TRIGGER), "/robsim/reset", self._on_reset)
        node.create_service(load_message_type(SET_BOOL), "/robsim/pause", self._on_pause)
        node.create_service(load_message_type(TRIGGER), "/robsim/step", self._on_step)
        self._publish()

    def _start_clock(self, start: int) -> None:
        """Let step 0 be at a time in ns, and let the present step be now in real time."""
        self._start = start
        self._anchor = time.monotonic() - self.cell.now.time

    @property
    def clock(self) -> int:
        """The present time of the cell in ns."""
        return self._start + round(self.cell.now.time * NANO)

    def wait(self) -> float:
        """Return the seconds until the next period begins, at most a tenth of a second."""
        if self._paused or self._stepped:
            return 0.0 if self._is_due() else 0.1
        due = self._anchor + (self.cell.now.step + 1) * self.cell.dt
        return min(max(due - time.monotonic(), 0.0), 0.1)

    def advance_if_due(self) -> None:
        """Advance by one period if it is time, and report what holds the robot."""
        if self._is_due():
            self._advance()
        elif self._stepped and not self._paused:
            self._wait_for_command()

    def _is_due(self) -> bool:
        """Return whether the next period begins."""
        if self._paused:
            return False
        if self._stepped:
            return self._fresh
        return time.monotonic() >= self._anchor + (self.cell.now.step + 1) * self.cell.dt

    def _advance(self) -> None:
        """Move for one period with the present command, and publish the next instant."""
        command = self._gate.next_command(self.cell.now.q, time.monotonic())
        self._say(self._gate.reason)
        self._fresh, self._waits_since = False, time.monotonic()
        self.cell.advance(command)
        if not np.isfinite(self.cell.now.q).all():
            self._start_again("the motion of the joints is unstable: the cell returns to its start")
        self._catch_up()
        self._publish()

    def _catch_up(self) -> None:
        """Report a clock that is behind real time, and let it go on from there."""
        late = time.monotonic() - self._anchor - self.cell.now.time
        if not self._stepped and not self._paused and late > BEHIND:
            self._warn(f"the clock is {late:.2g} s behind real time: a period takes too long")
            self._anchor += late

    def _publish(self) -> None:
        """Publish the present instant."""
        self._publishers.publish(self._start)
        self._published = time.monotonic()

    def _wait_for_command(self) -> None:
        """Repeat the instant that a stepped cell waits at, and report once that it waits."""
        if time.monotonic() - self._published > AGAIN:
            self._publish()
        if time.monotonic() - self._waits_since > SILENCE:
            self._say(f"waits for a command on {self._told.commands}")

    def _on_command(self, message: Any, info: Any) -> None:
        """Store a command with its publisher, or the reason why it is none."""
        try:
            check_command_names(message, self._commanded)
            values = self._reader.read(
                f"command on {self._told.commands}", TimedMessage(self.clock, message)
            )
        except InputError as error:
            self._refused += 1
            self._gate.refuse(f"not used: {error}")
            if self._stepped:
                self._say(f"not used: {error}")
            return
        if values is None:
            return
        self._report_others()
        self._recorder.write(self._told.commands, message, self.clock)
        sender = bytes((info.get("publisher_gid") or {}).get("data", b""))
        self._gate.take(values[self.cell.columns], time.monotonic(), sender)
        self._fresh = True

    def _report_others(self) -> None:
        """Report names in commands that the scene does not have, each once."""
        for name in self._reader.others.keys() - self._others:
            self._others.add(name)
            self._warn(f"a command has {name}, which the scene does not have")

    def _on_reset(self, request: Any, response: Any) -> Any:
        """Return the cell to its start; the clock goes on."""
        self._start_again("reset: the cell is at its start")
        self._publish()
        return _answer(response, True, "at the start")

    def _start_again(self, reason: str) -> None:
        """Return the cell to its start at the next time of the clock."""
        after = self.clock + round(self.cell.dt * NANO)
        self.cell.reset()
        self._gate.stop()
        self._fresh = False
        self._start_clock(after)
        self._node.get_logger().info(reason)

    def _on_pause(self, request: Any, response: Any) -> Any:
        """Pause the cell, or let it go on."""
        if self._paused and not request.data:
            self._anchor = time.monotonic() - self.cell.now.time
        self._paused = bool(request.data)
        return _answer(response, True, "paused" if self._paused else "continues")

    def _on_step(self, request: Any, response: Any) -> Any:
        """Advance a paused cell by one period."""
        if not self._paused:
            return _answer(response, False, "the cell is not paused: call /robsim/pause first")
        self._advance()
        return _answer(response, True, f"at {self.cell.now.time:.6g} s")

    def _diagnose(self) -> None:
        """Publish the state of the cell."""
        values = {
            "time": f"{self.cell.now.time:.6g} s",
            "clock": "paused" if self._paused else "stepped" if self._stepped else "real time",
            "refused commands": self._refused,
        }
        self._diagnostics.publish(WARN if self._said else OK, self._said or "ok", values)

    def _say(self, reason: str) -> None:
        """Log a reason if it is new; no reason is the end of the last one."""
        if reason == self._said:
            return
        ended, self._said = self._said, reason
        if reason:
            self._warn(reason)
        elif ended:
            self._node.get_logger().info("follows its commands")

    def _warn(self, text: str) -> None:
        """Log a warning."""
        self._node.get_logger().warning(text)


def _find_acceleration(experiment: Experiment, cell: SimulatedCell) -> Array | None:
    """Return the largest change of each commanded velocity by the safety, or None."""
    safety = experiment.safety
    if safety is None or safety.acceleration is None:
        return None
    return broadcast_limits(safety.acceleration, cell.scene.nv)[cell.columns]


def _answer(response: Any, success: bool, message: str) -> Any:
    """Return the response of a service."""
    response.success, response.message = success, message
    return response


def spin_cell(play: PlayNode, executor: Any, goes_on: Callable[[], bool]) -> None:
    """Serve the messages of a cell, and advance it, while `goes_on()`."""
    while goes_on():
        executor.spin_once(timeout_sec=play.wait())
        play.advance_if_due()
