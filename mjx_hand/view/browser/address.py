"""The address that a server of ours answers at, and what is asked of that address and not of another.

Browsers let any page open a websocket to any address. Requests are answered whose `Host` is the server's own (which
keeps out names that an attacker points at this computer, "DNS rebinding"), and of those a browser states an `Origin`
for only the ones of the very page that the server serves (RFC 6455, section 10.2).
"""

import ipaddress
import socket
from urllib.parse import urlsplit

from websockets import Headers

from mjx_hand.errors import InputError

EVERYWHERE = ("", "0.0.0.0", "::")  # addresses that stand for all of this computer


def free_port(host: str, port: int) -> int:
    """The port, or for 0 one that is free; viser would silently take another where it is not.

    Raises:
        InputError: it is taken, or is none.
    """
    if not 0 <= port <= 65535:
        raise InputError(f"cannot serve at {host}:{port}: ports are 0 to 65535; choose another --port")
    with socket.socket() as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind((host, port))
        except OSError as error:
            raise InputError(f"cannot serve at {host}:{port}: {error.strerror}; choose another --port") from None
        return probe.getsockname()[1]


def is_public(host: str) -> bool:
    """Whether other computers can reach a server that listens on this address."""
    try:
        return not ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host != "localhost"


def browser_address(host: str) -> str:
    """What a browser on this computer calls a server that listens on `host`."""
    return "localhost" if host in EVERYWHERE or not is_public(host) else host


class OwnAddress:
    """The names of a server that listens on `host`."""

    def __init__(self, host: str):
        self._names = {"localhost", "127.0.0.1", "::1", host.lower()}
        self._everywhere = host in EVERYWHERE
        if self._everywhere:
            self._names |= {socket.gethostname().lower(), socket.getfqdn().lower()}

    def knows(self, headers: Headers) -> bool:
        """Whether a request is for this server, and from its own page or from no page at all."""
        hosts, origins = headers.get_all("Host"), headers.get_all("Origin")
        if len(hosts) != 1 or len(origins) > 1:
            return False
        try:
            name = urlsplit(f"//{hosts[0]}").hostname or ""
            known = name in self._names or (self._everywhere and _is_address(name))
            return known and all(
                urlsplit(o).scheme in ("http", "https") and urlsplit(o).netloc.lower() == hosts[0].lower()
                for o in origins
            )
        except ValueError:
            return False


def _is_address(name: str) -> bool:
    try:
        ipaddress.ip_address(name)
    except ValueError:
        return False
    return True
