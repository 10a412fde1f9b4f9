"""At the goal nothing moves, whatever the scheme; free directions may move, without any effect."""

import numpy as np
import pytest

import robsim as rs

P = rs.features.FeatureBlock
quiet = pytest.mark.filterwarnings("ignore::robsim.errors.RankWarning")
SINGLE = {
    **{
        name: rs.IBVS(features=name)
        for name in (
            *("points", "pixels", "polar", "spherical", "log_depth", "points_3d", "segments"),
            *("lines", "region_moments", "point_moments", "decoupled_moments", "sphere"),
        )
    },
    "desired": rs.IBVS(interaction="desired"),
    "mean": rs.IBVS(interaction="mean", law="camera"),
    "centimetre": rs.IBVS(law=rs.laws.CameraLaw(0.01)),
    "damped": rs.IBVS(inverse="damped"),
    "transpose": rs.IBVS(inverse="transpose"),
    "broyden": rs.IBVS(interaction="broyden"),
    "depth filter": rs.IBVS(depth=rs.laws.DepthFilter(0.6)),
    "adaptive": rs.IBVS(gain=rs.laws.AdaptiveGain(4, 0.5, 10)),
    "limited": rs.IBVS(limit=rs.laws.SpeedLimit(joint=0.1)),
    "pbvs": rs.PBVS(),
    "pbvs of the camera": rs.PBVS(form="camera", law="camera"),
    "hybrid": rs.Hybrid(),
    "partitioned": rs.Partitioned(),
    "stacked": rs.IBVS(features=[P("points"), P("theta_u", weight=0.5)]),
    "priorities": rs.Priorities([rs.IBVS(features=[P("points", marks=[0])]), rs.PBVS()]),
    "switch": rs.Switch(rs.PBVS(), rs.IBVS(), rs.tasks.ErrorBelow(0.1)),
}
STEREO = {
    "both": rs.IBVS(features=[P("points", camera=name) for name in ("left", "right")]),
    "triangulated": rs.IBVS(features=[P("stereo_points", camera=("left", "right"))]),
    "placing": rs.Placing(camera=["left", "right"]),
    "placing as printed": rs.Placing(camera=["left", "right"], variant="printed"),
    "completed": rs.Placing(camera=["left", "right"], variant="completed"),
}


def rests(scene, task, q):
    """Ten periods from the goal on: the command stays below 1e-12."""
    over = rs.simulate(scene, task, q)
    assert rs.Outcome(int(over.outcome)) is rs.Outcome.CONVERGED and float(over.end_time) == 0.0
    held = rs.simulate(scene, task, q, dt=0.04, duration=0.4, hold=True)
    assert float(np.abs(held.error).max()) < 1e-13
    assert float(np.abs(held.qd).max()) < 1e-12


@pytest.mark.covering(1)
@quiet
@pytest.mark.parametrize("name", ["free", "eye_in_hand", "eye_to_hand", "face_to_face"])
@pytest.mark.parametrize("scheme", SINGLE)
def test_no_error_no_command(arrange, scheme, name):
    scene = arrange(name)
    rests(scene, SINGLE[scheme], scene.home)


@quiet
@pytest.mark.parametrize("name", ["head", "holonomic", "unicycle", "mobile_arm", "face_to_face"])
@pytest.mark.parametrize("task", [rs.IBVS, rs.PBVS, rs.Hybrid])
def test_no_error_no_command_on_heads_and_bases(arrange, around, task, name):
    """Home is a round pose; the pose that shows this goal is not."""
    scene = arrange(name)
    goal = around(scene, 1, spread=0.02, seed=2)[0]
    rests(scene, task(goal=goal), goal)


@pytest.mark.parametrize("scheme", STEREO)
def test_no_error_no_command_for_two_cameras(arrange, scheme):
    scene = arrange("stereo_beside")
    rests(scene, STEREO[scheme], scene.home)


def test_a_docked_unicycle_stays(arrange):
    rests(arrange("unicycle"), rs.Docking(), arrange("unicycle").home)


def test_tasks_side_by_side_rest_together(arrange):
    scene = arrange("head_and_arm")
    watch = rs.IBVS(camera="watch", target="dish")
    rests(scene, rs.Parallel([watch, rs.PBVS(camera="camera", target="plate")]), scene.home)


FREE = {"eye_in_hand": 1, "mobile_arm": 3, "face_to_face": 6}  # motions beyond six


