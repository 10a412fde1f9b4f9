"""The files of a ROS 2 bag: topics, messages, and errors of damaged files."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Literal, NamedTuple, Self

from robsim.base.atomic_files import convert_os_errors
from robsim.base.errors import FileError, RobSimError, prefix_errors
from robsim.base.file_content import check_regular_file
from robsim.logs import decompression, message_types
from robsim.logs.mcap_checksums import McapChunk, verify_mcap
from robsim.logs.message_layout import LearnedLayout
from robsim.run.log import NANO

Clock = Literal["header", "log"]
SUFFIXES = (".mcap", ".db3")
MOST = 20_000_000  # messages of a bag
MOST_PADDING = 8  # bytes after a message
LAID_OUT = (message_types.JOINTS, message_types.DETECTIONS, message_types.LENS)  # mostly alike


class RecordedMessage(NamedTuple):
    """A message of a bag, with its times in nanoseconds."""

    logged: int  # time of recording
    stamped: int | None  # time in the header, None without a header
    message: message_types.Message


class TimedMessage(NamedTuple):
    """A message and its time in nanoseconds."""

    time: int
    message: message_types.Message

    @property
    def when(self) -> str:
        """The time in seconds as text, for error messages."""
        return f"at {self.time / NANO:.9g} s"


def assign_times(messages: Sequence[RecordedMessage], clock: Clock) -> Iterator[TimedMessage]:
    """Yield messages with their times.

    The times come from the headers if the clock is "header" and any header has a nonzero time.
    Otherwise they are the times of recording.
    """
    stamped = clock == "header" and any(each.stamped for each in messages)
    for each in messages:
        time = each.stamped if stamped else None
        yield TimedMessage(each.logged if time is None else time, each.message)


class Bag:
    """A ROS 2 bag to read in a `with` block: a folder of MCAP or SQLite files, or one such file.

    The attribute `topics` is {name: type of the messages}. FileError is raised for files that
    cannot be read. Errors of `messages` do not contain the path; the caller adds it.
    """

    def __init__(self, path: str | os.PathLike[str]) -> None:
        self.path, self._files = path, list(_list_bag_files(path))
        self._store = message_types.load_typestore()
        self._stack, self._private_paths = ExitStack(), [str(path)]
        self._readers: list[Any] = []
        self.topics: dict[str, str] = {}

    def __enter__(self) -> Self:
        from rosbags.rosbag2 import Reader

        with ExitStack() as stack:
            self._private_paths.append(stack.enter_context(TemporaryDirectory(prefix="robsim-")))
            for file in self._files:
                with prefix_errors(str(self.path)), self._convert_errors():
                    plain = decompression.decompress_file(file, self._private_paths[-1])
                    chunks = verify_mcap(plain) if plain.suffix == ".mcap" else {}
                    reader = stack.enter_context(Reader(plain))
                    _check_chunk_index(reader, chunks)
                    self._readers.append(reader)
            with prefix_errors(str(self.path)):
                self._store_topics()
            self._stack = stack.pop_all()
        return self

    def __exit__(self, *_: object) -> None:
        self._stack.close()

    def messages(self, *topics: str) -> Iterator[tuple[str, RecordedMessage]]:
        """Yield (topic, message) for the messages of some topics, in the order of recording."""
        layouts: dict[str, LearnedLayout] = {}
        for reader in self._readers:
            with self._convert_errors():
                connections = [each for each in reader.connections if each.topic in topics]
                for each in connections:
                    layouts.setdefault(each.topic, LearnedLayout(each.msgtype))
                    definition = _message_definition(each)
                    message_types.check_message_definition(
                        each.msgtype, definition, f"topic {each.topic}"
                    )
                for connection, logged, data in reader.messages(connections) if connections else ():
                    try:
                        payload = decompression.decompress_message(data)
                        message = self._deserialize(payload, connection, layouts[connection.topic])
                        stamped = message_types.header_time(message)
                    except Exception as error:  # noqa: BLE001  see _convert_error
                        raise self._convert_error(error, f"topic {connection.topic}: ") from None
                    yield connection.topic, RecordedMessage(int(logged), stamped, message)

    def _deserialize(
        self, payload: bytes, connection: Any, layout: LearnedLayout
    ) -> message_types.Message:
        """Return the message of a payload, fast if it has a layout that the topic had before."""
        message = layout.parse(payload)
        if message is None:
            message = self._deserialize_padded(payload, connection.msgtype)
            if connection.msgtype in LAID_OUT:
                layout.learn(message)
        return message

    def _deserialize_padded(self, payload: bytes, kind: str) -> message_types.Message:
        """Return a message in CDR, without the bytes that ROS 2 may append after an empty list."""
        for cut in range(0, MOST_PADDING + 1, 4):
            try:
                return self._store.deserialize_cdr(payload[: len(payload) - cut], kind)
            except Exception:  # noqa: BLE001  the error of the whole message is shown
                continue
        return self._store.deserialize_cdr(payload, kind)

    def _store_topics(self) -> None:
        """Store the topics; raise FileError for an empty or huge bag, or a topic of two types."""
        for each in (each for reader in self._readers for each in reader.connections):
            if self.topics.setdefault(each.topic, each.msgtype) != each.msgtype:
                raise FileError(
                    f"topic {each.topic} has two types: {self.topics[each.topic]}, {each.msgtype}"
                )
        count = sum(reader.message_count for reader in self._readers)
        if not count:
            raise FileError("the bag is empty")
        if count > MOST:
            raise FileError(f"{count} messages; at most {MOST} are read")

    @contextmanager
    def _convert_errors(self) -> Iterator[None]:
        """Convert any exception of a bag reader to a FileError."""
        try:
            yield
        except Exception as error:  # noqa: BLE001  damaged files raise many kinds of errors
            raise self._convert_error(error) from None

    def _convert_error(self, error: Exception, where: str = "") -> FileError:
        """Return the FileError for an exception of a bag reader, without names of private files."""
        if isinstance(error, RobSimError):
            return FileError(f"{where}{error}")
        if isinstance(error, OSError):
            reason = error.strerror or type(error).__name__
            return FileError(f"{where}the bag cannot be read: {reason}")
        words = str(error)
        for place in self._private_paths:
            words = words.replace(place, "it")
        reason = " ".join(words.split()) or type(error).__name__
        return FileError(f"{where}not a ROS 2 bag, or truncated or damaged: {reason:.200}")


def _list_bag_files(path: str | os.PathLike[str]) -> list[Path]:
    """Return the files of a bag, in the order of recording."""
    with convert_os_errors(path, "read"):
        location = Path(path)
        if not location.exists():
            raise FileError(f"no file {path}")
        if not location.is_dir():
            check_regular_file(path, "a bag")
            if _strip_compression(location).suffix not in SUFFIXES:
                raise FileError(f"{path}: expected a folder, or a .mcap or .db3 file")
            return [location]
        by_name = {
            _strip_compression(file): file for file in sorted(location.iterdir(), reverse=True)
        }
    files = [file for name, file in by_name.items() if name.suffix in SUFFIXES]
    if not files:
        raise FileError(f"{path}: no .mcap or .db3 file in this folder")
    for file in files:
        check_regular_file(file, "a file of a bag")
    return sorted(files, key=lambda file: _part_number(_strip_compression(file)))


def _strip_compression(file: Path) -> Path:
    """Return the name of a file without the suffix of its compression."""
    return file.with_suffix("") if file.suffix == decompression.SUFFIX else file


def _part_number(file: Path) -> tuple[int, str]:
    """Return the number at the end of a file name, or 0, and the name: the order of files."""
    last = file.stem.rsplit("_", maxsplit=1)[-1]
    return (int(last) if last.isascii() and last.isdigit() and len(last) < 10 else 0), file.name


def _check_chunk_index(reader: Any, chunks: Mapping[int, McapChunk]) -> None:
    """Raise FileError if the index of an MCAP file lists a chunk that the file does not have."""
    for each in getattr(reader.storage, "chunks", ()):
        chunk = chunks.get(each.chunk_start_offset)
        indexed = each.compression, each.compressed_size, each.uncompressed_size
        if chunk is None or indexed != (chunk.compression, chunk.packed, chunk.size):
            raise FileError(
                f"the index has a chunk at byte {each.chunk_start_offset}, not the data"
            )


def _message_definition(connection: Any) -> str:
    """Return the definition of a connection's messages, empty unless its format is .msg."""
    from rosbags.interfaces import MessageDefinitionFormat

    content = connection.msgdef
    return str(content.data) if content.format is MessageDefinitionFormat.MSG else ""
