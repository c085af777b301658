"""JSON over HTTP from a server that an operator configured and that may be hostile.

Time and size are bounded.  Redirects are not followed, and bodies come uncompressed, so
that no small body unpacks into a large one.
"""

import asyncio
import ssl
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from functools import cache
from typing import Final

import httpx
import orjson

from iveg.domain.errors import HopError, NoAnswerError
from iveg.domain.records import Json

TIMEOUT_S: Final = 5.0
MOST_BYTES: Final = 256 * 1024


@dataclass(frozen=True, slots=True)
class JsonAnswer:
    """Status and object of an answer; the object of a failure may be empty."""

    status: int
    body: Json

    @property
    def is_success(self) -> bool:
        """Whether the status is 2xx."""
        return 200 <= self.status < 300

    @property
    def refusal(self) -> str:
        """Status and OAuth error code; a description may hold anything."""
        code = self.body.get("error")
        known = isinstance(code, str) and code.isascii() and code.isprintable()
        return f"{self.status} {str(code)[:40]}" if known else str(self.status)


class BoundedJson:
    """HTTP to one server.

    Args:
        hop: Name of the server in errors.
        timeout_s: Time limit of a whole exchange (s), however slowly it trickles.
    """

    def __init__(self, hop: str, timeout_s: float = TIMEOUT_S) -> None:
        self._hop, self._timeout_s = hop, timeout_s
        self._client = httpx.AsyncClient(
            transport=httpx.AsyncHTTPTransport(verify=_believed()),
            timeout=timeout_s,
            headers={"Accept": "application/json", "Accept-Encoding": "identity"},
        )

    async def close(self) -> None:
        """Close connections."""
        await self._client.aclose()

    async def post(
        self,
        url: str,
        form: Mapping[str, str],
        login: tuple[str, str] | None = None,
    ) -> JsonAnswer:
        """POST a form; ``login`` is a user and password, or None.

        Raises:
            HopError: no answer in time, or none that is a JSON object within the size.
        """
        auth = None if login is None else httpx.BasicAuth(*login)
        return await self.ask("POST", url, data=dict(form), auth=auth)

    async def ask(self, method: str, url: str, **parts: object) -> JsonAnswer:
        """Request an object; ``parts`` of the request have their names in httpx.

        Raises:
            HopError: no answer in time, or none that is a JSON object within the size.
        """
        present = {name: part for name, part in parts.items() if part is not None}
        try:
            async with asyncio.timeout(self._timeout_s):
                # mypy cannot follow arguments by name into the library.
                async with self._client.stream(method, url, **present) as answer:  # type: ignore[arg-type]
                    body = await self._read(answer)
        except (TimeoutError, httpx.TimeoutException) as error:
            detail = f"no answer in {self._timeout_s:g} s"
            raise NoAnswerError(self._hop, detail) from error
        except (httpx.HTTPError, httpx.InvalidURL, OSError, UnicodeError) as error:
            # Without the address: its query may hold a token.
            reason = type(error).__name__
            raise HopError(self._hop, f"cannot be reached: {reason}") from None
        return JsonAnswer(answer.status_code, self._object(answer.status_code, body))

    async def _read(self, answer: httpx.Response) -> bytes:
        body = bytearray()
        async for part in answer.aiter_raw():
            body += part
            if len(body) > MOST_BYTES:
                raise HopError(self._hop, f"answered more than {MOST_BYTES} bytes")
        return bytes(body)

    def _object(self, status: int, body: bytes) -> Json:
        document = None
        with suppress(ValueError):
            document = orjson.loads(body)
        if isinstance(document, dict):
            return document
        if 200 <= status < 300:
            raise HopError(self._hop, "answered something that is no JSON object")
        return {}


@cache
def _believed() -> ssl.SSLContext:
    """Trusted certificates of this machine, read once, since reading takes a while."""
    return ssl.create_default_context()
