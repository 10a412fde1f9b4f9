"""The controller that predicts the motion of candidates and commands the best of them."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array
from robsim.kernels.control import rollout
from robsim.kernels.control.control_law import copy_rows
from robsim.kernels.machine.block_rows import BlockRows
from robsim.kernels.machine.program import Blocks
from robsim.servo.controller_rows import ControllerInputs, ControllerOutputs
from robsim.servo.laws.law import JointLaw
from robsim.servo.prediction import Forecast, Prediction, divide_horizon, name_path
from robsim.servo.servo_controller import ServoController
from robsim.servo.servo_stages import ServoStages

ARRIVED = 1e-6  # metres; candidates that end nearer to the goal are equally good


class RolloutSettings(NamedTuple):
    """Numbers of a prediction: horizon and period in seconds, margin in pixels, hysteresis."""

    horizon: float
    period: float
    margin: float | Array
    hysteresis: float


@dataclass(frozen=True, eq=False, kw_only=True)
class RolloutController(ServoController):
    """Controller of a servo task that commands the best of several candidates.

    Attributes
    ----------
    candidates : tuple of ServoController
        Controllers of the same velocities and camera-target pairs.
    settings : RolloutSettings
        Numbers of the prediction.
    """

    candidates: tuple[ServoController, ...]
    settings: RolloutSettings

    def stages(self, inputs: ControllerInputs) -> ControllerOutputs:
        """Add the stages of all candidates, and the prediction that selects one of them."""
        own = ServoStages(replace(self, law=JointLaw()), inputs)
        own.assess()
        program, n = inputs.program, self.columns.size
        choice, last = program.constant(-1.0), program.rows(n)
        self._add_choice(inputs, choice, last)
        each = [
            one.stages(replace(inputs, path=name_path(inputs.path, i)))
            for i, one in enumerate(self.candidates)
        ]
        qd = program.result(
            rollout.select_command, "qd", n, choice=choice, commands=[one.qd for one in each]
        )
        outputs = own.outputs(qd)

        def note(qd: BlockRows) -> None:
            for one in (outputs, *each):
                one.note(qd)
            program.add(copy_rows, rows=qd, to=last)

        return replace(outputs, note=note)

    def _add_choice(self, inputs: ControllerInputs, choice: BlockRows, last: BlockRows) -> None:
        """Add the Python stage that selects a candidate at each predicted period.

        `last` (n,) are the rows of the last command.
        """
        settings = self.settings
        times = divide_horizon(settings.horizon, settings.period, inputs.seconds)
        prediction = Prediction(self, self.candidates, times, settings.margin, inputs.path)

        def choose(blocks: Blocks, step: int) -> None:
            if step % times.between == 0:
                present = blocks.get(inputs.q), blocks.get(last)
                forecast = prediction.forecast(*present, blocks, step // times.between)
                before = blocks.get(choice).astype(np.int64)
                best = choose_candidates(forecast, before, settings.hysteresis)
                blocks.put(choice, best.astype(np.float64))

        inputs.program.call(choose)


def choose_candidates(
    forecast: Forecast, last: NDArray[np.int64], hysteresis: float
) -> NDArray[np.int64]:
    """Return the number of the selected candidate of each run (B,).

    It is the feasible candidate that ends nearest to the goal, or without any the candidate that
    stays feasible longest, the nearest to the goal if several do. The last candidate (-1: none)
    remains if it stays feasible as long, unless another ends nearer by the share `hysteresis`.
    """
    counts, runs = forecast.counts, np.arange(len(last))
    distances = np.where(np.isfinite(forecast.distances), forecast.distances, np.inf)
    longest = counts == counts.max(axis=0)
    scores = np.where(longest, distances, np.inf)
    best = np.where(longest & (scores == scores.min(axis=0)), 1, 0).argmax(axis=0)
    stays = (last >= 0) & longest[last, runs]
    nearer = scores[best, runs] < (1.0 - hysteresis) * scores[last, runs] - ARRIVED
    return np.where(stays & ~nearer, last, best)


def make_rollout_controller(
    controller: ServoController, candidates: tuple[ServoController, ...], settings: RolloutSettings
) -> RolloutController:
    """Return the controller that selects one of several candidates for the task of another."""
    own = {each.name: getattr(controller, each.name) for each in fields(ServoController)}
    return RolloutController(**own, candidates=candidates, settings=settings)
