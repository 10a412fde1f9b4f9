"""Files that a page can save: the experiment as TOML and as Python, and its run."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from robsim.base.errors import RobSimError
from robsim.files import examples
from robsim.files.netcdf import save_run
from robsim.page.html_document import build_html
from robsim.page.recordings import build_recording
from robsim.run.experiment import Experiment, load_scenario


def build_download(
    experiment: Experiment, changes: Mapping[str, Any], name: str
) -> tuple[str, bytes] | None:
    """Return media type and content of a file, or None if there is no such file.

    The files are experiment.toml, experiment.py, run.nc and run.html. The run is simulated from the
    start of the experiment, with all changes.
    """
    if name == "experiment.toml":
        return "application/toml", experiment.text.encode()
    if name == "experiment.py":
        return "text/x-python", format_python_code(experiment, changes).encode()
    if name == "run.nc":
        return "application/x-netcdf", _encode_netcdf(experiment)
    if name == "run.html":
        return "text/html", build_html(build_recording(experiment.run(), experiment)).encode()
    return None


def format_python_code(experiment: Experiment, changes: Mapping[str, Any]) -> str:
    """Return Python code that builds and runs the experiment.

    >>> from robsim import examples, load_scenario
    >>> experiment = load_scenario(examples.path("visp_tutorial")).at("task.gain", 2)
    >>> print(format_python_code(experiment, {"task.gain": 2}))
    import robsim as rs
    <BLANKLINE>
    experiment = rs.load_scenario(rs.examples.path('visp_tutorial'))
    experiment = experiment.at({'task.gain': 2})
    run = experiment.run()
    rs.show(run)
    <BLANKLINE>
    """
    building = _format_loading_code(experiment, changes)
    building = building or [
        f"experiment = rs.Experiment.from_text({_format_text_literal(experiment)})"
    ]
    lines = ["import robsim as rs", "", *building, "run = experiment.run()", "rs.show(run)", ""]
    return "\n".join(lines)


def _format_loading_code(experiment: Experiment, changes: Mapping[str, Any]) -> list[str]:
    """Return lines of code that load the experiment from its file; none if the file differs."""
    path = Path(experiment.source).resolve()
    try:
        loaded = load_scenario(path) if experiment.source else None
        if loaded is None or (loaded.at(changes) if changes else loaded) != experiment:
            return []
    except RobSimError:
        return []
    shipped = path.stem in examples.names() and path == Path(examples.path(path.stem)).resolve()
    location = f"rs.examples.path({path.stem!r})" if shipped else repr(str(path))
    change = [f"experiment = experiment.at({dict(changes)!r})"] if changes else []
    return [f"experiment = rs.load_scenario({location})", *change]


def _format_text_literal(experiment: Experiment) -> str:
    """Return the text of an experiment as a Python literal, one line of code for each line."""
    lines = experiment.text.splitlines(keepends=True)
    return "\n".join(["(", *(f"    {line!r}" for line in lines), ")"])


def _encode_netcdf(experiment: Experiment) -> bytes:
    """Return the run as the bytes of a NetCDF file."""
    with tempfile.TemporaryDirectory() as folder:
        return save_run(experiment.run(), Path(folder) / "run.nc").read_bytes()
