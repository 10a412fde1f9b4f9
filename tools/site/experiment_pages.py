"""Pages of the shipped experiments: an index with cards, and a live page for each."""

from html import escape
from pathlib import Path

from live_experiments import LiveExperiment

import robsim as rs
from robsim.files.example_groups import GROUPS

FIND = (
    '<p class="find"><label>Find <input id="wanted" type="search" '
    'placeholder="for example mobile, L current, Puma"></label></p>'
    '<p id="none" role="status" hidden>No experiment has all of these words.</p>'
)


def write_experiment_pages(folder: Path, cards: list[LiveExperiment]) -> None:
    """Write the index and the page of each experiment into a folder."""
    folder.mkdir(exist_ok=True)
    for card in cards:
        (folder / f"{card.name}.md").write_text(write_page(card), encoding="utf-8")
    (folder / "index.md").write_text(write_index(cards), encoding="utf-8")


def write_page(card: LiveExperiment) -> str:
    """Return the page of one experiment: its remark, its live page, and its file."""
    file = Path(rs.examples.path(card.name)).read_text(encoding="utf-8").rstrip()
    return (
        f"# {card.title}\n\n<!-- live: {card.name} -->\n\n{card.about}\n\n"
        f"The command `robsim examples {card.name}` copies this file:\n\n```toml\n{file}\n```\n"
    )


def write_index(cards: list[LiveExperiment]) -> str:
    """Return the page with the cards of all experiments in groups."""
    parts = [
        "# Live experiments\n",
        "Each card opens a page that plays one shipped experiment in space, in the image and in",
        "curves: drag the scene, move the slider, and read the file of the experiment.\n",
        f"```{{raw}} html\n{FIND}\n```\n",
    ]
    for group in GROUPS:
        html = "\n".join(write_card(card) for card in cards if card.group == group)
        parts += [f"## {group}\n", f'```{{raw}} html\n<div class="cards">\n{html}\n</div>\n```\n']
    return "\n".join(parts)


def write_card(card: LiveExperiment) -> str:
    """Return a card as HTML."""
    ending = "ending arrived" if card.arrived else "ending"
    return (
        f'<a class="experiment" href="{card.name}.html"><img src="../live/{card.name}.webp" '
        f'alt="{escape(card.picture_text)}" width="960" height="540" '
        f'loading="lazy"><span class="title">{escape(card.title)}</span>'
        f'<span class="{ending}">{escape(card.ending)}</span></a>'
    )
