"""Packets between a controller and a robot, in the style of RTDE: big-endian, header first.

A header is the size of the whole packet in bytes (uint16) and its kind (uint8). `parse` returns
None for data with another size or kind, or with a number that is not finite.
"""

import struct
from math import isfinite
from typing import NamedTuple

HEADER = struct.Struct(">HB")
JOINTS = 6
LARGEST = 1500  # bytes; networks transmit packets of this size unfragmented


class State(NamedTuple):
    """The robot at a time: joints, and statistics of the received packets.

    timestamp   seconds on the robot's clock
    q, qd       (6,) in rad and rad/s
    sequence    number of the last received command, 0 before the first
    round_trip  seconds from the state that this command answers to its arrival
    refused     number of invalid packets
    stops       number of stops due to missing commands
    """

    timestamp: float
    q: tuple[float, ...]
    qd: tuple[float, ...]
    sequence: int = 0
    round_trip: float = 0.0
    refused: int = 0
    stops: int = 0


class Command(NamedTuple):
    """Velocities (6,) in rad/s, their number, and the timestamp of the state that they answer."""

    sequence: int
    answers: float
    qd: tuple[float, ...]


class Image(NamedTuple):
    """Marks seen by a camera: time of the image, and {name: (column, row)} in pixels."""

    timestamp: float
    marks: dict[str, tuple[float, float]]


STATE, COMMAND, MARK, IMAGE = (
    struct.Struct(f">{of}") for of in ("d6d6dIdII", "Id6d", "16s2d", "d")
)


def pack(packet: State | Command | Image) -> bytes:
    """Return the bytes of a packet."""
    if isinstance(packet, State):
        first, q, qd, *rest = packet
        return _whole(b"U", STATE.pack(first, *q, *qd, *rest))
    if isinstance(packet, Command):
        return _whole(b"V", COMMAND.pack(packet.sequence, packet.answers, *packet.qd))
    marks = (MARK.pack(name.encode(), *place) for name, place in packet.marks.items())
    return _whole(b"I", IMAGE.pack(packet.timestamp) + b"".join(marks))


def parse(data: bytes) -> State | Command | Image | None:
    """Return the packet of some bytes, or None if they are not a packet.

    >>> command = Command(7, 0.25, (0.1, 0.0, 0.0, 0.0, 0.0, -0.1))
    >>> parse(pack(command)) == command, parse(pack(command)[:-1]), parse(b"garbage")
    (True, None, None)
    """
    if len(data) < HEADER.size or HEADER.unpack_from(data)[0] != len(data):
        return None
    kind, body = data[2:3], data[HEADER.size :]
    if kind == b"U" and len(body) == STATE.size:
        found = STATE.unpack(body)
        joints = found[1 : 1 + JOINTS], found[1 + JOINTS : 1 + 2 * JOINTS]
        return _finite(State(found[0], *joints, *found[1 + 2 * JOINTS :]), found)
    if kind == b"V" and len(body) == COMMAND.size:
        number, answers, *qd = COMMAND.unpack(body)
        return _finite(Command(number, answers, tuple(qd)), (answers, *qd))
    if kind == b"I" and len(body) >= IMAGE.size and not (len(body) - IMAGE.size) % MARK.size:
        return _image(body)
    return None


def _image(body: bytes) -> Image | None:
    (timestamp,) = IMAGE.unpack_from(body)
    marks = {}
    for name, column, row in MARK.iter_unpack(body[IMAGE.size :]):
        try:
            marks[name.rstrip(b"\0").decode("ascii")] = column, row
        except UnicodeDecodeError:
            return None
    return _finite(Image(timestamp, marks), (timestamp, *sum(marks.values(), ())))


def _finite(packet, numbers):
    return packet if all(map(isfinite, numbers)) else None


def _whole(kind: bytes, body: bytes) -> bytes:
    return HEADER.pack(HEADER.size + len(body), kind[0]) + body
