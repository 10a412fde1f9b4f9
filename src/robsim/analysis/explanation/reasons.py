"""Why a run ended as it did, read from its diagnosis: for what is not the fault of one number."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from robsim.analysis.diagnosis import law_map
from robsim.analysis.explanation import views
from robsim.analysis.explanation.changes import without_border, without_limits
from robsim.analysis.explanation.ends import beyond_limit, not_finite
from robsim.analysis.explanation.finding import Finding
from robsim.analysis.explanation.inquiry import Inquiry
from robsim.analysis.explanation.wording import degrees, listed, number
from robsim.analysis.leaves import leaves
from robsim.arrays import Array
from robsim.outcome import Outcome
from robsim.servo import CameraLaw, Given, JointLaw
from robsim.servo.controller import Assessment

Reason = Callable[[Inquiry], Finding | None]
RETREAT = 1.5  # times as far as at start and goal: a retreat
ROLL = np.pi / 3  # about the optical axis from here on a cause of retreat
SHARE = 0.35  # of a unit direction that a component must have to be named


def reasons(inquiry: Inquiry) -> Iterator[Finding]:
    """What is found, the most telling first."""
    start = blind_start(inquiry) if inquiry.outcome in _LOST else None
    if start:
        yield start
        return
    for reason in _REASONS[inquiry.outcome]:
        finding = reason(inquiry)
        if finding:
            yield finding


def _last(inquiry: Inquiry) -> Assessment | None:
    basis = inquiry.again.moments[-1].decision.basis
    return basis if isinstance(basis, Assessment) else None


def null_space(inquiry: Inquiry) -> Finding | None:
    """A joint law whose error lies where (L J)^+ commands nothing."""
    last, servo = _last(inquiry), inquiry.servo
    if last is None or servo is None or type(servo.law) is not JointLaw:
        return None
    k, rank = len(last.error), int(inquiry.value("rank_reach"))
    norm = float(np.linalg.norm(last.state.error_last))
    speed = float(np.linalg.norm(law_map(servo.law, last.state) @ last.state.error_last))
    current = servo.regulated.which == "current" if isinstance(servo.regulated.which, str) else 0
    place = "a local minimum of V" if current else "an equilibrium of the law"
    sentence = (
        f"This is {place}: the law regulates k = {k} numbers and L J has rank {rank}, and the "
        f"error that is left, of length {number(norm)}, lies in the null space of (L J)^+, where "
        f"nothing is commanded and V' = {number(inquiry.value('lyapunov_rate'))} (chapter, eq. 18)."
    )
    evidence = {"k": float(k), "rank": float(rank), "error_norm": norm, "speed": speed}
    return Finding("local minimum", sentence, evidence)


def camera_law(inquiry: Inquiry) -> Finding | None:
    """A camera law that asks for a twist of which the joints can do nothing."""
    last, servo = _last(inquiry), inquiry.servo
    if last is None or servo is None or type(servo.law) is not CameraLaw:
        return None
    state = last.state
    twist = np.linalg.pinv(state.interaction_last[..., 0]) @ state.error_last[:, 0]
    joints = int(np.linalg.matrix_rank(state.jacobian_last[..., 0]))
    V = float(views.gain_of(inquiry.case) * np.linalg.norm(twist))
    e = float(np.linalg.norm(state.error_last))
    if joints >= 6 or 1e-3 * e > V:
        return None
    sentence = (
        f"The camera law asks for a twist of length {number(V)} (m/s, rad/s), and the joints, "
        f"which move the camera in {joints} of 6 ways only, can do nothing of it: J^+ V = 0 where "
        "V = -gain L^+ e is not. The joint law does not part the two steps."
    )
    return Finding("camera law", sentence, {"twist": V, "rank_J": float(joints), "error_norm": e})


def ascending(inquiry: Inquiry) -> Finding | None:
    """A camera law under which V grows, because the joints cannot follow every twist."""
    last, servo = _last(inquiry), inquiry.servo
    rates = inquiry.diagnosis["lyapunov_rate"].values
    if last is None or servo is None or type(servo.law) is not CameraLaw:
        return None
    rank, steepest = int(np.linalg.matrix_rank(last.state.jacobian_last[..., 0])), np.nanmax(rates)
    if rank >= 6 or not steepest > 0:
        return None
    sentence = (
        f"Under the camera law the error grows: the joints move the camera in {rank} of 6 ways "
        f"only, J^+ follows the twist that is asked for as well as that goes, and V' is up to "
        f"{number(float(steepest))} on the way. The joint law descends V wherever L and J are right."
    )
    return Finding("camera law", sentence, {"rank_J": float(rank), "steepest": float(steepest)})


def own_law(inquiry: Inquiry) -> Finding | None:
    """A law of which nothing is known that commands nothing."""
    last, servo = _last(inquiry), inquiry.servo
    if last is not None and servo is not None and type(servo.law) in (JointLaw, CameraLaw):
        return None
    name = type(servo.law).__name__ if servo else type(inquiry.case.task).__name__
    return Finding(
        "law", f"{name} commands (almost) nothing here: this is an equilibrium of its own."
    )


def unseen_goal(inquiry: Inquiry) -> Finding | None:
    """A goal that is made of numbers, which there may be no way to reach."""
    if not any(isinstance(leaf.goal, Given) for leaf in leaves(inquiry.case.task)):
        return None
    return Finding(
        "goal",
        "The goal is given as numbers that no camera has seen: there may be no pose that has them.",
    )


def lost_direction(inquiry: Inquiry) -> Finding | None:
    """Which motion the features, or the joints, lost."""
    moment, names = inquiry.again.moments[-1], inquiry.case.scene.velocity_names
    controller = inquiry.again.loop.controller
    reach, J = moment.decision.command.reach[..., 0], moment.decision.J[..., 0]
    if not np.isfinite(reach).all():
        return None
    _, sigma, Vt = np.linalg.svd(reach)
    full, rank = controller.full_rank, int((sigma > controller.rcond * sigma[0]).sum())
    columns = controller.columns
    rank_J = int(np.linalg.matrix_rank(J, tol=controller.rcond * np.linalg.norm(J)))
    which = _main(Vt[rank], [names[i] for i in columns])
    posture = rank_J < min(J.shape) and inquiry.value("rank_interaction") != rank
    who = (
        f"the posture is singular: J has rank {rank_J}, and the camera cannot move along "
        f"{_twist(J)} (v, omega) in its axes"
        if posture
        else "the camera then moves as no feature sees"
    )
    sentence = (
        f"L J lost rank, from {full} to {rank}: no error changes when {which} "
        f"{'moves' if which.count(' ') == 0 else 'move together'}, and {who}."
    )
    evidence = {"rank": float(rank), "full_rank": float(full), "rank_J": float(rank_J)}
    return Finding("singularity", sentence, evidence)


def _main(direction: Array, names: list[str]) -> str:
    chosen = [name for name, part in zip(names, direction, strict=True) if abs(part) > SHARE]
    return listed(chosen or names)


def _twist(J: Array) -> str:
    """The twist that no joint makes."""
    U = np.linalg.svd(J)[0]
    direction = U[:, int(np.linalg.matrix_rank(J, tol=1e-6 * np.linalg.norm(J)))]
    return "(" + ", ".join(f"{part:.2f}" for part in direction + 0.0) + ")"


def blind_start(inquiry: Inquiry) -> Finding | None:
    """A start that does not see the target."""
    if inquiry.end > 0:
        return None
    sentence = "The run starts where the camera does not see all marks: take another start."
    return Finding("start", sentence)


def pose_features(inquiry: Inquiry) -> Finding | None:
    """A scheme that does not look at the image."""
    servo = inquiry.servo
    parts = servo.regulated.parts if servo else ()
    if not parts or not all(getattr(p.feature, "uses_pose", False) for p in parts):
        return None
    return Finding(
        "no control of the image",
        "The scheme is position-based: it regulates the pose of the camera, and nothing in its "
        "law keeps the marks in the image.",
    )


def retreat(inquiry: Inquiry) -> Finding | None:
    """A camera that backed away, as it does for rotations about its axis."""
    depths, goal, turn = inquiry.depths, inquiry.goal_pose, inquiry.turn
    here = float(depths[0])
    if goal is not None:
        here = max(here, float(np.asarray(goal @ inquiry.sight.target.marks)[..., 2].mean()))
    farthest = float(np.nanmax(depths))
    if farthest < RETREAT * here:
        return None
    evidence = {"from_m": float(depths[0]), "to_m": farthest}
    told = f"The camera retreated: the marks were {number(depths[0])} m away at the start and "
    told += f"{number(farthest)} m at most, farther than at the goal."
    if turn is not None and abs(turn[2]) > ROLL:
        evidence["roll_deg"] = float(np.degrees(abs(turn[2])))
        told += (
            f" Start and goal differ by {degrees(abs(turn[2]))} about the optical axis, and the "
            "straight ways that the law asks of the points make the camera back away "
            "(Chaumette 1998)."
        )
    return Finding("camera retreat", told, evidence)


def roll(inquiry: Inquiry) -> Finding | None:
    """A large rotation about the optical axis, without a retreat."""
    turn = inquiry.turn
    if turn is None or abs(turn[2]) < ROLL or retreat(inquiry):
        return None
    angle = abs(turn[2])
    sentence = (
        f"Start and goal differ by {degrees(angle)} about the optical axis, far beyond the "
        "neighbourhood in which L describes how the points move."
    )
    return Finding("rotation about the axis", sentence, {"roll_deg": float(np.degrees(angle))})


def border_alone(inquiry: Inquiry) -> Finding | None:
    """Whether the border of the image is the only obstacle."""
    trial = inquiry.trial(without_border)
    if trial is None or not trial.converged:
        return None
    sentence = (
        "Only the border of the image stands in the way: with an image without one the same run "
        f"{trial.told}."
    )
    return Finding("border", sentence, {"converges_after_s": trial.end_time})


def limit_alone(inquiry: Inquiry) -> Finding | None:
    """Whether the limits of the joints are the only obstacle."""
    name, side, limit, _, _ = beyond_limit(inquiry)
    trial = inquiry.trial(without_limits)
    if trial is None:
        return None
    if trial.converged:
        end = f"without limits the same run {trial.told}."
        return Finding(
            "joint limit",
            f"The {side} limit of {name} stands in the way, and nothing else: {end}",
            {"limit": limit, "converges_after_s": trial.end_time},
        )
    return Finding(
        "joint limit",
        f"The {side} limit of {name} is not the cause: without limits the run ends as "
        f"{trial.outcome.name} after {number(trial.end_time)} s.",
        {"limit": limit},
    )


def loop_gain(inquiry: Inquiry) -> Finding | None:
    """A gain that is too high for the period."""
    radius = inquiry.diagnosis["contraction"].values
    motion = inquiry.diagnosis["stability_motion"].values
    product = views.gain_of(inquiry.case) * inquiry.case.dt
    known = np.isfinite(radius)
    if known.any() and np.median(radius[known]) > 1 and np.median(motion[known]) > 0:
        value = float(np.median(radius[known]))
    elif not known.any() and product > 2:
        value = abs(1 - product)
    else:
        return None
    sentence = (
        f"The gain is too high for the period: gain times period is {number(product)}, and what "
        f"is left of an error after one period is up to {number(value)} times what there was; a "
        "loop without delay is stable below 2."
    )
    return Finding("gain", sentence, {"gain_dt": product, "contraction": value, "limit": 2.0})


def misled(inquiry: Inquiry) -> Finding | None:
    """An Lhat that is too far from L: some motion is steered away from the goal."""
    radius = inquiry.diagnosis["contraction"].values
    motion = inquiry.diagnosis["stability_motion"].values
    known = np.isfinite(motion)
    if not known.any() or not (motion[known] < -1e-9).any():
        return None
    least = float(motion[known].min())
    if np.median(radius[known]) <= 1:
        return None
    sentence = (
        "What the law takes for L J is too far from the truth: the symmetric part of "
        f"(Lhat J)^+ L J has an eigenvalue of {number(least)}, so that some motions lead away from "
        "the goal."
    )
    return Finding("wrong interaction matrix", sentence, {"least_eigenvalue": least})


def own_motion(inquiry: Inquiry) -> Finding | None:
    """Something else moves."""
    if not inquiry.case.scene.motions:
        return None
    names = listed([f"'{motion.robot}'" for motion in inquiry.case.scene.motions])
    return Finding("own motion", f"{names} moves on its own meanwhile.")


def growing(inquiry: Inquiry) -> Finding | None:
    """An error that grew before the end."""
    V = inquiry.diagnosis["lyapunov"].values
    if not np.isfinite(V).all() or V[-1] <= 1.05 * V[0]:
        return None
    sentence = f"The error did not shrink: V grew from {number(V[0])} to {number(V[-1])}."
    return Finding("growing error", sentence, {"from": float(V[0]), "to": float(V[-1])})


def singular_feature(inquiry: Inquiry) -> Finding | None:
    """What features say about where they are not finite."""
    servo = inquiry.servo
    what = not_finite(inquiry)
    if servo is None:
        return None
    if what == "a feature":
        sentence = f"{servo.regulated.names} gave a number that is not finite at this view"
        return Finding("feature", f"{sentence}{servo.regulated.reasons}.")
    if what == "the command":
        sentence = f"{type(servo.law).__name__} commanded what is not finite, from finite features."
        return Finding("law", sentence)
    return Finding("state", "The command was so large that a coordinate overflowed.")


def slow(inquiry: Inquiry) -> Finding | None:
    """An error that falls, but has not had the time."""
    rate, arrival = inquiry.decay, inquiry.arrival
    if not inquiry.falls or not np.isfinite(arrival):
        return None
    gain = views.gain_of(inquiry.case)
    trial = inquiry.trial(lambda case: case)
    late = ""
    if trial is not None and trial.converged:
        late = f"; given more time it is there after {number(trial.end_time)} s"
    sentence = (
        f"It was still on its way: the error falls at {number(rate)} per second, with a gain of "
        f"{number(gain)} per second, and at that rate it is below the tolerance after "
        f"{number(arrival)} s{late}."
    )
    evidence = {"rate": rate, "gain": gain, "arrival_s": arrival}
    return Finding("too little time", sentence, evidence)


def lagging(inquiry: Inquiry) -> Finding | None:
    """An error that stays."""
    if slow(inquiry):
        return None
    third = inquiry.errors[-max(len(inquiry.errors) // 3, 3) :]
    low, high = float(third.min()), float(third.max())
    rate = inquiry.value("lyapunov_rate")
    sentence = (
        f"The error stays between {inquiry.size(low)} and {inquiry.size(high)}, and V' is "
        f"{number(rate)} at the end: what the law commands does not make it smaller."
    )
    return Finding("standing error", sentence, {"low": low, "high": high})


def near_border(inquiry: Inquiry) -> Finding | None:
    """A mark that was close to being lost."""
    margins = inquiry.diagnosis["border_margin"].values
    if not np.isfinite(margins).any():
        return None
    t = int(np.nanargmin(margins))
    if margins[t] > 5 or t == 0:
        return None
    sentence = (
        f"A mark came within {number(margins[t])} px of the border of its image, after "
        f"{number(t * inquiry.case.dt)} s."
    )
    return Finding("near border", sentence, {"margin_px": float(margins[t])})


_LOST = (Outcome.OUT_OF_IMAGE, Outcome.BEHIND_CAMERA)
_WILD = (pose_features, ascending, retreat, roll, loop_gain, misled, own_motion)
_REASONS: dict[Outcome, tuple[Reason, ...]] = {
    Outcome.RUNNING: (),
    Outcome.CONVERGED: (retreat, near_border),
    Outcome.LOCAL_MINIMUM: (camera_law, null_space, own_law, unseen_goal),
    Outcome.OUT_OF_IMAGE: (*_WILD, border_alone, growing),
    Outcome.BEHIND_CAMERA: (*_WILD, growing),
    Outcome.JOINT_LIMIT: (ascending, loop_gain, misled, limit_alone, retreat, roll, own_motion),
    Outcome.SINGULAR: (lost_direction,),
    Outcome.DIVERGED: (ascending, retreat, roll, loop_gain, misled, growing),
    Outcome.NOT_FINITE: (singular_feature, loop_gain, misled, growing),
    Outcome.TIME_LIMIT: (slow, ascending, loop_gain, misled, retreat, lagging),
}
