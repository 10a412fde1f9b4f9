"""The results that a user's own classes may return, and the errors for any other result."""

import numpy as np
import pytest

import robsim as rs
from robsim.testing import check_law

SCENARIO = rs.load_scenario(rs.examples.path("eye_in_hand"))
SCENE, START = SCENARIO.scene, SCENARIO.start
EYES = "wide", "narrow"
UNIT = rs.Camera(np.eye(3))


def run(task, q0=START, **how):
    return rs.simulate(SCENE, task, q0, **{"duration": 0.2} | how)


class When:
    def __init__(self, value):
        self.value = value

    def holds(self, first, second):
        return self.value


@pytest.mark.parametrize(
    "value", [None, True, "yes", [1], [np.nan], ["yes"], [[True], [True, False]]]
)
def test_a_condition_gives_a_truth_value_for_each_run(value):
    task = rs.Switch(rs.PBVS(), rs.IBVS(), when=When(value))
    with pytest.raises(
        rs.errors.InputError, match=r"When.holds: expected truth values of shape \(1,\)"
    ):
        run(task)


@pytest.mark.parametrize("value", [[True], np.array([False])])
def test_and_a_list_of_them_will_do(value):
    first, second = rs.PBVS(gain=0.5), rs.IBVS()
    chosen = second if value[0] else first
    switched = run(rs.Switch(first, second, when=When(value)))
    np.testing.assert_array_equal(switched.qd, run(chosen).qd)


def test_a_wrong_result_of_a_law_is_not_blamed_on_the_file():
    class Short:
        def command(self, state):
            return [1.0]

    assert SCENARIO.source
    with pytest.raises(rs.errors.CodeError) as error:
        SCENARIO.with_(task=rs.IBVS(law=Short())).run()
    message = "Short.command returned shape (1,) where (1, 7) is needed; see robsim.testing"
    assert str(error.value) == message


def test_the_limits_that_a_secondary_motion_is_shown_are_not_its_own():
    class Greedy:
        def velocity(self, q, limits):
            limits[...] = 0.0
            return np.zeros(q.shape)

    with pytest.raises(ValueError, match="read-only"):
        run(rs.IBVS(secondary=Greedy()))


@pytest.mark.filterwarnings("ignore::robsim.errors.RankWarning")
def test_the_transpose_needs_a_jacobian_at_the_goal():
    plate = SCENE.object()
    beyond = rs.Object("plate", marks=plate.marks, pose=rs.Pose.at(0, 0, 5))  # behind, at home
    with pytest.raises(rs.errors.InputError, match="given as numbers, at home"):
        rs.IBVS(goal=rs.GoalFeatures(np.zeros(8)), inverse="transpose").bind(
            SCENE.replacing(beyond)
        )


def test_a_law_may_be_checked_that_reads_features_and_coordinates():
    class Reader:
        def command(self, state):
            assert state.s.shape == (len(state.q), 8) and state.q.shape[1] == 6
            return rs.laws.JointLaw().command(state)

    assert check_law(Reader()) == []


def test_an_observation_without_a_model_has_no_pose():
    seen = rs.features.Observation.of(np.zeros((3, 2)), np.ones(3), rs.Camera(np.eye(3)))
    with pytest.raises(rs.errors.InputError, match="a pose needs the model of the target"):
        seen.pose  # noqa: B018
    with pytest.raises(rs.errors.InputError, match="needs the image of a second camera"):
        rs.features.StereoPoints().measure(seen)


def test_a_class_is_no_secondary_motion():
    with pytest.raises(
        rs.errors.InputError,
        match="secondary: expected a secondary motion, not the class, got <class",
    ):
        rs.IBVS(secondary=rs.laws.AvoidLimits)


def test_numbers_are_kept_as_floats():
    """The kernels are compiled for them."""
    law = rs.laws.PartitionedLaw(1, 2, 3)
    large = rs.laws.LargeProjection(1, 2)
    kept = (
        law.roll,
        law.advance,
        law.length,
        large.low,
        large.high,
        rs.laws.DampedInverse(1).damping,
    )
    assert [type(each) for each in kept] == [float] * 6


@pytest.mark.parametrize(
    "what", [{"feed_forward": "known"}, {"inverse": "damped"}, {"interaction": "broyden"}], ids=str
)
@pytest.mark.parametrize("name", ["Partitioned", "Placing", "Docking"])
def test_a_law_of_its_own_passes_over_nothing_in_silence(name, what):
    (key,) = what
    with pytest.raises((TypeError, rs.errors.InputError), match=key):
        getattr(rs, name)(**what)


