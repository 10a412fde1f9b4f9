"""The site in a real browser, opened from its folder without a network."""

import os
import subprocess
import sys
from importlib.resources import files
from pathlib import Path

import pytest
from page.tabs import Tabs
from page.test_browser import picture
from page.waiting import until

import robsim as rs

pytestmark = pytest.mark.browser
TOOL = Path(__file__).parents[2] / "tools" / "build_site.py"
LARGEST = 3_000_000  # bytes of a page
ARRIVED = 44  # of the experiments; the others show what goes wrong
PHONE = {"width": 390, "height": 844}
PAGES = (  # one of each kind
    *("index", "begin/index", "begin/own_arm", "howto/errors", "explanation/interaction_matrices"),
    *("gallery/large_rolls", "examples/quickstart", "experiments/index", "experiments/car"),
    *("reference/index", "reference/robsim/IBVS", "benchmarks/index"),
)
DARK = ("index", "begin/own_arm", "gallery/large_rolls", "examples/quickstart", "experiments/car")
SCHEMES = [*((name, "light") for name in PAGES), *((name, "dark") for name in DARK)]


@pytest.fixture(scope="session")
def site(tmp_path_factory):
    """The folder of this version's site: the one that stands already, or a new one."""
    folder = os.environ.get("ROBSIM_SITE")
    if folder is None:
        folder = tmp_path_factory.mktemp("site")
        subprocess.run([sys.executable, TOOL, folder], check=True, timeout=500)
    return Path(folder).resolve() / rs.__version__


@pytest.fixture
def visit(chromium, site):
    """Open a page of the site; fail if it complains or requests anything but files of the site."""
    complaints = []
    tabs = Tabs(
        chromium,
        console=lambda m: complaints.append(m.text) if m.type == "error" else None,
        pageerror=lambda error: complaints.append(str(error)),
        request=lambda r: None if is_own(r.url) else complaints.append(r.url),
    )

    def open_page(name, **options):
        page = tabs.take(**options, offline=True)
        address, _, words = name.partition("?")
        page.goto((site / f"{address}.html").as_uri() + (f"?{words}" if words else ""))
        until(page, "document.body.dataset.ready")
        return page

    def is_own(url):
        return url.startswith((site.parent.as_uri(), "data:", "blob:"))

    yield open_page
    tabs.leave()
    assert not complaints


@pytest.mark.parametrize(("name", "scheme"), SCHEMES)
def test_a_page_is_readable(visit, name, scheme):
    """Contrast, order of headings, alternative texts and names of controls, as axe checks them."""
    page = visit(name, color_scheme=scheme)
    page.evaluate(files("axe_playwright_python").joinpath("axe.min.js").read_text("utf-8"))
    rules = {"runOnly": ["wcag2a", "wcag2aa", "best-practice"], "iframes": False, "preload": False}
    found = page.evaluate("(rules) => axe.run(document, rules)", rules)["violations"]
    assert [(each["id"], each["nodes"][0]["html"]) for each in found] == []
    assert page.evaluate("document.documentElement.dataset.theme") == scheme


@pytest.mark.parametrize("name", PAGES)
def test_a_phone_shows_the_whole_width_of_a_page(visit, name):
    page = visit(name, viewport=PHONE)
    assert page.evaluate("document.documentElement.scrollWidth") <= PHONE["width"]


def test_an_experiment_plays_once_it_is_seen_and_rests_when_it_is_far_away(visit):
    page = visit("gallery/large_rolls", viewport={"width": 1280, "height": 600})
    figures = page.locator("figure.live")
    assert figures.count() > 2
    figures.last.scroll_into_view_if_needed()
    frame = page.frame_locator("figure.live >> nth=-1 >> iframe")
    frame.locator("body[data-ready=yes].framed").wait_for()
    assert frame.locator("header").is_hidden() and frame.locator("#space canvas").is_visible()
    until(page, "!document.querySelector('figure.live').querySelector('iframe')")
    figures.first.scroll_into_view_if_needed()
    until(page, "document.querySelector('figure.live').classList.contains('playing')")


def test_an_experiment_has_the_colours_of_the_page(visit):
    page = visit("index", color_scheme="dark")
    frame = page.frame_locator("figure.live iframe")
    frame.locator("body[data-ready=yes]").wait_for()
    assert frame.locator("html").get_attribute("data-theme") == "dark"
    page.evaluate("document.documentElement.dataset.theme = 'light'")
    frame.locator("html[data-theme=light]").wait_for()


def test_its_search_works_from_a_folder(visit):
    page = visit("search?q=retreat")
    results = page.locator("#search-results ul.search li a")
    results.first.wait_for()
    assert "gallery/large_rolls.html" in " ".join(
        results.evaluate_all("all => all.map((each) => each.getAttribute('href'))")
    )


def test_each_page_names_the_next(visit):
    """From the first page to the last one of the way in, as a reader clicks."""
    page = visit("begin/install")
    for name in ("first_experiment", "own_arm", "break_it", "many_runs"):
        page.locator("a.right-next").click()
        page.wait_for_url(f"**/begin/{name}.html")


def test_the_index_has_a_card_for_every_experiment(visit):
    cards = visit("experiments/index").locator("a.experiment")
    links = cards.evaluate_all("all => all.map((each) => each.getAttribute('href'))")
    assert sorted(links) == [f"{name}.html" for name in rs.examples.names()]
    assert cards.locator(".arrived").count() == ARRIVED


def test_words_in_its_box_leave_the_cards_that_have_them(visit):
    page = visit("experiments/index")
    for words, left in (("puma 560", 8), ("l DESIRED target", 1), ("zebra", 0), ("", 55)):
        page.locator("#wanted").fill(words)
        assert page.locator(".experiment:visible").count() == left, words
        assert page.locator("#none").is_visible() == (left == 0)
    assert page.locator("article h2:visible").count() == 11


@pytest.mark.parametrize("name", rs.examples.names())
def test_a_live_page_gets_ready_and_requests_nothing(site, opened, name):
    path = site / "live" / f"{name}.html"
    assert path.stat().st_size < LARGEST
    page = opened(path.as_uri())
    assert page.locator("#problem").is_hidden()
    assert picture(page).std() > 0.02
    assert page.title() == rs.load_scenario(rs.examples.path(name)).title


def test_the_folder_opens_at_the_newest_version(chromium, site):
    page = chromium.new_page(offline=True)
    page.goto((site.parent / "index.html").as_uri())
    page.wait_for_url(f"**/{rs.__version__}/index.html")
    assert page.locator(".versions").first.locator("option").all_inner_texts() == [rs.__version__]
    page.close()
