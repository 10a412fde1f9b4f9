"""Messages to pages, as JSON texts."""

from __future__ import annotations

import json
from typing import Any


def encode_message(kind: str, **content: Any) -> str:  # Any: JSON
    """Return a message of a type as JSON.

    >>> encode_message("state", playing=True)
    '{"type": "state", "playing": true}'
    """
    return json.dumps({"type": kind, **content}, ensure_ascii=False, allow_nan=False)
