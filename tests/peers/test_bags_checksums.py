"""Checksums of MCAP bags: the mcap package verifies ours, and no flipped bit opens."""

import zlib

import numpy as np
import pytest
from bagging import check_refusal, read_messages
from mcap.reader import NonSeekingReader
from mcap.writer import CompressionType, Writer

import robsim as rs
from robsim.logs import message_types


def flip(data, bit):
    """The bytes with one bit changed."""
    changed = bytearray(data)
    changed[bit // 8] ^= 1 << (bit % 8)
    return bytes(changed)


def write_by_mcap(path, source, compression, checksums=True):
    """Write the messages of a bag by the mcap package, with chunks of 4 kB."""
    store = message_types.load_typestore()
    with open(path, "wb") as file:
        writer = Writer(
            file,
            chunk_size=4096,
            compression=compression,
            enable_crcs=checksums,
            enable_data_crcs=checksums,
        )
        writer.start("ros2")
        channels = {}
        for topic, kind, time, each in read_messages(source):
            if topic not in channels:
                definition, _ = store.generate_msgdef(kind, ros_version=2)
                schema = writer.register_schema(kind, "ros2msg", definition.encode())
                channels[topic] = writer.register_channel(topic, "cdr", schema)
            writer.add_message(channels[topic], time, bytes(store.serialize_cdr(each, kind)), time)
        writer.finish()
    return path


def test_the_checksums_of_our_bags_are_those_of_the_format(run, tmp_path):
    path = rs.logs.write_bag(run, tmp_path / "run.mcap")
    with open(path, "rb") as file:
        reader = NonSeekingReader(file, validate_crcs=True)  # it raises for a wrong checksum
        assert len(list(reader.iter_messages(["/joint_states"]))) == run.sizes["time"]
    data = path.read_bytes()
    summary = int.from_bytes(data[-28:-20], "little")
    assert int.from_bytes(data[-12:-8], "little") == zlib.crc32(data[summary:-12])
    end = summary - 13  # DataEnd: opcode 15, 8 bytes of length, checksum
    assert data[end] == 15 and int.from_bytes(data[end + 9 : summary], "little") == zlib.crc32(
        data[:end]
    )
    (chunk,) = (i for i in [data.index(b"\x06", 43)] if i < 60)
    assert int.from_bytes(data[chunk + 33 : chunk + 37], "little") != 0


def test_no_flipped_bit_of_our_bags_opens(run, tmp_path):
    """Without checksums, 148 of these 200 bags were opened, 13 of them with other numbers."""
    data = rs.logs.write_bag(run, tmp_path / "run.mcap").read_bytes()
    odd, rng = tmp_path / "odd.mcap", np.random.default_rng(1)
    tail = 8 * len(data) - np.arange(1, 400, 8)
    for bit in (*rng.integers(8 * len(data), size=150).tolist(), *tail.tolist()):
        odd.write_bytes(flip(data, bit))
        with pytest.raises(rs.errors.FileError):
            rs.logs.read_bag(odd)


@pytest.mark.parametrize("compression", list(CompressionType))
def test_bags_of_the_mcap_package_are_read_and_verified(compression, bag, run, tmp_path):
    path = write_by_mcap(tmp_path / "other.mcap", bag, compression)
    np.testing.assert_array_equal(rs.logs.read_bag(path).q, run.q)
    data, rng = path.read_bytes(), np.random.default_rng(2)
    for bit in rng.integers(8 * len(data), size=40).tolist():
        path.write_bytes(flip(data, bit))
        with pytest.raises(rs.errors.FileError):
            rs.logs.read_bag(path)


def test_a_bag_without_checksums_is_read(bag, run, tmp_path):
    path = write_by_mcap(tmp_path / "other.mcap", bag, CompressionType.ZSTD, checksums=False)
    np.testing.assert_array_equal(rs.logs.read_bag(path).q, run.q)
    data = path.read_bytes()
    end = int.from_bytes(data[-28:-20], "little") - 13
    path.write_bytes(data[:end] + b"\x0e" + data[end + 1 :])
    check_refusal(path, "the end of the data or of the file is damaged")
