"""Files that a page can save: the experiment as TOML and as Python, its run, and a film."""

from __future__ import annotations

import importlib.util
import re
import tempfile
import unicodedata
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from robsim.base.errors import InputError
from robsim.files.netcdf import save_run
from robsim.page.html_document import build_html
from robsim.page.recording_builder import Recording
from robsim.plot.film.animation import save_film
from robsim.run.experiment import Experiment
from robsim.run.mission_run import MissionRun
from robsim.studio.python_code import format_change_remark, format_python_code

if TYPE_CHECKING:
    import xarray as xr

LONGEST_STEM = 48  # characters of a file name
FILM_FRAMES = 36  # a film is ready within some ten seconds
FILM_SECONDS = 6.0  # longest film; a longer run is shown faster
FILM_DPI = 75  # 960 x 540 pixels
MEDIA = {
    "toml": "application/toml",
    "py": "text/x-python",
    "nc": "application/x-netcdf",
    "html": "text/html",
    "mp4": "video/mp4",
    "gif": "image/gif",
}


def build_download(
    experiment: Experiment, get_recording: Callable[[], Recording], name: str
) -> tuple[str, bytes] | None:
    """Return media type and content of a file, or None if there is no such file.

    Parameters
    ----------
    experiment : Experiment
        Experiment of the files "experiment.toml", "experiment.py", "run.nc", "film.mp4" and
        "film.gif". The run is simulated from its start.
    get_recording : callable
        Function that returns the recording of the file "run.html".
    name : str
        Name of the file.

    Raises
    ------
    InputError
        If the experiment has no such file.
    """
    builders: dict[str, Callable[[], bytes]] = {
        "experiment.toml": lambda: format_saved_scenario(experiment).encode(),
        "experiment.py": lambda: format_python_code(experiment).encode(),
        "run.nc": lambda: _encode_netcdf(experiment),
        "run.html": lambda: build_html(get_recording()).encode(),
        "film.mp4": lambda: _encode_film(experiment, "mp4"),
        "film.gif": lambda: _encode_film(experiment, "gif"),
    }
    return (MEDIA[name.rpartition(".")[2]], builders[name]()) if name in builders else None


def format_file_name(experiment: Experiment | None, name: str) -> str:
    """Return the name under which a browser stores a file: it begins with the experiment.

    >>> from robsim import examples, load_scenario
    >>> experiment = load_scenario(examples.path("eye_in_hand"))
    >>> format_file_name(experiment, "experiment.toml"), format_file_name(experiment, "run.html")
    ('eye_in_hand.toml', 'eye_in_hand-run.html')
    """
    if experiment is None:
        return name
    stem, _, ending = name.rpartition(".")
    part = {"experiment": "", "film": ""}.get(stem, f"-{stem}")
    own = Path(experiment.source).stem if experiment.source.endswith(".toml") else ""
    return f"{make_slug(own or experiment.title or 'experiment')}{part}.{ending}"


def make_slug(text: str) -> str:
    """Return a text in small letters, digits, dashes and underscores, as part of a file name."""
    plain = unicodedata.normalize("NFKD", text).encode("ascii", "ignore").decode().lower()
    words = re.sub(r"[^a-z0-9_]+", "-", plain)[:LONGEST_STEM].strip("-")
    return words or "experiment"


def format_saved_scenario(experiment: Experiment) -> str:
    """Return the scenario file of an experiment, with a remark on its changes at the head."""
    return format_change_remark(experiment) + experiment.to_toml()


def _encode_netcdf(experiment: Experiment) -> bytes:
    """Return the run as the bytes of a NetCDF file."""
    with tempfile.TemporaryDirectory() as folder:
        return save_run(experiment.run(), Path(folder) / "run.nc").read_bytes()


def _encode_film(experiment: Experiment, kind: str) -> bytes:
    """Return the film of a run; InputError if this installation cannot make it."""
    if kind == "mp4" and importlib.util.find_spec("av") is None:
        raise InputError("film.mp4 needs PyAV: pip install 'robsim[film]'; film.gif does not")
    run = experiment.run()
    pace: Any = _compute_film_pace(_get_duration(run))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"film.{kind}"
        return save_film(run, path, experiment, dpi=FILM_DPI, **pace).read_bytes()


def _get_duration(run: xr.Dataset | MissionRun) -> float:
    """Return the simulated time of a run, or of all legs of a mission, in seconds."""
    return run.legs[-1].end if isinstance(run, MissionRun) else float(run["end_time"])


def _compute_film_pace(duration: float) -> dict[str, float]:
    """Return speed and frame rate of a film with at most `FILM_FRAMES` moving frames."""
    length = min(max(duration, 0.5), FILM_SECONDS)
    return {"speed": max(duration / length, 1.0), "fps": min(FILM_FRAMES / length, 20.0)}
