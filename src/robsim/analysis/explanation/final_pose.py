"""Comparison of the final camera pose with the intended one, and causes of a difference."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from robsim.analysis.explanation.attribution import Criterion, Cure
from robsim.analysis.explanation.changes import with_leaves
from robsim.analysis.explanation.finding import Finding
from robsim.analysis.explanation.imperfections import imperfections
from robsim.analysis.explanation.inquiry import Inquiry
from robsim.analysis.explanation.removal import Trial, cures, patient
from robsim.analysis.explanation.wording import away, counted
from robsim.base.arrays import runs_last
from robsim.engine.loop import Loop
from robsim.run import ends
from robsim.run.experiment import Experiment
from robsim.servo.controller import Controller

FAR, TURNED = 1e-3, 2e-3  # metres and radians above which a distance is reported
BETTER = 0.1  # share of its distance below which the camera counts as at its goal


def final_pose(inquiry: Inquiry) -> list[Finding]:
    """Report a converged run that stands away from its goal pose, and the cause."""
    loop = inquiry.loop
    off, full = miss(loop), _determined(loop.controller)
    far, turned = (FAR, TURNED) if full else (ends.FAR, ends.TURNED)
    if math.isnan(off[0]) and ends.free_motions(loop.controller):
        return [_undetermined(inquiry)]  # of a goal that is numbers: no pose is the right one
    if not (off[0] > far or off[1] > turned):
        return []
    wrong = imperfections(inquiry)
    first = _displaced(loop.controller, off, bool(wrong))
    if not full:
        return [first, _undetermined(inquiry)]
    if not inquiry.trials:
        return [first]
    cured = _nearer(off, float(inquiry.depths[-1]))
    stands = Criterion(cured, lambda _: "the camera stands where it should")
    causes = stands.attributed(inquiry.case, wrong).causes
    return [first, *(causes or _same_image(inquiry, cured, bool(wrong)))]


def _determined(controller: Controller) -> bool:
    """Return whether features at their goal determine the pose, up to a few solutions."""
    commanded = controller.columns.size >= 6 and not ends.free_motions(controller)
    return commanded or controller.full_rank >= 6


def _displaced(controller: Controller, off: tuple[float, float], wrong: bool) -> Finding:
    """Report how far from the goal pose the run ended."""
    part = ends.regarded(controller)
    who = "the camera" if part.moving == part.frame else f"'{part.moving}'"
    as_seen = "as the controller sees and believes it" if wrong else "but not in space"
    sentence = (
        f"It converged in the image {as_seen}: in truth {who} stands {away(*off)} away from "
        "where it was meant to stand."
    )
    return Finding("final pose", sentence, {"off_m": off[0], "angle_deg": math.degrees(off[1])})


def _undetermined(inquiry: Inquiry) -> Finding:
    """Report why features at their goal do not determine the pose."""
    controller = inquiry.controller
    free, count = ends.free_motions(controller), controller.columns.size
    if free:
        sentence = (
            f"The features leave {counted(free, 'motion')} free that the joints can make, and so "
            f"they have their goal at many poses. {_more(inquiry)}"
        )
    else:
        sentence = (
            f"A pose has six numbers, and the velocities that are commanded are {count}: the "
            "features have their goal at other poses too."
        )
    return Finding("free motions", sentence, {"free_motions": free, "velocities": count})


def _more(inquiry: Inquiry) -> str:
    """Return advice on what would tell the poses apart."""
    marks = inquiry.sight.target.marks
    if np.linalg.matrix_rank(marks - marks[0], tol=1e-9) < 2:
        return "Three marks or more that are not on one line tell these apart."
    return "More features or marks tell these apart."


def _same_image(inquiry: Inquiry, cured: Cure, wrong: bool) -> Iterator[Finding]:
    """Report why a camera ends away from its goal pose without any imperfection."""
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


def miss(loop: Loop) -> tuple[float, float]:
    """Return the distance (m) and angle (rad) of the first camera from its goal at the end."""
    q_end = runs_last(loop.recorder.last.q[:, 0], 1)
    _, metres, radians = ends.off_goal(loop.controller, q_end, loop.q0)
    return float(metres[0]), float(radians[0])


def _nearer(off: tuple[float, float], depth: float) -> Cure:
    """Return the test whether a change brings the camera nearer to its goal pose.

    A translation counts as the angle at which it is seen.
    """

    def apparent(miss: tuple[float, float]) -> float:
        return max(miss[0] / depth, miss[1])

    def cured(case: Experiment) -> Trial | None:
        trial = cures(case)
        if trial is None:
            return None
        now = apparent(miss(trial.loop))
        return trial if now < max(TURNED, BETTER * apparent(off)) else None

    return cured
