"""The pages of the site in one folder, as Sphinx reads them: copied, generated, linked, ordered."""

import posixpath
import re
import shutil
from collections.abc import Callable
from dataclasses import dataclass, field
from html import escape
from pathlib import Path, PurePosixPath

from benchmark_pages import write_benchmark_pages
from contents import ROOT, Group, read_groups
from example_pages import write_example_pages
from experiment_pages import write_experiment_pages
from live_experiments import LiveExperiment
from page_lengths import write_page_lengths
from reference_split import find_entry_page, split_reference

LIVE = re.compile(r"^<!-- live: (\w+) -->$", re.M)
LINK = re.compile(r"(!?\[(?:[^\[\]]|\[[^\]]*\])*\]\()([^)\s]+)(\))")
FENCE = re.compile(r"^(`{3,}).*?^\1$", re.M | re.S)
LANGUAGES = {".py": "python", ".toml": "toml", ".cpp": "cpp", ".sh": "bash", ".json": "json"}
ROOT_PAGES = ("CHANGELOG.md", "CONTRIBUTING.md", "SECURITY.md")
PICTURES = {".png", ".svg", ".webp", ".gif", ".jpg"}


@dataclass
class SiteSource:
    """The source folder of the site, and the repository's path of each of its pages."""

    folder: Path
    cards: dict[str, LiveExperiment]
    listings: set[str] = field(default_factory=set)  # files of the repository that pages link to
    moved: dict[str, str] = field(default_factory=dict)  # page of a folder: its file in docs/

    def copy_pages(self) -> None:
        """Copy the documentation and the pages at the root of the repository."""
        shutil.copytree(ROOT / "docs", self.folder, ignore=shutil.ignore_patterns("*.py", "*.html"))
        for name in ROOT_PAGES:
            if (ROOT / name).exists():
                shutil.copy(ROOT / name, self.folder / name)
        split_reference(self.folder)
        for page in self.pages():  # X.md beside a folder X becomes its index
            if (self.folder / page).is_dir():
                self.moved[f"{page}/index"] = page
                shutil.move(self.folder / f"{page}.md", self.folder / page / "index.md")

    def pages(self) -> list[str]:
        """Return the names of all pages: paths without the suffix."""
        found = sorted(self.folder.rglob("*.md"))
        return [page.relative_to(self.folder).with_suffix("").as_posix() for page in found]

    def link_pages(self) -> None:
        """Rewrite the links and the live experiments of all pages."""
        for page in self.pages():
            path = self.folder / f"{page}.md"
            text = path.read_text(encoding="utf-8")
            text = _outside_code(text, lambda part, page=page: self._link(part, page))
            path.write_text(text, encoding="utf-8")

    def _link(self, text: str, page: str) -> str:
        text = LIVE.sub(lambda match: self.live_figure(match[1], page), text)
        return LINK.sub(lambda m: m[1] + self.resolve(m[2], page) + m[3], text)

    def resolve(self, link: str, page: str) -> str:
        """Return a link of a page of the repository as a link of the site."""
        path, _, anchor = link.partition("#")
        if not path or re.match(r"\w+:", link):
            return link
        folder = PurePosixPath(self.moved.get(page, page)).parent
        base = "." if f"{page}.md" in ROOT_PAGES else f"docs/{folder}"
        target = posixpath.normpath(f"{base}/{path}")
        return self._site_path(target, page, anchor)

    def _site_path(self, target: str, page: str, anchor: str) -> str:
        """Return the link from a page to a file of the repository; the file may become a page."""
        inside = target.removeprefix("docs/")
        if inside.endswith("README.md"):  # the first page of the site, or of a folder
            inside, anchor = inside.replace("README.md", "index.md"), ""
        if inside.startswith("examples/"):
            inside = self._find_example(inside)
        bare = inside.removesuffix(".md")
        if entry := find_entry_page(self.folder / bare, anchor):
            inside, anchor = f"{bare}/{entry}", ""
        elif (self.folder / bare / "index.md").exists():
            inside = f"{bare}/index.md"
        elif not (self.folder / inside).exists():
            inside = self._add_file(target)
        relative = posixpath.relpath(inside, PurePosixPath(page).parent)
        return relative + (f"#{anchor}" if anchor else "")

    def _find_example(self, target: str) -> str:
        """Return the page of a script or of the folder of a file; the target if it has none."""
        page = "/".join(PurePosixPath(target).with_suffix("").parts[:2]) + ".md"
        return page if (self.folder / page).exists() else target

    def _add_file(self, target: str) -> str:
        """Add a file of the repository: a picture as it is, other files as pages of their text."""
        path = ROOT / target
        if not path.is_file():
            return target  # Sphinx reports it
        if path.suffix in PICTURES:
            copied = self.folder / "files" / target
            copied.parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(path, copied)
            return f"files/{target}"
        self.listings.add(target)
        return f"files/{target}.md"

    def write_listings(self) -> None:
        """Write a page with the text of each file that pages link to."""
        for target in self.listings:
            text = (ROOT / target).read_text(encoding="utf-8")
            language = LANGUAGES.get(Path(target).suffix, "text")
            page = self.folder / "files" / f"{target}.md"
            page.parent.mkdir(parents=True, exist_ok=True)
            body = (
                f"---\norphan: true\n---\n\n# {target}\n\n````{language}\n{text.rstrip()}\n````\n"
            )
            page.write_text(body, encoding="utf-8")

    def live_figure(self, name: str, page: str) -> str:
        """Return the figure of a live experiment: a picture, in front of it the page once seen."""
        if name not in self.cards:
            raise LookupError(f"{page}.md: no shipped experiment {name!r}")
        card = self.cards[name]
        title, ending = escape(card.title), escape(card.ending)
        live = posixpath.relpath(f"live/{name}", PurePosixPath(page).parent)
        return (
            f'```{{raw}} html\n<figure class="live" data-page="{live}.html">'
            f'<div class="stage"><img src="{live}.webp" alt="{escape(card.picture_text)}" '
            'width="960" height="540" loading="lazy"></div>'
            f'<figcaption><a href="{live}.html">{title}</a>: {ending}. '
            f"<code>robsim examples {name}</code></figcaption></figure>\n```\n"
        )

    def order_pages(self, groups: list[Group]) -> None:
        """Write the table of contents: of the site, of each group, and of each folder."""
        placed = [self.find_page(page) for group in groups for page in group.pages]
        folders = [page for page in self.pages() if page.endswith("/index")]
        texts = {page: (self.folder / f"{page}.md").read_text(encoding="utf-8") for page in folders}
        for group in groups:
            self._write_group(group)
        for page, text in texts.items():
            if "{toctree}" not in text:  # some have short titles in their own
                self._order_folder(page, text, placed)
        titles = [f"{group.title} </{group.name}/index>" for group in groups]
        _append_toctree(self.folder / "index.md", titles)

    def find_page(self, name: str) -> str:
        """Return the page of a name in the table of contents; of a folder, its index."""
        return f"{name}/index" if (self.folder / name).is_dir() else name

    def _write_group(self, group: Group) -> None:
        """Write the page of a group unless it has one, and its table of contents."""
        path = self.folder / group.name / "index.md"
        if not path.exists():
            path.parent.mkdir(exist_ok=True)
            path.write_text(f"# {group.title}\n\n{group.about}\n\n{self._cards(group)}", "utf-8")
        pages = [self.find_page(page) for page in group.pages]
        _append_toctree(path, [f"/{page}" for page in pages if page != f"{group.name}/index"])

    def _cards(self, group: Group) -> str:
        """Return a list of the pages of a group with their first sentences."""
        lines = []
        for page in map(self.find_page, group.pages):
            title, about = read_summary((self.folder / f"{page}.md").read_text(encoding="utf-8"))
            lines.append(f"- [{title}](/{page}.md)\n\n  {about}\n")
        return "\n".join(lines)

    def _order_folder(self, index: str, text: str, placed: list[str]) -> None:
        """Append the pages of a folder to its index, in the order in which its text links them."""
        folder = index.removesuffix("/index")
        links = re.findall(r"(?:\]\(|href=\")([\w/.-]+)\.(?:md|html)", text)
        linked = [posixpath.normpath(f"{folder}/{link}") for link in links]
        below = [page for page in self._pages_in(folder) if page != index and page not in placed]
        below.sort(key=lambda page: (linked.index(page) if page in linked else len(linked), page))
        if below:
            _append_toctree(self.folder / f"{index}.md", [f"/{page}" for page in below])

    def _pages_in(self, folder: str) -> list[str]:
        """Return the pages in a folder, and the indexes of the folders in it."""
        here = re.compile(re.escape(folder) + r"/[\w-]+(/index)?")
        return [page for page in self.pages() if here.fullmatch(page)]


