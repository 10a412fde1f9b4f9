"""A goal that was shown remains that image while objects and cameras move.

The oracle is the pose of the target in the camera, from `Scene.pose`, and the invariance of a run:
a free camera does not notice that target, start and goal have moved together.
"""

from dataclasses import replace

import numpy as np
import pytest

import robsim as rs
from robsim.features import FeatureBlock
from robsim.plot.goal_outlines import build_goal_outlines
from robsim.servo.goals.kept_goal import (
    keep_shown_goals,
    list_shown_goals,
    show_goals_anew,
    show_goals_at,
)
from robsim.tasks import TaughtGoal

M = rs.Pose.at(0.3, -0.2, 0.15, rpy=(0.4, -0.3, 1.1))  # motion of the whole world
HERE = rs.Pose.at()
Q = rs.Pose.at(0.01, 0.02, -0.4, rpy=(0.05, -0.1, 0.2)).q  # where goals are shown
START = rs.Pose.at(0.12, -0.06, -0.55, rpy=(0.1, 0.15, -0.2))
MARKS = [[-0.1, -0.09, 0], [0.11, -0.1, 0.02], [0.1, 0.1, 0], [-0.09, 0.11, 0.03]]
NEAR = rs.tasks.ErrorBelow(0.2)
SCHEMES = {
    "current": rs.IBVS(Q),
    "desired": rs.IBVS(Q, interaction="desired", depth="goal"),
    "mean": rs.IBVS(Q, interaction="mean", depth_scale=1.1),
    "moments": rs.IBVS(Q, features="decoupled_moments"),
    "robust": rs.IBVS(Q, weighting=rs.weights.Tukey(noise=0.5)),
    "pbvs": rs.PBVS(Q),
    "pbvs of the camera": rs.PBVS(Q, form="camera"),
    "hybrid": rs.Hybrid(Q, mark=1),
    "partitioned": rs.Partitioned(Q),
    "stereo": rs.IBVS(Q, features=[FeatureBlock("stereo_points", camera=("eye", "second"))]),
    "two cameras": rs.IBVS(
        Q, features=[FeatureBlock("points", camera=each) for each in ("eye", "second")]
    ),
    "two targets": rs.IBVS(
        Q,
        interaction="mean",
        features=[FeatureBlock("points", target=each) for each in ("dots", "others")],
    ),
    "priorities": rs.Priorities(
        [rs.IBVS(Q, features=[FeatureBlock("points", marks=[0])]), rs.PBVS(Q)]
    ),
    "switch": rs.Switch(rs.PBVS(Q), rs.IBVS(Q), NEAR),
}


def make_scene(world=HERE):
    """Return a free camera before two objects, which `world` moves."""
    lens = rs.Camera([[500, 0, 320], [0, 500, 240], [0, 0, 1]])
    free = rs.robots.free_camera()
    on = f"{free.name}.body"
    return rs.Scene(
        [free],
        [
            rs.Object("dots", marks=MARKS, pose=world @ rs.Pose.at(0.02, 0.01, 0.05)),
            rs.Object(
                "others", marks=MARKS, pose=world @ rs.Pose.at(-0.1, 0.08, 0.1, rpy=(0.2, 0, 0))
            ),
        ],
        [
            rs.MountedCamera("eye", lens, on),
            rs.MountedCamera("second", lens, on, rs.Pose.at(0.06, 0.01, 0, rpy=(0, -0.1, 0.05))),
        ],
    )


def named(task):
    """Return a scheme with the camera and the target that it does not name."""
    if hasattr(task, "inner"):
        return task.with_inner([named(each) for each in task.inner])
    return replace(task, camera=task.camera or "eye", target=task.target or "dots")


def follow(scene, task, start):
    """Return ten periods of a run."""
    return rs.simulate(scene, task, start.q, dt=0.04, duration=0.4, hold=True)


