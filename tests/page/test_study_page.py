"""The map of a study in a real browser: points are selected, hidden and opened."""

import numpy as np
import pytest
from page.desk import open_desk
from page.waiting import until

import robsim as rs

pytestmark = pytest.mark.browser
POINT = "((i) => [robsim.map.scatter.px[i], robsim.map.scatter.py[i]])({})"
SHOWN = "[...robsim.map.scatter.px].filter((x) => x === x).length"
COLOR = """((i) => {
  const { scatter } = robsim.map;
  const ratio = scatter.canvas.width / scatter.place.clientWidth;
  const at = [scatter.px[i], scatter.py[i]].map((x) => Math.round(x * ratio));
  return [...scatter.context.getImageData(...at, 1, 1).data];
})"""


@pytest.fixture(scope="module")
def study():
    """Two interaction matrices from 40 starts, some of them with too few marks in view."""
    one = rs.load_scenario(rs.examples.path("local_minimum")).with_(duration=20)
    look = rs.starts.LookAt(distance=(0.4, 1.2), visible=False, aside=0.4)
    vary = {"task.interaction": ["current", "mean"], "task.gain": rs.samplers.Uniform(0.5, 2)}
    return rs.study(one, 40, seed=2, start=look, vary=vary)


@pytest.fixture
def desk(chromium, study):
    with open_desk(chromium, study) as made:
        yield made


def choose(page, name, value):
    page.locator(f'.tools select[aria-label="{name}"]').select_option(value)


def place(page, number):
    """The position of the point of a run on the screen."""
    box = page.locator(".points canvas").bounding_box()
    x, y = page.evaluate(POINT.format(number))
    return box["x"] + x, box["y"] + y


def alone(page, table, **facts):
    """The number of a run with these facts that no other point comes near."""
    found = table
    for name, value in facts.items():
        found = found[found[name.replace("__", ".")] == value]
    xy = np.array([page.evaluate(POINT.format(i)) for i in range(len(table))], dtype=float)
    for number in found["run"]:
        away = np.hypot(*(xy - xy[number]).T)
        away[number] = np.nan
        if np.nanmin(away) > 14:
            return int(number)
    raise AssertionError(facts)


def test_points_have_the_colours_of_their_outcomes_and_may_be_hidden(desk, study):
    page = desk.page()
    table = study.table
    first = table[table["task.interaction"] == "current"]
    assert page.evaluate(SHOWN) == len(first)
    number = alone(page, table, task__interaction="current", outcome="CONVERGED", began=True)
    assert page.evaluate(f"{COLOR}({number})") == [0x00, 0x72, 0xB2, 255]
    hollow = alone(page, table, task__interaction="current", began=False)
    paper = [255, 255, 255, 255]
    assert page.evaluate(f"{COLOR}({hollow})") == paper
    chip = page.locator(".chip", has_text="converged")
    count = int(((first["outcome"] == "CONVERGED") & first["began"]).sum())
    assert chip.inner_text().split() == ["converged", str(count)]
    chip.click()
    assert page.evaluate(SHOWN) == len(first) - count
    assert page.evaluate("document.activeElement.getAttribute('aria-pressed')") == "false"
    page.locator(".chip", has_text="could not begin").click()
    assert page.evaluate(SHOWN) == int((first["began"] & (first["outcome"] != "CONVERGED")).sum())


def test_the_map_is_held_at_a_value_or_shows_runs_of_a_draw_beside_each_other(desk, study):
    page = desk.page()
    choose(page, "task.interaction", "mean")
    began = study.table[study.table["task.interaction"] == "mean"]
    assert page.evaluate(SHOWN) == len(began)
    choose(page, "task.interaction", "all")
    assert page.evaluate(SHOWN) == len(study.table)
    one, other = (np.array(page.evaluate(POINT.format(i))) for i in (0, 1))
    assert 5 < np.hypot(*(one - other)) < 12


def test_points_stand_at_their_numbers(desk, study):
    page = desk.page()
    for name in ("start_x", "task.gain", "end_time"):
        choose(page, "across", name)
        own = study.table[study.table["task.interaction"] == "current"]
        numbers = own[name][own["began"] | (name != "end_time")]
        x = [page.evaluate(POINT.format(i))[0] for i in numbers.index]
        fit = np.polyfit(numbers, x, 1)
        assert np.abs(np.polyval(fit, numbers) - x).max() < 1e-2
    without = len(own) - own["began"].sum()
    assert (
        page.locator(".legend .remark").inner_text() == f"{without} without a number on these axes"
    )


def test_pointing_shows_the_row(desk, study):
    page = desk.page()
    number = alone(page, study.table, task__interaction="current", began=True)
    page.mouse.move(*place(page, number))
    card = page.locator(".card-of-run")
    row = study.table.iloc[number]
    assert card.locator("strong").inner_text() == f"run {number}"
    terms = card.locator("dt").all_inner_texts()
    options = dict(zip(terms, card.locator("dd").all_inner_texts(), strict=True))
    assert options["task.interaction"] == "current"
    assert float(options["task.gain (1/s)"]) == pytest.approx(row["task.gain"], rel=1e-4)
    assert float(options["end_time (s)"]) == pytest.approx(row["end_time"], rel=1e-4)
    page.mouse.move(5, 5)
    assert card.is_hidden()


