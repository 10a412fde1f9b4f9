"""The judge: whether and why each run ends."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from robsim.base.arrays import frozen, shown_view
from robsim.engine.endings import Ending, Moment, which
from robsim.engine.plant import Plant
from robsim.engine.record import Judged
from robsim.engine.sensor import Sensor
from robsim.kernels.control.weighting import worst
from robsim.kernels.linear_algebra.singular import scratch_of
from robsim.kernels.machine.program import Blocks, Program
from robsim.kernels.outcomes import endings as kernels
from robsim.kernels.outcomes import judging
from robsim.robot.joint import LIMIT_SLACK
from robsim.servo.controller import Controller
from robsim.servo.given import Commanded


class Judge:
    """The rows of a program with the outcome of each run, and the stages that decide it."""

    def __init__(
        self, program: Program, controller: Controller, steps: int, endings: Sequence[Ending]
    ) -> None:
        self.program, self.controller, self.steps = program, controller, steps
        self.endings = endings
        self.outcome, self.length, self.still = program.rows(), program.rows(), program.rows()
        self.ending = program.constant(-1.0)
        self.tolerance = program.constant(controller.tolerance)
        self.scale = program.constant(controller.tolerance / controller.tolerances)

    def judge(
        self, plant: Plant, sensor: Sensor, command: Commanded, hold: bool, limited: bool
    ) -> None:
        """Add the stages: what a run is judged by, the outcome, and whether a stall is singular."""
        add, c = self.program.add, self.controller
        k, n = c.k, c.columns.size
        size, norm = self.program.rows(), self.program.rows()
        pace = self.program.number(c.pace)
        add(judging.errors, k, command.error, self.scale, size, norm)
        matrix = command.task_jacobian, k, n
        add(judging.stillness, *matrix, command.qd, self.scale, pace, self.tolerance, self.still)
        add(judging.path, self._moving(plant, sensor), self.program.rows(3), self.length)
        slack = np.array([-LIMIT_SLACK, LIMIT_SLACK])
        free = np.full(plant.scene.limits.shape, [-np.inf, np.inf])
        limits = self.program.constant((plant.scene.limits + slack if limited else free).T)
        busy = self.program.constant(1.0) if hold else command.busy
        images = sensor.images
        status = self._worst(sensor.status, command.status)
        seen = status, images.true + 2 * images.N, images.N
        add(
            judging.judge, plant.q, plant.scene.nq, limits, *seen, command.qd, n, size, norm,
            self.tolerance, busy, self.program.rows(2), self.still, self.steps,
            self.outcome,
        )  # fmt: skip
        room = self.program.scratch(k * n + k + n + scratch_of(k, n))
        rank = self.program.number(c.full_rank)
        numbers = self.program.constant(c.rcond), rank, self.outcome, room
        add(judging.stalls, *matrix, self.scale, *numbers)
        if not images.fresh or plant.drives.moves:
            self._wait(plant, sensor, command, pace, size)
        if self.endings:
            self.program.call(lambda blocks, step: self._ask(blocks, step, plant, sensor, command))

    def _worst(self, seen: int, left: int) -> int:
        """Return the row of the status of the image, and of what is left of it to command."""
        if left < 0:
            return seen
        found = self.program.rows()
        self.program.add(worst, 2, found, seen, left)
        return found

    @property
    def judged(self) -> Judged:
        """The rows that are kept at the end of a run."""
        return Judged(self.outcome, self.ending, self.length)

    def _ask(
        self, blocks: Blocks, step: int, plant: Plant, sensor: Sensor, command: Commanded
    ) -> None:
        """End runs that nothing else ends, and of which an ending holds."""
        get, scene = blocks.get, plant.scene
        arrays = (
            get(plant.q, scene.nq),
            get(plant.qd, scene.nv),
            get(command.error, self.controller.k),
            get(sensor.images.true, sensor.images.N, 2),
        )
        q, qd, error, pixels = (shown_view(array) for array in arrays)
        now = Moment(step * plant.seconds, scene, q, qd, error, pixels, frozen(blocks.rows.view()))
        found = which(self.endings, now)
        outcome = get(self.outcome, 1)[0]
        open_ = (outcome == kernels.RUNNING) | (outcome == kernels.TIME_LIMIT)
        ends = open_ & (found >= 0)
        blocks.put(self.outcome, np.where(ends, kernels.ENDED, outcome)[None])
        blocks.put(self.ending, np.where(ends, found, -1.0)[None])

    def _wait(self, plant: Plant, sensor: Sensor, command: Commanded, pace: int, size: int) -> None:
        """Add the stage that lets runs go on that only pass their goal."""
        c = self.controller
        rates, age = plant.rates if plant.drives.moves else -1, sensor.images.age
        self.program.add(
            judging.wait, command.task_jacobian, c.k, c.columns.size, command.qd, self.scale,
            pace, self.tolerance, size, age, self.program.rows(), self.outcome, self.steps,
            rates, *c.columns,
        )  # fmt: skip

    def _moving(self, plant: Plant, sensor: Sensor) -> int:
        """Return the rows of the pose whose way is measured."""
        if not sensor.views:
            return plant.placed.frames([plant.scene.tree.find(self.controller.moving)])[0]
        seen, moves = sensor.views[0], sensor.sights[0].camera_moves
        return seen.T_w_c if moves else seen.T_w_o
