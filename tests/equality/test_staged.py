"""Built-in kinds run as compiled stages, with the bits of the same kind evaluated in Python."""

import numpy as np
import pytest

import robsim as rs
from robsim.engine.loop import Loop
from robsim.servo.laws.partitioned_law import PartitionedLaw
from robsim.trajectory import Blends, Path, Quintic, Straight, Trapezoid

PLATE = np.array([[-0.05, -0.06, 0], [0.06, -0.05, 0], [0.05, 0.04, 0], [-0.06, 0.06, 0]])
START = np.array([0.2, 1.1, -3.0, 0.3, -0.4, 0.2])
STARTS = START + np.random.default_rng(3).uniform(-0.05, 0.05, (9, 6))
ADAPTIVE = rs.laws.AdaptiveGain(4.0, 1.0, 20.0)
ONE = rs.features.FeatureBlock("points", marks=[0])
LIMITS = {"speed": 0.3, "acceleration": 1.0}


@pytest.fixture(scope="module")
def scene():
    """A Puma 560 that carries four marks in front of a camera."""
    arm, at = rs.robots.puma560(), rs.Pose.at(0, 0, 0.08)
    plate = rs.Object("plate", marks=PLATE, on="puma560.flange", pose=at)
    seen = rs.Pose(arm.fk(START)) @ at @ rs.Pose.at(0.02, 0.03, -0.6, rpy=(0.1, -0.1, 0.2))
    eye = rs.Camera([[500, 0, 400], [0, 500, 400], [0, 0, 1]], size=(800, 800))
    scene = rs.Scene([arm], [plate], [rs.MountedCamera("eye", eye, pose=seen)])
    return scene


def there(scene):
    return rs.Pose(scene.pose("puma560.flange", START).matrix) @ rs.Pose.at(0.05, 0, 0.1)


def motion(scene, task, **told):
    run = rs.simulate(scene, task, STARTS, duration=2.0, hold=True, chunk=4, **told)
    return run.q.values


GOAL = {"goal": START + np.array([0.1, -0.05, 0.05, 0.1, 0.1, 0.2])}
TASKS = {
    "camera law": lambda scene: rs.IBVS(**GOAL, law="camera", gain=ADAPTIVE),
    "partitioned": lambda scene: rs.Partitioned(**GOAL, advance=0.5),
    "switch": lambda scene: rs.Switch(rs.PBVS(**GOAL), rs.IBVS(**GOAL), rs.tasks.ErrorBelow(0.1)),
    "border": lambda scene: rs.Switch(
        rs.PBVS(**GOAL), rs.IBVS(**GOAL), rs.tasks.NearBorder(50, (800, 800)), latch=False
    ),
    "priorities": lambda scene: rs.Priorities(
        [rs.IBVS(**GOAL, features=ONE), rs.PBVS(**GOAL)], secondary=rs.laws.AvoidLimits()
    ),
    "parallel": lambda scene: rs.Parallel(
        [
            rs.FollowJoints({"shoulder": 0.4}, **LIMITS),
            rs.FollowJoints({"forearm": 0.4}, duration=1),
        ]
    ),
    "by": lambda scene: rs.FollowJoints(by={"shoulder": 0.1}, duration=1.0),
    "trajectory": lambda scene: rs.FollowJoints(trajectory=Quintic(START, START + 0.1, 1.0)),
    "path": lambda scene: rs.FollowPath(
        there(scene), duration=1.0, limit=rs.laws.SpeedLimit(joint=1)
    ),
    "position": lambda scene: rs.FollowPath(there(scene).position, mask="position", **LIMITS),
}


@pytest.mark.parametrize("name", TASKS)
def test_every_stage_is_compiled(scene, name):
    loop = Loop(TASKS[name](scene).bind(scene), STARTS, 0.04, 3)
    assert loop.sequence.compiled


@pytest.mark.parametrize("name", ["unicycle_docking", "chapter_6_2"])
def test_laws_of_their_own_tasks_are_compiled(name):
    loop = rs.load_scenario(rs.examples.path(name)).loop()
    assert not isinstance(loop.controller.law, rs.laws.JointLaw) and loop.sequence.compiled


class Asked:
    """A user's law that calls a built-in one."""

    in_camera = True

    def __init__(self, law):
        self.law = law

    def command(self, state):
        return self.law.command(state)


