"""The bar and the fields of the studio: values in the page agree with the values of the session."""

import re

import pytest
from page.test_studio_page import row
from page.waiting import until

import robsim as rs
from robsim.page import load_recording

pytestmark = pytest.mark.browser

LEAST = "less than 0.1 mm and 0.01 deg"
GAIN = "robsim.listed.find((c) => c.path === 'task.gain').value"
LATENCY = "robsim.listed.find((c) => c.path === 'sensing.latency').value"
PHONE = {"viewport": {"width": 390, "height": 844}, "has_touch": True, "is_mobile": True}
SMALL = """() => [...document.querySelectorAll("button, select, summary")]
  .filter((each) => each.offsetParent && each.getBoundingClientRect().height < LEAST)
  .map((each) => each.textContent)"""


def enter(page, name, text):
    """Type a text into the field of a value."""
    field = row(page, name).locator("input")
    field.fill(text)
    field.press("Enter")
    return field


def read_reason(page, name):
    """The reason below the field of a value; empty without a refusal."""
    return row(page, name).locator("xpath=following-sibling::p[1]").inner_text()


def read_gain(desk):
    """The gain of the session's experiment."""
    return desk.app.bench.experiment.task.gain


def test_a_refused_value_springs_back_with_the_reason_beside_it(desk):
    page = desk.page()
    for _ in range(2):
        field = enter(page, "gain (1/s)", "0")
        until(page, "robsim.state.refusals.length === 1 && document.querySelector('.refused')")
        assert field.input_value() == "0.5" and read_gain(desk) == 0.5
        assert read_reason(page, "gain (1/s)") == "must be greater than 0, got 0 1/s"
        assert not page.locator("#note").is_visible()
    assert row(page, "gain (1/s)").get_attribute("class").endswith("refused")
    enter(page, "gain (1/s)", "0.8")
    until(page, f"{GAIN} === 0.8 && robsim.state.refusals.length === 0")
    assert read_reason(page, "gain (1/s)") == "" and read_gain(desk) == 0.8


def test_numbers_are_read_as_a_person_writes_them_and_other_texts_spring_back(desk):
    page = desk.page()
    reasons = {
        "fast": 'expected a number in 1/s, got "fast"',
        "": "expected a number in 1/s, got nothing",
        "20 ms": 'expected a number in 1/s, got "20 ms"',
        "1,250": '"1,250" can be read in two ways: write 1.250 or 1250',
        "1.234,5": "can be read in two ways: write one decimal point",
        "1e999": "expected a finite number",
        "0x10": "expected a number in 1/s",
    }
    for typed, reason in reasons.items():
        field = enter(page, "gain (1/s)", typed)
        assert field.input_value() == "0.5"
        assert reason in read_reason(page, "gain (1/s)")
    assert page.evaluate("robsim.state.changes.length") == 0 and read_gain(desk) == 0.5
    field = row(page, "gain (1/s)").locator("input")
    field.fill("7")
    field.press("Escape")
    assert field.input_value() == "0.5"
    page.wait_for_timeout(200)
    assert read_gain(desk) == 0.5
    typed = {"0,8": 0.8, "0.7": 0.7, " 3 ": 3.0, "1.5 1/s": 1.5, "2 Hz": 2.0, "2e-1": 0.2}
    for text, value in typed.items():
        field = enter(page, "gain (1/s)", text)
        until(page, f"{GAIN} === {value}")
        assert float(field.input_value()) == value == read_gain(desk)


def test_a_slider_sends_round_numbers_and_keeps_its_range(desk):
    page = desk.page()
    box = row(page, "gain (1/s)").locator(".lil-slider").bounding_box()
    y = box["y"] + box["height"] / 2
    page.mouse.move(box["x"] + 3, y)
    page.mouse.down()
    sent = []
    for k in range(8):
        page.mouse.move(box["x"] + 9 + 7.3 * k, y)
        page.wait_for_timeout(80)
        sent.append(row(page, "gain (1/s)").locator("input").input_value())
    page.mouse.up()
    field = row(page, "gain (1/s)").locator("input")
    until(page, f"{GAIN} === {field.input_value()}")
    assert len(set(sent)) == 8 and all(len(each) <= 4 for each in sent)
    assert read_gain(desk) == float(sent[-1])
    assert round(read_gain(desk) / 0.02) * 0.02 == pytest.approx(read_gain(desk), abs=1e-12)
    fill = row(page, "gain (1/s)").locator(".lil-fill")
    narrow = fill.evaluate("(each) => each.style.width")
    enter(page, "gain (1/s)", "200")
    until(page, f"{GAIN} === 200")
    assert fill.evaluate("(each) => each.style.width") == "100%"
    enter(page, "gain (1/s)", sent[-1])
    until(page, f"{GAIN} === {sent[-1]}")
    assert fill.evaluate("(each) => each.style.width") == narrow


