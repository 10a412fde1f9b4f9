"""The marks that messages of detections hold."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import Any

import numpy as np

from robsim.base.arrays import Array
from robsim.base.errors import FileError
from robsim.logs.bag_files import At
from robsim.logs.called import Ids
from robsim.run.log import Stream
from robsim.servo.sight import Key
from robsim.vision.tags.finders import from_april
from robsim.vision.tags.tag import name_of

Place = tuple[float, float]  # column and row in pixels


def images(
    what: str, found: Iterable[At], ids: Ids, sizes: Mapping[Key, int], others: dict[str, None]
) -> dict[Key, Stream]:
    """Return the pixels (n, N, 2) of the targets of a camera, NaN for a mark that is not seen.

    `others` collects marks of which nothing is known. FileError: a mark is there twice.
    """
    every = list(found)
    values = [image(what, each, ids, sizes, others) for each in every]
    times = np.array([each.time for each in every], dtype=np.int64)
    return {
        key: Stream(what, times, np.array([one[key] for one in values]).reshape(-1, count, 2))
        for key, count in sizes.items()
    }


def image(
    what: str, each: At, ids: Ids, sizes: Mapping[Key, int], others: dict[str, None]
) -> dict[Key, Array]:
    """Return the pixels (N, 2) of each target in a message."""
    values = {key: np.full((count, 2), np.nan) for key, count in sizes.items()}
    before: set[str] = set()
    for name, place in _marks(each.message):
        if name in before:
            raise FileError(f"{what}: mark '{name}' is there twice, {each.said}")
        before.add(name)
        if name not in ids:
            others[name] = None
        elif np.isfinite(place).all():
            key, number = ids[name]
            values[key][number] = place
    return values


def _marks(message: Any) -> Iterator[tuple[str, Place]]:
    """Yield the name and the place of each mark: of boxes the middle, of AprilTags the corners."""
    for found in message.detections:
        if hasattr(found, "corners"):
            corners = from_april(np.array([[each.x, each.y] for each in found.corners]))
            name = name_of(found.family, found.id)
            yield from ((f"{name}.{i}", tuple(place)) for i, place in enumerate(corners.tolist()))
        else:
            name = found.id or next((one.hypothesis.class_id for one in found.results), "")
            yield name, (found.bbox.center.position.x, found.bbox.center.position.y)
