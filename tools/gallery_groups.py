"""Groups of experiments, chosen by the content and the outcome of an experiment."""

from collections.abc import Iterator
from typing import Any

import robsim as rs

ROLLING = {"planar", "unicycle", "car"}
# an experiment belongs to the first group that matches
GROUPS = {
    "Missions": lambda it, run: isinstance(it.task, rs.Mission),
    "Mobile robots": lambda it, run: bool(ROLLING & set(_kinds(it.scene))),
    "Moving targets": lambda it, run: len(it.scene.motions) > 0,
    "Imperfect images, joints, depths and beliefs": lambda it, run: _is_imperfect(it),
    "Runs that do not converge": lambda it, run: int(run.outcome) != rs.Outcome.CONVERGED,
    "Free cameras": lambda it, run: "floating" in _kinds(it.scene),
    "Robot arms": lambda it, run: True,
}


def group_of(experiment: rs.Experiment, run: Any) -> str:
    """Return the name of the group to which an experiment with this run belongs."""
    return next(name for name, holds in GROUPS.items() if holds(experiment, run))


def _kinds(scene: rs.Scene) -> Iterator[str]:
    """Yield the kind of every joint of a scene."""
    return (link.joint.kind for robot in scene.robots for link in robot.links)


def _is_imperfect(experiment: rs.Experiment) -> bool:
    task = experiment.task
    wrong = getattr(task, "depth_scale", 1.0) != 1.0 or getattr(task, "belief", None) is not None
    return wrong or (experiment.sensing, experiment.actuation) != (rs.Sensing(), rs.Actuation())
