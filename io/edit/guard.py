"""Access control of the server: it answers only its own page, which knows the token.

Any program on the machine can send requests to a port of 127.0.0.1: those of other users, and every page that is open
in the browser.
"""

from __future__ import annotations

import secrets
from typing import Any

from starlette.datastructures import Headers
from starlette.responses import PlainTextResponse
from starlette.types import ASGIApp, Receive, Scope, Send

POLICY = {
    "Content-Security-Policy": "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob: data:; "
    "connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cache-Control": "no-store",
}


class Guard:
    """Refuse, with status 403, all requests except those from its own page to /TOKEN/… at this server's address."""

    def __init__(self, app: ASGIApp, token: str, port: int) -> None:
        self._app, self._token = app, token
        self._hosts = {f"127.0.0.1:{port}", f"localhost:{port}"}

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve one HTTP request or one websocket."""
        if scope["type"] == "lifespan":
            return await self._app(scope, receive, send)
        if self._allowed(scope):
            return await self._app(scope, receive, _with_policy(send))
        if scope["type"] == "websocket":
            await receive()
            return await send({"type": "websocket.close", "code": 1008})  # before it is accepted: 403
        return await PlainTextResponse("forbidden\n", 403, POLICY)(scope, receive, send)

    def _allowed(self, scope: Scope) -> bool:
        headers = Headers(scope=scope)
        host, origin = headers.get("host", ""), headers.get("origin")
        if host not in self._hosts or (origin is None and scope["type"] == "websocket"):
            return False
        if origin is not None and origin != f"http://{host}":
            return False
        if headers.get("sec-fetch-site", "none") not in ("none", "same-origin") and not self._is_visit(
            scope, headers
        ):
            return False
        token = scope["path"].split("/")[1] if scope["path"].startswith("/") else ""
        return secrets.compare_digest(token.encode(), self._token.encode())

    def _is_visit(self, scope: Scope, headers: Headers) -> bool:
        """Return whether a request is for the page itself, in a window or tab: the file from which the browser
        is led to the page counts as another site.
        """
        wanted = headers.get("sec-fetch-mode"), headers.get("sec-fetch-dest")
        is_page = scope["path"].split("/")[2:] == [""]
        return is_page and wanted == ("navigate", "document")


def _with_policy(send: Send) -> Send:
    async def sending(message: Any) -> None:
        if message["type"] == "http.response.start":
            policy_headers = [(name.lower().encode(), value.encode()) for name, value in POLICY.items()]
            message = {**message, "headers": [*message["headers"], *policy_headers]}
        await send(message)

    return sending
