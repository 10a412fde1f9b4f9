"""The phase of a mission: a task, and the objects that are grasped or released before it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Annotated, Any, ClassVar

from robsim.base.arrays import Array
from robsim.base.errors import InputError, prefix_errors
from robsim.declare import DeclaredValue, Role, Text, Time, Word, described
from robsim.declare.context import Context, FieldValue, Raw
from robsim.declare.lists import Names
from robsim.declare.scalars import PlainValue
from robsim.declare.texts import FrameReference
from robsim.engine.outcome import Outcome
from robsim.servo.tasks.task import Task
from robsim.servo.tasks.task_choice import TASKS, TaskChoice
from robsim.world.scene import Scene

Outcomes = str | Outcome | Sequence[str | Outcome]  # stored as a tuple of `Outcome`


@dataclass(frozen=True)
class PhaseName(Text):
    """A name in words, such as "lift the front wheel". Dots are reserved for dotted names."""

    most: int = 64

    def find_violation(self, value: Any) -> str:
        fits = not super().find_violation(value) and value.strip() and value.isprintable()
        return "" if fits and "." not in value else self.words()

    def words(self) -> str:
        return f"a name without dots of 1 to {self.most} characters"


@dataclass(frozen=True)
class AttachmentTable(PlainValue):
    """A table {object: frame} of objects and the frames that carry them."""

    forms: ClassVar[tuple[str, ...]] = ("table",)
    phrase: ClassVar[str] = '{ object = "frame" }'
    json: ClassVar[Mapping[str, Any]] = {
        "type": "object",
        "additionalProperties": {"type": "string"},
    }

    def find_violation(self, value: Any) -> str:
        names = [*value, *value.values()] if isinstance(value, Mapping) else [None]
        return self.words() if any(map(FrameReference.find_violation, names)) else ""

    def convert_python_value(self, value: Any, what: str) -> Any:
        return dict(value) if isinstance(value, Mapping) else value

    def put(self, table: dict[str, Raw], name: str, value: Any, c: Context) -> None:
        if value:
            super().put(table, name, value, c)


@dataclass(frozen=True)
class OutcomeName(Word):
    """The name of an outcome, such as "joint_limit". Python code may also pass the `Outcome`."""

    choices: tuple[str, ...] = tuple(each.name.lower() for each in Outcome if each)
    noun: str = "outcome"

    def check(self, value: Any, what: str) -> Any:
        if isinstance(value, Outcome):
            return value
        return Outcome[super().check(value, what).upper()]

    def read(self, raw: Raw, c: Context) -> Any:
        return Outcome[super().read(raw, c).upper()]

    def write(self, value: Any, c: Context) -> str:
        return str(value.name.lower())


@described
@dataclass(frozen=True, eq=False)
class Phase(DeclaredValue):
    """One task of a mission, with the objects that are grasped or released at its start.

    At the start of the phase the objects of `release` stay in the world at their current poses, and
    the objects of `attach` are carried by their frames from their current poses. The phase succeeds
    if it ends with an outcome of `expects`. After an expected JOINT_LIMIT the next phase starts at
    the limit.

    Examples
    --------
    >>> from robsim import FollowJoints
    >>> lift = FollowJoints(by={"lift": 0.1}, duration=2.0)
    >>> Phase("lift", lift, attach={"cube": "arm.tool"})
    Phase('lift')
    """

    name: Annotated[str, PhaseName(), Role.LABEL, "Name, unique in the mission."]
    task: Annotated[Task, TaskChoice(TASKS, protocol=Task), "Control task of the phase."]
    duration: Annotated[
        float | None,
        Time(above=0),
        "Longest duration in seconds; None: the duration of the experiment.",
    ] = None
    attach: Annotated[
        Mapping[str, str],
        AttachmentTable(),
        "Objects to grasp at the start, each with the frame that carries it.",
    ] = field(default_factory=dict)
    release: Annotated[
        Sequence[str], Names(least=0), "Objects to release into the world at the start."
    ] = ()
    expects: Annotated[
        Outcomes, Names(OutcomeName()), "Outcome, or outcomes, with which the phase succeeds."
    ] = Outcome.CONVERGED

    def __post_init__(self) -> None:
        with prefix_errors(f"phase {self.name!r}"):
            super().__post_init__()
            both = sorted(set(self.release) & set(self.attach))
            if both:
                raise InputError(f"attach and release of '{both[0]}' at once")

    facts_from: ClassVar[tuple[str, ...]] = ("release", "attach")

    @classmethod
    def facts(cls, own: Mapping[str, FieldValue], c: Context) -> Context:
        """Return the context with the scene after the grasps and releases of all phases so far.

        Only the parts of this scene matter: the units of joints do not depend on poses.
        """
        stage = c.facts.get("stage", {"scene": c.facts.get("scene")})
        if (scene := stage["scene"]) is None:
            return c
        with c.problems.at(*c.path, "release"):
            scene = reattach_objects(scene, own.get("release", ()), {}, scene.home)
        with c.problems.at(*c.path, "attach"):
            scene = reattach_objects(scene, (), own.get("attach", {}), scene.home)
        stage["scene"] = scene
        return c.with_facts(scene=scene)

    def __repr__(self) -> str:
        return f"Phase({self.name!r})"

    def change_attachments(self, scene: Scene, q: Array) -> Scene:
        """Return the scene after the grasps and releases of this phase, at q (nq,)."""
        return reattach_objects(scene, self.release, self.attach, q)


def reattach_objects(
    scene: Scene, release: Sequence[str], attach: Mapping[str, str], q: Array
) -> Scene:
    """Return the scene with released and attached objects; InputError for an unknown name."""
    for thing in release:
        scene = scene.released(thing, q)
    for thing, frame in attach.items():
        scene = scene.attached(thing, frame, q)
    return scene
