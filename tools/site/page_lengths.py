"""The pages of more than 1,500 words, each with its length and the reason for it."""

from pathlib import Path

from contents import ROOT, read_reasons

LIMIT = 1500  # words
GENERATED = ROOT / "docs" / "reference"


def count_words() -> dict[str, int]:
    """Return the number of words of each page of docs/ but the entries of the reference."""
    pages = [page for page in (ROOT / "docs").rglob("*.md") if GENERATED not in page.parents]
    names = {page.relative_to(ROOT / "docs").with_suffix("").as_posix(): page for page in pages}
    return {name: len(page.read_text(encoding="utf-8").split()) for name, page in names.items()}


def write_page_lengths(path: Path) -> None:
    """Write the table of the long pages."""
    words = count_words()
    lines = [
        "# Lengths of the pages\n",
        f"A page has at most {LIMIT:,} words, code and tables included, so that it is read in one",
        "sitting. These pages are longer:\n",
        "| page | words | reason |",
        "|---|---|---|",
    ]
    reasons = sorted(read_reasons().items(), key=lambda item: -words[item[0]])
    lines += [f"| [{name}](/{name}.md) | {words[name]:,} | {text} |" for name, text in reasons]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
