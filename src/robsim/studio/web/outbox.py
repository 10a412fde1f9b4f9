"""Queue of messages for one page; a delayed page is updated as a whole."""

from __future__ import annotations

import threading
from collections import deque

from websockets.frames import Frame, Opcode

from robsim.studio.web import server_limits


class Outbox:
    """Queue of frames; any thread may add a frame, without waiting."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._frames: deque[bytes] = deque()
        self._size = 0  # bytes
        self._is_delayed = True

    def put(self, frame: bytes) -> None:
        """Add a frame; if there are too many, delete all and mark the page as delayed."""
        with self._lock:
            if self._is_delayed:
                return
            size = self._size + len(frame)
            full = size > server_limits.QUEUE_BYTES or len(self._frames) >= server_limits.QUEUE
            if self._frames and full:
                self._frames.clear()
                self._size, self._is_delayed = 0, True
            else:
                self._frames.append(frame)
                self._size = size

    def take(self) -> bytes | None:
        """Return the next frame, or None."""
        with self._lock:
            if not self._frames:
                return None
            frame = self._frames.popleft()
            self._size -= len(frame)
            return frame

    def start_anew(self) -> bool:
        """Return whether the page is new or delayed; store frames from now on."""
        with self._lock:
            behind, self._is_delayed = self._is_delayed, False
            return behind


def encode_websocket_frame(message: str | bytes) -> bytes:
    """Return the WebSocket frame of a message, which is the same for all pages."""
    text = isinstance(message, str)
    data = message.encode("utf-8") if isinstance(message, str) else message
    return Frame(Opcode.TEXT if text else Opcode.BINARY, data).serialize(mask=False)
