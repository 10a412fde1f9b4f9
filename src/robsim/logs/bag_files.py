"""Bags as files: what is in them, message by message, and what cannot be read of them."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Literal, NamedTuple, Self

from robsim.base.atomic_files import convert_os_errors
from robsim.base.errors import FileError, RobSimError, prefix_errors
from robsim.logs import message_types, zstd
from robsim.run.log import NANO

Clock = Literal["header", "log"]
SUFFIXES = (".mcap", ".db3")
MOST = 20_000_000  # messages
LARGEST = 1 << 30  # bytes of a chunk of MCAP, once it is unpacked


class RecordedMessage(NamedTuple):
    """A message, the time in nanoseconds at which it was recorded, and that in its header."""

    logged: int
    stamped: int | None
    message: Any


class TimedMessage(NamedTuple):
    """A message at a time in nanoseconds."""

    time: int
    message: Any

    @property
    def said(self) -> str:
        """The time, for messages of errors."""
        return f"at {self.time / NANO:.9g} s"


def assign_times(messages: Sequence[RecordedMessage], clock: Clock) -> Iterator[TimedMessage]:
    """Yield messages with their times: those of the headers, where these have any."""
    stamped = clock == "header" and any(each.stamped for each in messages)
    for each in messages:
        time = each.stamped if stamped else None
        yield TimedMessage(each.logged if time is None else time, each.message)


class Bag:
    """An open bag: a folder of MCAP or SQLite files, or one of them.

    `topics` are {name: type}. FileError: it cannot be read; once it is open, without its path.
    """

    def __init__(self, path: str | os.PathLike[str]) -> None:
        self.path, self._files = path, list(_list_bag_files(path))
        self._store = message_types.load_typestore()
        self._open, self._places = ExitStack(), [str(path)]
        self._readers: list[Any] = []
        self.topics: dict[str, str] = {}

    def __enter__(self) -> Self:
        from rosbags.rosbag2 import Reader

        with ExitStack() as stack:
            self._places.append(stack.enter_context(TemporaryDirectory(prefix="robsim-")))
            for file in self._files:
                with prefix_errors(str(self.path)), self._readable():
                    reader = stack.enter_context(
                        Reader(zstd.decompress_file(file, self._places[-1]))
                    )
                    _check_chunk_size(reader)
                    self._readers.append(reader)
            with prefix_errors(str(self.path)):
                self._note_topics()
            self._open = stack.pop_all()
        return self

    def __exit__(self, *_: object) -> None:
        self._open.close()

    def messages(self, *topics: str) -> Iterator[tuple[str, RecordedMessage]]:
        """Yield the messages of some topics, with these, in the order in which they came."""
        for reader in self._readers:
            with self._readable():
                some = [each for each in reader.connections if each.topic in topics]
                for each in some:
                    definition = _message_definition(each)
                    message_types.check_message_definition(
                        each.msgtype, definition, f"topic {each.topic}"
                    )
                for connection, logged, data in reader.messages(some) if some else ():
                    with self._readable(connection.topic):
                        plain = zstd.decompress_message(data)
                        found = self._store.deserialize_cdr(plain, connection.msgtype)
                        timed = RecordedMessage(
                            int(logged), message_types.header_time(found), found
                        )
                    yield connection.topic, timed

    def _note_topics(self) -> None:
        """Note the topics; FileError if there is nothing, too much, or a topic of two types."""
        for each in (each for reader in self._readers for each in reader.connections):
            if self.topics.setdefault(each.topic, each.msgtype) != each.msgtype:
                raise FileError(
                    f"topic {each.topic} holds {self.topics[each.topic]} and {each.msgtype}"
                )
        count = sum(reader.message_count for reader in self._readers)
        if not count:
            raise FileError("the bag is empty")
        if count > MOST:
            raise FileError(f"{count} messages; at most {MOST} are read")

    @contextmanager
    def _readable(self, topic: str = "") -> Iterator[None]:
        """Raise FileError for whatever the readers of bags raise."""
        where = f"topic {topic}: " if topic else ""
        try:
            yield
        except RobSimError as error:
            raise FileError(f"{where}{error}") from None
        except Exception as error:  # noqa: BLE001  of a damaged file there are many kinds
            words = str(error)
            for place in self._places:
                words = words.replace(place, "it")
            reason = " ".join(words.split()) or type(error).__name__
            raise FileError(
                f"{where}not a ROS 2 bag, or cut off or damaged: {reason:.200}"
            ) from None


def _list_bag_files(path: str | os.PathLike[str]) -> list[Path]:
    """Return the files of a bag, in the order in which they were written."""
    with convert_os_errors(path, "read"):
        there = Path(path)
        if not there.exists():
            raise FileError(f"no file {path}")
        if there.is_file():
            if _strip_compression(there).suffix not in SUFFIXES:
                raise FileError(f"{path}: expected a folder, or a .mcap or .db3 file")
            return [there]
        found = {_strip_compression(file): file for file in sorted(there.iterdir(), reverse=True)}
    files = [file for plain, file in found.items() if plain.suffix in SUFFIXES]
    if not files:
        raise FileError(f"{path}: no .mcap or .db3 file in this folder")
    return sorted(files, key=lambda file: _part_number(_strip_compression(file)))


def _strip_compression(file: Path) -> Path:
    """Return the name of a file without that of its compression."""
    return file.with_suffix("") if file.suffix == zstd.SUFFIX else file


def _part_number(file: Path) -> tuple[int, str]:
    """Return the number behind the name of a part of a bag."""
    last = file.stem.rsplit("_", maxsplit=1)[-1]
    return (int(last) if last.isascii() and last.isdigit() and len(last) < 10 else 0), file.name


def _check_chunk_size(reader: Any) -> None:
    """Raise FileError if a chunk would need too much memory."""
    sizes = [each.uncompressed_size for each in getattr(reader.storage, "chunks", ())]
    if max(sizes, default=0) > LARGEST:
        raise FileError(f"a chunk of {max(sizes)} bytes; at most {LARGEST} are read")


def _message_definition(connection: Any) -> str:
    """Return how a bag defines the messages of a connection; empty unless it is in .msg form."""
    from rosbags.interfaces import MessageDefinitionFormat

    own = connection.msgdef
    return str(own.data) if own.format is MessageDefinitionFormat.MSG else ""
