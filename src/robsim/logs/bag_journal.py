"""A bag that is recorded over time, and stays readable if its process is killed."""

from __future__ import annotations

import shutil
import sqlite3
import time
from itertools import count
from pathlib import Path
from typing import Final

from robsim.base.atomic_files import convert_os_errors
from robsim.base.errors import FileError
from robsim.logs import message_types
from robsim.logs.bag_draft import BagDraft, TopicWriter, check_bag_path

SAVE_PERIOD: Final = 1.0  # seconds of messages that a killed process loses at most


class BagJournal:
    """Messages in the order of their arrival, which become a bag at the end.

    Until then they are in a folder beside the bag, PATH.part1, or the next free number. The folder
    is a bag in SQLite, to which the messages are committed every second: if the process is killed,
    `read_bag` reads all but the messages of the last second from it.

    Parameters
    ----------
    path : Path
        Path of the bag: a new folder, or a file that ends with .mcap or .db3.

    Raises
    ------
    InputError
        If rosbags is not installed.
    FileError
        If the bag exists as a folder, or cannot be written.
    """

    def __init__(self, path: Path) -> None:
        message_types.load_typestore()  # InputError without rosbags
        check_bag_path(path)
        self.path = path
        parts = (path.with_name(f"{path.name}.part{n}") for n in count(1))
        with convert_os_errors(path):
            path.parent.mkdir(parents=True, exist_ok=True)
            self.part = next(part for part in parts if not part.exists())
            self.topics = TopicWriter(self.part, "sqlite3")
        connection = self.topics.storage.conn
        connection.execute("PRAGMA synchronous = OFF")  # a commit then waits for no disk
        self._commit = connection.commit
        self._saved = time.monotonic()

    def write(self, topic: str, kind: str, at: int, data: bytes | memoryview) -> None:
        """Write a message in CDR, with its time in ns; FileError if the disk is full."""
        try:
            self.topics.write(topic, kind, at, data)
            if time.monotonic() - self._saved > SAVE_PERIOD:
                self._commit()
                self._saved = time.monotonic()
        except sqlite3.Error as error:
            raise FileError(f"{self.part}: the bag cannot be recorded: {error}") from None

    def complete(self) -> None:
        """Write the bag at its path, and remove the folder of the journal.

        If that fails, the folder stays. A journal without messages leaves no bag.
        """
        from rosbags.rosbag2 import Reader

        with convert_os_errors(self.path):
            self.topics.close()
            with Reader(self.part) as reader:
                if reader.message_count:
                    with BagDraft(self.path) as draft:
                        for connection, at, data in reader.messages():
                            draft.topics.write(connection.topic, connection.msgtype, at, data)
            shutil.rmtree(self.part)
