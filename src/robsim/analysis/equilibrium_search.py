"""Search for the equilibria of a task, and for the share of the runs that end at each."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike, NDArray

from robsim.analysis.equilibrium import (
    EQUILIBRIUM_KINDS,
    Equilibrium,
    EquilibriumKind,
    EquilibriumSet,
)
from robsim.analysis.equilibrium_kinds import (
    SAME_STATE,
    EquilibriumPoints,
    classify_points,
    group_points,
    loop_eigenvalues,
    merge_points,
)
from robsim.analysis.newton_method import refine_equilibria
from robsim.analysis.random_starts import sample_starts
from robsim.analysis.vector_fields import VectorField
from robsim.base.arrays import (
    Array,
    as_integer,
    as_positive,
    make_read_only,
    move_runs_first,
    move_runs_last,
)
from robsim.base.errors import InputError
from robsim.engine.chunk import ChunkProgress
from robsim.engine.loop import Loop
from robsim.robot.joint import LIMIT_SLACK
from robsim.run.run_checks import check_instance, check_task, count_periods
from robsim.servo.task_controller import TaskController
from robsim.servo.tasks.task import Task
from robsim.statistics.random_numbers import RandomNumbers
from robsim.vision.camera import Visibility
from robsim.world.scene import Scene

NEAR = 0.02  # largest distance (m, rad) of the end of a run from its equilibrium
CHUNK = 256  # runs in lockstep
PAIRS = 200  # least number of pairs of ends for starts of Newton's method
PERIODS = 0.02  # control period of a run, in time constants of the fastest motion
PATIENCE = 100.0  # duration of a run, in nominal time constants of the slowest motion
LONGEST = 20_000  # control periods of a run, at most
MOST = 1_000_001  # exclusive upper bound of the number of random starts


def equilibria(
    scene: Scene,
    task: Task,
    starts: ArrayLike | Mapping[str, ArrayLike] | None = None,
    *,
    count: int = 200,
    seed: int = 0,
    distance: tuple[float, float] = (0.6, 1.4),
    cone: float = np.pi / 4,
    dt: float | None = None,
    duration: float | None = None,
) -> EquilibriumSet:
    """Find the states without commanded motion of a task, from many starts, and classify them.

    A run is simulated from every start as in `simulate`, but without image borders and joint
    limits. Newton's method then solves f(q) = 0, with the commanded velocities qdot = f(q), from
    the end and the start of every run, from random states between two ends (saddles lie there), and
    from a taught goal. The result depends on the starts and may be incomplete: an equilibrium that
    no start leads to is missing. Each equilibrium is classified by its error and by the eigenvalues
    of df/dq. Chaumette 1998, "Potential problems of stability and convergence in image-based and
    position-based visual servoing", describes spurious minima; Colotti et al. 2024, "Determination
    of all stable and unstable equilibria for image-point-based visual servoing", all equilibria of
    points.

    Parameters
    ----------
    scene : Scene
        Scene without prescribed motions.
    task : Task
        Task without memory.
    starts : array_like of shape (B, nq), or mapping of str to array_like, optional
        Starts, or starts of each robot by name. Default: random starts.
    count : int, default 200
        Number of random starts.
    seed : int, default 0
        Seed of the random starts.
    distance : tuple of float, default (0.6, 1.4)
        For a single flying camera: least and largest distance from the middle of the marks, in
        units of the distance at the goal. The camera looks at the middle, with a random roll. For
        other robots every commanded joint is uniform within its limits, or within 0.5 m and a full
        turn of home if it has no limits. Starts with a mark behind its camera are sampled again.
    cone : float, default pi/4
        For a single flying camera: largest angle in radians from the direction of the goal.
    dt : float, optional
        Control period of the runs in seconds. Default: 1/50 of the fastest time constant at the
        goal.
    duration : float, optional
        Duration of the runs in seconds. Default: 100 times 1/gain, at most 20,000 periods. With the
        transpose as inverse, the rate of the slowest feature replaces the gain.

    Returns
    -------
    EquilibriumSet
        The equilibria in order: goals, minima, unstable equilibria.

    Raises
    ------
    InputError
        If the task has memory (Broyden, DepthFilter, estimated feed-forward, a smooth start, a
        latched switch), if the scene has prescribed motions, or if the starts are unusable.

    Examples
    --------
    >>> import robsim as rs
    >>> scenario = rs.load_scenario(rs.examples.path("local_minimum"))
    >>> result = equilibria(scenario.scene, scenario.task, count=40)
    >>> [each.kind for each in result][:2], round(result.minima[0].error_norm, 5)
    (['goal', 'minimum'], 0.00231)
    """
    scene, task = check_instance(scene, Scene, "scene"), check_task(task)
    real = task.bind(scene)  # with the errors and warnings of a run
    field = VectorField.of(scene, task)
    count, seed = as_integer(count, "count", 1, MOST), as_integer(seed, "seed", 0, 2**64)
    with np.errstate(all="ignore"):  # invalid states give NaN
        q0 = (
            sample_starts(field, count, seed, distance, cone)
            if starts is None
            else _check_given_starts(field, starts)
        )
        return _search_equilibria(real, field, q0, seed, *_choose_period(field, q0, dt, duration))


def _search_equilibria(
    real: TaskController, field: VectorField, q0: Array, seed: int, dt: float, steps: int
) -> EquilibriumSet:
    """Return the equilibria that runs and Newton's method reach from starts q0 (nq, B)."""
    field.check_memoryless(q0)
    ends, outcomes = _simulate_runs(field, q0, dt, steps)
    seeds = [q0, ends, _sample_between_ends(field, ends, seed)]
    if field.goal is not None:
        seeds.insert(0, field.goal)
    q = refine_equilibria(field, np.concatenate(seeds, axis=1))
    return _assemble_equilibria(real, field, q, q0, ends, outcomes)


