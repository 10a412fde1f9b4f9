"""Build the gallery: a page for every shipped experiment, and an index.

python tools/build_gallery.py [FOLDER]          docs/gallery by default, which git ignores

Each page is one HTML file, as `export_html` writes it; the index is one, too. No page loads
anything from a server, so the folder can be opened locally or copied to any web site.
"""

import base64
import hashlib
import re
import sys
import warnings
from dataclasses import dataclass
from html import escape
from pathlib import Path

from gallery_pictures import pictures

import robsim as rs
from robsim.base.atomic_files import write_whole
from robsim.files.example_groups import GROUPS
from robsim.page import load_recording
from robsim.studio.scenario_shelf import ScenarioShelf

HERE = Path(__file__).parent
DEFAULT = HERE.parent / "docs" / "gallery"


@dataclass(frozen=True)
class Card:
    """The card of an experiment in the index, as HTML, and its group."""

    group: str
    html: str


def main() -> None:
    """Build the pages and the index, and print their location."""
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else DEFAULT
    shelf = ScenarioShelf.shipped()
    cards = []
    for entry in shelf.entries:
        cards.append(build(folder, shelf.experiment(entry["name"]), entry))
        print(entry["name"], flush=True)
    write_whole(folder / "index.html", index(cards))
    print(f"{len(cards)} pages: open {folder / 'index.html'}")


def build(folder: Path, experiment: rs.Experiment, entry: dict[str, str]) -> Card:
    """Run an experiment, write its page, and return its card."""
    name = entry["name"]
    with warnings.catch_warnings():
        # some experiments demonstrate a loss of rank
        warnings.simplefilter("ignore", rs.errors.RankWarning)
        run = experiment.run()
    page = load_recording(rs.export_html(run, folder / f"{name}.html")).header
    ending, arrived = page["events"][-1]["text"], page["outcome"] == rs.Outcome.CONVERGED.name
    images = "".join(f'<img src="{each}" alt="">' for each in pictures(experiment, run))
    html = (
        f'<a class="card" href="{name}.html"><span class="pictures">{images}</span>'
        f'<span class="title">{escape(entry["title"])}</span>'
        f'<span class="ending{" arrived" * arrived}">{escape(ending)}</span>'
        f'<span class="about">{escape(entry["about"])}</span></a>'
    )
    return Card(entry["group"], html)


def index(cards: list[Card]) -> str:
    """Return the HTML of the index. Its policy allows its own script and no other resources."""
    style, script = (_read(f"gallery.{kind}") for kind in ("css", "js"))
    policy = (
        f"default-src 'none'; script-src {_hash(script)}; style-src {_hash(style)}; "
        "img-src data:; base-uri 'none'; form-action 'none'"
    )
    groups = "".join(_section(name, cards) for name in GROUPS)
    parts = {"policy": policy, "style": style, "groups": groups, "script": script}
    return re.sub(r"\{(\w+)\}", lambda match: parts[match[1]], _read("gallery.html"))


def _section(group: str, cards: list[Card]) -> str:
    html = "\n".join(card.html for card in cards if card.group == group)
    return f'<section><h2>{escape(group)}</h2><div class="cards">\n{html}\n</div></section>\n'


def _read(name: str) -> str:
    return (HERE / name).read_text(encoding="utf-8")


def _hash(text: str) -> str:
    return f"'sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()}'"


if __name__ == "__main__":
    main()
