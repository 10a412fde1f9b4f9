"""Diagnosis of a run over time: Lyapunov function, ranks, stability and margins."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from robsim.analysis.detection_quality import measure_detection
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
    "rank_interaction": "rank of L as the law used it",
    "condition_interaction": "largest over smallest singular value of L as the law used it",
    "rank_task_jacobian": "rank of L J as the law used it",
    "condition_task_jacobian": "largest over smallest singular value of L J as the law used it",
    "smallest_task_jacobian": "smallest singular value of L J as the law used it",
    "stability": "smallest eigenvalue of the symmetric part of L Lhat^+ (chapter, eq. 18)",
    "stability_motion": "smallest eigenvalue of the symmetric part of (Lhat J)^+ L J",
    "contraction": "largest |eigenvalue| of I - gain dt (Lhat J)^+ L J",
    "border_margin": "least distance of a mark from the border of its image",
    "border_mark": "number of the mark nearest to its border",
    "marks_in_image": "number of marks in their image",
    "limit_margin": "least distance of a joint from a limit, as a share of its range",
    "limit_coordinate": "number of the coordinate nearest to a limit; -1 without limits",
    "singularity": "smallest over largest singular value of the true L J",
}
UNITS = {"border_margin": "px"}
TORQUE_NAMES = ("torque", "saturation", "torque_limit")  # of the run
LAG = "commanded minus actual velocity of each joint at the end of its period"


def diagnose(run: xr.Dataset, experiment: Experiment | None = None) -> xr.Dataset:
    """Compute ranks, stability measures and margins of a run at each recorded instant.

    The run is simulated again, with the same bits. Below, Lhat and Jhat are the matrices that the
    law used, and L and J the true matrices, all multiplied by the weights of the task and of its
    weightings. V and its rate use the unweighted true error of the features with a weight above
    zero.

    Parameters
    ----------
    run : Dataset
        A single simulated run.
    experiment : Experiment, optional
        Experiment of the run, needed if it contains Python code. Default: the experiment stored in
        the run.

    Returns
    -------
    Dataset
        Variables over the recorded instants of the run; all instants for a run with
        record="summary":

        - lyapunov, lyapunov_rate: V = e'e/2 (eq. 16) and e' L J qdot (eq. 17). The velocities are
          the joint velocities at the beginning of each period, prescribed motions included.
        - rank_interaction, condition_interaction, smallest_interaction: rank, condition number and
          smallest singular value of Lhat.
        - rank_task_jacobian, condition_task_jacobian, smallest_task_jacobian: rank, condition
          number and smallest singular value of Lhat Jhat. The smallest singular value is number r
          in descending order, with the rank r at the goal.
        - stability: smallest eigenvalue of the symmetric part of L Lhat^+. If it is positive, V
          decreases under the twist V_c = -gain Lhat^+ e for every error e (eqs. 17 and 18). The
          rank is at most 6, so that it is never positive for k > 6 features.
        - stability_motion: smallest eigenvalue of the symmetric part of (Lhat Jhat)^+ L J over the
          motions that the law can command, in rad and m. If it is positive, the length of each of
          these motions decreases. For the camera law J^+ Lhat^+ replaces (Lhat Jhat)^+.
        - contraction: largest |eigenvalue| of I - gain dt (Lhat Jhat)^+ L J over these motions.
          Near the goal, a loop without delay converges if it is below 1.
        - border_margin, border_mark: distance in px and number of the mark nearest to the border of
          its image; NaN and -1 without borders.
        - marks_in_image: number of marks in their images, over all cameras.
        - limit_margin, limit_coordinate: distance (as a share of its range) and number of the
          coordinate nearest to a limit; NaN and -1 without limits.
        - singularity: ratio of the smallest to the largest singular value of the true L J.

        A run with a drive also has its torque, saturation and torque_limit, and

        - velocity_error: commanded minus actual velocity of each joint, at the end of the period of
          the command; 0 at the start. A law of torques has no velocity_error.

        A run with a detector also has variables of at most 200 of its pictures, which are drawn and
        searched again near the true marks:

        - marks_missed, detection_error: number of marks in the image that were not found, and the
          root mean square of detected minus true marks in px, along an axis; NaN elsewhere.
        - detection_pictures, detection_bias, detection_rms: number of examined pictures, mean
          (column, row) and root mean square of detected minus true marks in px.
        - not_found: number of marks that were not found for each `reason`: outside the image, or
          the change of the pictures that finds them.
        - detection_rms_without: detection_rms without one error of the `optics`. The error that
          accounts for the deviation has the smallest value.

        For several simultaneous tasks the rows of L J are stacked, in units of one common
        tolerance, and variables of a single interaction matrix or law are NaN. stability_motion and
        contraction are NaN for laws other than "joint" and "camera". True quantities are NaN if the
        true camera does not see the goal.

    Raises
    ------
    InputError
        If `run` is no single run, or cannot be simulated again.

    Examples
    --------
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
    """Return the diagnosis of a resimulated run at every instant."""
    import xarray as xr

    T = len(again.snapshots)
    q = np.concatenate([one.q for one in again.snapshots], axis=1)
    rates = again.run["qd_actual" if "qd_actual" in again.run else "qd"].values[:T]
    truth = compute_true_error(again.case.task, again.case.scene, q)
    if truth is not None and "weight" in again.run:
        truth = truth.weighted(again.run["weight"].values[:T])
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        measures = {
            **_lyapunov_function(truth, rates),
            **_ranks_and_conditions(again),
            **_stability_measures(again, truth),
            **_all_margins(again, q),
            "singularity": _singularity_measure(again, truth, T),
        }
    variables = {
        name: (["time"], measures[name], {"units": UNITS.get(name, "1"), "long_name": long})
        for name, long in LONG_NAMES.items()
    }
    variables["lyapunov"][2]["units"] = again.run["lyapunov"].attrs["units"]
    variables["lyapunov_rate"][2]["units"] = f"{variables['lyapunov'][2]['units']}/s"
    variables |= measure_detection(again)
    coordinate_names = ["time", "coordinate", "mark_camera", "mark_target"]
    instants = again.run.isel(time=slice(0, T))
    if "torque" in instants:
        variables |= _measure_drives(instants)
        coordinate_names.append("velocity")
    coordinates = {name: instants[name] for name in coordinate_names}
    attributes = {"title": "RobSim diagnosis", "outcome": again.outcome.name, "dt": again.case.dt}
    return xr.Dataset(variables, coordinates, attributes)


