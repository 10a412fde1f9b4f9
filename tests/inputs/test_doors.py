"""Public values and calls refuse wrong input before any of it reaches compiled code."""

import numpy as np
import pytest

import robsim as rs
from robsim.testing import check_feature, check_joint, check_law

UNIT = rs.Camera(np.eye(3))
SCENARIO = rs.load_scenario(rs.examples.path("visp_tutorial"))
SCENE, GOAL = SCENARIO.scene, SCENARIO.task.goal
ARM = rs.robots.planar_2r()
SQUARE = [[-0.1, -0.1], [0.1, -0.1], [0.1, 0.1], [-0.1, 0.1]]
SEEN = rs.features.Observation.of(SQUARE, np.ones(4), UNIT)


@pytest.mark.parametrize(
    "pixels,depth",
    [
        (np.ones((1, 0, 2)), np.ones((1, 0))),
        (np.ones((0, 4, 2)), np.ones((0, 4))),
        (np.ones((4, 2)), np.ones(3)),
        (np.ones((4, 2, 3)), np.ones((4, 3))),
        (np.ones((2, 4, 2)), np.ones((3, 4))),
        (np.ones((2, 2, 4, 2)), np.ones((2, 2, 4))),
        (np.full((4, 2), np.inf), np.ones(4)),
        ("pixels", np.ones(4)),
        (None, np.ones(4)),
        ([[10**400, 0.0]], [1.0]),
        ([[10**5000, 0.0]], [1.0]),
    ],
)
def test_an_observation_is_of_as_many_depths_as_marks(pixels, depth):
    with pytest.raises(rs.errors.InputError, match=r"pixels"):
        rs.features.Observation.of(pixels, depth, UNIT)


def test_an_observation_of_a_batch_equals_the_observations_of_its_runs():
    both = rs.features.Observation.of([SQUARE, np.multiply(2.0, SQUARE)], np.ones((2, 4)), UNIT)
    np.testing.assert_array_equal(
        rs.features.Points().measure(both)[0], rs.features.Points().measure(SEEN)[0]
    )
    np.testing.assert_array_equal(rs.features.Points().measure(both)[1], 2.0 * np.ravel(SQUARE))


@pytest.mark.parametrize(
    "changes",
    [
        {"depth_last": np.ones((3, 1))},
        {"points_last": np.ones((4, 2, 2))},
        {"pixels_last": np.ones((4, 1, 2))},
        {"model": np.ones((3, 3))},
        {"guess_last": np.ones((3, 4, 2))},
        {"camera": "eye"},
        {"other": SEEN},
    ],
    ids=str,
)
def test_arrays_in_the_layout_of_the_kernels_are_of_one_size(changes):
    names = ("pixels_last", "points_last", "depth_last", "camera")
    with pytest.raises(rs.errors.InputError):
        rs.features.Observation(**{name: getattr(SEEN, name) for name in names} | changes)


def test_a_pair_of_cameras_sees_as_many_marks():
    other = rs.features.Observation.of(SQUARE[:3], np.ones(3), UNIT)
    with pytest.raises(rs.errors.InputError, match="pixels_last of the other: expected shape"):
        rs.features.Observation.of(SQUARE, np.ones(4), UNIT, other=other, between=rs.Pose.at(0.1))


def test_a_feature_requires_an_observation_of_enough_marks():
    with pytest.raises(rs.errors.InputError, match="Ellipse needs at least 5 marks, got 4"):
        rs.features.Ellipse().measure(SEEN)
    with pytest.raises(rs.errors.InputError, match="Points: expected an Observation, got array"):
        rs.features.Points().measure(np.ones((4, 2)))
    for feature in (
        rs.features.LogDepth(),
        rs.features.ThetaU(),
        rs.features.RegionMoments(),
        rs.features.Polar(),
    ):
        with pytest.raises(rs.errors.InputError, match="expected an Observation, got None"):
            feature.towards(None)


@pytest.mark.parametrize(
    "kind", [rs.features.LogDepth, rs.features.Polar, rs.features.Lines, rs.features.Segments]
)
def test_at_the_goal_as_many_marks_are_seen_as_later(kind):
    bound = kind().towards(SEEN)
    fewer = rs.features.Observation.of(SQUARE[:2], np.ones(2), UNIT)
    with pytest.raises(rs.errors.InputError, match="the goal has another number"):
        bound.measure(fewer)


def test_goals_of_several_runs_are_of_as_many_as_are_seen():
    bound = rs.features.LogDepth().towards(
        rs.features.Observation.of([SQUARE] * 3, np.ones((3, 4)), UNIT)
    )
    two = rs.features.Observation.of([SQUARE] * 2, np.ones((2, 4)), UNIT)
    with pytest.raises(rs.errors.InputError, match="the goal has 3 runs, the observation 2"):
        bound.measure(two)


