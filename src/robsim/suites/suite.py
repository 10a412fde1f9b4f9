"""`Suite`: starts and a goal on which schemes are compared, with what counts as success."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence, Sized
from dataclasses import KW_ONLY, dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

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
from robsim.geometry.pose import Pose
from robsim.run.end_variables import measure_pose_difference
from robsim.run.experiment import Experiment
from robsim.run.run_checks import check_instance, check_starts
from robsim.servo.goals.goal import GoalPose, TaughtGoal
from robsim.servo.tasks.task import ServoTask
from robsim.suites.builtin_schemes import BUILT_IN
from robsim.world.scene import Scene
from robsim.world.sensing import Sensing

if TYPE_CHECKING:
    import pandas as pd

TEXT_FIELDS = "name", "title", "source", "criterion"


@dataclass(frozen=True, eq=False)
class Suite:
    """Starts and a goal in a scene, with what counts as success: what schemes are compared on.

    name, version  results of the same name and version may be compared
    title, source  what it is, and where it comes from
    criterion      what counts as success, in words
    succeeds       the same as a function of the rows of `Benchmark.data`: truth values, a row each
    scene          with one camera and one target
    goal           (nq,), the coordinates at which the camera is at its goal
    starts         (runs, nq), where the runs start
    gain           of every scheme
    dt, duration   control period and length of a run, in seconds
    varied         {name: (runs, ...)}, what else differs from run to run, as in `Experiment.vary`
    groups         {what: (runs,) labels}, by which the runs are counted
    crossed        count by every pair of the labels of two groups, not by each alone
    computed       the goal is computed from its pose by what the controller believes, not shown
    sensing        what is wrong with the images of all runs
    seed           of the noise of the runs
    schemes        {name: task}, which are compared; by default those of the textbooks

    InputError: a part that does not fit.

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
    succeeds: Callable[[pd.DataFrame], Any]
    scene: Scene
    goal: Any
    starts: Any
    _: KW_ONLY
    gain: float = 1.0
    dt: float = 0.02
    duration: float = 10.0
    varied: Mapping[str, Any] = field(default_factory=dict)
    groups: Mapping[str, Sequence[str]] = field(default_factory=dict)
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
        """Check goal and starts in the scene, and keep them as arrays."""
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
        """Check that all that has a value for each run has as many; keep it unchanging."""
        for what in ("varied", "groups"):
            given = getattr(self, what)
            lists = isinstance(given, Mapping) and all(map(has_items, given.values()))
            if not lists or not all(isinstance(each, Sized) for each in given.values()):
                raise InputError(
                    f"{what}: expected a list for each name, got {format_value(given)}"
                )
            for name, values in given.items():
                if len(values) != self.runs:
                    raise InputError(f"{name}: {len(values)} values for {self.runs} starts")
        varied = {name: make_read_only(as_floats(x, name, ())) for name, x in self.varied.items()}
        object.__setattr__(self, "varied", varied)
        labels = {what: tuple(map(str, each)) for what, each in self.groups.items()}
        object.__setattr__(self, "groups", labels)

    @property
    def runs(self) -> int:
        """The number of runs of a scheme."""
        return len(self.starts)

    @property
    def task_goal(self) -> TaughtGoal | GoalPose:
        """The goal as a task takes it."""
        if not self.computed:
            return TaughtGoal(self.goal)
        T_w_c = self.scene.pose(self.scene.camera().name, self.goal)
        T_w_o = self.scene.pose(self.scene.object().name, self.goal)
        return GoalPose(Pose((T_w_c.inv() @ T_w_o).matrix))

    def experiment(self, task: Any) -> Experiment:
        """Return the experiment of all runs of a task, without what differs from run to run."""
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
        """Return metres and radians (runs,) from the goal to where the true camera is at q."""
        name = self.scene.camera().name
        there = np.broadcast_to(self.scene.pose(name, self.goal).matrix, (len(q), 4, 4))
        here = self.scene.pose(name, q).matrix
        return measure_pose_difference(*(np.moveaxis(T[:, :3], 0, 2) for T in (there, here)))

    def cells(self) -> list[tuple[str, NDArray[np.bool_]]]:
        """Return the label of each group of runs, and which runs (runs,) belong to it."""
        labels = {what: np.asarray(each, dtype=object) for what, each in self.groups.items()}
        if self.crossed:
            rows, columns = labels.values()
            labels = {"": np.array([f"{a}, {b}" for a, b in zip(rows, columns, strict=True)])}
        found = [("all", np.ones(self.runs, dtype=bool))]
        for each in labels.values():
            found += [(label, each == label) for label in dict.fromkeys(each)]
        return found


def square_marks(side: float) -> Array:
    """Return the marks (4, 3) of a square of this side in metres, in its plane z = 0."""
    corners = [[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]
    return make_read_only(0.5 * side * np.array(corners, dtype=float))
