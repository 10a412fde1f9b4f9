"""Containers: packed values come back, and no header claims more than the numbers hold."""

import hashlib
import json
from io import BytesIO

import numpy as np
import pytest

from robsim.container import MAGIC, ContainerError, append_seal, pack_container, unpack_container

ARRAYS = [
    np.arange(6.0).reshape(2, 3),
    np.array([True, False]),
    np.zeros((0, 4), "<i2"),
    np.array(1 + 2j),
    np.frombuffer(b"code", np.uint8),
    np.asfortranarray(np.arange(6, dtype=">i4").reshape(3, 2)),
]


def test_packed_values_come_back():
    header, arrays = unpack_container(pack_container({"a": [1, "ü", None, 0.1]}, ARRAYS))
    assert header == {"a": [1, "ü", None, 0.1]}
    for found, own in zip(arrays, ARRAYS, strict=True):
        assert found.dtype == own.dtype.newbyteorder("<") and found.shape == own.shape
        np.testing.assert_array_equal(found, own)
        found.reshape(-1)[:1] = 0  # an array of its own
    assert pack_container({}, ARRAYS).getvalue() == pack_container({}, ARRAYS).getvalue()


@pytest.mark.parametrize("odd", [np.array(["a"]), np.array([None]), np.zeros(1, "M8[s]")])
def test_only_numbers_are_packed(odd):
    with pytest.raises(ValueError, match="invalid type or place of numbers"):
        pack_container({}, [odd])


def test_no_flipped_bit_is_read():
    whole = pack_container({"step": 3}, ARRAYS).getvalue()
    for at in range(len(whole)):
        changed = bytearray(whole)
        changed[at] ^= 1 << (at % 8)
        with pytest.raises(ContainerError, match=r"was changed|has no seal"):
            unpack_container(BytesIO(changed))
        with pytest.raises(ContainerError, match=r"was changed|has no seal"):
            unpack_container(BytesIO(whole[:at]))


@pytest.mark.parametrize(
    "block",
    [
        {"dtype": "<f8", "shape": [2, 2], "offset": 0},
        {"dtype": "<f8", "shape": [1], "offset": 17},
        {"dtype": "<f8", "shape": [1 << 40], "offset": 0},
        {"dtype": "<f8", "shape": [1 << 61, 1 << 61], "offset": 0},
        {"dtype": "<f8", "shape": [-1], "offset": 0},
        {"dtype": "<f8", "shape": [1.0], "offset": 0},
        {"dtype": "<f8", "shape": [True], "offset": 0},
        {"dtype": "<f8", "shape": [1] * 17, "offset": 0},
        {"dtype": "|O", "shape": [1], "offset": 0},
        {"dtype": ["<f8"], "shape": [1], "offset": 0},
        {"dtype": "<f8", "shape": 1, "offset": 0},
        {"dtype": "<f8", "shape": [1], "offset": -8},
        {"dtype": "<f8", "shape": [1]},
        [],
    ],
)
def test_a_header_that_claims_other_numbers_is_refused(block):
    content = BytesIO(bytes(24))
    append_seal(content, {"header": None, "arrays": [block]})
    with pytest.raises(ContainerError, match="has a header that is not valid"):
        unpack_container(content)


def test_arrays_that_share_numbers_are_no_more_than_there_are():
    """A thousand arrays of all numbers each would take a thousand times the memory."""
    content = BytesIO(bytes(24))
    block = {"dtype": "<f8", "shape": [3], "offset": 0}
    append_seal(content, {"header": None, "arrays": [block] * 1000})
    with pytest.raises(ContainerError, match="larger than the file"):
        unpack_container(content)


@pytest.mark.parametrize("text", [b"[" * 10**6, b'{"a": 1, "a": 2}', b"\xff", b'"\\ud800"', b""])
def test_a_header_that_is_no_plain_json_is_refused(text):
    whole = text + len(text).to_bytes(8, "little")
    whole += hashlib.sha256(whole).digest() + MAGIC
    with pytest.raises(ContainerError, match="not JSON"):
        unpack_container(BytesIO(whole))
    long = json.dumps({}).encode() + (10**9).to_bytes(8, "little")
    with pytest.raises(ContainerError, match="index of 1000000000 bytes"):
        unpack_container(BytesIO(long + hashlib.sha256(long).digest() + MAGIC))
