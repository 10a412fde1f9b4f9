"""Equations of pages as MathML, which browsers draw without a script or a network."""

import re
from typing import Any

from docutils import nodes
from latex2mathml.converter import convert
from sphinx.application import Sphinx

FUNCTION = re.compile(r'<mi>(sin|cos|tan|cot|ln|exp|det)</mi>(<mo stretchy="false">&#x00028;)?')


def convert_equation(tex: str, display: str) -> str:
    """Return an equation as MathML, with a space around the names of functions."""

    def space(match: re.Match[str]) -> str:
        right = "0" if match[2] else "0.17em"
        return f'<mo lspace="0.17em" rspace="{right}">{match[1]}</mo>{match[2] or ""}'

    return FUNCTION.sub(space, convert(tex, display=display))


def setup(app: Sphinx) -> dict[str, bool]:
    """Register the renderer `mathml`."""
    app.add_html_math_renderer(
        "mathml", inline_renderers=(write_inline, None), block_renderers=(write_block, None)
    )
    return {"parallel_read_safe": True, "parallel_write_safe": True}


def write_inline(writer: Any, node: nodes.math) -> None:
    """Write an equation in a sentence."""
    writer.body.append(convert_equation(node.astext(), "inline"))
    raise nodes.SkipNode


def write_block(writer: Any, node: nodes.math_block) -> None:
    """Write an equation on lines of its own; a wide one scrolls."""
    mathml = convert_equation(node.astext(), "block")
    writer.body.append(f'<div class="equation" tabindex="0">{mathml}</div>\n')
    raise nodes.SkipNode