def _check_given_starts(field: VectorField, starts: ArrayLike | Mapping[str, ArrayLike]) -> Array:
    """Return the given starts as (nq, B); raise InputError if they are unusable."""
    coordinates = field.scene.coordinates(starts, "starts", limits=False)
    if coordinates.ndim != 2 or not coordinates.size:
        raise InputError(f"starts: expected shape (B, {field.scene.nq}), got {coordinates.shape}")
    q = move_runs_last(coordinates, 1)
    behind = np.flatnonzero(~field.in_front(q))
    if behind.size:
        raise InputError(f"starts: row {behind[0]} has a mark that is not in front of its camera")
    return q


def _choose_period(
    field: VectorField, q0: Array, dt: float | None, duration: float | None
) -> tuple[float, int]:
    """Return the control period and the number of periods, by default from the decay rates."""
    if dt is None:
        rates = np.abs(loop_eigenvalues(field, q0 if field.goal is None else field.goal)).max(
            axis=0
        )
        fastest = np.median(rates[np.isfinite(rates)]) if np.isfinite(rates).any() else 0.0
        dt = PERIODS / max(float(fastest), field.controller.pace)
    dt = as_positive(dt, "dt (seconds)")
    if duration is None:
        return dt, int(min(np.ceil(PATIENCE / (field.controller.pace * dt)), LONGEST))
    return dt, count_periods(dt, as_positive(duration, "duration (seconds)"))


def _simulate_runs(
    field: VectorField, q0: Array, dt: float, steps: int
) -> tuple[Array, NDArray[np.int8]]:
    """Return the final states (nq, B) of the runs, and their outcomes (B,)."""
    loop = Loop(field.controller, move_runs_first(q0), dt, steps, limited=False)
    rows = np.arange(q0.shape[1])
    for first in range(0, rows.size, CHUNK):
        loop.advance(ChunkProgress(rows[first : first + CHUNK]), lambda share: None)
    return move_runs_last(loop.recorder.last.q[:, 0], 1), loop.recorder.outcome


def _sample_between_ends(field: VectorField, ends: Array, seed: int) -> Array:
    """Return random states between the ends of two runs, where saddles separate their basins."""
    count = ends.shape[1]
    share = RandomNumbers(seed, "between", np.arange(max(PAIRS, count))).uniform(3)
    i, j = (share[:, :2] * count).astype(int).T
    return field.interpolate(ends[:, i], ends[:, j], share[:, 2])


def _assemble_equilibria(
    real: TaskController,
    field: VectorField,
    q: Array,
    q0: Array,
    ends: Array,
    outcomes: NDArray[np.int8],
) -> EquilibriumSet:
    """Return the distinct equilibria in order."""
    starts = make_read_only(move_runs_first(q0))
    if not q.shape[1]:
        return EquilibriumSet(
            (), starts, make_read_only(np.full(len(starts), -1)), make_read_only(outcomes)
        )
    points = merge_points(field, q)
    first, point_kinds = group_points(points), classify_points(field, points)
    ended = _assign_ends(field, points, first, ends)
    counts = np.bincount(ended[ended >= 0], minlength=first.size)
    listed = [i for i in _order_points(field, points, point_kinds, counts) if first[i] == i]
    T, within = field.pose(points.q).matrix, is_within_bounds(real, points.q)
    result = [
        Equilibrium(
            make_read_only(points.q[:, i].copy()),
            make_read_only(T[i].copy()),
            point_kinds[i],
            float(points.error_norm[i]),
            make_read_only(points.eigenvalues[:, i].copy()),
            int(points.free[i]),
            bool(within[i]),
            float(counts[i] / ended.size),
        )
        for i in listed
    ]
    number = np.full(first.size + 1, -1)  # the last entry stands for runs without equilibrium
    number[listed] = np.arange(len(listed))
    return EquilibriumSet(
        tuple(result), starts, make_read_only(number[ended]), make_read_only(outcomes)
    )


def _order_points(
    field: VectorField,
    points: EquilibriumPoints,
    point_kinds: list[EquilibriumKind],
    counts: NDArray[np.int64],
) -> list[int]:
    """Return indices of the points by kind, taught goal first, then by share, then by error."""
    ranks = np.array([EQUILIBRIUM_KINDS.index(kind) for kind in point_kinds])
    other = (
        np.zeros(ranks.size) if field.goal is None else field.distances(points.q, field.goal)[:, 0]
    )
    order = np.lexsort(np.array([points.error_norm, -counts, other > SAME_STATE, ranks]))
    return [int(i) for i in order]


def is_within_bounds(real: TaskController, q: Array) -> NDArray[np.bool_]:
    """Return whether (E,) all joints are within their limits and all marks in their images."""
    low, high = real.scene.limits.T[..., None]
    within = (low - LIMIT_SLACK <= q) & (q <= high + LIMIT_SLACK)
    visible = [sight.project(q).visibility == Visibility.IN_IMAGE for sight in real.sights]
    return np.asarray(np.concatenate([within, *visible]).all(axis=0))


def _assign_ends(
    field: VectorField, points: EquilibriumPoints, first: NDArray[np.int64], ends: Array
) -> NDArray[np.int64]:
    """Return the first point (B,) of the set near the end of each run; -1 if there is none."""
    distances = field.distances(ends, points.q)
    return np.where(distances.min(axis=1) < NEAR, first[distances.argmin(axis=1)], -1)
