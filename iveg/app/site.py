"""What a world of the past is made with."""

from dataclasses import dataclass
from pathlib import Path

from iveg.domain.kinds import Scope
from iveg.settings import Settings


@dataclass(frozen=True, slots=True)
class Site:
    """What a world of the past is made with; the same as the live one.

    Attributes:
        folder: Of the recordings.
    """

    folder: Path
    fleet: str
    robots: tuple[str, ...]
    greenhouse: str
    equipment: str
    calibration: str
    apikey: str
    direct_read: Scope
    stop_direct: bool

    @classmethod
    def of(cls, settings: Settings, folder: Path) -> "Site":
        """As the settings say."""
        return cls(
            folder,
            settings.fleet,
            tuple(settings.robots),
            settings.greenhouse,
            settings.equipment,
            settings.calibration,
            settings.apikey,
            settings.direct_read,
            settings.stop_direct,
        )