def assert_same_views(one, other):
    for name in ("s", "error", "pixels", "pixels_goal", "distance_to_goal", "angle_to_goal"):
        np.testing.assert_allclose(other[name], one[name], atol=1e-7, err_msg=name)


@pytest.mark.parametrize("name", SCHEMES)
def test_a_free_camera_does_not_notice_that_the_world_has_moved(name):
    before, after, task = make_scene(), make_scene(M), named(SCHEMES[name])
    kept = keep_shown_goals(task, before, after)
    one, other = follow(before, task, START), follow(after, kept, M @ START)
    assert np.ptp(one.pixels.values, axis=0).max() > 1  # it moves
    assert_same_views(one, other)
    T = M @ rs.Pose(one.goal_pose.values)
    np.testing.assert_allclose(other.goal_pose, T.matrix, atol=1e-9)


@pytest.mark.parametrize("name", ["mean", "pbvs", "stereo"])
def test_a_belief_keeps_its_error(name):
    error = rs.Pose.at(0.01, -0.02, 0.03, rpy=(0.02, 0.05, -0.04))
    before, after, task = make_scene(), make_scene(M), named(SCHEMES[name])
    believed = [
        each.believe(target="dots", place=error, camera="eye", hand_eye=error, focal=1.1)
        for each in (before, after)
    ]
    kept = keep_shown_goals(replace(task, belief=believed[1]), before, after)
    one = follow(before, replace(task, belief=believed[0]), START)
    assert_same_views(one, follow(after, kept, M @ START))


@pytest.mark.parametrize("name", ["mean", "pbvs", "hybrid"])
def test_a_carried_target_follows_a_camera_that_has_moved(name):
    lens = rs.Camera([[500, 0, 320], [0, 500, 240], [0, 0, 1]])
    free = rs.robots.free_camera()
    dots = rs.Object("dots", marks=MARKS, on=f"{free.name}.body")
    before, after = (
        rs.Scene([free], dots, rs.MountedCamera("eye", lens, pose=T)) for T in (HERE, M)
    )
    start = rs.Pose.at(0.05, -0.06, 0.7, rpy=(0.1, 0.15, -0.2))
    goal = rs.Pose.at(0.01, 0.02, 0.5, rpy=(0.05, -0.1, 0.2)).q
    task = replace(SCHEMES[name], goal=goal)
    kept = keep_shown_goals(task, before, after)
    assert_same_views(follow(before, task, start), follow(after, kept, M @ start))


RADIAL = -0.03 * np.array([np.cos(np.radians(20)), -np.sin(np.radians(20)), 0])
ASIDE = np.array([0.03, 0.02, 0.01])
EXAMPLES = {  # body, displacement in metres, changed numbers
    "eye_in_hand": ("objects.plate", ASIDE, {}),
    "chapter_6_1": ("objects.cube", RADIAL, {}),  # five joints reach poses in their vertical plane
    "eye_to_hand": ("cameras.camera", ASIDE, {}),
    "mobile_arm": ("objects.plate", ASIDE, {}),  # two tasks in strict order
    "unicycle_docking": ("objects.board", np.array([0.03, 0, 0]), {}),
    "stereo_in_hand": ("objects.plate", ASIDE, {}),
    "visp_tutorial": ("objects.square", ASIDE, {"task.gain": 1.0}),  # at 0.5 1/s it takes 7.1 s
    "smooth_start": ("objects.square", ASIDE, {}),  # PBVS
    "chapter_6_2": ("cameras.left", ASIDE, {}),  # two fixed cameras place an object
}


def find_pair(scene):
    """Return the names of the first camera and of the first object with marks."""
    return scene.cameras[0].name, next(each.name for each in scene.objects if len(each.marks))


def compute_target_pose(scene, q):
    """Return T_c_o of the first camera and object with marks."""
    eye, target = (rs.Pose(scene.pose(name, q).matrix) for name in find_pair(scene))
    return eye.inv() @ target


