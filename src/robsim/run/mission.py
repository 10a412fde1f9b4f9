"""Missions: one task after the other, with things grasped and let go between them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from robsim.base.arrays import Array, positive
from robsim.base.errors import InputError, Interrupted, suggest
from robsim.run.outcome import Outcome
from robsim.run.simulate import check, check_kinds, simulate
from robsim.servo.tasks.task import Task
from robsim.world.actuation import Actuation
from robsim.world.scene import Scene
from robsim.world.sensing import Sensing

if TYPE_CHECKING:
    import xarray as xr


@dataclass(frozen=True, eq=False)
class Phase:
    """One task of a mission.

    At its start the objects of `release` are left standing in the world where they are, and those
    of `attach`, {object: frame}, are from then on carried by that frame; none of them jumps. The
    phase has succeeded if it ends as `expects` says: one outcome or several. After an expected
    JOINT_LIMIT the next phase starts at the limit.

    >>> from robsim import FollowJoints
    >>> Phase("lift", FollowJoints(to={"lift": 0.1}, duration=2.0), attach={"cube": "arm.tool"})
    Phase('lift')
    """

    name: str
    task: Task
    duration: float = 60.0
    attach: Mapping[str, str] = field(default_factory=dict)
    release: Sequence[str] = ()
    expects: Any = Outcome.CONVERGED

    def __post_init__(self) -> None:
        if not isinstance(self.name, str) or not self.name.strip():
            raise InputError(f"a phase needs a name, got {self.name!r:.80}")
        if isinstance(self.task, type) or not isinstance(self.task, Task):
            raise InputError(
                f"phase '{self.name}': expected a task such as IBVS(...), got {self.task!r:.80}"
            )
        put = object.__setattr__
        put(self, "duration", positive(self.duration, f"duration of phase '{self.name}'"))
        if not isinstance(self.attach, Mapping):
            raise InputError(f"phase '{self.name}': attach is {{object: frame}}")
        put(self, "attach", dict(self.attach))
        let_go = (self.release,) if isinstance(self.release, str) else self.release
        if not isinstance(let_go, Sequence):
            raise InputError(f"phase '{self.name}': release is a list of objects, got {let_go!r}")
        put(self, "release", tuple(let_go))
        both = sorted(set(self.release) & set(self.attach))
        if both:
            raise InputError(f"phase '{self.name}': attach and release of '{both[0]}' at once")
        expects = self.expects if isinstance(self.expects, tuple | list) else (self.expects,)
        if not expects or not all(isinstance(each, Outcome) for each in expects):
            raise InputError(f"phase '{self.name}': expects an Outcome, got {self.expects!r:.80}")
        put(self, "expects", tuple(expects))

    def __repr__(self) -> str:
        return f"Phase({self.name!r})"

    def after(self, legs: Sequence[Leg], scene: Scene, q: Array, **settings: Any) -> Leg:
        """How it goes from q (nq,), after these legs."""
        with _named(self):
            scene = self.begun(scene, q)
            run = simulate(scene, self.task, q, duration=self.duration, **settings)
        start, outcome = legs[-1].end if legs else 0.0, Outcome(int(run["outcome"]))
        end = start + float(run["end_time"])
        return Leg(self.name, outcome, outcome in self.expects, start, end, run, scene)

    def begun(self, scene: Scene, q: Array) -> Scene:
        """The scene as it hangs together from the start of this phase, at q (nq,)."""
        for thing in self.release:
            scene = scene.released(thing, q)
        for thing, frame in self.attach.items():
            scene = scene.attached(thing, frame, q)
        return scene


@dataclass(frozen=True, eq=False)
class Leg:
    """One phase of a mission as it went; seconds since the start of the mission."""

    name: str
    outcome: Outcome
    succeeded: bool
    start: float
    end: float
    run: xr.Dataset
    scene: Scene

    @property
    def q_end(self) -> Array:
        """(nq,) where it ended."""
        q: Array = np.array(self.run["q_end"].values)
        return q


@dataclass(frozen=True, eq=False)
class MissionRun:
    """How a mission went: the legs that were begun, the last one perhaps in vain."""

    legs: tuple[Leg, ...]
    planned: int  # phases
    problem: str = ""  # why the next phase could not begin, if it could not

    @property
    def succeeded(self) -> bool:
        """Whether every phase ended as it should."""
        return len(self.legs) == self.planned and all(leg.succeeded for leg in self.legs)

    @property
    def run(self) -> xr.Dataset:
        """q (time, coordinate) and qd (time, velocity) of the whole mission, and its phases.

        Where one phase ends and the next begins there is one instant, that of the next.
        """
        import xarray as xr

        parts = [_instants(leg, last=leg is self.legs[-1]) for leg in self.legs]
        joined: xr.Dataset = xr.concat(parts, dim="time")
        joined.attrs = {"title": "RobSim mission", "succeeded": int(self.succeeded)}
        return joined

    def __str__(self) -> str:
        wide = max(len(leg.name) for leg in self.legs)
        lines = [f"{leg.start:8.2f} s  {leg.name:{wide}}  {leg.outcome.words}" for leg in self.legs]
        left = self.planned - len(self.legs)
        lines += [self.problem] if self.problem else []
        return "\n".join([*lines, *([f"phases not begun: {left}"] if left else [])])


@dataclass(frozen=True, eq=False)
class Mission:
    """Phases in a scene, one after the other; the first that goes wrong is the last.

    Each phase is a run of its own: it starts where the one before it ended, its joints at rest,
    and what moves on its own goes on at constant rates.

    >>> from robsim import FollowJoints
    >>> from robsim.files import robots
    >>> arm = robots.planar_2r()
    >>> there = Phase("there", FollowJoints(to=[0.5, 0.5], duration=1.0))
    >>> back = Phase("back", FollowJoints(to=arm.home, duration=1.0))
    >>> print(Mission(Scene(arm), [there, back]).run())
        0.00 s  there  converged
        1.00 s  back   converged
    """

    scene: Scene
    phases: Any

    def __post_init__(self) -> None:
        phases = (self.phases,) if isinstance(self.phases, Phase) else self.phases
        if not isinstance(phases, Sequence) or not phases:
            raise InputError(f"a mission needs a list of Phase, got {phases!r:.80}")
        for phase in phases:
            if not isinstance(phase, Phase):
                raise InputError(f"a mission needs a list of Phase, got {phase!r:.80} in it")
        object.__setattr__(self, "phases", tuple(phases))
        check_kinds(self.scene, phases[0].task)
        for motion in self.scene.motions:
            if callable(motion.rates):
                raise InputError(
                    f"in a mission '{motion.robot}' moves at constant rates, not by a function: "
                    "every phase starts at time 0"
                )
        self._check_names()

    def run(
        self,
        q0: Any = None,
        *,
        dt: float = 0.04,
        seed: int = 0,
        sensing: Sensing | None = None,
        actuation: Actuation | None = None,
    ) -> MissionRun:
        """Simulate all phases from q0 (nq,), or home; keywords as those of `simulate`.

        InputError: in the words of `simulate`, with the name of the phase in front. What turns out
        only on the way, such as a target that is out of sight where it was put down, ends the
        mission and is its `problem`. Interrupted after Ctrl-C, with the legs so far in `.run`.
        """
        scene = self.scene
        q = scene.coordinates(scene.home if q0 is None else q0, "q0")
        if q.ndim != 1:
            raise InputError(f"a mission starts at one q0 ({scene.nq},), got {q.shape}")
        settings: dict[str, Any] = {
            "dt": dt,
            "seed": seed,
            "sensing": sensing,
            "actuation": actuation,
        }
        self._check_tasks(q, settings)
        legs: list[Leg] = []
        for i, phase in enumerate(self.phases):
            try:
                legs.append(phase.after(legs, scene, q, run=i, **settings))
            except Interrupted:
                raise Interrupted("stopped by the user", self._so_far(legs)) from None
            except InputError as error:
                if not legs:
                    raise
                return self._so_far(legs, str(error))
            scene, q = legs[-1].scene, np.clip(legs[-1].q_end, *scene.limits.T)
            if not legs[-1].succeeded:
                break
        return self._so_far(legs)

    def _so_far(self, legs: Sequence[Leg], problem: str = "") -> MissionRun:
        return MissionRun(tuple(legs), len(self.phases), problem)

    def _check_names(self) -> None:
        """InputError for an object or a frame that does not exist, in any phase."""
        things = [thing.name for thing in self.scene.objects]
        for phase in self.phases:
            for thing in (*phase.release, *phase.attach):
                if thing not in things:
                    hint = suggest(thing, things, "objects")
                    raise InputError(f"phase '{phase.name}': no object {thing!r}; {hint}")
            for frame in phase.attach.values():
                with _named(phase):
                    self.scene.tree.find(frame)

    def _check_tasks(self, q: Array, settings: Mapping[str, Any]) -> None:
        """What can be known of the phases before the first thing is grasped or let go."""
        for phase in self.phases:
            if phase.attach or phase.release:
                return
            with _named(phase):
                check(self.scene, phase.task, q, {**settings, "duration": phase.duration})


@contextmanager
def _named(phase: Phase) -> Iterator[None]:
    """Errors that name the phase."""
    try:
        yield
    except InputError as error:
        raise type(error)(f"phase '{phase.name}': {error}") from None


def _instants(leg: Leg, *, last: bool) -> xr.Dataset:
    """q and qd of a leg on the clock of the mission; its end belongs to the next."""
    run = leg.run[["q", "qd"]].drop_vars("run", errors="ignore")
    before = run["time"].values < leg.end - leg.start - 1e-9 * float(leg.run.attrs["dt"])
    count = int(before.sum()) + (1 if last else 0)
    run = run.isel(time=slice(0, max(count, 1 if last else 0)))
    run = run.assign_coords(time=run["time"] + leg.start)
    return run.assign_coords(phase=("time", np.full(run.sizes["time"], leg.name)))
