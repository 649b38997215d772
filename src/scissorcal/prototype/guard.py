"""Who may see the page: only who has its address, from a browser that stands on the page itself."""

import hmac
import secrets
from dataclasses import dataclass, field

from aiohttp import web
from aiohttp.typedefs import Handler, Middleware

HOSTS = ("127.0.0.1", "localhost")
HEADERS = {
    "Cache-Control": "no-store",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Referrer-Policy": "no-referrer",
    "Server": "scissorcal",
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
}
"""Of every answer. There is none that would let another site read it (CORS)."""


@dataclass
class Guard:
    """Checks each request before anything else does: its host, its origin, and its token.

    The host keeps out names that another site made point here (DNS rebinding), the origin keeps out
    pages of other sites, which a browser lets open sockets to anywhere, and the token keeps out
    everybody else on this computer. Whatever is wrong, the answer is the same: 403, no more.
    """

    port: int = 0
    token: str = field(default_factory=lambda: secrets.token_urlsafe(32))
    policy: str = "default-src 'none'"

    def admits(self, request: web.Request) -> bool:
        """Whether a request comes from this page, or from who was given its address."""
        own = [f"{host}:{self.port}" for host in HOSTS]
        hosts = request.headers.getall("Host", [])
        origins = request.headers.getall("Origin", [])
        if len(hosts) != 1 or hosts[0].lower() not in own:
            return False
        if origins and origins != [f"http://{hosts[0].lower()}"]:
            return False
        return self._is_token(request.query.getall("token", []))

    def _is_token(self, given: list[str]) -> bool:
        """Compare in a time that does not depend on how much of it is right."""
        one = given[0] if len(given) == 1 else ""
        return hmac.compare_digest(one.encode("utf-8", "replace"), self.token.encode())

    def middleware(self) -> Middleware:
        """Refuses what is not admitted, whatever path it names."""

        @web.middleware
        async def guarded(request: web.Request, handler: Handler) -> web.StreamResponse:
            if not self.admits(request):
                return web.Response(status=403, text="Forbidden\n")
            return await handler(request)

        return guarded

    async def put_headers(self, request: web.Request, response: web.StreamResponse) -> None:
        """For ``on_response_prepare``: the headers of every answer, errors and sockets included."""
        response.headers.update(HEADERS)
        response.headers["Content-Security-Policy"] = f"{self.policy}; frame-ancestors 'none'"
