"""The joints of a scene as rows of a program, which are commanded and measured."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array, first_view, frozen, shown_view
from robsim.kernels.machine.program import Blocks, Program
from robsim.world.imperfections.drive import Drive
from robsim.world.imperfections.exposure import like
from robsim.world.scene import Scene

Driven = Callable[[Array, Drive], Array]


@dataclass
class JointRows:
    """The rows of joints to which effects add their stages, one after the other.

    program  the stages of a period; an effect keeps what it remembers in new rows of it
    columns  the numbers of the commanded velocities among those of the scene
    wanted   first row of the velocities (nv,) of the scene, the commanded ones to be changed
    speed    first row of those at which joints move (nv,)
    q        first row of the true coordinates (nq,)
    measured first row of the coordinates (nq,) that the controller gets
    seconds  the control period
    seed     of random numbers, `runs` the numbers of all runs, and `run` the row of these
    stream   the first of two streams of random numbers of an effect
    """

    program: Program
    scene: Scene
    columns: NDArray[np.int64]
    wanted: int
    speed: int
    q: int
    measured: int
    seconds: float
    seed: np.uint64
    runs: NDArray[np.int64]
    stream: int = 0

    def new_measured(self) -> int:
        """Return new rows (nq,), which are the measured coordinates from here on."""
        self.measured = self.program.rows(self.scene.nq)
        return self.measured

    def call(self, driven: Driven, name: str) -> None:
        """Add a function in Python from the wanted velocities (B, n) to others."""
        self.program.call(partial(self._called, driven, name, self.stream))

    def _called(self, driven: Driven, name: str, stream: int, blocks: Blocks, step: int) -> None:
        nv, get = self.scene.nv, blocks.get
        rates, q, speed = get(self.wanted, nv), get(self.q, self.scene.nq), get(self.speed, nv)
        wanted, moved = first_view(rates[self.columns]).copy(), shown_view(speed[self.columns])
        key = step, self.seed, self.runs[blocks.rows].view(np.uint64), stream
        drive = Drive(step * self.seconds, shown_view(q), moved, *key)
        found = like(wanted, driven(frozen(wanted.view()), drive), f"{name}.driven")
        rates[self.columns] = found.T
        blocks.put(self.wanted, rates)
