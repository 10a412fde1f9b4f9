"""The base class of imperfections of joints, and the program rows that they process."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Annotated, Any, ClassVar, NamedTuple, Protocol, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from robsim.base.arrays import Array, is_any_nonzero, make_read_only, view_for_user, view_runs_first
from robsim.base.errors import InputError
from robsim.base.named_integers import NamedInteger
from robsim.declare import KindOf, ListOf, family
from robsim.declare.joint_numbers import broadcast_limits
from robsim.kernels.machine.block_rows import BlockRows
from robsim.kernels.machine.program import Blocks, Program
from robsim.world.imperfections.image_effect import FIRST_STREAM, EffectContext, check_effect_result
from robsim.world.imperfections.imperfection import Imperfection
from robsim.world.scene import Scene

JOINT_EFFECTS = family("joint effect")
# first stream of random numbers of joint effects; image effects use the streams below
FIRST_JOINT_STREAM = FIRST_STREAM + 1024


@dataclass(frozen=True, eq=False)
class Drive(EffectContext):
    """The state of the drives at a control instant, for B runs.

    Attributes
    ----------
    q : ndarray of shape (B, nq)
        Coordinates of the scene.
    moved : ndarray of shape (B, n)
        Velocities of the commanded joints in the previous period, zero at the start.
    """

    q: Array
    moved: Array

    def normal(self, count: int) -> Array:
        """Return independent standard normal numbers (B, count)."""
        rows = self.normal_pairs(-(-count // 2)).reshape(-1, self.runs.size)
        return np.ascontiguousarray(rows[:count].T)


@dataclass
class JointRows:
    """The program rows of joints, for effects that add stages one after another.

    Attributes
    ----------
    program : Program
        Stages of a control period. An effect stores its state in new rows of the program.
    columns : ndarray of int
        Indices of the commanded velocities among the velocities of the scene.
    wanted : Rows
        Velocities (nv,) of the scene; effects change the commanded velocities.
    speed : Rows
        Actual velocities (nv,).
    q : Rows
        True coordinates (nq,).
    measured : Rows
        Coordinates (nq,) that the controller receives.
    seconds : float
        Control period.
    seed, runs : uint64 and ndarray
        Seed of the random numbers, and numbers of all runs.
    stream : int
        First of two streams of random numbers of the effect.
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

    def add_measured_rows(self) -> BlockRows:
        """Return new rows (nq,), which contain the measured coordinates from this effect on."""
        self.measured = self.program.rows(self.scene.nq)
        return self.measured

    def call(self, driven: Callable[[Array, Drive], Array], name: str) -> None:
        """Add a Python function that maps the wanted velocities (B, n) to other velocities."""
        self.program.call(partial(self._call_python, driven, name, self.stream))

    def _call_python(
        self,
        driven: Callable[[Array, Drive], Array],
        name: str,
        stream: int,
        blocks: Blocks,
        step: int,
    ) -> None:
        """Call a Python effect and store the changed velocities."""
        rates, q, speed = map(blocks.get, (self.wanted, self.q, self.speed))
        wanted, moved = (
            view_runs_first(rates[self.columns]).copy(),
            view_for_user(speed[self.columns]),
        )
        key = step, self.seed, self.runs[blocks.rows].view(np.uint64), stream
        drive = Drive(step * self.seconds, *key, view_for_user(q), moved)
        result = check_effect_result(
            wanted, driven(make_read_only(wanted.view()), drive), f"{name}.driven"
        )
        rates[self.columns] = result.T
        blocks.put(self.wanted, rates)


class JointEffectStage(NamedInteger):
    """The stage between a command and the measured motion that an effect belongs to."""

    COMMANDED = 0  # the commanded velocities
    FOLLOWED = 1  # the effect has a `response`, but no stages
    MEASURED = 2  # the coordinates that the controller receives


class JointResponse(NamedTuple):
    """The response of joints to a command: v' = (command - v) / lag, with |v| and |v'| limited.

    Attributes
    ----------
    lag : float or ndarray of shape (runs,)
        Time constant in seconds.
    velocity, acceleration : ndarray of shape (n,) or (n, runs)
        Limits of |v| and |v'| for the velocities of a scene, infinite without a limit.
    """

    lag: Any  # Any: a float, or an array (runs,) in a batch, which the linear loop never has
    velocity: Array
    acceleration: Array

    @classmethod
    def of(cls, count: int, lag: float | Array = 0.0, **limits: ArrayLike | None) -> JointResponse:
        """Return the response of `count` velocities, by default without lag and limits."""
        each = (broadcast_limits(limits.get(name), count) for name in cls._fields[1:])
        return cls(lag, *each)

    def and_also(self, other: JointResponse) -> JointResponse:
        """Return the response under two effects: the lower limits, and the lag of either effect.

        Raise InputError if both have a lag.
        """
        if is_any_nonzero(self.lag) and is_any_nonzero(other.lag):
            raise InputError("two lags of the joints; give one")
        limits = (np.minimum(a.T, b.T).T for a, b in zip(self[1:], other[1:], strict=True))
        return JointResponse(self.lag if is_any_nonzero(self.lag) else other.lag, *limits)


class JointEffect(Imperfection):
    """Base class of the imperfections of joints.

    A kind is a frozen dataclass of declared fields, registered as a "joint effect". It adds
    compiled stages (`add_stages`), or its Python method `driven` is called in every period, or it
    changes the `response` of the joints.

    Attributes
    ----------
    place : JointEffectStage
        Stage between command and measurement to which the effect belongs.

    Examples
    --------
    >>> from robsim import Actuation
    >>> @dataclass(frozen=True)
    ... class Halved(JointEffect):
    ...     def driven(self, wanted, drive):
    ...         return 0.5 * wanted
    >>> [each.effect.label for each in Actuation(effects=[Halved()]).list_active()]
    ['Halved']
    """

    method_name: ClassVar[str] = "driven"
    place: ClassVar[JointEffectStage] = JointEffectStage.COMMANDED
    title: ClassVar[str] = "effects on the joints"
    statement_subject: ClassVar[str] = "The command is"

    def check(self, velocities: Sequence[str], coordinates: Sequence[str]) -> None:
        """Raise InputError if the effect does not fit the joints of a scene, by their names."""

    def response(self, count: int) -> JointResponse:
        """Return the contribution to the response of the joints, for `count` velocities."""
        return JointResponse.of(count)

    def deviation(self, scene: Scene) -> Array:
        """Return the standard deviation of each measured coordinate (nq,)."""
        return np.zeros(scene.nq)


@runtime_checkable
class OwnJointEffect(Protocol):
    """The protocol of a user-defined effect on joints, which needs no base class.

    Register the class with `register("joint effect", "my_effect")` to use it in scenario files.
    """

    def driven(self, wanted: Array, drive: Drive) -> Array:
        """Return the velocities (B, n) of the next period, given the wanted velocities."""


JointEffectList = Annotated[
    tuple[JointEffect | OwnJointEffect, ...],
    ListOf(KindOf(JOINT_EFFECTS, protocol=OwnJointEffect), most=64, alone=True),
    "Effects of further kinds or of user-defined kinds, applied one after the other.",
]
