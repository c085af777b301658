"""Opens a server as the settings say."""

from pathlib import Path

from iveg.adapters.fleet_files import load_fleet
from iveg.app.dss import Dss
from iveg.app.outside import open_outside
from iveg.domain.errors import SettingsError
from iveg.settings import Settings


def open_dss(
    settings: Settings,
    data_directory: Path,
    *,
    demo: bool = False,
    make: type[Dss] = Dss,
) -> Dss:
    """A server as the settings say.

    Args:
        settings: An operator's choices.
        data_directory: Where the database (unless set) and the journals are.
        demo: Whether the robots are emulated.
        make: The class.
    """
    fleet = load_fleet(settings.fleet, settings.robots)
    if unknown := sorted({*settings.refused_robots} - {*fleet.ids}):
        raise SettingsError("IVEG_REFUSED_ROBOTS", unknown[0], "robots of the fleet")
    return make(
        settings, fleet, open_outside(settings, data_directory, fleet), demo=demo
    )
