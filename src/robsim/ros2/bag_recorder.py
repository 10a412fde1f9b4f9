"""Recording of the messages of a node as a bag."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Self

from robsim.base.errors import FileError
from robsim.logs import message_types, topics
from robsim.logs.bag_journal import BagJournal
from robsim.run.experiment import Experiment


class BagRecorder:
    """A bag with the messages of a node, which is complete at the end of its `with` block.

    Until then the messages are in a folder beside the bag, PATH.part1. If the process is killed,
    `read_bag` reads this folder.

    Parameters
    ----------
    path : Path or None
        Bag to record; None: nothing is recorded.
    believed : Experiment, optional
        Experiment to record, which the reader of the bag then need not give.

    Raises
    ------
    InputError
        If rosbags is not installed.
    FileError
        If the bag cannot be written.
    """

    def __init__(self, path: Path | None, believed: Experiment | None = None) -> None:
        self._path, self._believed = path, believed
        self._kinds: dict[type, str] = {}
        self._journal: BagJournal | None = None
        self._latest = 0  # ns: messages are recorded in the order in which they came

    def __enter__(self) -> Self:
        if self._path is not None:
            if self._path.exists():
                raise FileError(f"{self._path} exists already: name another bag")
            self._journal = BagJournal(self._path)
        return self

    def __exit__(self, *reason: object) -> None:
        if self._journal is not None:
            self._journal.complete()  # also after an error

    def write(self, topic: str, message: Any, time: int) -> None:
        """Record a message of rclpy, with its time in ns."""
        if self._journal is None:
            return
        from rclpy.serialization import serialize_message

        time = self._latest = max(time, self._latest)
        if self._believed is not None:
            self._write_experiment(self._believed, time)
            self._believed = None
        kind = self._kinds.setdefault(type(message), _name_type(type(message)))
        self._journal.write(topic, kind, time, serialize_message(message))

    def _write_experiment(self, experiment: Experiment, time: int) -> None:
        """Record an experiment, with the time of the first message."""
        assert self._journal is not None
        origin = experiment.origin
        for text in filter(None, (origin.get("scenario"), origin.get("stored_data"))):
            message = message_types.make_message(message_types.TEXT, data=text)
            self._journal.topics.write_message(topics.EXPERIMENT, message_types.TEXT, time, message)


def _name_type(kind: type) -> str:
    """Return the name of a message type, such as "std_msgs/msg/Bool"."""
    package, part, *_ = kind.__module__.split(".")
    return f"{package}/{part}/{kind.__name__}"
