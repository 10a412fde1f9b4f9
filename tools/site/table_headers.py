"""Names for the empty headers of tables, which programs that read a page aloud need."""

from docutils import nodes
from sphinx.application import Sphinx


def setup(app: Sphinx) -> dict[str, bool]:
    """Name the headers when a page is read."""
    app.connect("doctree-read", name_headers)
    return {"parallel_read_safe": True, "parallel_write_safe": True}


def name_headers(_app: Sphinx, tree: nodes.document) -> None:
    """Put a hidden name into each empty header: of the rows, or of the column."""
    for head in tree.findall(nodes.thead):
        for column, entry in enumerate(head.findall(nodes.entry)):
            if not entry.astext().strip():
                name = "description" if column else "row"
                hidden = nodes.inline("", name, classes=["visually-hidden"])
                entry.append(nodes.paragraph("", "", hidden))