def write_source(folder: Path, cards: list[LiveExperiment]) -> None:
    """Write the source of the whole site."""
    source = SiteSource(folder, {card.name: card for card in cards})
    source.copy_pages()
    write_experiment_pages(folder / "experiments", cards)
    write_example_pages(folder / "examples")
    write_benchmark_pages(folder / "benchmarks")
    write_page_lengths(folder / "page_lengths.md")
    source.link_pages()
    source.write_listings()
    source.order_pages(read_groups())


def read_summary(text: str) -> tuple[str, str]:
    """Return the title of a page, and its first paragraph up to its first sentence's end."""
    title, rest = re.search(r"^# ([^\n]+)\n(.*)", text, re.M | re.S).groups()
    texts = (part for part in rest.split("\n\n") if re.match(r"[A-Z`*\[]", part.strip()))
    paragraph = next(texts, "")
    sentence = re.split(r"(?<=[.:]) (?=[A-Z])", " ".join(paragraph.split()))[0]
    return title, re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", sentence)


def _append_toctree(path: Path, entries: list[str]) -> None:
    """Append a table of contents, which only the side bar shows, to a page."""
    lines = "\n".join(entries)
    text = path.read_text(encoding="utf-8").rstrip()
    path.write_text(f"{text}\n\n```{{toctree}}\n:hidden:\n\n{lines}\n```\n", encoding="utf-8")


def _outside_code(text: str, change: Callable[[str], str]) -> str:
    """Change the parts of a page that are no code."""
    parts, last = [], 0
    for match in FENCE.finditer(text):
        parts += [change(text[last : match.start()]), match[0]]
        last = match.end()
    return "".join([*parts, change(text[last:])])
