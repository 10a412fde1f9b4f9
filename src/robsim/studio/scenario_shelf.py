"""Collections of scenarios to choose from, with their remarks."""

from __future__ import annotations

import base64
import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path

from robsim.base.errors import FileError, check_known
from robsim.files import examples
from robsim.files.example_groups import GROUPS
from robsim.files.scenario_remark import extract_remark
from robsim.files.toml import read_toml_text
from robsim.run.experiment import Experiment, load_scenario


class ScenarioShelf:
    """Scenario files by name: the shipped scenarios, or the scenarios of a folder.

    Attributes
    ----------
    entries : list of dict
        Name, title, remark (its first line, and all other lines) and group of each scenario, in
        the order of the gallery.
    """

    def __init__(
        self, paths: Sequence[Path], groups: Mapping[str, Sequence[str]] | None = None
    ) -> None:
        self._paths = {path.stem: path for path in paths}
        groups = {"": list(self._paths)} if groups is None else groups
        grouped = [(name, group) for group, names in groups.items() for name in names]
        self.entries = [_build_shelf_entry(self._paths[name], group) for name, group in grouped]

    @classmethod
    def shipped(cls) -> ScenarioShelf:
        """Return the shipped scenarios."""
        return cls([Path(examples.path(name)) for name in examples.names()], GROUPS)

    @classmethod
    def of(cls, folder: Path) -> ScenarioShelf:
        """Return the scenario files of a folder; raise FileError if it has none."""
        paths = sorted(folder.glob("*.toml"))
        if not paths:
            raise FileError(f"{folder}: no scenario file (*.toml)")
        return cls(paths)

    def first(self) -> Experiment:
        """Return the first valid experiment; raise the error of the first file if none is valid."""
        problems = []
        for name in self._paths:
            try:
                return self.experiment(name)
            except FileError as error:
                problems.append(error)
        raise problems[0]

    def experiment(self, name: str) -> Experiment:
        """Return the experiment of a name; raise InputError if it is unknown or invalid."""
        check_known(name, self._paths, "no experiment {}", "experiments")
        return load_scenario(self._paths[name])

    def pictures(self) -> dict[str, str]:
        """Return the pictures of the scenarios that have one, as data URLs by name."""
        files = {
            name: path.parent / "thumbnails" / f"{name}.webp" for name, path in self._paths.items()
        }
        return {name: _encode_picture(file) for name, file in files.items() if file.is_file()}


def _encode_picture(file: Path) -> str:
    """Return a WebP picture as a data URL."""
    return f"data:image/webp;base64,{base64.b64encode(file.read_bytes()).decode()}"


def _build_shelf_entry(path: Path, group: str) -> dict[str, str]:
    """Return name, title, remark and group of a scenario file."""
    entry = {"name": path.stem, "group": group}
    try:
        text = read_toml_text(path)
    except FileError as error:
        return {**entry, "title": path.stem, "about": str(error), "more": ""}
    about, _, more = extract_remark(text).partition("\n")
    return {**entry, "title": _extract_title(text) or path.stem, "about": about, "more": more}


def _extract_title(text: str) -> str:
    """Return the title in the text of a scenario; "" if there is none."""
    try:
        title = tomllib.loads(text).get("title", "")
    except tomllib.TOMLDecodeError:
        return ""
    return title if isinstance(title, str) else ""
