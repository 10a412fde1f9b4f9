"""Weighting over time, for marks that are hidden and reappear."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

from robsim.declare import DeclaredValue, PerRun, Time, register
from robsim.kernels.control import mark_weights as kernels
from robsim.kernels.machine.block_rows import BlockRows
from robsim.servo.weightings.weighting_protocol import MarkRows, MarkWeighting


@register("weighting", "fade")
@dataclass(frozen=True)
class Fade(MarkWeighting, DeclaredValue):
    """Weighting that fades marks in and out as they appear and disappear.

    The weight of a mark that reappears grows from 0 to 1 within `time`. A mark that disappears
    keeps its last measured pixels, and its weight falls to 0 within `time`. Marks present at the
    start have weight 1. The command therefore stays continuous when objects hide marks. A larger
    `time` makes the command smoother, but uses old positions of hidden marks for longer.

    Raises
    ------
    InputError
        By `simulate`, if a feature depends on all marks at once, such as a moment.

    Examples
    --------
    Largest change of a velocity from one period to the next, with little and with more fading:

    >>> from dataclasses import replace
    >>> import robsim as rs
    >>> scenario = rs.load_scenario(rs.examples.path("marks_come_and_go"))
    >>> for time in 0.04, 0.4:
    ...     weighting = rs.weights.Border(width=40), rs.weights.Fade(time=time)
    ...     task = replace(scenario.task, weighting=weighting)
    ...     run = replace(scenario, task=task).run()
    ...     jump = float(np.nanmax(abs(np.diff(run.qd.values, axis=0))))
    ...     print(f"{jump:.2f}")
    0.03
    0.02
    """

    fades: ClassVar[bool] = True

    time: Annotated[
        float,
        Time(above=0),
        PerRun(()),
        "Time in which a weight rises to 1 or falls to 0, in seconds.",
    ] = 0.5

    def marks(self, of: MarkRows) -> BlockRows:
        """Add the stage of the weights of the marks of a pair; return their rows."""
        program = of.inputs.program
        times = {"seconds": program.number(self.time), "dt": of.inputs.dt}
        ramp = program.rows(of.N)
        return program.result(
            kernels.fade_weights, "out", of.N, there=of.present, **times, ramp=ramp
        )
