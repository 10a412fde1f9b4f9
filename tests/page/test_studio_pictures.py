"""Rendered pictures on the page of a studio: on request alone, and as the hand moves."""

import numpy as np
import pytest
from page.desk import open_desk
from page.drivers import ChromiumDriver
from page.hands import Hands
from page.posters import draw_noise, hang_poster
from page.test_picture_switch import DECODED, choose
from page.waiting import until

import robsim as rs

pytestmark = pytest.mark.browser

LAYER = "robsim.view.layers.get('camera')"
SHOWN = f"{LAYER}?.image && {LAYER}.key === {LAYER}.demanded?.key"  # the picture of the instant


@pytest.fixture
def poster_desk(chromium):
    with open_desk(chromium, hang_poster(draw_noise((6, 8)))) as made:
        yield made


def read_picture(page, size=(240, 320)):
    until(page, SHOWN)
    return np.reshape(page.evaluate(DECODED.replace("robsim.", "robsim.view.")), size)


def draw_now(desk):
    """The picture of the camera at the last instant."""
    live = desk.app.bench.pair.live
    scene = live.experiment.scene
    return scene.picture(live.now.q)


def test_the_picture_follows_the_run_and_the_hand(poster_desk):
    page = poster_desk.page()
    hands = Hands(ChromiumDriver(page))
    first = read_picture(page)
    whole = draw_now(poster_desk)[::2, ::2].astype(float)
    assert np.median(abs(first - whole)) < 3
    hands.ask("{step: 20}")
    until(page, "robsim.clock.index === 20")
    second = read_picture(page)
    assert (abs(second.astype(float) - first) > 20).mean() > 0.05
    hands.pull("objects.square", 30, 10)
    moved = "robsim.state.changes.some((c) => c.path === 'objects.square.position')"
    until(page, moved)
    until(page, f"{LAYER}.demanded.key.endsWith(' ' + robsim.view.version)")
    third = read_picture(page)
    assert (abs(third.astype(float) - second) > 20).mean() > 0.05
    whole = draw_now(poster_desk)[::2, ::2].astype(float)
    assert np.median(abs(third - whole)) < 3
    choose(page, "difference")
    hands.play_to_rest()
    until(page, SHOWN)
    assert abs(read_picture(page) - 127.0).max() <= 1


def test_pictures_are_requested_while_they_are_shown_and_at_most_five_a_second(poster_desk):
    page = poster_desk.page()
    until(page, SHOWN)
    page.evaluate(
        "robsim.sent = [];"
        f"{LAYER}.ask = (wish) => (robsim.sent.push({LAYER}.before), robsim.link.ask(wish))"
    )
    page.evaluate("robsim.link.ask({speed: 1}); robsim.link.ask({play: true})")
    until(page, "robsim.sent.length >= 5")
    sent = page.evaluate("robsim.sent")
    assert np.diff(sent).min() >= 200
    choose(page, "marks")
    count = page.evaluate("robsim.sent.length")
    page.wait_for_timeout(600)
    assert page.evaluate("robsim.sent.length") == count
    assert page.evaluate("robsim.view.pictures[0].image") is None
    choose(page, "picture")
    until(page, f"robsim.sent.length > {count}")


def test_a_studio_without_bodies_has_no_switch(desk):
    page = desk.page()
    assert page.locator("#pictures canvas").count() == 1
    assert page.locator(".layers").count() == 0


def test_a_studio_of_bodies_draws_them_on_demand(chromium):
    experiment = rs.load_scenario(rs.examples.path("stereo_in_hand"))
    with open_desk(chromium, experiment) as desk:
        page = desk.page()
        assert page.locator(".layers").count() == 1
        assert page.evaluate("robsim.view.pictures.every((each) => !each.image)")
        choose(page, "picture")
        until(page, "robsim.view.pictures.every((each) => each.image)")
        sizes = page.evaluate(
            "robsim.view.pictures.map(({ image }) => [image.width, image.height])"
        )
        assert sizes == [[320, 320], [320, 320]]
