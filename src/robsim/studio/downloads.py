"""What a page can save: the experiment as text and as Python, and its run."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from robsim.base.errors import RobSimError
from robsim.files import examples
from robsim.files.netcdf import save_run
from robsim.page.document import document
from robsim.page.recording import recording_of
from robsim.run.experiment import Experiment, load_scenario


def made(experiment: Experiment, changes: Mapping[str, Any], name: str) -> tuple[str, bytes] | None:
    """Return media type and content of a file that can be saved; None where there is no such file.

    There are experiment.toml, experiment.py, run.nc and run.html. What is saved of a run is that of
    the experiment as it is now, from its start.
    """
    if name == "experiment.toml":
        return "application/toml", experiment.text.encode()
    if name == "experiment.py":
        return "text/x-python", python_of(experiment, changes).encode()
    if name == "run.nc":
        return "application/x-netcdf", _saved(experiment)
    if name == "run.html":
        return "text/html", document(recording_of(experiment.run(), experiment)).encode()
    return None


def python_of(experiment: Experiment, changes: Mapping[str, Any]) -> str:
    """Return Python code that makes and runs the experiment.

    >>> from robsim import examples, load_scenario
    >>> experiment = load_scenario(examples.path("visp_tutorial")).at("task.gain", 2)
    >>> print(python_of(experiment, {"task.gain": 2}))
    import robsim as rs
    <BLANKLINE>
    experiment = rs.load_scenario(rs.examples.path('visp_tutorial'))
    experiment = experiment.at({'task.gain': 2})
    run = experiment.run()
    rs.show(run)
    <BLANKLINE>
    """
    made = _loaded(experiment, changes)
    made = made or [f"experiment = rs.Experiment.from_text({_text(experiment)})"]
    lines = ["import robsim as rs", "", *made, "run = experiment.run()", "rs.show(run)", ""]
    return "\n".join(lines)


def _loaded(experiment: Experiment, changes: Mapping[str, Any]) -> list[str]:
    """Return lines that load the experiment from its file, if that has it."""
    path = Path(experiment.source).resolve()
    try:
        read = load_scenario(path) if experiment.source else None
        if read is None or (read.at(changes) if changes else read) != experiment:
            return []
    except RobSimError:
        return []
    shipped = path.stem in examples.names() and path == Path(examples.path(path.stem)).resolve()
    where = f"rs.examples.path({path.stem!r})" if shipped else repr(str(path))
    changed = [f"experiment = experiment.at({dict(changes)!r})"] if changes else []
    return [f"experiment = rs.load_scenario({where})", *changed]


def _text(experiment: Experiment) -> str:
    """Return a literal of the text, a line of code for each line."""
    lines = experiment.text.splitlines(keepends=True)
    return "\n".join(["(", *(f"    {line!r}" for line in lines), ")"])


def _saved(experiment: Experiment) -> bytes:
    with tempfile.TemporaryDirectory() as folder:
        return save_run(experiment.run(), Path(folder) / "run.nc").read_bytes()
