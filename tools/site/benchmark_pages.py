"""Pages of the benchmarks: one a section of benchmarks/README.md, with plots of its tables."""

import re
import shutil
from dataclasses import dataclass
from pathlib import Path

from benchmark_plots import PLOTS, draw_plot
from markdown_tables import read_tables

ROOT = Path(__file__).parents[2]
README = ROOT / "benchmarks/README.md"
FIRST = "step_of_the_loop"  # the plot of the index


@dataclass(frozen=True)
class Section:
    """A section of second level: its title and its text."""

    title: str
    text: str

    @property
    def name(self) -> str:
        """The name of the file of its page, without the ending."""
        return re.sub(r"\W+", "_", self.title.lower())


def write_benchmark_pages(folder: Path) -> list[str]:
    """Write a page for each section and an index, and return the names of the files.

    The folder stands for docs/benchmarks. The index has the first name.
    """
    folder.mkdir(parents=True, exist_ok=True)
    intro, sections = read_sections()
    shutil.copy(README.parent / "scaling.png", folder)
    for section in sections:
        page = format_page(section, sections, folder)
        (folder / f"{section.name}.md").write_text(page, encoding="utf-8")
    (folder / "index.md").write_text(format_index(intro, sections), encoding="utf-8")
    return ["index.md", *(f"{section.name}.md" for section in sections)]


def read_sections() -> tuple[str, list[Section]]:
    """Return the introduction of the README, and its sections."""
    intro, *texts = re.split(r"^## ", README.read_text(encoding="utf-8"), flags=re.M)
    parts = (text.partition("\n") for text in texts)
    return intro, [Section(title, text.strip()) for title, _, text in parts]


def format_page(section: Section, sections: list[Section], folder: Path) -> str:
    """Return the page of a section, and draw its plots into the folder."""
    tables = read_tables(section.text)
    parts = [f"# {section.title}"]
    for plot in PLOTS:
        if plot.section == section.title:
            draw_plot(plot, tables, folder)
            parts.append(format_picture(plot.name, plot.describe(tables)))
    text = section.text
    for each in sections:
        text = text.replace(f"(#{each.name.replace('_', '-')})", f"({each.name}.md)")
    return "\n\n".join([*parts, text]) + "\n"


def format_picture(name: str, text: str) -> str:
    """Return a plot in two forms, for the light and the dark theme."""
    forms = (
        f"```{{image}} {name}_{theme}.svg\n:alt: {text}\n:class: only-{theme}\n```"
        for theme in ("light", "dark")
    )
    return "\n\n".join(forms)


def format_index(intro: str, sections: list[Section]) -> str:
    """Return the index: the main plot, a list of the pages, and the introduction."""
    title, _, text = intro.partition("\n")
    plot = next(each for each in PLOTS if each.name == FIRST)
    measured = next(each for each in sections if each.title == plot.section)
    picture = format_picture(plot.name, plot.describe(read_tables(measured.text)))
    pages = "\n".join(f"- [{each.title}]({each.name}.md)" for each in sections)
    listed = "\n".join(each.name for each in sections)
    toctree = f"```{{toctree}}\n:hidden:\n\n{listed}\n```"
    head = "## Programs\n\n"
    return "\n\n".join([title, picture, pages, head + text.strip(), toctree]) + "\n"
