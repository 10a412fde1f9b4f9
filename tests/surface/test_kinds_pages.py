"""The pages of the tables of a scenario file list every kind and every key once."""

import re
from collections import Counter
from pathlib import Path

from robsim.declare import families
from robsim.declare.document import format_markdown_table

FOLDER = Path(__file__).parents[2] / "docs/kinds"
PAGES = {page.stem: page.read_text(encoding="utf-8") for page in FOLDER.glob("*.md")}


def test_every_shipped_kind_has_one_entry():
    heads = Counter(re.findall(r"^##+ `(\w+)`\n\n`(\w+)`: ", "".join(PAGES.values()), re.M))
    shipped = Counter(
        (name, kind.__name__)
        for each in families().values()
        for name, kind in each.kinds.items()
        if name in each.shipped
    )
    assert heads == shipped and heads["ibvs", "IBVS"] == 1 and len(heads) > 100


def test_the_index_links_every_page_and_names_every_kind():
    links = re.findall(r"\]\((\w+)\.md\)", PAGES["index"])
    assert sorted(links) == sorted(PAGES.keys() - {"index"})
    for each in families().values():
        assert all(f"`{name}`" in PAGES["index"] for name in each.shipped)


def read_meanings(text):
    """Key and meaning of each row, without the kinds, to which other tests add their own."""
    rows = [row.split(" | ") for row in text.split("\n") if row.startswith("| `")]
    return sorted((row[0], row[-1]) for row in rows)


def test_shared_and_own_keys_are_the_keys_of_the_class():
    """Of position-based servoing: the rows of both tables are the rows of one whole table."""
    page = PAGES["servo_tasks"]
    shared = page.split("## `")[0]
    own = page.split("## `pbvs`")[1].split("\n## ")[0]
    whole = format_markdown_table(families()["task"].find("pbvs"))
    assert read_meanings(shared + own) == read_meanings(whole)
    assert "`tolerance`" in shared and "`form`" in own