def arrays(k=8, n=6, B=2):
    rng = np.random.default_rng(0)
    return {
        "error_last": rng.normal(size=(k, B)),
        "interaction_last": rng.normal(size=(k, 6, B)),
        "jacobian_last": rng.normal(size=(6, n, B)),
        "task_jacobian_last": rng.normal(size=(k, n, B)),
        "gain": 1.0,
        "inverse": rs.laws.PseudoInverse(),
    }


@pytest.mark.parametrize(
    "changes",
    [
        {"error_last": np.ones((7, 2))},
        {"interaction_last": np.ones((8, 5, 2))},
        {"jacobian_last": np.ones((6, 6, 3))},
        {"task_jacobian_last": np.ones((8, 5, 2))},
        {"error_last": np.full((8, 2), np.nan)},
        {"gain": [1.0, 2.0, 3.0]},
        {"gain": "high"},
        {"inverse": "pseudo_inverse"},
        {"s_last": np.ones((7, 2))},
        {"q_last": np.ones((6, 1))},
        {"memory": None},
        {"dt": [1.0, 2.0]},
    ],
    ids=str,
)
def test_a_state_of_control_is_of_one_size(changes):
    with pytest.raises(rs.errors.InputError):
        rs.laws.ControlState(**arrays() | changes)


def test_a_state_is_made_with_the_run_first():
    e, L, J = [1.0, -2.0], np.eye(2, 6), np.eye(6, 3)
    qd = rs.laws.JointLaw().command(rs.laws.ControlState.of(e, L, J, gain=0.5))
    np.testing.assert_allclose(qd, [[-0.5, 1.0, 0.0]], atol=1e-15)
    both = rs.laws.ControlState.of([e, e], [L, L], [J, J], gain=[0.5, 1.0])
    np.testing.assert_allclose(rs.laws.JointLaw().command(both), [qd[0], 2 * qd[0]], atol=1e-15)
    with pytest.raises(rs.errors.InputError, match=r"expected error \(B, k\)"):
        rs.laws.ControlState.of([1.0], L, J)


def test_the_partitioned_law_requires_its_own_features():
    with pytest.raises(rs.errors.InputError, match="needs the features s of at least one mark"):
        rs.laws.PartitionedLaw().command(rs.laws.ControlState(**arrays()))
    with pytest.raises(
        rs.errors.InputError, match="the law reads features s, which the state does not have"
    ):
        rs.laws.ControlState(**arrays()).s  # noqa: B018
    with pytest.raises(rs.errors.InputError, match="expected a ControlState, got 3"):
        rs.laws.JointLaw().command(3)


CALLS = {
    "swapped": lambda: SCENE.view("camera", SCENE.home),
    "frame": lambda: SCENE.pose(SCENE.home, "camera"),
    "on": lambda: ARM.at(rs.Pose.at(0), on=np.zeros(3)),
    "convention": lambda: rs.Robot.from_dh([[0, 0, 1, 0]], convention=np.ones(2)),
    "limits": lambda: rs.Robot.from_dh([[0, 0, 1, 0]], limits="é"),
    "dh": lambda: rs.Robot.from_dh([[0, 0, 10**400, 0]]),
    "shapes": lambda: rs.Robot.from_dh([[0, 0, 1, 0]], shapes=np.ones(2)),
    "joints": lambda: check_law(rs.laws.JointLaw(), joints=-1),
    "features": lambda: check_law(rs.laws.JointLaw(), features=10**400),
    "marks": lambda: check_feature(rs.features.Points(), marks=np.ones((0, 3))),
    "runs": lambda: check_joint(rs.joints.JointKind(), runs=-1),
    "seed": lambda: check_feature(rs.features.Points(), seed="é"),
    "dt": lambda: ARM.integrate([0, 0], [1, 1], [0.1, 0.2]),
    "t": lambda: rs.Controller(SCENARIO).step(np.ones((4, 2)), SCENE.home, np.ones(3)),
    "link": lambda: ARM.fk([0, 0], link=np.ones(2)),
    "tip": lambda: rs.Robot("arm", ARM.links, tip=np.ones(2)),
    "limits flag": lambda: ARM.coordinates([0, 0], limits=np.ones(2)),
    "example": lambda: rs.examples.path(np.ones(2)),
    "robot": lambda: rs.robots.load(np.ones(2)),
    "released": lambda: SCENE.released(np.ones(2)),
    "camera": lambda: SCENE.camera(10**5000),
    "at": lambda: SCENARIO.at(np.ones(2)),
    "size": lambda: rs.laws.AdaptiveGain(2, 1, 3).at("é"),
    "velocity": lambda: rs.laws.AvoidLimits().velocity(np.ones((1, 2)), np.ones(2)),
    "posture": lambda: rs.laws.Posture([0.0]).velocity([None], np.ones((1, 2))),
    "occlusion": lambda: rs.imperfections.Occlusion([0], 0.1, end=np.ones(3)),
}


