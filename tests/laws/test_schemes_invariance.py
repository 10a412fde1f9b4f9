"""No scheme depends on the place of the world, on the order of marks, or on which body moves."""

from dataclasses import replace

import numpy as np
import pytest

import robsim as rs

AWAY = rs.Pose.at(2.0, -1.5, 0.7, rpy=(0.4, -1.1, 2.0))
ORDER = [2, 0, 3, 1]
MARK_BY_MARK = {"points": 2, "pixels": 2, "polar": 2, "spherical": 3, "log_depth": 1}
MARK_BY_MARK |= {"points_3d": 3, "stereo_points": 3}
AS_A_WHOLE = ["point_moments", "theta_u", "translation"]
RAILS = [[-0.05, -0.06, 0], [-0.05, -0.06, 0.08], [0.06, 0.05, 0], [0.06, 0.05, 0.1]]
ANGLES = np.arange(7) * 2 * np.pi / 7
CIRCLE = 0.06 * np.stack([np.cos(ANGLES), 0.8 * np.sin(ANGLES), 0 * ANGLES], axis=1)
FEATURES = [
    *("points", "pixels", "polar", "spherical", "log_depth", "points_3d", "segments", "lines"),
    *("vanishing_point", "region_moments", "point_moments", "decoupled_moments", "ellipse"),
    *("sphere", "theta_u", "translation"),
]
quiet = pytest.mark.filterwarnings("ignore::robsim.errors.RankWarning")


THREE = [rs.IBVS(features=[rs.features.FeatureBlock("points", marks=[i])]) for i in range(3)]
SCHEMES = {
    "desired": rs.IBVS(interaction="desired"),
    "mean": rs.IBVS(interaction="mean"),
    "camera": rs.IBVS(law="camera", interaction="mean"),
    "centimetre": rs.IBVS(law=rs.laws.CameraLaw(0.01)),
    "damped": rs.IBVS(inverse="damped"),
    "transpose": rs.PBVS(inverse="transpose"),
    "broyden": rs.IBVS(interaction="broyden"),
    "depth of the goal": rs.IBVS(depth="goal", depth_scale=1.2),
    "depth filter": rs.IBVS(depth=rs.laws.DepthFilter(0.6)),
    "pbvs": rs.PBVS(),
    "pbvs of the camera": rs.PBVS(form="camera"),
    "hybrid": rs.Hybrid(mark=1),
    "partitioned": rs.Partitioned(),
    "stacked": rs.IBVS(
        features=[
            rs.features.FeatureBlock("points"),
            rs.features.FeatureBlock("theta_u", weight=0.5),
        ]
    ),
    "adaptive": rs.IBVS(gain=rs.laws.AdaptiveGain(4, 0.5, 10)),
    "smooth start": rs.IBVS(smooth_start=3.0),
    "limited": rs.IBVS(limit=rs.laws.SpeedLimit(joint=0.02, linear=0.01)),
    "avoid": rs.PBVS(secondary=rs.laws.AvoidLimits(margin=0.45)),
    "large": rs.PBVS(secondary=rs.laws.AvoidLimits(margin=0.45), projection="large"),
    "priorities": rs.Priorities(THREE),
    "switch": rs.Switch(rs.PBVS(), rs.IBVS(), rs.tasks.ErrorBelow(0.02)),
}
SINGLE = ["eye_in_hand", "eye_to_hand", "face_to_face", "mobile_arm"]
STEREO = ["stereo_in_hand", "stereo_apart", "stereo_beside"]


def steps(scene, task, q0, **more):
    """Ten periods."""
    return rs.simulate(scene, task, q0, dt=0.04, duration=0.4, hold=True, **more)


def with_marks(scene, marks):
    return scene.replacing(replace(scene.object(), marks=marks))


def same_motion(a, b, q=1e-10):
    for name in ("s", "qd", "q"):
        size = 1.0 + np.abs(a[name].values).max()
        np.testing.assert_allclose(a[name], b[name], rtol=0, atol=q * size)


def marks_for(feature, scene):
    special = {"vanishing_point": RAILS, "ellipse": CIRCLE}
    return with_marks(scene, special[feature]) if feature in special else scene


@pytest.mark.covering(1)
@quiet
@pytest.mark.parametrize("name", SINGLE)
@pytest.mark.parametrize("feature", FEATURES)
def test_moving_the_world_changes_no_feature(arrange, around, moved, feature, name):
    scene = marks_for(feature, arrange(name))
    task, q0 = rs.IBVS(features=feature), around(scene, 3)
    here = steps(scene, task, q0)
    assert float(np.abs(here.qd).max()) > 1e-3
    same_motion(here, steps(moved(scene, AWAY), task, q0))


