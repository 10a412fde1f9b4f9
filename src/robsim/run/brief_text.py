"""The short text of an experiment, as a person would write it."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any

from robsim.base.errors import FileWarning, InputError
from robsim.declare.short_numbers import shorten_numbers
from robsim.files.robot_library import describe_origin
from robsim.files.toml import Tables, parse_toml
from robsim.files.toml_layout import format_toml
from robsim.run.experiment_text import read_experiment, write_experiment


def write_brief_text(experiment: Any, folder: Path) -> str | None:
    """Return a short text of an experiment for a file of a folder.

    Return None if no short text reproduces the experiment exactly.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FileWarning)  # issued when the files were first read
        study = {} if experiment.study is None else {"study": experiment.study}
        tables = shorten_numbers({**make_brief_tables(experiment, folder), **study})
        text = format_toml({key: tables[key] for key in sorted(tables, key="title".__ne__)})
        return text if _is_text_of(text, experiment, folder) else None


def make_brief_tables(experiment: Any, folder: Path) -> Tables:
    """Return the tables of an experiment for a file of a folder, without defaults."""

    def origin(robot: Any) -> Any:
        return describe_origin(robot, folder)

    return write_experiment(experiment, brief=True, short=True, read_origin=origin, folder=folder)


def _is_text_of(text: str, experiment: Any, folder: Path) -> bool:
    """Return whether reading a text reproduces an experiment to the last bit."""
    try:
        source, make = str(folder / "brief.toml"), type(experiment)
        again = make(**read_experiment(parse_toml(text, source), source, known=experiment))
    except InputError:
        return False
    return bool(write_experiment(again) == write_experiment(experiment))
