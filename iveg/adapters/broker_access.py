"""The site's own command that tells the broker of revoked robots."""

import asyncio
import contextlib
import shlex

from iveg.domain.errors import HopError
from iveg.domain.revocation import BrokerTold

_LIMIT_S = 10.0
_SAID = 200
"""Characters of a failed command's output that are told."""


class BrokerAccessCommand:
    """Implements ``pipeline.ports.BrokerAccess`` by a program of the site.

    Args:
        command: Program and first arguments; ``--revoke ROBOT`` or ``--allow ROBOT``
            follows.  Empty: there is none.
    """

    def __init__(self, command: str) -> None:
        self._command = tuple(shlex.split(command))

    async def change(self, robot_id: str, *, admitted: bool) -> BrokerTold:
        """Run it. Raises HopError where it fails or takes more than ten seconds."""
        if not self._command:
            return "not_asked"
        what = "--allow" if admitted else "--revoke"
        try:
            process = await asyncio.create_subprocess_exec(
                *(*self._command, what, robot_id),
                stdin=asyncio.subprocess.DEVNULL,
                stdout=asyncio.subprocess.PIPE,
                stderr=asyncio.subprocess.STDOUT,
            )
        except OSError as error:
            raise HopError("broker access", error.strerror or str(error)) from error
        try:
            async with asyncio.timeout(_LIMIT_S):
                said, _ = await process.communicate()
        except TimeoutError:
            raise HopError("broker access", "took too long") from None
        finally:
            if process.returncode is None:
                with contextlib.suppress(ProcessLookupError):
                    process.kill()
                await process.wait()
        if process.returncode:
            detail = said.decode(errors="replace").strip()[-_SAID:]
            raise HopError("broker access", detail or f"exit {process.returncode}")
        return "done"
