"""Pages as files: export, loading, and display in a browser or a notebook."""

from __future__ import annotations

import base64
import importlib
import os
import re
import sys
import tempfile
import webbrowser
import zlib
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from robsim.base.arrays import Array
from robsim.base.atomic_files import check_suffix, write_whole
from robsim.base.errors import FileError, InputError, format_value
from robsim.base.file_content import read_bytes
from robsim.page.html_document import build_html
from robsim.page.recording_builder import FORMAT, VERSION, Recording
from robsim.page.recording_codec import unpack_recording
from robsim.page.recordings import build_recording
from robsim.page.study_map import build_study_map
from robsim.robot.robot import Robot
from robsim.run.experiment import Experiment
from robsim.run.mission_run import MissionRun
from robsim.studies.study_result import StudyResult
from robsim.world.scene import Scene

if TYPE_CHECKING:
    import xarray as xr

    Showable: TypeAlias = xr.Dataset | MissionRun | Experiment | Scene | Robot | StudyResult

LARGEST = 200_000_000  # largest size of a page that is loaded, bytes
HEIGHT = 560  # height of a page in a notebook, pixels
_RECORDING = r'<script type="text/plain" id="recording">(.*?)</script>'


def export_html(
    shown: Showable, path: str | os.PathLike[str], experiment: Experiment | None = None
) -> Path:
    """Write a run, an experiment, a scene, a robot or a study as one HTML file.

    The page shows the scene in 3-D, the camera images and the curves over time, with a slider. A
    study is shown as a map with a dot for each run. The file opens in any browser, without a server
    or a network. Equal runs give equal bytes.

    Parameters
    ----------
    shown : xarray.Dataset, MissionRun, Experiment, Scene, Robot or StudyResult
        Object to show: a single run, a mission, an experiment at its start, a scene or a robot at
        home, or a study.
    path : str or path-like
        File to write; its name ends in .html.
    experiment : Experiment, optional
        Experiment of the run. Required if the run does not store it, because the experiment
        contains Python code.

    Returns
    -------
    pathlib.Path
        Path of the page.

    Raises
    ------
    InputError
        If `shown` has several runs or another type, or if `experiment` is required.
    FileError
        If the name has another suffix, or the file cannot be written.

    Examples
    --------
    >>> from robsim import examples, load_scenario
    >>> run = load_scenario(examples.path("visp_tutorial")).run(duration=0.4)
    >>> recording = load_recording(export_html(run, "run.html"))
    >>> recording.header["title"], recording.arrays["time"].shape
    ("ViSP's tutorial case", (11,))
    """
    check_suffix(path, (".html", ".htm"), "a page")
    return write_whole(path, build_html(_build_shown_recording(shown, experiment)))


def load_recording(path: str | os.PathLike[str]) -> Recording:
    """Return the recording in a page that `export_html` wrote.

    The page stores numbers as float32, and the components of poses with a resolution of 1/65535 of
    their range.

    Parameters
    ----------
    path : str or path-like
        Page to read.

    Returns
    -------
    Recording
        Header and arrays of the page.

    Raises
    ------
    FileError
        If the file cannot be read, or is not a page of RobSim.

    Examples
    --------
    >>> from robsim import Robot
    >>> arm = Robot.from_dh([[0, 0, 1, 0]], name="arm")
    >>> load_recording(export_html(arm, "arm.html"))
    <Recording 'arm' of 1 instants>
    """
    data = read_bytes(path, "a page of export_html", LARGEST)
    try:
        text = data.decode()
        header, arrays = unpack_recording(base64.b64decode(_extract_recording(text)))
        if header["format"] != FORMAT:
            raise ValueError(f"its format is {format_value(header['format'])}, not {FORMAT!r}")
        if header["version"] != VERSION:
            raise ValueError(f"its version is {format_value(header['version'])}, not {VERSION}")
        return Recording(header, arrays)
    except (ValueError, LookupError, TypeError, AttributeError, zlib.error) as reason:
        raise FileError(f"{path}: not a page of RobSim: {reason}") from None


def show(shown: Showable, experiment: Experiment | None = None) -> None:
    """Show a run, an experiment, a scene, a robot or a study, in a notebook or in the browser.

    In a notebook the page appears below the cell. Otherwise it opens in the browser; without a
    browser the path of the page is printed. The map of a study shows the row of a run when its dot
    is clicked. The command `robsim studio FOLDER` opens a map that also simulates the run.

    Parameters
    ----------
    shown : xarray.Dataset, MissionRun, Experiment, Scene, Robot or StudyResult
        Object to show, as in `export_html`.
    experiment : Experiment, optional
        Experiment of the run, as in `export_html`.

    Raises
    ------
    InputError
        If `shown` has several runs or another type, or if `experiment` is required.

    Examples
    --------
    `export_html` writes the same page to a file:

    >>> from robsim import Robot, export_html
    >>> export_html(Robot.from_dh([[0, 0, 1, 0]], name="arm"), "arm.html").name
    'arm.html'
    """
    page = build_html(_build_shown_recording(shown, experiment))
    if _is_notebook():
        notebook: Any = importlib.import_module("IPython.display")
        notebook.display(_build_bundle(page, draw_still_picture(shown, experiment)), raw=True)
        return
    open_page_file(write_whole(Path(tempfile.mkdtemp(prefix="robsim-")) / "run.html", page))


