"""The linear loop of an experiment at rest: state, response, how it grows with gains, times."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

from robsim.analysis.advising.response import Response
from robsim.analysis.advising.rest import at_rest, has_gain, steady
from robsim.analysis.advising.scaled import Scaled
from robsim.analysis.advising.timing import Timing
from robsim.analysis.field import Field
from robsim.analysis.leaves import leaves
from robsim.base.arrays import Array
from robsim.base.errors import InputError
from robsim.run.experiment import Experiment
from robsim.servo.tasks.task import Task

WHO = "advise"  # of errors


@dataclass(frozen=True, eq=False)
class Linear:
    """A task, linear near a state of rest q (nq, 1), in a loop with these times."""

    task: Task  # steady
    field: Field
    q: Array
    timing: Timing

    @classmethod
    def of(cls, experiment: Experiment) -> Self:
        """Return the loop of an experiment; InputError where there is no linear one."""
        task = steady(experiment.task)
        field = Field.of(experiment.scene, task, WHO)
        if not field.controller.sights:
            raise InputError(f"{WHO}: the task looks through no camera")
        q = at_rest(field, experiment)
        field.check_forgetful(q, WHO)
        return cls(task, field, q, Timing.of(experiment))

    def with_task(self, task: Task) -> Self:
        """Return the same with another task at the same state."""
        return replace(self, task=task, field=Field.of(self.field.scene, task, WHO))

    @property
    def calm(self) -> Timing:
        """The times without lost images, which are enough to compare limits."""
        return replace(self.timing, lost=0.0)

    @cached_property
    def response(self) -> Response:
        """What is commanded near the state of rest."""
        return Response.of(self.field, self.q)

    @cached_property
    def scaled(self) -> Scaled:
        """The same as a function of a factor of all gains."""
        own = leaves(self.task)
        if not own or not all(map(has_gain, own)):
            return Scaled.of(self.response, None)
        twice = self.with_task(steady(self.task, 2.0))
        return Scaled.of(self.response, twice.response)
