"""The experiment: all that is needed for a run, as one value."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import KW_ONLY, dataclass, field, fields, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from robsim.base.arrays import frozen, numbers
from robsim.base.errors import FileError, GoalError, InputError, Interrupted
from robsim.base.values import Value
from robsim.declare.problems import shown
from robsim.files.changes import Changes
from robsim.files.toml import Tables, parse, read_text, write
from robsim.run import overview
from robsim.run.changed import changed, has_objects, names_files
from robsim.run.mission_run import MissionRun
from robsim.run.record import Record
from robsim.run.simulate import Progress, check, simulate
from robsim.run.staged import Staged
from robsim.run.text import read_experiment, text_of, write_experiment
from robsim.world.actuation import Actuation
from robsim.world.scene import Scene
from robsim.world.sensing import Sensing

if TYPE_CHECKING:
    import xarray as xr

_PERFECT, _EXACT = Sensing(), Actuation()


@dataclass(frozen=True, eq=False, repr=False)
class Experiment(Value):
    """A scene, a task, a start, imperfections and a duration, as one frozen value.

    scene, task  what there is, and what is to be done: a task, or a `Mission`
    start        (nq,), a batch of starts (B, nq), or {robot: q}; None: home
    sensing      what is wrong with the images
    actuation    what is wrong with the joints
    dt           control period in seconds: a command is held for it
    duration     seconds, rounded up to whole periods
    seed         of all that is random
    hold         go on to the end of the duration, also after convergence
    record       "all", every n-th step, or "summary": the end of each run
    title        what it shows, in a line

    Two experiments are equal where all these are. `text` is TOML that says it, `hash` stands for
    it, `at` and `with_` give changed copies, `run` runs it.

    >>> from robsim import examples
    >>> experiment = load_scenario(examples.path("visp_tutorial"))
    >>> experiment.at("task.gain", 2.0).task.gain, experiment.with_(dt=0.02).dt
    (2.0, 0.02)
    """

    scene: Scene
    task: Any
    start: Any = None
    _: KW_ONLY
    sensing: Sensing = _PERFECT
    actuation: Actuation = _EXACT
    dt: float = 0.04
    duration: float = 10.0
    seed: int = 0
    hold: bool = False
    record: Record = "all"
    title: str | None = None
    source: str = field(default="<experiment>", repr=False, compare=False)

    def __post_init__(self) -> None:
        start = self.start
        if isinstance(start, Mapping):
            start = self.scene.coordinates(start, "start")
        if start is not None:
            start = frozen(np.array(numbers(start, "start", ("nq",))))
        object.__setattr__(self, "start", start)
        if self.title is not None and not isinstance(self.title, str):
            raise InputError(f"title: expected a text, got {self.title!r:.80}")

    def __repr__(self) -> str:
        """Return a few lines: the scene, the task, and the settings."""
        return overview.text(self)

    def _repr_html_(self) -> str:
        """Return a table for notebooks."""
        return overview.table(self)

    @classmethod
    def from_text(cls, text: str, source: str = "<text>", set: Changes = ()) -> Experiment:
        """Return the experiment of a TOML text.

        `set` are changes such as {"task.gain": "2"} or ["task.gain=2"].

        FileError: whatever is wrong, with the key and what would be valid.

        >>> Experiment.from_text('''
        ... schema = 1
        ... robots = [{ model = "free_camera" }]
        ... objects = [{ name = "dots", marks = ["0, 0, 1 m", "10, 0, 100 cm"] }]
        ... cameras = [{ name = "eye", on = "free_camera.body", focal = 800, size = [640, 480] }]
        ... task = { kind = "ibvs", gain = 2 }
        ... ''').task.gain
        2.0
        """
        if not isinstance(text, str):
            raise FileError(f"{source}: expected TOML text, got {shown(text)}")
        tables = parse(text, source)
        other = changed(tables, set, source)
        return cls._of_tables(other, source, text if other is tables else None)

    @classmethod
    def of(cls, run: xr.Dataset | MissionRun) -> Experiment:
        """Return the experiment that a run was made of. InputError: the run does not say.

        >>> from robsim import examples
        >>> experiment = load_scenario(examples.path("visp_tutorial")).with_(duration=0.4)
        >>> Experiment.of(experiment.run()) == experiment
        True
        """
        text = run.attrs.get("scenario", "")
        if not text:
            reason = run.attrs.get("no_scenario", "it has no attrs['scenario']")
            raise InputError(f"this run cannot be repeated from its own text: {reason}")
        return cls.from_text(text, "scenario of the run")

    @classmethod
    def _of_tables(cls, tables: Tables, source: str, text: str | None) -> Experiment:
        made = cls(**read_experiment(tables, source), source=source)
        made.__dict__["tables"] = tables
        if text is not None:
            made.__dict__["text"] = text
        return made

    @cached_property
    def tables(self) -> Tables:
        """The tables of the text, in which an object that no text can say stands as it is."""
        return write_experiment(self.scene, self.task, self.start, self.settings, live=True)

    @cached_property
    def text(self) -> str:
        """The TOML text of this experiment: as it was read, or exact.

        InputError: the experiment is made of Python code, or has several starts.
        """
        own = self.__dict__.get("tables")
        return self.to_toml() if own is None or has_objects(own) else write(own)

    def to_toml(self) -> str:
        """Return all of it as TOML, with robots in full and numbers exact.

        Reading it gives the same experiment.

        InputError: the experiment is made of Python code, or has several starts.
        """
        return text_of(self.scene, self.task, self.start, self.settings)

    @cached_property
    def hash(self) -> str:
        """The first 16 hexadecimal digits of the hash of the exact text.

        InputError: there is no text.
        """
        return hashlib.sha256(self.to_toml().encode()).hexdigest()[:16]

    @property
    def settings(self) -> dict[str, Any]:
        """The fields by name, without scene, task and start."""
        apart = ("scene", "task", "start", "source")
        return {
            each.name: getattr(self, each.name) for each in fields(self) if each.name not in apart
        }

    @property
    def keywords(self) -> dict[str, Any]:
        """The settings that `simulate` takes."""
        return {name: value for name, value in self.settings.items() if name != "title"}

    def with_(self, **changes: Any) -> Experiment:
        """Return a copy with other fields: `experiment.with_(task=PBVS(), dt=0.02)`.

        InputError: there is no such field.
        """
        names = [each.name for each in fields(self) if each.name != "source"]
        for name in changes:
            if name not in names:
                raise InputError(f"no field {name!r}; fields: {', '.join(names)}")
        return replace(self, **changes)

    def at(self, name: str | Mapping[str, Any], value: Any = None) -> Experiment:
        """Return a copy in which what has this dotted name has another value.

        name    such as "task.gain", "run.dt", "cameras.eye.focal" or "belief.robots.arm.links.
                elbow.dh.a"; or several of them, {name: value}
        value   a number in SI, a text as in a file ("20 ms"), or an object (`rs.PBVS()`)

        FileError: there is no such name, with the nearest; or the value is not valid there.
        """
        changes = dict(name) if isinstance(name, Mapping) else {name: value}
        tables = changed(self.tables, changes, self.source, python=True)
        return self._of_tables(tables, self.source, None)

    def check(self) -> None:
        """Check task, start and settings as a run would, without running.

        GoalError, FileError: a run would be refused.

        A start that does not see its target is an error here; as a run it ends at once.
        """
        with self._named():
            if isinstance(self.task, Staged):
                self.task.checked(self.scene, self.start, must_see=True, **self.keywords)
            else:
                check(self.scene, self.task, self.start, self.keywords, must_see=True)

    def run(
        self,
        progress: Progress | None = None,
        *,
        run: int = 0,
        threads: int | None = None,
        chunk: int = 256,
        **changes: Any,
    ) -> Any:
        """Simulate, and return the run: an xarray.Dataset, or a `MissionRun` of a mission.

        `changes` are those of `with_`, for this run.

        `run`, `threads`, `chunk` and `progress` are as in `simulate`. The run keeps the text of the
        experiment, so that `replay` can repeat it.
        """
        if changes:
            return self.with_(**changes).run(progress, run=run, threads=threads, chunk=chunk)
        how: dict[str, Any] = {
            "run": run,
            "threads": threads,
            "chunk": chunk,
            "progress": progress,
        }
        try:
            with self._named():
                how |= self.keywords
                if isinstance(self.task, Staged):
                    made = self.task.simulated(self.scene, self.start, **how)
                else:
                    made = simulate(self.scene, self.task, self.start, **how)
        except Interrupted as stop:
            self._sign(stop.run)
            raise
        return self._sign(made)

    def _sign(self, run: Any) -> Any:
        """Note in a run the text of this experiment, from which it was made."""
        own = self.__dict__.get("tables")
        one = np.ndim(self.start) < 2  # a text holds one start
        if run.attrs["scenario"] and (one if own is None else not names_files(own)):
            run.attrs["scenario"] = self.text
        return run

    @contextmanager
    def _named(self) -> Iterator[None]:
        """Put the name of the file in front of errors from inside."""
        try:
            yield
        except GoalError as error:
            raise GoalError(f"{self.source}: task.goal: {error}") from None
        except InputError as error:
            raise FileError(f"{self.source}: {error}") from None


def load_scenario(path: str | os.PathLike[str], set: Changes = ()) -> Experiment:
    """Return the experiment of a scenario file, with changes such as ["task.gain=2"].

    FileError: whatever is wrong, with the key and what would be valid.

    >>> from robsim import examples
    >>> load_scenario(examples.path("visp_tutorial"), ["task.gain=2", "run.dt=20 ms"]).dt
    0.02
    """
    return Experiment.from_text(read_text(path), str(path), set)