class Wander:
    """A secondary task that has nothing to do with the task."""

    def velocity(self, q, limits):
        return 0.3 * np.cos(np.arange(q.shape[1]) + 3 * q)


def times(A, x):
    return np.einsum("knb,nb->kb", A, x)


@pytest.mark.parametrize("name", FREE)
@pytest.mark.parametrize("task", [rs.IBVS, rs.PBVS, rs.Hybrid])
def test_a_secondary_motion_shows_nowhere(arrange, around, decide, task, name):
    """L J qd = 0 at the goal; away from it, L J qd is the same as without."""
    scene = arrange(name)
    at_goal = decide(scene, task(secondary=Wander()), scene.home).command
    assert np.abs(at_goal.qd).max() > 1e-2
    assert np.abs(times(at_goal.task_jacobian, at_goal.qd)).max() < 1e-10
    q = around(scene, 5)
    one, other = (decide(scene, task(secondary=w), q).command for w in (Wander(), None))
    moved = one.qd - other.qd
    assert np.abs(moved).max() > 1e-2
    assert np.abs(times(one.task_jacobian, moved)).max() < 1e-10


@quiet
@pytest.mark.parametrize("features", ["theta_u", "translation", P("points", marks=[1])])
@pytest.mark.parametrize("name", ["free", "eye_in_hand", "eye_to_hand", "holonomic"])
def test_a_secondary_motion_has_all_that_the_features_leave(
    arrange, around, decide, name, features
):
    """qd = -gain A^+ e + (I - A^+ A) z with A = L J, not J: features fewer than the joints."""
    scene, q = arrange(name), around(arrange(name), 4)
    wish = np.array([0.1, -0.2, 0.15, 0.05, -0.1, 0.2, 0.1])[: scene.nv]

    class Wish:
        def velocity(self, q, limits):
            return np.tile(wish, (len(q), 1))

    command = decide(scene, rs.IBVS(features=[features], secondary=Wish()), q).command
    for b in range(4):
        A = command.task_jacobian[..., b]
        inverse = np.linalg.pinv(A, rcond=1e-6)
        expected = -inverse @ command.error[:, b] + wish - inverse @ A @ wish
        np.testing.assert_allclose(command.qd[:, b], expected, atol=1e-11)


@pytest.mark.parametrize("name", FREE)
def test_a_secondary_motion_leaves_the_image_alone_for_good(arrange, name):
    """Held for a second at 1 ms, the error is of first order in the period and halves with it."""
    scene, ends = arrange(name), []
    for dt in (2e-3, 1e-3):
        task = rs.IBVS(secondary=Wander(), gain=2.0)
        run = rs.simulate(scene, task, scene.home, dt=dt, duration=0.5, hold=True)
        assert np.abs(run.q.values[-1] - scene.home).max() > 1e-2
        ends.append(float(run.error_norm[-1]))
    assert ends[0] < 1e-3
    assert ends[0] / ends[1] == pytest.approx(2.0, abs=0.2)


@pytest.mark.parametrize("name", ["eye_in_hand", "eye_to_hand", "mobile_arm"])
def test_the_large_projection_keeps_the_rate_of_the_norm(arrange, around, decide, name):
    """d||e||^2/dt = 2 e' L J qd, far from the goal; the components of e are disturbed."""
    scene, q = arrange(name), around(arrange(name), 5, spread=0.1)
    kinds = {"secondary": Wander(), "projection": rs.laws.LargeProjection(low=1e-3, high=0.03)}
    one, other = (decide(scene, rs.IBVS(**what), q).command for what in (kinds, {}))
    assert (np.linalg.norm(one.error, axis=0) > 0.03).all()
    moved = times(one.task_jacobian, one.qd - other.qd)
    assert np.abs(moved).max() > 1e-3
    assert np.abs((one.error * moved).sum(0)).max() < 1e-10


def test_the_large_projection_is_the_classic_one_near_the_goal(arrange, around, decide):
    scene, q = arrange("eye_in_hand"), around(arrange("eye_in_hand"), 5, spread=1e-4)
    kinds = ("large", "classic")
    one, other = (
        decide(scene, rs.IBVS(secondary=Wander(), projection=kind), q).command for kind in kinds
    )
    np.testing.assert_allclose(one.qd, other.qd, rtol=0, atol=1e-15)  # by a projector, by a basis
