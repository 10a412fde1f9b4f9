"""Bags that were compressed by `ros2 bag`: whole files, messages, chunks."""

import os
import shutil
import struct
import tracemalloc
from importlib import import_module

import numpy as np
import pytest
from bagging import check_refusal, write_bag
from rosbags.rosbag2 import CompressionMode, StoragePlugin

import robsim as rs
from robsim.logs import decompression


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
    monkeypatch.setattr(decompression, "LARGEST", 100)
    monkeypatch.setattr(decompression, "LARGEST_FILE", 1000)
    check_refusal(path, "more than 1000? bytes when decompressed|at most 100 are read")
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


def compress_zeros(count, before=b""):
    """Some bytes and `count` MiB of zeros, compressed by Zstandard to 32 bytes per MiB."""
    compressor = import_module(decompression.ZSTD_MODULE).ZstdCompressor()
    pieces = [
        compressor.compress(before),
        *(compressor.compress(bytes(1 << 20)) for _ in range(count)),
    ]
    return b"".join([*pieces, compressor.flush()])


def test_a_small_file_that_decompresses_to_gigabytes_is_refused(tmp_path):
    """Before, 92 kB were written as 3 GB before they were refused."""
    path = tmp_path / "run.mcap.zstd"
    for before, words, most in (
        (b"", "the decompressed file is not a bag", 0),
        (b"\x89MCAP0\r\n", "more than 16777216 bytes when decompressed", 1 << 24),
        (b"SQLite format 3\0", "more than 16777216 bytes when decompressed", 1 << 24),
    ):
        path.write_bytes(compress_zeros(300, before))
        check_refusal(path, words)
        with pytest.raises(rs.errors.FileError, match=words):
            decompression.decompress_file(path, str(tmp_path))
        assert (tmp_path / "run.mcap").stat().st_size <= most


@pytest.mark.parametrize("declared", [100, 300 << 20])
def test_a_small_chunk_that_decompresses_to_gigabytes_is_refused(declared, content, tmp_path):
    path = write_bag(tmp_path / "bag", content) / "bag.mcap"
    data, packed = path.read_bytes(), compress_zeros(300)
    head = struct.pack("<QQQII4sQ", 0, 1, declared, 0, 4, b"zstd", len(packed))
    chunk = struct.pack("<BQ", 6, len(head) + len(packed)) + head + packed
    header = 17 + int.from_bytes(data[9:17], "little")
    path.write_bytes(data[:header] + chunk + data[header:])
    tracemalloc.start()
    check_refusal(path, "declares 100 bytes|more than 16777216 bytes when decompressed")
    assert tracemalloc.get_traced_memory()[1] < 1 << 25
    tracemalloc.stop()


def test_a_small_message_that_decompresses_to_gigabytes_is_refused():
    tracemalloc.start()
    with pytest.raises(rs.errors.FileError, match="more than 16777216 bytes"):
        decompression.decompress_message(compress_zeros(300))
    assert tracemalloc.get_traced_memory()[1] < 1 << 26
    tracemalloc.stop()


def test_frames_that_follow_each_other_are_one_file(content, run, tmp_path):
    path = write_bag(tmp_path / "bag", content) / "bag.mcap"
    compress, data = import_module(decompression.ZSTD_MODULE).compress, path.read_bytes()
    odd = tmp_path / "odd.mcap.zstd"
    odd.write_bytes(compress(data[:9999]) + compress(data[9999:]))
    np.testing.assert_array_equal(rs.logs.read_bag(odd).q, run.q)


@pytest.mark.parametrize("kind", ["pipe", "device"])
def test_a_bag_that_is_no_regular_file_is_not_opened(kind, tmp_path):
    """A pipe would wait for a writer, and /dev/zero has no end."""
    (tmp_path / "bag").mkdir()
    for path in (tmp_path / "run.mcap", tmp_path / "run.mcap.zstd", tmp_path / "bag" / "a.db3"):
        if kind == "pipe":
            os.mkfifo(path)
        else:
            path.symlink_to("/dev/zero")
        where = path.parent if path.parent != tmp_path else path
        with pytest.raises(rs.errors.FileError, match=f"{path.name}: this is a {kind}; expected a"):
            rs.logs.read_bag(where)