def test_a_click_opens_the_run_and_a_button_leads_back(desk, study):
    page = desk.page()
    number = alone(page, study.table, task__interaction="current", outcome="CONVERGED", began=True)
    page.mouse.click(*place(page, number))
    page.wait_for_selector("body:not(.map) #space canvas")
    assert page.locator("#whose").inner_text() == f"run {number}: current"
    until(page, "robsim.clock.times.length > 5")
    page.locator("#speed").select_option("0")
    end = study.table["end_time"][number] + 1  # a live run goes on for a second, and rests
    until(page, f"robsim.state.resting && Math.abs(robsim.clock.end - {end}) < 1e-4")
    page.locator("#back").click()
    page.wait_for_selector("body.map .points canvas")
    assert page.locator("#space").is_hidden() and page.locator("#mapped").is_visible()


def test_an_opened_run_can_be_changed(desk):
    page = desk.page()
    page.locator(".worst button").first.click()
    page.wait_for_selector("body:not(.map)")
    gain = page.locator("#controls .lil-controller", has=page.get_by_text("gain (1/s)")).first
    gain.locator("input").fill("0.3")
    gain.locator("input").press("Enter")
    until(page, "robsim.state.changes.some((c) => c.path === 'task.gain')")


def test_the_ten_worst_agree_with_the_study(desk, study):
    page = desk.page()
    choose(page, "task.interaction", "all")
    for name in ("distance_to_goal", "end_time"):
        page.get_by_label("measure").select_option(name)
        listed = page.locator(".worst button").all_inner_texts()
        worst = study.worst(name, 10)[name]
        assert [float(text.split()[-1]) for text in listed] == pytest.approx(list(worst), rel=1e-4)


def test_keys_go_from_run_to_run_and_open_one(desk):
    page = desk.page()
    page.locator(".points canvas").focus()
    page.keyboard.press("ArrowRight")
    first = page.evaluate("robsim.map.scatter.at")
    page.keyboard.press("ArrowRight")
    second = page.evaluate("robsim.map.scatter.at")
    assert page.evaluate(POINT.format(second))[0] > page.evaluate(POINT.format(first))[0]
    page.keyboard.press("Enter")
    page.wait_for_selector("body:not(.map)")
    until(page, f"robsim.state.run === {second}")


def test_a_rectangle_that_is_dragged_is_looked_at(desk, study):
    page = desk.page()
    box = page.locator(".points canvas").bounding_box()
    before = page.evaluate(SHOWN)
    page.mouse.move(box["x"] + 200, box["y"] + 100)
    page.mouse.down()
    page.mouse.move(box["x"] + 400, box["y"] + 300, steps=4)
    page.mouse.up()
    assert page.locator(".tools button").is_visible() and page.evaluate(SHOWN) < before
    page.locator(".tools button").click()
    assert page.evaluate(SHOWN) == before


def test_a_shade_represents_a_number(desk, study):
    page = desk.page()
    choose(page, "colour", "end_time")
    told = study.table[(study.table["task.interaction"] == "current") & study.table["began"]]
    ink = [sum(page.evaluate(f"{COLOR}({i})")[:3]) for i in (told["end_time"].idxmin(),)]
    dark = [sum(page.evaluate(f"{COLOR}({i})")[:3]) for i in (told["end_time"].idxmax(),)]
    assert dark < ink and "end_time (s)" in page.locator(".shades").inner_text()


def test_on_a_phone_a_tap_shows_the_row_and_a_button_opens_it(desk, study):
    page = desk.page(viewport={"width": 390, "height": 844}, has_touch=True, is_mobile=True)
    assert page.evaluate("document.documentElement.scrollWidth") <= 390
    number = alone(page, study.table, task__interaction="current", began=True)
    page.touchscreen.tap(*place(page, number))
    button = page.locator(".card-of-run button")
    button.wait_for()
    assert button.inner_text() == f"open run {number}"
    assert page.locator(".ring").is_visible()
    page.evaluate("scrollTo(0, 90)")
    button.click()
    page.wait_for_selector("body:not(.map)")
    assert page.evaluate("scrollY") == 0
    page.locator("#back").click()
    assert page.evaluate("scrollY") == 90


def test_two_pages_look_at_their_own_choices(desk, study):
    one, two = desk.page(), desk.page()
    one.locator(".worst button").first.click()
    one.wait_for_selector("body:not(.map)")
    until(two, "robsim.state.run !== null")
    assert two.locator(".points canvas").is_visible()


def test_a_file_shows_the_map_without_a_server(opened, study, tmp_path):
    path = rs.export_html(study, tmp_path / "map.html")
    page = opened(path.as_uri(), color_scheme="dark")
    page.evaluate("robsim.map = robsim")
    number = alone(page, study.table, task__interaction="current", began=True)
    page.mouse.click(*place(page, number))
    card = page.locator(".card-of-run.pinned")
    assert card.locator("strong").inner_text() == f"run {number}"
    assert card.locator("button").count() == 0
    page.keyboard.press("Escape")
    assert page.locator(".card-of-run").is_hidden()
    assert path.read_bytes() == rs.export_html(study, tmp_path / "again.html").read_bytes()


def test_words_of_a_study_are_no_elements(opened, tmp_path):
    one = rs.load_scenario(rs.examples.path("visp_tutorial")).with_(duration=0.4)
    one = one.with_(title="</script><img src=x>")
    gains = {"<b>slow</b>": 1.0, "</script><img src=x>": 2.0}
    start = rs.starts.LookAt(distance=(0.5, 1))
    study = rs.study(one, 5, start=start, vary={"task.gain": gains})
    page = opened(rs.export_html(study, tmp_path / "map.html").as_uri())
    assert page.locator("img").count() == page.locator("b", has_text="slow").count() == 0
    assert page.locator(".counts th").count() == 2
