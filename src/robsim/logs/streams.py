"""The messages of topics as streams of numbers."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal, NamedTuple

import numpy as np

from robsim.base.arrays import Array
from robsim.base.errors import FileError
from robsim.logs.bag_files import Timed
from robsim.run.log import NANO, Stream
from robsim.servo.sight import Key
from robsim.vision.camera import Camera

Clock = Literal["header", "log"]
Names = Mapping[str, tuple[Key, int]]  # of a mark in a bag: its camera and target, its number


class At(NamedTuple):
    """A message at a time in nanoseconds."""

    time: int
    message: Any

    @property
    def said(self) -> str:
        """The time, for messages of errors."""
        return f"at {self.time / NANO:.9g} s"


def at_times(messages: Sequence[Timed], clock: Clock) -> Iterator[At]:
    """Yield messages with their times: those of the headers, where these have any."""
    stamped = clock == "header" and any(each.stamped for each in messages)
    for each in messages:
        time = each.stamped if stamped else None
        yield At(each.logged if time is None else time, each.message)


@dataclass
class Joints:
    """Numbers by name, of messages each of which may hold some: all of them, once all are known.

    `called` are the names in the bag, in the order of the values; `lacking` are those that were not
    found, and `others` those of which nothing is known.
    """

    called: Sequence[str]
    lacking: list[str] = field(default_factory=list)
    others: dict[str, None] = field(default_factory=dict)

    def stream(
        self, what: str, found: Iterable[At], part: str, every: bool = True
    ) -> Stream | None:
        """Return the positions or velocities (n, width) of JointState messages; None without any.

        What is not named is zero, unless `every` is wanted. FileError: a name that is there twice,
        or a number that is not finite.
        """
        rows = {name: i for i, name in enumerate(self.called)}
        now = np.full(len(self.called), np.nan if every else 0.0)
        times, values = [], []
        for each in found:
            if not len(getattr(each.message, part)):
                continue
            known = self._known(each, part, what)
            for name in known.keys() & rows.keys():
                now[rows[name]] = known[name]
            self.others |= dict.fromkeys(name for name in known if name not in rows)
            if not np.isnan(now).any():
                times.append(each.time)
                values.append(now.copy())
        self.lacking = [name for name, i in rows.items() if np.isnan(now[i])]
        return Stream(what, np.array(times, dtype=np.int64), np.array(values)) if values else None

    def _known(self, each: At, part: str, what: str) -> dict[str, float]:
        """Return the numbers of a message by name."""
        names, values = list(each.message.name), np.asarray(getattr(each.message, part)).tolist()
        if len(names) != len(values):
            raise FileError(f"{what}: {len(names)} names and {len(values)} of {part}, {each.said}")
        known = dict(zip(names, values, strict=True))
        if len(known) < len(names):
            twice = next(name for name in names if names.count(name) > 1)
            raise FileError(f"{what}: joint {twice} is there twice, {each.said}")
        if not np.isfinite(values).all():
            odd = next(name for name, value in known.items() if not np.isfinite(value))
            raise FileError(f"{what}: {part} of joint {odd} is {known[odd]}, {each.said}")
        return known


def numbered(what: str, found: Iterable[At], columns: Sequence[int], width: int) -> Stream | None:
    """Return the commands (n, width) of messages of as many numbers as are commanded.

    FileError: another count, or a number that is not finite.
    """
    times, values = [], []
    for each in found:
        row = np.asarray(each.message.data, dtype=np.float64)
        if len(row) not in (len(columns), width):
            raise FileError(
                f"{what}: {len(row)} numbers, {each.said}; {len(columns)} are commanded"
            )
        if not np.isfinite(row).all():
            raise FileError(f"{what}: {row[~np.isfinite(row)][0]}, {each.said}")
        full = np.zeros(width)
        full[slice(None) if len(row) == width else list(columns)] = row
        times.append(each.time)
        values.append(full)
    return Stream(what, np.array(times, dtype=np.int64), np.array(values)) if values else None


def images(
    what: str, found: Iterable[At], names: Names, sizes: Mapping[Key, int], others: dict[str, None]
) -> dict[Key, Stream]:
    """Return the pixels (n, N, 2) of the targets of a camera, NaN for a mark that is not seen.

    `others` collects marks of which nothing is known. FileError: a mark is there twice.
    """
    times: list[int] = []
    values: dict[Key, list[Array]] = {key: [] for key in sizes}
    for each in found:
        times.append(each.time)
        for key, count in sizes.items():
            values[key].append(np.full((count, 2), np.nan))
        for name, place in _marks(what, each):
            if name not in names:
                others[name] = None
                continue
            key, number = names[name]
            values[key][-1][number] = place if np.isfinite(place).all() else np.nan
    stamps = np.array(times, dtype=np.int64)
    return {
        key: Stream(what, stamps, np.array(values[key]).reshape(-1, count, 2))
        for key, count in sizes.items()
    }


def _marks(what: str, each: At) -> Iterator[tuple[str, tuple[float, float]]]:
    """Yield the name and the place (column, row) of each mark of a message."""
    before: set[str] = set()
    for found in each.message.detections:
        name = found.id or next((one.hypothesis.class_id for one in found.results), "")
        if name in before:
            raise FileError(f"{what}: mark '{name}' is there twice, {each.said}")
        before.add(name)
        centre = found.bbox.center.position
        yield name, (centre.x, centre.y)


def check_lens(what: str, found: Iterable[At], name: str, camera: Camera) -> Array | None:
    """Return the intrinsics (3, 3) of a camera's messages; None where they say of none.

    FileError: it changes them or its size, or has another size than the camera of the experiment.
    """
    first: tuple[Any, ...] | None = None
    for each in found:
        now = int(each.message.width), int(each.message.height), tuple(each.message.k.tolist())
        if first is None:
            first = now
        for was, is_now, part in zip(first, now, ("width", "height", "K"), strict=True):
            if was != is_now:
                raise FileError(
                    f"{what}: camera '{name}' changes its {part}, {each.said}: {is_now} after {was}"
                )
    if first is None:
        return None
    if camera.size and first[:2] not in ((0, 0), tuple(camera.size)):
        raise FileError(
            f"{what}: camera '{name}' has images of {first[0]} x {first[1]} pixels, and "
            f"{camera.size[0]} x {camera.size[1]} in the experiment"
        )
    K = np.array(first[2]).reshape(3, 3)
    return K if K[0, 0] and np.isfinite(K).all() else None  # 0: of a camera without calibration
