"""Devices and pipes in place of files: an endless file is refused, and a pipe is not waited for."""

from __future__ import annotations

import os
import socket
from pathlib import Path

import pytest

import robsim as rs
from robsim.base.file_content import check_regular_file, open_regular_file, read_bytes
from robsim.page import load_recording


def resume_run(path):
    one = rs.load_scenario(rs.examples.path("visp_tutorial"))
    return one.run(duration=0.4, checkpoint=path, resume=True)


READERS = {
    "scenario": rs.load_scenario,
    "robot": rs.Robot.from_urdf,
    "camera": rs.Camera.from_file,
    "run": rs.open_run,
    "run without a seal": lambda path: rs.open_run(path, unsealed=True),
    "page": load_recording,
    "checkpoint": resume_run,
}


@pytest.fixture
def endless(tmp_path):
    """Paths that are no regular files, by the word of the message."""
    os.mkfifo(tmp_path / "pipe")
    with socket.socket(socket.AF_UNIX) as listener:
        listener.bind(str(tmp_path / "socket"))
        yield {
            "pipe": [tmp_path / "pipe"],
            "socket": [tmp_path / "socket"],
            "folder": [tmp_path],
            "device": [Path("/dev/zero"), Path("/dev/full"), Path("/dev/tty")],
        }


@pytest.mark.parametrize("name", READERS)
def test_only_regular_files_are_opened(name, endless):
    for word, paths in endless.items():
        for path in paths:
            with pytest.raises(rs.errors.FileError, match=f"{path}: this is a {word}; expected "):
                READERS[name](path)


@pytest.mark.parametrize("name", ["study.toml", "study.json"])
def test_the_files_of_a_study_are_regular_files(name, tmp_path):
    one = rs.load_scenario(rs.examples.path("visp_tutorial")).with_(duration=0.2)
    rs.study(one, 2, store=tmp_path / "store")
    (tmp_path / "store" / name).unlink()
    os.mkfifo(tmp_path / "store" / name)
    with pytest.raises(rs.errors.FileError, match=f"{name}: this is a pipe"):
        rs.open_study(tmp_path / "store")


def test_a_symbolic_link_leads_to_its_file(tmp_path):
    (tmp_path / "file").write_bytes(b"1234")
    (tmp_path / "link").symlink_to("file")
    (tmp_path / "loop").symlink_to("loop")
    assert read_bytes(tmp_path / "link", "four bytes", 4) == b"1234"
    with pytest.raises(rs.errors.FileError, match="larger than 0 MB"):
        read_bytes(tmp_path / "link", "three bytes", 3)
    with pytest.raises(rs.errors.FileError, match=r"cannot read .*loop"):
        read_bytes(tmp_path / "loop", "a file", 4)


@pytest.mark.parametrize("path", [3, b"file", None, "a\0b"])
def test_a_path_of_another_type_is_an_error(path):
    with pytest.raises(rs.errors.FileError, match="cannot read"):
        check_regular_file(path, "a file")


def test_a_pipe_that_replaces_a_file_after_the_check_is_not_waited_for(tmp_path, monkeypatch):
    os.mkfifo(tmp_path / "pipe")
    monkeypatch.setattr("robsim.base.file_content.check_regular_file", lambda *_: None)
    with pytest.raises(rs.errors.FileError, match="this is a pipe"):
        open_regular_file(tmp_path / "pipe", "a file")
