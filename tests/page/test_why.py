"""The card of the reason in a real browser: distances, buttons that cure, and its place."""

import re

import numpy as np
import pytest
from page.desk import open_desk
from page.waiting import until

import robsim as rs

pytestmark = pytest.mark.browser
HEADLINE = "document.querySelector('#why h2')?.innerText ?? ''"
BUTTONS = "#why .actions button"
BODY_SIZE = 4.5  # least contrast of small text


@pytest.fixture
def trap(chromium):
    """A studio of the camera in a local minimum."""
    with open_desk(chromium, rs.load_scenario(rs.examples.path("local_minimum"))) as made:
        yield made


def failed(page):
    """Run to the end at full speed, and wait for the advice."""
    page.evaluate("robsim.link.ask({ speed: 0 }); robsim.link.ask({ play: true })")
    until(page, f"({HEADLINE}).startsWith('Missed') && !!document.querySelector('{BUTTONS}')")
    until(page, f"document.querySelectorAll('{BUTTONS}').length > 2")


def saved(page):
    return page.evaluate("fetch('/download/experiment.toml').then((answer) => answer.text())")


def button(page, label):
    return page.locator("#why .finding").get_by_role("button", name=label, exact=True).first


def test_a_missed_goal_has_its_distance_a_readable_reason_and_a_button_that_cures_it(trap):
    page = trap.page()
    failed(page)
    experiment = rs.load_scenario(rs.examples.path("local_minimum"))
    ends = experiment.run().q_end.values, experiment.task.goal.q
    away = experiment.scene.pose("camera", ends[0]).inv() @ experiment.scene.pose("camera", ends[1])
    centimetres = f"{100 * np.linalg.norm(away.position):.0f} cm"
    degrees = f"{np.degrees(np.linalg.norm(away.rotvec)):.0f} deg"
    assert page.evaluate(HEADLINE) == (
        f"Missed the goal by {centimetres} and {degrees}: local minimum after 14.5 s"
    )
    require_readable_reason(page)
    button(page, "Try L mean").click()
    until(page, f"({HEADLINE}).startsWith('Converged after 9.84 s')")
    assert 'interaction = "mean"' in saved(page)
    assert not page.evaluate("document.getElementById('why').classList.contains('off-goal')")


def require_readable_reason(page):
    """The whole reason is on the screen, dark and light; on a phone it is below the scene."""
    side, last = (page.locator(each).last.bounding_box() for each in ("#side", "#why > .finding"))
    assert last["y"] + last["height"] <= side["y"] + side["height"]
    for _ in range(2):
        for each in ("#why h2", "#why .finding p", "#why .actions button"):
            assert contrast(page, each) >= BODY_SIZE, each
        page.locator("#theme").click()
    page.set_viewport_size({"width": 390, "height": 844})
    scene, why = (page.locator(each).bounding_box() for each in ("#space", "#why"))
    assert 0 <= why["y"] - (scene["y"] + scene["height"]) < 20
    assert why["x"] >= 0 and why["x"] + why["width"] <= 390
    assert min(page.locator(BUTTONS).evaluate_all("all => all.map((b) => b.offsetHeight)")) >= 26
    page.set_viewport_size({"width": 1280, "height": 800})


def test_advice_runs_beside_the_failure_and_stops_again(trap):
    page = trap.page()
    failed(page)
    beside = page.locator(BUTTONS, has_text="beside it").first
    beside.click()
    until(page, "robsim.state.second['task.interaction'] === 'mean'")
    until(page, "robsim.view.header.curves[0].title === 'image error'")
    failed(page)
    pressed = page.locator(f"{BUTTONS}[aria-pressed=true]")
    assert pressed.count() >= 1 and "interaction = " not in saved(page)
    pressed.first.click()
    until(page, "Object.keys(robsim.state.second).length === 0")


def test_what_to_watch_for_has_buttons_before_the_end(trap):
    page = trap.page()
    assert page.locator("#why h2").count() == 0
    side, image = (page.locator(each).bounding_box() for each in ("#side", "#pictures canvas"))
    assert side["y"] < image["y"] < page.locator("#why").bounding_box()["y"]
    assert image["y"] + image["height"] < side["y"] + side["height"]  # the image needs no scrolling
    assert page.locator("#why code").inner_text() == "robsim study local_minimum.toml"
    button(page, "Try L mean").click()
    until(page, "robsim.state.changes.length === 1 && robsim.clock.times.length > 5")
    assert 'interaction = "mean"' in saved(page)


def test_a_page_of_a_run_has_the_reason_without_buttons(opened, tmp_path):
    experiment = rs.load_scenario(rs.examples.path("local_minimum"))
    page = opened(rs.export_html(experiment.run(), tmp_path / "run.html", experiment).as_uri())
    assert page.evaluate(HEADLINE).startswith("Missed the goal by 55 cm and 32 deg")
    assert page.locator("#why button").count() == 0
    told = page.locator("#why").inner_text().replace("\xa0", " ")  # between a number and its unit
    assert "With L mean the same start converges after 9.84 s." in told
    commands = page.locator("#why code").all_text_contents()
    assert commands[0] == "robsim run local_minimum.toml --set task.interaction=mean"
    assert page.locator("#texts summary").all_text_contents() == ["experiment"]


def contrast(page, selector):
    """The contrast of a text with the nearest opaque background, as WCAG 2 defines it."""
    colors = page.evaluate(
        """(selector) => {
          const text = document.querySelector(selector);
          let behind = text;
          const clear = (it) => /, 0\\)|transparent/.test(getComputedStyle(it).backgroundColor);
          while (clear(behind)) behind = behind.parentElement;
          return [getComputedStyle(text).color, getComputedStyle(behind).backgroundColor];
        }""",
        selector,
    )
    light, dark = sorted(map(luminance, colors), reverse=True)
    return (light + 0.05) / (dark + 0.05)


def luminance(color):
    numbers = np.array([float(x) for x in re.findall(r"[\d.]+", color)[:3]])
    srgb = numbers if color.startswith("color(") else numbers / 255
    linear = np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)
    return float(linear @ [0.2126, 0.7152, 0.0722])


def test_a_change_that_fails_at_once_is_taken_back_by_its_button(chromium):
    with open_desk(chromium, rs.load_scenario(rs.examples.path("chapter_6_1"))) as desk:
        page = desk.page()
        page.evaluate("robsim.link.ask({ speed: 0 }); robsim.link.ask({ play: true })")
        until(page, "robsim.state.resting")
        page.evaluate("robsim.link.ask({ drag: ['objects.cube', [0.5, 0, 0.025, 0, 0, 0, 1]] })")
        until(page, f"({HEADLINE}).startsWith('Missed')")
        button(page, "Undo the last change").click()
        until(page, "robsim.state.resting && !robsim.state.edited")


def test_trying_a_cure_shows_why_the_run_started_over(trap):
    page = trap.page()
    failed(page)
    button(page, "Try L mean").click()
    until(page, "!document.getElementById('flash').hidden")
    flash = page.locator("#flash").inner_text()
    assert flash == "started over: the run had ended: local minimum after 14.5 s"
