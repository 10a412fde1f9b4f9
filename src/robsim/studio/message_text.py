"""Messages to pages, as JSON texts."""

from __future__ import annotations

import json
from typing import Any

LARGEST = 65_536  # size of a message, characters
PART = 60_000  # largest part of a recording in a message, characters


def encode_message(kind: str, **content: Any) -> str:  # Any: JSON
    """Return a message of a type as JSON.

    >>> encode_message("state", playing=True)
    '{"type": "state", "playing": true}'
    """
    return json.dumps({"type": kind, **content}, ensure_ascii=False, allow_nan=False)


def encode_recording_parts(kind: str, recording: str) -> list[str]:
    """Return the messages of a type with consecutive parts of a recording, as "part" of "parts".

    >>> [len(each) for each in encode_recording_parts("replay", "A" * 100_000)]
    [60058, 40058]
    """
    pieces = [recording[i : i + PART] for i in range(0, len(recording), PART)]
    return [
        encode_message(kind, recording=piece, part=i, parts=len(pieces))
        for i, piece in enumerate(pieces)
    ]
