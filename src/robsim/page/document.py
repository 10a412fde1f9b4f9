"""The page as one HTML document, which needs neither a server nor a network."""

from __future__ import annotations

import base64
import hashlib
import json
import re
from functools import cache
from importlib import resources
from typing import Any

from robsim.page.packing import check_size, packed
from robsim.page.recording import Recording

MODULES = (
    "unpack",
    "clock",
    "shading",
    "space",
    "picture",
    "charts",
    "main",
)  # after what they import
_IMPORT = re.compile(r"^import [^;]*;\n", re.MULTILINE)
_EXPORT = re.compile(r"^export ", re.MULTILINE)


def document(recording: Recording) -> str:
    """Return the HTML text of a page that shows a recording.

    It makes no request, and its policy lets it make none; every text in it is data.
    """
    check_size(recording.arrays)
    table, numbers = packed(recording.arrays, {"poses"})
    header = {**recording.header, "arrays": table}
    parts = {
        "policy": _policy(),
        "style": _style(),
        "header": _embedded(header),
        "numbers": base64.b64encode(numbers).decode(),
        "script": _script(),
    }
    page = _asset("page.html")
    return re.sub(r"\{(\w+)\}", lambda found: parts[found[1]], page)


def _embedded(value: Any) -> str:
    """Return JSON that cannot end the script element in which it stands."""
    text = json.dumps(value, ensure_ascii=False, allow_nan=False, separators=(",", ":"))
    return text.replace("<", "\\u003c").replace("\u2028", "\\u2028").replace("\u2029", "\\u2029")


def _policy() -> str:
    own = {"script-src": _hash(_script()), "style-src": _hash(_style())}
    data = {"img-src": "data: blob:", "font-src": "data:"}
    never = dict.fromkeys(("connect-src", "base-uri", "form-action"), "'none'")
    rules = {"default-src": "'none'", **own, **data, **never}
    return "; ".join(f"{name} {value}" for name, value in rules.items())


def _hash(text: str) -> str:
    return f"'sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()}'"


@cache
def _style() -> str:
    return _asset("vendor.css") + _asset("page.css")


@cache
def _script() -> str:
    """Return the modules in one scope: they import from each other, and no two names are equal."""
    own = (_EXPORT.sub("", _IMPORT.sub("", _asset(f"{name}.js"))) for name in MODULES)
    names = "const { THREE, OrbitControls, uPlot, GUI } = vendor;\n"
    return f'"use strict";(() => {{\n{_asset("vendor.js")}\n{names}{"".join(own)}}})();'


def _asset(name: str) -> str:
    return (resources.files(__package__) / "static" / name).read_text(encoding="utf-8")
