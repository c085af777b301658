"""TLS to the broker: whom to trust, and the certificate by which a program is known.

The files are read at each connection, so that a certificate is renewed by replacing
its files; ``MqttLink`` connects anew when they change.
"""

import ssl
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True, slots=True)
class TlsFiles:
    """Files in PEM; each may be empty.

    Attributes:
        authority: Certificates that are trusted; empty: those of the system.
        certificate: Own certificate with its chain; ``key`` its private key.
    """

    authority: str = ""
    certificate: str = ""
    key: str = ""

    def context(self) -> ssl.SSLContext:
        """What a connection needs, as the files are now.

        Raises:
            OSError: a file is missing or is no certificate (``ssl.SSLError``).
        """
        context = ssl.create_default_context(cafile=self.authority or None)
        if self.certificate:
            context.load_cert_chain(self.certificate, self.key or None)
        return context

    def state(self) -> "FileState":
        """Changes when a file is replaced: its time and inode; None: not there."""
        return tuple(map(_state, filter(None, self._files())))

    def _files(self) -> tuple[str, ...]:
        return self.authority, self.certificate, self.key


NO_FILES = TlsFiles()
FileState = tuple[tuple[int, int] | None, ...]


def _state(file: str) -> tuple[int, int] | None:
    try:
        found = Path(file).stat()
    except OSError:
        return None
    return found.st_mtime_ns, found.st_ino
