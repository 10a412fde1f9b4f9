"""What a page can save: the experiment as text and as Python, and its run."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from robsim.files.netcdf import save_run
from robsim.page.document import document
from robsim.page.recording import recording_of
from robsim.run.experiment import Experiment

NAMES = ("experiment.toml", "experiment.py", "run.nc", "run.html")


def made(experiment: Experiment, changes: Mapping[str, Any], name: str) -> tuple[str, bytes] | None:
    """Return media type and content of a file of one of `NAMES`; None for any other.

    What is saved of a run is that of the experiment as it is now, from its start.
    """
    if name == "experiment.toml":
        return "application/toml", experiment.text.encode()
    if name == "experiment.py":
        return "text/x-python", python_of(experiment, changes).encode()
    if name == "run.nc":
        return "application/x-netcdf", _saved(experiment)
    if name == "run.html":
        return "text/html", document(recording_of(experiment.run())).encode()
    return None


def python_of(experiment: Experiment, changes: Mapping[str, Any]) -> str:
    """Return Python code that makes and runs the experiment.

    >>> from robsim import examples, load_scenario
    >>> experiment = load_scenario(examples.path("visp_tutorial")).at("task.gain", 2)
    >>> print(python_of(experiment, {"task.gain": 2}))  # doctest: +ELLIPSIS
    import robsim as rs
    <BLANKLINE>
    experiment = rs.load_scenario(...)
    experiment = experiment.at({'task.gain': 2})
    run = experiment.run()
    rs.show(run)
    <BLANKLINE>
    """
    lines = ["import robsim as rs", "", _loaded(experiment)]
    if changes:
        lines.append(f"experiment = experiment.at({dict(changes)!r})")
    return "\n".join([*lines, "run = experiment.run()", "rs.show(run)", ""])


def _loaded(experiment: Experiment) -> str:
    path = Path(experiment.source)
    if experiment.source and path.is_file():
        from robsim.files import examples

        shipped = path.stem in examples.names() and path == examples.path(path.stem)
        where = f"rs.examples.path({path.stem!r})" if shipped else repr(str(path))
        return f"experiment = rs.load_scenario({where})"
    return f"experiment = rs.Experiment.from_text('''\n{experiment.text}''')"


def _saved(experiment: Experiment) -> bytes:
    with tempfile.TemporaryDirectory() as folder:
        return save_run(experiment.run(), Path(folder) / "run.nc").read_bytes()
