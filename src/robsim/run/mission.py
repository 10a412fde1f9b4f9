"""Missions: tasks one after the other, with objects grasped and released between them."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, cast

import numpy as np

from robsim.base.arrays import Array
from robsim.base.errors import InputError, Interrupted, prefix_errors
from robsim.declare import DeclaredValue, ListOf, Table, register
from robsim.declare.context import Context, FieldValue
from robsim.engine.outcome import Outcome
from robsim.engine.workers import Progress, check_progress
from robsim.run.mission_run import MissionLeg, MissionRun
from robsim.run.phase import Phase
from robsim.servo.tasks.task import Task
from robsim.world.scene import Scene

if TYPE_CHECKING:
    import xarray as xr

    from robsim.run.experiment import Experiment

MOST = 1000  # phases


@register("task", "mission")
@dataclass(frozen=True, eq=False)
class Mission(DeclaredValue):
    """Sequence of phases, which ends after the last phase or at the first that fails.

    A mission takes the place of a task in an `Experiment`; `run` then returns a `MissionRun`. Each
    phase is a run of its own: it starts at the end of the previous phase with the joints at rest.
    Prescribed motions continue at constant rates. The duration (unless the phase has one), `hold`
    and `record` of the experiment apply to each phase.

    >>> from robsim import Experiment, FollowJoints, Scene, robots
    >>> arm = robots.planar_2r()
    >>> there = Phase("there", FollowJoints(to=[0.5, 0.5], duration=1.0))
    >>> back = Phase("back", FollowJoints(by=[-0.5, -0.5], duration=1.0))
    >>> print(Experiment(Scene(arm), Mission([there, back])).run())
        0.00 to 1.00 s  there  converged
        1.00 to 2.00 s  back   converged
    """

    outermost: ClassVar[bool] = True  # a mission cannot be a phase or a part of another task

    phases: Annotated[
        Sequence[Phase],
        ListOf(Table(Phase), 1, MOST, alone=True, in_turn=True),
        "Phases in their order.",
    ]

    def __post_init__(self) -> None:
        super().__post_init__()
        names = [phase.name for phase in self.phases]
        twice = next((name for name in names if names.count(name) > 1), None)
        if twice is not None:
            raise InputError(f"two phases are called {twice!r}")

    @classmethod
    def facts(cls, own: Mapping[str, FieldValue], c: Context) -> Context:
        """Return the context that lets each phase change the scene of the following phases."""
        return c.with_facts(stage={"scene": c.facts.get("scene")})

    @property
    def inner(self) -> tuple[Task, ...]:
        """The tasks of the phases."""
        return tuple(phase.task for phase in self.phases)

    def simulated(
        self,
        experiment: Experiment,
        *,
        progress: Progress | None = None,
        **how: Any,  # Any: the other arguments of `Experiment.run`
    ) -> MissionRun:
        """Simulate all phases of an experiment from its start.

        The runs of the phases have the numbers first_run, first_run + 1, ..., which determine their
        noise.

        Parameters
        ----------
        experiment : Experiment
            Experiment with this mission as its task.
        progress : callable, optional
            Function that is called repeatedly with the finished share, from 0 to 1.
        **how
            Further arguments of `Experiment.run`.

        Returns
        -------
        MissionRun
            The legs. If a later phase cannot begin, for example because the previous
            phase put its target down out of sight, `problem` gives the reason.

        Raises
        ------
        InputError
            If the first phase cannot begin. The message names the phase.
        Interrupted
            If the user stops the simulation. Its attribute `run` is the MissionRun so far, with the
            unfinished leg.
        """
        check_progress(progress)
        self.checked(experiment, view=False)
        legs: list[MissionLeg] = []

        def so_far(problem: str = "") -> MissionRun:
            return MissionRun(tuple(legs), len(self.phases), problem, experiment.origin)

        one = replace(experiment, start=_check_mission_start(experiment), source="")
        for i, phase in enumerate(self.phases):
            try:
                legs.append(
                    _run_phase(phase, one, legs, progress=self._map_progress(i, progress), **how)
                )
            except Interrupted as stop:
                legs += stop.run
                if keeper := how.get("checkpoint"):  # the phase may have ended before the stop
                    keeper.save()
                raise Interrupted("stopped by the user", so_far()) from None
            except InputError as error:
                if not legs:
                    raise
                return so_far(str(error))
            scene = legs[-1].scene
            q = np.clip(legs[-1].q_end, *scene.limits.T)
            one = replace(one, scene=scene, start=q, first_run=one.first_run + 1)
            if not legs[-1].succeeded:
                break
        return so_far()

    def checked(self, experiment: Experiment, *, view: bool = True) -> None:
        """Raise InputError for errors that can be detected before the first phase begins.

        With `view`, it is an error if the first phase does not see its target at the start. After
        an object is grasped or released its pose is unknown, and later goals are not checked.
        """
        q = _check_mission_start(experiment)
        staged, known = experiment.scene, True
        one = replace(experiment, start=q, record="summary", source="")
        for i, phase in enumerate(self.phases):
            with prefix_errors(f"phase {phase.name!r}"):
                staged = phase.change_attachments(staged, q)
                known = known and staged is experiment.scene
                if known:
                    own = _make_phase_experiment(phase, one)
                    if i == 0:
                        own.check(view=view)
                    else:
                        own.loop()

    def _map_progress(self, done: int, progress: Progress | None) -> Progress | None:
        """Return a callback that maps the progress of a phase to the progress of the mission."""
        if progress is None:
            return None
        return lambda share: progress((done + share) / len(self.phases))


def _check_mission_start(experiment: Experiment) -> Array:
    """Return the start (nq,); InputError for a batch, or if the scene does not allow a mission."""
    scene = experiment.scene
    q: Array = scene.home if experiment.start is None else experiment.start
    if q.ndim != 1:
        raise InputError(f"a mission starts at one q0 ({scene.nq},), got {q.shape}")
    for motion in scene.motions:
        if callable(motion.rates):
            raise InputError(
                f"in a mission '{motion.robot}' moves at constant rates, not by a function: "
                "every phase starts at time 0"
            )
    return q


def _make_phase_experiment(phase: Phase, experiment: Experiment) -> Experiment[Task]:
    """Return the experiment of one phase, with the duration of the phase if it has one."""
    duration = experiment.duration if phase.duration is None else phase.duration
    return replace(experiment, task=phase.task, duration=duration)


def _run_phase(
    phase: Phase, experiment: Experiment, before: Sequence[MissionLeg], **how: Any
) -> MissionLeg:
    """Run a phase from the end of the previous legs, and return its leg.

    At an interruption, Interrupted holds a list with the unfinished leg, which is empty if the leg
    has not begun.
    """
    start = before[-1].end if before else 0.0
    with prefix_errors(f"phase {phase.name!r}"):
        scene = phase.change_attachments(experiment.scene, _check_mission_start(experiment))
        later = experiment.actuation.after(start)  # every phase begins at time 0
        own = _make_phase_experiment(phase, replace(experiment, scene=scene, actuation=later))
    try:
        with prefix_errors(f"phase {phase.name!r}"):
            return _make_leg(phase, scene, start, own.run(**how))
    except Interrupted as stop:
        began = np.isfinite(float(stop.run["end_time"]))
        raise Interrupted("", [_make_leg(phase, scene, start, stop.run)] if began else []) from None


def _make_leg(phase: Phase, scene: Scene, start: float, run: xr.Dataset) -> MissionLeg:
    """Return the leg of a phase that began at `start` seconds."""
    outcome = Outcome(int(run["outcome"]))
    end = start + float(run["end_time"])
    return MissionLeg(
        phase.name,
        outcome,
        outcome in cast(Collection[Outcome], phase.expects),
        start,
        end,
        run,
        scene,
    )
