"""The experiment: a frozen value with all data of a run."""

from __future__ import annotations

import hashlib
import math
import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import KW_ONLY, dataclass, field, fields, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Generic, Self, TypeVar, cast, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from robsim.base import interrupt
from robsim.base.arrays import Array, as_bool, as_integer, as_positive
from robsim.base.atomic_files import convert_os_errors
from robsim.base.errors import (
    CodeError,
    FileError,
    GoalError,
    InputError,
    Interrupted,
    check_known,
    format_value,
    prefix_errors,
)
from robsim.base.parameter_names import name_parameters
from robsim.base.value import Value, is_immutable, replace_unchecked
from robsim.declare.context import MISSING, FieldValue
from robsim.declare.controls import Control
from robsim.declare.problems import join_keys, prefix_path
from robsim.declare.scalars import LARGEST
from robsim.engine.endings import ENDING_LIST, Ending, check_endings
from robsim.engine.instant import Instant, iterate_instants
from robsim.engine.loop import Loop
from robsim.engine.recorder import Record, parse_record
from robsim.engine.start_visibility import check_start_visibility
from robsim.engine.workers import Progress, advance_loop, check_workers
from robsim.files.overrides import Changes
from robsim.files.toml import Tables, read_toml_text
from robsim.geometry.content_reference import DIGEST_KEY
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
    check_belief_name,
    make_command_guard,
    replace_numbers,
    yield_experiment_controls,
)
from robsim.run.experiment_text import write_complete_text
from robsim.run.mission_protocol import SelfSimulatingTask
from robsim.run.mission_run import MissionRun
from robsim.run.provenance import get_run_attributes, read_run_settings
from robsim.run.ros_connection import RosConnection
from robsim.run.run_checks import check_instance, check_starts, check_task, count_periods
from robsim.run.stored_data import (
    StoredData,
    StoredValue,
    find_stored_data,
    pack_stored_data,
    unpack_stored_data,
    write_stored_value,
)
from robsim.servo.safety.safety import Safety
from robsim.servo.tasks.task import ServoTask, Task
from robsim.world.actuation import Actuation
from robsim.world.scene import Scene
from robsim.world.sensing import Sensing

if TYPE_CHECKING:
    import xarray as xr
    from typing_extensions import TypeVar as DefaultTypeVar

    from robsim.engine.simulated_cell import SimulatedCell
    from robsim.files.flat_table import RunDataset

    AnyTask = Task | SelfSimulatingTask
    # Any: the task of a file is unknown until it is read
    TaskT_co = DefaultTypeVar("TaskT_co", bound=AnyTask, covariant=True, default=Any)
    OtherTask = TypeVar("OtherTask", bound=AnyTask)
else:
    TaskT_co = TypeVar("TaskT_co", covariant=True)

Coordinates = ArrayLike | Mapping[str, ArrayLike]
PERFECT, EXACT = Sensing(), Actuation()
PARTS = {
    "scene",
    "task",
    "sensing",
    "actuation",
}  # fields that check themselves when they are created


