"""Conversion of ROS 2 messages to the inputs of a controller, and of commands to messages."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager

import numpy as np
from numpy.typing import ArrayLike

from robsim.base.arrays import Array, as_floats, as_positive
from robsim.base.errors import InputError, RobSimError, check_known, format_value
from robsim.logs import command_messages, message_types
from robsim.logs.bag_files import TimedMessage
from robsim.logs.command_reader import check_torque_messages
from robsim.logs.detections import read_marks
from robsim.logs.joint_states import JointValues
from robsim.logs.name_map import Ids, map_joint_names, map_mark_ids
from robsim.logs.tf_poses import BodyPoses
from robsim.logs.twists import twist_components
from robsim.run.control.mark_input import Marks
from robsim.run.control.standalone_controller import Controller
from robsim.run.log import NANO
from robsim.run.ros_connection import COMMAND_TYPES
from robsim.servo.camera_target import PairKey

MarkPlaces = dict[PairKey, tuple[list[int], list[int]]]  # rows of a message, numbers of marks


class RosMessages:
    """Convert ROS 2 messages to the inputs of a `Controller`, and its commands to messages.

    Any object with the fields of a message can be read: messages of rclpy, of rosbags, or your own
    objects. Neither package is needed for this. Times are the stamps of the headers, in seconds.

    Parameters
    ----------
    controller : Controller
        Controller that receives the measurements.
    names : mapping, optional
        Names {joint of the scene: joint in the messages}, if they differ.
    marks : mapping, optional
        Ids {target: ids of its marks in the messages, in order}. Default: TARGET.NUMBER, such as
        "plate.0".
    frames : mapping, optional
        Frames {"world" or "ROBOT.LINK": frame in /tf} of bodies that drive or fly, if they differ.
    order : sequence of str, optional
        Names of the joints in a command message. Default: the commanded joints in the order of the
        controller.
    make : callable, optional
        Function that returns a message from its type, such as "std_msgs/msg/Header", and all its
        fields as keywords, with NumPy arrays. Default: a message of rosbags.

    Raises
    ------
    InputError
        If names, ids or the order do not fit the scene.

    Examples
    --------
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
        make: command_messages.MakeMessage | None = None,
    ) -> None:
        if not isinstance(controller, Controller):
            raise InputError(f"expected a Controller, got {format_value(controller)}")
        self.controller = controller
        self._make = message_types.make_message if make is None else make
        scene, log_names = controller.scene, map_joint_names(names, controller.scene)
        self._joint_names = [log_names.get(name, name) for name in scene.coordinate_names]
        self._joints, self._q = JointValues(self._joint_names, "position"), np.empty(0)
        self._bodies = BodyPoses(scene, log_names, frames)
        self._ids = {name: map_mark_ids(controller, name, marks) for name in controller.cameras}
        # ids of the last array of marks of each camera, and their places
        self._labels: dict[str, tuple[list[str], MarkPlaces]] = {}
        self._command_names = [log_names.get(name, name) for name in controller.velocity_names]
        self.order = tuple(
            self._command_names if order is None else _check_joint_order(order, self._command_names)
        )
        self._places = [self.order.index(name) for name in self._command_names]

    @property
    def roams(self) -> bool:
        """Whether the poses of any bodies that drive or fly are read from /tf or odometry."""
        return bool(self._bodies)

    @property
    def links(self) -> list[str]:
        """The links of bodies that drive or fly whose coordinates no JointState contains."""
        return self._bodies.links

    def time(self, message: object) -> float | None:
        """Return the time of a message in seconds, or None if the time is zero.

        A TFMessage has the time of its latest transform.

        Raises
        ------
        InputError
            If a header of the message has no stamp.
        """
        with _convert_errors(message, "with a time"):
            every = getattr(message, "transforms", None)
            times = [_message_time(each) for each in ([message] if every is None else every)]
        return max(times, default=0) / NANO or None

    def joints(self, message: object) -> Array | None:
        """Return the coordinates (nq,) of the scene after a JointState; None until all are known.

        Parameters
        ----------
        message : object
            JointState message.

        Raises
        ------
        InputError
            If a joint occurs twice, or a number is not finite.
        """
        with _convert_errors(message, "JointState"):
            state: message_types.Message = message
            if len(state.position):
                self._bodies.leave_out(state.name)
            return self._update_joints("JointState", TimedMessage(_message_time(state), state))

    def frames(self, message: object, still: bool = False) -> Array | None:
        """Return the coordinates (nq,) of the scene after a TFMessage; None until all are known.

        The poses of bodies that drive or fly give the coordinates of these bodies, unless a
        JointState message contains them.

        Parameters
        ----------
        message : object
            TFMessage of /tf or /tf_static.
        still : bool, default False
            Whether the message is from /tf_static. The result is then None.

        Raises
        ------
        InputError
            If a transform is not a pose.
        """
        with _convert_errors(message, "TFMessage"):
            tree: message_types.Message = message
            if still:
                self._bodies.store_static("TFMessage", tree.transforms)
                return None
            bodies = list(self._bodies.take("TFMessage", tree.transforms))
            values = [self._update_joints("TFMessage", each) for each in bodies]
            return values[-1] if values else None

    def pose(self, message: object, link: str | None = None) -> Array | None:
        """Return the coordinates (nq,) of the scene after the pose of a body that drives or flies.

        The result is None until all coordinates are known.

        Parameters
        ----------
        message : object
            Odometry or PoseStamped of the link of the body, in the world.
        link : str, optional
            Link that the message is about, as "rover.body". Default: the only one of these bodies.

        Raises
        ------
        InputError
            If the message has no pose, or the scene has no such body.
        """
        links = self.links
        link = links[0] if link is None and len(links) == 1 else link
        check_known(link, links, "no link {} that drives or flies", "links")
        with _convert_errors(message, "Odometry or PoseStamped"):
            fields = self._bodies.take_pose("pose", str(link), message)
            at = TimedMessage(_message_time(message), fields)
            return self._update_joints(f"pose of '{link}'", at)

    def marks(self, message: object, camera: str | None = None, t: float | None = None) -> Marks:
        """Return the marks in a message of detections, with their time.

        The message is a Detection2DArray, an AprilTagDetectionArray, or a Float64MultiArray with
        the ids of the marks as labels.

        Marks with an unknown id are listed in `health.unused` of the command that follows.

        Parameters
        ----------
        message : object
            Message with detections.
        camera : str, optional
            Name of the camera. Default: the only camera.
        t : float, optional
            Time in seconds, if the message has no time.

        Raises
        ------
        InputError
            If a mark occurs twice, the camera does not exist, or the time is missing.
        """
        eye = self._camera(camera)
        if (alike := self._read_alike_marks(message, eye)) is not None:
            return alike
        ids, sizes = self._ids[eye]
        others: dict[str, None] = {}
        with _convert_errors(message, "of detections"):
            at = TimedMessage(_message_time(message), message)
            pixels = read_marks(f"marks of '{eye}'", at, ids, sizes, others)
        time = at.time / NANO or t
        if time is None:
            raise InputError("the message has no time: give t")
        return Marks({**pixels, **others}, time)

    def _read_alike_marks(self, message: object, camera: str) -> Marks | None:
        """Return the marks in an array with the ids of the last array, which is faster, or None."""
        if not message_types.is_mark_array(message):
            return None
        array: message_types.Message = message
        labels, data = [each.label for each in array.layout.dim], np.asarray(array.data)
        known, places = self._labels.get(camera, ([], {}))
        ids, sizes = self._ids[camera]
        if not labels or labels != known:
            if len(set(labels)) == len(labels) and ids.keys() >= set(labels):
                self._labels[camera] = labels, _place_marks(labels, ids)
            return None
        if data.size != message_types.STAMP + 2 * len(labels) or not np.isfinite(data).all():
            return None
        given = data[message_types.STAMP :].reshape(-1, 2)
        pixels = {key: np.full((count, 2), np.nan) for key, count in sizes.items()}
        for key, (rows, numbers) in places.items():
            pixels[key][numbers] = given[rows]
        time = message_types.read_stamp(message)
        return Marks(pixels, time / NANO) if time else None

    def command(
        self, velocities: ArrayLike, kind: str = message_types.NUMBERS, ahead: float = 0.1
    ) -> message_types.Message:
        """Return a message with the velocities (n,) of a command.

        Parameters
        ----------
        velocities : array_like of shape (n,)
            Commanded velocities in the order of the controller; its torques, if its law commands
            torques.
        kind : str, default "std_msgs/msg/Float64MultiArray"
            Type of the message: "std_msgs/msg/Float64MultiArray", for a forward_command_controller;
            "sensor_msgs/msg/JointState"; "trajectory_msgs/msg/JointTrajectory" with one point, the
            positions of the joints after `ahead` seconds; "geometry_msgs/msg/Twist" or
            "geometry_msgs/msg/TwistStamped", for a body in its own axes.
        ahead : float, default 0.1
            Seconds until the point of a trajectory.

        Returns
        -------
        object
            Message that `make` returns.

        Raises
        ------
        InputError
            If the type is not supported, or does not fit the scene.
        """
        rates = as_floats(velocities, "velocities", (len(self._command_names),))
        check_known(kind, COMMAND_TYPES, "no command of type {}", "types")
        torques = self.controller.command_quantity == "torque"
        check_torque_messages(torques, kind)
        if kind in message_types.TWISTS:
            return self._make_twist(rates, kind)
        velocity = np.zeros(len(self.order))
        velocity[self._places] = rates
        if kind == message_types.NUMBERS:
            return command_messages.make_number_array(self._make, velocity)
        if kind == message_types.JOINTS:
            none = command_messages.NONE
            parts = (none, none, velocity) if torques else (none, velocity)
            return command_messages.make_joint_state(self._make, 0, self.order, *parts)
        after = round(as_positive(ahead, "ahead (seconds)") * NANO)
        return command_messages.make_trajectory(
            self._make, self.order, self._positions(), velocity, after
        )

    def _update_joints(self, what: str, at: TimedMessage) -> Array | None:
        """Store the coordinates after a message, and return them if all are known."""
        values = self._joints.take(what, at)
        self._q = self._q if values is None else values
        return values

    def _make_twist(self, velocity: Array, kind: str) -> message_types.Message:
        """Return a Twist or TwistStamped of commanded velocities."""
        parts = twist_components(self.controller.velocity_names)
        message = command_messages.make_twist(self._make, velocity, parts)
        if kind == message_types.TWIST:
            return message
        return self._make(kind, header=command_messages.make_header(self._make, 0), twist=message)

    def _positions(self) -> Array:
        """Return the positions of the commanded joints; raise InputError if one is unknown."""
        known = dict(zip(self._joint_names, self._q.tolist(), strict=False))
        for name in self.order:
            if name not in known:
                raise InputError(
                    f"a trajectory needs the position of joint {name}: call `joints` first"
                )
        return np.array([known[name] for name in self.order])

    def _camera(self, camera: str | None) -> str:
        """Return the name of a camera, or of the only camera."""
        names = self.controller.cameras
        if camera is None and len(names) == 1:
            return names[0]
        check_known(camera, names, "no camera {}", "cameras")
        return str(camera)


