"""``iveg provision``: what FIWARE must know of the fleet, made or mended once."""

import asyncio

from iveg.adapters.equipment_files import load_equipment
from iveg.adapters.fleet_files import load_fleet
from iveg.adapters.reconciler import provision
from iveg.app.outside import open_fiware
from iveg.cli.arguments import CommandCall


def run(call: CommandCall) -> int:
    """Create or repair the fleet's devices, and print the repairs."""
    settings = call.settings

    async def work() -> None:
        orion, agent = open_fiware(settings)
        async with orion, agent:
            robots = load_fleet(settings.fleet, settings.robots).ids
            done = await provision(
                agent,
                orion,
                robots=robots,
                apikey=settings.apikey,
                cbroker_url=settings.iota_cb_url or settings.orion_url,
                tiles=load_equipment(settings.equipment, robots),
            )
        said = [*done.mended, *done.problems]
        print("\n".join(said) or "Everything was as it should be.")

    asyncio.run(work())
    return 0