@name_parameters
@dataclass(frozen=True, eq=False, repr=False)
class Experiment(Value, Generic[TaskT_co]):
    """Scene, task, start, imperfections and duration of a run, as one frozen value.

    An experiment is the unit that RobSim runs, stores and compares. `run` simulates it, `with_` and
    `at` return changed copies, `to_toml` writes it as a scenario file, and `hash` identifies it.
    Two experiments are equal if all their fields but `study` and `source` are equal.

    Parameters
    ----------
    scene : Scene
        Robots, objects and cameras, as they truly are.
    task : Task or Mission
        Control task. With a `Mission`, `run` returns a `MissionRun`.
    start : array_like of shape (nq,) or (B, nq), or dict, optional
        Coordinates at the start, a batch of B starts, or {robot: q}. Default: the home
        configuration.
    sensing : Sensing, optional
        Errors of the images. Default: exact images without delay.
    actuation : Actuation, optional
        Errors of the joints. Default: joints that follow every command exactly.
    safety : Safety, optional
        Limits within which every command is kept. Default: no limits.
    endings : sequence of Ending, optional
        Further conditions that end a run, such as `Region` or `TooClose`.
    dt : float, default 0.04
        Control period in seconds. A command is held for one period.
    duration : float, default 10.0
        Longest duration of a run in seconds. It is rounded up to whole periods.
    seed : int, default 0
        Seed of all random numbers.
    hold : bool, default False
        Whether a run continues after convergence until the end of the duration.
    record : {"all", "summary"} or int, default "all"
        Recorded steps: all, every n-th, or only the end of each run.
    first_run : int, default 0
        Number of the first run. The noise of a run depends on its number and the seed.
    title : str, optional
        Title in one line.
    ros2 : RosConnection, optional
        Topics and names of messages, for `robsim ros2`. It has no effect on a run.
    varied : dict, optional
        Numbers that differ from run to run. Use `vary`, which checks them.
    study : dict, optional
        Table of a study in the scenario file. It has no effect on a run.
    source : str, optional
        File name in error messages.

    Raises
    ------
    InputError
        If a field is not valid, or if the fields do not fit each other.

    See Also
    --------
    simulate : Simulate a scene and a task in one call.
    load_scenario : Return the experiment of a scenario file.

    Examples
    --------
    >>> from robsim import examples
    >>> experiment = load_scenario(examples.path("visp_tutorial"))
    >>> experiment.at("task.gain", 2.0).task.gain, experiment.with_(dt=0.02).dt
    (2.0, 0.02)
    """

    scene: Scene
    task: TaskT_co
    start: Array | None = None
    _: KW_ONLY
    sensing: Sensing = PERFECT
    actuation: Actuation = EXACT
    safety: Safety | None = None
    endings: tuple[Ending, ...] = ()
    dt: float = 0.04
    duration: float = 10.0
    seed: int = 0
    hold: bool = False
    record: Record = "all"
    first_run: int = 0
    title: str | None = None
    ros2: RosConnection | None = None
    varied: Mapping[str, Array] = field(
        default_factory=dict, repr=False
    )  # set by `Experiment.vary`
    study: Tables | None = field(default=None, repr=False, compare=False)  # of the scenario file
    source: str = field(default="", repr=False, compare=False)

    if TYPE_CHECKING:  # accepted types; the fields have the stored types

        def __init__(
            self,
            scene: Scene,
            task: TaskT_co,
            start: Coordinates | None = None,
            *,
            sensing: Sensing = PERFECT,
            actuation: Actuation = EXACT,
            safety: Safety | None = None,
            endings: Ending | Sequence[Ending] = (),
            dt: float = 0.04,
            duration: float = 10.0,
            seed: int = 0,
            hold: bool = False,
            record: Record = "all",
            first_run: int = 0,
            title: str | None = None,
            ros2: RosConnection | None = None,
            varied: Mapping[str, ArrayLike] = ...,
            study: Tables | None = None,
            source: str = "",
        ) -> None: ...

    def __post_init__(self) -> None:
        for name, text in (
            ("title", "" if self.title is None else self.title),
            ("source", self.source),
        ):
            if not isinstance(text, str):
                raise InputError(f"{name}: expected a text, got {format_value(text)}")
        checked = {
            "scene": check_instance(self.scene, Scene, "scene"),
            "task": check_task(self.task, Task, SelfSimulatingTask),
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
            "ros2": None if self.ros2 is None else check_instance(self.ros2, RosConnection, "ros2"),
        }
        for name, value in checked.items():
            object.__setattr__(self, name, value)
        self._check_runs()
        check_endings(self.endings, self.scene)
        if self.safety is not None:
            with prefix_errors("safety"):
                self.safety.check(self.scene)
        if self.ros2 is not None:
            with prefix_errors("ros2"):
                self.ros2.check(self.scene)
        parse_record(self.record)
        with self.prefix_error_keys("run", "duration"):
            count_periods(self.dt, self.duration)

    def __repr__(self) -> str:
        """Return a few lines: the scene, the task, and the settings."""
        return experiment_overview.format_experiment(self)

    def _repr_html_(self) -> str:
        """Return a table for notebooks."""
        return experiment_overview.format_experiment_html(self)

    @classmethod
    def from_text(
        cls,
        text: str,
        source: str = "<text>",
        set: Changes = (),
        *,
        stored_data: Iterable[StoredValue] = (),
    ) -> Self:
        """Return the experiment of a TOML text.

        Parameters
        ----------
        text : str
            Text of a scenario file.
        source : str, default "<text>"
            File name in error messages. Paths in the text are relative to its folder.
        set : dict or sequence of str, optional
            Changes, such as {"task.gain": "2"} or ["task.gain=2"].
        stored_data : sequence of GreyPicture or TriangleMesh, optional
            Pictures and meshes that the text names by their SHA-256. Others are read from the files
            that the text names, and from the folders `pictures` and `meshes` beside `source`.

        Returns
        -------
        Experiment
            The experiment of the text.

        Raises
        ------
        FileError
            If the text is not valid. The message gives the key and the valid values.

        Examples
        --------
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
        known = StoredData({each.digest: each for each in stored_data})
        experiment = cls._from_fields(read_experiment_text(text, source, known=known), source)
        return (
            cls._from_fields(apply_changes(experiment, changes), source) if changes else experiment
        )

    @classmethod
    def _from_fields(cls, parts: Mapping[str, Any], source: str) -> Self:
        """Return the experiment of the fields of a text; InputError if they do not fit."""
        try:
            return cls(**parts, source=source)
        except InputError as error:
            if not source:
                raise
            raise FileError(f"{source}: {error}") from None

    @classmethod
    def of(cls, run: xr.Dataset | MissionRun) -> Experiment:
        """Return the experiment that produced a run.

        Parameters
        ----------
        run : xarray.Dataset or MissionRun
            Run, batch, or selection of consecutive runs of a batch.

        Returns
        -------
        Experiment
            The experiment, with the start and the numbers of these runs.

        Raises
        ------
        InputError
            If the run stores no experiment.

        Examples
        --------
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
        data = unpack_stored_data(attributes.get("stored_data", ""))
        stored = cls.from_text(text, "scenario of the run", stored_data=data)
        if isinstance(stored.task, SelfSimulatingTask):
            return stored
        whole_run = cast(Any, run)
        repeated = stored._with_different(read_run_settings(whole_run))
        varied = {name: whole_run[name].values for name in attributes.get("varied", "").split()}
        if not varied:
            return repeated
        return repeated.vary(varied) if "run" in whole_run.dims else repeated.at(varied)

    @property
    def settings(self) -> dict[str, FieldValue]:
        """The fields by name, without scene, task, start and `varied`."""
        apart = ("scene", "task", "start", "varied", "study", "source")
        return {
            each.name: getattr(self, each.name) for each in fields(self) if each.name not in apart
        }

    @overload
    def with_(self, *, task: OtherTask, **changes: Any) -> Experiment[OtherTask]: ...

    @overload
    def with_(self, **changes: Any) -> Self: ...

    def with_(self, **changes: Any) -> Experiment:  # Any: a field may hold a value of any type
        """Return a copy with other fields.

        Parameters
        ----------
        **changes
            New values of fields, such as ``task=PBVS(), dt=0.02``.

        Returns
        -------
        Experiment
            The copy.

        Raises
        ------
        InputError
            If a field does not exist, or if its value is not valid.

        Examples
        --------
        >>> from robsim import PBVS, examples
        >>> experiment = load_scenario(examples.path("visp_tutorial"))
        >>> type(experiment.with_(task=PBVS(), dt=0.02).task).__name__
        'PBVS'
        """
        names = [each.name for each in fields(self) if each.name not in ("study", "source")]
        for name in changes:
            check_known(name, names, "no field {}", "fields")
        return replace(self, **changes)

    def revised(self, **changes: Any) -> Self:  # Any: as in `with_`
        """Return a copy with other fields; scene and parts differ only in numbers."""
        rest = {name: x for name, x in changes.items() if name not in PARTS}
        copy = replace(self, **rest) if rest else self
        parts = {name: changes[name] for name in changes.keys() & PARTS}
        if not parts:
            return copy
        copy = replace_unchecked(copy, **parts)
        if copy.scene is not self.scene:
            copy._check_scene()
        return copy

    def _check_scene(self) -> None:
        """Raise InputError if numbers of the scene do not fit the other fields."""
        if self.start is not None:
            check_starts(self.scene, self.start, "start")
        if self.safety is not None:
            with prefix_errors("safety"):
                self.safety.check_margin(self.scene)
        check_endings([each for each in self.endings if not is_immutable(each)], self.scene)

    def at(self, name: str | Mapping[str, FieldValue], value: FieldValue = MISSING) -> Self:
        """Return a copy with other values at dotted names.

        A change of the true scene also changes the belief of the task, if both had the same value
        before.

        Parameters
        ----------
        name : str or dict
            Dotted name, such as "task.gain", "run.dt", "cameras.eye.focal" or
            "belief.robots.arm.links.elbow.dh.a"; or several names with their values, {name: value}.
        value : object
            Number in SI units, text as in a scenario file ("20 ms"), or object (`rs.PBVS()`). None
            restores the default. Omit it only if `name` is a dict.

        Returns
        -------
        Experiment
            The copy.

        Raises
        ------
        InputError
            If the name does not exist (the message gives the nearest name), if the value is missing
            or not valid, or if the values are given twice.

        Examples
        --------
        >>> from robsim import examples
        >>> experiment = load_scenario(examples.path("visp_tutorial"))
        >>> experiment.at({"task.gain": 2.0, "run.dt": "20 ms"}).dt
        0.02
        """
        if not isinstance(name, str | Mapping):
            raise InputError(
                f"expected a dotted name such as 'task.gain', got {format_value(name)}"
            )
        if isinstance(name, str) and value is MISSING:
            raise InputError(
                f"{name}: expected a value, at({name!r}, value); None restores the default"
            )
        if isinstance(name, Mapping) and value is not MISSING:
            raise InputError(f"{format_value(name)} has the values; omit {format_value(value)}")
        changes = dict(name) if isinstance(name, Mapping) else {name: value}
        for each in changes:
            check_belief_name(each)
        try:
            copy: Self = replace_numbers(self, changes)
        except NOT_BY_PATH:  # the text reader may accept the value; else it raises a better error
            copy = self._change_by_text(changes)
        varied = {each: x for each, x in self.varied.items() if each not in changes}
        return copy if varied == self.varied else copy.with_(varied=varied)

    def _change_by_text(self, changes: Mapping[str, Any]) -> Self:
        """Return a copy with these changes, made by the reader of scenario files.

        Its errors do not name the file, which does not contain the changes.
        """
        for name, value in changes.items():
            if isinstance(value, float) and LARGEST < abs(value) < math.inf:
                limits = f"between {-LARGEST:g} and {LARGEST:g}"
                raise InputError(f"{name}: expected a number {limits}, got {format_value(value)}")
        several = self._has_many_starts  # a text holds one start only
        one = replace(self, start=None, varied={}) if several else replace(self, varied={})
        pairs = parse_dotted_changes(changes, "")
        copy = self._from_fields(apply_changes(one, pairs, python=True), "")
        start = self.start if several else copy.start
        return replace(copy, start=start, varied=self.varied, source=self.source)

    def controls(self) -> list[Control]:
        """Return the values that a user interface can edit, each with its range and unit.

        Returns
        -------
        list of Control
            Values of the task, the settings, the believed scene and the true scene. The method
            `changes` of a control returns the argument of `at` for a new value.

        Examples
        --------
        >>> from robsim import examples, load_scenario
        >>> experiment = load_scenario(examples.path("visp_tutorial"))
        >>> gain = next(each for each in experiment.controls() if each.path == "task.gain")
        >>> gain.value, gain.unit, gain.meaning
        (0.5, 'per second', 'Decay rate of e, in 1/s: a constant, or adaptive.')
        >>> experiment.at(gain.changes(2.0)).task.gain
        2.0
        """
        return list(yield_experiment_controls(self))

    def vary(self, numbers: Mapping[str, ArrayLike]) -> Self:
        """Return a copy with many runs and with numbers that differ from run to run.

        One controller is bound for all runs: 10,000 runs with 10,000 calibrations take little
        longer than 10,000 runs with one calibration. `of_run(i)` returns the experiment of a single
        run; its result has the same bits. The Dataset of the run has a variable for each name.

        Parameters
        ----------
        numbers : dict of str to array_like of shape (runs, ...)
            Numbers in SI units by the dotted names of `at`: intrinsics, distortion and pose of
            cameras, marks and pose of objects, pose of robots, constants of links
            ("belief.robots.arm.links.elbow.dh.a"), each true or believed; "task.gain",
            "task.depth_scale", "actuation.lag", "sensing.noise", "sensing.latency" and others. The
            start is common to all runs, or there is one for each run.

        Returns
        -------
        Experiment
            The copy, with as many runs as there are numbers.

        Raises
        ------
        InputError or FileError
            If the number of a name cannot differ from run to run, or if a value is not valid.

        Examples
        --------
        >>> from robsim import examples, load_scenario
        >>> experiment = load_scenario(examples.path("calibration_errors"))
        >>> wrong = experiment.vary({"belief.cameras.camera.focal": [490, 500, 510]})
        >>> wrong.run(record="summary").distance_to_goal.values.round(3)
        array([0.02, 0.  , 0.02])
        """
        return self.with_(varied={**self.varied, **check_batch_numbers(self, numbers)})

    def of_run(self, number: int) -> Self:
        """Return the experiment of a single run.

        Parameters
        ----------
        number : int
            Index of the run among the runs of this experiment, from 0.

        Returns
        -------
        Experiment
            Experiment of one run; its result has the bits of that run in the batch.

        Raises
        ------
        InputError
            If the experiment has fewer runs.
        """
        i = as_integer(number, "run", 0, self.runs)
        numbers = {name: values[i] for name, values in self.varied.items()}
        one = self.with_(varied={}).at(numbers) if numbers else self
        start = self.start
        if start is not None and start.ndim > 1:
            start = start[i]
        return one.with_(start=start, first_run=self.first_run + i)

    @property
    def text(self) -> str:
        """The TOML text of this experiment, as `to_toml` returns it."""
        return self.to_toml()

    def to_toml(self, *, complete: bool = False, folder: str | os.PathLike[str] = ".") -> str:
        """Return the experiment as TOML text; reading the text returns an equal experiment.

        The text is as short as a person would write it: a robot of the library or of a URDF file is
        stored by its name with the changes, and a belief by its differences from the scene. Numbers
        are exact, in the units that make them shortest. If no short text reproduces the experiment,
        the text is complete.

        Parameters
        ----------
        complete : bool, default False
            Whether to write every default, and robots link by link. A complete text needs no
            library and no URDF file, which may change; use it for archives.
        folder : str or path, default "."
            Folder of the file to be written. Paths of URDF files are relative to it.

        Returns
        -------
        str
            TOML text.

        Raises
        ------
        InputError
            If the experiment contains Python code, several starts, or numbers that differ from run
            to run.

        Examples
        --------
        >>> from robsim import examples, load_scenario
        >>> experiment = load_scenario(examples.path("eye_in_hand")).at("task.gain", 2)
        >>> text = experiment.to_toml()
        >>> len(text.splitlines()) < 40 < 400 < len(experiment.to_toml(complete=True).splitlines())
        True
        """
        whole = write_complete_text(self)
        return whole if complete else write_brief_text(self, Path(folder)) or whole

    @cached_property
    def stored_data(self) -> dict[str, StoredValue]:
        """The pictures and meshes that the complete text names, by their SHA-256.

        Raises
        ------
        InputError
            If the experiment has no text.
        """
        return find_stored_data(self._single_run)

    def write_stored_data(self, folder: str | os.PathLike[str]) -> list[Path]:
        """Write the pictures and meshes that a text of this experiment names by their SHA-256 only.

        A text in `folder` is then complete: `load_scenario` finds the data beside it.

        Parameters
        ----------
        folder : str or path
            Folder of the text. Pictures are written into its folder `pictures` as PNG files, meshes
            into its folder `meshes`.

        Returns
        -------
        list of Path
            The files, none for an experiment whose pictures and meshes are files that have not
            changed.

        Raises
        ------
        FileError
            If a file cannot be written.

        Examples
        --------
        >>> from robsim import examples
        >>> load_scenario(examples.path("visp_tutorial")).write_stored_data(".")
        []
        """
        if not self.stored_data:
            return []
        text = self._single_run.to_toml(folder=folder)
        named = (each for digest, each in self.stored_data.items() if digest in text)
        return [write_stored_value(each, Path(folder)) for each in named]

    @cached_property
    def hash(self) -> str:
        """The first 16 hexadecimal digits of the SHA-256 of the complete text.

        Raises
        ------
        InputError
            If the experiment has no text.
        """
        return hashlib.sha256(self.to_toml(complete=True).encode()).hexdigest()[:16]

    def check(self, *, view: bool = True) -> None:
        """Check task, start and settings as `run` does, without running.

        Parameters
        ----------
        view : bool, default True
            Whether it is an error if a camera does not see its target at the start. In a run it is
            an outcome at the first step.

        Raises
        ------
        GoalError, FileError or InputError
            If `run` would raise it, or `view` is neither True nor False.
        """
        view = as_bool(view, "view")
        with self._named_errors():
            if isinstance(self.task, SelfSimulatingTask):
                with self.prefix_error_keys("task"):
                    self.task.checked(self, view=view)
                return
            loop = self.loop_from_start()
            if view:
                check_start_visibility(loop)

    # The kind of task of a file is unknown: the first overload is for these experiments, too.
    @overload
    def run(
        self: Experiment[Task],
        progress: Progress | None = ...,
        *,
        threads: int | None = ...,
        chunk: int = ...,
        checkpoint: str | os.PathLike[str] | CheckpointFile | None = ...,
        resume: bool = ...,
        **changes: Any,
    ) -> RunDataset: ...

    @overload
    def run(
        self: Experiment[SelfSimulatingTask],
        progress: Progress | None = ...,
        *,
        threads: int | None = ...,
        chunk: int = ...,
        checkpoint: str | os.PathLike[str] | CheckpointFile | None = ...,
        resume: bool = ...,
        **changes: Any,
    ) -> MissionRun: ...

    def run(
        self,
        progress: Progress | None = None,
        *,
        threads: int | None = None,
        chunk: int = 256,
        checkpoint: str | os.PathLike[str] | CheckpointFile | None = None,
        resume: bool = False,
        **changes: Any,  # Any: as in `with_`
    ) -> RunDataset | MissionRun:
        """Simulate the experiment and return the run.

        Parameters
        ----------
        progress : callable, optional
            Function that is called repeatedly with the finished share, from 0 to 1.
        threads : int, optional
            Number of threads. Default: one for each processor. It does not change the result.
        chunk : int, default 256
            Largest number of runs that advance in lockstep. It does not change the result.
        checkpoint : str or path, optional
            File for the state, written about every ten seconds and at an interruption.
            Delete it when the run is saved.
        resume : bool, default False
            Whether to continue from the checkpoint. On the same machine and with the same versions,
            the bits do not depend on the interruption.
        **changes
            Fields that differ for this run, as in `with_`.

        Returns
        -------
        xarray.Dataset or MissionRun
            The recorded run. It stores the text of the experiment, so that `replay` can repeat it.
            Of a mission, a `MissionRun`.

        Raises
        ------
        Interrupted
            If the user stops the simulation. Its attribute `run` is the run so far.
        FileError
            If the checkpoint does not belong to this experiment and these versions.

        Warns
        -----
        FileWarning
            If a checkpoint cannot be written, or comes from another processor.

        Examples
        --------
        >>> from robsim import examples
        >>> experiment = load_scenario(examples.path("visp_tutorial"))
        >>> run = experiment.run(checkpoint="run.checkpoint")  # once more with resume=True
        """
        if changes:
            one: Experiment = self.with_(**changes)
            how: dict[str, Any] = {"threads": threads, "chunk": chunk}
            run: RunDataset | MissionRun = one.run(
                progress, checkpoint=checkpoint, resume=resume, **how
            )
            return run
        threads, chunk = check_workers(threads, chunk, progress)  # not errors of the file
        keeper = self._make_checkpoint_file(checkpoint, resume)
        how = {"threads": threads, "chunk": chunk, "progress": progress}
        result: RunDataset | MissionRun
        with interrupt.defer_stops(begun=False) as stops, self._named_errors():
            # the test of the class is fast, the test of the protocol is slow
            if not isinstance(self.task, ServoTask) and isinstance(self.task, SelfSimulatingTask):
                with self.prefix_error_keys("task"):
                    result = self.task.simulated(self, checkpoint=keeper, **how)
                finished = True
            else:
                loop = self.loop()
                with self.prefix_error_keys("task"):
                    finished = advance_loop(loop, checkpoints=keeper, **how)
                result = self.dataset(loop)
        if stops or not finished:
            raise Interrupted("stopped by the user; the run so far is in .run", result)
        return result

    def _make_checkpoint_file(self, checkpoint: Any, resume: bool) -> CheckpointFile | None:
        """Return the writer of checkpoints, or None. All phases of a mission share one."""
        if isinstance(checkpoint, CheckpointFile):
            return checkpoint
        again = as_bool(resume, "resume")
        if checkpoint is None:
            if again:
                raise InputError("resume: from which file? pass checkpoint=path")
            return None
        with self._named_errors():
            identity = self.identity
        with convert_os_errors(checkpoint, "keep"):
            return CheckpointFile(checkpoint, identity, again)

    def steps(self) -> Iterator[Instant]:
        """Yield the control instants of a single run one by one.

        Use it to observe a run, or to stop it on a condition of your own.

        Yields
        ------
        Instant
            State, command and outcome at one control instant. The last instant is the end of the
            run.

        Raises
        ------
        InputError
            If the task is a mission, or if there are several runs.

        Examples
        --------
        >>> from robsim import examples
        >>> experiment = load_scenario(examples.path("visp_tutorial"))
        >>> now = next(experiment.steps())
        >>> now.time, now.q.shape, now.outcome.name
        (0.0, (7,), 'RUNNING')
        """
        self._check_single_run("steps")
        with self._named_errors():
            loop = self.loop_from_start()
        return iterate_instants(loop)

    def _check_single_run(self, what: str) -> None:
        """Raise InputError, which names `what`, unless there is a single run of one controller."""
        if isinstance(self.task, SelfSimulatingTask):
            raise InputError(f"{what}: a mission has several runs; take the experiment of a phase")
        if self._has_many_starts or self.varied:
            raise InputError(
                f"{what}: one start is needed, and there are several runs: take of_run(i)"
            )

    def cell(self) -> SimulatedCell:
        """Return the simulated robots and cameras without the controller, for commands of your own.

        The cell has the imperfections of the experiment. With the commands of a `Controller` it
        moves as the run of the experiment, bit for bit.

        Returns
        -------
        SimulatedCell
            Cell at the start.

        Raises
        ------
        InputError
            If there are several runs, or the task is a mission.

        Examples
        --------
        >>> import robsim as rs
        >>> experiment = load_scenario(rs.examples.path("eye_in_hand"))
        >>> cell, controller = experiment.cell(), rs.Controller(experiment)
        >>> while cell.now.step < 100:
        ...     command = controller.step(cell.now.pixels, cell.now.measured, cell.now.time)
        ...     now = cell.advance(command.velocities)
        >>> bool((now.q == experiment.run().q[100].values).all())
        True
        """
        from robsim.engine.simulated_cell import SimulatedCell  # late: few programs need it

        self._check_single_run("cell")
        with self._named_errors():
            return SimulatedCell(self.loop_from_start())

    def loop_from_start(self) -> Loop:
        """Return the loop without a record; InputError if the task cannot begin at a start."""
        loop = self.with_(record="summary").loop()
        with self.prefix_error_keys("task"):
            loop.controller.check_start(loop.q0)
        return loop

    def dataset(self, loop: Loop) -> RunDataset:
        """Return the record of a loop of this experiment as a Dataset."""
        from robsim.run.simulation_dataset import make_dataset  # late: the import of xarray is slow

        return make_dataset(loop, self)

    def loop(
        self, numbers: NDArray[np.int64] | None = None, template: BatchTemplate | None = None
    ) -> Loop:
        """Return the loop that simulates this experiment.

        `numbers` are the numbers of the runs, which determine their noise; by default they are
        consecutive. `template` is the `BatchTemplate` of an experiment that differs only in the
        varied numbers.
        """
        simulated: Any = self
        if self.varied:
            simulated = (template or BatchTemplate(self)).of(self.varied)
        with self.prefix_error_keys("task"):
            controller = simulated.task.bind(simulated.scene)
        start = (
            check_starts(self.scene, self.scene.home, "home") if self.start is None else self.start
        )
        q0 = np.empty((self.runs, self.scene.nq))
        q0[:] = start
        steps = count_periods(self.dt, self.duration)
        single = start.ndim == 1 and not self.varied
        settings = self.hold, self.first_run, numbers, self.record, single
        with self.prefix_error_keys():
            return Loop(
                controller,
                q0,
                self.dt,
                steps,
                self.seed,
                simulated.sensing,
                simulated.actuation,
                *settings,
                endings=self.endings,
                guard=make_command_guard(simulated, self.safety) if self.safety else None,
            )

    @property
    def runs(self) -> int:
        """The number of runs: the number of starts, or of values that differ from run to run."""
        if self.start is not None and self.start.ndim > 1:
            return len(self.start)
        return max((len(values) for values in self.varied.values()), default=1)

    @property
    def _has_many_starts(self) -> bool:
        """Whether there is a batch of starts."""
        return self.start is not None and self.start.ndim > 1

    def _check_runs(self) -> None:
        """Raise InputError unless there is a start for each run, or one for all."""
        what = "starts" if self._has_many_starts else "runs"
        if not isinstance(self.varied, Mapping):
            raise InputError(f"varied: expected {{name: numbers}}, got {format_value(self.varied)}")
        for name, values in self.varied.items():
            if len(values) != self.runs:
                counts = f"{len(values)} numbers for {self.runs} {what}"
                raise InputError(f"{name}: {counts}; expected one for each run")

    @cached_property
    def origin(self) -> dict[str, str]:
        """The attributes of a run that store its experiment, or the reason why it has no text."""
        try:
            text = self._single_run.to_toml(complete=True)
            named = self.stored_data if DIGEST_KEY in text else {}  # the search is fast
            data = pack_stored_data(named.values())
        except InputError as reason:
            return {"scenario": "", "no_scenario": str(reason)}
        return {"scenario": text, **({"stored_data": data} if data else {})}

    @property
    def _single_run(self) -> Experiment:
        """The experiment without the numbers that differ from run to run: a text holds one run."""
        several = bool(self.varied) or self._has_many_starts
        return self.with_(start=None, varied={}) if several else self

    @property
    def identity(self) -> str:
        """The hash of all data that determine the bits of the runs; InputError without a text."""
        digest = hashlib.sha256(self._single_run.to_toml(complete=True).encode())
        for name, values in {"start": self.start, **self.varied}.items():
            array = np.ascontiguousarray(np.nan if values is None else values)
            digest.update(f"{name} {array.dtype} {array.shape}".encode() + array.tobytes())
        return digest.hexdigest()

    def _with_different(self, fields: Mapping[str, Any]) -> Experiment:
        """Return the experiment with these fields; equal fields keep their objects."""
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
    def prefix_error_keys(self, *keys: str) -> Iterator[None]:
        """Prepend keys of the scenario file, if there is one, to the path of an inner error."""
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
    def _named_errors(self) -> Iterator[None]:
        """Prepend the name of the file, if there is one, to inner errors."""
        if not self.source:
            yield
            return
        try:
            yield
        except CodeError:
            raise
        except InputError as error:
            kind = GoalError if isinstance(error, GoalError) else FileError
            raise kind(f"{self.source}: {error}") from None


def load_scenario(path: str | os.PathLike[str], set: Changes = ()) -> Experiment:
    """Return the experiment of a scenario file.

    Parameters
    ----------
    path : str or path
        TOML file. `examples.path(name)` returns the path of an example of RobSim.
    set : dict or sequence of str, optional
        Changes, such as {"task.gain": "2"} or ["task.gain=2"].

    Returns
    -------
    Experiment
        The experiment of the file.

    Raises
    ------
    FileError
        If the file cannot be read or is not valid. The message gives the key and the valid values.

    Examples
    --------
    >>> from robsim import examples
    >>> load_scenario(examples.path("visp_tutorial"), ["task.gain=2", "run.dt=20 ms"]).dt
    0.02
    """
    return Experiment.from_text(read_toml_text(path), str(path), set)
