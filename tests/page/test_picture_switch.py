"""The rendered picture beneath the marks in a real browser, and the buttons that choose it."""

import numpy as np
import pytest
from page.posters import decode, draw_noise, hang_poster, read_pictures
from page.waiting import until

import robsim as rs
from robsim.page.export import embed_page, export_html, load_recording

pytestmark = pytest.mark.browser

POINTS = [(40, 30), (600, 40), (320, 140), (60, 420), (580, 400)]  # pixels of the camera, off marks
GREYS = """(points) => points.map(([x, y]) => {
  const picture = robsim.pictures[0];
  const [left, top] = picture.bounds;
  const at = [x - left, y - top].map((each) => Math.round(each * picture.scale));
  return [...picture.canvas.getContext("2d").getImageData(...at, 1, 1).data.slice(0, 3)];
})"""
DECODED = """() => {
  const image = robsim.pictures[0].image;
  const canvas = document.createElement("canvas");
  [canvas.width, canvas.height] = [image.width, image.height];
  const pen = canvas.getContext("2d");
  pen.drawImage(image, 0, 0);
  const { data } = pen.getImageData(0, 0, canvas.width, canvas.height);
  return [...data].filter((_, i) => i % 4 === 0);
}"""
PRESSED = "document.querySelector('.layers [aria-pressed=true]').textContent"


@pytest.fixture(scope="module")
def poster_page(tmp_path_factory):
    run = hang_poster(draw_noise((6, 8))).run(duration=4.0)
    return export_html(run, tmp_path_factory.mktemp("page") / "poster.html")


def choose(page, mode):
    page.get_by_role("button", name=mode, exact=True).click()
    until(page, f"{PRESSED} === '{mode}'")


def read_greys(page, size=(240, 320)):
    """The picture beneath the marks, decoded by the page."""
    until(page, "robsim.pictures[0].image")
    return np.reshape(page.evaluate(DECODED), size)


def test_the_picture_and_its_difference_are_beneath_the_marks(opened, poster_page):
    page = opened(poster_page.as_uri())
    stored = read_pictures(load_recording(poster_page))
    goal = decode(stored["goal"]).astype(float)
    assert page.evaluate(PRESSED) == "picture"
    for k in (0, len(stored["instants"]) // 2, -1):
        page.evaluate(f"robsim.clock.step({stored['instants'][k]} - robsim.clock.index)")
        grey = decode(stored["images"][k])
        until(page, f"robsim.layers.get('camera').decoded.get(`{stored['images'][k]}`)")
        np.testing.assert_array_equal(read_greys(page), grey)
        colors = np.array(page.evaluate(GREYS, POINTS))
        free = np.ptp(colors, axis=1) == 0  # of the coloured paths
        expected = [int(grey[y // 2, x // 2]) for x, y in POINTS]
        assert free.sum() >= 3 and (abs(colors[:, 0] - expected)[free] < 12).all()
        choose(page, "difference")
        until(page, "robsim.layers.get('camera').differences.size > 0")
        np.testing.assert_allclose(read_greys(page), 127 + (grey - goal) / 2, atol=0.51)
        choose(page, "picture")
    choose(page, "marks")
    assert page.evaluate(GREYS, POINTS) == [[255, 255, 255]] * len(POINTS)
    choose(page, "picture")
    page.evaluate("robsim.layers.get('camera').instants[0] = 1; robsim.clock.seek(0)")
    assert page.evaluate("robsim.pictures[0].image") is None  # before the first picture


def test_the_choice_is_made_by_keys_and_remembered(opened, poster_page):
    page = opened(poster_page.as_uri())
    page.locator("h1").click()
    page.keyboard.press("p")
    assert page.evaluate(PRESSED) == "difference"
    page.keyboard.press("p")
    assert page.evaluate(PRESSED) == "marks"
    page.locator(".layers button").first.focus()
    page.keyboard.press("Tab")
    page.keyboard.press("Enter")
    assert page.evaluate(PRESSED) == "picture"
    choose(page, "difference")
    page.reload()
    until(page, "document.body.dataset.ready")
    assert page.evaluate(PRESSED) == "difference"


def test_bodies_alone_are_shown_on_demand_and_one_switch_serves_several_cameras(opened, tmp_path):
    run = rs.load_scenario(rs.examples.path("stereo_in_hand")).run(duration=0.4)
    page = opened(export_html(run, tmp_path / "stereo.html").as_uri())
    assert page.locator(".layers").count() == 1 and page.evaluate(PRESSED) == "marks"
    choose(page, "picture")
    until(page, "robsim.pictures.every((each) => each.image)")
    box = page.locator(".layers").bounding_box()
    side = page.locator("#side").bounding_box()
    assert box["x"] >= side["x"] and box["x"] + box["width"] <= side["x"] + side["width"]
    assert box["height"] < 40


def test_a_page_without_pictures_has_no_switch(opened, demo_page, tmp_path):
    run = rs.load_scenario(rs.examples.path("visp_tutorial")).run(duration=0.2)
    page = opened(export_html(run, tmp_path / "run.html").as_uri())
    assert page.locator(".layers").count() == 0
    page.keyboard.press("p")
    assert page.evaluate("robsim.choice.mode") is None


def test_a_goal_without_a_picture_has_no_difference(opened, tmp_path):
    watching = rs.load_scenario(rs.examples.path("watching_head"))
    page = opened(export_html(watching.run(duration=0.4), tmp_path / "head.html").as_uri())
    assert page.locator(".layers button").all_inner_texts() == ["marks", "picture"]


def test_the_switch_works_in_a_frame_of_a_notebook(opened, poster_page, tmp_path):
    """The frame has no origin, and therefore no storage."""
    notebook = tmp_path / "notebook.html"
    page = embed_page(poster_page.read_text(encoding="utf-8"))
    notebook.write_text(f"<!doctype html><body data-ready='yes'>{page}", encoding="utf-8")
    frame = opened(notebook.as_uri()).frames[1]
    until(frame, "document.body.dataset.ready")
    stored = read_pictures(load_recording(poster_page))
    first, goal = (decode(each).astype(float) for each in (stored["images"][0], stored["goal"]))
    frame.get_by_role("button", name="difference", exact=True).click()
    until(frame, "robsim.layers.get('camera').differences.size > 0")
    np.testing.assert_allclose(read_greys(frame), 127 + (first - goal) / 2, atol=0.51)
