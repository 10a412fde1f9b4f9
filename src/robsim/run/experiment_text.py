"""The text form of an experiment: scene, task, start, imperfections and settings."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, fields, replace
from functools import partial
from pathlib import Path
from typing import Annotated, Any, ClassVar

import numpy as np

from robsim.base.errors import InputError
from robsim.declare import Flag, Integer, OneOf, Role, Table, Text, Time, Word, fields_of
from robsim.declare.context import MISSING, Context, NoTextError, PythonValue, Raw, UnwritableChange
from robsim.declare.fields import is_identical
from robsim.declare.joint_numbers import PerJoint, get_coordinate_axes
from robsim.declare.problems import Problems, UnreadableValue
from robsim.declare.spec import Spec, make_expected_error
from robsim.declare.tables import PartTable, get_table_keys, read_table, write_table
from robsim.engine.endings import ENDING_LIST
from robsim.engine.recorder import LONGEST
from robsim.files.robot_library import load_origin_robot
from robsim.files.toml import write_toml
from robsim.geometry.pose import Pose
from robsim.geometry.pose_table import FLAT_POSE
from robsim.run.beliefs import find_common_belief, replace_beliefs
from robsim.run.ros_connection import ROS_TABLE
from robsim.servo.goals.goal import describe_start, describe_start_exactly, parse_start
from robsim.servo.safety.safety import SAFETY_TABLE
from robsim.servo.tasks.belief_spec import BeliefSpec
from robsim.servo.tasks.task_choice import TASKS, TaskChoice
from robsim.world.actuation import Actuation
from robsim.world.scene import Scene
from robsim.world.sensing import Sensing

SCENE = get_table_keys(Scene)
SCENE_SPEC, BELIEF = PartTable(Scene), BeliefSpec()


RECORD = OneOf(
    Word(("all", "summary")),
    Integer(1),
    words='"all", "summary" or a whole number n, to keep every n-th step',
)


@dataclass(frozen=True)
class StartTable:
    """The start of a run; the home configuration if the table is empty."""

    rivals: ClassVar[Any] = ((("q",), ("pose",)),)

    q: Annotated[
        Any, PerJoint(get_coordinate_axes), "Coordinates at the start, one number for each."
    ] = None
    pose: Annotated[
        Pose | None, FLAT_POSE, "Pose at the start, for a scene with a single floating joint."
    ] = None

    @classmethod
    def of(cls, value: Any, c: Context) -> StartTable:
        """Return the table of a start in a scene."""
        return cls(*describe_start(value, c.facts["scene"]))

    def build_value(self, c: Context) -> Any:
        """Return the coordinates of the start."""
        return parse_start(self.q, self.pose, c.facts["scene"], "q")


@dataclass(frozen=True)
class RunTable:
    """The control period, duration, seed and record of a run."""

    dt: Annotated[float | None, Time(above=0), "Control period."] = None
    duration: Annotated[float | None, Time(above=0), "Longest duration of a run."] = None
    seed: Annotated[int | None, Integer(0, 2**64 - 1), "Seed of all random numbers."] = None
    hold: Annotated[bool | None, Flag(), "Whether a run continues after convergence."] = None
    record: Annotated[Any, RECORD, "Instants that are recorded."] = None
    first_run: Annotated[
        int | None, Integer(0, 2**62 - 1), "Number of the first run, which determines its noise."
    ] = None

    @classmethod
    def text_check(cls, raw: Mapping[str, Raw], c: Context) -> None:
        """Report an error if there are more steps than a run can have."""
        dt, duration = c.facts["own"].get("dt") or 0.04, c.facts["own"].get("duration") or 10.0
        if duration / dt > LONGEST:
            c.report(
                f"duration {duration:g} s in periods of {dt:g} s are more than {LONGEST} steps"
            )


RUN = tuple(each.name for each in fields_of(RunTable))
PARTS = "sensing", "actuation", "safety", "endings", "ros2"  # fields with a table of their own


@dataclass(frozen=True)
class ForeignTable(Spec):
    """A table that is not part of the experiment and is read by other code."""

    forms: ClassVar[tuple[str, ...]] = ("table",)
    phrase: ClassVar[str] = "a table"
    json: ClassVar[Mapping[str, Any]] = {"type": "object"}

    def read(self, raw: Raw, c: Context) -> Any:
        if not isinstance(raw, Mapping):
            raise make_expected_error(self.words(), raw)
        return MISSING


@dataclass(frozen=True)
class TaskTable:
    """The part of a text without its scene."""

    stands: ClassVar[Mapping[str, str]] = {"run": ""}

    task: Annotated[Any, TaskChoice(TASKS, whole=True), "Task of the robots."]
    title: Annotated[str | None, Text(), Role.LABEL, "Description in one line."] = None
    belief: Annotated[
        Any, BELIEF, "Differences of the scene that the controller believes in from the true scene."
    ] = None
    start: Annotated[Any, Table(StartTable, StartTable), "Start of the run."] = None
    sensing: Annotated[Any, Table(Sensing), "Imperfections of the images."] = None
    actuation: Annotated[Any, Table(Actuation), "Imperfections of the joints."] = None
    safety: Annotated[Any, SAFETY_TABLE, "Limits within which every command is kept."] = None
    endings: Annotated[Any, ENDING_LIST, "Further conditions that end a run."] = ()
    run: Annotated[Any, Table(RunTable, RunTable), "Period, duration and record of the run."] = None
    ros2: Annotated[Any, ROS_TABLE, Role.MESSAGE, "Topics and names of ROS 2 messages."] = None
    study: Annotated[Any, ForeignTable(), "Study of many runs, for `robsim study`."] = None


@dataclass(frozen=True)
class ExperimentTable(TaskTable):
    """The whole text of an experiment: the scene, and all other tables."""

    scene: Annotated[Any, Table(Scene, flat=True), "Robots, objects and cameras."] = None


def read_experiment(
    tables: Mapping[str, Raw], source: str, old: Any = None, in_file: bool = True, **facts: Any
) -> dict[str, Any]:
    """Return the fields of an experiment from tables, or from changes to an old experiment.

    An error lists all problems. It is a FileError that names the source, unless the tables are not
    `in_file`. The fact `known` is an object with the `stored_data` that the text names by SHA-256,
    by default the old experiment.
    """
    problems, folder = Problems(source if in_file else ""), Path(source).parent
    own = {"folder": folder, "text_file": source.endswith(".toml"), "known": old}
    c = Context(problems, facts={"belief": None, **own, **facts})
    c = c.with_facts(library=partial(load_origin_robot, folder=folder))
    raw = {key: each for key, each in tables.items() if key in SCENE}
    over = c if old is None else c.with_old_value(old.scene)
    scene = old.scene if old is not None and not raw else SCENE_SPEC.read_or_report(raw, over)
    c = c.with_facts(scene=None if scene is MISSING else scene)
    rest = {key: each for key, each in tables.items() if key not in SCENE}
    # an old task cannot refer to a scene with problems
    own_fields = None if old and scene is MISSING else _read_all_but_scene(rest, c, old)
    if own_fields is None and not problems.lines:  # an object of a kind without a text form
        problems.add("", "a value has a class that a text cannot represent there")
    problems.stop()
    return own_fields or {}


def _read_all_but_scene(raw: Mapping[str, Raw], c: Context, old: Any) -> dict[str, Any] | None:
    """Return the fields of an experiment from all tables but the scene, which is known."""
    scene, table, shared = c.facts["scene"], MISSING, None
    if scene is not None and old is not None:
        task = _rebase_beliefs(old, scene, c)
        shared = find_common_belief(task)
        if "belief" in raw:
            believed = None
            if raw["belief"] != PythonValue(None):
                believed = BELIEF.read_or_report(raw["belief"], c.at("belief", over=shared))
            task = replace_beliefs(task, lambda one: believed if is_identical(one, shared) else one)
            shared = believed
        table = replace(make_task_table(old), task=task)
    elif scene is not None and "belief" in raw:
        c = c.with_facts(belief=BELIEF.read_or_report(raw["belief"], c.at("belief")))
    task_part, rest = MISSING, {key: each for key, each in raw.items() if key != "belief"}
    with suppress(UnreadableValue):
        task_part = read_table(TaskTable, rest, c.with_old_value(table), *SCENE)
    if task_part is MISSING or scene is None:
        return None
    keeps_start = old is not None and "start" not in raw
    start = old.start if keeps_start else _read_start(task_part, scene, c)
    if isinstance(raw.get("task"), PythonValue):  # a new object keeps the belief of the old one
        own_task = replace_beliefs(task_part.task, lambda one: shared if one is None else one)
        task_part = replace(task_part, task=own_task)
    names = ("task", "title", *PARTS)
    own = {
        **{name: getattr(task_part, name) for name in names},
        **vars(task_part.run or RunTable()),
    }
    return {"scene": scene, "start": start, **{k: x for k, x in own.items() if x is not None}}


def _read_start(table_of_task: TaskTable, scene: Scene, c: Context) -> Any:
    """Return the start of a table; None if its pose or coordinates are not valid."""
    table: StartTable = table_of_task.start or StartTable()
    with c.problems.at("start"):
        return parse_start(table.q, table.pose, scene, "q")
    return None


def _rebase_beliefs(old: Any, scene: Scene, c: Context) -> Any:
    """Return the old task with beliefs that differ from the new scene as from the old scene."""

    def believed(one: Scene | None) -> Scene | None:
        if one is None or scene is old.scene:
            return one
        try:
            raw = write_table(
                one, c.with_facts(scene=old.scene, short=True).with_old_value(old.scene)
            )
        except (UnwritableChange, NoTextError):
            return one
        new_belief: Scene | None = BELIEF.read_or_report(raw, c.at("belief"))
        return new_belief

    return replace_beliefs(old.task, believed)


def make_task_table(of: Any) -> TaskTable:
    """Return the complete table of an experiment without its scene."""
    run = RunTable(**{name: getattr(of, name) for name in RUN})
    parts = {name: getattr(of, name) for name in PARTS}
    start = StartTable(*describe_start(of.start, of.scene))
    return TaskTable(of.task, of.title, start=start, **parts, run=run)


def write_experiment(of: Any, **facts: Any) -> dict[str, Raw]:
    """Return the exact tables of an experiment; NoTextError if it contains a user's Python code.

    With the fact `brief`, the tables omit defaults. With `short`, robots and beliefs are written as
    differences from their sources. A dict `stored_data` gets the pictures and meshes that the
    tables name by their SHA-256.
    """
    c = Context(Problems("<text>"), facts={"scene": of.scene, **facts})
    belief = find_common_belief(of.task)
    describe = describe_start_exactly if facts.get("short") else lambda q, scene: (q,)
    task_part = replace(
        make_task_table(of),
        start=None if of.start is None else StartTable(*describe(of.start, of.scene)),
        sensing=None if of.sensing == Sensing() else of.sensing,
        actuation=None if of.actuation == Actuation() else of.actuation,
        run=_make_run_table(of, bool(facts.get("brief"))),
    )
    tables = {
        **write_table(of.scene, c),
        **write_table(task_part, c.with_facts(apart=belief is None)),
    }
    if belief is not None:
        tables["belief"] = BELIEF.write(belief, c)
    return tables


def _make_run_table(of: Any, brief: bool) -> RunTable | None:
    """Return the table of the settings; if `brief`, without defaults."""
    defaults = {each.name: each.default for each in fields(of)}
    omitted = RUN if brief else ("first_run",)  # if they have their defaults
    own = {name: getattr(of, name) for name in RUN}
    kept = {name: x for name, x in own.items() if name not in omitted or x != defaults[name]}
    return RunTable(**kept) if kept else None


def write_complete_text(of: Any) -> str:
    """Return the exact TOML text of an experiment.

    Raise InputError if it contains Python code, several starts, or numbers that differ from run to
    run.
    """
    if of.varied:
        raise InputError("a text holds one run, and numbers differ from run to run: use of_run(i)")
    if np.ndim(of.start) > 1:
        raise InputError(f"a text holds one start, not a batch of shape {np.shape(of.start)}")
    try:
        return write_toml(write_experiment(of))
    except NoTextError as reason:
        raise InputError(f"this experiment has no text: {reason}") from None
