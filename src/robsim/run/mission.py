"""Missions: one task after the other, with things grasped and let go between them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar

import numpy as np

from robsim.base.arrays import Array
from robsim.base.errors import InputError, Interrupted
from robsim.declare import Declared, ListOf, Table, register
from robsim.declare.spec import Context, Raw
from robsim.run.mission_run import Leg, MissionRun
from robsim.run.outcome import Outcome
from robsim.run.phase import Phase, named
from robsim.run.simulate import Progress, check, check_progress, simulate
from robsim.run.text import text_of
from robsim.world.scene import Scene

MOST = 1000  # phases


@register("task", "mission")
@dataclass(frozen=True, eq=False)
class Mission(Declared):
    """Phases, one after the other; the first that goes wrong is the last.

    It stands where a task stands in an `Experiment`, whose run is then a `MissionRun`. Each phase
    is a run of its own: it starts where the one before it ended, its joints at rest, and what moves
    on its own goes on at constant rates. Duration, hold and record of the experiment are those of
    each phase.

    >>> from robsim import Experiment, FollowJoints, Scene, robots
    >>> arm = robots.planar_2r()
    >>> there = Phase("there", FollowJoints(to=[0.5, 0.5], duration=1.0))
    >>> back = Phase("back", FollowJoints(by=[-0.5, -0.5], duration=1.0))
    >>> print(Experiment(Scene(arm), Mission([there, back])).run())
        0.00 s  there  converged
        1.00 s  back   converged
    """

    outermost: ClassVar[bool] = True  # no phase is a mission, nor is a part of another task

    phases: Annotated[
        Any, ListOf(Table(Phase), 1, MOST, alone=True), "What is done one after the other."
    ]

    def __post_init__(self) -> None:
        super().__post_init__()
        names = [phase.name for phase in self.phases]
        twice = next((name for name in names if names.count(name) > 1), None)
        if twice is not None:
            raise InputError(f"two phases are called {twice!r}")

    @classmethod
    def text_facts(cls, raw: Mapping[str, Raw], c: Context) -> Context:
        """Let each phase see what the phases before it have grasped and let go."""
        return c.knowing(stage={"scene": c.facts.get("scene")})

    @classmethod
    def written_facts(cls, value: Mission, c: Context) -> Context:
        """Likewise of a mission that is written."""
        return c.knowing(stage={"scene": c.facts["scene"]})

    @property
    def inner(self) -> tuple[Any, ...]:
        """The tasks of which it is made."""
        return tuple(phase.task for phase in self.phases)

    def simulated(
        self,
        scene: Scene,
        q0: Any = None,
        *,
        run: int = 0,
        progress: Progress | None = None,
        **settings: Any,
    ) -> MissionRun:
        """Simulate all phases from q0 (nq,), or home; `settings` are those of `simulate`.

        The phases have the numbers run, run + 1, ..., and their noise by these. InputError: in the
        words of `simulate`, with the name of the phase in front. What turns out only on the way,
        such as a target that is out of sight where it was put down, ends the mission and is its
        `problem`. Interrupted after Ctrl-C, with the legs so far in `.run`.
        """
        check_progress(progress)
        q = self._start(scene, q0)
        self.checked(scene, q, **settings)
        origin = self._origin(scene, q, settings)
        legs: list[Leg] = []

        def so_far(problem: str = "") -> MissionRun:
            return MissionRun(tuple(legs), len(self.phases), problem, origin)

        for i, phase in enumerate(self.phases):
            how = {**settings, "run": run + i, "progress": self._share(i, progress)}
            try:
                legs.append(_leg(phase, legs[-1].end if legs else 0.0, scene, q, how))
            except Interrupted:
                raise Interrupted("stopped by the user", so_far()) from None
            except InputError as error:
                if not legs:
                    raise
                return so_far(str(error))
            scene, q = legs[-1].scene, np.clip(legs[-1].q_end, *scene.limits.T)
            if not legs[-1].succeeded:
                break
        return so_far()

    def checked(
        self, scene: Scene, q0: Any = None, *, must_see: bool = False, **settings: Any
    ) -> None:
        """InputError for what can be known of the phases before the first begins.

        With `must_see` also where the first does not see its target at the start. Where things
        will be that change hands is not known, and so neither the goals after that.
        """
        q = self._start(scene, q0)
        staged, known = scene, True
        for i, phase in enumerate(self.phases):
            with named(phase):
                staged = phase.begun(staged, q)
                known = known and staged is scene
                if known:
                    own, first = _settings(phase, settings), i == 0
                    check(scene, phase.task, q, own, must_see=must_see and first, starts=first)

    def _start(self, scene: Scene, q0: Any) -> Array:
        """(nq,); InputError for a batch, and for a scene in which no mission can be."""
        if not isinstance(scene, Scene):
            raise InputError(f"scene: expected a Scene, got {scene!r:.80}")
        q = scene.coordinates(scene.home if q0 is None else q0, "q0")
        if q.ndim != 1:
            raise InputError(f"a mission starts at one q0 ({scene.nq},), got {q.shape}")
        for motion in scene.motions:
            if callable(motion.rates):
                raise InputError(
                    f"in a mission '{motion.robot}' moves at constant rates, not by a function: "
                    "every phase starts at time 0"
                )
        return q

    def _origin(self, scene: Scene, q: Array, settings: Mapping[str, Any]) -> dict[str, Any]:
        """What a run says of where it comes from."""
        try:
            return {"scenario": text_of(scene, self, q, settings)}
        except InputError as reason:
            return {"scenario": "", "no_scenario": str(reason)}

    def _share(self, done: int, progress: Progress | None) -> Progress | None:
        """Progress of one phase as a share of the mission."""
        if progress is None:
            return None
        return lambda share: progress((done + share) / len(self.phases))


def _leg(phase: Phase, start: float, scene: Scene, q: Array, settings: Mapping[str, Any]) -> Leg:
    """How a phase goes that starts after some seconds at q (nq,)."""
    with named(phase):
        scene = phase.begun(scene, q)
        run = simulate(scene, phase.task, q, **_settings(phase, settings))
    outcome = Outcome(int(run["outcome"]))
    end = start + float(run["end_time"])
    return Leg(phase.name, outcome, outcome in phase.expects, start, end, run, scene)


def _settings(phase: Phase, settings: Mapping[str, Any]) -> dict[str, Any]:
    """Those of a phase, which may have a duration of its own."""
    own = {} if phase.duration is None else {"duration": phase.duration}
    return {**settings, **own}
