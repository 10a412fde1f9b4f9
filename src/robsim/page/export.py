"""Pages as files, read back as recordings, and shown where a person looks."""

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
from typing import Any

from robsim.base.atomic_files import convert_os_errors, write_whole
from robsim.base.errors import FileError, InputError, format_value
from robsim.page.html_document import build_html
from robsim.page.recording_builder import FORMAT, VERSION, Recording
from robsim.page.recording_codec import unpack_recording
from robsim.page.recordings import build_recording
from robsim.page.study_map import build_study_map
from robsim.run.experiment import Experiment
from robsim.studies.study_result import StudyResult

LARGEST = 200_000_000  # bytes of a page that is read back
HEIGHT = 560  # pixels, of a page in a notebook
_RECORDING = r'<script type="text/plain" id="recording">(.*?)</script>'


def export_html(
    shown: Any, path: str | os.PathLike[str], experiment: Experiment | None = None
) -> Path:
    """Write a page that shows a run, an experiment, a scene, a robot or a study, as one HTML file.

    It opens in any browser, from a mail or a slide, and needs neither a server nor a network. The
    same run gives the same bytes.

    experiment  of a run whose experiment is Python code, which has no text

    InputError: several runs, or nothing that can be shown. FileError: it cannot be written.

    >>> from robsim import examples, load_scenario
    >>> run = load_scenario(examples.path("visp_tutorial")).run(duration=0.4)
    >>> recording = load_recording(export_html(run, "run.html"))
    >>> recording.header["title"], recording.arrays["time"].shape
    ("ViSP's tutorial case", (11,))
    """
    return write_whole(path, build_html(_build_shown_recording(shown, experiment)))


def load_recording(path: str | os.PathLike[str]) -> Recording:
    """Return the recording in a page that `export_html` wrote.

    Numbers are float32; poses are rounded to 1/65535 of the range of each of their components.

    FileError: it cannot be read, or is no such page.
    """
    with convert_os_errors(path, "read"):
        if Path(path).stat().st_size > LARGEST:
            raise FileError(f"{path}: larger than {LARGEST // 1_000_000} MB")
        text = Path(path).read_text(encoding="utf-8")
    try:
        header, arrays = unpack_recording(base64.b64decode(_extract_recording(text)))
        if header["format"] != FORMAT:
            raise ValueError(f"it holds {format_value(header['format'])}, and not {FORMAT!r}")
        if header["version"] != VERSION:
            raise ValueError(f"version {format_value(header['version'])}, and this reads {VERSION}")
        return Recording(header, arrays)
    except (ValueError, LookupError, TypeError, AttributeError, zlib.error) as reason:
        raise FileError(f"{path}: not a page of RobSim: {reason}") from None


def show(shown: Any, experiment: Experiment | None = None) -> None:
    """Show a run, an experiment, a scene, a robot or a study: in the notebook, else in the browser.

    Without a browser, a line says where the page is. The map of a study shows the row of each run;
    the command `robsim studio FOLDER` simulates those that are clicked as well.
    """
    page = build_html(_build_shown_recording(shown, experiment))
    if _is_notebook():
        notebook: Any = importlib.import_module("IPython.display")
        notebook.display({"text/html": embed_page(page)}, raw=True)
        return
    open_page_file(write_whole(Path(tempfile.mkdtemp(prefix="robsim-")) / "run.html", page))


def _build_shown_recording(shown: Any, experiment: Experiment | None) -> Recording:
    """Return what a page shows of a value: the map of a study, or a recording."""
    if isinstance(shown, StudyResult):
        return build_study_map(shown)
    return build_recording(shown, experiment)


def open_page_file(path: Path) -> None:
    """Open a page in the browser, if there is one, and say where it is."""
    if not open_in_browser(path.resolve().as_uri()):
        print(f"open {path} in a browser to see it", file=sys.stderr)


def open_in_browser(address: str) -> bool:
    """Open an address in the browser, if there is one a person would see; return whether."""
    return has_browser() and webbrowser.open(address)


def has_browser() -> bool:
    """Return whether a person at this machine would see a browser open."""
    remote = any(os.environ.get(name) for name in ("CI", "SSH_CONNECTION", "SSH_TTY"))
    windows = sys.platform in ("win32", "darwin")
    display = os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")
    return not remote and bool(windows or display)


def render_notebook_cell(shown: Any) -> str:
    """Return what a notebook shows of a value: the page, or a table where it has none."""
    try:
        return embed_page(build_html(build_recording(shown, trials=False)))
    except InputError:
        table = getattr(shown, "_repr_html_", None)
        return str(table()) if table else f"<pre>{escape(repr(shown))}</pre>"


def embed_page(page: str) -> str:
    """Return a page as an element of another one, such as a notebook."""
    return (
        f'<iframe srcdoc="{escape(page)}" width="100%" height="{HEIGHT}" sandbox="allow-scripts" '
        'style="border: 1px solid #ccc; border-radius: 6px"></iframe>'
    )


def _extract_recording(text: str) -> str:
    found = re.search(_RECORDING, text, re.DOTALL)
    if not found:
        raise ValueError("it has no recording")
    return found[1]


def _is_notebook() -> bool:
    """Return whether this is a kernel of Jupyter."""
    shell = sys.modules.get("IPython")
    return shell is not None and type(shell.get_ipython()).__name__ == "ZMQInteractiveShell"
