"""What the messages of a ROS 2 node say to a controller, and its commands as messages."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any

import numpy as np

from robsim.base.arrays import Array, as_floats, as_positive
from robsim.base.errors import InputError, RobSimError, check_known, format_value
from robsim.logs import command_messages, message_types
from robsim.logs.bag_files import TimedMessage
from robsim.logs.detections import read_marks
from robsim.logs.joint_states import JointValues
from robsim.logs.name_map import map_joint_names, map_mark_ids
from robsim.logs.tf_poses import BodyPoses
from robsim.logs.twists import twist_components
from robsim.run.control.mark_input import Marks
from robsim.run.control.standalone_controller import Controller
from robsim.run.log import NANO

COMMAND_TYPES = (
    message_types.NUMBERS,
    message_types.JOINTS,
    message_types.TRAJECTORY,
    *message_types.TWISTS,
)


class RosMessages:
    """What ROS 2 messages say to a `Controller`, and its commands as messages.

    Messages are read by their fields, whether rclpy or rosbags made them; neither is needed to read
    them. Times are those of the headers, in seconds.

    controller  whom they are for
    names       {joint of the scene: joint in the messages}, where they differ
    marks       {target: the ids of its marks, in their order}; by default TARGET.NUMBER
    frames      {"world" or "ROBOT.LINK" of a body that drives or flies: frame in /tf}, likewise
    order       names in the messages of the joints in a command; by default those that are
                commanded, as the controller has them
    make        makes a message of a type, "std_msgs/msg/Header", and all its fields as keywords,
                arrays as NumPy has them; by default it is one of rosbags

    InputError: names, ids or an order that do not fit the scene.

    >>> from types import SimpleNamespace as Message
    >>> from robsim import Controller, examples
    >>> ros = RosMessages(Controller.from_file(examples.path("eye_to_hand")))
    >>> stamp = Message(stamp=Message(sec=7, nanosec=500_000_000))
    >>> joints = [f"{name}" for name in ros.controller.scene.coordinate_names]
    >>> state = Message(header=stamp, name=joints[::-1], position=[5.0, 4.0, 3.0, 2.0, 1.0, 0.0])
    >>> ros.time(state), ros.joints(state)
    (7.5, array([0., 1., 2., 3., 4., 5.]))
    """

    def __init__(
        self,
        controller: Controller,
        *,
        names: Mapping[str, str] | None = None,
        marks: Mapping[str, Sequence[str]] | None = None,
        frames: Mapping[str, str] | None = None,
        order: Sequence[str] | None = None,
        make: Callable[..., Any] | None = None,
    ) -> None:
        if not isinstance(controller, Controller):
            raise InputError(f"expected a Controller, got {format_value(controller)}")
        self.controller, self._make = (
            controller,
            message_types.make_message if make is None else make,
        )
        scene, called = controller.scene, map_joint_names(names, controller.scene)
        self._called = [called.get(name, name) for name in scene.coordinate_names]
        self._joints, self._q = JointValues(self._called, "position"), np.empty(0)
        self._places = BodyPoses(scene, called, frames)
        self._ids = {name: map_mark_ids(controller, name, marks) for name in controller.cameras}
        self._commanded = [called.get(name, name) for name in controller.velocity_names]
        self.order = tuple(
            self._commanded if order is None else _check_joint_order(order, self._commanded)
        )

    @property
    def roams(self) -> bool:
        """Whether something drives or flies of which /tf may say where it is, and joints do not."""
        return bool(self._places)

    def time(self, message: Any) -> float | None:
        """Return the time in seconds that a message says, the last of several; None if none.

        InputError: it is no message with times.
        """
        with _convert_errors(message, "with a time"):
            every = getattr(message, "transforms", None)
            times = [_message_time(each) for each in ([message] if every is None else every)]
        return max(times, default=0) / NANO or None

    def joints(self, message: Any) -> Array | None:
        """Return coordinates (nq,) of the scene, of a JointState; None until all are known.

        InputError: a joint that is there twice, or a number that is not finite.
        """
        with _convert_errors(message, "JointState"):
            if len(message.position):
                self._places.leave_out(message.name)
            return self._taken("JointState", TimedMessage(_message_time(message), message))

    def frames(self, message: Any, still: bool = False) -> Array | None:
        """Return coordinates (nq,) of the scene, of a TFMessage; None until all are known.

        It says where bodies are that drive or fly, as long as no JointState does. Those of
        /tf_static are `still`, and move nothing: None. InputError: a transform is no pose.
        """
        with _convert_errors(message, "TFMessage"):
            if still:
                self._places.still("TFMessage", message.transforms)
                return None
            moved = list(self._places.take("TFMessage", message.transforms))
            found = [self._taken("TFMessage", each) for each in moved]
            return found[-1] if found else None

    def marks(self, message: Any, camera: str | None = None, t: float | None = None) -> Marks:
        """Return the marks in a Detection2DArray or AprilTagDetectionArray, with their time.

        camera  its name, where there are several
        t       seconds, where the message does not say them

        Marks of which nothing is known are in `health.unused` of the command. InputError: a mark
        that is there twice, no such camera, or no time.
        """
        eye = self._camera(camera)
        ids, sizes = self._ids[eye]
        others: dict[str, None] = {}
        with _convert_errors(message, "of detections"):
            at = TimedMessage(_message_time(message), message)
            found = read_marks(f"marks of '{eye}'", at, ids, sizes, others)
        time = at.time / NANO or t
        if time is None:
            raise InputError("the message has no time of its own: give t")
        return Marks({**found, **others}, time)

    def command(
        self, velocities: Any, kind: str = message_types.NUMBERS, ahead: float = 0.1
    ) -> Any:
        """Return a message that commands velocities (n,) of the controller.

        kind   "std_msgs/msg/Float64MultiArray", of a forward_command_controller;
               "sensor_msgs/msg/JointState"; "trajectory_msgs/msg/JointTrajectory", one point to
               where the joints are after `ahead` seconds; "geometry_msgs/msg/Twist" or
               "geometry_msgs/msg/TwistStamped", of a body in its own axes

        InputError: another type, or one that the scene has nothing for.
        """
        given = as_floats(velocities, "velocities", (len(self._commanded),))
        check_known(kind, COMMAND_TYPES, "no command of type {}", "types")
        if kind in message_types.TWISTS:
            return self._twist(given, kind)
        by_name = dict(zip(self._commanded, given.tolist(), strict=True))
        velocity = np.array([by_name.get(name, 0.0) for name in self.order])
        if kind == message_types.NUMBERS:
            return command_messages.make_number_array(self._make, velocity)
        if kind == message_types.JOINTS:
            return command_messages.make_joint_state(
                self._make, 0, self.order, np.empty(0), velocity
            )
        after = round(as_positive(ahead, "ahead (seconds)") * NANO)
        return command_messages.make_trajectory(
            self._make, self.order, self._positions(), velocity, after
        )

    def _taken(self, what: str, at: TimedMessage) -> Array | None:
        found = self._joints.take(what, at)
        self._q = self._q if found is None else found
        return found

    def _twist(self, velocity: Array, kind: str) -> Any:
        parts = twist_components(self.controller.velocity_names)
        found = command_messages.make_twist(self._make, velocity, parts)
        if kind == message_types.TWIST:
            return found
        return self._make(kind, header=command_messages.make_header(self._make, 0), twist=found)

    def _positions(self) -> Array:
        """Return where the joints of a command are. InputError: that is not known."""
        known = dict(zip(self._called, self._q.tolist(), strict=False))
        for name in self.order:
            if name not in known:
                raise InputError(f"a trajectory needs the position of joint {name}: read it first")
        return np.array([known[name] for name in self.order])

    def _camera(self, camera: str | None) -> str:
        names = self.controller.cameras
        if camera is None and len(names) == 1:
            return names[0]
        check_known(camera, names, "no camera {}", "cameras")
        return str(camera)


def _check_joint_order(order: Any, commanded: Sequence[str]) -> Sequence[str]:
    """Return the names of joints in a command. InputError: one of those commanded lacks."""
    if not isinstance(order, list | tuple) or not all(isinstance(name, str) for name in order):
        raise InputError(f"order: expected names of joints, got {format_value(order)}")
    for name in commanded:
        if list(order).count(name) != 1:
            raise InputError(f"order: expected joint {name} once, got {format_value(list(order))}")
    return tuple(order)


@contextmanager
def _convert_errors(message: Any, kind: str) -> Iterator[None]:
    """Raise InputError for a message that lacks a field, or holds something else in it."""
    try:
        yield
    except RobSimError:
        raise
    except (AttributeError, TypeError, ValueError) as error:
        raise InputError(
            f"expected a message {kind}, got {format_value(message)}: {error!s:.100}"
        ) from None


def _message_time(message: Any) -> int:
    return message_types.header_time(message) or 0
