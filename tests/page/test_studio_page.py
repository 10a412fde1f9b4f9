"""The page of a studio in a real browser: the controls that are touched change the run."""

import re

import numpy as np
import pytest
from page.conftest import launched, until
from page.desk import BALL, Desk

import robsim as rs
from robsim.studio.studio import studio

pytestmark = pytest.mark.browser
FRAME = "robsim.view.space.frames.find((f) => f.name === '{}').position.toArray()"


def row(page, name):
    """The row of a control, by the words before it."""
    return page.locator("#controls .lil-controller", has=page.get_by_text(name, exact=True)).first


def test_it_plays_steps_and_goes_back(desk):
    page = desk.page()
    page.locator("#play").click()
    until(page, "robsim.clock.times.length > 10")
    page.locator("#play").click()
    until(page, "robsim.state.playing === false")
    here = page.evaluate("robsim.clock.times.length")
    page.locator("#step").click()
    until(page, f"robsim.clock.times.length > {here}")
    moved = np.array(page.evaluate(FRAME.format("camera")))
    page.locator("#reset").click()
    until(page, "robsim.clock.times.length === 1")
    start = np.array(page.evaluate(FRAME.format("camera")))
    assert np.linalg.norm(moved - start) > 0.01
    assert start == pytest.approx([-0.24284, 0.09836, -0.98176], abs=1e-5)


def test_the_past_is_looked_at_and_a_page_loaded_again_while_it_goes_on(desk):
    page = desk.page()
    page.locator("#speed").select_option("0.1")
    page.locator("#play").click()
    until(page, "robsim.clock.times.length > 10")
    page.keyboard.press("Home")
    here = page.evaluate("robsim.clock.times.length")
    until(page, f"robsim.clock.times.length > {here}")
    assert page.evaluate("robsim.clock.index") == 0
    page.keyboard.press("End")
    until(page, "robsim.clock.index === robsim.clock.times.length - 1")
    page.reload()
    until(page, "document.body.dataset.ready")
    until(page, "robsim.clock.times.length > 15 && robsim.clock.times[0] === 0")
    page.locator("#play").click()
    until(page, "robsim.state.playing === false")
    until(page, "robsim.view.charts[0].times.length === robsim.clock.times.length")


def test_the_gain_by_its_slider_changes_how_fast_it_goes(desk):
    page = desk.page()
    page.locator("#speed").select_option("0")
    page.locator("#play").click()
    until(page, "robsim.state.resting")
    slow = page.evaluate("robsim.clock.end")
    page.locator("#play").click()
    until(page, "robsim.state.playing === false")
    page.locator("#reset").click()
    gain = row(page, "gain (1/s)").locator("input")
    gain.fill("2")
    gain.press("Enter")
    until(page, "robsim.state.changes.some((c) => c.path === 'task.gain')")
    page.locator("#play").click()
    fast = rs.load_scenario(rs.examples.path("visp_tutorial")).at("task.gain", 2).run()
    end = float(fast["end_time"])
    until(page, f"robsim.state.resting && robsim.clock.end > {end} + 1 - 1e-5")
    assert page.evaluate("robsim.clock.end") == pytest.approx(end + 1.0, abs=1e-5)
    assert end < slow / 3


def test_another_and_a_second_scheme_are_chosen_and_echoed_to_other_pages(desk):
    one, two = desk.page(), desk.page()
    row(one, "kind").locator("select").select_option("pbvs")
    for page in (one, two):
        until(page, "robsim.state.changes.some((c) => c.path === 'task.kind')")
        until(page, "robsim.view.header.curves[0].unit.includes('rad')")
    assert row(two, "kind").locator("select").input_value() == "pbvs"
    row(one, "differs in").locator("select").select_option("task.gain")
    until(two, "Object.keys(robsim.state.second).length === 1")
    until(two, "robsim.view.header.frames.some((f) => f.group === 'second')")


def test_the_camera_follows_the_dragged_target(desk):
    page = desk.page()
    x, y = page.evaluate(BALL, "objects.square")
    page.mouse.click(x, y)
    until(page, "robsim.handles.choice.held === 'objects.square'")
    page.wait_for_timeout(300)
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + 30, y + 10, steps=6)
    page.mouse.up()
    until(page, "robsim.state.changes.some((c) => c.path === 'objects.square.position')")
    ball = "robsim.handles.balls.get('objects.square').position"
    near = f"Math.abs({FRAME.format('square')}[0] - {ball}.x) < 1e-5"
    until(page, f"{near} && {ball}.length() > 0.02")
    page.locator("#speed").select_option("0")
    page.locator("#play").click()
    until(page, "robsim.state.resting && robsim.state.goal.kept")
    goal = page.evaluate("robsim.view.pictures[0].goal.values[0]")
    run = rs.load_scenario(rs.examples.path("visp_tutorial")).run()
    assert goal == pytest.approx(run["pixels_goal"].values[0, 0], abs=1e-3)
    moved = np.subtract(*(page.evaluate(FRAME.format(name)) for name in ("camera", "square")))
    scene = rs.Experiment.of(run).scene
    q = run["q"].dropna("time").values[-1]
    camera = scene.display @ scene.pose("camera", q)
    square = scene.display @ scene.pose("square", q)
    assert moved == pytest.approx(camera.position - square.position, abs=2e-3)


