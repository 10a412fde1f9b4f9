"""The XML of OpenCV's FileStorage as plain tables, numbers and texts."""

from __future__ import annotations

from typing import Any

from robsim.base.errors import FileError, format_value
from robsim.base.xml_elements import Element, parse_xml
from robsim.vision.camera_files.yaml_text import parse_plain_scalar

XML_ROOT = "opencv_storage"


def parse_xml_table(data: bytes, source: str) -> dict[str, Any]:
    """Return the content of an XML text as tables; the data of a matrix is a list.

    FileError is raised for other XML, another root, or an element that occurs twice.
    """
    root = parse_xml(data, source, f"<{XML_ROOT}>")
    if root.tag != XML_ROOT:
        raise FileError(
            f"{source}:{root.line}: <{root.tag:.40}>: expected <{XML_ROOT}>, the root of OpenCV"
        )
    return _element_table(root, source)


def _element_table(element: Element, source: str) -> dict[str, Any]:
    """Return the children of an element as a table."""
    table: dict[str, Any] = {}
    for child in element.children:
        if child.tag in table and child.tag != "_":  # <_> is an item of a list
            raise FileError(f"{source}:{child.line}: {format_value(child.tag)} occurs twice")
        table[child.tag] = (
            _element_table(child, source) if child.children else _element_value(child)
        )
    return table


def _element_value(element: Element) -> Any:
    """Return the number or the text of an element, or a list of several numbers."""
    words = element.text.split()
    if element.tag == "data" or (len(words) > 1 and not element.text.startswith('"')):
        return [parse_plain_scalar(word) for word in words]
    return parse_plain_scalar(element.text.strip('"')) if words else None
