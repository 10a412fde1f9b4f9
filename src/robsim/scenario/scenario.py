"""A scenario: all that is needed to simulate, and the text that says it."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

from robsim import describe
from robsim.base.arrays import Array
from robsim.base.errors import FileError, GoalError, InputError, Interrupted
from robsim.run.simulate import Progress, check, simulate
from robsim.scenario import build
from robsim.scenario.belief import merge
from robsim.scenario.imperfection import actuation, sensing
from robsim.scenario.library import expanded
from robsim.scenario.override import Changes, overridden
from robsim.scenario.problems import Problems, shown
from robsim.scenario.run import Settings, settings, start
from robsim.scenario.schema import BeliefTable, SceneTable
from robsim.scenario.tables import checked
from robsim.scenario.task import TaskReader
from robsim.scenario.task_schema import ScenarioFile
from robsim.scenario.text import Raw, parse, read_text
from robsim.servo import Task
from robsim.world.scene import Scene

if TYPE_CHECKING:
    import xarray as xr

_SCENE = tuple(SceneTable.model_fields)  # robots, objects, cameras, display


@dataclass(frozen=True, eq=False)
class Scenario:
    """A scene, a task, a start (None: home) and settings; `text` is the TOML that said so.

    >>> scenario = Scenario.from_text('''
    ... schema = 1
    ... robots = [{ model = "free_camera" }]
    ... objects = [{ name = "dots", marks = ["0, 0, 1 m", "10, 0, 100 cm", "0, 10, 100 cm"] }]
    ... cameras = [{ name = "eye", on = "free_camera.body", focal = 800, size = [640, 480] }]
    ... task = { kind = "ibvs", gain = 2 }
    ... start = { position = "5, 0, 0 cm" }
    ... ''')
    >>> scenario.task.gain, float(scenario.q0[0])
    (2.0, 0.05)
    """

    scene: Scene
    task: Task
    q0: Array | None = None
    settings: Settings = field(default_factory=Settings)
    text: str = ""
    title: str | None = None
    source: str = field(default="<text>", kw_only=True)

    @classmethod
    def from_text(cls, text: str, source: str = "<text>", set: Changes = ()) -> Scenario:
        """Read a TOML text, with changes such as {"task.gain": "2"} or ["task.gain=2"].

        FileError: whatever is wrong, with the key and what would be valid.
        """
        if not isinstance(text, str):
            raise FileError(f"{source}: expected TOML text, got {shown(text)}")
        raw = parse(text, source)
        changed = overridden(raw, set, source)
        made = _read(changed, source)
        return cls(
            *made, text if changed is raw else _toml(changed), changed.get("title"), source=source
        )

    def check(self) -> None:
        """Bind the task and try start and settings, as a run would. GoalError, or FileError."""
        with _named(self.source):
            check(self.scene, self.task, self.q0, self.settings.keywords)

    def run(self, progress: Progress | None = None, **changes: Any) -> xr.Dataset:
        """Simulate; `changes` are keywords of `simulate` that come before the file's settings.

        The run keeps this scenario's text, so that `replay` can repeat it; or an exact
        description, where that text does not say what was run.
        """
        told = {"q0": self.q0, **self.settings.keywords, **changes}
        try:
            with _named(self.source):
                run = simulate(self.scene, self.task, **told, progress=progress)
        except Interrupted as stop:
            self._sign(stop.run, changes)
            raise
        return self._sign(run, changes)

    def to_toml(self) -> str:
        """All of it as TOML, with robots in full and numbers exact: `from_text` reads the same.

        InputError: the task is made of Python code that a file cannot hold.
        """
        q0 = None if self.q0 is None else self.scene.coordinates(self.q0, "q0")
        if q0 is not None and q0.ndim != 1:
            raise InputError(f"q0: a file holds one start, not a batch of shape {q0.shape}")
        try:
            return describe.scenario(self.scene, self.task, self.settings.keywords, q0, self.title)
        except describe.NoDescription as reason:
            raise InputError(f"this scenario has no text: {reason}") from None

    def _sign(self, run: xr.Dataset, changes: dict[str, Any]) -> xr.Dataset:
        if not changes.keys() - {"threads", "chunk"} and self._says_it():
            run.attrs["scenario"] = self.text
        return run

    def _says_it(self) -> bool:
        """Whether the text still says what this is; fields may have been replaced."""
        try:
            return Scenario.from_text(self.text).to_toml() == self.to_toml()
        except InputError:
            return False


def load_scenario(path: str | os.PathLike[str], set: Changes = ()) -> Scenario:
    """Read a scenario file, with changes such as {"task.gain": "2"} or ["task.gain=2"].

    FileError: whatever is wrong, with the key and what would be valid.

    >>> from robsim.files import examples
    >>> load_scenario(examples.path("visp_tutorial"), ["task.gain=2", "run.dt=20 ms"]).task.gain
    2.0
    """
    return Scenario.from_text(read_text(path), str(path), set)


def _read(raw: Raw, source: str) -> tuple[Scene, Task, Array | None, Settings]:
    """The values that raw tables say."""
    problems = Problems(source)
    raw = {**raw, "robots": expanded(raw.get("robots", []), problems, "robots")}
    table = checked(ScenarioFile, raw, problems)
    truth = build.scene(table, problems)

    def believed(tables: Any, *path: str | int) -> Scene:
        return _belief(raw, tables, problems, *path)

    belief = believed(raw["belief"], "belief") if "belief" in raw else None
    what = TaskReader(truth, belief, believed, problems).task(table.task)
    q0 = None
    with problems.at("start"):
        q0 = start(table.start, truth)
    told = Settings()
    with problems.at("run"):
        told = settings(table.run)
    with problems.at("sensing"):
        told = replace(told, sensing=sensing(table.sensing))
    with problems.at("actuation"):
        told = replace(told, actuation=actuation(table.actuation, truth))
    problems.stop()
    return truth, what, q0, told


def _belief(raw: Raw, tables: Any, problems: Problems, *path: str | int) -> Scene:
    """The believed scene: what a table says over what is true, or alone where it is complete."""
    with problems.at(*path):
        if not isinstance(tables, dict):
            raise InputError(f"must be a table, as in [[belief.cameras]], got {shown(tables)}")
        if tables.get("complete") is not True:
            tables = merge({key: raw[key] for key in _SCENE if key in raw}, tables)
    problems.stop()
    robots = expanded(tables.get("robots", []), problems, *path, "robots")
    table = checked(BeliefTable, {**tables, "robots": robots}, problems, *path)
    return build.scene(table, problems, *path)


@contextmanager
def _named(source: str) -> Iterator[None]:
    """Errors from inside with the name of the file in front."""
    try:
        yield
    except GoalError as error:
        raise GoalError(f"{source}: task.goal: {error}") from None
    except InputError as error:
        raise FileError(f"{source}: {error}") from None


def _toml(tables: Raw) -> str:
    import tomli_w

    return tomli_w.dumps(tables)
