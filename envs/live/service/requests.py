"""What a request may be: a page, one of its files, or a websocket, of this server's own address and with its token."""

import hmac
import http
from importlib import resources
from urllib.parse import parse_qs, urlsplit

from websockets import Headers
from websockets.http11 import Request, Response

from mjx_hand.view.browser.address import OwnAddress

VIEW, STATE, HAND = "/view", "/state", "/hand"
SOCKETS = (VIEW, STATE, HAND)
_PAGE = "live.html"
_KINDS = {"html": "text/html", "js": "text/javascript", "css": "text/css"}
# The page runs its own scripts alone, talks to its own server alone, is framed by nobody and tells nobody its address.
_HEADERS = {
    "Content-Security-Policy": "default-src 'self'; img-src 'self' data:; frame-ancestors 'none'",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
    "Cache-Control": "no-store",
}


class Requests:
    """Answers requests for pages; lets websockets in.

    Args:
        host: that the server listens on.
        token: that the address of page and websockets has, as in /?token=…
    """

    def __init__(self, host: str, token: str):
        self._address, self._token = OwnAddress(host), token
        folder = resources.files("envs.live.service") / "page"
        self._files = {f"/{file.name}": file.read_bytes() for file in folder.iterdir() if "." in file.name}

    def answer(self, request: Request) -> Response | None:
        """The answer; None for a websocket that may come in."""
        if not self._address.knows(request.headers):
            return _refusal(http.HTTPStatus.FORBIDDEN, "Only pages of this server's own address are answered.")
        try:
            parts = urlsplit(request.path)
            token = parse_qs(parts.query).get("token", [""])[0]
        except ValueError:
            return _refusal(http.HTTPStatus.BAD_REQUEST, "No address.")
        if parts.path in self._files and parts.path != f"/{_PAGE}":
            return _response(http.HTTPStatus.OK, self._files[parts.path], parts.path)
        if not hmac.compare_digest(token.encode(), self._token.encode()):
            return _refusal(http.HTTPStatus.FORBIDDEN, "The address lacks its token; open the one that was printed.")
        if parts.path in SOCKETS:
            return None
        if parts.path == "/":
            return _response(http.HTTPStatus.OK, self._files[f"/{_PAGE}"], _PAGE)
        return _refusal(http.HTTPStatus.NOT_FOUND, "There is no such page.")


def path_of(request: Request | None) -> str:
    """Of a websocket's request."""
    return urlsplit(request.path).path if request is not None else ""


def _refusal(status: http.HTTPStatus, text: str) -> Response:
    return _response(status, f"{text}\n".encode(), ".txt")


def _response(status: http.HTTPStatus, body: bytes, name: str) -> Response:
    kind = _KINDS.get(name.rpartition(".")[2], "text/plain")
    headers = Headers(_HEADERS | {"Content-Type": f"{kind}; charset=utf-8", "Content-Length": str(len(body))})
    headers["Connection"] = "close"
    return Response(status.value, status.phrase, headers, body)
