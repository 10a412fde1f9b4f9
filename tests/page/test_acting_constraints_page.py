"""The constraints that act, on pages in a real browser, and their controls in a studio."""

import io

import numpy as np
import pytest
from page.borders import list_acting, make_border_case
from page.desk import open_desk
from page.waiting import until

import robsim as rs
from robsim.page.export import export_html

pytestmark = pytest.mark.browser
ORANGE, VERMILLION = (230, 159, 0), (213, 94, 0)
LIT = "[...document.querySelectorAll('#acting li[data-acts={}]')].map((e) => e.textContent)"
LISTED = "robsim.listed.find((c) => c.path === 'task.law.constraints').value"
LIGHT = "[...document.querySelectorAll('#controls .lil-title')].find((e) => e.textContent === '{}')"


def count_colored(page, color, place):
    """The number of pixels of a colour in a place of the image, in pixels of the camera."""
    from matplotlib.image import imread

    picture = imread(io.BytesIO(page.locator("#pictures canvas").screenshot()), format="png")
    left, top, wide, tall = page.evaluate("(robsim.pictures ?? robsim.view.pictures)[0].bounds")
    height, width = picture.shape[:2]
    (x0, x1), (y0, y1) = place
    columns = slice(*(int((x - left) / wide * width) for x in (x0, x1)))
    rows = slice(*(int((y - top) / tall * height) for y in (y0, y1)))
    near = np.abs(255 * picture[rows, columns, :3] - color).max(axis=-1) < 30
    return int(near.sum())


def test_a_page_lights_up_what_acts_in_words_and_in_the_image(opened, tmp_path):
    run = make_border_case().run()
    page = opened(export_html(run, tmp_path / "run.html").as_uri())
    seen = set()
    for instant in (0, 60, 125):
        page.evaluate(f"robsim.clock.step({instant} - robsim.clock.index)")
        acting = list_acting(run, "active", instant)
        assert page.evaluate(LIT.format("holding")) == acting
        count = f"{len(acting)} constraint{'s' if len(acting) > 1 else ''}"
        assert page.locator("#acting .line").inner_text().startswith(count)
        sides = {"left": ((0, 6), (0, 480)), "right": ((633, 639), (0, 480))}
        for side, place in sides.items():
            held = any(name.startswith(side) for name in acting)
            seen.add((side, held))
            assert (count_colored(page, ORANGE, place) > 200) == held
        if "left border for mark 1" in acting:
            x, y = run.pixels.values[instant, 1]
            ring = count_colored(page, ORANGE, ((x + 12, x + 26), (y - 22, y + 22)))
            assert ring > 20
    assert ("left", True) in seen and ("left", False) in seen


def test_constraints_that_give_way_warn(opened, tmp_path):
    run = make_border_case(duration=0.4).run().copy(deep=True)
    slack = np.array(run["slack"].values)
    slack[3, [str(x) for x in run["constraint"].values].index("top border for mark 2")] = 2.0
    run["slack"] = run["slack"].dims, slack
    page = opened(export_html(run, tmp_path / "run.html").as_uri())
    line = page.locator("#acting .line")
    page.evaluate("robsim.clock.step(3 - robsim.clock.index)")
    assert page.evaluate(LIT.format("yielding")) == ["top border for mark 2"]
    assert line.inner_text().startswith("1 constraint gives way")
    assert count_colored(page, VERMILLION, ((0, 639), (0, 6))) > 200
    page.evaluate("robsim.clock.step(1)")
    assert "gives way" not in line.inner_text()


def test_a_page_without_constraints_has_no_list(opened, demo_page):
    assert opened(demo_page.as_uri()).locator("#acting").is_hidden()


def row(page, name):
    return page.locator("#controls .lil-controller", has=page.get_by_text(name, exact=True)).first


def unfold(page, name):
    page.locator("#controls .lil-title", has_text=name).first.click()


def test_constraints_are_added_changed_and_removed_by_hand(desk):
    page = desk.page()
    row(page, "law").locator("select").select_option("constrained")
    until(page, "robsim.listed.some((c) => c.path === 'task.law.constraints')")
    unfold(page, "law")
    unfold(page, "constraints")
    row(page, "add").locator("select").select_option("field of view")
    until(page, f"{LISTED}.join() === 'joint_limits,field_of_view'")
    until(page, "robsim.view.header.cameras[0].margins?.join() === '8'")
    unfold(page, "field of view")
    margin = row(page, "margin (px)").locator("input")
    margin.fill("25")
    margin.press("Enter")
    until(page, "robsim.view.header.cameras[0].margins.join() === '25'")
    unfold(page, "joint limits")
    page.locator("#controls button", has_text="remove").first.click()
    until(page, f"{LISTED}.join() === 'field_of_view'")
    law = desk.app.bench.experiment.task.law
    assert law == rs.laws.ConstrainedLaw([rs.constraints.FieldOfView(25.0)])
    assert page.locator("#controls button", has_text="remove").first.is_disabled()
    page.locator("#bar button", has_text="undo").first.click()
    until(page, f"{LISTED}.length === 2")


def test_the_controls_of_the_acting_constraints_light_up(chromium):
    case = make_border_case(duration=5.0)  # both constraints act from 2.84 s to the end
    with open_desk(chromium, case) as desk:
        page = desk.page()
        unfold(page, "law")
        unfold(page, "constraints")
        page.locator("#speed").select_option("0")
        page.locator("#play").click()
        until(page, f"{LIGHT.format('field of view')}?.dataset.acts === 'holding'")
        assert page.evaluate(f"{LIGHT.format('joint speeds')}.dataset.acts") == "holding"
