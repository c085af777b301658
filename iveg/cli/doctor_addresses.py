"""Addresses that the doctor listens at, or names."""

import contextlib
from ipaddress import ip_address

from iveg.settings import Settings

_ANYWHERE = {"0.0.0.0": "127.0.0.1", "::": "::1"}  # noqa: S104 - read, not bound


def bind_to(host: str) -> str:
    """Address to bind; any name but loopback may be a container's or a router's."""
    with contextlib.suppress(ValueError):
        address = ip_address(host)
        if address.is_loopback:
            return host
        return "::" if address.version == 6 else "0.0.0.0"  # noqa: S104
    return "127.0.0.1" if host == "localhost" else "0.0.0.0"  # noqa: S104


def page_url_of(settings: Settings) -> str:
    """Address at which the server answers on this machine."""
    host = _ANYWHERE.get(settings.host, settings.host)
    return f"http://{in_url(host)}:{settings.port}"


def in_url(host: str) -> str:
    """A host as a URL has it; IPv6 in brackets."""
    return f"[{host}]" if ":" in host else host
