"""Search of a built site for links to missing files and anchors, and for pictures without texts."""

from dataclasses import dataclass, field
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

LINKS = {"a": "href", "img": "src", "script": "src", "link": "href", "figure": "data-page"}


@dataclass
class PageLinks(HTMLParser):
    """Anchors and links of one page."""

    anchors: set[str] = field(default_factory=set)
    links: list[str] = field(default_factory=list)
    silent: int = 0  # pictures without an alternative text

    def __post_init__(self) -> None:
        """Prepare the parser."""
        super().__init__(convert_charrefs=True)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Note the anchor and the link of an element."""
        found = dict(attrs)
        self.anchors |= {value for key in ("id", "name") if (value := found.get(key))}
        if (key := LINKS.get(tag)) and (link := found.get(key)):
            self.links.append(link)
        self.silent += tag == "img" and not found.get("alt")


def read_links(page: Path) -> PageLinks:
    """Return the anchors and links of a page."""
    found = PageLinks()
    found.feed(page.read_text(encoding="utf-8"))
    return found


def find_broken_links(site: Path) -> list[str]:
    """Return a sentence for each broken link of a site, loaded resource, and silent picture."""
    pages = {page: read_links(page) for page in sorted(site.rglob("*.html"))}
    pages = {p: found for p, found in pages.items() if p.parent.name not in ("live", "_static")}
    broken: list[str] = []
    for page, found in pages.items():
        name = page.relative_to(site)
        problems = (_check(page, link, pages) for link in found.links)
        broken += [f"{name}: {problem}" for problem in problems if problem]
        broken += [f"{name}: {found.silent} pictures have no alternative text"] * bool(found.silent)
    return broken


def _check(page: Path, link: str, pages: dict[Path, PageLinks]) -> str:
    """Return the fault of a link, "" for a good one; links to other sites are not followed."""
    parts = urlsplit(link)
    if parts.scheme or link.startswith("#!"):
        return ""
    target = (page.parent / unquote(parts.path)).resolve() if parts.path else page
    if not target.exists():
        return f"{link} does not exist"
    anchors = pages[target].anchors if target in pages else {parts.fragment}
    if parts.fragment and unquote(parts.fragment) not in anchors:
        return f"{link} has no such anchor"
    return ""
