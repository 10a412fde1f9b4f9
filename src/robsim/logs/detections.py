"""The marks that messages of detections hold."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import Any

import numpy as np

from robsim.base.arrays import Array
from robsim.base.errors import FileError
from robsim.logs.bag_files import TimedMessage
from robsim.logs.name_map import Ids
from robsim.run.log import Stream
from robsim.servo.camera_target import PairKey
from robsim.vision.tags.detector_backends import convert_apriltag_corners
from robsim.vision.tags.tag import tag_name

PixelPosition = tuple[float, float]  # column and row in pixels


def read_mark_streams(
    what: str,
    found: Iterable[TimedMessage],
    ids: Ids,
    sizes: Mapping[PairKey, int],
    others: dict[str, None],
) -> dict[PairKey, Stream]:
    """Return the pixels (n, N, 2) of the targets of a camera, NaN for a mark that is not seen.

    `others` collects marks of which nothing is known. FileError: a mark is there twice.
    """
    every = list(found)
    values = [read_marks(what, each, ids, sizes, others) for each in every]
    times = np.array([each.time for each in every], dtype=np.int64)
    return {
        key: Stream(what, times, np.array([one[key] for one in values]).reshape(-1, count, 2))
        for key, count in sizes.items()
    }


def read_marks(
    what: str, each: TimedMessage, ids: Ids, sizes: Mapping[PairKey, int], others: dict[str, None]
) -> dict[PairKey, Array]:
    """Return the pixels (N, 2) of each target in a message."""
    values = {key: np.full((count, 2), np.nan) for key, count in sizes.items()}
    before: set[str] = set()
    for name, place in _list_detections(each.message):
        if name in before:
            raise FileError(f"{what}: mark '{name}' is there twice, {each.said}")
        before.add(name)
        if name not in ids:
            others[name] = None
        elif np.isfinite(place).all():
            key, number = ids[name]
            values[key][number] = place
    return values


def _list_detections(message: Any) -> Iterator[tuple[str, PixelPosition]]:
    """Yield the name and the place of each mark: of boxes the middle, of AprilTags the corners."""
    for found in message.detections:
        if hasattr(found, "corners"):
            corners = convert_apriltag_corners(
                np.array([[each.x, each.y] for each in found.corners])
            )
            name = tag_name(found.family, found.id)
            yield from ((f"{name}.{i}", tuple(place)) for i, place in enumerate(corners.tolist()))
        else:
            name = found.id or next((one.hypothesis.class_id for one in found.results), "")
            yield name, (found.bbox.center.position.x, found.bbox.center.position.y)
