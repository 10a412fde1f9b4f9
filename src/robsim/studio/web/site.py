"""The few addresses under which there is something: the page, and files for download."""

from __future__ import annotations

import asyncio
import re
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from http import HTTPStatus
from typing import TypeVar

from websockets.http11 import Response

from robsim.studio.web import server_limits
from robsim.studio.web.app import App, UnavailableDownload
from robsim.studio.web.http_responses import (
    POLICY,
    WORDS,
    FailureLog,
    RefusedRequest,
    build_response,
)

SOCKET = "/socket"
_DOWNLOAD = re.compile(r"/download/([a-z_.]{1,64})")
_META = re.compile(r'<meta http-equiv="Content-Security-Policy" content="([^"]*)">')
_T = TypeVar("_T")


class Site:
    """What an app has under each address; the app works in threads of its own."""

    def __init__(self, app: App, failures: FailureLog) -> None:
        """Start no thread before something is asked for."""
        self._app, self._failures = app, failures
        self._workers = ThreadPoolExecutor(server_limits.ANSWERS, "robsim-studio-answers")

    async def answer(self, target: str) -> Response:
        """Return the page or a file. Refused: there is none, or the app fails."""
        found = _DOWNLOAD.fullmatch(target)
        if target == "/":
            return _build_page_response(await self._asked(self._app.page))
        if target == SOCKET:
            status = HTTPStatus.UPGRADE_REQUIRED
            raise RefusedRequest(status, "This address is for WebSocket.", Upgrade="websocket")
        file = await self._asked(lambda: self._app.download(found[1])) if found else None
        if not found or file is None:
            raise RefusedRequest(HTTPStatus.NOT_FOUND, "There is nothing under this address.")
        kept = f'attachment; filename="{found[1]}"'
        return build_response(HTTPStatus.OK, file[1], file[0], Content_Disposition=kept)

    def close(self) -> None:
        """Let the threads end; one that is at work for the app ends after that."""
        self._workers.shutdown(wait=False, cancel_futures=True)

    async def _asked(self, question: Callable[[], _T]) -> _T:
        try:
            return await asyncio.get_running_loop().run_in_executor(self._workers, question)
        except UnavailableDownload as reason:
            raise RefusedRequest(HTTPStatus.CONFLICT, str(reason)) from None
        except Exception:  # noqa: BLE001  whatever the app raises, the server goes on
            self._failures.log("a page or a download")
            raise RefusedRequest(HTTPStatus.INTERNAL_SERVER_ERROR, WORDS) from None


def _build_page_response(text: str) -> Response:
    """Return the page with its own policy as a header, where it also keeps out frames."""
    found = _META.search(text)
    rules = [rule.strip() for rule in found[1].split(";")] if found else ["default-src 'none'"]
    kept = [rule for rule in rules if not rule.startswith("connect-src")]
    policy = "; ".join([*kept, "connect-src 'self'", "frame-ancestors 'none'"])
    media = "text/html; charset=utf-8"
    return build_response(HTTPStatus.OK, text.encode(), media, **{POLICY: policy})
