"""Stand-ins for what lies outside iVeg: servers on loopback that keep what came.

They speak TLS with a certificate of their own; ``OutboundHttp`` is told by argument
that loopback may be reached and that this certificate is believed.
"""

import asyncio
import contextlib
import datetime
import ssl
from base64 import b64encode
from collections.abc import AsyncIterator, Callable, Coroutine
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, cast

from cryptography import x509
from cryptography.hazmat.primitives import hashes
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.hazmat.primitives.serialization import (
    Encoding,
    NoEncryption,
    PrivateFormat,
)

from iveg.adapters.outbound import OutboundHttp

Talk = Callable[[asyncio.StreamReader, asyncio.StreamWriter], Coroutine[Any, Any, None]]


@cache
def contexts() -> tuple[ssl.SSLContext, ssl.SSLContext]:
    """TLS of a server called ``localhost``, and of a client that believes it."""
    key = ec.generate_private_key(ec.SECP256R1())
    name = x509.Name([x509.NameAttribute(x509.NameOID.COMMON_NAME, "localhost")])
    now = datetime.datetime.now(datetime.UTC)
    names = [x509.DNSName("localhost")]
    made = (
        x509.CertificateBuilder(name, name, key.public_key(), 1)
        .not_valid_before(now - datetime.timedelta(days=1))
        .not_valid_after(now + datetime.timedelta(days=1))
        .add_extension(x509.SubjectAlternativeName(names), critical=False)
        .add_extension(x509.BasicConstraints(ca=True, path_length=None), critical=True)
        .sign(key, hashes.SHA256())
    )
    plain = PrivateFormat.PKCS8, NoEncryption()
    pem = made.public_bytes(Encoding.PEM)
    server = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    with TemporaryDirectory() as folder:
        both = Path(folder) / "both.pem"
        both.write_bytes(key.private_bytes(Encoding.PEM, *plain) + pem)
        server.load_cert_chain(both)
    return server, ssl.create_default_context(cadata=pem.decode("ascii"))


def loopback(timeout_s: float = 5.0) -> OutboundHttp:
    """The door, for a test that has its servers at home."""
    return OutboundHttp(lambda address: address.is_loopback, contexts()[1], timeout_s)


@dataclass
class HttpsStand:
    """Answers each POST with ``status``; ``hangs`` answers nothing."""

    status: int = 201
    hangs: bool = False
    port: int = 0
    asked: list[tuple[dict[str, str], bytes]] = field(default_factory=list)

    def url(self, path: str = "/hook", host: str = "localhost") -> str:
        return f"https://{host}:{self.port}{path}"

    async def talk(
        self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter
    ) -> None:
        head = (await reader.readuntil(b"\r\n\r\n")).decode("latin-1").splitlines()
        told = (line.partition(": ") for line in head[1:] if line)
        headers = {name.lower(): value for name, _, value in told}
        content = await reader.readexactly(int(headers["content-length"]))
        self.asked.append(({"": head[0], **headers}, content))
        if self.hangs:
            await reader.read()
            return
        where = b"Location: https://127.0.0.1/else\r\n" if self.status == 302 else b""
        line = b"HTTP/1.1 %d Said\r\n" % self.status
        writer.write(line + where + b"Content-Length: 0\r\n\r\n")
        await writer.drain()


@dataclass
class MailStand:
    """Takes letters as a mail server does; ``refuses`` addresses."""

    user: str = "iveg"
    password: str = "tomato"
    refuses: frozenset[str] = frozenset()
    port: int = 0
    letters: list[tuple[str, str]] = field(default_factory=list)

    async def talk(
        self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter
    ) -> None:
        to = ""
        writer.write(b"220 stand\r\n")
        while line := (await reader.readline()).decode().strip():
            word = line[:4].upper()
            if word == "DATA":
                writer.write(b"354 go on\r\n")
                raw = await reader.readuntil(b"\r\n.\r\n")
                self.letters.append((to, raw.decode()))
            if word == "RCPT":
                to = line.partition("<")[2].partition(">")[0]
            writer.write(self._answer(word, line, to))
            await writer.drain()

    def _answer(self, word: str, line: str, to: str) -> bytes:
        if word == "EHLO":
            return b"250-stand\r\n250 AUTH PLAIN\r\n"
        if word == "AUTH":
            return b"235 ok\r\n" if self._knows(line) else b"535 no\r\n"
        if word == "RCPT" and to in self.refuses:
            return b"550 nobody\r\n"
        return b"221 bye\r\n" if word == "QUIT" else b"250 ok\r\n"

    def _knows(self, line: str) -> bool:
        told = b64encode(f"\0{self.user}\0{self.password}".encode()).decode()
        return line.endswith(told)


@contextlib.asynccontextmanager
async def standing(stand: HttpsStand | MailStand) -> AsyncIterator[None]:
    """Serves while the test goes on."""

    talks: set[asyncio.Task[Any]] = set()

    async def serve(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        talks.add(cast("asyncio.Task[None]", asyncio.current_task()))
        with contextlib.suppress(OSError, asyncio.IncompleteReadError):
            await stand.talk(reader, writer)
        writer.close()
        with contextlib.suppress(OSError):
            await writer.wait_closed()

    server = await asyncio.start_server(serve, "127.0.0.1", 0, ssl=contexts()[0])
    stand.port = server.sockets[0].getsockname()[1]
    try:
        yield
    finally:
        server.close()
        await asyncio.gather(*talks, return_exceptions=True)