def test_arrows_units_and_folders(desk):
    page = desk.page()
    field = row(page, "gain (1/s)").locator("input")
    field.press("ArrowUp")
    until(page, f"{GAIN} === 0.52")
    field.press("Shift+ArrowDown")
    until(page, f"{GAIN} === 0.32")
    assert read_gain(desk) == 0.32
    page.locator("#controls .lil-title", has_text="sensing").first.click()
    field = enter(page, "latency (s)", "40 ms")
    until(page, f"{LATENCY} === 0.04")
    assert field.input_value() == "0.04"
    row(page, "kind").locator("select").select_option("pbvs")
    until(page, "robsim.state.changes.some((c) => c.path === 'task.kind')")
    assert row(page, "latency (s)").is_visible()


def test_changes_are_taken_back_and_repeated_by_buttons_and_keys(desk):
    page = desk.page()
    undo, redo = (page.get_by_role("button", name=name, exact=True) for name in ("undo", "redo"))
    original = page.get_by_role("button", name="original", exact=True)
    assert undo.is_disabled() and redo.is_disabled() and original.is_disabled()
    field = enter(page, "gain (1/s)", "0.8")
    until(page, f"{GAIN} === 0.8 && robsim.state.undo")
    page.wait_for_timeout(1100)  # changes of one value within a second are one edit
    enter(page, "gain (1/s)", "0.9")
    until(page, f"{GAIN} === 0.9")
    steps = [(undo, 0.8), ("Control+z", 0.5), ("Control+Shift+Z", 0.8), (redo, 0.9)]
    steps += [("Control+z", 0.8), ("Control+y", 0.9), (original, 0.5), (undo, 0.9)]
    for act, value in steps:
        if isinstance(act, str):
            page.keyboard.press(act)
        else:
            act.click()
        until(page, f"{GAIN} === {value}")
        assert read_gain(desk) == value == float(field.input_value())


def test_one_of_several_changes_is_taken_back(desk):
    page = desk.page()
    enter(page, "gain (1/s)", "0.8")
    row(page, "interaction").locator("select").select_option("desired")
    until(page, "robsim.state.changes.length === 2")
    menu = page.locator("#bar .menu").first
    menu.locator("summary").click()
    change = menu.locator(".change", has_text="task gain")
    assert re.sub(r"\s+", " ", change.inner_text()) == "task gain 0.5 1/s → 0.8 1/s back"
    change.locator("button").click()
    until(page, f"{GAIN} === 0.5 && robsim.state.changes.length === 1")
    task = desk.app.bench.experiment.task
    assert task.gain == 0.5 and task.interaction == "desired"
    assert page.evaluate("robsim.state.changes[0].path") == "task.interaction"


def test_python_is_copied_pages_are_shared_and_reasons_are_shown(desk, tmp_path):
    page = desk.page(permissions=["clipboard-read", "clipboard-write"])
    enter(page, "gain (1/s)", "0.8")
    until(page, f"{GAIN} === 0.8")
    page.get_by_role("button", name="copy Python").click()
    until(page, "document.querySelector('#bar .told').textContent === 'copied'")
    code = page.evaluate("navigator.clipboard.readText()")
    names = {}
    exec(code.replace("rs.show(run)", ""), names)
    original = rs.load_scenario(rs.examples.path("visp_tutorial"))
    assert names["experiment"] == original.at("task.gain", 0.8)
    assert names["run"].sizes["time"] > 10
    page.evaluate("Object.defineProperty(navigator, 'clipboard', { value: undefined })")
    page.get_by_role("button", name="copy Python").click()
    until(page, "document.querySelector('#copying textarea') !== null")
    assert "rs.load_scenario" in page.evaluate("document.getSelection().toString()")
    page.keyboard.press("Escape")
    assert not page.locator("#copying").is_visible()
    with page.expect_download() as waiting:  # this browser cannot share files
        page.get_by_role("button", name="share").click()
    waiting.value.save_as(tmp_path / "run.html")
    assert waiting.value.suggested_filename == "visp_tutorial-run.html"
    recording = load_recording(tmp_path / "run.html")
    assert recording.header["title"] == "ViSP's tutorial case"
    refuse = {"status": 409, "body": "films need ffmpeg"}
    page.route("**/download/film.*", lambda route: route.fulfill(**refuse))
    page.get_by_role("button", name="film").click()
    until(page, "document.querySelector('#bar .told').textContent.includes('films need ffmpeg')")
    assert page.get_by_role("button", name="film").is_enabled()
    desk.complaints[:] = [each for each in desk.complaints if "409" not in each]


