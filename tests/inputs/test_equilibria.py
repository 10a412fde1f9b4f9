"""Bad input to `equilibria` is one clear error."""

from dataclasses import dataclass

import numpy as np
import pytest

import robsim as rs

SQUARE = 0.1 * np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])
GOAL = rs.Pose.at(0, 0, -0.5)
BEHIND = rs.Pose.at(0, 0, 0.5).q
NAN = float("nan")


@dataclass(frozen=True)
class Habit:
    """A law of a user that keeps its commands."""

    def command(self, state):
        qd = -state.error @ np.linalg.pinv(state.task_jacobian[0]).T
        state.memory["last"] = qd
        return qd


@pytest.mark.parametrize(
    ("given", "says"),
    [
        ({"starts": [0, 0, -1, 0, 0, 0, 1]}, r"starts: expected shape \(B, 7\), got \(7,\)"),
        ({"starts": np.empty((0, 7))}, r"starts: expected shape \(B, 7\), got \(0, 7\)"),
        ({"starts": [[0, 0, -1]]}, r"starts: expected shape \(..., 7\), got \(1, 3\)"),
        ({"starts": [[0, 0, NAN, 0, 0, 0, 1]]}, "every number must be finite"),
        ({"starts": [[0, 0, -1, 0, 0, 0, 2]]}, "quaternion of 'body' must have length 1"),
        ({"starts": [GOAL.q, BEHIND]}, "starts: row 1 has a mark that is not in front"),
        ({"starts": {"arm": [[0.0]]}}, "no robot 'arm' in the scene"),
        ({"starts": "anywhere"}, "starts: expected numbers"),
        ({"count": 0}, "count must be a whole number from 1 on, got 0"),
        ({"count": 2.5}, "count must be a whole number from 1 on, got 2.5"),
        ({"count": 10**30}, "count must be below 1000001, got 1000"),
        ({"seed": -1}, "seed must be a whole number from 0 on, got -1"),
        ({"distance": (1.0, 0.5)}, r"distance: expected \(nearest, farthest\) above 0"),
        ({"distance": (0.0, 1.0)}, r"distance: expected \(nearest, farthest\) above 0"),
        ({"distance": 1.0}, r"distance: expected shape \(..., 2\)"),
        ({"cone": -0.1}, "cone: expected a half angle from 0 to pi radians, got -0.1"),
        ({"cone": 45}, "cone: expected a half angle from 0 to pi radians, got 45"),
        ({"dt": 0}, "dt .seconds. must be a positive number, got 0"),
        ({"duration": -1.0}, "duration .seconds. must be a positive number, got -1"),
        ({"dt": 2.0, "duration": 1.0}, "dt 2 s is longer than the duration 1 s"),
        ({"dt": 1e-9, "duration": 100.0}, "at most 10 million are simulated"),
    ],
    ids=str,
)
def test_settings_of_no_use(free_scene, given, says):
    with pytest.raises(rs.errors.InputError, match=says):
        rs.equilibria(free_scene(SQUARE), rs.IBVS(goal=GOAL), **given)


@pytest.mark.parametrize(
    ("task", "says"),
    [
        (rs.IBVS(goal=GOAL, interaction=rs.laws.Broyden()), r"interaction=Broyden\(...\)"),
        (rs.IBVS(goal=GOAL, depth=rs.laws.DepthFilter(0.5)), r"depth=DepthFilter\(...\)"),
        (rs.IBVS(goal=GOAL, feed_forward="estimated"), r"feed_forward=EstimatedMotion\(...\)"),
        (rs.IBVS(goal=GOAL, smooth_start=4.0), "smooth_start=4"),
        (
            rs.Switch(rs.PBVS(goal=GOAL), rs.IBVS(goal=GOAL), rs.tasks.ErrorBelow(0.1)),
            "Switch with latch=True",
        ),
        (
            rs.Priorities([rs.IBVS(goal=GOAL), rs.IBVS(goal=GOAL, depth=rs.laws.DepthFilter(0.5))]),
            r"depth=DepthFilter\(...\)",
        ),
        (rs.IBVS(goal=GOAL, law=Habit()), "the law of this task stores 'last'"),
    ],
    ids=lambda part: part if isinstance(part, str) else type(part).__name__,
)
def test_a_task_with_memory_is_refused_by_the_name_of_its_part(free_scene, task, says):
    with pytest.raises(rs.errors.InputError, match=f"equilibria: .*{says}"):
        rs.equilibria(free_scene(SQUARE), task)


def test_a_scene_that_moves_on_its_own_is_refused():
    scenario = rs.load_scenario(rs.examples.path("watching_head"))
    with pytest.raises(rs.errors.InputError, match="robot 'turntable' moves on its own"):
        rs.equilibria(scenario.scene, scenario.task)


def test_an_invalid_scene_or_task_is_refused(free_scene):
    with pytest.raises(rs.errors.InputError, match="scene: expected a Scene, got 3"):
        rs.equilibria(3, rs.IBVS())
    with pytest.raises(rs.errors.InputError, match="task: expected a task such as IBVS"):
        rs.equilibria(free_scene(SQUARE), "ibvs")


def test_a_goal_out_of_the_image_is_the_error_of_a_run(free_scene):
    scene = free_scene(SQUARE, size=(2, 2))
    with pytest.raises(rs.errors.GoalError, match="the shown goal puts mark"):
        rs.equilibria(scene, rs.IBVS(goal=rs.Pose.at(3, 0, -0.5)))


def test_starts_that_can_hardly_be_drawn():
    """A tip that is to see a dot which stands beside it, whatever the joint does."""
    arm = rs.Robot.from_dh([[0, 0, 0, 0]], limits=[[-0.1, 0.1]], name="arm")
    eye = rs.MountedCamera("eye", rs.Camera(np.eye(3)), on="arm.link1", pose=rs.Pose.at(0, 0, 1))
    task = rs.IBVS(goal=rs.GoalFeatures([0.0, 0.0]))
    scene = rs.Scene([arm], [rs.Object("dot", marks=[[0.1, 0, 0.5]])], [eye])
    with pytest.raises(
        rs.errors.InputError, match="starts: only 0 of 20000 random starts have all"
    ):
        rs.equilibria(scene, task)


NOWHERE = rs.IBVS(
    goal=rs.GoalFeatures([0.2, 0.0, 0.1, 0.3, -0.1, 0.2, 0.3, 0.1])
)  # no view gives these


def test_numbers_as_a_goal_with_the_camera_at_home_among_the_marks(free_scene):
    with pytest.raises(
        rs.errors.InputError, match="home is in the middle of the marks; give starts"
    ):
        rs.equilibria(free_scene(SQUARE), NOWHERE, count=20)


@pytest.mark.parametrize(
    ("gain", "distance"), [(1.0, (1e300, 1e300)), (1e300, (0.6, 1.4)), (1e-100, (0.6, 1.4))]
)
def test_numbers_without_sense_are_no_warnings_of_ours(free_scene, gain, distance):
    task = rs.IBVS(goal=GOAL, gain=gain)
    found = rs.equilibria(free_scene(SQUARE), task, count=4, distance=distance)
    assert found[0].kind == "goal"


def test_an_equilibrium_without_error_may_not_be_found(free_scene):
    found = rs.equilibria(free_scene(SQUARE + np.array([0, 0, 0.5])), NOWHERE, count=20)
    with pytest.raises(
        rs.errors.InputError, match="the search found no equilibrium with zero error"
    ):
        _ = found.goal
