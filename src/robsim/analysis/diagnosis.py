"""Diagnosis of a run over time: Lyapunov function, ranks, stability and margins."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from robsim.analysis.detection_quality import measure_detection
from robsim.analysis.instant_measures import InstantMeasures
from robsim.analysis.resimulation import resimulate_run
from robsim.run.experiment import Experiment

if TYPE_CHECKING:
    import xarray as xr

LONG_NAMES = {
    "lyapunov": "V: half the square of the true error (chapter, eq. 16)",
    "lyapunov_rate": "dV/dt along the motion of the joints (chapter, eq. 17)",
    "rank_interaction": "rank of L as the law used it",
    "condition_interaction": "largest over smallest singular value of L as the law used it",
    "smallest_interaction": "smallest singular value of L as the law used it",
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
    import xarray as xr

    again = resimulate_run(run, experiment)
    measures = InstantMeasures(again)
    variables: dict[str, Any] = {  # Any: as Dataset accepts variables
        name: (["time"], measures[name], {"units": UNITS.get(name, "1"), "long_name": long})
        for name, long in LONG_NAMES.items()
    }
    variables["lyapunov"][2]["units"] = again.run["lyapunov"].attrs["units"]
    variables["lyapunov_rate"][2]["units"] = f"{variables['lyapunov'][2]['units']}/s"
    variables |= measure_detection(again)
    coordinate_names = ["time", "coordinate", "mark_camera", "mark_target"]
    instants = again.run.isel(time=slice(0, again.history.length))
    if "torque" in instants:
        variables |= _measure_drives(instants)
        coordinate_names.append("velocity")
    coordinates = {name: instants[name] for name in coordinate_names}
    attributes = {"title": "RobSim diagnosis", "outcome": again.outcome.name, "dt": again.case.dt}
    record = run.attrs["record"]
    every = 1 if isinstance(record, str) else int(record)
    return xr.Dataset(variables, coordinates, attributes).isel(time=slice(0, None, every))


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
