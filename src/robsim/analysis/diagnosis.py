"""Diagnosis of a run over time: Lyapunov function, ranks, stability and margins."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from robsim.analysis.resimulation import Resimulation, resimulate_run
from robsim.analysis.true_error import TrueError, compute_true_error
from robsim.base.arrays import Array, view_runs_last
from robsim.base.value import replace_unchecked
from robsim.run.experiment import Experiment
from robsim.servo.command import LawInput
from robsim.servo.laws.control_state import ControlState
from robsim.servo.laws.inverse import RCOND
from robsim.servo.laws.law import CameraLaw, JointLaw, Law
from robsim.servo.servo_controller import ServoController

if TYPE_CHECKING:
    import xarray as xr

LONG_NAMES = {
    "lyapunov": "V: half the square of the true error (chapter, eq. 16)",
    "lyapunov_rate": "dV/dt along the motion of the joints (chapter, eq. 17)",
    "rank_interaction": "rank of L as the law was given it",
    "condition_interaction": "largest over smallest singular value of L as the law was given it",
    "rank_task_jacobian": "rank of L J as the law was given it",
    "condition_task_jacobian": "largest over smallest singular value of L J as given to the law",
    "smallest_task_jacobian": "smallest singular value of L J as the law was given it",
    "stability": "smallest eigenvalue of the symmetric part of L Lhat^+ (chapter, eq. 18)",
    "stability_motion": "smallest eigenvalue of the symmetric part of (Lhat J)^+ L J",
    "contraction": "largest |eigenvalue| of I - gain dt (Lhat J)^+ L J",
    "border_margin": "least distance of a mark from the border of its image",
    "border_mark": "number of that mark",
    "marks_in_image": "number of marks that are in their image",
    "limit_margin": "least distance of a joint from a limit, as a share of its range",
    "limit_coordinate": "number of that coordinate; -1 if none is limited",
    "singularity": "smallest over largest singular value of the true L J",
}
UNITS = {"border_margin": "px"}


def diagnose(run: xr.Dataset, experiment: Experiment | None = None) -> xr.Dataset:
    """Return what the controller of a run used and what was true, at each recorded instant.

    The run is repeated from its own text, with the same bits, or from its `experiment`, where that
    is Python code. For a summary every instant is given.
    Lhat and Jhat are what the law was given, L and J what was true, all with the weights of the
    task, and of its weightings; V and its rate are those of the unweighted true error, of what has
    a weight above zero.

    lyapunov, lyapunov_rate
        V = e'e/2 (eq. 16) and e' L J qdot (eq. 17), with what moves on its own, and the velocities
        that the joints had when the period began
    rank_..., condition_..., smallest_task_jacobian
        of Lhat (interaction) and Lhat Jhat (task_jacobian); the smallest singular value is that of
        the rank that there is at the goal
    stability
        smallest eigenvalue of the symmetric part of L Lhat^+: V falls under V_c = -gain Lhat^+ e
        for every error if it is above zero (eqs 17 and 18). Its rank is at most 6, so for k > 6
        it never is
    stability_motion
        the same of (Lhat Jhat)^+ L J over the motions that the law can command, in rad and m: above
        zero every one of them is made smaller. For the camera law J^+ Lhat^+ stands in it
    contraction
        largest |eigenvalue| of I - gain dt (Lhat Jhat)^+ L J over these motions: near the goal a
        loop without delay converges where it is below 1
    border_margin, border_mark
        px and number of the mark next to the border of its image; NaN and -1 without borders
    marks_in_image
        number of marks of all cameras that are in their image
    limit_margin, limit_coordinate
        share of its range and number of the coordinate next to a limit; NaN and -1 without limits
    singularity
        smallest over largest singular value of the true L J, the smallest as above

    Of several tasks at once the rows of L J are stacked, in units of one tolerance for all, and
    what belongs to one interaction matrix or one law is NaN; so are stability_motion and
    contraction of any law but "joint" and "camera", and what is true where the true camera does
    not see the goal.
    InputError: no single run, or one that cannot be repeated.

    >>> from robsim import load_scenario
    >>> from robsim.files import examples
    >>> run = load_scenario(examples.path("visp_tutorial")).run(duration=0.4)
    >>> diagnosis = diagnose(run)
    >>> int(diagnosis.rank_interaction[0]), bool((diagnosis.lyapunov_rate < 0).all())
    (6, True)
    """
    whole = diagnose_resimulation(resimulate_run(run, experiment))
    record = run.attrs["record"]
    return whole.isel(time=slice(0, None, 1 if isinstance(record, str) else int(record)))


def diagnose_resimulation(again: Resimulation) -> xr.Dataset:
    """Return the diagnosis of a repeated run, at every instant."""
    import xarray as xr

    T = len(again.snapshots)
    q = np.concatenate([one.q for one in again.snapshots], axis=1)
    rates = again.run["qd_actual" if "qd_actual" in again.run else "qd"].values[:T]
    truth = compute_true_error(again.case.task, again.case.scene, q)
    if truth is not None and "weight" in again.run:
        truth = truth.weighted(again.run["weight"].values[:T])
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        found = {
            **_lyapunov_function(truth, rates),
            **_ranks_and_conditions(again),
            **_stability_measures(again, truth),
            **_all_margins(again, q),
            "singularity": _singularity_measure(again, truth, T),
        }
    variables = {
        name: (["time"], found[name], {"units": UNITS.get(name, "1"), "long_name": long})
        for name, long in LONG_NAMES.items()
    }
    variables["lyapunov"][2]["units"] = again.run["lyapunov"].attrs["units"]
    variables["lyapunov_rate"][2]["units"] = f"{variables['lyapunov'][2]['units']}/s"
    kept = ("time", "coordinate", "mark_camera", "mark_target")
    lived = again.run.isel(time=slice(0, T))
    coordinates = {name: lived[name] for name in kept}
    attributes = {"title": "RobSim diagnosis", "outcome": again.outcome.name, "dt": again.case.dt}
    return xr.Dataset(variables, coordinates, attributes)


def _lyapunov_function(truth: TrueError | None, rates: Array) -> dict[str, Array]:
    if truth is None:
        return dict.fromkeys(("lyapunov", "lyapunov_rate"), np.full(len(rates), np.nan))
    return {
        "lyapunov": 0.5 * np.einsum("tk,tk->t", truth.error, truth.error),
        "lyapunov_rate": np.einsum("tk,tkv,tv->t", truth.error, truth.rates, rates),
    }


def _ranks_and_conditions(again: Resimulation) -> dict[str, Array]:
    """Return ranks and singular values of the matrices that the law was given."""
    controller, basis = again.controller, list_command_bases(again)
    task_jacobian = _stack_instants([one.command.task_jacobian for one in again.snapshots])
    found: dict[str, Array] = {}
    if basis is None:
        sigma = np.full((len(task_jacobian), 1), np.nan)
    else:
        task_jacobian = _stack_instants([one.state.task_jacobian_last for one in basis])
        sigma = singular_values_over_time(
            _stack_instants([one.state.interaction_last for one in basis])
        )
    full = min(controller.full_rank, *task_jacobian.shape[1:])
    for name, values, least in (
        ("interaction", sigma, sigma.shape[1]),
        ("task_jacobian", singular_values_over_time(task_jacobian), full),
    ):
        found[f"rank_{name}"] = _count_rank(values, controller.rcond)
        found[f"condition_{name}"] = values[:, 0] / values[:, least - 1]
        found[f"smallest_{name}"] = values[:, least - 1]
    return found


def _count_rank(values: Array, rcond: float) -> Array:
    count = (values > rcond * values[:, :1]).sum(axis=1)
    return np.where(np.isfinite(values[:, 0]), count, np.nan)


def _stability_measures(again: Resimulation, truth: TrueError | None) -> dict[str, Array]:
    """Return the first-order stability measures of the closed loop."""
    T, basis = len(again.snapshots), list_command_bases(again)
    found = {name: np.full(T, np.nan) for name in ("stability", "stability_motion", "contraction")}
    controller = again.controller
    if truth is None or basis is None or not isinstance(controller, ServoController):
        return found
    linear = type(controller.law) in (JointLaw, CameraLaw)
    for t, one in enumerate(basis):
        task_jacobian = truth.weights[t][:, None] * truth.rates[t][:, controller.columns]
        L, state = truth.L[t], one.state
        used = L, task_jacobian, state.interaction_last, state.task_jacobian_last
        if not all(np.isfinite(array).all() for array in used):
            continue
        # as if the twist were commanded
        own = {"task_jacobian_last": state.interaction_last, "jacobian_last": np.eye(6)[..., None]}
        twist = replace_unchecked(state, **own)
        found["stability"][t] = smallest_eigenvalue(L @ -law_matrix(JointLaw(), twist))
        if linear:
            M = restrict_to_motions(-law_matrix(controller.law, state), task_jacobian)
            found["stability_motion"][t] = smallest_eigenvalue(M)
            gain = float(np.ravel(state.gain)[0])
            eigenvalues = np.linalg.eigvals(np.eye(len(M)) - gain * again.case.dt * M)
            found["contraction"][t] = np.abs(eigenvalues).max(initial=0.0)
    return found


def law_matrix(law: Law, state: ControlState) -> Array:
    """Return the matrix (n, k) that a law, linear in the error, applies to it at gain 1."""
    k = state.error_last.shape[0]

    def wide(array: Array) -> Array:
        return np.ascontiguousarray(np.repeat(array, k, axis=-1))

    unit = replace_unchecked(
        state,
        error_last=np.eye(k),
        interaction_last=wide(state.interaction_last),
        jacobian_last=wide(state.jacobian_last),
        task_jacobian_last=wide(state.task_jacobian_last),
        gain=1.0,
        s_last=None,  # nothing else counts for a law that is linear in the error
        q_last=None,
    )
    return np.array(view_runs_last(law.command(unit)))


def restrict_to_motions(P: Array, task_jacobian: Array) -> Array:
    """Return P task_jacobian restricted to the range of P (n, k): the motions commanded."""
    U, sigma, _ = np.linalg.svd(P, full_matrices=False)
    U = U[:, sigma > RCOND * sigma.max(initial=0.0)]
    M: Array = U.T @ P @ task_jacobian @ U
    return M


def smallest_eigenvalue(M: Array) -> float:
    """Return the least eigenvalue of the symmetric part of M."""
    return float(np.linalg.eigvalsh(0.5 * (M + M.T)).min(initial=np.inf))


def _all_margins(again: Resimulation, q: Array) -> dict[str, NDArray[Any]]:
    border, mark = _border_margins(again, q)
    limit, coordinate = _limit_margins(again.case.scene.limits, q)
    return {
        "border_margin": border,
        "border_mark": mark,
        "marks_in_image": _count_marks_in_image(again),
        "limit_margin": limit,
        "limit_coordinate": coordinate,
    }


def _border_margins(again: Resimulation, q: Array) -> tuple[Array, NDArray[np.int64]]:
    """Return the least distance (T,) of a mark from its image border, and which mark."""
    each = []
    for sight in again.controller.sights:
        low, high = sight.eye.camera.border.T[:, None, :, None]
        pixels = sight.project(q).pixels
        each.append(np.minimum(pixels - low, high - pixels).min(axis=1))
    margins = np.concatenate(each)
    margins[~np.isfinite(margins)] = np.inf  # behind the camera, or no border
    return _smallest_margin(margins)


def _count_marks_in_image(again: Resimulation) -> NDArray[np.int64]:
    """Return the number (T,) of marks that are in their image."""
    views = (one.projections.values() for one in again.snapshots)
    return np.array([sum(int((v.visibility == 0).sum()) for v in each) for each in views])


def _limit_margins(limits: Array, q: Array) -> tuple[Array, NDArray[np.int64]]:
    """Return the least distance (T,) from a limit as a share of its range, and where."""
    low, high = limits[:, :1], limits[:, 1:]
    span = np.where(np.isfinite(high - low), high - low, 1.0)
    return _smallest_margin(np.minimum(q - low, high - q) / span)


def _smallest_margin(margins: Array) -> tuple[Array, NDArray[np.int64]]:
    """Return the least finite margin of (N, T) and its row; NaN and -1 where there is none."""
    if not len(margins):
        return np.full(margins.shape[1], np.nan), np.full(margins.shape[1], -1)
    least, row = margins.min(axis=0), margins.argmin(axis=0)
    there = np.isfinite(least)
    return np.where(there, least, np.nan), np.where(there, row, -1)


def _singularity_measure(again: Resimulation, truth: TrueError | None, T: int) -> Array:
    if truth is None:
        return np.full(T, np.nan)
    controller = again.controller
    values = singular_values_over_time(
        truth.weights[..., None] * truth.rates[..., controller.columns]
    )
    least: Array = values[:, min(controller.full_rank, values.shape[1]) - 1]
    return least / values[:, 0]


def singular_values_over_time(A: Array) -> Array:
    """Return singular values (T, min(m, n)) of A (T, m, n), largest first; NaN if not finite."""
    there = np.isfinite(A).all(axis=(1, 2))
    sigma = np.full((len(A), min(A.shape[1:])), np.nan)
    sigma[there] = np.linalg.svd(A[there], compute_uv=False)
    return sigma


def list_command_bases(again: Resimulation) -> list[LawInput] | None:
    """Return what each command is based on; None unless the run is of one servo task."""
    found = [decision.basis for decision in again.decisions]
    return found if all(isinstance(one, LawInput) for one in found) else None


def _stack_instants(arrays: list[Array]) -> Any:
    """Return (T, ...) of T arrays whose last axis has a single run."""
    return np.stack([array[..., 0] for array in arrays])
