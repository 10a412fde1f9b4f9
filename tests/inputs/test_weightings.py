"""Weightings that contradict the features are refused, in one line, before anything runs."""

import numpy as np
import pytest
from poster import CAMERA, GOAL, POSTER, SCENE

import robsim as rs


class Negative:
    def weigh(self, now):
        return -np.ones(now.error.shape)


ENDLESS = rs.Scene(
    SCENE.robots, SCENE.objects, rs.MountedCamera("eye", rs.Camera(CAMERA.K), "free_camera.body")
)
ALL_AT_ONCE = "depends on all marks at once, so that none may be missing"
REFUSED = {
    "moments": (dict(features="point_moments"), ALL_AT_ONCE),
    "an area beside points": (dict(features=["points", "region_moments"]), ALL_AT_ONCE),
    "Broyden": (dict(interaction="broyden"), "Broyden's rule follows every mark from the start"),
    "depth filter": (dict(depth=rs.laws.DepthFilter(0.6)), "a depth filter follows every mark"),
    "estimated": (dict(feed_forward="estimated"), "use feed_forward='known'"),
    "negative": (dict(weighting=Negative()), "Negative.weigh: expected weights from 0 to 1"),
    "unknown": (dict(weighting="edge"), "no weighting 'edge'"),
    "no width": (dict(weighting=lambda: rs.weights.Border(width=0)), "Border.width must be"),
    "no time": (dict(weighting=lambda: rs.weights.Fade(time=0)), "Fade.time"),
    "no noise": (dict(weighting=lambda: rs.weights.Tukey(noise=0)), "Tukey.noise must be"),
    "no image of the goal": (
        dict(goal=rs.GoalFeatures(np.zeros(80)), weighting="huber", features="polar"),
        "Huber needs the image of the marks at the goal",
    ),
    "no object": (dict(weighting=[3]), "expected a weighting"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_a_task_without_marks_to_weigh_is_refused_in_one_line(case):
    given, words = REFUSED[case]
    with pytest.raises(rs.errors.InputError, match=words) as error:
        given = {"weighting": "border"} | given
        made = given["weighting"]
        given["weighting"] = made() if callable(made) else made
        rs.simulate(SCENE, rs.IBVS(**{"goal": GOAL} | given), POSTER.goal, duration=0.1)
    assert "\n" not in str(error.value)


def test_a_camera_without_a_border_has_none_to_weigh_by():
    with pytest.raises(
        rs.errors.InputError, match="camera 'eye' has no image size, and therefore no border"
    ):
        rs.simulate(ENDLESS, rs.IBVS(GOAL, weighting="border"), POSTER.goal)


def test_partitioned_servoing_needs_its_area_of_all_marks():
    area = rs.features.FeatureBlock("region_moments", components=[0])
    with pytest.raises(rs.errors.InputError, match=ALL_AT_ONCE):
        rs.simulate(SCENE, rs.IBVS(GOAL, features=area, weighting="border"), POSTER.goal)
    with pytest.raises(TypeError, match="weighting"):
        rs.Partitioned(GOAL, weighting="border")


def test_of_three_marks_none_can_be_left_out():
    scene = rs.Scene(SCENE.robots, rs.Object("square", marks=0.1 * np.eye(3)), SCENE.cameras)
    with pytest.raises(
        rs.errors.InputError, match="Cauchy needs 4 marks or more, and 'square' has 3"
    ):
        rs.simulate(scene, rs.IBVS(GOAL, weighting="cauchy"), POSTER.goal)


@pytest.mark.parametrize(
    ("marks", "robust", "words"),
    [
        (np.eye(3), "tukey", "3 marks do not determine the outlier"),
        (np.eye(4, 3), "tukey", "4 marks do not determine the outlier"),
        (np.eye(5, 3), "tuckey", "no weights 'tuckey'; did you mean 'tukey'?"),
        (np.eye(5, 3), 1, "no weights 1"),
    ],
)
def test_poses_take_robust_weights_by_name_and_five_marks(marks, robust, words):
    with pytest.raises(rs.errors.InputError, match=words) as error:
        rs.vision.estimate_pose(marks, np.zeros((len(marks), 2)), CAMERA, robust=robust)
    assert "\n" not in str(error.value)
