"""The parts of an experiment, checked, and the loop that they make."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import KW_ONLY, dataclass, field, fields, replace
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import flag, positive, whole
from robsim.base.errors import GoalError, InputError, naming, said
from robsim.base.values import Value, unchanging, unchecked
from robsim.declare.problems import joined, under
from robsim.engine.endings import ENDING_LIST, check_endings
from robsim.engine.loop import Loop
from robsim.engine.record import Record, every
from robsim.run.checks import a_task, of_kind, starts, whole_periods
from robsim.run.staged import Staged
from robsim.run.text import common_belief
from robsim.run.varied import Template, simulated
from robsim.servo.safety.guard import Guard
from robsim.servo.safety.safety import Safety
from robsim.servo.tasks.task import Task
from robsim.world.actuation import Actuation
from robsim.world.scene import Scene
from robsim.world.sensing import Sensing

PERFECT, EXACT = Sensing(), Actuation()
PARTS = {"scene", "task", "sensing", "actuation"}  # which are checked when they are made


@dataclass(frozen=True, eq=False)
class Setup(Value):
    """A scene, a task, a start, imperfections and settings: the fields of an `Experiment`."""

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
    source: str = field(default="", repr=False, compare=False)

    def __post_init__(self) -> None:
        for name, text in (
            ("title", "" if self.title is None else self.title),
            ("source", self.source),
        ):
            if not isinstance(text, str):
                raise InputError(f"{name}: expected a text, got {said(text)}")
        checked = {
            "scene": of_kind(self.scene, Scene, "scene"),
            "task": a_task(self.task, (Task, Staged)),
            "start": None if self.start is None else starts(self.scene, self.start, "start"),
            "sensing": of_kind(self.sensing, Sensing, "sensing"),
            "actuation": of_kind(self.actuation, Actuation, "actuation"),
            "safety": None if self.safety is None else of_kind(self.safety, Safety, "safety"),
            "endings": ENDING_LIST.check(self.endings, "endings"),
            "dt": positive(self.dt, "dt (seconds)"),
            "duration": positive(self.duration, "duration (seconds)"),
            "seed": whole(self.seed, "seed", 0, 2**64),
            "hold": flag(self.hold, "hold"),
            "first_run": whole(self.first_run, "first_run", 0, 2**62),
        }
        for name, value in checked.items():
            object.__setattr__(self, name, value)
        self._check_runs()
        check_endings(self.endings, self.scene)
        if self.safety is not None:
            with naming("safety"):
                self.safety.check(self.scene)
        every(self.record)
        with self.keyed("run", "duration"):
            whole_periods(self.dt, self.duration)

    @property
    def settings(self) -> dict[str, Any]:
        """The fields by name, without scene, task and start."""
        apart = ("scene", "task", "start", "varied", "source")
        return {
            each.name: getattr(self, each.name) for each in fields(self) if each.name not in apart
        }

    def with_(self, **changes: Any) -> Self:
        """Return a copy with other fields: `experiment.with_(task=PBVS(), dt=0.02)`.

        InputError: there is no such field.
        """
        names = [each.name for each in fields(self) if each.name != "source"]
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
        made = unchecked(made, **parts)
        if made.scene is not self.scene:
            made._check_scene()
        return made

    def _check_scene(self) -> None:
        """Raise InputError for numbers of the scene that do not go with the rest."""
        if self.start is not None:
            starts(self.scene, self.start, "start")
        if self.safety is not None:
            with naming("safety"):
                self.safety.check_margin(self.scene)
        check_endings([each for each in self.endings if not unchanging(each)], self.scene)

    def loop(
        self, numbers: NDArray[np.int64] | None = None, template: Template | None = None
    ) -> Loop:
        """Return the loop that simulates this experiment; its runs may have numbers of their own.

        Else they follow one another. Noise is drawn by these. A template is that of an experiment
        which differs in what differs from run to run alone.
        """
        made: Any = self
        if self.varied:
            made = simulated(self) if template is None else template.of(self.varied)
        with self.keyed("task"):
            controller = made.task.bind(made.scene)
        start = starts(self.scene, self.scene.home, "home") if self.start is None else self.start
        q0 = np.broadcast_to(start, (self.runs, self.scene.nq))
        steps = whole_periods(self.dt, self.duration)
        single = start.ndim == 1 and not self.varied
        settings = self.hold, self.first_run, numbers, self.record, single
        with self.keyed():
            return Loop(
                controller,
                np.ascontiguousarray(q0),
                self.dt,
                steps,
                self.seed,
                made.sensing,
                made.actuation,
                *settings,
                endings=self.endings,
                guard=guard_of(made, self.safety) if self.safety else None,
            )

    @contextmanager
    def keyed(self, *keys: str) -> Iterator[None]:
        """Put the keys of the file of this experiment, if any, in front of an error's path."""
        if not self.source:
            yield
            return
        try:
            with under(*keys):
                yield
        except GoalError as error:
            error.path = joined(error.path, *([] if isinstance(self.task, Staged) else ["goal"]))
            raise

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
            raise InputError(f"varied: expected {{name: numbers}}, got {said(self.varied)}")
        for name, values in self.varied.items():
            if len(values) != self.runs:
                raise InputError(
                    f"{self.runs} {what}, and {len(values)} numbers of {name}: each run needs both"
                )


def guard_of(made: Any, safety: Safety | None) -> Guard:
    """Return what keeps commands within a safety, in the scene that the task of `made` believes."""
    return Guard(safety or Safety(), common_belief(made.task) or made.scene)
