"""The experiment: all that is needed for a run, as one value."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import KW_ONLY, dataclass, field, fields, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self, cast

import numpy as np
from numpy.typing import NDArray

from robsim.base import interrupt
from robsim.base.arrays import as_bool, as_integer, as_positive
from robsim.base.atomic_files import convert_os_errors
from robsim.base.errors import (
    FileError,
    GoalError,
    InputError,
    Interrupted,
    format_value,
    prefix_errors,
)
from robsim.base.value import Value, is_immutable, replace_unchecked
from robsim.declare.controls import Control
from robsim.declare.problems import join_keys, prefix_path
from robsim.engine.endings import ENDING_LIST, check_endings
from robsim.engine.instant import Instant, iterate_instants
from robsim.engine.loop import Loop
from robsim.engine.recorder import Record, parse_record
from robsim.engine.start_visibility import check_start_visibility
from robsim.engine.workers import Progress, advance_loop
from robsim.files.overrides import Changes
from robsim.files.toml import read_toml_text
from robsim.run import experiment_overview
from robsim.run.batch_numbers import BatchTemplate, check_batch_numbers
from robsim.run.brief_text import write_brief_text
from robsim.run.checkpoint import CheckpointFile
from robsim.run.experiment_overrides import (
    apply_changes,
    parse_dotted_changes,
    read_experiment_text,
)
from robsim.run.experiment_paths import (
    NOT_BY_PATH,
    make_command_guard,
    replace_numbers,
    yield_experiment_controls,
)
from robsim.run.experiment_text import write_complete_text
from robsim.run.mission_protocol import SelfSimulatingTask
from robsim.run.mission_run import MissionRun
from robsim.run.provenance import get_run_attributes, read_run_settings
from robsim.run.run_checks import check_instance, check_starts, check_task, count_periods
from robsim.servo.safety.safety import Safety
from robsim.servo.tasks.task import ServoTask, Task
from robsim.world.actuation import Actuation
from robsim.world.scene import Scene
from robsim.world.sensing import Sensing

if TYPE_CHECKING:
    import xarray as xr

PERFECT, EXACT = Sensing(), Actuation()
PARTS = {"scene", "task", "sensing", "actuation"}  # which are checked when they are made


@dataclass(frozen=True, eq=False, repr=False)
class Experiment(Value):
    """A scene, a task, a start, imperfections and a duration, as one frozen value.

    scene, task  what there is, and what is to be done: a task, or a `Mission`
    start        (nq,), a batch of starts (B, nq), or {robot: q}; None: home
    sensing      what is wrong with the images
    actuation    what is wrong with the joints
    safety       limits that every command is kept within (`Safety`); None: none
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

    scene: Scene
    task: Any
    start: Any = None
    _: KW_ONLY
    sensing: Sensing = PERFECT
    actuation: Actuation = EXACT
    safety: Safety | None = None
    endings: Any = ()
    dt: float = 0.04
    duration: float = 10.0
    seed: int = 0
    hold: bool = False
    record: Record = "all"
    first_run: int = 0
    title: str | None = None
    varied: Any = field(default_factory=dict, repr=False)  # of `Experiment.vary`
    study: Any = field(default=None, repr=False, compare=False)  # table of its file
    source: str = field(default="", repr=False, compare=False)

    def __post_init__(self) -> None:
        for name, text in (
            ("title", "" if self.title is None else self.title),
            ("source", self.source),
        ):
            if not isinstance(text, str):
                raise InputError(f"{name}: expected a text, got {format_value(text)}")
        checked = {
            "scene": check_instance(self.scene, Scene, "scene"),
            "task": check_task(self.task, (Task, SelfSimulatingTask)),
            "start": None if self.start is None else check_starts(self.scene, self.start, "start"),
            "sensing": check_instance(self.sensing, Sensing, "sensing"),
            "actuation": check_instance(self.actuation, Actuation, "actuation"),
            "safety": None
            if self.safety is None
            else check_instance(self.safety, Safety, "safety"),
            "endings": ENDING_LIST.check(self.endings, "endings"),
            "dt": as_positive(self.dt, "dt (seconds)"),
            "duration": as_positive(self.duration, "duration (seconds)"),
            "seed": as_integer(self.seed, "seed", 0, 2**64),
            "hold": as_bool(self.hold, "hold"),
            "first_run": as_integer(self.first_run, "first_run", 0, 2**62),
        }
        for name, value in checked.items():
            object.__setattr__(self, name, value)
        self._check_runs()
        check_endings(self.endings, self.scene)
        if self.safety is not None:
            with prefix_errors("safety"):
                self.safety.check(self.scene)
        parse_record(self.record)
        with self.keyed("run", "duration"):
            count_periods(self.dt, self.duration)

    def __repr__(self) -> str:
        """Return a few lines: the scene, the task, and the settings."""
        return experiment_overview.format_experiment(self)

    def _repr_html_(self) -> str:
        """Return a table for notebooks."""
        return experiment_overview.format_experiment_html(self)

    @classmethod
    def from_text(cls, text: str, source: str = "<text>", set: Changes = ()) -> Self:
        """Return the experiment of a TOML text.

        `set` are changes such as {"task.gain": "2"} or ["task.gain=2"].

        FileError: whatever is wrong, with the key and what would be valid.

        >>> from robsim import Experiment
        >>> Experiment.from_text('''
        ... schema = 1
        ... robots = [{ model = "free_camera" }]
        ... objects = [{ name = "dots", marks = ["0, 0, 1 m", "10, 0, 100 cm"] }]
        ... cameras = [{ name = "eye", on = "free_camera.body", focal = 800, size = [640, 480] }]
        ... task = { kind = "ibvs", gain = 2 }
        ... ''').task.gain
        2.0
        """
        if not isinstance(source, str):
            raise InputError(f"source: expected a text, got {format_value(source)}")
        if not isinstance(text, str):
            raise FileError(f"{source}: expected TOML text, got {format_value(text)}")
        changes = parse_dotted_changes(set, source)
        made = cls._read(read_experiment_text(text, source), source)
        return cls._read(apply_changes(made, changes), source) if changes else made

    @classmethod
    def _read(cls, parts: Mapping[str, Any], source: str) -> Self:
        """Return the experiment of the parts that a text says; FileError if they do not fit."""
        try:
            return cls(**parts, source=source)
        except InputError as error:
            raise FileError(f"{source}: {error}" if source else str(error)) from None

    @classmethod
    def of(cls, run: xr.Dataset | MissionRun) -> Experiment:
        """Return the experiment that a run, a batch or consecutive runs of it were made of.

        InputError: the run does not say.

        >>> from robsim import examples
        >>> experiment = load_scenario(examples.path("visp_tutorial")).with_(duration=0.4)
        >>> Experiment.of(experiment.run()) == experiment
        True
        """
        attributes = get_run_attributes(run)
        text = attributes.get("scenario", "")
        if not text:
            reason = run.attrs.get("no_scenario", "it has no attrs['scenario']")
            raise InputError(f"this run cannot be repeated from its own text: {reason}")
        made = cls.from_text(text, "scenario of the run")
        if isinstance(made.task, SelfSimulatingTask):
            return made
        whole_run = cast(Any, run)
        same = made._as(read_run_settings(whole_run))
        varied = {name: whole_run[name].values for name in attributes.get("varied", "").split()}
        if not varied:
            return same
        return same.vary(varied) if "run" in whole_run.dims else same.at(varied)

    @property
    def settings(self) -> dict[str, Any]:
        """The fields by name, without scene, task and start."""
        apart = ("scene", "task", "start", "varied", "study", "source")
        return {
            each.name: getattr(self, each.name) for each in fields(self) if each.name not in apart
        }

    def with_(self, **changes: Any) -> Self:
        """Return a copy with other fields: `experiment.with_(task=PBVS(), dt=0.02)`.

        InputError: there is no such field.
        """
        names = [each.name for each in fields(self) if each.name not in ("study", "source")]
        for name in changes:
            if name not in names:
                raise InputError(f"no field {name!r}; fields: {', '.join(names)}")
        return replace(self, **changes)

    def revised(self, **changes: Any) -> Self:
        """Return a copy with other fields, in whose scene and parts only numbers differ."""
        rest = {name: x for name, x in changes.items() if name not in PARTS}
        made = replace(self, **rest) if rest else self
        parts = {name: changes[name] for name in changes.keys() & PARTS}
        if not parts:
            return made
        made = replace_unchecked(made, **parts)
        if made.scene is not self.scene:
            made._check_scene()
        return made

    def _check_scene(self) -> None:
        """Raise InputError for numbers of the scene that do not go with the rest."""
        if self.start is not None:
            check_starts(self.scene, self.start, "start")
        if self.safety is not None:
            with prefix_errors("safety"):
                self.safety.check_margin(self.scene)
        check_endings([each for each in self.endings if not is_immutable(each)], self.scene)

    def at(self, name: str | Mapping[str, Any], value: Any = None) -> Self:
        """Return a copy in which what has this dotted name has another value.

        name    such as "task.gain", "run.dt", "cameras.eye.focal" or "belief.robots.arm.links.
                elbow.dh.a"; or several of them, {name: value}
        value   a number in SI, a text as in a file ("20 ms"), or an object (`rs.PBVS()`); None:
                as if nothing was said

        A belief has the numbers of the truth where it has those that the truth had before.
        FileError: there is no such name, with the nearest; or the value is not valid there.
        """
        if not isinstance(name, str | Mapping):
            raise InputError(
                f"expected a dotted name such as 'task.gain', got {format_value(name)}"
            )
        changes = dict(name) if isinstance(name, Mapping) else {name: value}
        try:
            made: Self = replace_numbers(self, changes)
        except NOT_BY_PATH:  # a file has the last word, and says what is wrong
            made = self._by_text(changes)
        varied = {each: x for each, x in self.varied.items() if each not in changes}
        return made if varied == self.varied else made.with_(varied=varied)

    def _by_text(self, changes: Mapping[str, Any]) -> Self:
        """Return a copy of which a text says these changes."""
        several = np.ndim(self.start) > 1  # which no text says
        one = replace(self, start=None, varied={}) if several else replace(self, varied={})
        pairs = parse_dotted_changes(changes, self.source)
        made = self._read(apply_changes(one, pairs, python=True), self.source)
        made = replace(made, start=self.start) if several else made
        return made.with_(varied=self.varied) if self.varied else made

    def controls(self) -> list[Control]:
        """Return the values that a person may change by hand, as their declarations say them.

        `at` takes what the control of a value makes of another one: `control.changes(value)`.

        >>> from robsim import examples, load_scenario
        >>> experiment = load_scenario(examples.path("visp_tutorial"))
        >>> gain = next(each for each in experiment.controls() if each.path == "task.gain")
        >>> gain.value, gain.unit, gain.meaning
        (0.5, 'per second', 'Rate at which e falls: a constant, or adaptive.')
        >>> experiment.at(gain.changes(2.0)).task.gain
        2.0
        """
        return list(yield_experiment_controls(self))

    def vary(self, numbers: Mapping[str, Any]) -> Self:
        """Return a copy of many runs, in which these names have another value in each run.

        numbers  {name: (runs, ...)} in SI, with the dotted names of `at`: intrinsics, distortion
                 and pose of cameras, marks and pose of objects, pose of robots, constants of links
                 ("belief.robots.arm.links.elbow.dh.a"), each true or believed; "task.gain",
                 "task.depth_scale", "actuation.lag", "sensing.noise", "sensing.latency" and others

        They are bound at once, so that 10,000 runs with 10,000 calibrations take little longer than
        with one. There is one start for all runs, or one for each. `of_run(i)` is the experiment of
        one run, with the same bits. The run has a variable for each name.

        InputError, FileError: a name that cannot differ from run to run, or a value that is not
        valid there.

        >>> from robsim import examples, load_scenario
        >>> experiment = load_scenario(examples.path("calibration_errors"))
        >>> wrong = experiment.vary({"belief.cameras.camera.focal": [490, 500, 510]})
        >>> wrong.run(record="summary").distance_to_goal.values.round(3)
        array([0.02, 0.  , 0.02])
        """
        return self.with_(varied={**self.varied, **check_batch_numbers(self, numbers)})

    def of_run(self, number: int) -> Self:
        """Return the experiment of a single run, by its place among the runs, from 0 on.

        InputError: there are not so many.
        """
        i = as_integer(number, "run", 0, self.runs)
        numbers = {name: values[i] for name, values in self.varied.items()}
        one = self.with_(varied={}).at(numbers) if numbers else self
        start = self.start[i] if np.ndim(self.start) > 1 else self.start
        return one.with_(start=start, first_run=self.first_run + i)

    @property
    def text(self) -> str:
        """The TOML text of this experiment, as `to_toml` returns it."""
        return self.to_toml()

    def to_toml(self, *, complete: bool = False, folder: str | os.PathLike[str] = ".") -> str:
        """Return it as TOML, as short as a person writes it; reading it gives the same experiment.

        complete  robots link by link and every default, for files that must last: such a text
                  needs no library and no URDF file, which may change
        folder    of the file that the text is for: paths of URDF files are relative to it

        A robot of the library or of a URDF file is called by its name there, with what was changed
        of it, and a belief says where it differs from the scene. Numbers are exact, in the units
        that make them shortest. Where no short text gives the same experiment, it is complete.

        InputError: the experiment is made of Python code, or has several starts or other numbers
        in each run.

        >>> from robsim import examples, load_scenario
        >>> experiment = load_scenario(examples.path("eye_in_hand")).at("task.gain", 2)
        >>> text = experiment.to_toml()
        >>> len(text.splitlines()) < 40 < 400 < len(experiment.to_toml(complete=True).splitlines())
        True
        """
        whole = write_complete_text(self)
        return whole if complete else write_brief_text(self, Path(folder)) or whole

    @cached_property
    def hash(self) -> str:
        """The first 16 hexadecimal digits of the hash of the exact text.

        InputError: there is no text.
        """
        return hashlib.sha256(self.to_toml(complete=True).encode()).hexdigest()[:16]

    def check(self, *, view: bool = True) -> None:
        """Check task, start and settings as a run would, without running.

        With `view`, a start that does not see its target is an error; as a run it ends at once.

        GoalError, FileError: a run would be refused.
        """
        with self._named():
            if isinstance(self.task, SelfSimulatingTask):
                with self.keyed("task"):
                    self.task.checked(self, view=view)
                return
            loop = self._loop_from_start()
            if view:
                check_start_visibility(loop)

    def run(
        self,
        progress: Progress | None = None,
        *,
        threads: int | None = None,
        chunk: int = 256,
        checkpoint: str | os.PathLike[str] | CheckpointFile | None = None,
        resume: bool = False,
        **changes: Any,
    ) -> Any:
        """Simulate, and return the run: an xarray.Dataset, or a `MissionRun` of a mission.

        `changes` are those of `with_`, for this run.

        `threads`, `chunk` and `progress` are as in `simulate`. The run keeps the text of the
        experiment, so that `replay` can repeat it.

        `checkpoint` is a file that is written every ten seconds or so, and when a stop comes (see
        `Interrupted`). With `resume` the run goes on from there, on this machine and with these
        versions, and has the same bits as if it had not been stopped. Delete it when the run is
        saved. FileError: it does not serve. FileWarning: it cannot be written.

        >>> from robsim import examples
        >>> experiment = load_scenario(examples.path("visp_tutorial"))
        >>> run = experiment.run(checkpoint="run.checkpoint")  # once more with resume=True
        """
        if changes:
            one = self.with_(**changes)
            how: dict[str, Any] = {"threads": threads, "chunk": chunk}
            return one.run(progress, checkpoint=checkpoint, resume=resume, **how)
        keeper = self._keeper(checkpoint, resume)
        how = {"threads": threads, "chunk": chunk, "progress": progress}
        with interrupt.defer_stops(begun=False) as stops, self._named():
            if not isinstance(self.task, ServoTask) and isinstance(
                self.task, SelfSimulatingTask
            ):  # faster so
                with self.keyed("task"):
                    result = self.task.simulated(self, checkpoint=keeper, **how)
                finished = True
            else:
                loop = self.loop()
                with self.keyed("task"):
                    finished = advance_loop(loop, checkpoints=keeper, **how)
                result = self.dataset(loop)
        if stops or not finished:
            raise Interrupted("stopped by the user; what was simulated so far is in .run", result)
        return result

    def _keeper(self, checkpoint: Any, resume: bool) -> CheckpointFile | None:
        """Return what keeps checkpoints, if any are wanted; that of a mission serves its phases."""
        if isinstance(checkpoint, CheckpointFile):
            return checkpoint
        again = as_bool(resume, "resume")
        if checkpoint is None:
            if again:
                raise InputError("resume: from which file? give checkpoint=path")
            return None
        with self._named():
            identity = self.identity
        with convert_os_errors(checkpoint, "keep"):
            return CheckpointFile(checkpoint, identity, again)

    def steps(self) -> Iterator[Instant]:
        """Yield the instants of a single run one by one, so that you may watch, or stop.

        The last one is that at which the run ends. InputError: a mission, or several starts.

        >>> from robsim import examples
        >>> experiment = load_scenario(examples.path("visp_tutorial"))
        >>> now = next(experiment.steps())
        >>> now.time, now.q.shape, now.outcome.name
        (0.0, (7,), 'RUNNING')
        """
        if isinstance(self.task, SelfSimulatingTask):
            raise InputError("steps: a mission has several runs; take the experiment of a phase")
        if np.ndim(self.start) > 1 or self.varied:
            raise InputError(
                "steps: one start is needed, and there are several runs: take of_run(i)"
            )
        with self._named():
            loop = self._loop_from_start()
        return iterate_instants(loop)

    def _loop_from_start(self) -> Loop:
        """Return the loop without a record; InputError if no start lets the task be done."""
        loop = self.with_(record="summary").loop()
        with self.keyed("task"):
            loop.controller.check_start(loop.q0)
        return loop

    def dataset(self, loop: Loop) -> xr.Dataset:
        """Return what a loop of this experiment has recorded."""
        from robsim.run.simulation_dataset import (
            make_dataset,  # of xarray, which a quick start does without
        )

        parts = self.task, self.sensing, self.actuation, self.endings
        if not (self.scene.tree.compiled and all(map(is_immutable, parts))):
            _ = self.origin  # written now: later a user's object may be another
        return make_dataset(loop, self, lambda: self.origin)

    def loop(
        self, numbers: NDArray[np.int64] | None = None, template: BatchTemplate | None = None
    ) -> Loop:
        """Return the loop that simulates this experiment; its runs may have numbers of their own.

        Else they follow one another. Noise is drawn by these. A template is that of an experiment
        which differs in what differs from run to run alone.
        """
        made: Any = self
        if self.varied:
            made = (template or BatchTemplate(self)).of(self.varied)
        with self.keyed("task"):
            controller = made.task.bind(made.scene)
        start = (
            check_starts(self.scene, self.scene.home, "home") if self.start is None else self.start
        )
        q0 = np.empty((self.runs, self.scene.nq))
        q0[:] = start
        steps = count_periods(self.dt, self.duration)
        single = start.ndim == 1 and not self.varied
        settings = self.hold, self.first_run, numbers, self.record, single
        with self.keyed():
            return Loop(
                controller,
                q0,
                self.dt,
                steps,
                self.seed,
                made.sensing,
                made.actuation,
                *settings,
                endings=self.endings,
                guard=make_command_guard(made, self.safety) if self.safety else None,
            )

    @property
    def runs(self) -> int:
        """The number of runs: of starts, or of numbers that differ from run to run."""
        if np.ndim(self.start) > 1:
            return len(self.start)
        return max((len(values) for values in self.varied.values()), default=1)

    def _check_runs(self) -> None:
        """Raise InputError unless there is a start for each run, or one for all."""
        what = "starts" if np.ndim(self.start) > 1 else "runs"
        if not isinstance(self.varied, Mapping):
            raise InputError(f"varied: expected {{name: numbers}}, got {format_value(self.varied)}")
        for name, values in self.varied.items():
            if len(values) != self.runs:
                raise InputError(
                    f"{self.runs} {what}, and {len(values)} numbers of {name}: each run needs both"
                )

    @cached_property
    def origin(self) -> dict[str, str]:
        """What a run says of its experiment: the text, or why there is none."""
        try:
            return {"scenario": self._one.to_toml(complete=True)}
        except InputError as reason:
            return {"scenario": "", "no_scenario": str(reason)}

    @property
    def _one(self) -> Experiment:
        """The experiment without what differs from run to run: a text is of one run."""
        several = bool(self.varied) or np.ndim(self.start) > 1
        return self.with_(start=None, varied={}) if several else self

    @property
    def identity(self) -> str:
        """The hash of all that the bits of its runs depend on; InputError: it has no text."""
        digest = hashlib.sha256(self._one.to_toml(complete=True).encode())
        for name, values in {"start": self.start, **self.varied}.items():
            array = np.ascontiguousarray(np.nan if values is None else values)
            digest.update(f"{name} {array.dtype} {array.shape}".encode() + array.tobytes())
        return digest.hexdigest()

    def _as(self, fields: Mapping[str, Any]) -> Experiment:
        """Return the experiment with other fields where they are not the same."""
        home = self.scene.home if self.start is None else self.start
        steps = count_periods(self.dt, self.duration)
        same = {
            "start": np.array_equal(home, fields["start"]),
            "duration": steps == count_periods(fields["dt"], fields["duration"]),
        }
        other = {
            name: value
            for name, value in fields.items()
            if not same.get(name, value == getattr(self, name))
        }
        return self.with_(**other) if other else self

    @contextmanager
    def keyed(self, *keys: str) -> Iterator[None]:
        """Put the keys of the file of this experiment, if any, in front of an error's path."""
        if not self.source:
            yield
            return
        try:
            with prefix_path(*keys):
                yield
        except GoalError as error:
            error.path = join_keys(
                error.path, *([] if isinstance(self.task, SelfSimulatingTask) else ["goal"])
            )
            raise

    @contextmanager
    def _named(self) -> Iterator[None]:
        """Put the name of the file, if any, in front of errors from inside."""
        if not self.source:
            yield
            return
        try:
            yield
        except InputError as error:
            kind = GoalError if isinstance(error, GoalError) else FileError
            raise kind(f"{self.source}: {error}") from None


def load_scenario(path: str | os.PathLike[str], set: Changes = ()) -> Experiment:
    """Return the experiment of a scenario file, with changes such as ["task.gain=2"].

    FileError: whatever is wrong, with the key and what would be valid.

    >>> from robsim import examples
    >>> load_scenario(examples.path("visp_tutorial"), ["task.gain=2", "run.dt=20 ms"]).dt
    0.02
    """
    return Experiment.from_text(read_toml_text(path), str(path), set)
