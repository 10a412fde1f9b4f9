"""What pages may say: JSON objects of finite numbers, not too deep and not too often."""

from __future__ import annotations

import json
import math
from typing import Any

from robsim.studio.web import server_limits

LARGEST = 2**53  # above which a whole number is no float of a page


class BadMessage(Exception):
    """A message that is not taken, and the words that say why."""


def parse_page_message(data: bytes) -> dict[str, Any]:
    """Return the object in a message from a page.

    BadMessage: not JSON in UTF-8, not an object, too deep, or with a number that is not finite.

    >>> parse_page_message(b'{"set": "task.gain", "value": 2}')
    {'set': 'task.gain', 'value': 2}
    """
    try:
        value = _DECODER.decode(data.decode("utf-8"))
        json.dumps(value, ensure_ascii=False).encode("utf-8")  # half a character is not a text
    except RecursionError:
        raise BadMessage(_DEEP) from None
    except ValueError:
        raise BadMessage("a message is JSON in UTF-8, and this is not") from None
    if not isinstance(value, dict):
        raise BadMessage("a message is a JSON object, such as {...}")
    if _is_nested_too_deep(value):
        raise BadMessage(_DEEP)
    return value


def encode_error_message(words: str) -> str:
    """Return the message that tells a page what was wrong."""
    return json.dumps({"error": words})


class MessageBudget:
    """How many messages a page may still send: RATE a second, and BURST of them at once."""

    def __init__(self) -> None:
        self._left, self._at = server_limits.BURST, -math.inf

    def spend(self, now: float) -> bool:
        """Return whether one more message may come at this time, in seconds."""
        self._left = (
            min(server_limits.BURST, self._left + server_limits.RATE * (now - self._at)) - 1.0
        )
        self._at = now
        return self._left >= 0.0


_DEEP = f"a message nests at most {server_limits.DEPTH} deep"


def _parse_json_integer(text: str) -> int:
    if len(text) > len(f"-{LARGEST}") or abs(int(text)) > LARGEST:
        raise BadMessage(f"a whole number in a message is at most {LARGEST}")
    return int(text)


def _parse_json_float(text: str) -> float:
    value = float(text)
    if not math.isfinite(value):
        raise BadMessage("the numbers in a message are finite")
    return value


_DECODER = json.JSONDecoder(
    parse_int=_parse_json_integer, parse_float=_parse_json_float, parse_constant=_parse_json_float
)


def _is_nested_too_deep(value: Any, left: int = server_limits.DEPTH) -> bool:
    """Return whether arrays and objects nest deeper than DEPTH, and no further look at them."""
    if not isinstance(value, dict | list):
        return False
    inner = value.values() if isinstance(value, dict) else value
    return left == 0 or any(_is_nested_too_deep(each, left - 1) for each in inner)