def test_a_change_after_a_failure_starts_over_visibly(desk):
    page = desk.page()
    page.locator("#speed").select_option("0")
    enter(page, "gain (1/s)", "200")
    page.locator("#play").click()
    until(page, "robsim.state.missed && robsim.state.playing === false")
    distance = page.locator("#distance")
    assert re.fullmatch(r"[\d.]+ (m|cm) and [\d.]+ deg from the goal", distance.inner_text())
    assert distance.evaluate("(each) => getComputedStyle(each).color") == "rgb(179, 71, 0)"
    assert not page.locator("#flash").is_visible()
    field = enter(page, "gain (1/s)", "0.8")
    until(page, "robsim.state.restarts === 1")
    assert page.locator("#flash").inner_text().startswith("started over: the run had ended: ")
    assert field.input_value() == "0.8" and read_gain(desk) == 0.8
    until(page, "robsim.state.resting")
    assert page.locator("#resting").inner_text().startswith("converged: drag the target")
    assert distance.inner_text() == f"{LEAST} from the goal"
    until(page, "document.getElementById('flash').hidden")
    shown = []
    for length, angle in ((2.5, 1.0), (0.0231, 0.0716), (0.0042, 0.001), (0.0, 0.0), (0.5, None)):
        given = f"{{ length: {length}, angle: {'null' if angle is None else angle}, frame: '' }}"
        page.evaluate(f"robsim.tellDistance({{ distance: {given} }})")
        shown.append(page.locator("#distance").inner_text().removesuffix(" from the goal"))
    assert shown == [
        *("2.50 m and 57.3 deg", "2.3 cm and 4.1 deg", "4.2 mm and 0.06 deg", LEAST),
        "50.0 cm",
    ]


def test_the_goal_is_shown_anew_by_its_button_and_its_key(desk):
    page = desk.page()
    anew = page.get_by_role("button", name="show the goal anew")
    for act, x in ((anew.click, 0.05), (lambda: page.keyboard.press("g"), 0.1)):
        assert anew.is_disabled()
        page.evaluate(f"robsim.link.ask({{ drag: ['objects.square', [{x}, 0, 0, 0, 0, 0, 1]] }})")
        until(page, "robsim.state.goal.kept")
        assert desk.app.bench.keeps_goals
        act()
        until(page, "robsim.state.goal.kept === false")
        assert not desk.app.bench.keeps_goals
    before = desk.app.bench.experiment.task.goal
    page.locator("#step").click()
    until(page, "robsim.clock.times.length > 1")
    page.get_by_role("button", name="take this image as the goal").click()
    until(page, "robsim.state.undo && robsim.state.distance.length < 1e-6")
    assert desk.app.bench.experiment.task.goal != before


def test_keys_are_listed_and_do_not_act_while_a_person_types(desk):
    page = desk.page()
    page.keyboard.press("?")
    text = page.locator("#keys").inner_text()
    for words in ("undo", "redo", "show the goal anew", "play or pause", "Ctrl Z", "space"):
        assert words in text
    page.keyboard.press("r")  # belongs to the dialog
    page.keyboard.press("Escape")
    assert not page.locator("#keys").is_visible()
    page.get_by_role("button", name="keys").click()
    assert page.locator("#keys").is_visible()
    page.keyboard.press("Escape")
    enter(page, "gain (1/s)", "0.8")
    until(page, f"{GAIN} === 0.8")
    field = row(page, "gain (1/s)").locator("input")
    field.focus()
    for key in ("Control+z", "r", "g", "?", " "):
        page.keyboard.press(key)
    page.wait_for_timeout(200)
    assert read_gain(desk) == 0.8 and not page.locator("#keys").is_visible()
    assert not page.evaluate("robsim.state.playing")


