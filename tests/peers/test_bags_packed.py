"""Bags that were compressed by `ros2 bag`: whole files, messages, chunks."""

import shutil

import numpy as np
import pytest
from bagging import check_refusal, write_bag
from rosbags.rosbag2 import CompressionMode, StoragePlugin

import robsim as rs
from robsim.logs import zstd


@pytest.mark.parametrize("storage", [StoragePlugin.MCAP, StoragePlugin.SQLITE3])
@pytest.mark.parametrize("packed", [CompressionMode.FILE, CompressionMode.MESSAGE])
def test_compressed_bags_are_read(storage, packed, content, run, tmp_path):
    path = write_bag(tmp_path / "bag", content, storage, packed)
    of_files = packed is CompressionMode.FILE
    assert any(file.suffix == ".zstd" for file in path.iterdir()) == of_files
    for where in (path, *(file for file in path.iterdir() if file.suffix != ".yaml")):
        np.testing.assert_array_equal(rs.logs.read_bag(where).q, run.q)


def test_chunks_of_mcap_that_are_compressed_are_read(content, run, tmp_path):
    path = write_bag(tmp_path / "bag", content, packed=CompressionMode.STORAGE)
    np.testing.assert_array_equal(rs.logs.read_bag(path).pixels, run.pixels)


@pytest.mark.parametrize("packed", [CompressionMode.FILE, CompressionMode.MESSAGE])
def test_damaged_compressed_data_is_reported(packed, content, tmp_path, monkeypatch):
    path = write_bag(tmp_path / "bag", content, packed=packed)
    monkeypatch.setattr(zstd, "LARGEST", 100)
    monkeypatch.setattr(zstd, "LARGEST_FILE", 1000)
    check_refusal(path, "more than 1000? bytes when decompressed")
    monkeypatch.undo()
    (file,) = (file for file in path.iterdir() if file.suffix != ".yaml")
    whole, odd = file.read_bytes(), tmp_path / f"odd{''.join(file.suffixes)}"
    for data in (whole[: len(whole) // 2], whole[:3], b"", b"\0" * 99):
        odd.write_bytes(data)
        check_refusal(odd, "truncated|damaged")


def test_nothing_is_left_of_the_unpacked_files(content, tmp_path, monkeypatch):
    path = write_bag(tmp_path / "bag", content, packed=CompressionMode.FILE)
    (tmp_path / "scratch").mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "scratch"))
    rs.logs.read_bag(path)
    assert list((tmp_path / "scratch").iterdir()) == []


def test_a_file_that_was_unpacked_beside_itself_is_read_once(content, run, tmp_path):
    path = write_bag(tmp_path / "bag", content)
    packed = write_bag(tmp_path / "packed", content, packed=CompressionMode.FILE)
    shutil.copy(packed / "packed.mcap.zstd", path / "bag.mcap.zstd")
    np.testing.assert_array_equal(rs.logs.read_bag(path).q, run.q)
