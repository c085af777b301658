"""Requests that the context broker sends: address, head, length."""

from collections.abc import Mapping
from dataclasses import dataclass
from urllib.parse import urlsplit

AGENT = "orion/4.7.0-next libcurl/7.88.1"


@dataclass(frozen=True, slots=True)
class NotificationTarget:
    """Address of a lane's receiver."""

    host: str
    port: int
    tls: bool = False

    @classmethod
    def from_url(cls, url: str) -> "NotificationTarget":
        """The server of an ``http`` or ``https`` address."""
        parts = urlsplit(url)
        tls = parts.scheme == "https"
        return cls(parts.hostname or "", parts.port or (443 if tls else 80), tls)


def write_head(target: str, headers: Mapping[str, str]) -> bytes:
    """The part of a POST's head that does not change; no header is empty."""
    lines = [f"{name}: {value}" for name, value in headers.items() if value]
    return "\r\n".join((f"POST {target} HTTP/1.1", *lines, "")).encode()


def with_length(body: bytes) -> bytes:
    """The last header, the end of the head, and the body."""
    return b"Content-Length: %d\r\n\r\n%b" % (len(body), body)