def _measure_drives(run: xr.Dataset) -> dict[str, Any]:  # Any: as Dataset accepts variables
    """Return the torques of the drives with their limits, and the errors of the velocities."""
    torques: dict[str, Any] = {name: run[name].variable for name in TORQUE_NAMES}
    commands, rates, unit = run["qd"].values, run["qd_actual"].values, run["qd"].attrs["units"]
    if unit != run["qd_actual"].attrs["units"]:  # a law of torques
        return torques
    error = np.zeros_like(rates)
    error[1:] = commands[:-1] - rates[1:]
    attributes = {"units": unit, "long_name": LAG}
    return {**torques, "velocity_error": (["time", "velocity"], error, attributes)}


def _lyapunov_function(truth: TrueError | None, rates: Array) -> dict[str, Array]:
    """Return V and its rate; NaN without true features."""
    if truth is None:
        return dict.fromkeys(("lyapunov", "lyapunov_rate"), np.full(len(rates), np.nan))
    return {
        "lyapunov": 0.5 * np.einsum("tk,tk->t", truth.error, truth.error),
        "lyapunov_rate": np.einsum("tk,tkv,tv->t", truth.error, truth.rates, rates),
    }


def _ranks_and_conditions(again: Resimulation) -> dict[str, Array]:
    """Return ranks and singular values of the matrices that the law used."""
    controller, basis = again.controller, list_command_bases(again)
    task_jacobian = _stack_instants([one.command.task_jacobian for one in again.snapshots])
    conditions: dict[str, Array] = {}
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
        conditions[f"rank_{name}"] = _count_rank(values, controller.rcond)
        conditions[f"condition_{name}"] = values[:, 0] / values[:, least - 1]
        conditions[f"smallest_{name}"] = values[:, least - 1]
    return conditions


def _count_rank(values: Array, rcond: float) -> Array:
    """Return the number of singular values above rcond times the largest, or NaN."""
    count = (values > rcond * values[:, :1]).sum(axis=1)
    return np.where(np.isfinite(values[:, 0]), count, np.nan)


