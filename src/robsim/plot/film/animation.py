"""Films of runs and missions, written to files."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from robsim.base.arrays import as_positive
from robsim.base.atomic_files import convert_os_errors, write_whole
from robsim.base.errors import FileError, InputError, format_value
from robsim.engine.workers import Progress, check_progress
from robsim.plot.canvas import parse_figure_size
from robsim.plot.film import gif, mp4
from robsim.plot.film.camera_frames import CameraFrames
from robsim.plot.film.film_frames import FilmFrames, Frame
from robsim.plot.film.film_source import build_film_source
from robsim.plot.film.frame_times import choose_frame_times
from robsim.plot.goal_outlines import DrawableGoal
from robsim.run.experiment import Experiment
from robsim.run.mission_run import MissionRun

if TYPE_CHECKING:
    import xarray as xr

SIZE, DPI, FPS = (12.8, 7.2), 100.0, 20.0
SMALLEST, LARGEST = 64, 4096  # side of a frame, pixels
SLOWEST, QUICKEST = 0.1, 240.0  # frames per second
PAUSE = 1.5  # duration of the last frame, seconds
KINDS = (".gif", ".mp4")


def save_film(
    run: xr.Dataset | MissionRun,
    path: str | os.PathLike[str],
    experiment: Experiment | None = None,
    *,
    camera: str | None = None,
    fps: float = FPS,
    speed: float | None = None,
    size: tuple[float, float] = SIZE,
    dpi: float = DPI,
    view: tuple[float, float] | None = None,
    goal: DrawableGoal | None = None,
    title: str | None = None,
    progress: Progress | None = None,
) -> Path:
    """Write a film of a run or a mission as GIF or MP4: scene, images and curves in step.

    All frames have the same axes, view and ground. Each frame shows the recorded instant nearest to
    its time, and the last frame stays for 1.5 s. A GIF repeats forever. An MP4 requires PyAV: pip
    install 'robsim[film]'. Films need no display.

    Parameters
    ----------
    run : xarray.Dataset or MissionRun
        A single run, or a mission.
    path : str or path-like
        File to write; its name must end in .gif or .mp4.
    experiment : Experiment, optional
        Experiment of the run. Required if the run does not store it, because the experiment
        contains Python code.
    camera : str, optional
        Name of a camera. The film then shows its pictures, drawn again from the run, in pixels of
        the camera, and `size`, `dpi`, `view`, `goal` and `title` have no effect.
    fps : float, default 20
        Frames per second of the film, 0.1 to 240, and at most 50 in a GIF.
    speed : float, optional
        Seconds of the run in one second of the film. Default: 1, or the smallest integer that
        keeps the film within one minute.
    size : (float, float), default (12.8, 7.2)
        Width and height of the film in inches.
    dpi : float, default 100
        Pixels per inch; by default the film has 1280 x 720 pixels.
    view : (float, float), optional
        Elevation and azimuth of the viewing direction in degrees, as in `plot.scene`.
    goal : array_like of shape (nq,), Pose, ServoTask or the goal of a task, optional
        Goal to draw as an outline, as in `plot.scene`. Default: the goal of the run.
    title : str, optional
        Title of the film. Default: the title of the experiment.
    progress : callable, optional
        Function that is called after each frame with the completed share of the film, 0 to 1.

    Returns
    -------
    pathlib.Path
        Path of the film.

    Raises
    ------
    InputError
        If the run cannot be filmed, or an option is invalid.
    FileError
        If the film cannot be written. An existing file is then unchanged, as after an interrupt.

    Examples
    --------
    >>> from robsim import examples, load_scenario
    >>> run = load_scenario(examples.path("visp_tutorial")).run(duration=0.4)
    >>> save_film(run, "run.gif", fps=5).stat().st_size > 10_000
    True
    """
    kind = check_film_path(path)
    check_progress(progress)
    rate, dots = _parse_frame_rate(fps, kind), as_positive(dpi, "dpi")
    inches = _round_to_even_pixels(parse_figure_size(size), dots)
    source = build_film_source(run, experiment)
    clock = choose_frame_times(source.time, rate, speed)
    film: FilmFrames | CameraFrames
    if camera is not None:
        film = CameraFrames(source, clock, camera)
    else:
        film = FilmFrames(source, clock, inches, dots, view=view, goal=goal, title=title)
    frames = _report_progress_of_frames(film, progress)
    if kind == ".mp4":
        return write_whole(path, mp4.encode_mp4(frames, rate, PAUSE))
    some = [film[k] for k in np.unique(np.linspace(0, len(film) - 1, 4).astype(int))]
    return write_whole(path, gif.encode_gif(frames, len(film), some, rate, PAUSE))


def check_film_path(path: str | os.PathLike[str]) -> str:
    """Return the suffix of a path, ".gif" or ".mp4".

    Raise InputError for other suffixes, and for an MP4 if PyAV is missing. Raise FileError if the
    path is a folder.
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


def _parse_frame_rate(fps: float, kind: str) -> float:
    """Return the frame rate; raise InputError unless the format supports it."""
    rate, most = as_positive(fps, "fps"), gif.FASTEST if kind == ".gif" else QUICKEST
    if not SLOWEST <= rate <= most:
        raise InputError(f"fps: a {kind} has {SLOWEST:g} to {most:g} frames a second, got {rate:g}")
    return rate


def _round_to_even_pixels(size: tuple[float, float], dpi: float) -> tuple[float, float]:
    """Return the size in inches rounded to even numbers of pixels, which an MP4 requires.

    Raise InputError if a side is too short or too long.
    """
    width, height = (2 * round(side * dpi / 2) for side in size)
    if not SMALLEST <= min(width, height) <= max(width, height) <= LARGEST:
        raise InputError(
            f"size and dpi: expected {SMALLEST} to {LARGEST} pixels a side, "
            f"got {size[0] * dpi:.6g} x {size[1] * dpi:.6g}"
        )
    return width / dpi, height / dpi


def _report_progress_of_frames(
    film: FilmFrames | CameraFrames, progress: Progress | None
) -> Iterator[Frame]:
    """Yield the frames, and report the completed share after each frame."""
    for k in range(len(film)):
        yield film[k]
        if progress:
            progress((k + 1) / len(film))
