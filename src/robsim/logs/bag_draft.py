"""A ROS 2 bag that is being written beside its path, and moved there when it is complete."""

from __future__ import annotations

import shutil
import tempfile
from contextlib import suppress
from pathlib import Path
from typing import Any, Final, Self

from robsim.base.errors import FileError
from robsim.logs import message_types, topics
from robsim.logs.mcap_checksums import add_mcap_checksums

PLUGINS = {"mcap": ".mcap", "sqlite3": ".db3"}
LATCHED = (topics.STATIC_FRAMES, topics.EXPERIMENT)  # topics kept for late subscribers
VERSION: Final = 8  # of the bag format


def check_bag_path(path: Path) -> None:
    """Raise FileError if the folder of a new bag exists already."""
    if path.suffix not in PLUGINS.values() and path.exists():
        raise FileError(f"{path} exists already; a bag needs a new folder")


class TopicWriter:
    """A writer of messages to the folder of a new bag, which adds topics as they come.

    Parameters
    ----------
    folder : Path
        New folder.
    storage : str
        "mcap" or "sqlite3".
    """

    def __init__(self, folder: Path, storage: str) -> None:
        from rosbags.rosbag2 import StoragePlugin, Writer

        self._store = message_types.load_typestore()
        plugin = StoragePlugin[storage.upper()]
        self._writer = Writer(folder, version=VERSION, storage_plugin=plugin)
        self._writer.open()
        self._connections: dict[str, Any] = {}

    @property
    def storage(self) -> Any:
        """The writer of the file by rosbags."""
        return self._writer.storage

    def close(self) -> None:
        """Complete the files of the bag."""
        self._writer.close()

    def write(self, topic: str, kind: str, time: int, data: bytes | memoryview) -> None:
        """Write a message in CDR, with its time in ns."""
        if topic not in self._connections:
            profiles = [_make_latched_qos()] if topic in LATCHED else []
            self._connections[topic] = self._writer.add_connection(
                topic, kind, typestore=self._store, offered_qos_profiles=profiles
            )
        self._writer.write(self._connections[topic], time, bytes(data))

    def write_message(self, topic: str, kind: str, time: int, message: Any) -> None:
        """Write a message of rosbags, with its time in ns."""
        self.write(topic, kind, time, message_types.serialize_message(kind, message))


class BagDraft:
    """A bag that appears at its path when the `with` block ends without an error.

    If the path ends with .mcap or .db3, the bag is a single file, else a new folder.

    Parameters
    ----------
    path : Path
        Path of the bag.
    storage : str, default "mcap"
        Storage of a folder: "mcap" or "sqlite3".

    Raises
    ------
    FileError
        If the folder of a new bag exists already.
    """

    def __init__(self, path: Path, storage: str = "mcap") -> None:
        self.path, self._is_file = path, path.suffix in PLUGINS.values()
        self._storage = storage
        check_bag_path(path)
        if self._is_file:
            self._storage = next(name for name, end in PLUGINS.items() if end == path.suffix)
        path.parent.mkdir(parents=True, exist_ok=True)
        self.folder = Path(tempfile.mkdtemp(prefix=".robsim-", dir=path.parent))

    @property
    def _content(self) -> Path:
        """The folder with the files of the bag."""
        return self.folder / self.path.name

    def __enter__(self) -> Self:
        self.topics = TopicWriter(self._content, self._storage)
        return self

    def __exit__(self, kind: object, *_: object) -> None:
        try:
            self.topics.close()
            if kind is None:
                self._move()
        finally:
            with suppress(OSError):
                shutil.rmtree(self.folder)

    def _move(self) -> None:
        """Move the complete bag to its path."""
        name = self._content.name
        if self._storage == "mcap":
            add_mcap_checksums(self._content / f"{name}.mcap")
        if self._is_file:
            (self._content / f"{name}{self.path.suffix}").replace(self.path)
        else:
            self._content.rename(self.path)


def _make_latched_qos() -> Any:
    """Return the quality of service of a topic with a message for late subscribers."""
    from rosbags import interfaces as of

    never = of.QosTime(2147483647, 4294967295)
    return of.Qos(
        of.QosHistory.KEEP_LAST,
        1,
        of.QosReliability.RELIABLE,
        of.QosDurability.TRANSIENT_LOCAL,
        never,
        never,
        of.QosLiveliness.AUTOMATIC,
        never,
        False,
    )
