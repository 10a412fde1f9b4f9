"""A person at the studio: each gesture is checked by the poses of the page and by the saved file.

The same gestures are made in Chromium and, for the first five, in Firefox.
"""

import numpy as np
import pytest
from page.drivers import ChromiumDriver
from page.hands import Hands
from page.test_studio_page import Desk

import robsim as rs
from robsim.studio.studio import studio

pytestmark = pytest.mark.browser

# experiment, handle of the target, pixels to the right and down, camera, target
TARGETS = {
    "eye_in_hand": ("objects.plate", "camera", "plate"),
    "chapter_6_1": ("objects.cube", "camera", "cube"),
    "eye_to_hand": ("cameras.camera", "camera", "plate"),
    "holonomic": ("objects.board", "camera", "board"),
    "mobile_arm": ("objects.plate", "camera", "plate"),
}
PULLS = {"pull": (35, 12), "push": (-30, -8)}


@pytest.fixture
def sit_down(chromium):
    """Open the studio of a shipped experiment; return the hands."""
    opened = []

    def sit(name):
        serving = studio(rs.load_scenario(rs.examples.path(name)))
        server = serving.__enter__()
        desk = Desk(chromium, server)
        opened.append((serving, desk))
        return Hands(ChromiumDriver(desk.page()))

    yield sit
    for serving, desk in opened:
        for context in desk.contexts:
            context.close()
        serving.__exit__(None, None, None)
        assert not desk.complaints


def measure_offset(one, other):
    """Return the distance (m) and the angle (degrees) between two poses."""
    difference = one.inv() @ other
    return np.linalg.norm(difference.position), np.rad2deg(np.linalg.norm(difference.rotvec))


@pytest.mark.parametrize("name", TARGETS)
def test_the_arm_follows_the_target(sit_down, name):
    hands = sit_down(name)
    handle, camera, target = TARGETS[name]
    hands.play_to_rest()
    first = hands.relative(camera, target)
    for gesture, (right, down) in PULLS.items():
        before, begun = hands.pose(target if "objects" in handle else camera), hands.end()
        hands.pull(handle, right, down)
        hands.play_to_rest()
        after = hands.pose(target if "objects" in handle else camera)
        assert np.linalg.norm(after.position - before.position) > 0.02, gesture
        hands.check_return(first, camera, target, begun)


def test_the_target_is_turned(sit_down):
    hands = sit_down("eye_in_hand")
    hands.play_to_rest()
    first = hands.relative("camera", "plate")
    before, begun = hands.pose("plate"), hands.end()
    hands.turn("objects.plate", 40, 10)
    hands.play_to_rest()
    assert measure_offset(before, hands.pose("plate"))[1] > 5.0
    hands.check_return(first, "camera", "plate", begun)


def check_files(hands, tmp_path):
    """Check that the four files hold the run that the page shows since the last change."""
    since = hands.state()["since"]
    shown = hands.driver.evaluate("[...robsim.clock.times]")
    count = sum(time >= since - 1e-9 for time in shown)
    return since, count