def _build_shown_recording(shown: Showable, experiment: Experiment | None) -> Recording:
    """Return the recording of an object, or the map of a study."""
    if isinstance(shown, StudyResult):
        return build_study_map(shown)
    return build_recording(shown, experiment)


def open_page_file(path: Path) -> None:
    """Open a page in the browser; without a browser, print its path."""
    if not open_in_browser(path.resolve().as_uri()):
        print(f"open {path} in a browser", file=sys.stderr)


def open_in_browser(address: str) -> bool:
    """Open an address in the browser, and return whether a browser is available and opened it."""
    return has_browser() and webbrowser.open(address)


def has_browser() -> bool:
    """Return whether a user at this machine can see a browser window."""
    remote = any(os.environ.get(name) for name in ("CI", "SSH_CONNECTION", "SSH_TTY"))
    windows = sys.platform in ("win32", "darwin")
    display = os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")
    return not remote and bool(windows or display)


def build_notebook_bundle(shown: Showable) -> dict[str, str]:
    """Return the contents of a notebook cell by MIME type: HTML, and a picture as PNG in base64.

    The HTML of an experiment or a study is its table, and of other objects their page. A run
    without a page has its table, and no picture.
    """
    if isinstance(shown, Experiment | StudyResult):
        html = {"text/html": shown._repr_html_()}
        return html | _build_picture_entry(draw_still_picture(shown))
    try:
        page = build_html(build_recording(shown, trials=False))
    except InputError:
        table = getattr(shown, "_repr_html_", None)
        return {"text/html": str(table()) if table else f"<pre>{escape(repr(shown))}</pre>"}
    return _build_bundle(page, draw_still_picture(shown))


def draw_still_picture(shown: Showable, experiment: Experiment | None = None) -> bytes:
    """Return a picture of an object as PNG; empty if it cannot be drawn."""
    from robsim.plot.still_picture import draw_scene_still, draw_study_still

    try:
        if isinstance(shown, StudyResult):
            return draw_study_still(shown)
        return draw_scene_still(*_find_shown_scene(shown, experiment))
    except InputError:
        return b""


def _find_shown_scene(
    shown: Any, experiment: Experiment | None
) -> tuple[Scene, Array | None, xr.Dataset | None]:
    """Return the scene of an object, and its configuration or run."""
    if isinstance(shown, Robot):
        return Scene((shown,)), None, None
    if isinstance(shown, Scene):
        return shown, None, None
    if isinstance(shown, Experiment):
        q = None if shown.start is None else np.atleast_2d(shown.start)[0]
        return shown.scene, q, None
    if isinstance(shown, MissionRun):
        return shown.legs[-1].scene, None, shown.legs[-1].run
    return (experiment or Experiment.of(shown)).scene, None, shown


def _build_bundle(page: str, picture: bytes) -> dict[str, str]:
    """Return a page in front of its picture, and the picture."""
    entry = _build_picture_entry(picture)
    return {"text/html": embed_page(page, entry.get("image/png", ""))} | entry


def _build_picture_entry(picture: bytes) -> dict[str, str]:
    """Return the entry of a picture in a notebook cell, or none of an empty picture."""
    return {"image/png": base64.b64encode(picture).decode()} if picture else {}


def embed_page(page: str, picture: str = "") -> str:
    """Return a page as an iframe element, to embed it in another page.

    `picture` is a PNG in base64. The page covers it; it is visible on paper, and in viewers that
    remove the page.
    """
    frame = (
        f'<iframe srcdoc="{escape(page)}" width="100%" height="{HEIGHT}" sandbox="allow-scripts" '
        'style="border: 1px solid #ccc; border-radius: 6px"></iframe>'
    )
    if not picture:
        return frame
    cover = frame.replace('style="', 'style="position: absolute; inset: 0; background: #fff; ', 1)
    return (
        "<style>@media print { .robsim-page iframe { display: none } }</style>"
        f'<div class="robsim-page" style="position: relative; min-height: {HEIGHT + 4}px">'
        f'<img alt="still of the page" src="data:image/png;base64,{picture}">{cover}</div>'
    )


def _extract_recording(text: str) -> str:
    """Return the encoded recording of a page."""
    match = re.search(_RECORDING, text, re.DOTALL)
    if not match:
        raise ValueError("it has no recording")
    return match[1]


def _is_notebook() -> bool:
    """Return whether the process is a Jupyter kernel."""
    shell = sys.modules.get("IPython")
    return shell is not None and type(shell.get_ipython()).__name__ == "ZMQInteractiveShell"
