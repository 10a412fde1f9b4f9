"""Robust weightings: marks far from their expected positions count less (M-estimation).

The command is the weighted least squares of diag(w) L and diag(w) e, with the weights w of an
M-estimate (Comport, Marchand and Chaumette, "Statistically robust 2-D visual servoing", IEEE
Transactions on Robotics 22(2), 2006). Their residual is an error minus the median of all errors.
RobSim takes the distance of a mark from its position at the goal without this subtraction: a common
motion of the marks enters the scale. A residual against a motion fitted to the marks is useless
for four marks: for a square parallel to the image, an error of one mark leaves equal residuals at
all four.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

from robsim.declare import DeclaredValue, Number, PerRun, register
from robsim.kernels.estimation import m_estimator as kernels
from robsim.kernels.machine.block_rows import BlockRows
from robsim.servo.weightings.weighting_protocol import MarkRows, MarkWeighting

RobustNoise = Annotated[
    float,
    Number(above=0, unit="px"),
    PerRun(()),
    "Expected noise of a mark, in pixels: the smallest scale of the distances.",
]


class _RobustWeighting(MarkWeighting):
    """Base of weightings by the distance of marks from their positions at the goal."""

    by_goal: ClassVar[bool] = True
    least_marks: ClassVar[int] = 4  # an outlier among three leaves two marks, which fix no pose
    kernel: ClassVar[int]
    noise: float

    def marks(self, of: MarkRows) -> BlockRows:
        """Add the stage of the weights of the marks of a pair; return their rows."""
        program, N = of.inputs.program, of.N
        goal = program.numbers(of.goal, 2)
        image = {"pixels": of.view.pixels, "goal": goal, "present": of.present}
        options = {"kind": self.kernel, "least_scale": program.number(self.noise)}
        room = program.scratch(3 * N)
        return program.result(
            kernels.weight_by_distance, "weights", N, **image, **options, scratch=room
        )


@register("weighting", "huber")
@dataclass(frozen=True)
class Huber(_RobustWeighting, DeclaredValue):
    """Huber's robust weighting: full weight up to a distance, and then the inverse of the distance.

    The distance r of each mark from its position at the goal, in pixels, is divided by the scale
    1.4826 median(r), or by `noise` if it is larger: u = r/scale. The weight is

        w = 1  for u <= 1.345,    w = 1.345/u  otherwise

    (Huber, "Robust estimation of a location parameter", Annals of Mathematical Statistics 35,
    1964). Use it against outliers of the image processing. It never drops a mark entirely, so the
    run keeps converging, with a small bias. A larger `noise` keeps correct marks at full weight
    near the goal, and admits larger outliers.

    Raises
    ------
    InputError
        By `simulate`, if the target has fewer than four marks, or if the numbers of a goal are no
        image points.

    Examples
    --------
    Five percent of the measurements are outliers of 30 pixels:

    >>> import robsim as rs
    >>> scenario = rs.load_scenario(rs.examples.path("marks_that_lie"))
    >>> for weighting in (), rs.weights.Huber():
    ...     task = rs.IBVS(scenario.task.goal, weighting=weighting)
    ...     sensing = {"sensing": scenario.sensing, "seed": 1}
    ...     run = rs.simulate(scenario.scene, task, scenario.start, duration=20, **sensing)
    ...     print(f"{1000 * float(run.distance_to_goal):.0f} mm")
    36 mm
    1 mm
    """

    kernel: ClassVar[int] = kernels.HUBER
    noise: RobustNoise = 1.0


@register("weighting", "tukey")
@dataclass(frozen=True)
class Tukey(_RobustWeighting, DeclaredValue):
    """Tukey's robust weighting, the biweight: marks beyond a distance have nearly no weight.

    With u as for `Huber`, the weight is

        w = (1 - (u/4.685)^2)^2  for u < 4.685,    and at least 0.001

    (Beaton and Tukey, Technometrics 16, 1974). Unlike `Huber` it rejects gross outliers almost
    entirely. Far from the goal, correct marks with large errors may be rejected as well.

    Raises
    ------
    InputError
        By `simulate`, if the target has fewer than four marks, or if the numbers of a goal are no
        image points.

    Examples
    --------
    Five percent of the measurements are outliers of 30 pixels:

    >>> import robsim as rs
    >>> scenario = rs.load_scenario(rs.examples.path("marks_that_lie"))
    >>> task = rs.IBVS(scenario.task.goal, weighting=rs.weights.Tukey(noise=0.5))
    >>> sensing = {"sensing": scenario.sensing, "seed": 1}
    >>> run = rs.simulate(scenario.scene, task, scenario.start, duration=20, **sensing)
    >>> float(run.distance_to_goal) < 0.01
    True
    """

    kernel: ClassVar[int] = kernels.TUKEY
    noise: RobustNoise = 1.0


@register("weighting", "cauchy")
@dataclass(frozen=True)
class Cauchy(_RobustWeighting, DeclaredValue):
    """Cauchy's robust weighting: the weight falls smoothly with the square of the distance.

    With u as for `Huber`, the weight is

        w = 1/(1 + (u/2.385)^2)

    (Holland and Welsch, Communications in Statistics A6, 1977). It is smooth everywhere, and
    between `Huber` and `Tukey` in its effect on large outliers.

    Raises
    ------
    InputError
        By `simulate`, if the target has fewer than four marks, or if the numbers of a goal are no
        image points.

    Examples
    --------
    Five percent of the measurements are outliers of 30 pixels:

    >>> import robsim as rs
    >>> scenario = rs.load_scenario(rs.examples.path("marks_that_lie"))
    >>> task = rs.IBVS(scenario.task.goal, weighting=rs.weights.Cauchy())
    >>> sensing = {"sensing": scenario.sensing, "seed": 1}
    >>> run = rs.simulate(scenario.scene, task, scenario.start, duration=20, **sensing)
    >>> float(run.distance_to_goal) < 0.01
    True
    """

    kernel: ClassVar[int] = kernels.CAUCHY
    noise: RobustNoise = 1.0
