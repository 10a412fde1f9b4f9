"""The teach pendant in a real browser: the tool by the mouse, a slider, poses, replay and files."""

import numpy as np
import pytest
from page.desk import open_desk
from page.waiting import until

import robsim as rs

pytestmark = pytest.mark.browser
ON_SCREEN = """() => {
  const { space } = robsim.view;
  const p = robsim.hand.hand.position.clone().project(space.camera);
  const box = space.renderer.domElement.getBoundingClientRect();
  return [box.left + ((p.x + 1) / 2) * box.width, box.top + ((1 - p.y) / 2) * box.height];
}"""
FLANGE = "robsim.view.space.frames.find((f) => f.name === 'panda.flange').position.toArray()"


@pytest.fixture
def page(chromium):
    """The page of a panda."""
    with open_desk(chromium, rs.robots.panda()) as desk:
        page = desk.page()
        until(page, "robsim.now && robsim.hand")
        yield page


def pull_up(page, pixels):
    """Pull the tool up by its arrow, and wait until the server has answered each message."""
    start = page.evaluate(FLANGE)
    x, y = page.evaluate(ON_SCREEN)
    page.mouse.move(x, y)
    page.mouse.move(x + 3, y - 45, steps=3)
    until(page, "robsim.hand.control.axis === 'Z'")
    page.mouse.down()
    page.mouse.move(x + 5, y - 45 - pixels, steps=8)
    page.mouse.up()
    wait_for_rest(page, start[2] + 0.03)


def wait_for_rest(page, least):
    """Wait until the flange is above a height and rests: each message of a pull has its answer."""
    until(page, f"{FLANGE}[2] > {least}")
    height = None
    while (now := page.evaluate(FLANGE)[2]) != height:
        height = now
        page.wait_for_timeout(500)


def joint(page, number):
    return page.locator(".joint").nth(number)


def test_a_hand_teaches_two_poses_and_replays_them(page, tmp_path):
    start = page.evaluate(FLANGE)
    pull_up(page, 50)
    reached, hand = page.evaluate(FLANGE), page.evaluate("robsim.hand.hand.position.toArray()")
    assert reached[2] - start[2] > 0.03
    np.testing.assert_allclose(reached, hand, rtol=0, atol=1e-4)
    np.testing.assert_allclose(reached[:2], start[:2], rtol=0, atol=1e-4)
    page.keyboard.press("p")
    until(page, "robsim.count === 1")

    joint(page, 0).locator("input[type=range]").focus()
    for _ in range(3):
        page.keyboard.press("Shift+ArrowRight")
    until(page, "Math.abs(robsim.now.joints[0] - 30) < 1e-9")
    page.get_by_role("button", name="● record").click()
    until(page, "robsim.count === 2")
    page.get_by_label("name of pose 2").fill("place")
    page.get_by_label("name of pose 2").press("Enter")

    page.get_by_role("button", name="▶ replay").click()
    until(page, "robsim.replaying")
    page.evaluate("robsim.clock.toEnd()")
    end = page.evaluate(FLANGE)
    page.keyboard.press("Escape")
    np.testing.assert_allclose(end, page.evaluate(FLANGE), rtol=0, atol=1e-4)

    with page.expect_download() as caught:
        page.get_by_role("link", name="experiment.toml").click()
    assert caught.value.suggested_filename == "panda-experiment.toml"
    caught.value.save_as(tmp_path / "taught.toml")
    mission = rs.load_scenario(tmp_path / "taught.toml").run()
    assert [leg.name for leg in mission.legs] == ["pose 1", "place"]
    assert mission.succeeded
    tip = rs.robots.panda().fk(mission.legs[-1].q_end)[:3, 3]
    np.testing.assert_allclose(tip, end, rtol=0, atol=1e-4)


def test_a_refused_number_springs_back_and_a_far_pose_is_explained(page):
    field = joint(page, 3).locator("input[type=number]")
    field.fill("-400")
    field.press("Enter")
    until(page, "!document.getElementById('note').hidden")
    note = page.locator("#note").text_content()
    assert note == "link4: -400 deg is outside of its limits, -176 to -3.9992 deg"
    assert field.input_value() == "-135"
    field = page.get_by_label("x in cm")
    field.fill("150")
    field.press("Enter")
    until(page, "robsim.now.requested !== null")
    reason = page.locator(".tool .reason").text_content()
    assert reason == "out of reach: 72.8 cm too far and turned by 4.98 deg"
    assert page.evaluate("robsim.hand.ghost.visible && robsim.hand.ghost.position.x") == 1.5
    page.keyboard.press("Escape")
    page.locator("h1").click()
    page.keyboard.press("Control+z")
    until(page, "robsim.now.requested === null")
    assert page.evaluate("robsim.now.joints[3]") == -135
    assert not page.evaluate("robsim.hand.ghost.visible")
