"""The controller of an experiment between ROS 2 messages, without a node."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array
from robsim.base.errors import InputError
from robsim.logs.command_messages import MakeMessage
from robsim.logs.ros_messages import RosMessages
from robsim.logs.tf_poses import BodyPoses
from robsim.ros2.picture_marks import PictureMarks, read_picture
from robsim.ros2.stamp_clock import StampClock
from robsim.run.control.drive_command import DriveCommand
from robsim.run.control.mark_input import Marks
from robsim.run.control.standalone_controller import Controller
from robsim.run.experiment import Experiment
from robsim.run.log import NANO
from robsim.run.ros_connection import RosConnection
from robsim.servo.camera_target import PairKey
from robsim.servo.goals.goal import GoalFeatures

PERMITTED = 0.2  # seconds for which a permission to move is valid
CLOCKS = 1.0  # seconds: larger differences of stamps are of two clocks


class DriveLoop:
    """One command for each joint state, from the latest images.

    Times of the computer, `now`, are seconds of a monotonic clock.

    Parameters
    ----------
    controller : Controller
        Controller of the experiment.
    connection : RosConnection
        Topics and names of the messages.
    make : callable
        Function that returns a message, as in `RosMessages`.
    stepped : bool, default False
        Whether time passes by stamps only.

    Attributes
    ----------
    q : ndarray of shape (nq,) or None
        Latest coordinates; None until all are known.
    command : DriveCommand or None
        Latest command.
    links, bases : list of str
        Links of bodies that drive or fly, and those of them that drive on a plane.
    needs_joints : bool
        Whether any coordinates are in joint states.
    stamps : dict of str to float
        Capture time of the latest image of each camera, by its stamp.
    """

    def __init__(
        self,
        controller: Controller,
        connection: RosConnection,
        make: MakeMessage,
        stepped: bool = False,
    ) -> None:
        self.controller, self.connection, self.stepped = controller, connection, stepped
        names = dict(connection.names)
        bodies = BodyPoses(controller.scene, names, None, connection)
        known = ("world", *bodies.links)
        frames = {k: name for k, name in dict(connection.frames).items() if k in known}
        self.ros = RosMessages(
            controller,
            names=names,
            marks=dict(connection.ids),
            frames=frames,
            order=list(connection.order) or None,
            make=make,
        )
        coordinates = controller.scene.coordinate_names
        self.joint_names = {names.get(name, name) for name in coordinates}
        self.links, self.bases = bodies.links, bodies.bases
        self.needs_joints = len(bodies.names) < len(coordinates)
        self.reset()

    def reset(self) -> None:
        """Forget all measurements."""
        self.controller.reset()
        self.clock, self.pictures = StampClock(), PictureMarks(self.controller)
        self.q: Array | None = None
        self.command: DriveCommand | None = None
        self.stamps: dict[str, float] = {}
        self._compared: dict[str, float] = {}  # stamps that `find_other_clock` has compared
        self._permitted = -math.inf
        self._marks: dict[str, Marks] = {}
        self._greys: dict[str, NDArray[np.uint8]] = {}

    def take_marks(self, message: Any, camera: str) -> None:
        """Store the marks of a camera until the next command."""
        marks = self.ros.marks(message, camera, t=self.clock.stamp)
        self._marks[camera], self.stamps[camera] = marks, marks.t

    def take_picture(self, message: Any, camera: str) -> Mapping[PairKey, Array]:
        """Store the marks in a picture, and the picture for features of pictures.

        Return the pixels (N, 2) of the marks that detectors have found by camera and target.
        """
        grey, t = read_picture(message), self.ros.time(message) or self.clock.stamp
        found: Mapping[PairKey, Array] = {}
        if t == self.stamps.get(camera) or self.q is None:  # the joints tell where marks are
            return found
        if camera in self.pictures.cameras:
            found = self.pictures.find(camera, grey, self.q)
            self._marks[camera] = Marks(dict(found), t)
        if camera in self.controller.pictured_cameras:
            self._greys[camera] = grey
        self.stamps[camera] = t
        return found

    def take_body(self, message: Any, link: str) -> bool:
        """Store the pose of a body, and return whether all coordinates are known."""
        return self._store(self.ros.pose(message, link))

    def take_still_frames(self, message: Any) -> None:
        """Store transforms of frames that stand still."""
        self.ros.frames(message, still=True)

    def take_frames(self, message: Any) -> bool:
        """Store transforms, and return whether they give new coordinates."""
        return self._store(self.ros.frames(message))

    def take_joints(self, message: Any) -> bool:
        """Store joints, and return whether they give new coordinates."""
        return self._store(self.ros.joints(message))

    def _store(self, q: Array | None) -> bool:
        """Store coordinates (nq,), and return whether there are any."""
        self.q = self.q if q is None else q
        return q is not None

    def continue_from(self, other: DriveLoop) -> None:
        """Take over the coordinates and the permission of another loop."""
        self.q, self._permitted = other.q, other._permitted
        self.stamps = dict(other.stamps)

    def permit(self, allowed: bool, now: float) -> None:
        """Store a permission to move, or a ban."""
        self._permitted = now if allowed else -math.inf

    def answer(self, stamp: float, now: float) -> DriveCommand | None:
        """Return the command at a stamp, or None for joints that repeat or are late."""
        if self.stepped and stamp < self.clock.stamp:  # the cell has been started again
            self.controller.reset()
            self.clock = StampClock()
        t = self.clock.advance(stamp, None if self.stepped else now)
        if t is None or self.q is None:
            return None
        run = True if now - self._permitted < PERMITTED else None
        marks, self._marks = self._marks, {}
        greys, self._greys = self._greys, {}
        shift, seen = self.clock.offset, list(marks.values())
        if shift:
            seen = [Marks(each.pixels, each.t + shift) for each in seen]
        images = seen[0] if len(seen) == 1 else dict(zip(marks, seen, strict=True)) or None
        self.command = self.controller.step(images, self.q, t, run=run, images=greys)
        return self.command

    def brake(self) -> DriveCommand | None:
        """Return the command of one period of braking; None before the first command."""
        if self.q is None or self.command is None:
            return None
        t = self.clock.tick(self.controller.dt)
        self.command = self.controller.step(None, self.q, t, run=False)
        return self.command

    @property
    def numbers(self) -> Array:
        """The latest commanded velocities or torques (n,), zero before the first."""
        if self.command is None:
            return np.zeros(len(self.controller.velocity_names))
        return self.command.numbers

    def make_command(self) -> Any:
        """Return the message of the latest command."""
        return self.ros.command(self.numbers, self.connection.command_type)

    def make_still(self) -> Any:
        """Return the message of zero velocities."""
        zero = np.zeros(len(self.controller.velocity_names))
        return self.ros.command(zero, self.connection.command_type)

    def find_other_clock(self) -> tuple[str, float] | None:
        """Return a camera whose new image is of another clock, and its lead in seconds, or None."""
        new = {camera: t for camera, t in self.stamps.items() if self._compared.get(camera) != t}
        self._compared |= new
        leads = ((camera, t - self.clock.stamp) for camera, t in new.items())
        return next((each for each in leads if CLOCKS < abs(each[1]) < math.inf), None)


def read_instant(data: list[float]) -> tuple[float, list[float]]:
    """Return the time of an instant, and the capture time of each camera, NaN before the first.

    >>> read_instant([1.0, 5e8, 1.0, 0.0])
    (1.5, [1.0])
    """
    times = [seconds + nanos / NANO for seconds, nanos in zip(data[::2], data[1::2], strict=True)]
    return times[0], times[1:]


def teach_goal(controller: Controller, command: DriveCommand | None) -> Experiment:
    """Return the experiment with the features of the last command as the goal, for a servo task.

    Raises
    ------
    InputError
        If not all marks were seen in the last image, or if the task has no goal of features.

    Examples
    --------
    >>> import robsim as rs
    >>> controller = rs.Controller.from_file(rs.examples.path("visp_tutorial"))
    >>> run = controller.experiment.run(duration=0.4)
    >>> command = controller.step(run.pixels.values[0], run.q.values[0], t=0.0)
    >>> teach_goal(controller, command).task.goal.s.shape
    (8,)
    """
    experiment = controller.experiment
    task: Any = experiment.task
    if not hasattr(task, "goal"):
        raise InputError(f"the task {type(task).__name__} has no goal to teach")
    if command is None or command.health.lost or command.health.stale:
        raise InputError("the marks are not all seen now: the goal stays")
    basis = controller.last_decision().basis
    if basis is None or basis.state.s_last is None:
        raise InputError(f"the task {type(task).__name__} has no features to teach")
    goal = GoalFeatures(basis.state.s_last[:, 0].copy())
    return experiment.with_(task=replace(task, goal=goal))
