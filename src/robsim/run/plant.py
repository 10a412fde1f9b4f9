"""The plant: a scene whose joints obey commands as far as they can, and what moves on its own."""

from __future__ import annotations

import numpy as np

from robsim.base.arrays import Array
from robsim.kernels import joints as kinds
from robsim.kernels import moving
from robsim.kernels.actuation import follow_stage
from robsim.kernels.commanding import copied
from robsim.kernels.program import Program
from robsim.kernels.tree import IQ, IV, KIND
from robsim.robot.placed import Placed
from robsim.run.chunk import Chunk
from robsim.run.drives import Drives, Period


class Plant:
    """The rows of a program that say where everything is, and the stages that move it.

    q are the coordinates, qd the velocities that are commanded or prescribed, and `rates` those at
    which the joints move, where these are others.
    """

    def __init__(self, program: Program, drives: Drives, q0: Array, dt: float) -> None:
        self.program, self.drives, self.scene = program, drives, drives.scene
        self.seconds = dt
        self.q = program.each(q0.T)
        self.qd, self.drift = program.rows(self.scene.nv), program.constant(self.scene.drift(0.0))
        self.speed = program.rows(self.scene.nv)  # of joints that lag
        self.rates = program.rows(self.scene.nv if drives.moves else 0)
        self.dt = program.constant(dt)
        self.placed = Placed(program, self.scene.tree.joints, self.q, self.scene.nq)

    def move(self) -> None:
        """Add the stages of a period: joints move as they were commanded at the step before."""
        if self._is_compiled:
            self._integrate(self.dt, self.q, self.speed)
        else:
            self.program.call(self._advance)

    def within(self, seconds: int) -> Placed:
        """Add the stages that place all bodies where they were in the period that ends now.

        That is some time, in a row, after it began; call it before `move`.
        """
        nq, nv, tree = self.scene.nq, self.scene.nv, self.scene.tree
        q, speed = self.program.rows(nq), self.program.rows(nv)
        if self._is_compiled:
            self.program.add(copied, nq, self.q, q)
            self.program.add(copied, nv, self.speed, speed)
            self._integrate(seconds, q, speed)
        else:
            self.program.call(lambda chunk, step: chunk.put(q, self._moved(chunk, seconds)))
        placed = Placed(self.program, tree.joints, q, nq)
        if not tree.compiled:
            self.program.call(lambda chunk, step: placed.prepare(tree.own, chunk))
        placed.add()
        return placed

    def _integrate(self, dt: int, x: int, speed: int) -> None:
        """Add the stages that move coordinates from x for a time, from velocities `speed`."""
        v = self._follow(dt, speed) if self.drives.actuation.moves else self.qd
        joints = self.scene.tree.joints
        steady: list[int] = []
        for row in joints.rows[1:]:
            kind, q, rate = row[KIND], x + row[IQ], v + row[IV]
            if row[IV] < 0:
                continue  # what depends on others moves with them
            if kind == kinds.FLOATING:
                self.program.add(moving.fly, dt, q, rate)
            elif kind in (kinds.PLANAR, kinds.UNICYCLE, kinds.CAR):
                count = 3 if kind == kinds.PLANAR else 2
                self.program.add(moving.glide, dt, q, rate, count)
            else:
                steady += [q, rate]
        if steady:
            self.program.add(moving.run, dt, len(steady) // 2, *steady)
        for n, m, _, k in joints.wheels.rows:
            ratio = self.placed.ratio + k
            self.program.add(moving.roll, dt, x + n, v + m, ratio)

    @property
    def _is_compiled(self) -> bool:
        """Whether there are stages for all that moves: no joint of a user's kind, and no car."""
        return self.scene.tree.compiled and not self.scene.tree.cars

    def _follow(self, dt: int, speed: int) -> int:
        """Add the stages of joints that lag for a time; return the rows of mean velocities."""
        program, nv, mean = self.program, self.scene.nv, self.program.rows(self.scene.nv)
        rows = []
        for i in range(nv):
            if i in self.drives.columns:
                rows += [self.qd + i, speed + i, mean + i]
            else:
                program.add(copied, 1, self.qd + i, speed + i)
                program.add(copied, 1, self.qd + i, mean + i)
        lag = program.constant(self.drives.actuation.lag)
        limits = [program.constant(limit) for limit in self.drives.limits]
        program.add(follow_stage, len(rows) // 3, dt, lag, *limits, *rows)
        return mean

    def place(self) -> None:
        """Add the stages that place all bodies at q."""
        if not self.scene.tree.compiled:
            self.program.call(self._prepare)
        self.placed.add()

    def command(self, qd: int) -> None:
        """Add the stage of all velocities: in rows from qd as commanded, else prescribed."""
        scene, rows = self.scene, np.full(self.scene.nv, -1)
        rows[self.drives.columns] = qd + np.arange(self.drives.columns.size)
        if scene.varies:
            self.program.call(self._prescribe)
        self.program.add(moving.spread, scene.nv, self.qd, self.drift, *rows)
        if self.drives.moves and self._is_compiled:
            for i, prescribed in enumerate(scene.prescribed):
                own = self.drift if prescribed else self.speed
                self.program.add(copied, 1, own + i, self.rates + i)
        elif self.drives.moves:
            self.program.call(self._measure_rates)

    def _prescribe(self, chunk: Chunk, step: int) -> None:
        drift = self.scene.drift(step * self.seconds)[:, None]
        chunk.put(self.drift, np.repeat(drift, chunk.runs, axis=1))

    def _prepare(self, chunk: Chunk, step: int) -> None:
        """Write the motions and twists of joints of the user's kinds."""
        self.placed.prepare(self.scene.tree.own, chunk)

    def _measure_rates(self, chunk: Chunk, step: int) -> None:
        """Write the velocities at which joints move when a period begins."""
        nv = self.scene.nv
        q, speed = chunk.get(self.q, self.scene.nq), chunk.get(self.speed, nv)
        drift = chunk.get(self.drift, nv)
        wanted = np.where(self.scene.prescribed[:, None], drift, speed)
        chunk.put(self.rates, self.scene.tree.driven(q, wanted))

    def _period(self, chunk: Chunk) -> Period:
        """Return where the period of the step before began, and what was commanded in it."""
        nq, nv = self.scene.nq, self.scene.nv
        return Period(chunk.get(self.q, nq), chunk.get(self.speed, nv), chunk.get(self.qd, nv))

    def _moved(self, chunk: Chunk, seconds: int) -> Array:
        """Return coordinates (nq, B) some time, in a row, after the period began."""
        period, each = self._period(chunk), chunk.get(seconds, 1)[0]
        q = period.q.copy()
        for time in np.unique(each):
            some = each == time
            held = Period(*(np.ascontiguousarray(part[:, some]) for part in period))
            q[:, some] = self.drives.moved(held, float(time), self.seconds)
        return q

    def _advance(self, chunk: Chunk, step: int) -> None:
        q, speed = self.drives.advance(self._period(chunk), self.seconds)
        chunk.put(self.q, q)
        chunk.put(self.speed, speed)
