"""The termination checks: whether a run ends, and its outcome."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from robsim.base.arrays import make_read_only, view_for_user
from robsim.engine.endings import ControlInstant, Ending, find_first_ending
from robsim.engine.image_stream import ImageStream
from robsim.engine.plant import Plant
from robsim.features.feature_rows import select_rows
from robsim.kernels.linear_algebra.svd import count_truncation_rows
from robsim.kernels.machine.block_rows import BlockRows
from robsim.kernels.machine.program import Blocks, Program
from robsim.kernels.outcomes import outcome_codes as kernels
from robsim.kernels.outcomes import outcome_rules
from robsim.robot.joint import LIMIT_SLACK
from robsim.servo.controller_rows import ControllerOutputs
from robsim.servo.task_controller import TaskController
from robsim.servo.weight_stages import add_maximum


class TerminationChecks:
    """Rows and stages of a program that determine the outcome of each run."""

    def __init__(
        self, program: Program, controller: TaskController, steps: int, endings: Sequence[Ending]
    ) -> None:
        self.program, self.controller, self.steps = program, controller, steps
        self.endings = endings
        self.outcome, self.length, self.still = program.rows(), program.rows(), program.rows()
        self.ending = program.constant(-1.0)
        self.tolerance = program.constant(controller.tolerance)
        self.pace = program.number(controller.pace)
        self.scale = program.constant(controller.tolerance_scale)

    def judge(
        self,
        plant: Plant,
        images: ImageStream,
        command: ControllerOutputs,
        hold: bool,
        limited: bool,
    ) -> None:
        """Add the stages that compute the criteria and the outcome, and classify stalls."""
        task = {"A": command.task_jacobian, "scale": self.scale}
        paced_task = {**task, "pace": self.pace, "tolerance": self.tolerance}
        commanded, moving_at = self._find_rates(plant, command)
        size, norm = self._measure_error(command)
        self.program.add(
            outcome_rules.count_still_periods, **paced_task, qd=moving_at, periods=self.still
        )
        self._measure_path(plant, images)
        self._judge_outcome(plant, images, command, size, norm, hold, limited)
        self._classify_stall(task)
        if not images.fresh or plant.moves:
            self._defer_convergence(plant, images, paced_task, commanded, size)
        if plant.driven is not None:
            from robsim.kernels.dynamics.joint_drives import judge_stability  # late: needs a drive

            code = self.program.constant(kernels.UNSTABLE)
            self.program.add(
                judge_stability, unstable=plant.driven.unstable, code=code, outcome=self.outcome
            )
        if self.endings:
            self.program.call(
                lambda blocks, step: self._check_endings(blocks, step, plant, images, command)
            )

    def _measure_error(self, command: ControllerOutputs) -> tuple[BlockRows, BlockRows]:
        """Return the rows of the largest error by its tolerance, and of the norm of the error."""
        add, size, norm = self.program.add, self.program.rows(), self.program.rows()
        add(
            outcome_rules.measure_error,
            errors=command.error,
            scale=self.scale,
            size=size,
            norm=norm,
        )
        if command.step is not None:
            add(outcome_rules.include_step, share=command.step, tolerance=self.tolerance, size=size)
        return size, norm

    def _measure_path(self, plant: Plant, images: ImageStream) -> None:
        """Add the stage that sums the length of the path of the moving frame."""
        self.program.add(
            outcome_rules.accumulate_path_length,
            T=self._moving_frame(plant, images),
            before=self.program.rows(3),
            length=self.length,
        )

    def _judge_outcome(
        self,
        plant: Plant,
        images: ImageStream,
        command: ControllerOutputs,
        size: BlockRows,
        norm: BlockRows,
        hold: bool,
        limited: bool,
    ) -> None:
        """Add the stage that computes the outcome."""
        program = self.program
        status = add_maximum(program, [images.status, command.status])
        assert status is not None
        slack = np.array([-1.0, 1.0]) * (LIMIT_SLACK if limited else np.inf)
        program.add(
            outcome_rules.judge_outcome,
            q=plant.q,
            limits=program.constant((plant.scene.limits + slack).T),
            status=status,
            depth=images.true[2 * images.N : 3 * images.N].column,
            qd=command.qd,
            size=size,
            norm=norm,
            tolerance=self.tolerance,
            hold=program.constant(1.0) if hold else command.busy,
            bounds=program.rows(2),
            still_periods=self.still,
            steps=self.steps,
            outcome=self.outcome,
        )

    def _classify_stall(self, task: dict[str, BlockRows]) -> None:
        """Add the stage that distinguishes the causes of a standstill."""
        program, c = self.program, self.controller
        k, n = c.k, c.columns.size
        program.add(
            outcome_rules.classify_stall,
            **task,
            rcond=program.constant(c.rcond),
            full_rank=program.number(c.full_rank),
            outcome=self.outcome,
            scratch=program.scratch(k * n + k + n + count_truncation_rows(k, n)),
        )

    def _defer_convergence(
        self,
        plant: Plant,
        images: ImageStream,
        paced_task: dict[str, BlockRows],
        commanded: BlockRows,
        size: BlockRows,
    ) -> None:
        """Add the stage that waits for an image of the present pose before a run converges."""
        columns = self.controller.columns
        self.program.add(
            outcome_rules.defer_convergence,
            **paced_task,
            qd=commanded,
            size=size,
            age=images.age,
            periods=self.program.rows(),
            outcome=self.outcome,
            steps=self.steps,
            rates=[plant.rates[i] for i in columns] if plant.moves else [],
        )

    def _find_rates(self, plant: Plant, command: ControllerOutputs) -> tuple[BlockRows, BlockRows]:
        """Return the rows of the velocities to reach, and of those that show a standstill.

        Both are the command of a law of velocities. A law of torques reaches its goal at rest, and
        its joints stand still when their own velocities do.
        """
        if self.controller.command_quantity == "velocity":
            return command.qd, command.qd
        own = select_rows(self.program, plant.rates, self.controller.columns)
        return self.program.constant(np.zeros(command.qd.size)), own

    def _check_endings(
        self,
        blocks: Blocks,
        step: int,
        plant: Plant,
        images: ImageStream,
        command: ControllerOutputs,
    ) -> None:
        """Set the outcome of runs with an ending that holds and without another outcome."""
        get, scene = blocks.get, plant.scene
        arrays = (get(plant.q), get(plant.qd), get(command.error), get(images.true, images.N, 2))
        q, qd, error, pixels = (view_for_user(array) for array in arrays)
        now = ControlInstant(
            step * plant.seconds, scene, q, qd, error, pixels, make_read_only(blocks.rows.view())
        )
        first = find_first_ending(self.endings, now)
        outcome = get(self.outcome)
        open_ = (outcome == kernels.RUNNING) | (outcome == kernels.TIME_LIMIT)
        ends = open_ & (first >= 0)
        blocks.put(self.outcome, np.where(ends, kernels.ENDED, outcome))
        blocks.put(self.ending, np.where(ends, first, -1.0))

    def _moving_frame(self, plant: Plant, images: ImageStream) -> BlockRows:
        """Return the rows of the pose of the moving frame, for the path length."""
        if not images.views:
            return plant.placed.frames([plant.scene.tree.find(self.controller.moving)])[0]
        seen, moves = images.views[0], images.sights[0].camera_moves
        return seen.frames[0 if moves else 1]