def _place_marks(labels: Sequence[str], ids: Ids) -> MarkPlaces:
    """Return the rows and the numbers of the marks of each target in an array with these ids."""
    found: MarkPlaces = {}
    for row, label in enumerate(labels):
        key, number = ids[label]
        rows, numbers = found.setdefault(key, ([], []))
        rows.append(row)
        numbers.append(number)
    return found


def _check_joint_order(order: Sequence[str], commanded: Sequence[str]) -> Sequence[str]:
    """Return the names of joints in a command; raise InputError if a commanded joint is missing."""
    if not isinstance(order, list | tuple) or not all(isinstance(name, str) for name in order):
        raise InputError(f"order: expected names of joints, got {format_value(order)}")
    for name in commanded:
        if list(order).count(name) != 1:
            raise InputError(f"order: expected joint {name} once, got {format_value(list(order))}")
    return tuple(order)


@contextmanager
def _convert_errors(message: object, kind: str) -> Iterator[None]:
    """Raise InputError for a message with missing fields, or with fields of other types."""
    try:
        yield
    except RobSimError:
        raise
    except (AttributeError, TypeError, ValueError) as error:
        raise InputError(
            f"expected a message {kind}, got {format_value(message)}: {error!s:.100}"
        ) from None


def _message_time(message: object) -> int:
    """Return the time in nanoseconds in a message, 0 without a time."""
    return message_types.header_time(message) or 0
