"""The marks in detection messages."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from math import isfinite

import numpy as np

from robsim.base.arrays import Array
from robsim.base.errors import FileError
from robsim.logs.bag_files import TimedMessage
from robsim.logs.mark_arrays import list_marks
from robsim.logs.message_types import Message, is_mark_array
from robsim.logs.name_map import Ids
from robsim.run.log import Stream
from robsim.servo.camera_target import PairKey
from robsim.vision.tags.detector_backends import convert_apriltag_corners
from robsim.vision.tags.tag import tag_name

PixelPosition = tuple[float, float]  # column and row in pixels


def read_mark_streams(
    what: str,
    detections: Iterable[TimedMessage],
    ids: Ids,
    sizes: Mapping[PairKey, int],
    others: dict[str, None],
) -> dict[PairKey, Stream]:
    """Return the pixels (n, N, 2) of the targets of a camera, NaN for marks that are not seen.

    Unknown ids of marks are added to `others`. FileError is raised if a mark occurs twice in a
    message.
    """
    messages = list(detections)
    values = [read_marks(what, each, ids, sizes, others) for each in messages]
    times = np.array([each.time for each in messages], dtype=np.int64)
    return {
        key: Stream(what, times, np.array([pixels[key] for pixels in values]).reshape(-1, count, 2))
        for key, count in sizes.items()
    }


def read_marks(
    what: str, each: TimedMessage, ids: Ids, sizes: Mapping[PairKey, int], others: dict[str, None]
) -> dict[PairKey, Array]:
    """Return the pixels (N, 2) of each target in a message; see `read_mark_streams`."""
    values = {key: np.full((count, 2), np.nan) for key, count in sizes.items()}
    seen_ids: set[str] = set()
    for name, pixel in _list_detections(each.message):
        if name in seen_ids:
            raise FileError(f"{what}: mark '{name}' occurs twice, {each.when}")
        seen_ids.add(name)
        if name not in ids:
            others[name] = None
        elif isfinite(pixel[0]) and isfinite(pixel[1]):
            key, number = ids[name]
            values[key][number] = pixel
    return values


def _list_detections(message: Message) -> Iterator[tuple[str, PixelPosition]]:
    """Yield the id and the pixel of each mark: the middle of a box, or a corner of an AprilTag."""
    if is_mark_array(message):
        yield from list_marks(message)
        return
    for detection in message.detections:
        if hasattr(detection, "corners"):
            corners = convert_apriltag_corners(
                np.array([[each.x, each.y] for each in detection.corners])
            )
            name = tag_name(detection.family, detection.id)
            yield from ((f"{name}.{i}", tuple(pixel)) for i, pixel in enumerate(corners.tolist()))
        else:
            name = detection.id or next(_class_ids(detection), "")
            yield name, (detection.bbox.center.position.x, detection.bbox.center.position.y)


def _class_ids(detection: Message) -> Iterator[str]:
    """Yield the class ids of the hypotheses of a detection."""
    for result in detection.results:
        yield result.hypothesis.class_id
