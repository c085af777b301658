"""Which addresses are of the open internet."""

from ipaddress import IPv4Address, IPv6Address, IPv6Network, ip_address
from typing import Final
from urllib.parse import urlsplit

import httpx

from iveg.domain.errors import OutboundError

Address = IPv4Address | IPv6Address


_NAT64: Final = IPv6Network("64:ff9b::/96")


_UNICAST: Final = IPv6Network("2000::/3")
"""All of IPv6 that was given to the internet; what lies beside it is somebody's own."""


def is_public(address: Address) -> bool:
    """Whether an address is one of the open internet.

    Loopback, link-local (where clouds keep their metadata), private, shared, reserved
    and multicast addresses are not, nor what carries one of them inside.
    """
    carried = _carried(address)
    if carried is not None:
        return is_public(carried)
    if isinstance(address, IPv6Address) and address not in _UNICAST:
        return False
    return address.is_global and not address.is_multicast


def _carried(address: Address) -> IPv4Address | None:
    """The IPv4 address that an IPv6 one stands for."""
    if isinstance(address, IPv4Address):
        return None
    if address in _NAT64:
        return IPv4Address(int(address) & 0xFFFF_FFFF)
    teredo = address.teredo
    return address.ipv4_mapped or address.sixtofour or (teredo and teredo[1])


def https_target(url: str) -> tuple[str, int]:
    """Host and port of an https address.

    Raises:
        OutboundError: it is not one that may be used.
    """
    try:
        parts = urlsplit(url)
        host, port = parts.hostname or "", parts.port or 443
        httpx.URL(url)
    except (ValueError, httpx.InvalidURL):
        raise OutboundError("not_https") from None
    if parts.scheme != "https" or not host or parts.username is not None:
        raise OutboundError("not_https")
    return host, port


def is_public_target(url: str) -> bool:
    """Whether an https address may be used by its looks; names are not resolved."""
    try:
        host, _ = https_target(url)
    except OutboundError:
        return False
    try:
        return is_public(ip_address(host))
    except ValueError:
        return "." in host and not host.endswith((".localhost", ".local", ".internal"))