def _stability_measures(again: Resimulation, truth: TrueError | None) -> dict[str, Array]:
    """Return the first-order stability measures of the closed loop."""
    T, basis = len(again.snapshots), list_command_bases(again)
    measures = {
        name: np.full(T, np.nan) for name in ("stability", "stability_motion", "contraction")
    }
    controller = again.controller
    if truth is None or basis is None or not isinstance(controller, ServoController):
        return measures
    linear = type(controller.law) in (JointLaw, CameraLaw)
    for t, one in enumerate(basis):
        task_jacobian = truth.weights[t][:, None] * truth.rates[t][:, controller.columns]
        L, state = truth.L[t], one.state
        used = L, task_jacobian, state.interaction_last, state.task_jacobian_last
        if not all(np.isfinite(array).all() for array in used):
            continue
        # the law of a robot with velocities that are the twist of the camera
        own = {"task_jacobian_last": state.interaction_last, "jacobian_last": np.eye(6)[..., None]}
        twist = replace_unchecked(state, **own)
        measures["stability"][t] = smallest_eigenvalue(L @ -law_matrix(JointLaw(), twist))
        if linear:
            M = restrict_to_motions(-law_matrix(controller.law, state), task_jacobian)
            measures["stability_motion"][t] = smallest_eigenvalue(M)
            gain = float(np.ravel(state.gain)[0])
            eigenvalues = np.linalg.eigvals(np.eye(len(M)) - gain * again.case.dt * M)
            measures["contraction"][t] = np.abs(eigenvalues).max(initial=0.0)
    return measures


def law_matrix(law: Law, state: ControlState) -> Array:
    """Return the matrix (n, k) of a law that is linear in the error, at gain 1."""
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
        s_last=None,  # unused by a law that is linear in the error
        q_last=None,
    )
    return np.array(view_runs_last(law.command(unit)))


def restrict_to_motions(P: Array, task_jacobian: Array) -> Array:
    """Return P task_jacobian restricted to the range of P (n, k), the commanded motions."""
    U, sigma, _ = np.linalg.svd(P, full_matrices=False)
    U = U[:, sigma > RCOND * sigma.max(initial=0.0)]
    M: Array = U.T @ P @ task_jacobian @ U
    return M


def smallest_eigenvalue(M: Array) -> float:
    """Return the smallest eigenvalue of the symmetric part of M."""
    return float(np.linalg.eigvalsh(0.5 * (M + M.T)).min(initial=np.inf))


def _all_margins(again: Resimulation, q: Array) -> dict[str, NDArray[Any]]:
    """Return the margins to the image borders and the joint limits."""
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
    """Return the distance (T,) and the number (T,) of the mark nearest to its image border."""
    distances = []
    for sight in again.controller.sights:
        low, high = sight.eye.camera.border.T[:, None, :, None]
        pixels = sight.project(q).pixels
        distances.append(np.minimum(pixels - low, high - pixels).min(axis=1))
    margins = np.concatenate(distances)
    margins[~np.isfinite(margins)] = np.inf  # behind the camera, or no border
    return _smallest_margin(margins)


def _count_marks_in_image(again: Resimulation) -> NDArray[np.int64]:
    """Return the number (T,) of marks in their image."""
    views = (one.projections.values() for one in again.snapshots)
    return np.array([sum(int((v.visibility == 0).sum()) for v in each) for each in views])


def _limit_margins(limits: Array, q: Array) -> tuple[Array, NDArray[np.int64]]:
    """Return the distance (T,) from the nearest limit, as a share of its range, and its row."""
    low, high = limits[:, :1], limits[:, 1:]
    span = np.where(np.isfinite(high - low), high - low, 1.0)
    return _smallest_margin(np.minimum(q - low, high - q) / span)


def _smallest_margin(margins: Array) -> tuple[Array, NDArray[np.int64]]:
    """Return the smallest finite margin of (N, T) and its row; NaN and -1 if there is none."""
    if not len(margins):
        return np.full(margins.shape[1], np.nan), np.full(margins.shape[1], -1)
    least, row = margins.min(axis=0), margins.argmin(axis=0)
    finite = np.isfinite(least)
    return np.where(finite, least, np.nan), np.where(finite, row, -1)


def _singularity_measure(again: Resimulation, truth: TrueError | None, T: int) -> Array:
    """Return the ratio (T,) of the smallest to the largest singular value of the true L J."""
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
    finite = np.isfinite(A).all(axis=(1, 2))
    sigma = np.full((len(A), min(A.shape[1:])), np.nan)
    sigma[finite] = np.linalg.svd(A[finite], compute_uv=False)
    return sigma


def list_command_bases(again: Resimulation) -> list[LawInput] | None:
    """Return the input of the law at each instant; None unless the run has a single servo task."""
    command_bases = [decision.basis for decision in again.decisions]
    return command_bases if all(isinstance(one, LawInput) for one in command_bases) else None


def _stack_instants(arrays: list[Array]) -> Array:
    """Return (T, ...) from T arrays with a single run along the last axis."""
    return np.stack([array[..., 0] for array in arrays])
