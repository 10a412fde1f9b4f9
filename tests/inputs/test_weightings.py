"""Weightings that contradict what is servoed on are refused, in one line, before anything runs."""

import numpy as np
import pytest

import robsim as rs
from robsim.suites.published import vit_500_poster

POSTER = vit_500_poster.suite()
GOAL, SCENE = POSTER.task_goal, POSTER.scene
CAMERA = SCENE.camera().camera


class Negative:
    def weigh(self, now):
        return -np.ones(now.error.shape)


ENDLESS = rs.Scene(
    SCENE.robots, SCENE.objects, rs.MountedCamera("eye", rs.Camera(CAMERA.K), "free_camera.body")
)
ALL_AT_ONCE = "is made of all marks at once, so that none may be missing"
REFUSED = {
    "moments": (dict(features="point_moments"), ALL_AT_ONCE),
    "an area beside points": (dict(features=["points", "region_moments"]), ALL_AT_ONCE),
    "Broyden": (dict(interaction="broyden"), "Broyden's rule follows every mark from the start"),
    "depth filter": (dict(depth=rs.DepthFilter(0.6)), "a depth filter follows every mark"),
    "estimated": (dict(feed_forward="estimated"), "use feed_forward='known'"),
    "negative": (dict(weighting=Negative()), "Negative.weigh: expected weights from 0 to 1"),
    "unknown": (dict(weighting="edge"), "no weighting 'edge'"),
    "no width": (dict(weighting=lambda: rs.Border(width=0)), "Border.width .px. must be"),
    "no time": (dict(weighting=lambda: rs.Fade(time=0)), "Fade.time"),
    "no object": (dict(weighting=[3]), "expected a weighting"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_cannot_be_weighed_is_refused_in_one_line(case):
    given, words = REFUSED[case]
    with pytest.raises(rs.InputError, match=words) as error:
        given = {"weighting": "border"} | given
        made = given["weighting"]
        given["weighting"] = made() if callable(made) else made
        rs.simulate(SCENE, rs.IBVS(GOAL, **given), POSTER.goal, duration=0.1)
    assert "\n" not in str(error.value)


def test_a_camera_without_a_border_has_none_to_weigh_by():
    with pytest.raises(rs.InputError, match="camera 'eye' has no size, and its image no border"):
        rs.simulate(ENDLESS, rs.IBVS(GOAL, weighting="border"), POSTER.goal)


def test_partitioned_servoing_needs_its_area_of_all_marks():
    with pytest.raises(rs.InputError, match=ALL_AT_ONCE):
        rs.simulate(SCENE, rs.Partitioned(GOAL, weighting="border"), POSTER.goal)
