"""Films as MP4, encoded by PyAV."""

from __future__ import annotations

import importlib
from collections.abc import Iterable, Iterator
from fractions import Fraction
from importlib.util import find_spec
from io import BytesIO
from itertools import repeat
from typing import Any

from robsim.base.errors import InputError
from robsim.plot.film.film_frames import Frame

QUALITY = "20"  # constant rate factor of H.264: 0 is lossless, 51 the worst


def check_pyav() -> None:
    """Raise InputError if PyAV is missing."""
    if find_spec("av") is None:
        raise InputError(
            "an MP4 needs PyAV, which is not installed: pip install 'robsim[film]'; "
            "a GIF (--gif, or a name that ends in .gif) does not need it"
        )


def encode_mp4(frames: Iterable[Frame], fps: float, pause: float) -> bytes:
    """Return an MP4 (H.264) that shows its last frame for `pause` additional seconds.

    Height and width of the frames must be even.
    """
    av: Any = importlib.import_module("av")
    file = BytesIO()
    with av.open(file, "w", format="mp4") as film:
        stream: Any = None
        for frame in _repeat_last_frame(frames, round(pause * fps)):
            stream = stream or _add_video_stream(film, frame, fps)
            film.mux(stream.encode(av.VideoFrame.from_ndarray(frame, format="rgba")))
        film.mux(stream.encode())
    return file.getvalue()


def _repeat_last_frame(frames: Iterable[Frame], more: int) -> Iterator[Frame]:
    """Yield the frames, then the last frame `more` times."""
    for frame in frames:
        yield frame
    yield from repeat(frame, more)


def _add_video_stream(film: Any, frame: Frame, fps: float) -> Any:
    """Return a new video stream of the size of a frame."""
    stream = film.add_stream("h264", rate=Fraction(fps).limit_denominator(1000))
    stream.height, stream.width = frame.shape[:2]
    stream.pix_fmt = "yuv420p"  # supported by all players
    stream.options = {"crf": QUALITY}
    return stream
