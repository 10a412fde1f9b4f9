"""Measures of a run at its instants: Lyapunov function, ranks, stability and margins."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from robsim.analysis.loop_stability import LoopStability, measure_stability
from robsim.analysis.resimulation import Resimulation
from robsim.analysis.true_error import TrueError, compute_true_error
from robsim.base.arrays import Array, move_runs_first
from robsim.servo.servo_controller import ServoController

Measures = dict[str, NDArray[Any]]


@dataclass(frozen=True, eq=False)
class InstantMeasures:
    """Measures of a resimulated run at every instant.

    `measures[name]` returns one measure (T,), and computes the measures that belong to it when they
    are first read. `diagnose` describes the measures.
    """

    again: Resimulation

    def __getitem__(self, name: str) -> NDArray[Any]:
        if name not in self._computed:
            group = next(each for each in GROUPS if name in GROUPS[each])
            with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
                self._computed.update(group(self))
        return self._computed[name]

    @cached_property
    def _computed(self) -> Measures:
        """The measures that were read."""
        return {}

    @cached_property
    def velocities(self) -> Array:
        """The velocities of the joints (T, nv) at the beginning of each period."""
        run = self.again.run
        name = "qd_actual" if "qd_actual" in run else "qd"
        velocities: Array = run[name].values[: self.again.history.length]
        return velocities

    @cached_property
    def truth(self) -> TrueError | None:
        """The true error and Jacobians; None if the true camera does not see the goal."""
        again = self.again
        truth = compute_true_error(again.case.task, again.case.scene, again.q)
        if truth is not None and "weight" in again.run:
            truth = truth.weighted(again.run["weight"].values[: again.history.length])
        return truth

    @cached_property
    def task_jacobian(self) -> Array | None:
        """The true L J (T, k, n) of the commanded velocities, with the weights of the law."""
        if self.truth is None:
            return None
        return self.truth.weights[..., None] * self.truth.rates[..., self.again.controller.columns]

    @property
    def unknown(self) -> Array:
        """The values (T,) of an unknown measure."""
        return np.full(self.again.history.length, np.nan)


def compute_lyapunov_function(of: InstantMeasures) -> Measures:
    """Return V and its rate; NaN without true features."""
    truth = of.truth
    if truth is None:
        return {"lyapunov": of.unknown, "lyapunov_rate": of.unknown}
    return {
        "lyapunov": 0.5 * np.einsum("tk,tk->t", truth.error, truth.error),
        "lyapunov_rate": np.einsum("tk,tkv,tv->t", truth.error, truth.rates, of.velocities),
    }


def measure_interaction(of: InstantMeasures) -> Measures:
    """Return the rank and singular values of the L that the law used."""
    inputs = of.again.law_inputs
    if inputs is None:
        return _describe_singular_values("interaction", of.unknown[:, None], 1, of)
    sigma = singular_values_over_time(move_runs_first(inputs.state.interaction_last))
    return _describe_singular_values("interaction", sigma, sigma.shape[1], of)


def measure_task_jacobian(of: InstantMeasures) -> Measures:
    """Return the rank and singular values of the L J that the law used."""
    inputs, command = of.again.law_inputs, of.again.history.state.command
    used = command.task_jacobian if inputs is None else inputs.state.task_jacobian_last
    full = min(of.again.controller.full_rank, *used.shape[:2])
    sigma = singular_values_over_time(move_runs_first(used))
    return _describe_singular_values("task_jacobian", sigma, full, of)


def _describe_singular_values(name: str, sigma: Array, full: int, of: InstantMeasures) -> Measures:
    """Return rank, condition number and smallest of singular values (T, n), up to number `full`."""
    count = (sigma > of.again.controller.rcond * sigma[:, :1]).sum(axis=1)
    return {
        f"rank_{name}": np.where(np.isfinite(sigma[:, 0]), count, np.nan),
        f"condition_{name}": sigma[:, 0] / sigma[:, full - 1],
        f"smallest_{name}": sigma[:, full - 1],
    }


def compute_stability(of: InstantMeasures) -> Measures:
    """Return the first-order stability measures of the closed loop."""
    again, inputs, truth = of.again, of.again.law_inputs, of.truth
    controller, task_jacobian = again.controller, of.task_jacobian
    law = controller.law if isinstance(controller, ServoController) else None
    if law is None or truth is None or task_jacobian is None or inputs is None:
        return LoopStability(*(of.unknown for _ in LoopStability._fields))._asdict()
    matrices = truth.L, task_jacobian
    return measure_stability(law, inputs.state, *matrices, again.case.dt)._asdict()


def measure_border_margins(of: InstantMeasures) -> Measures:
    """Return the distance (T,) and the number (T,) of the mark nearest to its image border."""
    distances = []
    for sight in of.again.controller.sights:
        low, high = sight.eye.camera.border.T[:, None, :, None]
        pixels = of.again.history.state.projections[sight.key].pixels
        distances.append(np.minimum(pixels - low, high - pixels).min(axis=1))
    margins = np.concatenate(distances)
    margins[~np.isfinite(margins)] = np.inf  # behind the camera, or no border
    border, mark = _smallest_margin(margins)
    return {"border_margin": border, "border_mark": mark}


def count_marks_in_image(of: InstantMeasures) -> Measures:
    """Return the number (T,) of marks in their image."""
    views = of.again.history.state.projections.values()
    counts = [(each.visibility == 0).sum(axis=0) for each in views]
    return {"marks_in_image": np.sum(counts, axis=0)}


def measure_limit_margins(of: InstantMeasures) -> Measures:
    """Return the distance (T,) from the nearest limit, as a share of its range, and its row."""
    q, limits = of.again.q, of.again.case.scene.limits
    low, high = limits[:, :1], limits[:, 1:]
    span = np.where(np.isfinite(high - low), high - low, 1.0)
    limit, coordinate = _smallest_margin(np.minimum(q - low, high - q) / span)
    return {"limit_margin": limit, "limit_coordinate": coordinate}


def _smallest_margin(margins: Array) -> tuple[Array, NDArray[np.int64]]:
    """Return the smallest finite margin of (N, T) and its row; NaN and -1 if there is none."""
    if not len(margins):
        return np.full(margins.shape[1], np.nan), np.full(margins.shape[1], -1)
    least, row = margins.min(axis=0), margins.argmin(axis=0)
    finite = np.isfinite(least)
    return np.where(finite, least, np.nan), np.where(finite, row, -1)


def measure_singularity(of: InstantMeasures) -> Measures:
    """Return the ratio (T,) of the smallest to the largest singular value of the true L J."""
    if of.task_jacobian is None:
        return {"singularity": of.unknown}
    values = singular_values_over_time(of.task_jacobian)
    least = values[:, min(of.again.controller.full_rank, values.shape[1]) - 1]
    return {"singularity": least / values[:, 0]}


def singular_values_over_time(A: Array) -> Array:
    """Return singular values (T, min(m, n)) of A (T, m, n), largest first; NaN if not finite."""
    finite = np.isfinite(A).all(axis=(1, 2))
    sigma = np.full((len(A), min(A.shape[1:])), np.nan)
    sigma[finite] = np.linalg.svd(A[finite], compute_uv=False)
    return sigma


# functions that compute measures together, with the names of their measures
GROUPS: dict[Callable[[InstantMeasures], Measures], tuple[str, ...]] = {
    compute_lyapunov_function: ("lyapunov", "lyapunov_rate"),
    measure_interaction: ("rank_interaction", "condition_interaction", "smallest_interaction"),
    measure_task_jacobian: (
        *("rank_task_jacobian", "condition_task_jacobian", "smallest_task_jacobian"),
    ),
    compute_stability: LoopStability._fields,
    measure_border_margins: ("border_margin", "border_mark"),
    count_marks_in_image: ("marks_in_image",),
    measure_limit_margins: ("limit_margin", "limit_coordinate"),
    measure_singularity: ("singularity",),
}
