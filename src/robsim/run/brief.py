"""The text of an experiment as short as a person writes it."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any

from robsim.base.errors import FileWarning, InputError
from robsim.declare.brief import shortest
from robsim.files.layout import laid_out
from robsim.files.library import read_origin
from robsim.files.toml import Tables, parse
from robsim.run.text import read_experiment, write_experiment


def brief_text(experiment: Any, folder: Path) -> str | None:
    """Return a text that is read as an experiment in a file of a folder; None if there is none."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FileWarning)  # of files that were read before
        study = {} if experiment.study is None else {"study": experiment.study}
        text = laid_out(shortest({**brief_tables(experiment, folder), **study}))
        return text if _says(text, experiment, folder) else None


def brief_tables(experiment: Any, folder: Path) -> Tables:
    """Return the tables of an experiment without what need not be said in a file of a folder."""

    def origin(robot: Any) -> Any:
        return read_origin(robot, folder)

    return write_experiment(experiment, brief=True, short=True, read_origin=origin)


def _says(text: str, experiment: Any, folder: Path) -> bool:
    """Return whether a text is read as an experiment, to the last bit."""
    try:
        source = str(folder / "brief.toml")
        again = type(experiment)(**read_experiment(parse(text, source), source))
    except InputError:
        return False
    return bool(write_experiment(again) == write_experiment(experiment))
