"""The source of the site: its order, its links, its long pages, and the check of a built site."""

import sys
from importlib import import_module
from pathlib import Path

import pytest

import robsim as rs

pytestmark = pytest.mark.full  # as other checks of the repository
ROOT = Path(__file__).parents[2]
NAMES = ("contents", "link_check", "page_lengths", "site_source", "site_versions")


@pytest.fixture(scope="module")
def site():
    """The modules of tools/site by name."""
    sys.path.insert(0, str(ROOT / "tools/site"))
    yield {name: import_module(name) for name in NAMES}
    sys.path.remove(str(ROOT / "tools/site"))


@pytest.fixture(scope="module")
def source(site, tmp_path_factory):
    """The source of the site, as Sphinx reads it, with cards of experiments that did not run."""
    card = import_module("live_experiments").LiveExperiment
    names = rs.examples.names()
    cards = [card(name, name, "A remark.", "Missions", "converged", True, False) for name in names]
    folder = tmp_path_factory.mktemp("site") / "source"
    site["site_source"].write_source(folder, cards)
    return folder


def test_every_page_of_more_than_1500_words_has_a_reason(site):
    words = site["page_lengths"].count_words()
    long = {name for name, count in words.items() if count > 1500}
    assert long == set(site["contents"].read_reasons())
    assert sum(words.values()) > 80_000


def test_the_way_in_has_five_pages_which_end_with_the_next_one(site):
    begin, *_ = site["contents"].read_groups()
    assert begin.name == "begin" and len(begin.pages) == 5
    for page, following in zip(begin.pages, begin.pages[1:], strict=False):
        text = (ROOT / f"docs/{page}.md").read_text(encoding="utf-8")
        assert f"]({following.removeprefix('begin/')}.md)" in text.split("\n## ")[-1], page


def test_every_page_is_in_the_table_of_contents_once(source):
    listed = []
    for page in source.rglob("*.md"):
        tables = page.read_text(encoding="utf-8").split("```{toctree}\n:hidden:\n\n")[1:]
        for line in "\n".join(table.split("\n```")[0] for table in tables).splitlines():
            target = line.split("<")[-1].rstrip(">")
            home = source if target.startswith("/") else page.parent
            listed.append(home / f"{target.lstrip('/')}.md")
    pages = {p for p in source.rglob("*.md") if source / "files" not in p.parents}
    assert set(listed) == pages - {source / "index.md"}
    assert len(listed) == len(set(listed)) > 500


def test_every_shipped_experiment_is_alive_on_a_page_of_its_own(source):
    for name in rs.examples.names():
        text = (source / f"experiments/{name}.md").read_text(encoding="utf-8")
        assert f'data-page="../live/{name}.html"' in text
        assert Path(rs.examples.path(name)).read_text(encoding="utf-8").rstrip() in text


@pytest.mark.parametrize(
    ("link", "page", "expected"),
    [
        ("../scenario.md#a-task", "howto/runs", "../scenario.md#a-task"),
        ("reference/laws.md#cameralaw", "servoing", "reference/laws/CameraLaw.md"),
        ("reference/laws.md", "servoing", "reference/laws/index.md"),
        ("../README.md", "seven_steps", "index.md"),
        ("../benchmarks/README.md", "studies", "benchmarks/index.md"),
        ("../examples/car.py", "robots", "examples/car.md"),
        ("../examples/pose_network/train.py", "learned", "examples/pose_network.md"),
        ("../pyproject.toml", "stages", "files/pyproject.toml.md"),
        ("docs/drives.md", "CHANGELOG", "drives.md"),
        ("https://docs.xarray.dev", "studies", "https://docs.xarray.dev"),
        ("#runs", "howto/runs", "#runs"),
    ],
)
def test_a_link_of_the_repository_becomes_one_of_the_site(site, source, link, page, expected):
    made = site["site_source"].SiteSource(source, {})
    made.moved["reference/index"] = "reference"
    assert made.resolve(link, page) == expected


def test_the_check_finds_broken_links_anchors_and_silent_pictures(site, tmp_path):
    (tmp_path / "a.html").write_text(
        '<h1 id="top">a</h1><a href="b.html#there">b</a><a href="b.html#gone">b</a>'
        '<a href="c.html">c</a><a href="https://example.org">e</a><img src="a.html">',
        encoding="utf-8",
    )
    (tmp_path / "b.html").write_text('<p id="there">b</p><img src="a.html" alt="b">', "utf-8")
    assert site["link_check"].find_broken_links(tmp_path) == [
        "a.html: b.html#gone has no such anchor",
        "a.html: c.html does not exist",
        "a.html: 1 pictures have no alternative text",
    ]


def test_the_newest_version_is_opened(site, tmp_path):
    for name in ("0.9.0", "0.10.0", "0.2.1"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "index.html").touch()
    site["site_versions"].write_versions(tmp_path)
    script = (tmp_path / "versions.js").read_text(encoding="utf-8")
    assert script == 'window.ROBSIM_VERSIONS = ["0.10.0", "0.9.0", "0.2.1"];\n'
    assert 'url=0.10.0/index.html"' in (tmp_path / "index.html").read_text(encoding="utf-8")