@pytest.mark.covering(1)
@pytest.mark.parametrize("name", SINGLE)
@pytest.mark.parametrize("scheme", SCHEMES)
def test_moving_the_world_changes_no_command(arrange, around, moved, scheme, name):
    scene = arrange(name)
    task, q0 = SCHEMES[scheme], around(scene, 3)
    here = steps(scene, task, q0)
    assert float(np.abs(here.qd).max()) > 1e-3
    same_motion(here, steps(moved(scene, AWAY), task, q0))


@quiet
@pytest.mark.parametrize("name", ["holonomic", "unicycle", "turntable", "conveyor", "head"])
@pytest.mark.parametrize("ahead", [None, "known", "estimated"])
def test_moving_the_world_changes_nothing_for_bases_and_moving_bodies(
    arrange, around, moved, ahead, name
):
    scene = arrange(name)
    task, q0 = rs.IBVS(feed_forward=ahead), around(scene, 3)
    same_motion(steps(scene, task, q0), steps(moved(scene, AWAY), task, q0))


def test_moving_the_world_changes_no_docking(arrange, moved):
    scene, q0 = arrange("unicycle"), [[-0.4, 0.1, 0.1], [-0.3, -0.1, 0.2]]
    same_motion(steps(scene, rs.Docking(), q0), steps(moved(scene, AWAY), rs.Docking(), q0))


def stereo_task(feature):
    if feature == "stereo_points":
        return rs.IBVS(features=[rs.features.FeatureBlock(feature, camera=["left", "right"])])
    return rs.IBVS(
        features=[rs.features.FeatureBlock(feature, camera=name) for name in ("left", "right")]
    )


def renamed(scene):
    """Both cameras called left and right."""
    names = dict(zip((eye.name for eye in scene.cameras), ("left", "right"), strict=True))
    return replace(scene, cameras=[replace(eye, name=names[eye.name]) for eye in scene.cameras])


@pytest.mark.covering(1)
@quiet
@pytest.mark.parametrize("name", STEREO)
@pytest.mark.parametrize("feature", [*FEATURES, "stereo_points"])
def test_moving_the_world_changes_nothing_for_two_cameras(arrange, around, moved, feature, name):
    scene = marks_for(feature, renamed(arrange(name)))
    task, q0 = stereo_task(feature), around(scene, 2)
    here = steps(scene, task, q0)
    assert float(np.abs(here.qd).max()) > 1e-3
    same_motion(here, steps(moved(scene, AWAY), task, q0))


@pytest.mark.parametrize("variant", ["corrected", "completed", "printed"])
def test_only_the_placing_law_as_printed_depends_on_where_the_origin_is(
    arrange, around, moved, variant
):
    """Its T is the velocity at the origin, with a lever from there to mark a of the wrong sign."""
    scene = arrange("stereo_beside")
    task = rs.Placing(camera=["left", "right"], variant=variant)
    q0 = around(scene, 3, spread=0.1)
    here, there = steps(scene, task, q0), steps(moved(scene, AWAY), task, q0)
    if variant == "printed":
        assert np.abs(here.qd.values[:, 0] - there.qd.values[:, 0]).max() > 1e-2
        np.testing.assert_allclose(here.s[:, 0], there.s[:, 0], rtol=0, atol=1e-12)
    else:
        same_motion(here, there)


def shuffled(scene):
    return with_marks(scene, scene.object().marks[ORDER])


@quiet
@pytest.mark.parametrize("law", ["joint", "camera"])
@pytest.mark.parametrize("feature", [f for f in MARK_BY_MARK if f != "stereo_points"])
def test_the_order_of_the_marks_agrees_with_the_rows_and_does_not_matter(
    arrange, around, decide, feature, law
):
    scene, task = arrange("eye_in_hand"), rs.IBVS(features=feature, law=law)
    check_order(scene, task, around(scene, 3), decide, MARK_BY_MARK[feature])


@quiet
@pytest.mark.parametrize("name", STEREO)
def test_the_order_of_the_marks_does_not_matter_to_two_cameras(arrange, around, decide, name):
    scene = renamed(arrange(name))
    check_order(scene, stereo_task("stereo_points"), around(scene, 3), decide, 3)


