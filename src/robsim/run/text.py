"""The text of an experiment: a scene, a task, a start, imperfections, and how long it runs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Annotated, Any, ClassVar

import numpy as np

from robsim.base.errors import FileError, InputError, said
from robsim.declare import Flag, Role, Table, Text, Time, Whole, fields_of
from robsim.declare.problems import Broken, Problems
from robsim.declare.spec import MISSING, Context, Live, NoText, Raw, Spec, expected
from robsim.declare.tables import keys_of, merge_table, read_table, write_table
from robsim.engine.endings import ENDING_LIST
from robsim.engine.record import LONGEST
from robsim.files.library import expanded
from robsim.files.toml import write
from robsim.geometry.pose_table import PoseTable
from robsim.run.start_table import StartTable
from robsim.servo.goals.goal import start_of
from robsim.servo.safety.safety import SAFETY
from robsim.servo.tasks.belief import Belief
from robsim.servo.tasks.family import TASKS, TaskChoice
from robsim.world.actuation import Actuation
from robsim.world.scene import Scene
from robsim.world.sensing import Sensing

SCENE = keys_of(Scene)


@dataclass(frozen=True)
class RecordSpec(Spec):
    """The choice of what is recorded of a run."""

    form: ClassVar[str] = "plain"

    def read(self, raw: Raw, c: Context) -> Any:
        whole = isinstance(raw, int) and not isinstance(raw, bool) and raw >= 1
        if whole or raw in ("all", "summary"):
            return raw
        raise InputError(f"{said(raw)}: expected {self.words()}")

    def write(self, value: Any, c: Context) -> Any:
        return value if isinstance(value, str) else int(value)

    def words(self) -> str:
        return '"all", "summary" or a whole number n, to keep every n-th step'

    def schema(self, define: Any) -> dict[str, Any]:
        return {"anyOf": [{"enum": ["all", "summary"]}, {"type": "integer", "minimum": 1}]}


@dataclass(frozen=True)
class RunTable:
    """The control period and duration of a run, its seed, and what is recorded."""

    dt: Annotated[float | None, Time(above=0), "Control period."] = None
    duration: Annotated[float | None, Time(above=0), "Longest duration of a run."] = None
    seed: Annotated[int | None, Whole(0, 2**64 - 1), "Seed of all random numbers."] = None
    hold: Annotated[bool | None, Flag(), "Whether a run goes on after convergence."] = None
    record: Annotated[Any, RecordSpec(), "Instants that are recorded."] = None
    first_run: Annotated[
        int | None, Whole(0, 2**62 - 1), "Number of the first run, for its noise."
    ] = None

    @classmethod
    def text_check(cls, raw: Mapping[str, Raw], c: Context) -> None:
        """Report more steps than a run can have."""
        own = c.facts["own"]
        dt, duration = own.get("dt", 0.04), own.get("duration", 10.0)
        if duration / dt > LONGEST:
            c.report(
                f"duration {duration:g} s in periods of {dt:g} s are more than {LONGEST} steps"
            )


@dataclass(frozen=True)
class BeliefTables(Spec):
    """The belief of all tasks: tables as those of the scene, which differ from it."""

    form: ClassVar[str] = "table"

    def read(self, raw: Raw, c: Context) -> Any:
        raise NotImplementedError  # it is read before all else: see `read_experiment`

    def pick(self, table: Mapping[str, Raw], name: str, c: Context) -> Any:
        return MISSING

    def words(self) -> str:
        return "tables as those of the scene: [[belief.cameras]]"

    def schema(self, define: Any) -> dict[str, Any]:
        reference: dict[str, Any] = define.changes(Scene, complete={"type": "boolean"})
        return reference

    def merge(self, old: Raw, new: Raw, loose: bool) -> Raw:
        return merge_table(Scene, old, new, True)

    def inside(self) -> Sequence[type[Any]]:
        return (Scene,)


@dataclass(frozen=True)
class Aside(Spec):
    """A table that is no part of the experiment, and is read by who knows it."""

    form: ClassVar[str] = "table"

    def read(self, raw: Raw, c: Context) -> Any:
        if not isinstance(raw, Mapping):
            raise expected(self.words(), raw)
        return MISSING

    def words(self) -> str:
        return "a table"

    def schema(self, define: Any) -> dict[str, Any]:
        return {"type": "object"}

    def merge(self, old: Raw, new: Raw, loose: bool) -> Raw:
        if not isinstance(old, Mapping) or not isinstance(new, Mapping):
            return new
        return {**old, **{key: self.merge(old.get(key), raw, loose) for key, raw in new.items()}}


@dataclass(frozen=True)
class TaskTable:
    """The part of a text that is not its scene."""

    stands: ClassVar[Mapping[str, str]] = {"run": ""}

    task: Annotated[Any, TaskChoice(TASKS, whole=True), "Task of the robots."]
    title: Annotated[str | None, Text(), Role.LABEL, "Description in one line."] = None
    belief: Annotated[
        Any,
        BeliefTables(),
        "Scene as the controller believes it, where it differs from the true one.",
    ] = None
    start: Annotated[Any, Table(StartTable, StartTable), "Start of the run."] = None
    sensing: Annotated[Any, Table(Sensing), "Imperfections of the images."] = None
    actuation: Annotated[Any, Table(Actuation), "Imperfections of the joints."] = None
    safety: Annotated[Any, SAFETY, "Limits that every command is kept within."] = None
    endings: Annotated[Any, ENDING_LIST, "Conditions on which a run ends."] = ()
    run: Annotated[Any, Table(RunTable, RunTable), "Periods, duration and record of the run."] = (
        None
    )
    study: Annotated[Any, Aside(), "Study of many runs of it, for `robsim study`."] = None


@dataclass(frozen=True)
class ExperimentTable(TaskTable):
    """The whole text of an experiment: a scene, and what is done in it."""

    robots: Annotated[Any, fields_of(Scene)[0].spec, "Robots of the scene."] = ()
    objects: Annotated[
        Any, fields_of(Scene)[1].spec, "Objects that cameras look at, or that stand in the scene."
    ] = ()
    cameras: Annotated[Any, fields_of(Scene)[2].spec, "Cameras where they are mounted."] = ()
    motions: Annotated[
        Any, fields_of(Scene)[3].spec, "Motions of robots that no task commands."
    ] = ()
    display: Annotated[
        Any, PoseTable(), Role.FIGURE, "Pose of the world in the frame of the figures."
    ] = None


def read_experiment(tables: Mapping[str, Raw], source: str) -> dict[str, Any]:
    """Return the fields of an experiment from tables; FileError with all that is wrong."""
    problems, folder = Problems(source), Path(source).parent
    tables = {**tables, "robots": expanded(tables.get("robots", []), problems, folder, "robots")}
    c = Context(problems)
    scene = c.tried(Table(Scene), {key: tables[key] for key in SCENE if key in tables})
    scene = None if scene is MISSING else scene

    def believed(raw: Raw, at: Context) -> Scene:
        return _belief(tables, raw, at, folder)

    c = c.knowing(scene=scene, believed=believed, belief=None)
    rest = {key: raw for key, raw in tables.items() if key not in SCENE}
    if "belief" in rest and scene is not None:
        c = c.knowing(belief=_tried(believed, rest["belief"], c.at("belief")))
    found: Any = MISSING
    with suppress(Broken):
        found = read_table(TaskTable, rest, c, *SCENE)
    made = None if found is MISSING or scene is None else _fields(scene, found, c)
    problems.stop()
    if made is None:  # of an object in a place of texts that has no words
        raise FileError(f"{source}: a value is of a kind that a text cannot hold there")
    belief, task = c.facts["belief"], made["task"]
    if belief is not None and isinstance(rest.get("task"), Live) and hasattr(task, "belief"):
        made["task"] = replace(task, belief=belief)  # which reading a table gives to other tasks
    return made


def write_experiment(of: Any, live: bool = False, **facts: Any) -> dict[str, Raw]:
    """Return the tables of an experiment, exactly; NoText if it holds somebody's Python code.

    With `live`, what no text can say stands in the tables as the object that it is. With the fact
    `brief` the tables leave out what need not be said.
    """
    c = Context(Problems("<text>"), facts={"scene": of.scene, "live": live, **facts})
    belief = common_belief(of.task)
    said = TaskTable(
        of.task,
        of.title,
        start=None if of.start is None else StartTable(of.start),
        sensing=None if of.sensing == Sensing() else of.sensing,
        actuation=None if of.actuation == Actuation() else of.actuation,
        safety=of.safety,
        endings=of.endings,
        run=_run_table(of, bool(facts.get("brief"))),
    )
    tables = {**write_table(of.scene, c), **write_table(said, c.knowing(apart=belief is None))}
    if belief is not None:
        tables["belief"] = Belief().write(belief, c)
    return tables


def _run_table(of: Any, brief: bool) -> RunTable | None:
    """Return the table of the settings; where it is brief, of those that are not the usual ones."""
    usual = {each.name: each.default for each in fields(of)}
    own = {name: getattr(of, name) for name in RUN}
    gone = {name for name in RUN if own[name] == usual[name] and (brief or name == "first_run")}
    kept = {name: None if name in gone else value for name, value in own.items()}
    return None if len(gone) == len(RUN) else RunTable(**kept)


RUN = tuple(each.name for each in fields_of(RunTable))


def _fields(scene: Scene, found: TaskTable, c: Context) -> dict[str, Any] | None:
    start: StartTable = found.start or StartTable()
    made = {"scene": scene, "task": found.task, "title": found.title, "start": None}
    with c.problems.at("start"):
        made["start"] = start_of(start.q, start.pose, scene, "q")
    for name in ("sensing", "actuation", "safety", "endings"):
        if getattr(found, name):
            made[name] = getattr(found, name)
    given = vars(found.run or RunTable())
    return {**made, **{name: value for name, value in given.items() if value is not None}}


def _belief(truth: Mapping[str, Raw], raw: Raw, c: Context, folder: Path) -> Scene:
    """Return the believed scene: what a table says over what is true, or alone if complete."""
    if not isinstance(raw, Mapping):
        raise InputError(f"must be a table, as in [[belief.cameras]], got {said(raw)}")
    rest = {key: part for key, part in raw.items() if key != "complete"}
    complete = raw.get("complete", False)
    if not isinstance(complete, bool):
        c.at("complete").report(str(expected("a valid boolean", complete)))
    if complete is not True:
        rest = _over(truth, rest)
    robots = expanded(rest.get("robots", []), c.problems, folder, *c.path, "robots")
    scene: Scene = read_table(Scene, {**rest, "robots": robots}, c)
    return scene


def _over(truth: Mapping[str, Raw], rest: Mapping[str, Raw]) -> dict[str, Raw]:
    """Return the tables of the true scene with those of a belief over them."""
    true = {key: truth[key] for key in SCENE if key in truth}
    merged: dict[str, Raw] = merge_table(Scene, true, rest, False)
    return merged


def _tried(believed: Any, raw: Raw, c: Context) -> Any:
    with c.problems.at(*c.path):
        return believed(raw, c)
    return None


def common_belief(task: Any) -> Scene | None:
    """Return what all servo tasks within a task believe; None if nothing, or not the same."""
    each = beliefs(task)
    return each[0] if each and all(_same(one, each[0]) for one in each) else None


def beliefs(task: Any) -> list[Scene | None]:
    """Return what each servo task within a task believes; None where that is the truth."""
    if hasattr(task, "inner"):
        return [belief for each in task.inner for belief in beliefs(each)]
    return [task.belief] if hasattr(task, "belief") else []


def _same(a: Scene | None, b: Scene | None) -> bool:
    """Return whether two beliefs are one to the last bit: -0.0 is not 0.0."""
    if a is None or b is None or a is b:
        return a is b
    return a == b and repr(_tables(a)) == repr(_tables(b))


def _tables(scene: Scene) -> dict[str, Raw]:
    c = Context(Problems("<text>"), facts={"scene": scene, "live": True})
    return write_table(scene, c)


def complete_text(of: Any) -> str:
    """Return the exact TOML text of an experiment.

    InputError: it is made of Python code that no text can hold, or is of several runs.
    """
    if of.varied:
        raise InputError("a text is of one run, and numbers differ from run to run: of_run(i)")
    if np.ndim(of.start) > 1:
        raise InputError(f"a text holds one start, not a batch of shape {np.shape(of.start)}")
    try:
        return write(write_experiment(of))
    except NoText as reason:
        raise InputError(f"this experiment has no text: {reason}") from None
