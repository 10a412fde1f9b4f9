"""The message with the rendered picture of a camera at an instant of the run.

A page requests {"picture": [camera, index, mode]}, with the name of a camera, the number of an
instant, and the mode "picture" or "difference". The message is {"type": "picture", camera, index,
mode, image}. The image is a PNG file as a data URL: the picture, or half of its difference from the
picture at the goal. It is null if the run has no such instant since its last change, or if the goal
has no pose. Requests of anything else are ignored.
"""

from __future__ import annotations

import threading
from collections import OrderedDict
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from robsim.page.camera_pictures import (
    PictureSource,
    draw_goal_picture,
    encode_picture,
    has_pictures,
    reduce_camera,
)
from robsim.plot.run_pictures import subtract_greys
from robsim.rendering.recent_values import RecentValues
from robsim.studio.control_values import is_json_integer
from robsim.studio.message_text import PART, encode_message
from robsim.world.scene_picture import CameraPictures

if TYPE_CHECKING:
    from robsim.studio.live_run import LiveRun
    from robsim.studio.workbench import Workbench

MODES = ("picture", "difference")
SIDES = (320, 240, 160, 120)  # of pictures, in pixels; the largest that a message can hold
MOST = 16  # waiting requests; a later one replaces the earliest
KEPT = 8  # cameras and scenes whose renderers are kept
LAST_PICTURE = 0.5  # seconds until a picture that has begun is abandoned at the end


@dataclass(frozen=True)
class PictureRequest:
    """A request for a picture of a camera at an instant, with its mode and its source."""

    camera: str
    index: int
    mode: str
    source: PictureSource | None


class LivePictures:
    """Thread that draws pictures on request, beside the simulation.

    `broadcast` sends a message to all pages. The thread of the simulation calls `request`, which
    does not wait for the picture.
    """

    def __init__(self, broadcast: Callable[[str], None]) -> None:
        self._broadcast = broadcast
        self._waiting: OrderedDict[tuple[str, int, str], PictureRequest] = OrderedDict()
        self._changed, self._over = threading.Condition(), False
        self._thread: threading.Thread | None = None
        self._recent: RecentValues[CameraPictures] = RecentValues(KEPT)
        self._sides: dict[str, int] = {}  # by camera

    def request(self, bench: Workbench | None, value: Any) -> None:
        """Draw a picture of the present run soon; ignore an invalid request."""
        request = _build_request(bench, value)
        if request is None:
            return
        with self._changed:
            self._waiting[request.camera, request.index, request.mode] = request
            while len(self._waiting) > MOST:
                self._waiting.popitem(last=False)
            if self._thread is None:
                self._thread = threading.Thread(target=self._work, name="robsim-pictures")
                self._thread.daemon = True
                self._thread.start()
            self._changed.notify()

    def close(self) -> None:
        """End the thread within half a second; a longer picture ends with the process."""
        with self._changed:
            self._over = True
            self._changed.notify()
        if self._thread is not None:
            self._thread.join(LAST_PICTURE)

    def _work(self) -> None:
        """Draw the waiting pictures in order, until the end."""
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._waiting or self._over)
                if self._over:
                    return
                _, request = self._waiting.popitem(last=False)
            image = None
            with suppress(Exception):  # such as an error in a user's shape: there is no picture
                image = self._draw(request)
            content = {"index": request.index, "mode": request.mode, "image": image}
            self._broadcast(encode_message("picture", camera=request.camera, **content))

    def _draw(self, request: PictureRequest) -> str | None:
        """Return the picture as a data URL of a message; None without an instant or a goal."""
        if request.source is None:
            return None
        largest = self._sides.get(request.camera, SIDES[0])
        for side in (each for each in SIDES if each <= largest):
            self._sides[request.camera] = side  # for the next pictures too
            grey = self._draw_grey(request.source, request, side)
            image = None if grey is None else encode_picture(grey)
            if image is None or len(image) < PART:
                break
        return image

    def _draw_grey(
        self, source: PictureSource, request: PictureRequest, side: int
    ) -> NDArray[np.uint8] | None:
        """Return the grey values (h, w), with sides of at most `side` pixels."""
        scene, last = source.scene, len(source.instants.q) - 1
        eye = reduce_camera(scene.camera(request.camera), side)
        key = id(scene), eye.name, side
        pictures = self._recent.find(key, scene, lambda: CameraPictures(scene, eye))
        picture = source.instants.take(pictures, last)
        if request.mode == "picture":
            return picture
        goal = draw_goal_picture(source, pictures)
        return None if goal is None else subtract_greys(picture.astype(float), goal)


def _build_request(bench: Workbench | None, value: Any) -> PictureRequest | None:
    """Return the request of a page; None if it is invalid."""
    if bench is None or bench.pair is None or not isinstance(value, list) or len(value) != 3:
        return None
    (camera, index, mode), live = value, bench.pair.live
    scene = live.experiment.scene
    if not any(each.name == camera for each in scene.cameras) or not has_pictures(scene, camera):
        return None
    if not is_json_integer(index) or index < 0 or mode not in MODES:
        return None
    return PictureRequest(camera, index, mode, _build_source(live, index))


def _build_source(live: LiveRun, index: int) -> PictureSource | None:
    """Return the last two instants up to number `index`.

    None before the last change, and if the run has been started over and is not there yet.
    """
    if index >= len(live.instants) or live.instants[index].time < live.start_time:
        return None
    instants = live.camera_instants(max(index - 1, 0), index + 1)
    return PictureSource(live.experiment.scene, instants, {}, live.find_goal_poses())
