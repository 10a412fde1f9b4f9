"""Reading and writing of TOML texts."""

from __future__ import annotations

import os
import re
import sys
import tomllib
from itertools import accumulate, islice
from typing import Any

from robsim.base.decimal_comma import suggest_toml_line
from robsim.base.errors import FileError, format_value
from robsim.base.file_content import read_bytes

Tables = dict[str, Any]
SCHEMA = 1
LARGEST_FILE = 2_000_000  # bytes; the parser takes up to two seconds for them
# the parser is slow for dotted keys of many parts
_PART = r"""(?:"[^"\n]*"|'[^'\n]*'|(?<![\w-])[\w-]+)[ \t]*"""
_LONG_KEY = re.compile(rf"(?:{_PART}\.[ \t]*){{32}}")
_DEEP_KEY = re.compile(rf"^[ \t]*\[{{0,2}}[ \t]*(?:{_PART}\.[ \t]*){{7}}", re.MULTILINE)
MOST_DEEP = 1000  # largest number of deep keys


def read_toml_text(path: str | os.PathLike[str]) -> str:
    """Return the text of a file; FileError if it is missing, a folder, too large or not UTF-8."""
    data = read_bytes(path, "a TOML file", LARGEST_FILE)
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        raise FileError(
            f"{path}: not text: byte {error.start} (line {line}) is not UTF-8; expected a TOML "
            "file in UTF-8"
        ) from None


def parse_toml(text: str, source: str) -> Tables:
    """Return the tables of a TOML text; FileError for invalid TOML or another schema."""
    if len(text) > LARGEST_FILE:
        raise FileError(f"{source}: larger than {LARGEST_FILE // 1_000_000} MB")
    if not text.strip():
        raise FileError(f"{source}: empty; a file starts with schema = {SCHEMA}")
    if long := _LONG_KEY.search(text):
        key, line = format_value(long[0]), _get_line_number(text, long.start())
        raise FileError(f"{source}: invalid key: {key} (line {line})")
    if deep := next(islice(_DEEP_KEY.finditer(text), MOST_DEEP, None), None):
        line = _get_line_number(text, deep.start())
        raise FileError(f"{source}: more than {MOST_DEEP} keys of 8 parts or more (line {line})")
    try:
        tables = tomllib.loads(text)
    except RecursionError:
        line = _get_line_number(text, _find_deepest_bracket(text))
        raise FileError(f"{source}: brackets are nested too deeply (line {line})") from None
    except tomllib.TOMLDecodeError as error:
        end = f"(at line {_get_line_number(text, len(text))}, the end)"
        reason = str(error).replace("(at end of document)", end) + _suggest_line(text, error)
        raise FileError(f"{source}: not valid TOML: {reason}") from None
    except ValueError:
        raise FileError(f"{source}: not valid TOML: {_describe_long_number(text)}") from None
    return _remove_schema(tables, source)


def write_toml(tables: Tables) -> str:
    """Return the TOML text of tables."""
    import tomli_w

    return tomli_w.dumps({"schema": SCHEMA, **tables})


def _describe_long_number(text: str) -> str:
    """Return a message about a number with more digits than Python reads, with its line."""
    most = sys.get_int_max_str_digits()
    match = re.search(rf"[0-9_]{{{most + 1},}}", text)
    at, size = (match.start(), len(match[0])) if match else (0, most + 1)
    return f"a number of {size} digits; at most {most} are read (line {_get_line_number(text, at)})"


def _suggest_line(text: str, error: tomllib.TOMLDecodeError) -> str:
    """Return a message with the corrected line of an error, or "" without a correction."""
    place = re.search(r"line (\d+), column (\d+)", str(error))
    if not place:
        return ""
    return suggest_toml_line(text.splitlines()[int(place[1]) - 1], int(place[2]) - 1)


def _get_line_number(text: str, at: int) -> int:
    return text.count("\n", 0, at) + 1


def _find_deepest_bracket(text: str) -> int:
    """Return the position with the most open brackets."""
    steps = ((char in "[{") - (char in "]}") for char in text)
    depths = list(accumulate(steps))
    return depths.index(max(depths))


def _remove_schema(tables: Tables, source: str) -> Tables:
    if "schema" not in tables:
        raise FileError(f"{source}: schema: missing; the first line must be schema = {SCHEMA}")
    number = tables["schema"]
    if type(number) is not int or number != SCHEMA:
        raise FileError(
            f"{source}: schema: {format_value(number)} is unknown to this version of RobSim; "
            f"it reads schema = {SCHEMA}"
        )
    return {key: part for key, part in tables.items() if key != "schema"}
