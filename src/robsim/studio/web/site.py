"""Addresses of a server: the page, and files for download."""

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
    INTERNAL_ERROR,
    POLICY,
    FailureLog,
    RefusedRequest,
    build_response,
)

SOCKET = "/socket"
_DOWNLOAD = re.compile(r"/download/([a-z0-9_.]{1,64})")
_META = re.compile(r'<meta http-equiv="Content-Security-Policy" content="([^"]*)">')
_T = TypeVar("_T")


class Site:
    """Responses of an app at each address; the app runs in worker threads."""

    def __init__(self, app: App, failures: FailureLog) -> None:
        """Create the pool of worker threads, which start at the first request."""
        self._app, self._failures = app, failures
        self._workers = ThreadPoolExecutor(server_limits.ANSWERS, "robsim-studio-answers")

    async def answer(self, target: str) -> Response:
        """Return the page or a file; raise RefusedRequest if there is none, or if the app fails."""
        match = _DOWNLOAD.fullmatch(target)
        if target == "/":
            return _build_page_response(await self._call_app(self._app.page))
        if target == SOCKET:
            status = HTTPStatus.UPGRADE_REQUIRED
            raise RefusedRequest(status, "This address is for WebSocket.", Upgrade="websocket")
        file = await self._call_app(lambda: self._app.download(match[1])) if match else None
        if not match or file is None:
            raise RefusedRequest(HTTPStatus.NOT_FOUND, "There is nothing under this address.")
        stored_as = await self._call_app(lambda: self._app.file_name(match[1]))
        disposition = f'attachment; filename="{stored_as}"'
        return build_response(HTTPStatus.OK, file[1], file[0], Content_Disposition=disposition)

    def close(self) -> None:
        """End the idle threads; a working thread ends after its task."""
        self._workers.shutdown(wait=False, cancel_futures=True)

    async def _call_app(self, function: Callable[[], _T]) -> _T:
        """Call a function of the app in a worker thread; raise RefusedRequest if it fails."""
        try:
            return await asyncio.get_running_loop().run_in_executor(self._workers, function)
        except UnavailableDownload as reason:
            raise RefusedRequest(HTTPStatus.CONFLICT, str(reason)) from None
        except Exception:  # noqa: BLE001  whatever the app raises, the server goes on
            self._failures.log("a page or a download")
            raise RefusedRequest(HTTPStatus.INTERNAL_SERVER_ERROR, INTERNAL_ERROR) from None


def _build_page_response(text: str) -> Response:
    """Return the response with a page, and a header with its policy, which forbids frames."""
    match = _META.search(text)
    rules = [rule.strip() for rule in match[1].split(";")] if match else ["default-src 'none'"]
    own_rules = [rule for rule in rules if not rule.startswith("connect-src")]
    policy = "; ".join([*own_rules, "connect-src 'self'", "frame-ancestors 'none'"])
    media = "text/html; charset=utf-8"
    return build_response(HTTPStatus.OK, text.encode(), media, **{POLICY: policy})
