"""Answers of HTTP: each with the headers that keep other pages out, and none with a secret."""

from __future__ import annotations

from dataclasses import dataclass
from http import HTTPStatus

POLICY = "Content-Security-Policy"
_ALWAYS = {
    POLICY: "default-src 'none'; frame-ancestors 'none'",
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cache-Control": "no-store",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Connection": "close",
}


@dataclass(frozen=True)
class Answer:
    """A status, a body and its media type, and headers beyond those of every answer."""

    status: HTTPStatus
    body: bytes
    media: str = "text/plain; charset=utf-8"
    headers: tuple[tuple[str, str], ...] = ()

    def serialized(self) -> bytes:
        """Return the bytes that are sent."""
        content = {"Content-Type": self.media, "Content-Length": str(len(self.body))}
        lines = {**_ALWAYS, **content, **dict(self.headers)}
        head = [f"HTTP/1.1 {self.status.value} {self.status.phrase}"]
        head += [f"{name}: {value}" for name, value in lines.items()]
        return "\r\n".join([*head, "", ""]).encode("latin-1") + self.body


class Refused(Exception):
    """A request that is not granted, and the sentence that says why."""

    def __init__(self, status: HTTPStatus, why: str, *headers: tuple[str, str]) -> None:
        super().__init__(why)
        self.answer = Answer(status, f"{why}\n".encode(), headers=headers)
