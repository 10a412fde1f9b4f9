"""Causes of standstill with an error above the tolerance."""

from __future__ import annotations

import math

import numpy as np

from robsim.analysis.explanation.active_constraints import list_holding_constraints
from robsim.analysis.explanation.findings import Finding
from robsim.analysis.explanation.run_analysis import RunAnalysis
from robsim.analysis.explanation.text_format import format_list, format_number
from robsim.analysis.loop_stability import law_matrices
from robsim.analysis.true_error import compute_true_error
from robsim.analysis.vector_fields import STEP, VectorField
from robsim.base.arrays import Array
from robsim.servo.laws.law import CameraLaw, JointLaw

MAIN_COMPONENT = 0.35  # least component of a unit direction for a joint to be listed


def report_null_space(analysis: RunAnalysis) -> Finding | None:
    """Report a joint law with its error in the null space of (L J)^+."""
    last = analysis.last_basis_under(JointLaw)
    if last is None or list_holding_constraints(analysis):
        return None
    k, rank = len(last.error), int(analysis.value("rank_task_jacobian"))
    norm = float(np.linalg.norm(last.state.error_last))
    speed = float(np.linalg.norm(law_matrices(JointLaw(), last.state)[0] @ last.state.error_last))
    curvature = smallest_curvature(analysis)
    kind = "a local minimum of V" if curvature > -1e-9 else "an equilibrium of the law"
    sentence = (
        f"This is {kind}: the law regulates k = {k} numbers and L J has rank {rank}, and the "
        f"remaining error, of length {analysis.size(norm)}, lies in the null space of (L J)^+, "
        "so that nothing is commanded and V' is zero (chapter, eq. 18)."
    )
    sentence += describe_missing_velocities(analysis)
    evidence = {"k": float(k), "rank": float(rank), "error_norm": norm, "speed": speed}
    evidence["lyapunov_rate"] = analysis.value("lyapunov_rate")
    evidence |= {"least_curvature": curvature} if np.isfinite(curvature) else {}
    return Finding("local minimum", sentence, evidence)


def smallest_curvature(analysis: RunAnalysis) -> float:
    """Return the least eigenvalue of the Hessian of V over its largest magnitude.

    The Hessian is taken over the commanded joints at the end of the run, from differences of the
    gradient (L J)' e. The result is NaN if V is unknown.
    """
    columns = analysis.controller.columns
    n, q = columns.size, analysis.last_state.q
    steps = STEP * np.concatenate([np.eye(n), -np.eye(n)], axis=1)
    states = VectorField(analysis.controller).displace(np.repeat(q, 2 * n, axis=1), steps)
    truth = compute_true_error(analysis.case.task, analysis.case.scene, states)
    if truth is None or not (np.isfinite(truth.error).all() and np.isfinite(truth.rates).all()):
        return math.nan
    gradient = np.einsum("tkn,tk->tn", truth.rates[..., columns], truth.error)
    H = (gradient[:n] - gradient[n:]) / (2 * STEP)
    eigenvalues = np.linalg.eigvalsh(0.5 * (H + H.T))
    return float(eigenvalues[0] / np.abs(eigenvalues).max())


def describe_missing_velocities(analysis: RunAnalysis) -> str:
    """Return a sentence on a robot with too few velocities for its features; else ""."""
    if analysis.last is None:
        return ""
    n, k = analysis.last.state.jacobian_last.shape[1], len(analysis.last.error)
    rank = analysis.value("rank_interaction")
    if not n < rank:
        return ""
    return f" {n} velocities are commanded, too few for {k} numbers, which need {rank:.0f}."


