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

from robsim.base.errors import FileError, InputError, said
from robsim.base.output import refused, write_whole
from robsim.page.document import document
from robsim.page.film import FORMAT, VERSION, Recording
from robsim.page.packing import unpacked
from robsim.page.recording import recording_of
from robsim.page.study_map import map_of
from robsim.run.experiment import Experiment
from robsim.studies.study import Study

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
    >>> recording = open_recording(export_html(run, "run.html"))
    >>> recording.header["title"], recording.arrays["time"].shape
    ("ViSP's tutorial case", (11,))
    """
    return write_whole(path, document(_shown(shown, experiment)))


def open_recording(path: str | os.PathLike[str]) -> Recording:
    """Return the recording in a page that `export_html` wrote.

    Numbers are float32; poses are rounded to 1/65535 of the range of each of their components.

    FileError: it cannot be read, or is no such page.
    """
    with refused(path, "read"):
        if Path(path).stat().st_size > LARGEST:
            raise FileError(f"{path}: larger than {LARGEST // 1_000_000} MB")
        text = Path(path).read_text(encoding="utf-8")
    try:
        header, arrays = unpacked(base64.b64decode(_recording(text)))
        if header["format"] != FORMAT:
            raise ValueError(f"it holds {said(header['format'])}, and not {FORMAT!r}")
        if header["version"] != VERSION:
            raise ValueError(f"version {said(header['version'])}, and this reads {VERSION}")
        return Recording(header, arrays)
    except (ValueError, LookupError, TypeError, AttributeError, zlib.error) as reason:
        raise FileError(f"{path}: not a page of RobSim: {reason}") from None


def show(shown: Any, experiment: Experiment | None = None) -> None:
    """Show a run, an experiment, a scene, a robot or a study: in the notebook, else in the browser.

    Without a browser, a line says where the page is. The map of a study shows the row of each run;
    the command `robsim studio FOLDER` simulates those that are clicked as well.
    """
    page = document(_shown(shown, experiment))
    if _in_notebook():
        notebook: Any = importlib.import_module("IPython.display")
        notebook.display({"text/html": framed(page)}, raw=True)
        return
    open_page(write_whole(Path(tempfile.mkdtemp(prefix="robsim-")) / "run.html", page))


def _shown(shown: Any, experiment: Experiment | None) -> Recording:
    """Return what a page shows of a value: the map of a study, or a recording."""
    if isinstance(shown, Study):
        return map_of(shown)
    return recording_of(shown, experiment)


def open_page(path: Path) -> None:
    """Open a page in the browser, if there is one, and say where it is."""
    if not opened(path.resolve().as_uri()):
        print(f"open {path} in a browser to see it", file=sys.stderr)


def opened(address: str) -> bool:
    """Open an address in the browser, if there is one a person would see; return whether."""
    return has_browser() and webbrowser.open(address)


def has_browser() -> bool:
    """Return whether a person at this machine would see a browser open."""
    remote = any(os.environ.get(name) for name in ("CI", "SSH_CONNECTION", "SSH_TTY"))
    windows = sys.platform in ("win32", "darwin")
    display = os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")
    return not remote and bool(windows or display)


def in_cell(shown: Any) -> str:
    """Return what a notebook shows of a value: the page, or a table where it has none."""
    try:
        return framed(document(recording_of(shown, trials=False)))
    except InputError:
        table = getattr(shown, "_repr_html_", None)
        return str(table()) if table else f"<pre>{escape(repr(shown))}</pre>"


def framed(page: str) -> str:
    """Return a page as an element of another one, such as a notebook."""
    return (
        f'<iframe srcdoc="{escape(page)}" width="100%" height="{HEIGHT}" sandbox="allow-scripts" '
        'style="border: 1px solid #ccc; border-radius: 6px"></iframe>'
    )


def _recording(text: str) -> str:
    found = re.search(_RECORDING, text, re.DOTALL)
    if not found:
        raise ValueError("it has no recording")
    return found[1]


def _in_notebook() -> bool:
    """Return whether this is a kernel of Jupyter."""
    shell = sys.modules.get("IPython")
    return shell is not None and type(shell.get_ipython()).__name__ == "ZMQInteractiveShell"