@pytest.mark.parametrize("width, least", [(1280, 30), (900, 30), (390, 40)])
def test_buttons_are_large_enough_and_nothing_is_cut(desk, width, least):
    wide = {"viewport": {"width": width, "height": 700}}
    page = desk.page(**(PHONE if width == 390 else wide))
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    assert page.evaluate(SMALL.replace("LEAST", str(least))) == []
    unlabelled = """() => [...document.querySelectorAll("button, input, select")].filter((each) =>
      each.offsetParent && !each.textContent.trim() && !each.getAttribute("aria-label")
      && !each.getAttribute("aria-labelledby")).map((each) => each.outerHTML)"""
    assert page.evaluate(unlabelled) == []
    open_panels = page.locator("#options .lil-root:not(.lil-closed)")
    assert open_panels.count() == (width > 1100)  # they would cover a small scene
    for button in page.locator("#bar button:visible, header button:visible").all():
        box = button.bounding_box()
        assert box["x"] >= 0 and box["x"] + box["width"] <= width
    for name in ("changes", "save"):
        page.locator("#bar summary", has_text=name).click()
        page.wait_for_timeout(200)  # until the panel has moved into the window
        box = page.locator("#bar .menu[open] .panel").bounding_box()
        assert box["x"] >= 0 and box["x"] + box["width"] <= width
    page.locator("h1").click()
    assert page.locator("#bar .menu[open]").count() == 0
    assert page.evaluate("document.documentElement.scrollWidth") <= width


def test_texts_have_enough_contrast(desk):
    ratio = """() => {
      const light = (color) => color.match(/[\\d.]+/g).slice(0, 3).map(Number)
        .map((x) => x / 255).map((x) => x <= 0.04045 ? x / 12.92 : ((x + 0.055) / 1.055) ** 2.4)
        .reduce((sum, x, i) => sum + x * [0.2126, 0.7152, 0.0722][i], 0);
      const ratio = (one, two) => (Math.max(one, two) + 0.05) / (Math.min(one, two) + 0.05);
      const probe = document.body.appendChild(document.createElement("i"));
      const value = (name) => {
        probe.style.color = `var(--${name})`;
        return light(getComputedStyle(probe).color);
      };
      return ["ink", "soft", "accent", "warm"].map((name) =>
        Math.min(ratio(value(name), value("panel")), ratio(value(name), value("sky"))));
    }"""
    for scheme in ("light", "dark"):
        assert min(desk.page(color_scheme=scheme).evaluate(ratio)) >= 4.5


def test_a_stroke_with_pauses_is_one_change_and_the_next_stroke_another(desk):
    page = desk.page()
    box = row(page, "gain (1/s)").locator(".lil-slider").bounding_box()
    middle = box["y"] + box["height"] / 2
    gains = []
    for shares in ((0.3, 0.5), (0.7, 0.9)):
        for i, share in enumerate(shares):
            page.mouse.move(box["x"] + share * box["width"], middle)
            if i == 0:
                page.mouse.down()
            page.wait_for_timeout(1200)  # longer than the pause between two changes
            gains.append(read_gain(desk))
        page.mouse.up()
    assert len(set(gains)) == 4
    for value in (gains[1], 0.5):
        page.keyboard.press("Control+z")
        until(page, f"{GAIN} === {value}")
    until(page, "!robsim.state.undo")  # the state follows the value
    assert page.get_by_role("button", name="undo", exact=True).is_disabled()


def test_a_shared_page_names_what_was_changed(desk, tmp_path):
    page = desk.page()
    enter(page, "gain (1/s)", "0.8")
    until(page, f"{GAIN} === 0.8")
    until(page, "document.querySelector('#why summary')?.textContent.includes('original')")
    assert page.locator("#why summary").inner_text() == "Watch for, in the original"
    with page.expect_download() as download:
        page.get_by_role("button", name="share", exact=True).click()
    until(page, "document.querySelector('#bar .told').textContent.includes('any browser opens it')")
    download.value.save_as(tmp_path / "run.html")
    reader = page.context.new_page()
    reader.goto((tmp_path / "run.html").as_uri())
    until(reader, "document.querySelector('#why .finding')")
    found = reader.locator("#why .finding").first.inner_text()
    assert found.startswith("Changed") and "task gain: 0.5" in found and "0.8 1/s" in found
    assert reader.locator("#why summary").inner_text() == "Watch for, in the original"
    reader.close()
