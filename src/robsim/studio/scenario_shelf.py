"""Collections of scenarios to choose from, with their remarks."""

from __future__ import annotations

import tomllib
from collections.abc import Sequence
from pathlib import Path

from robsim.base.errors import FileError, check_known
from robsim.files import examples
from robsim.files.scenario_remark import extract_remark
from robsim.files.toml import read_toml_text
from robsim.run.experiment import Experiment, load_scenario


class ScenarioShelf:
    """Scenario files by name: the shipped scenarios, or the scenarios of a folder."""

    def __init__(self, paths: Sequence[Path]) -> None:
        self._paths = {path.stem: path for path in paths}
        self.entries = [_build_shelf_entry(name, path) for name, path in self._paths.items()]

    @classmethod
    def shipped(cls) -> ScenarioShelf:
        """Return the shipped scenarios."""
        return cls([Path(examples.path(name)) for name in examples.names()])

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


def _build_shelf_entry(name: str, path: Path) -> dict[str, str]:
    """Return name, title and first line of the remark of a scenario file."""
    try:
        text = read_toml_text(path)
    except FileError as error:
        return {"name": name, "title": name, "about": str(error)}
    return {
        "name": name,
        "title": _extract_title(text) or name,
        "about": extract_remark(text).partition("\n")[0],
    }


def _extract_title(text: str) -> str:
    """Return the title in the text of a scenario; "" if there is none."""
    try:
        title = tomllib.loads(text).get("title", "")
    except tomllib.TOMLDecodeError:
        return ""
    return title if isinstance(title, str) else ""
