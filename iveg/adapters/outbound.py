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
from ipaddress import IPv4Address, IPv6Address, IPv6Network, ip_address
from typing import Final
from urllib.parse import urlsplit

import httpx

from iveg.domain.errors import OutboundError

Address = IPv4Address | IPv6Address
_NAT64: Final = IPv6Network("64:ff9b::/96")
_UNICAST: Final = IPv6Network("2000::/3")
"""All of IPv6 that was given to the internet; what lies beside it is somebody's own."""
_THREADS = 2
TIMEOUT_S = 10.0


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


def _look_up(host: str, port: int) -> list[str]:
    found = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)
    # An address of a link is written with its interface: fe80::1%eth0.
    return [str(one[4][0]).partition("%")[0] for one in found]


def _why(error: Exception) -> str:
    text = str(error).lower()
    return "certificate" if "certificate" in text else "no_answer"
