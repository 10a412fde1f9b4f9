"""The judge: whether and why each run ends."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from robsim.base.arrays import frozen, shown_view
from robsim.engine.endings import Ending, Moment, which
from robsim.engine.images import Images
from robsim.engine.plant import Plant
from robsim.engine.record import Judged
from robsim.kernels.control.weighting import worst
from robsim.kernels.linear_algebra.singular import scratch_of
from robsim.kernels.machine.program import Blocks, Program
from robsim.kernels.machine.rows import Rows
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
        self, plant: Plant, images: Images, command: Commanded, hold: bool, limited: bool
    ) -> None:
        """Add the stages: what a run is judged by, the outcome, and whether a stall is singular."""
        program, c = self.program, self.controller
        add, size, norm = program.add, program.rows(), program.rows()
        tolerance, scale, outcome = self.tolerance, self.scale, self.outcome
        add(judging.errors, errors=command.error, scale=scale, size=size, norm=norm)
        given = {"A": command.task_jacobian, "scale": scale}
        paced = {**given, "qd": command.qd, "pace": program.number(c.pace), "tolerance": tolerance}
        add(judging.stillness, **paced, periods=self.still)
        moving = self._moving(plant, images)
        add(judging.path, T=moving, before=program.rows(3), length=self.length)
        slack = np.array([-1.0, 1.0]) * (LIMIT_SLACK if limited else np.inf)
        add(
            judging.judge,
            q=plant.q,
            limits=program.constant((plant.scene.limits + slack).T),
            status=self._worst(images.status, command.status),
            depth=images.true[2 * images.N :].column,
            qd=command.qd,
            size=size,
            norm=norm,
            tolerance=tolerance,
            hold=program.constant(1.0) if hold else command.busy,
            watch=program.rows(2),
            still=self.still,
            steps=self.steps,
            outcome=outcome,
        )
        k, n = c.k, c.columns.size
        room, full = program.scratch(k * n + k + n + scratch_of(k, n)), program.number(c.full_rank)
        rcond = program.constant(c.rcond)
        add(judging.stalls, **given, rcond=rcond, full=full, outcome=outcome, scratch=room)
        if not images.fresh or plant.moves:
            rates = [plant.rates[i] for i in c.columns] if plant.moves else []
            add(
                judging.wait,
                **paced,
                size=size,
                age=images.age,
                periods=program.rows(),
                outcome=outcome,
                steps=self.steps,
                rates=rates,
            )
        if self.endings:
            program.call(lambda blocks, step: self._ask(blocks, step, plant, images, command))

    def _worst(self, seen: Rows, left: Rows | None) -> Rows:
        """Return the row of the status of the image, and of what is left of it to command."""
        if left is None:
            return seen
        found = self.program.rows()
        self.program.add(worst, out=found, rows=[seen, left])
        return found

    @property
    def judged(self) -> Judged:
        """The rows that are kept at the end of a run."""
        return Judged(self.outcome, self.ending, self.length)

    def _ask(
        self, blocks: Blocks, step: int, plant: Plant, images: Images, command: Commanded
    ) -> None:
        """End runs that nothing else ends, and of which an ending holds."""
        get, scene = blocks.get, plant.scene
        arrays = (get(plant.q), get(plant.qd), get(command.error), get(images.true, images.N, 2))
        q, qd, error, pixels = (shown_view(array) for array in arrays)
        now = Moment(step * plant.seconds, scene, q, qd, error, pixels, frozen(blocks.rows.view()))
        found = which(self.endings, now)
        outcome = get(self.outcome)
        open_ = (outcome == kernels.RUNNING) | (outcome == kernels.TIME_LIMIT)
        ends = open_ & (found >= 0)
        blocks.put(self.outcome, np.where(ends, kernels.ENDED, outcome))
        blocks.put(self.ending, np.where(ends, found, -1.0))

    def _moving(self, plant: Plant, images: Images) -> Rows:
        """Return the rows of the pose whose way is measured."""
        if not images.views:
            return plant.placed.frames([plant.scene.tree.find(self.controller.moving)])[0]
        seen, moves = images.views[0], images.sights[0].camera_moves
        return seen.frames[0 if moves else 1]
