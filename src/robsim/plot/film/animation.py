"""Films of runs and missions, as files."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from robsim.base.arrays import as_positive
from robsim.base.atomic_files import convert_os_errors, write_whole
from robsim.base.errors import FileError, InputError, format_value
from robsim.engine.workers import Progress, check_progress
from robsim.plot.canvas import parse_figure_size
from robsim.plot.film import gif, mp4
from robsim.plot.film.film_frames import FilmFrames, Frame
from robsim.plot.film.film_source import build_film_source
from robsim.plot.film.frame_times import choose_frame_times
from robsim.run.experiment import Experiment

SIZE, DPI, FPS = (12.8, 7.2), 100.0, 20.0
SMALLEST, LARGEST = 64, 4096  # pixels, of a side
SLOWEST, QUICKEST = 0.1, 240.0  # frames per second
PAUSE = 1.5  # seconds, for which the last frame stays
KINDS = (".gif", ".mp4")


def save_film(
    run: Any,
    path: str | os.PathLike[str],
    experiment: Experiment | None = None,
    *,
    fps: float = FPS,
    speed: float | None = None,
    size: Any = SIZE,
    dpi: float = DPI,
    view: Any = None,
    goal: Any = None,
    title: str | None = None,
    progress: Progress | None = None,
) -> Path:
    """Write a film of a run or a mission, as GIF or MP4: scene, images and curves in step.

    All frames have the same axes, view and ground. A frame shows the recorded instant that is
    nearest to its time, and the last one stays for 1.5 s; a GIF repeats for ever. No display is
    needed; an MP4 needs PyAV: pip install 'robsim[film]'.

    path        ends in .gif or .mp4
    experiment  of a run whose experiment is Python code, which has no text
    fps         frames per second of the film; at most 50 in a GIF
    speed       seconds of the run in a second of the film; None: 1, or as many whole ones as bring
                the film down to a minute
    size, dpi   (width, height) in inches, and pixels per inch: 1280 x 720 pixels by default
    view, goal  as in `plot.scene`
    title       instead of that of the experiment
    progress    called after each frame with the share that is done, 0 to 1

    InputError: something that cannot be filmed, or not so. FileError: it cannot be written; what
    was there stays, and so it does when the film is stopped.

    >>> from robsim import examples, load_scenario
    >>> run = load_scenario(examples.path("visp_tutorial")).run(duration=0.4)
    >>> save_film(run, "run.gif", fps=5).stat().st_size > 10_000
    True
    """
    kind = check_film_path(path)
    check_progress(progress)
    rate, dots = _parse_frame_rate(fps, kind), as_positive(dpi, "dpi")
    inches, footage = (
        _round_to_even_pixels(parse_figure_size(size), dots),
        build_film_source(run, experiment),
    )
    ticks = choose_frame_times(footage.time, rate, speed)
    screen = FilmFrames(footage, ticks, inches, dots, view=view, goal=goal, title=title)
    frames = _report_progress_of_frames(screen, progress)
    if kind == ".mp4":
        return write_whole(path, mp4.encode_mp4(frames, rate, PAUSE))
    some = [screen[k] for k in np.unique(np.linspace(0, len(screen) - 1, 4).astype(int))]
    return write_whole(path, gif.encode_gif(frames, len(screen), some, rate, PAUSE))


def check_film_path(path: str | os.PathLike[str]) -> str:
    """Return ".gif" or ".mp4", by the end of a path.

    InputError: another end, or an MP4 without PyAV. FileError: there is a folder of that name.
    """
    with convert_os_errors(path):
        kind = Path(path).suffix.lower()
        if Path(path).is_dir():
            raise FileError(f"cannot write {path}: it is a folder")
    if kind not in KINDS:
        raise InputError(f"path: a film ends in {' or '.join(KINDS)}, got {format_value(path)}")
    if kind == ".mp4":
        mp4.check_pyav()
    return kind


def _parse_frame_rate(fps: Any, kind: str) -> float:
    rate, most = as_positive(fps, "fps"), gif.FASTEST if kind == ".gif" else QUICKEST
    if not SLOWEST <= rate <= most:
        raise InputError(f"fps: a {kind} has {SLOWEST:g} to {most:g} frames a second, got {rate:g}")
    return rate


def _round_to_even_pixels(size: tuple[float, float], dpi: float) -> tuple[float, float]:
    """Return the size in inches whose sides are even numbers of pixels, as an MP4 needs them.

    InputError: a side that is too short or too long.
    """
    width, height = (2 * round(side * dpi / 2) for side in size)
    if not SMALLEST <= min(width, height) <= max(width, height) <= LARGEST:
        raise InputError(
            f"size and dpi: expected {SMALLEST} to {LARGEST} pixels a side, "
            f"got {size[0] * dpi:.6g} x {size[1] * dpi:.6g}"
        )
    return width / dpi, height / dpi


def _report_progress_of_frames(screen: FilmFrames, progress: Progress | None) -> Iterator[Frame]:
    """Yield the frames, and say after each which share is done."""
    for k in range(len(screen)):
        yield screen[k]
        if progress:
            progress((k + 1) / len(screen))
