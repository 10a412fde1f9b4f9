"""Advice: changes of gain, L, law or image with which the same run converges."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress

import numpy as np

from robsim.analysis.explanation import changes
from robsim.analysis.explanation.finding import Finding
from robsim.analysis.explanation.inquiry import Inquiry
from robsim.analysis.explanation.removal import tried
from robsim.analysis.explanation.wording import length, number
from robsim.analysis.leaves import leaves, weighs_robustly
from robsim.base.arrays import Array
from robsim.base.errors import InputError
from robsim.engine.loop import Loop
from robsim.engine.outcome import Outcome
from robsim.run import ends
from robsim.run.experiment import Experiment
from robsim.servo.laws.inverse import INVERSES
from robsim.servo.laws.law import LAWS
from robsim.servo.shaping.redundancy import AvoidLimits
from robsim.servo.tasks.docking import Docking
from robsim.servo.tasks.schemes import IBVS, PBVS
from robsim.servo.tasks.task import ServoTask

ENOUGH = 3  # pieces of advice
LOWER = {0.5: "half", 0.25: "a quarter of", 0.1: "a tenth of"}  # factors of the gain
HIGHER = {2.0: "twice", 4.0: "four times", 10.0: "ten times"}
BRISK = 1.0  # gain times period above which the loop overshoots

Offer = tuple[str, str, Experiment | None]  # what it is about, with what, and the case
Remedy = Callable[[Inquiry], Iterator[Offer]]
NEARER = 0.5  # share of the distance without robust weights below which they are advised


def remedies(inquiry: Inquiry) -> list[Finding]:
    """Return the first few changes with which the run converges, or stays nearer its goal."""
    found = list(robustly(inquiry)) if inquiry.outcome is Outcome.TIME_LIMIT else []
    for remedy in _REMEDIES[inquiry.outcome]:
        for about, how, case in remedy(inquiry):
            trial = tried(case) if case is not None and len(found) < ENOUGH else None
            if trial is not None and trial.converged:
                sentence = f"{how} the same start {trial.ending}."
                evidence = {"converges_after_s": trial.end_time}
                found.append(Finding(about, sentence, evidence))
                if remedy in (gain_lower, gain_higher):
                    break
    return found


def interaction(inquiry: Inquiry) -> Iterator[Offer]:
    """Yield the case with each other named choice of L."""
    given = [leaf.interaction for leaf in leaves(inquiry.case.task)]
    used = {which if isinstance(which, str) else "" for which in given}
    if len(used) != 1:
        return
    for which in ("mean", "desired", "current"):
        if which not in used:
            case = changes.with_leaves(inquiry.patient, interaction=which)
            yield "interaction", f"With L {which}", case


def law(inquiry: Inquiry) -> Iterator[Offer]:
    """Yield the case with the other law."""
    servo = inquiry.servo
    used = LAWS.name_of(servo.law) if servo else None
    for which in {"joint", "camera"} - {used} if used in ("joint", "camera") else ():
        case = changes.with_leaves(inquiry.case if inquiry.falls else inquiry.patient, law=which)
        yield "law", f"With law '{which}'", case


def other_scheme(inquiry: Inquiry) -> Iterator[Offer]:
    """Yield the case with image-based instead of position-based servoing, or vice versa.

    For a unicycle, docking is yielded as well.
    """
    task = inquiry.case.task
    others: dict[type, tuple[type[ServoTask], ...]] = {IBVS: (PBVS, Docking), PBVS: (IBVS, Docking)}
    kept = ("goal", "camera", "target", "gain", "belief", "joints")
    for other in others.get(type(task), ()):
        given = {name: getattr(task, name) for name in kept}
        with suppress(InputError):  # of a goal, say, that this scheme cannot have
            case = inquiry.patient.with_(task=other(**given))
            yield other.__name__, f"With {other.__name__}", case


def inverse(inquiry: Inquiry) -> Iterator[Offer]:
    """Yield the case with a damped inverse in a singularity, else with a pseudo-inverse."""
    used = INVERSES.name_of(inquiry.servo.inverse) if inquiry.servo else None
    other = "damped" if inquiry.outcome is Outcome.SINGULAR else "pseudo_inverse"
    if used and used != other:
        case = changes.with_leaves(inquiry.patient, inverse=other)
        yield "inverse", f"With inverse='{other}'", case


def no_limit(inquiry: Inquiry) -> Iterator[Offer]:
    """Yield the case without its speed limit."""
    if any(leaf.limit for leaf in leaves(inquiry.case.task)):
        case = changes.with_leaves(inquiry.case, limit=None)
        yield "limit", "Without its speed limit", case


def gain_lower(inquiry: Inquiry) -> Iterator[Offer]:
    """Yield the case with half, a quarter and a tenth of the gain, unless time is short."""
    if not (inquiry.outcome is Outcome.TIME_LIMIT and inquiry.falls):
        for factor, word in LOWER.items():
            yield _gain(inquiry, inquiry.patient, factor, word)


def gain_higher(inquiry: Inquiry) -> Iterator[Offer]:
    """Yield the case with two, four and ten times the gain, in the same time."""
    for factor, word in HIGHER.items():
        if factor * inquiry.gain * inquiry.case.dt < BRISK:
            yield _gain(inquiry, inquiry.case, factor, word)


def _gain(inquiry: Inquiry, case: Experiment, factor: float, word: str) -> Offer:
    how = f"With {word} the gain ({number(factor * inquiry.gain)} per second)"
    return "gain", how, changes.with_gain(case, factor)


def image(inquiry: Inquiry) -> Iterator[Offer]:
    """Yield the case with a larger image."""
    case = changes.larger_image(inquiry.patient)
    yield "image", "With an image twice as wide and high", case


def weighting(inquiry: Inquiry) -> Iterator[Offer]:
    """Yield the case in which marks may leave the image, unless they may already."""
    if not inquiry.controller.excused:
        case = changes.with_leaves(inquiry.patient, weighting="border")
        yield "weighting", "With weighting='border'", case


def avoid_limits(inquiry: Inquiry) -> Iterator[Offer]:
    """Yield the case with limit avoidance, if the robot is redundant."""
    controller = inquiry.controller
    if controller.columns.size > controller.full_rank:
        case = changes.with_leaves(inquiry.patient, secondary=AvoidLimits())
        yield "secondary", "With secondary=AvoidLimits()", case


def longer(inquiry: Inquiry) -> Iterator[Offer]:
    """Yield the case with more time, if the error still falls."""
    if inquiry.falls:
        yield "duration", "Given more time", inquiry.patient


def feed_forward(inquiry: Inquiry) -> Iterator[Offer]:
    """Yield the case with feed-forward, if something moves on its own."""
    if not inquiry.case.scene.motions:
        return
    for which in ("known", "estimated"):
        case = changes.with_leaves(inquiry.case, feed_forward=which)
        yield "feed_forward", f"With feed_forward='{which}'", case


def tolerance(inquiry: Inquiry) -> Iterator[Offer]:
    """Yield the case with a tolerance above the final error."""
    if inquiry.falls:
        return
    third = inquiry.errors[-max(len(inquiry.errors) // 3, 1) :]
    wanted = float(f"{1.5 * float(np.median(third)):.2g}")
    own = inquiry.controller.tolerances
    if (own == own[0]).all() and inquiry.tolerance < wanted < 0.2 * inquiry.errors[0]:
        case = changes.with_leaves(inquiry.case, tolerance=wanted)
        yield "tolerance", f"With a tolerance of {inquiry.size(wanted)}", case


_REMEDIES: dict[Outcome, tuple[Remedy, ...]] = {
    Outcome.RUNNING: (),
    Outcome.ENDED: (),
    Outcome.CONVERGED: (),
    Outcome.LOCAL_MINIMUM: (interaction, law, other_scheme),
    Outcome.OUT_OF_IMAGE: (interaction, gain_lower, inverse, law, other_scheme, image, weighting),
    Outcome.BEHIND_CAMERA: (interaction, gain_lower, inverse, law, other_scheme, weighting),
    Outcome.JOINT_LIMIT: (avoid_limits, interaction, law, other_scheme, gain_lower),
    Outcome.SINGULAR: (interaction, inverse, law, other_scheme),
    Outcome.DIVERGED: (gain_lower, inverse, interaction, law, other_scheme),
    Outcome.NOT_FINITE: (gain_lower, inverse, interaction, law),
    Outcome.TIME_LIMIT: (
        *(feed_forward, no_limit, inverse, gain_higher),
        *(longer, gain_lower, law, tolerance),
    ),
}


def robustly(inquiry: Inquiry) -> Iterator[Finding]:
    """Yield the advice to weigh robustly, if marks lie, none is weighed so, and it helps.

    It helps if the run converges then. Where noise lets no run converge, it helps if the mean
    distance to the goal over the second half is less than half of what it was.
    """
    q: list[Array] = []
    case = changes.weighed_robustly(inquiry.case) if _lie(inquiry.case) else None
    trial = tried(case, lambda snapshot, _: q.append(snapshot.q)) if case is not None else None
    if trial is None:
        return
    others = any(leaf.weighting for leaf in leaves(inquiry.case.task))
    how = f"With weighting='tukey'{' beside what it has' * others}"
    if trial.converged:
        sentence = f"{how} the same start {trial.ending}."
        yield Finding("weighting", sentence, {"converges_after_s": trial.end_time})
        return
    was = _distance(inquiry.loop, [snapshot.q for snapshot in inquiry.snapshots])
    now = _distance(trial.loop, q)
    if trial.outcome is inquiry.outcome and now < NEARER * was:
        sentence = (
            f"{how} the same run ends {length(now)} off its goal instead of {length(was)} (means "
            "over its second half)."
        )
        yield Finding("weighting", sentence, {"off_m": now, "was_off_m": was})


def _lie(case: Experiment) -> bool:
    """Return whether marks lie that nothing weighs robustly."""
    effects = [each.effect for each in case.sensing.acting()]
    strays = any(effect.deviation(True) < effect.deviation(False) for effect in effects)
    return strays and not weighs_robustly(case.task)


def _distance(loop: Loop, q: Sequence[Array]) -> float:
    """Return the mean distance (m) to the goal over the second half of coordinates (nq, 1)."""
    late = np.concatenate(q[len(q) // 2 :], axis=1)
    start = np.repeat(loop.q0, late.shape[1], axis=0)
    return float(ends.off_goal(loop.controller, late, start)[1].mean())