def check_order(scene, task, q0, decide, rows):
    order = np.concatenate([rows * n + np.arange(rows) for n in ORDER])
    one, other = (decide(s, task, q0).basis.state for s in (scene, shuffled(scene)))
    for name in ("s_last", "interaction_last", "task_jacobian_last"):
        a, b = (getattr(state, name) for state in (one, other))
        np.testing.assert_allclose(b, a[order], rtol=0, atol=1e-12 * (1 + np.abs(a).max()))
    a, b = (steps(s, task, q0) for s in (scene, shuffled(scene)))
    np.testing.assert_allclose(a.qd, b.qd, rtol=0, atol=1e-10)


@quiet
@pytest.mark.parametrize("feature", AS_A_WHOLE)
def test_features_of_all_marks_do_not_depend_on_their_order(arrange, around, decide, feature):
    scene, task = arrange("eye_in_hand"), rs.IBVS(features=feature)
    q0 = around(scene, 3)
    a, b = (steps(s, task, q0) for s in (scene, shuffled(scene)))
    np.testing.assert_allclose(a.s, b.s, rtol=0, atol=1e-12)
    np.testing.assert_allclose(a.qd, b.qd, rtol=0, atol=1e-10)


OF_CHOSEN_MARKS = ("hybrid", "partitioned", "priorities")


@pytest.mark.parametrize("scheme", [name for name in SCHEMES if name not in OF_CHOSEN_MARKS])
def test_no_scheme_of_all_marks_depends_on_their_order(arrange, around, scheme):
    scene, task = arrange("eye_in_hand"), SCHEMES[scheme]
    q0 = around(scene, 3)
    a, b = (steps(s, task, q0) for s in (scene, shuffled(scene)))
    np.testing.assert_allclose(a.qd, b.qd, rtol=0, atol=1e-10)


@pytest.mark.parametrize("scheme", ["hybrid", "priorities"])
def test_a_scheme_of_chosen_marks_follows_them_through_another_order(arrange, around, scheme):
    tasks = {
        "hybrid": lambda n: rs.Hybrid(mark=n[1]),
        "priorities": lambda n: rs.Priorities(
            [rs.IBVS(features=[rs.features.FeatureBlock("points", marks=[n[i]])]) for i in range(3)]
        ),
    }
    scene, place = arrange("eye_in_hand"), np.argsort(ORDER)
    q0 = around(scene, 3)
    a = steps(scene, tasks[scheme](range(4)), q0)
    b = steps(shuffled(scene), tasks[scheme]([int(n) for n in place]), q0)
    np.testing.assert_allclose(a.qd, b.qd, rtol=0, atol=1e-10)


def relative(run, scene):
    """T_c_o (time, 4, 4)."""
    q = run.q.values
    T_w_c, T_w_o = (rs.Pose(scene.pose(name, q).matrix) for name in ("camera", "plate"))
    return (T_w_c.inv() @ T_w_o).matrix


MIRRORED = ["desired", "mean", "camera", "centimetre", "pbvs", "pbvs of the camera", "hybrid"]
MIRRORED += ["partitioned", "depth of the goal", "depth filter", "stacked", "adaptive", "switch"]


@pytest.mark.parametrize("scheme", MIRRORED)
def test_a_camera_that_moves_and_a_target_that_moves_are_one_relation(arrange, scheme):
    """Six free motions of one against the other: the target has the twist of the camera in
    other axes, and as both are held for one period the relative motion is the same."""
    task, camera_moves, target_moves = SCHEMES[scheme], arrange("free"), arrange("free_target")
    start = rs.Pose.at(0.1, 0.05, -0.2, rotvec=(0.1, -0.2, 0.3))
    timing = {"dt": 0.04, "duration": 2, "hold": True}
    a = rs.simulate(camera_moves, task, start.q, **timing)
    b = rs.simulate(target_moves, task, start.inv().q, **timing)
    np.testing.assert_allclose(relative(a, camera_moves), relative(b, target_moves), atol=1e-10)
    assert float(a.error_norm[-1]) < 0.4 * float(a.error_norm[0])


def test_a_smooth_start_is_one_of_the_joints(arrange):
    """It subtracts the first command, in axes of the joints: here the mirror symmetry breaks."""
    task = rs.IBVS(smooth_start=3.0)
    camera_moves, target_moves = arrange("free"), arrange("free_target")
    start = rs.Pose.at(0.1, 0.05, -0.2, rotvec=(0.1, -0.2, 0.3))
    a = rs.simulate(camera_moves, task, start.q, duration=1)
    b = rs.simulate(target_moves, task, start.inv().q, duration=1)
    apart = np.abs(relative(a, camera_moves) - relative(b, target_moves)).max((1, 2))
    assert apart[0] < 1e-14 and 1e-5 < apart.max() < 1e-2
