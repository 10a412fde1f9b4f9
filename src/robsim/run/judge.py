"""The judge: whether and why each run ends."""

from __future__ import annotations

import numpy as np

from robsim.kernels import judging
from robsim.kernels.program import Program
from robsim.kernels.singular import scratch_of
from robsim.robot.joint import LIMIT_SLACK
from robsim.run.plant import Plant
from robsim.run.sensor import Sensor
from robsim.servo.controller import Controller
from robsim.servo.given import Commanded


class Judge:
    """The rows of a program with the outcome of each run, and the stages that decide it."""

    def __init__(self, program: Program, controller: Controller, steps: int) -> None:
        self.program, self.controller, self.steps = program, controller, steps
        self.outcome, self.length, self.still = program.rows(), program.rows(), program.rows()
        self.tolerance = program.constant(controller.tolerance)
        self.scale = program.constant(controller.tolerance / controller.tolerances)

    def judge(
        self, plant: Plant, sensor: Sensor, command: Commanded, hold: bool, limited: bool
    ) -> None:
        """Add the stages: what a run is judged by, the outcome, and whether a stall is singular."""
        add, c = self.program.add, self.controller
        k, n = c.k, c.columns.size
        size, norm = self.program.rows(), self.program.rows()
        pace = self.program.constant(c.pace)
        add(judging.errors, k, command.error, self.scale, size, norm)
        matrix = command.task_jacobian, k, n
        add(judging.stillness, *matrix, command.qd, self.scale, pace, self.tolerance, self.still)
        add(judging.path, self._moving(plant, sensor), self.program.rows(3), self.length)
        slack = np.array([-LIMIT_SLACK, LIMIT_SLACK])
        free = np.full(plant.scene.limits.shape, [-np.inf, np.inf])
        limits = self.program.constant((plant.scene.limits + slack if limited else free).T)
        busy = self.program.constant(1.0) if hold else command.busy
        images = sensor.images
        seen = sensor.status, images.true + 2 * images.N, images.N
        add(
            judging.judge, plant.q, plant.scene.nq, limits, *seen, command.qd, n, size, norm,
            self.tolerance, busy, self.program.rows(2), self.still, self.steps,
            self.outcome,
        )  # fmt: skip
        room = self.program.rows(k * n + k + n + scratch_of(k, n))
        rank = self.program.constant(c.rcond), c.full_rank, self.outcome, room
        add(judging.stalls, *matrix, self.scale, *rank)
        if not images.fresh or plant.drives.moves:
            self._wait(plant, sensor, command, pace, size)

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
        seen, moves = sensor.views[0], sensor.sights[0].constants.moves
        return seen.T_w_c if moves else seen.T_w_o