@pytest.mark.parametrize("inverse", ["pseudo_inverse", "damped", "transpose"])
@pytest.mark.parametrize("law", [rs.laws.JointLaw(), rs.laws.CameraLaw(0.01)], ids=repr)
@pytest.mark.parametrize("gain", [2.0, ADAPTIVE], ids=["constant", "adaptive"])
def test_a_law_commands_the_results_of_its_stages(scene, law, inverse, gain):
    ours, asked = (
        motion(scene, rs.IBVS(**GOAL, law=each, inverse=inverse, gain=gain))
        for each in (law, Asked(law))
    )
    np.testing.assert_array_equal(ours, asked)


@pytest.mark.parametrize("of", ["error", "command"])
def test_the_partitioned_law_commands_the_results_of_its_stages(scene, of):
    gain = rs.laws.AdaptiveGain(4.0, 1.0, 20.0, of)

    class Python(rs.Partitioned):
        law = property(lambda self: Asked(PartitionedLaw(self.roll, self.advance, self.length)))

    task, other = (kind(**GOAL, advance=0.5, gain=gain) for kind in (rs.Partitioned, Python))
    np.testing.assert_array_equal(motion(scene, task), motion(scene, other))


class When:
    """A user's condition that calls a built-in one."""

    def __init__(self, condition):
        self.condition = condition

    def holds(self, first, second):
        return self.condition.holds(first, second)


CONDITIONS = [
    rs.tasks.ErrorBelow(0.1),
    rs.tasks.ErrorBelow(0.02, "second"),
    rs.tasks.NearBorder(330, (800, 800)),
]


@pytest.mark.parametrize("when", CONDITIONS, ids=repr)
@pytest.mark.parametrize("latch", [True, False])
def test_a_condition_holds_if_its_stages_compute_so(scene, when, latch):
    schemes = rs.PBVS(**GOAL), rs.IBVS(**GOAL, gain=3.0)
    ours, asked, never = (
        motion(scene, rs.Switch(*schemes, each, latch=latch))
        for each in (when, When(when), rs.tasks.ErrorBelow(1e-300))
    )
    np.testing.assert_array_equal(ours, asked)
    assert (ours != never).any()


class Own:
    """A trajectory of a user's, which is one of ours."""

    def __init__(self, way):
        self.way, self.duration = way, way.duration

    def at(self, t):
        return self.way.at(t)


def test_a_trajectory_agrees_with_its_table(scene):
    points = [START, START + 0.1, START - [0.1, 0, 0, 0, 0, 0]]
    for way in (Quintic(START, START + 0.1, 1.3), Blends(points, **LIMITS)):
        for gain in (None, 2.0):
            ours, asked = (
                motion(scene, rs.FollowJoints(trajectory=each, gain=gain))
                for each in (way, Own(way))
            )
            np.testing.assert_array_equal(ours, asked)


def test_a_path_agrees_with_its_table(scene):
    start, end = rs.Pose(scene.pose("puma560.flange", START).matrix), there(scene)
    for way in (
        Straight(start, end, 1.3),
        Path([Straight(start, end, 1), Straight(end, start, 1)]),
    ):
        ours, asked = (motion(scene, rs.FollowPath(path=each)) for each in (way, Own(way)))
        np.testing.assert_array_equal(ours, asked)


def test_a_trajectory_of_years_has_no_table(scene):
    """Of 40 ms each it would be of billions of rows."""
    way = Quintic(START, START + 0.1, 1e9)
    ours, asked = (motion(scene, rs.FollowJoints(trajectory=each)) for each in (way, Own(way)))
    np.testing.assert_array_equal(ours, asked)


@pytest.mark.parametrize("told", [{"duration": 1.3}, LIMITS], ids=["duration", "limits"])
def test_joints_are_planned_as_the_same_motion_that_is_given(scene, told):
    run = rs.simulate(scene, rs.FollowJoints(START + 0.1, **told), START, duration=2.0)
    made = Quintic if "duration" in told else Trapezoid
    way = made(START, START + 0.1, **told)
    again = rs.simulate(scene, rs.FollowJoints(trajectory=way), START, duration=2.0)
    np.testing.assert_array_equal(run.q, again.q)
