"""Who may talk to the page's server: only the page itself, opened by an address of this machine.

A foreign page may send requests to a loopback address too, and a foreign name may be made to
resolve to a loopback address (DNS rebinding). The browser shows both: by `Origin`, which must be
the page's own, and by `Host`, which must be a literal address, localhost, or the host that was
set.
"""

from __future__ import annotations

from collections.abc import Mapping
from ipaddress import IPv4Address, IPv6Address, ip_address
from urllib.parse import urlsplit


def find_refusal(headers: Mapping[str, str], host: str, acts: bool) -> str | None:
    """Return why a request is refused; None when it may pass.

    headers: of the request.
    host: where the server listens.
    acts: whether the request changes or reveals something that a foreign page must not reach;
        Origin is then required.
    """
    host_header = headers.get("Host", "")
    if not _is_ours(host_header, host):
        return f"Host: expected the address of this server, found {host_header!r}"
    origin = headers.get("Origin")
    if origin is None:
        return "Origin: expected the page of this server, found none" if acts else None
    if origin not in (f"http://{host_header}", f"https://{host_header}"):
        return f"Origin: expected the page of this server, found {origin!r}"
    return None


def is_loopback(host: str) -> bool:
    """Tell whether a host is reached from this machine only."""
    address = _parse_address(host)
    return host == "localhost" or (address is not None and address.is_loopback)


def _is_ours(host_header: str, host: str) -> bool:
    try:
        name = urlsplit(f"//{host_header}").hostname or ""
    except ValueError:
        return False
    if is_loopback(host):
        return is_loopback(name)
    return name in (host.lower(), "localhost") or _parse_address(name) is not None


def _parse_address(host: str) -> IPv4Address | IPv6Address | None:
    try:
        return ip_address(host)
    except ValueError:
        return None
