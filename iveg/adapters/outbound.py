"""Connections to addresses that somebody typed: public ones, under their own name.

A name is resolved once, every address that it has is judged, and the connection goes
to one that was judged, while certificates are checked against the name: nobody can
answer a second question differently (DNS rebinding).  Names are resolved in threads of
its own, so that a name server that hangs holds up nothing else.
"""

import asyncio
import socket
import ssl
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from ipaddress import ip_address

import httpx

from iveg.adapters.public_addresses import Address, https_target, is_public
from iveg.domain.errors import OutboundError

_THREADS = 2
TIMEOUT_S = 10.0


class OutboundHttp:
    """Resolves names and posts to them.

    Args:
        allowed: Which addresses may be reached.
        tls: Whose certificates are believed; None: those of this machine.
    """

    def __init__(
        self,
        allowed: Callable[[Address], bool] = is_public,
        tls: ssl.SSLContext | None = None,
        timeout_s: float = TIMEOUT_S,
    ) -> None:
        self._allowed = allowed
        self._tls = tls
        self.timeout_s = timeout_s
        self._threads = ThreadPoolExecutor(_THREADS, "outside")

    def close(self) -> None:
        """Let the threads go; waits for none."""
        self._threads.shutdown(wait=False, cancel_futures=True)

    async def tls(self) -> ssl.SSLContext:
        """Trusted certificates; read from the disk once."""
        if self._tls is None:
            loop = asyncio.get_running_loop()
            make = ssl.create_default_context
            self._tls = await loop.run_in_executor(self._threads, make)
        return self._tls

    async def resolve(self, host: str, port: int) -> str:
        """The address that a name has.

        Raises:
            OutboundError: ``no_address``, or ``not_public`` when one of them is not.
        """
        try:
            async with asyncio.timeout(self.timeout_s):
                found = await asyncio.get_running_loop().run_in_executor(
                    self._threads, _look_up, host, port
                )
        except (TimeoutError, OSError, UnicodeError):
            raise OutboundError("no_address") from None
        if not all(self._allowed(ip_address(one)) for one in found):
            raise OutboundError("not_public")
        return found[0]

    async def connect(self, host: str, port: int) -> socket.socket:
        """A connection to a name's own address.

        Raises:
            OutboundError: it has none, it is not public, or nobody answers there.
        """
        address = await self.resolve(host, port)
        family = socket.AF_INET6 if ":" in address else socket.AF_INET
        connection = socket.socket(family, socket.SOCK_STREAM)
        connection.setblocking(False)
        loop = asyncio.get_running_loop()
        try:
            async with asyncio.timeout(self.timeout_s):
                await loop.sock_connect(connection, (address, port))
        except (TimeoutError, OSError):
            connection.close()
            raise OutboundError("no_answer") from None
        except BaseException:
            connection.close()
            raise
        return connection

    async def post(self, url: str, content: bytes, headers: Mapping[str, str]) -> int:
        """POST and return the status; follows nothing, reads no body.

        Raises:
            OutboundError: the address is no https one, not public, or did not answer.
        """
        host, port = https_target(url)
        target = httpx.URL(url)
        address = await self.resolve(host, port)
        request = httpx.Request(
            "POST",
            target.copy_with(host=address),
            headers={**headers, "Host": target.netloc.decode("ascii")},
            content=content,
            extensions={"sni_hostname": host},
        )
        try:
            async with (
                asyncio.timeout(self.timeout_s),
                httpx.AsyncClient(
                    verify=await self.tls(), trust_env=False, timeout=self.timeout_s
                ) as client,
            ):
                answer = await client.send(request, stream=True)
                await answer.aclose()
        except (TimeoutError, httpx.HTTPError) as error:
            raise OutboundError(_why(error)) from None
        return answer.status_code


def _look_up(host: str, port: int) -> list[str]:
    found = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)
    # An address of a link is written with its interface: fe80::1%eth0.
    return [str(one[4][0]).partition("%")[0] for one in found]


def _why(error: Exception) -> str:
    text = str(error).lower()
    return "certificate" if "certificate" in text else "no_answer"
