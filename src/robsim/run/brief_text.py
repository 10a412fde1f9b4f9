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
from robsim.geometry.grey_picture import GreyPicture
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


def find_text_pictures(experiment: Any, folder: Path) -> list[GreyPicture]:
    """Return the pictures without a file that a text of an experiment can name."""
    found: dict[str, GreyPicture] = {}
    make_brief_tables(experiment, folder, found)
    return list(found.values())


def make_brief_tables(
    experiment: Any, folder: Path, pictures: dict[str, GreyPicture] | None = None
) -> Tables:
    """Return the tables of an experiment for a file of a folder, without defaults.

    The pictures that they name by their digests are added to `pictures`.
    """

    def origin(robot: Any) -> Any:
        return describe_origin(robot, folder)

    facts = {"brief": True, "short": True, "read_origin": origin, "folder": folder}
    return write_experiment(experiment, **facts, pictures={} if pictures is None else pictures)


def _is_text_of(text: str, experiment: Any, folder: Path) -> bool:
    """Return whether reading a text reproduces an experiment to the last bit."""
    try:
        source = str(folder / "brief.toml")
        tables = parse_toml(text, source)
        fields = read_experiment(tables, source, pictures=experiment.pictures)
        again = type(experiment)(**fields)
    except InputError:
        return False
    return bool(write_experiment(again) == write_experiment(experiment))
