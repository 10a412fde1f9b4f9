"""The text of an experiment: a scene, a task, a start, imperfections, and how long it runs."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, fields, replace
from functools import partial
from pathlib import Path
from typing import Annotated, Any, ClassVar

import numpy as np

from robsim.base.errors import FileError, InputError
from robsim.declare import Flag, Integer, OneOf, Role, Table, Text, Time, Word, fields_of
from robsim.declare.fields import is_identical
from robsim.declare.problems import Problems, UnreadableValue
from robsim.declare.spec import (
    MISSING,
    Context,
    NoTextError,
    PythonValue,
    Raw,
    Spec,
    UnwritableChange,
    make_expected_error,
)
from robsim.declare.tables import get_table_keys, read_table, write_table
from robsim.engine.endings import ENDING_LIST
from robsim.engine.recorder import LONGEST
from robsim.files.robot_library import load_origin_robot
from robsim.files.toml import write_toml
from robsim.run.beliefs import find_common_belief, replace_beliefs
from robsim.run.start_table import StartTable
from robsim.servo.goals.goal import describe_start, parse_start
from robsim.servo.safety.safety import SAFETY_TABLE
from robsim.servo.tasks.belief_spec import BeliefSpec
from robsim.servo.tasks.task_choice import TASKS, TaskChoice
from robsim.world.actuation import Actuation
from robsim.world.scene import Scene
from robsim.world.sensing import Sensing

SCENE = get_table_keys(Scene)
SCENE_SPEC, BELIEF = Table(Scene), BeliefSpec()


RECORD = OneOf(
    Word(("all", "summary")),
    Integer(1),
    words='"all", "summary" or a whole number n, to keep every n-th step',
)


@dataclass(frozen=True)
class RunTable:
    """The control period and duration of a run, its seed, and what is recorded."""

    dt: Annotated[float | None, Time(above=0), "Control period."] = None
    duration: Annotated[float | None, Time(above=0), "Longest duration of a run."] = None
    seed: Annotated[int | None, Integer(0, 2**64 - 1), "Seed of all random numbers."] = None
    hold: Annotated[bool | None, Flag(), "Whether a run goes on after convergence."] = None
    record: Annotated[Any, RECORD, "Instants that are recorded."] = None
    first_run: Annotated[
        int | None, Integer(0, 2**62 - 1), "Number of the first run, for its noise."
    ] = None

    @classmethod
    def text_check(cls, raw: Mapping[str, Raw], c: Context) -> None:
        """Report more steps than a run can have."""
        dt, duration = c.facts["own"].get("dt") or 0.04, c.facts["own"].get("duration") or 10.0
        if duration / dt > LONGEST:
            c.report(
                f"duration {duration:g} s in periods of {dt:g} s are more than {LONGEST} steps"
            )


RUN = tuple(each.name for each in fields_of(RunTable))


@dataclass(frozen=True)
class ExperimentBelief(BeliefSpec):
    """The belief of all tasks, which is read before them."""

    def pick(self, table: Mapping[str, Raw], name: str, c: Context) -> Any:
        return MISSING


@dataclass(frozen=True)
class ForeignTable(Spec):
    """A table that is no part of the experiment, and is read by who knows it."""

    form: ClassVar[str] = "table"
    phrase: ClassVar[str] = "a table"
    json: ClassVar[Mapping[str, Any]] = {"type": "object"}

    def read(self, raw: Raw, c: Context) -> Any:
        if not isinstance(raw, Mapping):
            raise make_expected_error(self.words(), raw)
        return MISSING


@dataclass(frozen=True)
class TaskTable:
    """The part of a text that is not its scene."""

    stands: ClassVar[Mapping[str, str]] = {"run": ""}

    task: Annotated[Any, TaskChoice(TASKS, whole=True), "Task of the robots."]
    title: Annotated[str | None, Text(), Role.LABEL, "Description in one line."] = None
    belief: Annotated[
        Any,
        ExperimentBelief(),
        "Scene as the controller believes it, where it differs from the true one.",
    ] = None
    start: Annotated[Any, Table(StartTable, StartTable), "Start of the run."] = None
    sensing: Annotated[Any, Table(Sensing), "Imperfections of the images."] = None
    actuation: Annotated[Any, Table(Actuation), "Imperfections of the joints."] = None
    safety: Annotated[Any, SAFETY_TABLE, "Limits that every command is kept within."] = None
    endings: Annotated[Any, ENDING_LIST, "Conditions on which a run ends."] = ()
    run: Annotated[Any, Table(RunTable, RunTable), "Periods, duration and record of the run."] = (
        None
    )
    study: Annotated[Any, ForeignTable(), "Study of many runs of it, for `robsim study`."] = None


@dataclass(frozen=True)
class ExperimentTable(TaskTable):
    """The whole text of an experiment: a scene, and what is done in it."""

    scene: Annotated[Any, Table(Scene, flat=True), "What there is."] = None


def read_experiment(tables: Mapping[str, Raw], source: str, old: Any = None) -> dict[str, Any]:
    """Return the fields of an experiment from tables, or of an old one that they change.

    FileError: with all that is wrong.
    """
    problems, folder = Problems(source), Path(source).parent
    c = Context(
        problems, facts={"library": partial(load_origin_robot, folder=folder), "belief": None}
    )
    raw = {key: each for key, each in tables.items() if key in SCENE}
    over = c if old is None else c.changing(old.scene)
    scene = old.scene if old is not None and not raw else over.tried(SCENE_SPEC, raw)
    c = c.knowing(scene=None if scene is MISSING else scene)
    rest = {key: each for key, each in tables.items() if key not in SCENE}
    made = _read_all_but_scene(rest, c, old)
    problems.stop()
    if made is None:  # of an object in a place of texts that has no words
        raise FileError(f"{source}: a value is of a kind that a text cannot hold there")
    return made


def _read_all_but_scene(raw: Mapping[str, Raw], c: Context, old: Any) -> dict[str, Any] | None:
    """Return the fields of an experiment from all tables but those of its scene, which is known."""
    scene, table, shared = c.facts["scene"], MISSING, None
    if scene is not None and old is not None:
        task = _rebase_beliefs(old, scene, c)
        shared = find_common_belief(task)
        if "belief" in raw:
            gone = raw["belief"] == PythonValue(None)
            believed = None if gone else c.at("belief", over=shared).tried(BELIEF, raw["belief"])
            task = replace_beliefs(task, lambda one: believed if is_identical(one, shared) else one)
            shared = believed
        table = replace(make_task_table(old), task=task)
    elif scene is not None and "belief" in raw:
        c = c.knowing(belief=c.at("belief").tried(BELIEF, raw["belief"]))
    found: Any = MISSING
    with suppress(UnreadableValue):
        found = read_table(TaskTable, raw, c.changing(table), *SCENE)
    if found is MISSING or scene is None:
        return None
    start = old.start if old is not None and "start" not in raw else _read_start(found, scene, c)
    if isinstance(raw.get("task"), PythonValue):  # which believes as the task before
        own_task = replace_beliefs(found.task, lambda one: shared if one is None else one)
        found = replace(found, task=own_task)
    names = ("task", "title", "sensing", "actuation", "safety", "endings")
    own = {**{name: getattr(found, name) for name in names}, **vars(found.run or RunTable())}
    return {"scene": scene, "start": start, **{k: x for k, x in own.items() if x is not None}}


def _read_start(found: TaskTable, scene: Scene, c: Context) -> Any:
    """Return the start that a table says; None where it says nothing."""
    table: StartTable = found.start or StartTable()
    with c.problems.at("start"):
        return parse_start(table.q, table.pose, scene, "q")
    return None


def _rebase_beliefs(old: Any, scene: Scene, c: Context) -> Any:
    """Return the task of an old experiment, whose beliefs differ from a new scene as before."""

    def believed(one: Scene | None) -> Scene | None:
        if one is None or scene is old.scene:
            return one
        try:
            raw = write_table(one, c.knowing(scene=old.scene, short=True).changing(old.scene))
        except (UnwritableChange, NoTextError):
            return one
        found: Scene | None = c.at("belief").tried(BELIEF, raw)
        return found

    return replace_beliefs(old.task, believed)


def make_task_table(of: Any) -> TaskTable:
    """Return the table of an experiment without its scene, in which nothing is left out."""
    run = RunTable(**{name: getattr(of, name) for name in RUN})
    parts = {name: getattr(of, name) for name in ("sensing", "actuation", "safety", "endings")}
    start = StartTable(*describe_start(of.start, of.scene))
    return TaskTable(of.task, of.title, start=start, **parts, run=run)


def write_experiment(of: Any, **facts: Any) -> dict[str, Raw]:
    """Return the tables of an experiment, exactly; NoText if it holds somebody's Python code.

    With the fact `brief` the tables leave out what need not be said, with `short` they say robots
    and a belief by what differs.
    """
    c = Context(Problems("<text>"), facts={"scene": of.scene, **facts})
    belief = find_common_belief(of.task)
    said = replace(
        make_task_table(of),
        start=None if of.start is None else StartTable(of.start),
        sensing=None if of.sensing == Sensing() else of.sensing,
        actuation=None if of.actuation == Actuation() else of.actuation,
        run=_make_run_table(of, bool(facts.get("brief"))),
    )
    tables = {**write_table(of.scene, c), **write_table(said, c.knowing(apart=belief is None))}
    if belief is not None:
        tables["belief"] = BELIEF.write(belief, c)
    return tables


def _make_run_table(of: Any, brief: bool) -> RunTable | None:
    """Return the table of the settings; where it is brief, of those that are not the usual ones."""
    usual = {each.name: each.default for each in fields(of)}
    own = {name: getattr(of, name) for name in RUN}
    gone = {name for name in RUN if own[name] == usual[name] and (brief or name == "first_run")}
    kept = {name: None if name in gone else value for name, value in own.items()}
    return None if len(gone) == len(RUN) else RunTable(**kept)


def write_complete_text(of: Any) -> str:
    """Return the exact TOML text of an experiment.

    InputError: it is made of Python code that no text can hold, or is of several runs.
    """
    if of.varied:
        raise InputError("a text is of one run, and numbers differ from run to run: of_run(i)")
    if np.ndim(of.start) > 1:
        raise InputError(f"a text holds one start, not a batch of shape {np.shape(of.start)}")
    try:
        return write_toml(write_experiment(of))
    except NoTextError as reason:
        raise InputError(f"this experiment has no text: {reason}") from None
