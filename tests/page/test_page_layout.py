"""Texts of the studio's page: whole in every window, and in one colour for one fact."""

import pytest
from page.desk import BALL, open_desk
from page.waiting import until

import robsim as rs

pytestmark = pytest.mark.browser
NARROW = {"width": 900, "height": 900}
CUT = """(selector) => [...document.querySelectorAll(selector)]
  .filter((e) => e.scrollWidth > e.clientWidth || e.scrollHeight > e.clientHeight + 1)
  .map((each) => each.textContent)"""


def open_example(chromium, name):
    return open_desk(chromium, rs.load_scenario(rs.examples.path(name)))


def test_a_run_that_converged_elsewhere_is_warm_in_the_card_and_in_the_header(chromium):
    with open_example(chromium, "straight_image_lines") as desk:
        page = desk.page()
        page.evaluate("robsim.link.ask({ speed: 0 }); robsim.link.ask({ play: true })")
        until(page, "robsim.state.resting && !!document.querySelector('#why h2')")
        colors = page.evaluate(
            "['#why h2', '#distance'].map((s) => getComputedStyle(document.querySelector(s)).color)"
        )
        assert colors == ["rgb(179, 71, 0)"] * 2
        assert page.evaluate("robsim.state.outcome") == "CONVERGED"
        page.locator("#reset").click()
        until(page, "!document.body.classList.contains('missed')")


def test_the_legends_of_curves_are_whole_in_a_narrow_window(chromium):
    with open_example(chromium, "joint_lag") as desk:
        page = desk.page(viewport=NARROW)
        assert page.evaluate(CUT, "figcaption") == []
        names = page.locator("#charts figure").last.locator(".key").all_text_contents()
        arm = ["shoulder", "upper_arm", "forearm", "wrist_roll", "wrist_bend", "flange"]
        assert names == arm
        assert min(page.locator(".plot").evaluate_all("all => all.map((p) => p.clientHeight)")) > 80


def test_the_phases_of_a_mission_are_whole_in_a_narrow_window(chromium):
    with open_example(chromium, "inspection_a") as desk:
        page = desk.page(viewport=NARROW)
        rows = page.locator(".phases tr").all_text_contents()
        assert len(rows) == 14 and rows[1] == "6.76 to 15.76 sapproach by sightconverged"
        side, table = (page.locator(each).bounding_box() for each in ("#side", ".phases"))
        assert table["x"] + table["width"] <= side["x"] + side["width"]


def test_a_handle_has_the_name_of_its_body(chromium):
    with open_example(chromium, "eye_in_hand") as desk:
        page = desk.page()
        page.mouse.move(*page.evaluate(BALL, "objects.plate"))
        canvas = page.locator("#space canvas")
        assert canvas.get_attribute("title") == "plate: click, then drag the arrows"
        shown = page.locator("#dragging option").all_text_contents()
        assert shown == ["none", "plate", "start pose of camera", "goal pose of camera"]
