"""``iveg provision``: what FIWARE must know of the fleet, made or mended once."""

import asyncio

from iveg.adapters.reconciler import provision
from iveg.app.outside import open_fiware, site_of
from iveg.cli.arguments import CommandCall


def run(call: CommandCall) -> int:
    """Create or repair the fleet's devices, and print the repairs."""

    async def work() -> None:
        orion, agent = open_fiware(call.settings)
        async with orion, agent:
            done = await provision(agent, orion, site_of(call.settings))
        said = [*done.mended, *done.problems]
        print("\n".join(said) or "Everything was as it should be.")

    asyncio.run(work())
    return 0
