"""The page as one HTML document that needs neither a server nor a network."""

from __future__ import annotations

import base64
import hashlib
import html
import re
from functools import cache
from importlib import resources
from typing import Any

from numpy.typing import NDArray

from robsim.page.recording_builder import Recording
from robsim.page.recording_codec import check_recording_size, pack_recording

MODULES = (
    *(
        "unpack",
        "growing",
        "clock",
        "pace",
        "shading",
        "solids",
        "space",
        "layers",
        "picture",
        "charts",
        "constraints",
        "view",
        "time",
    ),
    *("columns", "stamps", "scatter", "shades", "rows", "study"),
    *("quantities", "fields", "why", "gallery", "matrix", "keys", "bar", "pendant"),
    *("link", "handles", "controls", "studio", "main"),
)
STYLES = ("vendor", "page", "why", "gallery", "matrix", "bar", "pendant")
_IMPORT = re.compile(r"^import [^;]*;\n", re.MULTILINE)
_EXPORT = re.compile(r"^export ", re.MULTILINE)


def build_html(recording: Recording) -> str:
    """Return the HTML text of a page that shows a recording.

    The page sends no requests, and its content security policy forbids them. Texts of the recording
    are inserted as data, not as markup.
    """
    data = encode_recording_text(recording.header, recording.arrays, {"poses"})
    return _fill_page_template(recording.header["title"], data, "'none'")


def build_live_html() -> str:
    """Return the HTML text of a page that shows the messages of its own server."""
    return _fill_page_template("RobSim", "", "'self'")


def encode_recording_text(
    header: dict[str, Any], arrays: dict[str, NDArray[Any]], quantised: set[str], level: int = 9
) -> str:
    """Return a recording as base64 text, which cannot end the script element that contains it.

    Raise InputError if the arrays are larger than a page can hold.
    """
    check_recording_size(arrays)
    return base64.b64encode(pack_recording(header, arrays, quantised, level)).decode()


def _fill_page_template(title: str, recording: str, connect_source: str) -> str:
    """Return the page with a recording; its policy permits connections to `connect_source` only."""
    parts = {
        "title": html.escape(title),
        "policy": _build_policy(connect_source),
        "style": _read_page_style(),
        "recording": recording,
        "script": _join_page_modules(),
    }
    return re.sub(r"\{(\w+)\}", lambda match: parts[match[1]], _read_page_asset("page.html"))


def _build_policy(connect_source: str) -> str:
    """Return the content security policy of the page."""
    own = {
        "script-src": _hash_text(_join_page_modules()),
        "style-src": _hash_text(_read_page_style()),
    }
    data = {"img-src": "data: blob:", "font-src": "data:"}
    never = dict.fromkeys(("base-uri", "form-action"), "'none'")
    rules = {"default-src": "'none'", **own, **data, "connect-src": connect_source, **never}
    return "; ".join(f"{name} {value}" for name, value in rules.items())


def _hash_text(text: str) -> str:
    """Return the hash of a text, as a source of a content security policy."""
    return f"'sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()}'"


@cache
def _read_page_style() -> str:
    """Return the style sheets in one text."""
    return "".join(_read_page_asset(f"{name}.css") for name in STYLES)


@cache
def _join_page_modules() -> str:
    """Return all modules in one scope, without imports and exports; their names must differ."""
    own = (_EXPORT.sub("", _IMPORT.sub("", _read_page_asset(f"{name}.js"))) for name in MODULES)
    names = "const { THREE, OrbitControls, TransformControls, uPlot, GUI } = vendor;\n"
    return f'"use strict";(() => {{\n{_read_page_asset("vendor.js")}\n{names}{"".join(own)}}})();'


def _read_page_asset(name: str) -> str:
    """Return the text of a file of the folder static."""
    return (resources.files(__package__) / "static" / name).read_text(encoding="utf-8")
