"""The pages of the reference, one for each name: short pages, which open at once."""

import re
from pathlib import Path

ENTRY = re.compile(r"^## `(\w+)`\n", re.M)
OWN = re.compile(r"\]\(#(\w[\w-]*)\)")  # in the table of names at the head of a module
ENTRY_LINK = re.compile(r"\]\((?:(\w+)\.md)?#(\w[\w-]*)\)")


def split_reference(folder: Path) -> None:
    """Split the page of each module in FOLDER/reference into the pages of its names."""
    modules = sorted((folder / "reference").glob("*.md"))
    names = {page.stem: ENTRY.findall(page.read_text(encoding="utf-8")) for page in modules}
    for page in modules:
        head, *parts = ENTRY.split(page.read_text(encoding="utf-8"))
        entries = dict(zip(parts[::2], parts[1::2], strict=True))
        for name, body in entries.items():
            write_entry(page.with_suffix("") / f"{name}.md", page.stem, name, body, names)
        page.write_text(link_names(head, page.stem, names), encoding="utf-8")


def link_names(head: str, module: str, names: dict[str, list[str]]) -> str:
    """Return the head of a module, its table of names linked to the pages of the names."""

    def page_of(match: re.Match[str]) -> str:
        return f"]({_find(module, match[1], names).removeprefix('../')})"

    return OWN.sub(page_of, head)


def write_entry(path: Path, module: str, name: str, body: str, names: dict[str, list[str]]) -> None:
    """Write the page of one name, its members one level higher."""
    path.parent.mkdir(exist_ok=True)
    body = re.sub(r"^### `\w+\.(\w+)`", r"## `\1`", body, flags=re.M)
    body = ENTRY_LINK.sub(lambda match: f"]({_find(match[1] or module, match[2], names)})", body)
    path.write_text(f"# `{name}`\n\n{body.strip()}\n", encoding="utf-8")


def find_entry_page(folder: Path, anchor: str) -> str | None:
    """Return the page of a name in the folder of its module, by the anchor of the name."""
    found = (page.name for page in folder.glob("*.md") if page.stem.lower() == anchor)
    return next(found, None) if folder.parent.name == "reference" else None


def _find(module: str, anchor: str, names: dict[str, list[str]]) -> str:
    """Return the page of a name in a module, seen from the page of another name."""
    name = next(name for name in names[module] if name.lower() == anchor)
    return f"../{module}/{name}.md"
