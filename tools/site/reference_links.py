"""Links from names in the text, such as `rs.laws.CameraLaw`, to their entries in the reference."""

import re
from typing import Any

from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util.nodes import make_refnode

NAME = re.compile(r"(?:rs|robsim)\.((?:\w+\.)*)(\w+)(?:\(.*\))?")


def setup(app: Sphinx) -> dict[str, bool]:
    """Link the names when a page is written."""
    app.connect("doctree-resolved", link_names)
    return {"parallel_read_safe": True, "parallel_write_safe": True}


def link_names(app: Sphinx, tree: nodes.document, page: str) -> None:
    """Replace the names of a page by links, unless they stand in a link or a title."""
    for literal in list(tree.findall(nodes.literal)):
        if isinstance(literal.parent, nodes.reference | nodes.title):
            continue
        target = find_entry(app.env, literal.astext())
        if target and target != page:
            link = make_refnode(app.builder, page, target, "", literal.deepcopy())
            literal.replace_self(link)


def find_entry(env: Any, text: str) -> str | None:
    """Return the page of a name of the package; None for any other text."""
    match = NAME.fullmatch(text)
    if not match:
        return None
    module, name = match[1].rstrip(".") or "robsim", match[2]
    pages = [f"reference/{module}/{name}", f"reference/{name}" if not match[1] else ""]
    return next((page for page in pages if page in env.found_docs), None)
