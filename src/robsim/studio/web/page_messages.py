"""Messages from pages: JSON objects with finite numbers, of limited depth and rate."""

from __future__ import annotations

import json
import math
import re
from typing import Any

from robsim.studio.web import server_limits

LARGEST = 2**53  # larger integers are not exact numbers in JavaScript


class BadMessage(Exception):
    """Error for an invalid message; its text is the reason."""


def parse_page_message(data: bytes) -> dict[str, Any]:
    """Return the object in a message from a page.

    Raise BadMessage unless the message is a JSON object in UTF-8 with finite numbers and a limited
    depth.

    >>> parse_page_message(b'{"set": "task.gain", "value": 2}')
    {'set': 'task.gain', 'value': 2}
    """
    try:
        text = data.decode("utf-8")
        _check_depth(text)
        value = _DECODER.decode(text)
        json.dumps(value, ensure_ascii=False).encode("utf-8")  # rejects lone surrogates
    except ValueError:
        raise BadMessage("a message must be JSON in UTF-8") from None
    if not isinstance(value, dict):
        raise BadMessage("a message must be a JSON object, such as {...}")
    return value


def encode_error_message(text: str) -> str:
    """Return the message that reports an error to a page."""
    return json.dumps({"error": text})


class MessageBudget:
    """Budget of the messages of a page: RATE per second, and at most BURST at once."""

    def __init__(self) -> None:
        self._left, self._refill_time = server_limits.BURST, -math.inf

    def spend(self, now: float) -> bool:
        """Return whether one more message is permitted at time `now` in seconds."""
        self._left = (
            min(server_limits.BURST, self._left + server_limits.RATE * (now - self._refill_time))
            - 1.0
        )
        self._refill_time = now
        return self._left >= 0.0


def _parse_json_integer(text: str) -> int:
    """Return an integer of a message."""
    if len(text) > len(f"-{LARGEST}") or abs(int(text)) > LARGEST:
        raise BadMessage(f"a whole number in a message must be at most {LARGEST}")
    return int(text)


def _parse_json_float(text: str) -> float:
    """Return a float of a message."""
    value = float(text)
    if not math.isfinite(value):
        raise BadMessage("the numbers in a message must be finite")
    return value


_DECODER = json.JSONDecoder(
    parse_int=_parse_json_integer, parse_float=_parse_json_float, parse_constant=_parse_json_float
)


_TOKENS = re.compile(r'"(?:[^"\\]|\\.)*+"|[\[{]|[\]}]')  # strings and brackets of JSON


def _check_depth(text: str) -> None:
    """Raise BadMessage if arrays and objects nest too deep; the decoder's own limit varies."""
    depth = 0
    for token in _TOKENS.finditer(text):
        depth += (token[0] in "[{") - (token[0] in "]}")
        if depth > server_limits.DEPTH:
            raise BadMessage(f"a message must nest at most {server_limits.DEPTH} deep")