@pytest.mark.parametrize("call", CALLS.values(), ids=CALLS)
def test_swapped_and_odd_arguments_get_our_words(call):
    try:
        problems = call()
    except rs.RobSimError:
        return
    assert isinstance(problems, list) and problems  # of `robsim.testing`


@pytest.mark.parametrize(
    "call",
    [
        lambda: rs.Pose.at(rotvec=(0, 1e308, 0)),
        lambda: rs.Pose.exp([0, 0, 0, 1e200, 0, 0]),
        lambda: rs.Pose.at(1e308) @ rs.Pose.at(1e308),
        lambda: ARM.integrate([1e308, 0], [1e308, 0], 1.0),
    ],
)
def test_what_overflows_is_told(call):
    with pytest.raises(rs.errors.InputError, match="too large"):
        call()


def test_a_focal_length_in_metres_is_refused():
    K = [[0.008, 0, 320], [0, 0.008, 240], [0, 0, 1]]
    with pytest.raises(rs.errors.InputError, match=r"0.008 pixels: is it in metres\?.* = 800 for"):
        rs.Camera(K, size=(640, 480))
    path = rs.examples.path("visp_tutorial")
    with pytest.raises(rs.errors.FileError, match=r"focal.*0.008 pixels: is it in metres\?"):
        rs.load_scenario(path, {"cameras.camera.focal": "[0.008, 0.008]"})
    assert rs.Camera(np.eye(3), size=(2, 2)).K[0, 0] == 1.0  # normalised coordinates
    assert rs.Camera(np.diag([0.5, 0.5, 1])).K[0, 0] == 0.5


@pytest.mark.parametrize(
    "features,least,below", [("pixels", 640.0, 600.0), ("points", 640 / 600, 1.0)]
)
def test_a_tolerance_above_the_image_is_refused(features, least, below):
    eye, goal = SCENE.camera(), SCENARIO.task.goal
    sized = rs.Camera([[600, 0, 320], [0, 600, 240], [0, 0, 1]], size=(640, 480))
    scene = SCENE.replacing(rs.MountedCamera(eye.name, sized, on=eye.on, pose=eye.pose))
    with pytest.raises(rs.errors.InputError, match="every start would have converged"):
        rs.IBVS(goal, features=features, tolerance=least).bind(scene)
    assert rs.IBVS(goal, features=features, tolerance=below).bind(scene).tolerance == below


class Takes:
    """A user's object that checks whether it can write to its arguments."""

    unit, tolerance, writeable = "1", 1e-5, ()

    def look(self, *given):
        parts = [x for one in given for x in (*getattr(one, "__dict__", {}).values(), one)]
        self.writeable = [x for x in parts if isinstance(x, np.ndarray) and x.flags.writeable]
        self.looked = any(isinstance(x, np.ndarray) for x in parts)

    def measure(self, seen):
        self.look(seen, seen.pixels, seen.points, seen.depth)
        return rs.features.Points().measure(seen)

    def command(self, state):
        self.look(state, state.error, state.interaction, state.jacobian, state.q, state.s)
        return rs.laws.JointLaw().command(state)

    def holds(self, first, second=None):
        self.look(first, *([] if second is None else [second]))
        return np.zeros(len(first.error), bool)

    def seen(self, pixels, exposure):
        self.look(pixels)
        return pixels

    def driven(self, wanted, drive):
        self.look(wanted, drive.q, drive.moved)
        return wanted

    def velocity(self, q, limits):
        self.look(q, limits)
        return np.zeros(q.shape)


@pytest.mark.parametrize(
    "how",
    [
        lambda own: {"task": rs.IBVS(GOAL, features=own)},
        lambda own: {"task": rs.IBVS(GOAL, law=own)},
        lambda own: {"task": rs.IBVS(GOAL, secondary=own)},
        lambda own: {"task": rs.Switch(rs.IBVS(GOAL), rs.PBVS(GOAL), own)},
        lambda own: {"endings": [own]},
        lambda own: {"sensing": rs.Sensing(effects=[own])},
        lambda own: {"actuation": rs.Actuation(effects=[own])},
    ],
    ids=["feature", "law", "secondary", "condition", "ending", "image_effect", "joint_effect"],
)
@pytest.mark.filterwarnings("ignore::robsim.errors.RankWarning")
def test_arrays_that_users_code_is_given_are_read_only(how):
    own = Takes()
    SCENARIO.with_(duration=0.2, **how(own)).run()
    assert own.looked and not own.writeable
