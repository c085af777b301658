"""``iveg provision``: makes or repairs the fleet's devices in FIWARE, once."""

import asyncio

from iveg.adapters.reconciler import provision
from iveg.app import open_fiware, site_of
from iveg.cli.arguments import CommandCall


def run(call: CommandCall) -> int:
    """Create or repair the fleet's devices, and print the repairs."""

    async def work() -> None:
        orion, agent = open_fiware(call.settings)
        async with orion, agent:
            result = await provision(agent, orion, site_of(call.settings))
        sentences = [*result.mended, *result.problems]
        print("\n".join(sentences) or "Everything was as it should be.")

    asyncio.run(work())
    return 0
