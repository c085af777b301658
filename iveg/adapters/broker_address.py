"""The address of a broker, and with what a connection to it is made."""

import ssl
from dataclasses import dataclass
from urllib.parse import unquote, urlsplit

from iveg.adapters.tls import NO_FILES, TlsFiles


@dataclass(frozen=True, slots=True)
class BrokerAddress:
    """Address of the broker, user and password, and the files of TLS."""

    host: str
    port: int
    user: str | None = None
    password: str | None = None
    tls: bool = False
    files: TlsFiles = NO_FILES

    @classmethod
    def from_url(
        cls, url: str, user: str = "", password: str = "", files: TlsFiles = NO_FILES
    ) -> "BrokerAddress":
        """Read ``mqtt://user:password@host:port``; arguments win over the URL."""
        parts = urlsplit(url)
        tls = parts.scheme == "mqtts"
        return cls(
            parts.hostname or "127.0.0.1",
            parts.port or (8883 if tls else 1883),
            user or unquote(parts.username or "") or None,
            password or unquote(parts.password or "") or None,
            tls,
            files,
        )

    def context(self) -> ssl.SSLContext | None:
        """What TLS needs, from the files as they are now; None without TLS.

        Raises:
            OSError: a file is missing or is no certificate.
        """
        return self.files.context() if self.tls else None
