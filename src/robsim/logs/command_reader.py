"""The velocities that messages command."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np

from robsim.base.arrays import Array
from robsim.base.errors import FileError
from robsim.logs import message_types, twists
from robsim.logs.bag_files import TimedMessage
from robsim.logs.joint_states import JointStateFields, JointValues, stack_stream
from robsim.run.control.standalone_controller import Controller
from robsim.run.log import Stream


class CommandReader:
    """Commanded velocities (nv,) of a scene, from messages of one type; zero for the others.

    `others` collects what the scene does not have. InputError: the scene has no such commands.
    """

    def __init__(self, controller: Controller, kind: str, called: Mapping[str, str]) -> None:
        names = controller.scene.velocity_names
        self.others: dict[str, None] = {}
        self._nv = len(names)
        self._columns = [names.index(name) for name in controller.velocity_names]
        self._joints = JointValues(
            [called.get(name, name) for name in names], "velocity", every=False
        )
        self._twist = twists.twist_components(names) if kind in message_types.TWISTS else ()
        self._row = {
            message_types.JOINTS: self._joints.take,
            message_types.NUMBERS: self._numbered,
            message_types.TRAJECTORY: self._point,
            message_types.TWIST: self._of_twist,
            message_types.STAMPED: self._stamped,
        }[kind]

    def stream(self, what: str, found: Iterable[TimedMessage]) -> Stream | None:
        """Return the commands (n, nv) of messages; None without any. FileError: as `row`."""
        rows = [(each.time, self._row(what, each)) for each in found]
        self.others |= dict.fromkeys(f"joint {name}" for name in self._joints.others)
        return stack_stream(what, rows)

    def _numbered(self, what: str, each: TimedMessage) -> Array:
        """Return as many numbers as are commanded, or as there are velocities."""
        row = np.asarray(each.message.data, dtype=np.float64)
        if len(row) not in (len(self._columns), self._nv):
            raise FileError(
                f"{what}: {len(row)} numbers, {each.said}; {len(self._columns)} are commanded"
            )
        if not np.isfinite(row).all():
            raise FileError(f"{what}: {row[~np.isfinite(row)][0]}, {each.said}")
        found = np.zeros(self._nv)
        found[slice(None) if len(row) == self._nv else self._columns] = row
        return found

    def _point(self, what: str, each: TimedMessage) -> Array | None:
        """Return the velocities of a trajectory of one point, as they are streamed; none: a stop.

        FileError: several points, which are a plan and no command, or one without velocities.
        """
        points = each.message.points
        if len(points) > 1:
            raise FileError(
                f"{what}: a trajectory of {len(points)} points, {each.said}; commands have one"
            )
        names = list(each.message.joint_names)
        velocity = list(points[0].velocities) if points else [0.0] * len(names)
        if len(velocity) != len(names):
            raise FileError(
                f"{what}: {len(names)} names and {len(velocity)} of velocities, {each.said}"
            )
        return self._joints.take(
            what, each._replace(message=JointStateFields(names, velocity=velocity))
        )

    def _stamped(self, what: str, each: TimedMessage) -> Array:
        """Return the velocities of a stamped twist. FileError: it is in axes of the world."""
        frame = each.message.header.frame_id
        if frame in twists.WORLD_FRAMES:
            raise FileError(
                f"{what}: a twist in '{frame}', {each.said}; it is read in axes of the body"
            )
        return self._of_twist(what, each._replace(message=each.message.twist))

    def _of_twist(self, what: str, each: TimedMessage) -> Array:
        found = np.zeros(self._nv)
        for index, value in twists.read_twist(each.message, self._twist).items():
            if not np.isfinite(value):
                raise FileError(f"{what}: {value}, {each.said}")
            found[index] = value
        left = twists.list_unused_components(each.message, self._twist)
        self.others |= dict.fromkeys(f"{part} of {what}" for part in left)
        return found
