"""The XML of OpenCV's FileStorage as plain tables, numbers and texts."""

from __future__ import annotations

from typing import Any

from robsim.base.elements import Element, parsed
from robsim.base.errors import FileError, said
from robsim.vision.camera_files.yaml_text import plain

ROOT = "opencv_storage"


def tables_of(data: bytes, source: str) -> dict[str, Any]:
    """Return what an XML text holds; a list stands for the data of a matrix.

    FileError: no plain XML, another root, an element that occurs twice.
    """
    root = parsed(data, source, f"<{ROOT}>")
    if root.tag != ROOT:
        raise FileError(f"{source}:{root.line}: <{root.tag:.40}>: expected <{ROOT}>, as of OpenCV")
    return _table(root, source)


def _table(element: Element, source: str) -> dict[str, Any]:
    found: dict[str, Any] = {}
    for child in element.children:
        if child.tag in found and child.tag != "_":  # which stands for each item of a list
            raise FileError(f"{source}:{child.line}: {said(child.tag)} occurs twice")
        found[child.tag] = _table(child, source) if child.children else _value(child)
    return found


def _value(element: Element) -> Any:
    """Return the number or the text of an element, or a list of several numbers."""
    words = element.text.split()
    if element.tag == "data" or (len(words) > 1 and not element.text.startswith('"')):
        return [plain(word) for word in words]
    return plain(element.text.strip('"')) if words else None
