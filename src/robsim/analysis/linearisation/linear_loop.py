"""The linear loop of an experiment at rest: state, response, gain dependence and timing."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Self

from robsim.analysis.linearisation.gain_dependence import GainDependence
from robsim.analysis.linearisation.linear_response import LinearResponse
from robsim.analysis.linearisation.loop_delays import LoopDelays
from robsim.analysis.linearisation.rest_state import find_rest_state, has_single_gain, make_steady
from robsim.analysis.task_tree import list_servo_tasks
from robsim.analysis.vector_fields import VectorField
from robsim.base.arrays import Array
from robsim.base.errors import InputError
from robsim.run.experiment import Experiment
from robsim.servo.tasks.task import Task

if TYPE_CHECKING:  # few experiments have drives
    from robsim.analysis.linearisation.drive_derivatives import DriveDerivatives
    from robsim.analysis.linearisation.driven_loop import DrivenLoop

CALLER = "advise"  # subject of error messages


@dataclass(frozen=True, eq=False)
class LinearLoop:
    """A task, linearised about a state of rest q (nq, 1), in a loop with the given timing."""

    task: Task  # with constant gains
    field: VectorField
    q: Array
    timing: LoopDelays
    drives: DriveDerivatives | None = None

    @classmethod
    def of(cls, experiment: Experiment) -> Self:
        """Return the loop of an experiment; raise InputError if it has no linear loop."""
        task = make_steady(experiment.task)
        field = VectorField.of(experiment.scene, task, CALLER)
        if not field.controller.sights:
            raise InputError(f"{CALLER}: the task uses no camera")
        q = find_rest_state(field, experiment)
        field.check_memoryless(q, CALLER)
        return cls(task, field, q, LoopDelays.of(experiment), _differentiate(experiment, field, q))

    def with_task(self, task: Task) -> Self:
        """Return the same loop with another task at the same state."""
        return replace(self, task=task, field=VectorField.of(self.field.scene, task, CALLER))

    @property
    def lossless(self) -> LoopDelays:
        """The timing without lost images, which suffices to compare limits."""
        return replace(self.timing, lost=0.0)

    @cached_property
    def response(self) -> LinearResponse:
        """The derivatives of the command near the state of rest."""
        return LinearResponse.of(self.field, self.q)

    @cached_property
    def gain_dependence(self) -> GainDependence:
        """The response as a function of a factor of all gains."""
        own = list_servo_tasks(self.task)
        if not own or not all(map(has_single_gain, own)):
            return GainDependence.of(self.response, None)
        return GainDependence.of(self.response, self._doubled.response)

    @cached_property
    def _doubled(self) -> LinearLoop:
        """The loop with twice the gains."""
        return self.with_task(make_steady(self.task, 2.0))

    @cached_property
    def driven(self) -> DrivenLoop | None:
        """The loop with the drives; None without a drive."""
        if self.drives is None:
            return None
        own = list_servo_tasks(self.task)
        is_scaled = bool(own) and all(map(has_single_gain, own))
        return self._make_driven(self._doubled) if is_scaled else self.proportional_driven

    @property
    def proportional_driven(self) -> DrivenLoop | None:
        """The loop with the drives of a command that is proportional to the gains."""
        return self._make_driven(None)

    def _make_driven(self, doubled: LinearLoop | None) -> DrivenLoop | None:
        """Return the loop with the drives from the loop with twice the gains."""
        if self.drives is None:
            return None
        from robsim.analysis.linearisation.driven_loop import DrivenLoop

        twice = None if doubled is None else doubled.moved_response
        return DrivenLoop.of(self.moved_response, twice, self.drives)

    @property
    def moved_response(self) -> LinearResponse:
        """The derivatives of the command by the motions of all joints that move."""
        assert self.drives is not None
        if self.drives.moved.size == self.field.n:
            return self.response
        from robsim.analysis.linearisation.driven_loop import MovedField

        return LinearResponse.of(MovedField(self.field.controller, self.drives.moved), self.q)


def _differentiate(experiment: Experiment, field: VectorField, q: Array) -> DriveDerivatives | None:
    """Return the derivatives of the driven joints at rest; None without a drive."""
    if experiment.actuation.drive is None:
        return None
    from robsim.analysis.linearisation.drive_derivatives import DriveDerivatives

    return DriveDerivatives.of(experiment, field.controller.columns, q)
