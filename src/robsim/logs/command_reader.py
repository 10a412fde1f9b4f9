"""The commanded velocities in the messages of a log."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence

import numpy as np

from robsim.base.arrays import Array
from robsim.base.errors import FileError, InputError, check_known
from robsim.logs import message_types, twists
from robsim.logs.bag_files import TimedMessage
from robsim.logs.joint_states import JointStateFields, JointValues, Part, stack_stream
from robsim.run.control.standalone_controller import Controller
from robsim.run.log import Stream


def check_torque_messages(torques: bool, kind: str) -> None:
    """Raise InputError for commands of torques in messages of velocities."""
    if torques and kind not in (message_types.JOINTS, message_types.NUMBERS):
        raise InputError(
            f"the law commands torques, and messages of {kind} command velocities: use "
            f"{message_types.NUMBERS} or {message_types.JOINTS}"
        )


def check_command_names(message: message_types.Message, commanded: Collection[str]) -> None:
    """Raise InputError if a command by names does not name the commanded joints, each once.

    >>> from types import SimpleNamespace as Message
    >>> check_command_names(Message(joint_names=["elbow"], points=[]), ["elbow", "wrist"])
    Traceback (most recent call last):
    ...
    robsim.base.errors.InputError: a command without joint wrist
    """
    names = getattr(message, "name", getattr(message, "joint_names", None))
    if names is None or not len(names):
        return
    for name in names:
        check_known(name, commanded, "a command of joint {}, which is not commanded", "joints")
    for name in commanded:
        if name not in names:
            raise InputError(f"a command without joint {name}")


class CommandReader:
    """A reader of the velocities or torques (nv,) of a scene in command messages of one type.

    Arrays have the velocities of the controller, or of the joints in `order` by their names in the
    log. Velocities without a command are zero. The attribute `others` collects names that the scene
    does not have. InputError is raised for twists if the scene does not have one body that drives
    or flies.
    """

    def __init__(
        self,
        controller: Controller,
        kind: str,
        log_names: Mapping[str, str],
        order: Sequence[str] = (),
    ) -> None:
        names = controller.scene.velocity_names
        self.others: dict[str, None] = {}
        self._nv = len(names)
        commanded = {log_names.get(name, name): name for name in controller.velocity_names}
        for name in commanded if order else ():
            check_known(name, order, "order: joint {} is missing", "joints")
        listed = list(order or commanded)
        self._count = len(listed)
        self._places = [i for i, name in enumerate(listed) if name in commanded]
        self._columns = [names.index(commanded[listed[i]]) for i in self._places]
        torques = controller.command_quantity == "torque"
        check_torque_messages(torques, kind)
        part: Part = "effort" if torques else "velocity"
        self._joints = JointValues([log_names.get(name, name) for name in names], part, every=False)
        self._twist = twists.twist_components(names) if kind in message_types.TWISTS else ()
        self._row = {
            message_types.JOINTS: self._joints.take,
            message_types.NUMBERS: self._read_array,
            message_types.TRAJECTORY: self._read_point,
            message_types.TWIST: self._read_twist,
            message_types.STAMPED: self._read_stamped,
        }[kind]

    def read(self, what: str, each: TimedMessage) -> Array | None:
        """Return the commands (nv,) of a message, None without commands; FileError if invalid."""
        values: Array | None = self._row(what, each)
        self.others |= dict.fromkeys(f"joint {name}" for name in self._joints.others)
        return values

    def stream(self, what: str, timed: Iterable[TimedMessage]) -> Stream | None:
        """Return the commands (n, nv) of messages, or None without commands.

        `what` names the messages in errors. FileError is raised for an invalid command.
        """
        return stack_stream(what, ((each.time, self.read(what, each)) for each in timed))

    def _read_array(self, what: str, each: TimedMessage) -> Array:
        """Return the velocities in an array of the commanded velocities, or of all velocities."""
        row = np.asarray(each.message.data, dtype=np.float64)
        if len(row) not in (self._count, self._nv):
            raise FileError(f"{what}: {len(row)} numbers, {each.when}; {self._count} are commanded")
        if not np.isfinite(row).all():
            raise FileError(f"{what}: {row[~np.isfinite(row)][0]}, {each.when}")
        velocities = np.zeros(self._nv)
        if len(row) == self._count:
            velocities[self._columns] = row[self._places]
        else:
            velocities[:] = row
        return velocities

    def _read_point(self, what: str, each: TimedMessage) -> Array | None:
        """Return the velocities of the point of a trajectory.

        A trajectory without points is a stop. FileError is raised for a trajectory of several
        points, which is not a single command, and for a point without velocities.
        """
        points = each.message.points
        if len(points) > 1:
            raise FileError(
                f"{what}: a trajectory of {len(points)} points, {each.when}; commands have one"
            )
        names = list(each.message.joint_names)
        velocity = list(points[0].velocities) if points else [0.0] * len(names)
        if len(velocity) != len(names):
            raise FileError(
                f"{what}: {len(names)} names but {len(velocity)} velocities, {each.when}"
            )
        return self._joints.take(
            what, each._replace(message=JointStateFields(names, velocity=velocity))
        )

    def _read_stamped(self, what: str, each: TimedMessage) -> Array:
        """Return the velocities of a stamped twist; raise FileError for axes of the world."""
        frame = each.message.header.frame_id
        if frame in twists.WORLD_FRAMES:
            raise FileError(f"{what}: a twist in '{frame}', {each.when}; expected axes of the body")
        return self._read_twist(what, each._replace(message=each.message.twist))

    def _read_twist(self, what: str, each: TimedMessage) -> Array:
        """Return the velocities of a twist; `others` collects components that the body lacks."""
        velocities = np.zeros(self._nv)
        for index, value in twists.read_twist(each.message, self._twist).items():
            if not np.isfinite(value):
                raise FileError(f"{what}: {value}, {each.when}")
            velocities[index] = value
        unused = twists.list_unused_components(each.message, self._twist)
        self.others |= dict.fromkeys(f"{part} of {what}" for part in unused)
        return velocities
