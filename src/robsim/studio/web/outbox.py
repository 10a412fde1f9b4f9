"""What waits to be sent to one page: never much, for a page that falls behind starts anew."""

from __future__ import annotations

import threading
from collections import deque

from websockets.frames import Frame, Opcode

from robsim.studio.web import server_limits


class Outbox:
    """Frames in the order in which they came; any thread may put one in, and none waits."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._frames: deque[bytes] = deque()
        self._size = 0  # bytes
        self._behind = True

    def put(self, frame: bytes) -> None:
        """Keep a frame for the page; where there are too many, drop all: it falls behind."""
        with self._lock:
            if self._behind:
                return
            size = self._size + len(frame)
            full = size > server_limits.QUEUE_BYTES or len(self._frames) >= server_limits.QUEUE
            if self._frames and full:
                self._frames.clear()
                self._size, self._behind = 0, True
            else:
                self._frames.append(frame)
                self._size = size

    def take(self) -> bytes | None:
        """Return the next frame, if any."""
        with self._lock:
            if not self._frames:
                return None
            frame = self._frames.popleft()
            self._size -= len(frame)
            return frame

    def start_anew(self) -> bool:
        """Return whether the page is new or fell behind; what comes from here on is kept."""
        with self._lock:
            behind, self._behind = self._behind, False
            return behind


def encode_websocket_frame(message: str | bytes) -> bytes:
    """Return the WebSocket frame of a message to a page: the same bytes for all of them."""
    text = isinstance(message, str)
    data = message.encode("utf-8") if isinstance(message, str) else message
    return Frame(Opcode.TEXT if text else Opcode.BINARY, data).serialize(mask=False)
