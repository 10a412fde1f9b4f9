"""Each published result has its scenario, script, figure, test and paragraph."""

import re
import shlex
from pathlib import Path

import pytest
from matplotlib.image import imread

import robsim as rs

ROOT = Path(__file__).parents[2]
INDEX, *PAGES = sorted((ROOT / "docs/gallery").glob("*.md"), key=lambda p: p.stem != "index")
SECTIONS = {
    page.name: re.split(r"^## ", page.read_text(encoding="utf-8"), flags=re.M)[1:] for page in PAGES
}
ITEMS = {
    re.search(r"\((\w+)\.png\)", item)[1]: item for items in SECTIONS.values() for item in items
}
TESTS = "".join(path.read_text(encoding="utf-8") for path in (ROOT / "tests").rglob("test_*.py"))


def commands(item):
    for line in re.findall(r"^robsim (?:run|compare) (.*)$", item, re.M):
        name, *more = shlex.split(line)
        pairs = zip(more[::2], more[1::2], strict=True)
        yield name.removesuffix(".toml"), [value for option, value in pairs if option == "--set"]


def assert_for_slides(path):
    """Wide enough to be read on a wall, and still quick to load."""
    assert path.stat().st_size < 250_000
    assert imread(path).shape[1] >= 1600


@pytest.mark.filterwarnings("ignore::robsim.base.errors.RankWarning")  # of a unicycle, on purpose
@pytest.mark.parametrize("name", ITEMS)
def test_it_is_whole(name):
    item = ITEMS[name]
    assert_for_slides(ROOT / f"docs/gallery/{name}.png")
    assert (ROOT / f"examples/{name}.py").exists() and f"(../../examples/{name}.py)" in item
    runs = list(commands(item))
    assert runs, "no command"
    for scenario, changes in runs:
        rs.load_scenario(rs.examples.path(scenario), changes).check()
    assert any(f'"{scenario}"' in TESTS for scenario, _ in runs)


def test_the_index_lists_every_result_once():
    rows = re.findall(r"^\| \[(.+)\]\((\w+\.md)#([\w-]+)\) \| \S", INDEX.read_text("utf-8"), re.M)
    heads = [(item.partition("\n")[0], name) for name in SECTIONS for item in SECTIONS[name]]
    assert sorted((title, page) for title, page, _ in rows) == sorted(heads)
    for title, _, anchor in rows:
        assert anchor == re.sub(r"[^\w -]", "", title.lower()).replace(" ", "-")


def test_every_result_of_a_scenario_shows_it_once_on_its_page():
    for items in SECTIONS.values():
        live = re.findall(r"^<!-- live: (\w+) -->$", "".join(items), re.M)
        shown = {scenario for item in items for scenario, _ in commands(item)}
        assert sorted(live) == sorted(shown) and set(live) <= set(rs.examples.names())


def test_no_figure_is_left_over():
    assert {path.stem for path in (ROOT / "docs/gallery").glob("*.png")} == set(ITEMS)


@pytest.mark.parametrize("name", sorted(path.name for path in (ROOT / "docs/figures").iterdir()))
def test_figures_of_the_pages_are_for_slides(name):
    assert_for_slides(ROOT / "docs/figures" / name)
