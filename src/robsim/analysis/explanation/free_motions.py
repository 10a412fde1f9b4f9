"""Features that do not fix the pose of the camera, so that to converge does not say where."""

from __future__ import annotations

import math

import numpy as np

from robsim.analysis.explanation.final_pose import miss
from robsim.analysis.explanation.finding import Finding
from robsim.analysis.explanation.inquiry import Inquiry
from robsim.analysis.explanation.wording import away
from robsim.base.arrays import Array


def free_motions(inquiry: Inquiry) -> Finding | None:
    """Features that are the same at infinitely many poses to which the joints can bring the camera.

    There L J has a lower rank than J: of two marks L has rank 4, of one mark 2.
    """
    decision, controller = inquiry.again.decisions[-1], inquiry.again.loop.controller
    task_jacobian, J = decision.command.task_jacobian[..., 0], decision.J[..., 0]
    found, full = (
        int(np.linalg.matrix_rank(A, tol=_floor(A, controller.rcond))) for A in (task_jacobian, J)
    )
    hidden = inquiry.case.sensing.occlusions and controller.full_rank >= full  # with all marks
    if not found < full or hidden:
        return None
    sentence = (
        f"That the errors are small does not say where the camera stands: the features fix {found} "
        f"of the {full} motions that it can make, and infinitely many poses have the same. "
    )
    off = miss(inquiry.case.task, inquiry.again.loop)
    evidence = {"rank": float(found), "motions": float(full)}
    if not math.isnan(off[0]):
        sentence += f"It stands {away(*off)} away from where it was meant to stand. "
        evidence |= {"off_m": off[0], "angle_deg": math.degrees(off[1])}
    return Finding("free motions", sentence + _more(inquiry), evidence)


def _more(inquiry: Inquiry) -> str:
    """What would fix it."""
    marks = inquiry.sight.target.marks
    if np.linalg.matrix_rank(marks - marks[0], tol=1e-9) < 2:
        return "Three marks or more that are not on one line fix it."
    return "More features fix it."


def _floor(A: Array, rcond: float) -> float:
    """Below which a singular value counts as zero."""
    return rcond * float(np.linalg.norm(A, 2))