def test_joints_are_taught_by_sliders(chromium):
    experiment = rs.load_scenario(rs.examples.path("eye_in_hand"))
    with studio(experiment) as server:
        page = Desk(chromium, server).page()
        before = page.evaluate(FRAME.format("camera"))
        joint = row(page, "link1 (deg)").locator("input")
        joint.fill("-20")
        joint.press("Enter")
        until(page, "robsim.state.changes.some((c) => c.path === 'start.q')")
        q = experiment.start.copy()
        q[0] = np.deg2rad(-20)
        there = experiment.scene.pose("camera", q).position
        until(page, f"Math.abs({FRAME.format('camera')}[0] - {there[0]}) < 1e-5")
        assert np.linalg.norm(np.array(before) - there) > 0.03
        page.context.close()


def test_it_is_explained_again_when_it_ends_again(desk):
    page = desk.page()
    page.locator("#speed").select_option("0")
    for _ in range(2):
        page.locator("#play").click()
        until(page, "document.getElementById('why').innerText.includes('the run converged')")
        page.locator("#play").click()  # a run that rests still plays
        until(page, "robsim.state.playing === false")
        page.locator("#reset").click()
        until(page, "!document.getElementById('why').innerText.includes('the run converged')")


def test_a_paused_run_stays_paused_when_another_page_comes(desk):
    page = desk.page()
    for _ in range(3):
        page.locator("#step").click()
    until(page, "robsim.clock.times.length === 4")
    other = desk.page(reduced_motion="no-preference")
    until(other, "robsim.clock.times.length === 4")
    other.wait_for_timeout(300)
    assert other.evaluate("robsim.clock.times.length") == 4
    assert not other.evaluate("robsim.state.playing")


def test_it_is_of_use_without_graphics_in_3_d(playwright):
    browser = launched(playwright, "--disable-3d-apis")
    with studio(rs.load_scenario(rs.examples.path("visp_tutorial"))) as server:
        made = Desk(browser, server)
        page = made.page()
        page.locator("#play").click()
        until(page, "robsim.view.charts[0].times.length > 5")
        assert "cannot draw in 3-D" in page.locator("#space").inner_text()
        page.context.close()
    browser.close()


def test_the_run_is_saved_from_the_page(desk, tmp_path):
    page = desk.page()
    with page.expect_download() as waiting:
        page.locator("#bar summary", has_text="save").click()
        page.get_by_text("run.nc", exact=True).click()
    waiting.value.save_as(tmp_path / "run.nc")
    run = rs.load_scenario(rs.examples.path("visp_tutorial")).run()
    assert np.array_equal(rs.open_run(tmp_path / "run.nc")["q"], run["q"], equal_nan=True)


def test_the_server_goes_and_comes_back(chromium):
    experiment = rs.load_scenario(rs.examples.path("visp_tutorial"))
    with studio(experiment) as server:
        port = int(re.search(r":(\d+)/", server.address)[1])
        page = Desk(chromium, server).page()
    until(page, "!document.getElementById('problem').hidden")
    assert "does not answer" in page.locator("#problem").inner_text()
    with studio(experiment, port=port) as again:
        page.goto(again.address)  # a new server has a new token
        until(page, "document.body.dataset.ready")
        until(page, "document.getElementById('problem').hidden")
    page.context.close()


def test_a_phone_has_it_all_one_below_the_other(desk):
    page = desk.page(viewport={"width": 390, "height": 844}, has_touch=True)
    for part in ("#space", "#pictures canvas", "#charts figure:last-child", "#controls", "footer"):
        box = page.locator(part).first.bounding_box()
        assert box["x"] >= 0 and box["x"] + box["width"] <= 391 and box["height"] > 20, part
    assert page.evaluate("document.documentElement.scrollWidth") <= 390


def test_a_title_with_script_is_text_here_too(chromium):
    bad = "<img src=x onerror=alert(1)></script><script>document.title='ran'</script>"
    experiment = rs.load_scenario(rs.examples.path("visp_tutorial")).with_(title=bad)
    with studio(experiment) as server:
        page = Desk(chromium, server).page()
        assert page.locator("h1").inner_text() == bad and page.title() == bad
        page.context.close()


def test_a_mission_is_played(desk):
    page = desk.page()
    page.evaluate("robsim.link.ask({ open: 'inspection_a' })")
    until(page, "robsim.view.header.title.startsWith('An inspection robot')")
    until(page, "robsim.clock.index > 3")
    assert "approach by sight" in page.locator("#texts .phases").inner_text()
