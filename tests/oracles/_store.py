"""How the generators of this folder write their JSON: full precision, one case per line.

Python writes a float with its shortest exact text, so reading the file gives the same bits back.
"""

import json
from pathlib import Path


def store(name, document):
    """Write `document` as the file `name` beside this script."""
    path = Path(__file__).parent / name
    path.write_text(_text(document, "") + "\n", encoding="utf-8")
    print(f"{path.name}: {path.stat().st_size / 1000:.0f} kB")


def _text(value, indent):
    """JSON text of `value`: what holds cases is broken over lines, a case is one line."""
    inner = indent + " "
    if isinstance(value, dict) and any(_holds_cases(v) for v in value.values()):
        items = [f"{inner}{json.dumps(k)}: {_text(v, inner)}" for k, v in value.items()]
        return "{\n" + ",\n".join(items) + "\n" + indent + "}"
    if _holds_cases(value) and isinstance(value, list):
        return "[\n" + ",\n".join(inner + _text(v, inner) for v in value) + "\n" + indent + "]"
    return json.dumps(value, allow_nan=False)


def _holds_cases(value):
    """True for a list of dicts and for a dict (a group of cases)."""
    return isinstance(value, dict) or (
        isinstance(value, list) and bool(value) and isinstance(value[0], dict)
    )
