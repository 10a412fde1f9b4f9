"""Search for coordinates at which the features have their goal, and the report of a failure."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from robsim.analysis.explanation.damped_search import minimise_errors, shorten_steps
from robsim.analysis.explanation.findings import Finding
from robsim.analysis.explanation.run_analysis import RunAnalysis
from robsim.analysis.explanation.text_format import format_offset
from robsim.analysis.true_error import compute_true_error
from robsim.analysis.vector_fields import VectorField, remove_image_borders
from robsim.base.arrays import Array, move_runs_last
from robsim.engine.outcome import Outcome
from robsim.run import end_variables
from robsim.starts.start_kinematics import StartKinematics
from robsim.statistics.random_numbers import RandomNumbers

SEARCHES = 100  # random coordinates from which the search begins
ROUNDS = 80  # iterations of Levenberg and Marquardt
LONGEST_STEP = 0.5  # metres and radians
NEAR = 10.0  # in tolerances; a search that ends with a smaller error reaches the goal


class NearestState(NamedTuple):
    """Coordinates (nq, 1) with the smallest error, its largest part and its norm, in tolerances."""

    q: Array
    error: float
    length: float


def report_out_of_reach(analysis: RunAnalysis) -> Finding | None:
    """Report that no coordinates bring the features to their goal, even without limits."""
    nearest = find_nearest_state(analysis)
    if nearest is None or nearest.error < NEAR * analysis.tolerance:
        return None
    _, metres, radians = end_variables.measure_goal_offset(
        analysis.controller, nearest.q, nearest.q.T
    )
    place = ""
    if np.isfinite(metres[0]) and np.isfinite(radians[0]):
        place = f", {format_offset(float(metres[0]), float(radians[0]))} from the goal pose"
    sentence = (
        f"The goal is out of reach: of {SEARCHES} searches over the joint coordinates, without "
        f"limits, the best leaves an error of length {analysis.size(nearest.length)}{place}, and "
        f"the tolerance is {analysis.size(analysis.tolerance)}."
    )
    if analysis.outcome in (Outcome.JOINT_LIMIT, Outcome.SINGULAR):
        sentence += " At the edge of the workspace L J loses rank, and the joints speed up."
    sentence += " Give a goal that the robot can reach."
    return Finding("goal out of reach", sentence, {"nearest": nearest.length})


def find_nearest_state(analysis: RunAnalysis) -> NearestState | None:
    """Return the coordinates with the smallest true error; None if the search cannot decide.

    It cannot for goals that are coordinates, for scenes that move, for vehicles, and for other
    tasks than a single servo task. Damped steps dq = -(A'A + mu I)^-1 A'e of the commanded joints
    reduce the error e with its rates A (Levenberg 1944; Marquardt 1963), from random coordinates
    within the limits and from the ends of the run.
    """
    servo, case = analysis.servo, analysis.case
    if servo is None or servo.bound_features.q_goal is not None or case.scene.motions:
        return None
    field = VectorField(analysis.controller)
    if field.unactuated or compute_true_error(case.task, case.scene, _ends(analysis)) is None:
        return None
    with np.errstate(all="ignore"):  # searches that fail are dropped
        q, e = minimise_errors(
            lambda q: _error_and_rates(analysis, q),
            lambda q, steps: field.displace(q, move_runs_last(_shorten(steps), 1)),
            _sample_coordinates(analysis),
            ROUNDS,
        )
    size = np.abs(e).max(axis=1)
    best = int(size.argmin())
    if not np.isfinite(size[best]):
        return None
    return NearestState(q[:, best : best + 1], float(size[best]), float(np.linalg.norm(e[best])))


def _ends(analysis: RunAnalysis) -> Array:
    """Return the coordinates (nq, 2) at the start and at the end of the run."""
    return np.ascontiguousarray(analysis.q[:, [0, -1]])


def _sample_coordinates(analysis: RunAnalysis) -> Array:
    """Return the coordinates (nq, B) from which the searches begin."""
    reach = StartKinematics(analysis.controller)
    bodies = np.unique(reach.scene.tree.owners[analysis.controller.columns])
    draws = RandomNumbers(0, "workspace search", np.arange(SEARCHES))
    q = move_runs_last(reach.sample_coordinates(draws, bodies), 1)
    return np.ascontiguousarray(np.concatenate([_ends(analysis), q], axis=1))


def _error_and_rates(analysis: RunAnalysis, q: Array) -> tuple[Array, Array]:
    """Return the errors (B, k) in tolerances, infinite behind a camera, and their rates."""
    controller, case = analysis.controller, analysis.case
    truth = compute_true_error(case.task, remove_image_borders(case.scene), q)
    assert truth is not None
    scale = controller.tolerance_scale
    e, A = truth.error * scale, truth.rates[..., controller.columns] * scale[:, None]
    usable = np.asarray(np.isfinite(e).all(axis=1) & np.isfinite(A).all(axis=(1, 2)))
    return np.where(usable[:, None], e, np.inf), np.where(usable[:, None, None], A, 0.0)


def _shorten(steps: Array) -> Array:
    """Return steps (B, n) of the commanded joints, none of which moves too far."""
    return shorten_steps(steps, np.abs(steps).max(axis=1), LONGEST_STEP)
