"""The experiment: all that is needed for a run, as one value."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, Self, cast

import numpy as np

from robsim.base.arrays import whole
from robsim.base.errors import FileError, GoalError, InputError, Interrupted
from robsim.base.interrupt import undisturbed
from robsim.base.values import unchanging
from robsim.declare.problems import shown
from robsim.files.changes import Changes
from robsim.files.toml import Tables, parse, read_text, write
from robsim.run import overview
from robsim.run.changed import changed, has_objects, names_files
from robsim.run.checks import whole_periods
from robsim.run.instant import Instant, instants
from robsim.run.loop import Loop
from robsim.run.mission_run import MissionRun
from robsim.run.origin import attributes_of, made_with
from robsim.run.setup import Setup
from robsim.run.staged import Staged
from robsim.run.start_view import check_view
from robsim.run.text import SCENE, read_experiment, text_of, write_experiment
from robsim.run.varied import checked
from robsim.run.workers import Progress, advance

if TYPE_CHECKING:
    import xarray as xr


# the field of which a table of the text is a part, where it is not a setting
GROUPS = {**dict.fromkeys(SCENE, "scene"), "task": "task", "start": "start", "belief": "belief"}


@dataclass(frozen=True, eq=False, repr=False)
class Experiment(Setup):
    """A scene, a task, a start, imperfections and a duration, as one frozen value.

    scene, task  what there is, and what is to be done: a task, or a `Mission`
    start        (nq,), a batch of starts (B, nq), or {robot: q}; None: home
    sensing      what is wrong with the images
    actuation    what is wrong with the joints
    endings      conditions on which a run ends (`Region`, `TooClose`, or of a kind of your own)
    dt           control period in seconds: a command is held for it
    duration     seconds, rounded up to whole periods
    seed         of all that is random
    hold         go on to the end of the duration, also after convergence
    record       "all", every n-th step, or "summary": the end of each run
    first_run    number of the first run; its noise comes from this and the seed
    title        what it shows, in a line

    Two experiments are equal where all these are. `text` is TOML that says it, `hash` stands for
    it, `at` and `with_` give changed copies, `run` runs it.

    >>> from robsim import examples
    >>> experiment = load_scenario(examples.path("visp_tutorial"))
    >>> experiment.at("task.gain", 2.0).task.gain, experiment.with_(dt=0.02).dt
    (2.0, 0.02)
    """

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
        """Return the experiment that a run, a batch or consecutive runs of it were made of.

        InputError: the run does not say.

        >>> from robsim import examples
        >>> experiment = load_scenario(examples.path("visp_tutorial")).with_(duration=0.4)
        >>> Experiment.of(experiment.run()) == experiment
        True
        """
        attributes = attributes_of(run)
        text = attributes.get("scenario", "")
        if not text:
            reason = run.attrs.get("no_scenario", "it has no attrs['scenario']")
            raise InputError(f"this run cannot be repeated from its own text: {reason}")
        made = cls.from_text(text, "scenario of the run")
        if isinstance(made.task, Staged):
            return made
        whole_run = cast(Any, run)
        same = made._as(made_with(whole_run))
        varied = {name: whole_run[name].values for name in attributes.get("varied", "").split()}
        if not varied:
            return same
        return same.vary(varied) if "run" in whole_run.dims else same.at(varied)

    @classmethod
    def _of_tables(cls, tables: Tables, source: str, text: str | None) -> Experiment:
        read = read_experiment(tables, source)
        try:
            made = cls(**read, source=source)
        except InputError as error:
            raise FileError(f"{source}: {error}" if source else str(error)) from None
        made.__dict__["tables"] = tables
        if text is not None:
            made.__dict__["text"] = text
        return made

    @cached_property
    def tables(self) -> Tables:
        """The tables of the text, in which an object that no text can say stands as it is."""
        own = write_experiment(self.scene, self.task, self.start, self.settings, live=True)
        kept = self.__dict__.get("_kept", {})
        groups = {GROUPS.get(key) for key in kept}
        return {**{key: x for key, x in own.items() if GROUPS.get(key) not in groups}, **kept}

    def with_(self, **changes: Any) -> Self:
        """Return a copy with other fields: `experiment.with_(task=PBVS(), dt=0.02)`.

        InputError: there is no such field.
        """
        made = super().with_(**changes)
        gone = {*changes, *(["belief"] if changes.keys() & {"scene", "task"} else [])}
        said = self.__dict__.get("tables", self.__dict__.get("_kept", {}))
        kept = {key: x for key, x in said.items() if key in GROUPS and GROUPS[key] not in gone}
        made.__dict__["_kept"] = kept
        return made

    @cached_property
    def text(self) -> str:
        """The TOML text of this experiment: as it was read, or exact.

        InputError: the experiment is made of Python code, or has several starts.
        """
        if self.varied or np.ndim(self.start) > 1:
            return self.to_toml()
        own = self.__dict__.get("tables")
        return self.to_toml() if own is None or has_objects(own) else write(own)

    def to_toml(self) -> str:
        """Return all of it as TOML, with robots in full and numbers exact.

        Reading it gives the same experiment.

        InputError: the experiment is made of Python code, or has several starts or other numbers
        in each run.
        """
        if self.varied:
            raise InputError("a text is of one run, and numbers differ from run to run: of_run(i)")
        return text_of(self.scene, self.task, self.start, self.settings)

    @cached_property
    def hash(self) -> str:
        """The first 16 hexadecimal digits of the hash of the exact text.

        InputError: there is no text.
        """
        return hashlib.sha256(self.to_toml().encode()).hexdigest()[:16]

    def at(self, name: str | Mapping[str, Any], value: Any = None) -> Experiment:
        """Return a copy in which what has this dotted name has another value.

        name    such as "task.gain", "run.dt", "cameras.eye.focal" or "belief.robots.arm.links.
                elbow.dh.a"; or several of them, {name: value}
        value   a number in SI, a text as in a file ("20 ms"), or an object (`rs.PBVS()`); None:
                as if nothing was said

        FileError: there is no such name, with the nearest; or the value is not valid there.
        """
        changes = dict(name) if isinstance(name, Mapping) else {name: value}
        several = np.ndim(self.start) > 1  # which no table says
        own = {key: x for key, x in self.tables.items() if not (several and key == "start")}
        made = self._of_tables(changed(own, changes, self.source, python=True), self.source, None)
        varied = {each: x for each, x in self.varied.items() if each not in changes}
        made = made.with_(start=self.start) if several else made
        return made.with_(varied=varied) if varied else made

    def vary(self, numbers: Mapping[str, Any]) -> Experiment:
        """Return a copy of many runs, in which these names have another value in each run.

        numbers  {name: (runs, ...)} in SI, with the dotted names of `at`: intrinsics, distortion
                 and pose of cameras, marks and pose of objects, pose of robots, constants of links
                 ("belief.robots.arm.links.elbow.dh.a"), each true or believed; "task.gain",
                 "task.depth_scale", "sensing.noise", "actuation.lag"

        They are bound at once, so that 10,000 runs with 10,000 calibrations take little longer than
        with one. There is one start for all runs, or one for each. `of_run(i)` is the experiment of
        one run, with the same bits. The run has a variable for each name.

        InputError, FileError: a name that cannot differ from run to run, or a value that is not
        valid there.

        >>> from robsim import examples
        >>> experiment = load_scenario(examples.path("calibration_errors"))
        >>> wrong = experiment.vary({"belief.cameras.camera.focal": [490, 500, 510]})
        >>> wrong.run(record="summary").distance_to_goal.values.round(3)
        array([0.174, 0.174, 0.175])
        """
        return self.with_(varied={**self.varied, **checked(self, numbers)})

    def of_run(self, number: int) -> Experiment:
        """Return the experiment of a single run, by its place among the runs, from 0 on.

        InputError: there are not so many.
        """
        i = whole(number, "run", 0, self.runs)
        numbers = {name: values[i] for name, values in self.varied.items()}
        one = self.at(numbers) if numbers else self
        start = self.start[i] if np.ndim(self.start) > 1 else self.start
        return one.with_(start=start, first_run=self.first_run + i)

    def check(self, *, view: bool = True) -> None:
        """Check task, start and settings as a run would, without running.

        With `view`, a start that does not see its target is an error; as a run it ends at once.

        GoalError, FileError: a run would be refused.
        """
        with self._named():
            if isinstance(self.task, Staged):
                self.task.checked(self, view=view)
                return
            loop = self.with_(record="summary").loop()
            loop.controller.check_start(loop.q0)
            if view:
                check_view(loop)

    def run(
        self,
        progress: Progress | None = None,
        *,
        threads: int | None = None,
        chunk: int = 256,
        **changes: Any,
    ) -> Any:
        """Simulate, and return the run: an xarray.Dataset, or a `MissionRun` of a mission.

        `changes` are those of `with_`, for this run.

        `threads`, `chunk` and `progress` are as in `simulate`. The run keeps the text of the
        experiment, so that `replay` can repeat it.
        """
        if changes:
            return self.with_(**changes).run(progress, threads=threads, chunk=chunk)
        how: dict[str, Any] = {"threads": threads, "chunk": chunk, "progress": progress}
        with self._named():
            if isinstance(self.task, Staged):
                return self.task.simulated(self, **how)
            loop = self.loop()
            finished = advance(loop, **how)
        with undisturbed() as stops:
            result = self.dataset(loop)
        if stops or not finished:
            raise Interrupted("stopped by the user; what was simulated so far is in .run", result)
        return result

    def steps(self) -> Iterator[Instant]:
        """Yield the instants of a single run one by one, so that you may watch, or stop.

        The last one is that at which the run ends. InputError: a mission, or several starts.

        >>> from robsim import examples
        >>> experiment = load_scenario(examples.path("visp_tutorial"))
        >>> now = next(experiment.steps())
        >>> now.time, now.q.shape, now.outcome.name
        (0.0, (7,), 'RUNNING')
        """
        if isinstance(self.task, Staged):
            raise InputError("steps: a mission has several runs; take the experiment of a phase")
        if np.ndim(self.start) > 1 or self.varied:
            raise InputError("steps: these are several runs; take the experiment of one, of_run(i)")
        with self._named():
            loop = self.with_(record="summary").loop()
            loop.controller.check_start(loop.q0)
        return instants(loop)

    def dataset(self, loop: Loop) -> xr.Dataset:
        """Return what a loop of this experiment has recorded."""
        from robsim.run.result import dataset

        parts = self.task, self.sensing, self.actuation, self.endings
        if not (self.scene.tree.compiled and all(map(unchanging, parts))):
            _ = self.origin  # written now: later a user's object may be another
        return dataset(loop, self, lambda: self.origin)

    @cached_property
    def origin(self) -> dict[str, str]:
        """What a run says of its experiment: the text, or why there is none."""
        one = self.with_(start=None, varied={}) if self.runs > 1 else self  # a text is of one run
        try:
            exact = names_files(one.__dict__.get("tables"))  # the files may change
            return {"scenario": one.to_toml() if exact else one.text}
        except InputError as reason:
            return {"scenario": "", "no_scenario": str(reason)}

    def _as(self, fields: Mapping[str, Any]) -> Experiment:
        """Return the experiment with other fields where they are not the same."""
        home = self.scene.home if self.start is None else self.start
        steps = whole_periods(self.dt, self.duration)
        same = {
            "start": np.array_equal(home, fields["start"]),
            "duration": steps == whole_periods(fields["dt"], fields["duration"]),
        }
        other = {
            name: value
            for name, value in fields.items()
            if not same.get(name, value == getattr(self, name))
        }
        return self.with_(**other) if other else self

    @contextmanager
    def _named(self) -> Iterator[None]:
        """Put the name of the file, if any, in front of errors from inside."""
        if not self.source:
            yield
            return
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
