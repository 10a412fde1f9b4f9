"""Where a camera stands that has converged: where it was meant to, or elsewhere, and why."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from robsim.analysis.case import Case
from robsim.analysis.explanation import views
from robsim.analysis.explanation.attribution import Criterion, Cure
from robsim.analysis.explanation.changes import with_leaves
from robsim.analysis.explanation.finding import Finding
from robsim.analysis.explanation.imperfections import imperfections
from robsim.analysis.explanation.inquiry import Inquiry
from robsim.analysis.explanation.removal import Trial, cures, patient
from robsim.analysis.explanation.wording import away
from robsim.run.loop import Loop
from robsim.servo import Task

FAR, TURNED = 1e-3, 2e-3  # metres and radians: what is worth a word
BETTER = 0.1  # of what a camera is off: then it stands where it should


def final_pose(inquiry: Inquiry) -> list[Finding]:
    """That it stands elsewhere, and what of the things that are wrong is the cause of that."""
    controller = inquiry.again.loop.controller
    off = miss(inquiry.case.task, inquiry.again.loop)
    if controller.full_rank < 6 or not (off[0] > FAR or off[1] > TURNED):
        return []
    wrong = imperfections(inquiry.again)
    as_seen = "as the controller sees and believes it" if wrong else "but not in space"
    sentence = (
        f"It converged in the image {as_seen}: in truth the camera stands {away(*off)} away from "
        "where it was meant to stand."
    )
    evidence = {"off_m": off[0], "angle_deg": math.degrees(off[1])}
    first = Finding("final pose", sentence, evidence)
    if not inquiry.experiments:
        return [first]
    cured = _nearer(off, float(inquiry.depths[-1]))
    causes = Criterion(cured, _stands).attributed(inquiry.case, wrong).causes
    return [first, *(causes or _same_image(inquiry, cured, bool(wrong)))]


def _same_image(inquiry: Inquiry, cured: Cure, wrong: bool) -> Iterator[Finding]:
    """Why a camera stands elsewhere that is not misled."""
    finer = 1e-3 * inquiry.tolerance
    case = with_leaves(patient(inquiry.case), tolerance=finer)
    if case is None or not cures(case):
        return
    if cured(case):
        yield Finding(
            "tolerance",
            f"The tolerance of {inquiry.size(inquiry.tolerance)} leaves that: with "
            f"{inquiry.size(finer)} the camera stands where it should.",
            {"tolerance": inquiry.tolerance, "finer": finer},
        )
    elif not wrong:
        yield Finding(
            "ambiguous features",
            "The features have the same values at both poses; three marks, for one, look the same "
            "from up to four. More marks tell the poses apart.",
        )


def miss(task: Task, loop: Loop) -> tuple[float, float]:
    """How far (m) and how much turned (rad) the first camera stands from its goal at the end."""
    sight = loop.controller.sights[0]
    away = views.from_goal(task, sight, loop.recorder.last.q[0, 0])
    if away is None:
        return math.nan, math.nan
    return float(np.linalg.norm(away.position)), float(np.linalg.norm(away.rotvec))


def _nearer(off: tuple[float, float], depth: float) -> Cure:
    """What brings the camera nearer; a translation counts as the angle at which it is seen."""

    def apparent(miss: tuple[float, float]) -> float:
        return max(miss[0] / depth, miss[1])

    def cured(case: Case) -> Trial | None:
        trial = cures(case)
        if trial is None:
            return None
        now = apparent(miss(case.task, trial.loop))
        return trial if now < max(TURNED, BETTER * apparent(off)) else None

    return cured


def _stands(trial: Trial) -> str:
    return "the camera stands where it should"
