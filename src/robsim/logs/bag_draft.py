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


class BagDraft:
    """A bag that appears at its path when the `with` block ends without an error.

    If the path ends with .mcap or .db3, the bag is a single file, else a new folder.

    Parameters
    ----------
    path : Path
        Path of the bag.
    storage : str, default "mcap"
        Storage of a folder: "mcap" or "sqlite3".
    prefix : str, default ".robsim-"
        Start of the name of the folder of an incomplete bag.

    Raises
    ------
    FileError
        If the folder of a new bag exists already.
    """

    def __init__(self, path: Path, storage: str = "mcap", prefix: str = ".robsim-") -> None:
        self.path, self._is_file = path, path.suffix in PLUGINS.values()
        self._storage = storage
        if self._is_file:
            self._storage = next(name for name, end in PLUGINS.items() if end == path.suffix)
        elif path.exists():
            raise FileError(f"{path} exists already; a bag needs a new folder")
        path.parent.mkdir(parents=True, exist_ok=True)
        self.folder = Path(tempfile.mkdtemp(prefix=prefix, dir=path.parent))
        self._connections: dict[str, Any] = {}

    @property
    def _content(self) -> Path:
        """The folder with the files of the bag."""
        return self.folder / self.path.name

    def __enter__(self) -> Self:
        from rosbags.rosbag2 import StoragePlugin, Writer

        plugin = StoragePlugin[self._storage.upper()]
        self._store = message_types.load_typestore()
        self._writer = Writer(self._content, version=VERSION, storage_plugin=plugin)
        self._writer.open()
        return self

    def __exit__(self, kind: object, *_: object) -> None:
        try:
            self._writer.close()
            if kind is None:
                self._move()
        finally:
            with suppress(OSError):
                shutil.rmtree(self.folder)

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
        self.write(topic, kind, time, self._store.serialize_cdr(message, kind))

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
