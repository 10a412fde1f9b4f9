"""Messages about a scene and its instants, each smaller than `LARGEST`."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from robsim.page.html_document import encode_recording_text
from robsim.studio.message_text import LARGEST, encode_message

SHAPE_BYTES = 36_000  # size of the shapes in a message; base64 takes a third more
ARRAY_BYTES = 120  # size of the declaration of an array
TAIL = 48  # messages of rows; more are joined
GOAL = ".goal"  # suffix of the names of goal arrays, which do not have a row for each instant
# keys of a header; a change needs a new page
PANELS = ("format", "version", "title", "curves", "constraints")

Arrays = Mapping[str, NDArray[Any]]
Header = Mapping[str, Any]  # Any: JSON
Rows = tuple[int, Arrays, str]  # number of the first instant, arrays, and message


@dataclass(frozen=True)
class SceneLog:
    """All that a new page needs: header, shapes, first instants, and messages of further rows.

    Each change makes a new log, because another thread reads it.
    """

    header: Header = field(default_factory=dict)
    shapes: Arrays = field(default_factory=dict)
    first: Arrays = field(default_factory=dict)
    live: bool = False
    pieces: tuple[str, ...] = ()
    tail: tuple[Rows, ...] = ()

    def list_messages(self) -> list[str]:
        """Return the messages for a new page."""
        if not self.header:
            return []
        arrays = {**self.first, "poses": _widen(self.first["poses"], len(self.header["frames"]))}
        return [
            *_encode_shapes(self.shapes),
            _encode_recording(self.header, arrays, self.live),
            *self.pieces,
            *(message for _, _, message in self.tail),
        ]


class SceneMessages:
    """Messages of a scene: a recording with its first instants, then changed entries and rows.

    Attributes
    ----------
    log : SceneLog
        All that a new page needs.
    """

    def __init__(self) -> None:
        self.log = SceneLog()

    def can_change_to(self, header: Header, arrays: Arrays) -> bool:
        """Return whether the page of the last recording can show another header and its arrays."""
        own, first = self.log.header, self.log.first
        timed = {name: values.shape[1:] for name, values in arrays.items() if name != "poses"}
        return (
            self.log.live
            and all(own[key] == header[key] for key in PANELS)
            and timed == {name: first[name].shape[1:] for name in first if name != "poses"}
        )

    def open(self, header: Header, shapes: Arrays, arrays: Arrays, live: bool) -> Iterator[str]:
        """Yield the messages of a new recording: shapes, header and instants."""
        new = {name: shapes[name] for name in shapes if name not in self.log.shapes}
        messages, first = _encode_opening(header, arrays, live)
        self.log = SceneLog(header, shapes, first, live, tuple(messages[1:]))
        yield from [*_encode_shapes(new), *messages]

    def change(self, header: Header, shapes: Arrays) -> Iterator[str]:
        """Yield the messages of new shapes and of the entries that have changed."""
        before = self.log
        if header == before.header:
            return
        self.log = replace(before, header=header, shapes=shapes)
        yield from _encode_shapes({n: x for n, x in shapes.items() if n not in before.shapes})
        changes = {key: _find_changes(before.header[key], x) for key, x in header.items()}
        changed = {key: change for key, change in changes.items() if change is not None}
        yield encode_message("entries", header=changed)

    def extend(self, start: int, arrays: Arrays) -> Iterator[str]:
        """Yield the messages of the instants from number `start` on; 0 starts the run anew."""
        messages = _encode_rows(start, arrays)
        if start == 0:
            self.log = replace(self.log, first=arrays, pieces=tuple(messages[1:]), tail=())
        elif len(messages) > 1:
            self.log = replace(self._join_tail(), pieces=(*self.log.pieces, *messages))
        else:
            log = self.log if len(self.log.tail) < TAIL else self._join_tail()
            self.log = replace(log, tail=(*log.tail, (start, arrays, messages[0])))
        yield from messages

    def _join_tail(self) -> SceneLog:
        """Return the log with the messages of rows in its tail joined."""
        log = self.log
        if not log.tail:
            return log
        pieces = _encode_rows(log.tail[0][0], join_rows([(i, x) for i, x, _ in log.tail]))
        return replace(log, pieces=(*log.pieces, *pieces), tail=())


def split_shapes(header: Header, arrays: Arrays) -> tuple[Arrays, Arrays]:
    """Return the arrays of the shapes that the entries of a header name, and all other arrays."""
    keys = ("triangles", "edges", "points", "frustum")
    entries = [each for kind in ("parts", "marks", "cameras") for each in header[kind]]
    names = {each[key] for each in entries for key in keys if key in each}
    return (
        {name: arrays[name] for name in arrays if name in names},
        {name: arrays[name] for name in arrays if name not in names},
    )


def join_rows(rows: list[tuple[int, Arrays]]) -> dict[str, NDArray[Any]]:
    """Return the arrays of successive rows; later rows replace earlier ones."""
    end, last = rows[-1]
    width = max(arrays["poses"].shape[1] for _, arrays in rows)
    parts = [last]  # from the last rows back; each ends at the first of the later ones
    for start, arrays in reversed(rows[:-1]):
        count, end = max(end - start, 0), min(start, end)
        parts.append({name: arrays[name][:count] for name in last})
    columns = {name: [part[name] for part in reversed(parts)] for name in last}
    columns["poses"] = [_widen(each, width) for each in columns["poses"]]
    return {
        name: last[name] if name.endswith(GOAL) else np.concatenate(columns[name]) for name in last
    }


def _widen(poses: NDArray[Any], frames: int) -> NDArray[Any]:
    """Return poses (T, frames, 7), NaN for the frames that are missing."""
    missing = frames - poses.shape[1]
    return np.pad(poses, ((0, 0), (0, missing), (0, 0)), constant_values=np.nan)


def _find_changes(before: Any, after: Any) -> Any:  # Any: JSON
    """Return the change of a value or of a list, as in the message "entries"; None without one."""
    if before == after:
        return None
    if not isinstance(after, list):
        return {"value": after}
    pairs = enumerate(after)
    changed = [[i, x] for i, x in pairs if i >= len(before) or before[i] != x]
    return {"length": len(after), "changed": changed}


def _encode_opening(header: Header, arrays: Arrays, live: bool) -> tuple[list[str], Arrays]:
    """Return the messages of a recording and its further rows, and the arrays of the first one."""
    count = len(arrays["time"])
    message = _encode_recording(header, arrays, live)
    if len(message) < LARGEST or count < 2:
        return [message], arrays
    half = count // 2
    messages, first = _encode_opening(header, _cut(arrays, 0, half), live)
    return [*messages, *_encode_rows(half, _cut(arrays, half, count))], first


def _encode_rows(start: int, arrays: Arrays) -> list[str]:
    """Return the messages of rows from an instant on."""
    count = len(arrays["time"])
    text = encode_recording_text({}, dict(arrays), _list_quantised(arrays))
    message = encode_message("rows", recording=text, **{"from": start})
    if len(message) < LARGEST or count < 2:
        return [message]
    half = count // 2
    early, late = _cut(arrays, 0, half), _cut(arrays, half, count)
    return [*_encode_rows(start, early), *_encode_rows(start + half, late)]


def _encode_recording(header: Header, arrays: Arrays, live: bool) -> str:
    """Return the message of a recording without shapes."""
    text = encode_recording_text(dict(header), dict(arrays), _list_quantised(arrays))
    return encode_message("recording", recording=text, live=live)


def _encode_shapes(shapes: Arrays) -> list[str]:
    """Return the messages of shapes; a large shape is divided."""
    messages, part, room = [], _ShapePart(), SHAPE_BYTES
    for name, points in shapes.items():
        most = max((SHAPE_BYTES - ARRAY_BYTES) // points[:1].nbytes, 1) if points.size else 1
        for start in range(0, max(len(points), 1), most):
            piece = points[start : start + most]
            if part.arrays and room < piece.nbytes + ARRAY_BYTES:
                messages.append(part.encode())
                part, room = _ShapePart(), SHAPE_BYTES
            part.arrays[name], part.starts[name] = piece, start
            room -= piece.nbytes + ARRAY_BYTES
    return [*messages, part.encode()] if part.arrays else messages


@dataclass
class _ShapePart:
    """Shapes in a message, and the number of the first point of each."""

    arrays: dict[str, NDArray[Any]] = field(default_factory=dict)
    starts: dict[str, int] = field(default_factory=dict)

    def encode(self) -> str:
        """Return the message."""
        text = encode_recording_text({"starts": self.starts}, self.arrays, set(), 6)
        return encode_message("shapes", recording=text)


def _list_quantised(arrays: Arrays) -> set[str]:
    """Return the names of the arrays that are quantised: poses of several instants."""
    poses = arrays["poses"]
    return {"poses"} if len(poses) > 1 and np.isfinite(poses).all() else set()


def _cut(arrays: Arrays, start: int, end: int) -> Arrays:
    """Return the arrays of some instants."""
    return {
        name: values if name.endswith(GOAL) else values[start:end]
        for name, values in arrays.items()
    }