def measure_offset(one, other):
    """Return the distance in mm and the angle in degrees between two poses."""
    change = one.inv() @ other
    return 1000 * np.linalg.norm(change.position), np.degrees(np.linalg.norm(change.rotvec))


def find_body(scene, name):
    return next(each for each in (*scene.objects, *scene.cameras) if each.name == name)


def read_end(run):
    """Return the last configuration of a run."""
    return run.q.values[np.isfinite(run.q.values).all(axis=1)][-1]


@pytest.mark.parametrize("name", EXAMPLES)
def test_a_pulled_target_has_its_first_pose_in_the_camera_again_within_5_s(name):
    body, displacement, changes = EXAMPLES[name]
    one = rs.load_scenario(rs.examples.path(name)).at(changes)
    q = read_end(one.run())
    place = find_body(one.scene, body.partition(".")[2]).pose.position
    moved = one.at(f"{body}.position", (place + displacement).tolist())
    task = keep_shown_goals(moved.task, one.scene, moved.scene)
    run = moved.with_(task=task, start=q, hold=True, duration=5.0).run()
    first, again = (
        compute_target_pose(one.scene, q),
        compute_target_pose(moved.scene, read_end(run)),
    )
    assert measure_offset(first, compute_target_pose(moved.scene, q))[0] > 29
    distance, angle = measure_offset(first, again)
    assert distance < 1 and angle < 0.1
    shown = list_shown_goals(task)[0]
    home = one.scene.home if shown.q is None else shown.q
    eye, target = find_pair(one.scene)
    image = one.scene.view(home, eye, target).pixels
    np.testing.assert_allclose(run.pixels_goal[: len(image)], image, atol=1e-9)
    frame, T_c_o = run.goal_pose.attrs["frame"], compute_target_pose(one.scene, home)
    T_w_f = rs.Pose(run.goal_pose.values)
    end = moved.scene.pose(target if frame == eye else eye, read_end(run))
    relative = (
        T_w_f.inv() @ rs.Pose(end.matrix) if frame == eye else rs.Pose(end.matrix).inv() @ T_w_f
    )
    np.testing.assert_allclose(relative.matrix, T_c_o.matrix, atol=1e-9)


def test_places_of_bodies_that_have_not_moved_change_nothing():
    one = rs.load_scenario(rs.examples.path("eye_in_hand"))
    goal = TaughtGoal(places={"plate": one.scene.object("plate").pose})
    run, other = (each.run() for each in (one, one.with_(task=replace(one.task, goal=goal))))
    assert np.array_equal(run.q, other.q, equal_nan=True)


PLACES = '{ name = "plate", position = "31, 0, 10 cm", rpy = "0, 0, 10 deg" }, { name = "camera" }'


def test_a_goal_with_places_is_one_line_of_text():
    one = rs.load_scenario(rs.examples.path("eye_in_hand"))
    pose = rs.Pose.at(0.31, 0, 0.1, rpy=np.radians([0, 0, 10]))
    goal = TaughtGoal(places={"plate": pose, "camera": one.scene.camera().pose})
    kept = one.with_(task=replace(one.task, goal=goal))
    lines = [line for line in kept.text.splitlines() if line.startswith("goal")]
    assert lines == [f"goal = {{ places = [{PLACES}] }}"]
    assert rs.Experiment.from_text(kept.text).task.goal == goal


@pytest.mark.parametrize(
    ("value", "expected"), [("32, 0, 10 cm", {"plate": 0.32}), ([0.4, 0, 0.1], {"plate": 0.4})]
)
def test_a_place_is_changed_by_its_path(value, expected):
    one = rs.load_scenario(rs.examples.path("eye_in_hand"))
    kept = one.at("task.goal", {"places": [{"name": "plate", "position": "31, 0, 10 cm"}]})
    changed = kept.at("task.goal.places.plate.position", value)
    places = changed.task.goal.places
    assert {each.name: each.pose.position[0] for each in places} == expected
    assert kept.at("task.goal.places", None).task.goal == TaughtGoal()


