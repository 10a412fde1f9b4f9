"""`Suite`: starts and a goal for the comparison of schemes, with a criterion of success."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence, Sized
from dataclasses import KW_ONLY, dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from robsim.base.arrays import (
    Array,
    as_bool,
    as_floats,
    as_integer,
    as_positive,
    has_items,
    make_read_only,
)
from robsim.base.errors import InputError, format_value
from robsim.features.feature import reads_pictures
from robsim.geometry.pose import Pose
from robsim.run.end_variables import measure_pose_difference
from robsim.run.experiment import Experiment
from robsim.run.run_checks import check_instance, check_starts
from robsim.servo.goals.goal import GoalPose, TaughtGoal
from robsim.servo.tasks.task import ServoTask, Task
from robsim.suites.builtin_schemes import BUILT_IN
from robsim.world.scene import Scene
from robsim.world.sensing import Sensing

if TYPE_CHECKING:
    import pandas as pd

TEXT_FIELDS = "name", "title", "source", "criterion"
ROW_COLUMNS = (  # columns of the rows of every suite
    *("suite", "version", "scheme", "run", "draw", "outcome", "began", "success", "time"),
    *("path_length", "distance_at_start", "angle_at_start", "distance_to_goal", "angle_to_goal"),
)


@dataclass(frozen=True, eq=False)
class Suite:
    """Starts and a goal in a scene, with a criterion of success: a benchmark for schemes.

    Parameters
    ----------
    name : str
        Name of the suite.
    version : int
        Version of the suite. Results with the same name and version are comparable.
    title, source : str
        Title of the suite, and its source.
    criterion : str
        Criterion of success in words.
    succeeds : callable
        Criterion of success as a function from rows of `Benchmark.data` to one truth value per row.
    scene : Scene
        Scene with one camera and one target.
    goal : array_like of shape (nq,)
        Coordinates at the goal.
    starts : array_like of shape (runs, nq)
        Starts of the runs.
    gain : float, default 1.0
        Gain of every scheme, in 1/s.
    dt, duration : float, default 0.02 and 10.0
        Control period and duration of a run, in seconds.
    varied : mapping of str to array_like, optional
        Further values that differ from run to run, {name: (runs, ...)}, as in `Experiment.vary`.
    groups : mapping of str to sequence of str, optional
        Labels (runs,) of the groups of runs, by the name of the grouping.
    draws : array_like of int of shape (runs,), optional
        Number of the draw of each run. Runs of one draw are not independent, as the same start in
        several sizes of the world, and the intervals account for it. Default: every run is a draw,
        except that equal runs are one draw.
    columns : mapping of str to array_like, optional
        Further numbers (runs,) of the runs, for the criterion of success, by the name of their
        column in `Benchmark.data`.
    crossed : bool, default False
        Whether to count every pair of labels of two groupings, instead of each label alone.
    computed : bool, default False
        Whether the controller computes the goal from its pose and its beliefs. Default: the goal is
        shown.
    sensing : Sensing, optional
        Imperfections of the images of all runs.
    seed : int, default 0
        Seed of the noise of the runs.
    schemes : mapping of str to ServoTask, optional
        Compared schemes. Default: the textbook schemes.

    Raises
    ------
    InputError
        If a parameter is invalid or does not fit the others.

    Examples
    --------
    >>> import robsim as rs
    >>> from robsim.suites.suite_registry import load_suite
    >>> one = load_suite("vit_500")
    >>> one.name, one.runs
    ('vit_500', 500)
    """

    name: str
    version: int
    title: str
    source: str
    criterion: str
    succeeds: Callable[[pd.DataFrame], ArrayLike]
    scene: Scene
    goal: ArrayLike
    starts: ArrayLike
    _: KW_ONLY
    gain: float = 1.0
    dt: float = 0.02
    duration: float = 10.0
    varied: Mapping[str, ArrayLike] = field(default_factory=dict)
    groups: Mapping[str, Sequence[str]] = field(default_factory=dict)
    draws: ArrayLike | None = None
    columns: Mapping[str, ArrayLike] = field(default_factory=dict)
    crossed: bool = False
    computed: bool = False
    sensing: Sensing = field(default_factory=Sensing)
    seed: int = 0
    schemes: Mapping[str, ServoTask] = field(default_factory=lambda: BUILT_IN)

    def __post_init__(self) -> None:
        for name in TEXT_FIELDS:
            text = getattr(self, name)
            if not isinstance(text, str) or not text:
                raise InputError(f"{name} of a suite: expected a text, got {format_value(text)}")
        if not callable(self.succeeds):
            raise InputError(
                f"succeeds: expected a function of rows, got {format_value(self.succeeds)}"
            )
        as_integer(self.version, "version", 1)
        as_integer(self.seed, "seed", 0, 2**64)
        for name in ("gain", "dt", "duration"):
            as_positive(getattr(self, name), name)
        check_instance(self.sensing, Sensing, "sensing")
        if not isinstance(self.schemes, Mapping):
            raise InputError(f"schemes: expected {{name: task}}, got {format_value(self.schemes)}")
        for name, task in self.schemes.items():
            check_instance(task, ServoTask, f"scheme {name!r}")
        self._put_starts()
        self._put_lists()
        if as_bool(self.crossed, "crossed") and len(self.groups) != 2:
            raise InputError(f"crossed: two groups are needed, got {len(self.groups)}")
        if as_bool(self.computed, "computed"):
            _ = self.task_goal

    def _put_starts(self) -> None:
        """Check goal and starts in the scene, and store them as arrays."""
        scene = check_instance(self.scene, Scene, "scene")
        _ = scene.camera(), scene.object()
        goal, start = (
            check_starts(scene, self.goal, "goal"),
            check_starts(scene, self.starts, "starts"),
        )
        if goal.ndim != 1 or start.ndim != 2:
            shapes = f"got {goal.shape} and {start.shape}"
            raise InputError(f"expected a goal (nq,) and starts (runs, nq), {shapes}")
        object.__setattr__(self, "goal", goal)
        object.__setattr__(self, "starts", start)

    def _put_lists(self) -> None:
        """Check that lists have one value for each run, and store them as immutable arrays."""
        for field_name in ("varied", "groups", "columns"):
            self._check_lists(field_name, getattr(self, field_name))
        taken = [*ROW_COLUMNS, *self.groups, *self.columns]
        for name in (*self.groups, *self.columns):
            if taken.count(name) > 1:
                raise InputError(f"groups and columns: the column {name!r} would occur twice")
        varied = {name: make_read_only(as_floats(x, name, ())) for name, x in self.varied.items()}
        object.__setattr__(self, "varied", varied)
        labels = {name: tuple(map(str, each)) for name, each in self.groups.items()}
        object.__setattr__(self, "groups", labels)
        numbers = {name: self._as_column(x, name) for name, x in self.columns.items()}
        object.__setattr__(self, "columns", numbers)
        if self.draws is not None:
            draws = self._as_column(self.draws, "draws")
            if (draws != np.round(draws)).any():
                raise InputError(f"draws: expected integers, got {format_value(self.draws)}")
            object.__setattr__(self, "draws", make_read_only(draws.astype(np.int64)))

    def _check_lists(self, field_name: str, values_by_name: Any) -> None:
        """Raise InputError unless a field has a list with a value for each run, by name."""
        lists = isinstance(values_by_name, Mapping) and all(map(has_items, values_by_name.values()))
        if not lists or not all(isinstance(each, Sized) for each in values_by_name.values()):
            got = format_value(values_by_name)
            raise InputError(f"{field_name}: expected a list for each name, got {got}")
        for name, values in values_by_name.items():
            if len(values) != self.runs:
                raise InputError(f"{name}: {len(values)} values for {self.runs} starts")

    def _as_column(self, values: ArrayLike, name: str) -> Array:
        """Return one number for each run (runs,); raise InputError for other values."""
        numbers = as_floats(values, name, ("runs",))
        if numbers.shape != (self.runs,):
            raise InputError(
                f"{name}: expected one number for each of {self.runs} starts, got an array of "
                f"shape {numbers.shape}"
            )
        return make_read_only(numbers)

    @property
    def runs(self) -> int:
        """The number of runs of a scheme."""
        return len(np.asarray(self.starts))

    @property
    def uses_pictures(self) -> bool:
        """Whether a scheme has a detector or a feature of pictures, which takes minutes.

        Examples
        --------
        >>> from robsim.suites.suite_registry import load_suite
        >>> load_suite("vit_500").uses_pictures
        False
        """
        return any(
            getattr(each, "detector", None) is not None
            or reads_pictures(getattr(each, "features", None))
            for each in self.schemes.values()
        )

    @property
    def task_goal(self) -> TaughtGoal | GoalPose:
        """The goal in the form that a task needs."""
        if not self.computed:
            return TaughtGoal(self.goal)
        T_w_c = self.scene.pose(self.scene.camera().name, self.goal)
        T_w_o = self.scene.pose(self.scene.object().name, self.goal)
        return GoalPose(Pose((T_w_c.inv() @ T_w_o).matrix))

    def experiment(self, task: Task) -> Experiment:
        """Return the experiment of all runs of a task, without the varied values.

        Parameters
        ----------
        task : Task
            Task with its goal and gain.

        Returns
        -------
        Experiment
            Experiment with all starts of the suite.
        """
        return Experiment(
            self.scene,
            task,
            self.starts,
            sensing=self.sensing,
            dt=self.dt,
            duration=self.duration,
            seed=self.seed,
            record="summary",
        )

    def off_goal(self, q: Array) -> tuple[Array, Array]:
        """Return distances and angles of the true camera from its goal pose.

        Parameters
        ----------
        q : ndarray of shape (runs, nq)
            Coordinates.

        Returns
        -------
        distances, angles : ndarray of shape (runs,)
            Distances in metres and angles in radians.
        """
        name = self.scene.camera().name
        goal_matrices = np.broadcast_to(self.scene.pose(name, self.goal).matrix, (len(q), 4, 4))
        matrices = self.scene.pose(name, q).matrix
        return measure_pose_difference(
            *(np.moveaxis(T[:, :3], 0, 2) for T in (goal_matrices, matrices))
        )

    def cells(self) -> list[tuple[str, NDArray[np.bool_]]]:
        """Return the label of each group of runs, and its members (runs,)."""
        labels = {name: np.asarray(each, dtype=object) for name, each in self.groups.items()}
        if self.crossed:
            rows, columns = labels.values()
            labels = {"": np.array([f"{a}, {b}" for a, b in zip(rows, columns, strict=True)])}
        result = [("all", np.ones(self.runs, dtype=bool))]
        for each in labels.values():
            result += [(label, each == label) for label in dict.fromkeys(each)]
        return result


def square_marks(side: float) -> Array:
    """Return the marks (4, 3) of a square with the given side in metres, in the plane z = 0."""
    corners = [[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]
    return make_read_only(0.5 * side * np.array(corners, dtype=float))
