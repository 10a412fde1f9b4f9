"""Search for a start from which the cameras see their targets."""

from __future__ import annotations

import warnings
from collections.abc import Iterator

import numpy as np

from robsim.base.arrays import Array
from robsim.base.errors import InputError, RankWarning
from robsim.run.experiment import Experiment
from robsim.run.mission_protocol import SelfSimulatingTask
from robsim.starts.start_samplers import Anywhere, LookAt, Start, Within
from robsim.studies.row_simulator import RowSimulator
from robsim.studies.study_plan import make_plan

DRAWS = 32  # starts of each sampler, of which the nearest is chosen
NEAR, FAR = 0.7, 1.3  # distances from the target, in units of the distance at the goal
SPREAD = 0.5  # radians, half angle of the cone and largest roll and rotation
DECIMALS = 3  # of metres and radians


def find_visible_start(experiment: Experiment) -> Array | None:
    """Return a start (nq,) that sees the target, near to the start of an experiment.

    The starts of three samplers are tried in turn: poses that look at the target from about the
    distance at the goal, poses near to the goal, and coordinates within the joint limits. The
    result has three decimals.

    Parameters
    ----------
    experiment : Experiment
        Experiment with a start that does not see its target.

    Returns
    -------
    ndarray of shape (nq,) or None
        The start with the smallest of the largest differences from the given coordinates; None if
        no start is found, if the experiment has other errors, or for a mission.

    Examples
    --------
    >>> from robsim import examples, load_scenario
    >>> blind = load_scenario(examples.path("chapter_6_1")).with_(start=[1.5, -1.6, 1.6, 0, -1.5])
    >>> q = find_visible_start(blind)
    >>> blind.with_(start=q).check()
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RankWarning)  # the check of the experiment gives it
        if isinstance(experiment.task, SelfSimulatingTask) or not _is_valid(experiment, view=False):
            return None
        return _find_nearest_start(experiment)


def _find_nearest_start(experiment: Experiment) -> Array | None:
    """Return the nearest of the sampled starts that see the target; None if there is none."""
    scene = experiment.scene
    given = scene.home if experiment.start is None else np.atleast_2d(experiment.start)[0]
    has_decimals = np.array([unit != "1" for unit in scene.coordinate_units])
    for sampler in _list_samplers(experiment):
        q = _draw_starts(experiment, sampler)
        q = np.where(has_decimals, np.round(q, DECIMALS), q) + 0.0
        for one in q[np.argsort(np.abs(q - given).max(axis=1), kind="stable")]:
            if _is_valid(experiment.with_(start=one)):
                return np.asarray(one)
    return None


def _list_samplers(experiment: Experiment) -> Iterator[Start]:
    """Yield samplers of starts, those near to the goal first."""
    reach = RowSimulator(make_plan(experiment, 1, 0, Anywhere())).reach
    sight = reach.controller.sights[0] if reach.controller.sights else None
    distance = 1.0
    if sight is not None:
        offset = reach.goal.position - reach.middle(sight.target.name)
        distance = float(np.linalg.norm(offset)) or 1.0
        bounds = NEAR * distance, FAR * distance
        yield LookAt(sight.target.name, distance=bounds, roll=(-SPREAD, SPREAD), cone=SPREAD)
    yield Within(0.5 * distance, SPREAD)
    yield Anywhere()


def _draw_starts(experiment: Experiment, sampler: Start) -> Array:
    """Return starts (n, nq) that see their target; none if the sampler does not fit."""
    try:
        rows = RowSimulator(make_plan(experiment, DRAWS, 0, sampler))
        q, _, accepted = rows.starts(np.arange(DRAWS))
    except InputError:  # for example, a target that moves before a fixed camera
        return np.empty((0, experiment.scene.nq))
    return q[accepted]


def _is_valid(experiment: Experiment, view: bool = True) -> bool:
    """Return whether an experiment has no errors, with `view` also at its start."""
    try:
        experiment.check(view=view)
    except InputError:
        return False
    return True