def two_eyes(size):
    """A body that flies with two cameras; the second has an image of this size."""
    marks = [[0, 0, 1], [0.1, 0, 1], [0, 0.1, 1], [0.1, 0.1, 1]]
    plate = rs.Object("plate", marks=marks, pose=rs.Pose.at(0.03, 0.02, 0))
    K = [[500, 0, 100], [0, 500, 100], [0, 0, 1]]
    eyes = [
        rs.MountedCamera("wide", rs.Camera(K), on="free_camera.body"),
        rs.MountedCamera("narrow", rs.Camera(K, size=size), on="free_camera.body"),
    ]
    return rs.Scene([rs.robots.free_camera()], [plate], eyes)


@pytest.mark.parametrize("marks", [None, (0, 1, 2)], ids=["all marks", "without the last"])
def test_a_mark_that_any_camera_loses_ends_the_run(marks):
    """The last mark is in row 160 at home and in row 170 at the start."""
    task = rs.IBVS(
        features=[rs.features.FeatureBlock("points", camera=name, marks=marks) for name in EYES]
    )
    q0 = rs.Pose.at(0.02, -0.02, 0)
    for size, ending in (((400, 165), "OUT_OF_IMAGE"), ((400, 400), "CONVERGED")):
        run = rs.simulate(two_eyes(size), task, q0, duration=20)
        assert rs.Outcome(int(run.outcome)).name == ending


def test_with_a_constant_interaction_matrix_a_feature_is_measured_once_an_instant():
    class Counted:
        unit, tolerance, calls = "1", 1e-5, 0

        def measure(self, seen):
            Counted.calls += 1
            return rs.features.Points().measure(seen)

    corners = np.array([[-1, -1], [1, -1], [1, 2], [-1, 1]]) / 10
    L = rs.features.Points().interaction(rs.features.Observation.of(corners, np.ones(4), UNIT))[0]
    task = rs.IBVS(features=Counted(), interaction=L)
    task.bind(SCENE)
    before, Counted.calls = Counted.calls, 0
    run(task, dt=0.04)
    assert Counted.calls == before + 6


# mistakes of new users


LINE = [[0, 0, 0], [0, 0, 0.02], [0, 0, 0.05]]


@pytest.mark.parametrize(
    ("task", "words"),
    [
        (rs.IBVS(features="decoupled_moments"), "must not look the same after a turn"),
        (rs.IBVS(features="vanishing_point"), "edges that are parallel in the image"),
    ],
)
def test_a_task_that_cannot_be_is_refused_with_its_reason(task, words):
    square = [[-0.1, -0.1, 0], [0.1, -0.1, 0], [0.1, 0.1, 0], [-0.1, 0.1, 0]]
    eye = rs.MountedCamera("eye", rs.Camera(np.eye(3)), on="free_camera.body")
    plate = rs.Object("plate", marks=square, pose=rs.Pose.at(0, 0, 1))
    scene = rs.Scene(rs.robots.free_camera(), plate, eye)
    with pytest.raises(rs.errors.InputError, match=words):
        rs.simulate(scene, task, rs.Pose.at(0, 0, -0.1).q)


def test_three_marks_on_a_line_cannot_be_placed():
    section = rs.load_scenario(rs.examples.path("chapter_6_2"))
    cube = section.scene.object("cube")
    bar = section.scene.replacing(rs.Object("cube", marks=LINE, pose=cube.pose, on=cube.on))
    with pytest.raises(rs.errors.InputError, match="three marks that are not on one line"):
        rs.simulate(bar, section.task, section.start)


def test_one_task_of_a_list_is_changed_by_its_number():
    path = rs.examples.path("mobile_arm")
    assert rs.load_scenario(path, ["task.tasks.1.gain=0.5"]).task.tasks[1].gain == 0.5
    with pytest.raises(
        rs.errors.FileError, match=r"tasks\.2: there is none; they are numbered 0 to 1"
    ):
        rs.load_scenario(path, ["task.tasks.2.gain=0.5"])


def test_another_kind_of_task_drops_the_length_of_another_law():
    path = rs.examples.path("chapter_6_2")
    changes = {"task.kind": "ibvs", "task.camera": "left"}
    assert isinstance(rs.load_scenario(path, changes).task, rs.IBVS)


def test_feed_forward_can_be_switched_off():
    path = rs.examples.path("watching_head")
    assert rs.load_scenario(path, ["task.feed_forward=none"]).task.feed_forward is None


def test_one_rotation_is_enough():
    with pytest.raises(rs.errors.InputError, match="give one rotation only"):
        rs.Pose.at(0, 0, 0, rpy=(0, 0, 1), rotvec=(0, 0, 1))


def test_another_kind_of_task_keeps_the_length_of_its_law():
    path = rs.examples.path("chapter_6_1")
    assert rs.load_scenario(path, {"task.kind": "pbvs"}).task.law == rs.laws.CameraLaw(0.01)


def test_none_is_no_number():
    with pytest.raises(rs.errors.InputError, match=r"depth: expected a depth, got None"):
        rs.IBVS(depth=None)
