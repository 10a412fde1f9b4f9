"""Imperfections of the joints: what each kind declares, and the rows to which it adds stages."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import IntEnum
from functools import partial
from typing import Annotated, Any, ClassVar, NamedTuple, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array, is_any_nonzero, make_read_only, view_for_user, view_runs_first
from robsim.base.errors import InputError
from robsim.declare import KindOf, ListOf, family
from robsim.declare.joint_numbers import broadcast_limits
from robsim.kernels.machine.block_rows import BlockRows
from robsim.kernels.machine.program import Blocks, Program
from robsim.world.imperfections.image_effect import FIRST_STREAM, EffectContext, check_effect_result
from robsim.world.imperfections.imperfection import Imperfection
from robsim.world.scene import Scene

JOINT_EFFECTS = family("joint effect")
FIRST_JOINT_STREAM = FIRST_STREAM + 1024  # streams of random numbers; those below are of images


@dataclass(frozen=True, eq=False)
class Drive(EffectContext):
    """The state of the drives at a control instant, for B runs, with the run first.

    q        coordinates (B, nq) of the scene
    moved    velocities (B, n) of the commanded joints in the period that ends, zero at the start
    """

    q: Array
    moved: Array

    def normal(self, count: int) -> Array:
        """Return independent standard normal numbers (B, count)."""
        rows = self.normal_pairs(-(-count // 2)).reshape(-1, self.runs.size)
        return np.ascontiguousarray(rows[:count].T)


@dataclass
class JointRows:
    """The rows of joints to which effects add their stages, one after the other.

    program  the stages of a period; an effect keeps what it remembers in new rows of it
    columns  the numbers of the commanded velocities among those of the scene
    wanted   rows of the velocities (nv,) of the scene, the commanded ones to be changed
    speed    rows of those at which joints move (nv,)
    q        rows of the true coordinates (nq,)
    measured rows of the coordinates (nq,) that the controller gets
    seconds  the control period
    seed     of random numbers, `runs` the numbers of all runs, and `run` the row of these
    stream   the first of two streams of random numbers of an effect
    """

    program: Program
    scene: Scene
    columns: NDArray[np.int64]
    wanted: BlockRows
    speed: BlockRows
    q: BlockRows
    measured: BlockRows
    seconds: float
    seed: np.uint64
    runs: NDArray[np.int64]
    stream: int = 0

    def new_measured(self) -> BlockRows:
        """Return new rows (nq,), which are the measured coordinates from here on."""
        self.measured = self.program.rows(self.scene.nq)
        return self.measured

    def call(self, driven: Callable[[Array, Drive], Array], name: str) -> None:
        """Add a function in Python from the wanted velocities (B, n) to others."""
        self.program.call(partial(self._called, driven, name, self.stream))

    def _called(self, driven: Any, name: str, stream: int, blocks: Blocks, step: int) -> None:
        rates, q, speed = map(blocks.get, (self.wanted, self.q, self.speed))
        wanted, moved = (
            view_runs_first(rates[self.columns]).copy(),
            view_for_user(speed[self.columns]),
        )
        key = step, self.seed, self.runs[blocks.rows].view(np.uint64), stream
        drive = Drive(step * self.seconds, *key, view_for_user(q), moved)
        found = check_effect_result(
            wanted, driven(make_read_only(wanted.view()), drive), f"{name}.driven"
        )
        rates[self.columns] = found.T
        blocks.put(self.wanted, rates)


class JointEffectStage(IntEnum):
    """The place of an effect between a command and what is measured of the motion."""

    COMMANDED = 0  # the velocities that joints are to follow
    FOLLOWED = 1  # how they follow: a `response`, but no stages
    MEASURED = 2  # the coordinates that the controller gets


class JointResponse(NamedTuple):
    """How joints follow a command: v' = (command - v) / lag, with |v| and |v'| limited.

    `velocity` and `acceleration` are the limits (n,) of the velocities of a scene, or (n, runs)
    where each run has its own.
    """

    lag: Any
    velocity: Array
    acceleration: Array

    @classmethod
    def of(cls, count: int, lag: Any = 0.0, **limits: Any) -> JointResponse:
        """Return the response of so many velocities, at once and without limits by default."""
        each = (broadcast_limits(limits.get(name), count) for name in cls._fields[1:])
        return cls(lag, *each)

    def and_also(self, other: JointResponse) -> JointResponse:
        """Return the response under two effects: the lower limits, and one lag at most."""
        if is_any_nonzero(self.lag) and is_any_nonzero(other.lag):
            raise InputError("two lags of the joints; give one")
        limits = (np.minimum(a.T, b.T).T for a, b in zip(self[1:], other[1:], strict=True))
        return JointResponse(self.lag if is_any_nonzero(self.lag) else other.lag, *limits)


class JointEffect(Imperfection):
    """A kind of imperfection of the joints, with all that is known of it.

    A kind is a frozen dataclass of declared fields, registered as a "joint effect". It adds
    compiled stages (`add_stages`), or it is called in Python in every period (`driven`), or it is
    part of how joints follow (`response`).

    place  where it acts between a command and what is measured
    """

    called: ClassVar[str] = "driven"
    place: ClassVar[JointEffectStage] = JointEffectStage.COMMANDED
    title: ClassVar[str] = "effects on the joints"
    changed: ClassVar[str] = "What is commanded is"

    def check(self, velocities: Sequence[str], coordinates: Sequence[str]) -> None:
        """Raise InputError if the effect does not fit the joints of a scene, by their names."""

    def response(self, count: int) -> JointResponse:
        """Return its part in how the joints of a scene follow, of so many velocities."""
        return JointResponse.of(count)

    def deviation(self, scene: Scene) -> Array:
        """Return the standard deviation of each measured coordinate (nq,)."""
        return np.zeros(scene.nq)


@runtime_checkable
class OwnJointEffect(Protocol):
    """What anything must have to be an effect on joints: a user's class needs no base class.

    Registered with `register("joint effect", "my_effect")`, it has a place in scenario files.
    """

    def driven(self, wanted: Array, drive: Drive) -> Array:
        """Return velocities (B, n) for the period that begins, from those that are wanted."""


JointEffectList = Annotated[
    tuple[JointEffect | OwnJointEffect, ...],
    ListOf(KindOf(JOINT_EFFECTS, protocol=OwnJointEffect), most=64, alone=True),
    "Effects of other kinds, or of a kind of your own, one after the other.",
]
