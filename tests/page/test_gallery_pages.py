"""The gallery in a real browser, without a network: its index, and every page that it links."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from page.test_browser import picture

import robsim as rs

pytestmark = pytest.mark.browser
TOOL = Path(__file__).parents[2] / "tools" / "build_gallery.py"
LARGEST = 3_000_000  # bytes of a page
ARRIVED = 44  # of the experiments; the others show what goes wrong


@pytest.fixture(scope="session")
def gallery(tmp_path_factory):
    """The folder of the gallery: the one that stands already, or a new one."""
    if ready := os.environ.get("ROBSIM_GALLERY"):
        return Path(ready)
    folder = tmp_path_factory.mktemp("gallery")
    subprocess.run([sys.executable, "-W", "error", TOOL, folder], check=True, timeout=500)
    return folder


@pytest.fixture
def index(gallery, opened):
    return lambda **options: opened((gallery / "index.html").as_uri(), **options)


def test_the_index_has_a_card_for_every_experiment(index):
    cards = index().locator("a.card")
    links = cards.evaluate_all("all => all.map((each) => each.getAttribute('href'))")
    assert sorted(links) == [f"{name}.html" for name in rs.examples.names()]
    drawn = "all => all.every((each) => each.naturalWidth === 320)"
    assert cards.locator("img").evaluate_all(drawn)
    assert cards.locator(".arrived").count() == ARRIVED


def test_words_in_its_box_leave_the_cards_that_have_them(index):
    page = index()
    for words, left in (("puma 560", 8), ("l DESIRED target", 1), ("zebra", 0), ("", 55)):
        page.locator("#wanted").fill(words)
        assert page.locator(".card:visible").count() == left, words
        assert page.locator("#none").is_visible() == (left == 0)
    assert page.locator("section:visible").count() == 11


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_a_phone_shows_the_whole_width_of_the_index(index, scheme):
    page = index(viewport={"width": 390, "height": 844}, color_scheme=scheme)
    assert page.evaluate("document.documentElement.scrollWidth") <= 390


@pytest.mark.parametrize("name", rs.examples.names())
def test_a_page_gets_ready_and_requests_nothing(gallery, opened, name):
    path = gallery / f"{name}.html"
    assert path.stat().st_size < LARGEST
    page = opened(path.as_uri())
    assert page.locator("#problem").is_hidden()
    assert picture(page).std() > 0.02
    assert page.title() == rs.load_scenario(rs.examples.path(name)).title