@pytest.mark.parametrize(
    ("places", "message"),
    [
        ([{"name": "plat"}], "did you mean 'plate'"),
        ([{"name": "plate", "positio": "1 m"}], "task.goal.places.plate.positio: unknown key"),
        ([{"name": "plate"}, {"name": "plate"}], "one pose for each body"),
        ({"plate": {}}, "must be a list of tables"),
    ],
)
def test_wrong_places_of_a_text_are_refused(places, message):
    one = rs.load_scenario(rs.examples.path("eye_in_hand"))
    with pytest.raises(rs.errors.InputError, match=message):
        one.at("task.goal", {"places": places})


@pytest.mark.parametrize(
    "places", [3, "ab", [1], {"plate": 3}, {"plate": np.full((4, 4), np.nan)}, {"plate": "x"}]
)
def test_wrong_places_are_refused(places):
    with pytest.raises(rs.errors.GoalError, match="goal places"):
        TaughtGoal(places=places)


def test_a_place_needs_a_body_of_the_scene():
    one = rs.load_scenario(rs.examples.path("eye_in_hand"))
    task = replace(one.task, goal=TaughtGoal(places={"plat": rs.Pose.at(1)}))
    with pytest.raises(rs.errors.GoalError, match=r"'plat' at a place.*did you mean 'plate'"):
        rs.simulate(one.scene, task, one.start)


def test_goals_at_any_depth_are_kept_and_shown_anew():
    before, after = make_scene(), make_scene(M)
    schemes = [named(SCHEMES[name]) for name in ("pbvs", "priorities", "two targets")]
    task = rs.Switch(rs.Switch(*schemes[:2], rs.tasks.ErrorBelow(0.1)), schemes[2], NEAR)
    kept = keep_shown_goals(task, before, after)
    names = [[each.name for each in goal.places] for goal in list_shown_goals(kept)]
    assert names == [["dots"]] * 3 + [["dots", "others"]]  # not bodies that a goal ignores
    assert keep_shown_goals(kept, after, before) == kept  # the older place remains
    assert show_goals_anew(kept) == task
    here = show_goals_at(kept, START.q)
    assert all(np.array_equal(goal.q, START.q) for goal in list_shown_goals(here))
    assert not any(goal.places for goal in list_shown_goals(here))


def test_goals_that_are_not_shown_are_left_alone():
    before, after = make_scene(), make_scene(M)
    computed = named(rs.PBVS(rs.GoalPose(rs.Pose.at(0, 0, 0.4))))
    for change in (show_goals_anew, lambda task: keep_shown_goals(task, before, after)):
        assert change(computed) is computed
    still = named(SCHEMES["mean"])
    assert keep_shown_goals(still, before, before) is still


def test_a_batch_of_pulled_targets_is_its_single_runs():
    one = rs.load_scenario(rs.examples.path("eye_in_hand"))
    goal = TaughtGoal(places={"plate": one.scene.object().pose})
    belief = one.scene.believe(place=rs.Pose.at(0.01, 0, 0.02), focal=1.1)
    kept = one.with_(task=replace(one.task, goal=goal, belief=belief), duration=0.4)
    name, positions = "objects.plate.position", [[0.33, 0.01 * i, 0.1] for i in range(3)]
    batch = kept.vary({name: positions}).run()
    for i, position in enumerate(positions):
        assert np.array_equal(batch.q[i], kept.at(name, position).run().q)


def test_the_outline_of_a_kept_goal_follows_the_target():
    before, after, task = make_scene(), make_scene(M), named(SCHEMES["mean"])
    kept = keep_shown_goals(task, before, after)
    (one, *_), (other, *_) = (
        build_goal_outlines(scene, goal, None, scene.home, 0.1)
        for scene, goal in ((before, task), (after, kept))
    )
    np.testing.assert_allclose(other.points, M @ one.points, atol=1e-9)