def report_camera_law(analysis: RunAnalysis) -> Finding | None:
    """Report a camera law with a twist that the joints cannot follow at all."""
    last = analysis.last_basis_under(CameraLaw)
    if last is None:
        return None
    state = last.state
    twist = np.linalg.pinv(state.interaction_last[..., 0]) @ state.error_last[:, 0]
    joints = int(np.linalg.matrix_rank(state.jacobian_last[..., 0]))
    V = float(analysis.gain * np.linalg.norm(twist))
    e = float(np.linalg.norm(state.error_last))
    if joints >= 6 or 1e-3 * e > V:
        return None
    sentence = (
        f"The camera law commands a twist of length {format_number(V)} (m/s, rad/s), and the "
        f"joints, with {joints} of 6 degrees of freedom, cannot follow it: J^+ V = 0 although "
        "V = -gain L^+ e is not zero. The joint law does not separate the two steps."
    )
    return Finding("camera law", sentence, {"twist": V, "rank_J": float(joints), "error_norm": e})


def report_ascent(analysis: RunAnalysis) -> Finding | None:
    """Report a camera law that increases V, because the joints cannot follow every twist."""
    last = analysis.last_basis_under(CameraLaw)
    if last is None:
        return None
    steepest = np.nanmax(analysis.measures["lyapunov_rate"])
    rank = int(np.linalg.matrix_rank(last.state.jacobian_last[..., 0]))
    if rank >= 6 or not steepest > 0:
        return None
    sentence = (
        f"Under the camera law the error grows: the joints have {rank} of 6 degrees of "
        "freedom, J^+ approximates the commanded twist, and V' reaches "
        f"{format_number(float(steepest))}. The joint law reduces V if L and J are right."
    )
    return Finding("camera law", sentence, {"rank_J": float(rank), "steepest": float(steepest)})


def report_own_law(analysis: RunAnalysis) -> Finding | None:
    """Report a law of another kind that commands no motion."""
    if analysis.last_basis_under(JointLaw) or analysis.last_basis_under(CameraLaw):
        return None
    servo = analysis.servo
    name = type(servo.law).__name__ if servo else type(analysis.case.task).__name__
    return Finding("law", f"{name} commands (almost) nothing here: this is one of its equilibria.")


def report_lost_direction(analysis: RunAnalysis) -> Finding | None:
    """Report the motion that the features or the joints lost in a singularity."""
    decision, names = analysis.last_decision, analysis.case.scene.velocity_names
    controller = analysis.controller
    task_jacobian, J = decision.command.task_jacobian[..., 0], decision.J[..., 0]
    if not np.isfinite(task_jacobian).all():
        return None
    _, sigma, Vt = np.linalg.svd(task_jacobian)
    full, rank = controller.full_rank, int((sigma > controller.rcond * sigma[0]).sum())
    columns = controller.columns
    rank_J = int(np.linalg.matrix_rank(J, tol=controller.rcond * np.linalg.norm(J)))
    joints = _name_main_joints(Vt[rank], [names[i] for i in columns])
    is_posture = rank_J < min(J.shape) and analysis.value("rank_interaction") != rank
    reason = (
        f"the posture is singular: J has rank {rank_J}, and the camera cannot move along "
        f"{_format_lost_twist(J)} (v, omega) in its axes"
        if is_posture
        else "no feature sees the motion of the camera"
    )
    sentence = (
        f"L J lost rank, from {full} to {rank}: no error changes when {joints} "
        f"{'moves' if joints.count(' ') == 0 else 'move together'}, and {reason}."
    )
    evidence = {"rank": float(rank), "full_rank": float(full), "rank_J": float(rank_J)}
    return Finding("singularity", sentence, evidence)


def _name_main_joints(direction: Array, names: list[str]) -> str:
    """Return the names of the main joints of a direction."""
    chosen = [
        name for name, part in zip(names, direction, strict=True) if abs(part) > MAIN_COMPONENT
    ]
    return format_list(chosen or names)


def _format_lost_twist(J: Array) -> str:
    """Return as text a camera twist that no joint motion produces."""
    U = np.linalg.svd(J)[0]
    direction = U[:, int(np.linalg.matrix_rank(J, tol=1e-6 * np.linalg.norm(J)))]
    return "(" + ", ".join(f"{part:.2f}" for part in direction + 0.0) + ")"
