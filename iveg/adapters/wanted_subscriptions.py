"""The subscriptions that iVeg wants at Orion.

Odometry and scans have one subscription for each robot:  Orion throttles a subscription
as a whole, so in a common one the robot that sends first in each second would silence
the others.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from iveg.domain.equipment import Tile
from iveg.domain.kinds import MEASURED, Kind
from iveg.domain.observations import Observation
from iveg.ngsi import names

PREFIX = "iVeg: "


TOKEN_HEADER = "X-Iveg-Notify-Token"  # noqa: S105 - a header's name


THROTTLING_S = 1


@dataclass(frozen=True, slots=True)
class WantedSubscription:
    """One subscription that iVeg wants.

    Attributes:
        name: After the prefix in its description; never changes.
        entity: What it is about, as NGSI-v2 says it.
        attributes: What is sent.
        condition: What makes Orion send; the attributes where it is empty.
        copied: Robot and kind whose direct copy may make this one a mere fallback,
            which Orion then throttles; None where every notification counts.
    """

    name: str
    entity: tuple[tuple[str, str], ...]
    attributes: tuple[str, ...]
    condition: tuple[str, ...] = ()
    copied: tuple[str, type[Observation]] | None = None


ALL_ROBOTS = (("idPattern", ".*"), ("type", names.ROBOT_TYPE))


def _names_of(kind: Kind) -> tuple[str, ...]:
    return tuple(name for name, _ in kind.attributes)


WANTED_OF_ALL = (
    *(
        WantedSubscription(one.name, ALL_ROBOTS, _names_of(one))
        for one in MEASURED
        if not one.is_copied
    ),
    WantedSubscription(
        "commands", ALL_ROBOTS, (names.COMMAND_STATUS, names.COMMAND_INFO)
    ),
    WantedSubscription("goals", ALL_ROBOTS, (names.GOAL_INFO,)),
    WantedSubscription(
        "single uplink",
        ALL_ROBOTS,
        tuple(names.ALGORITHM_1),
        condition=("timestamp", "pose", "class"),
    ),
    WantedSubscription(
        "climate",
        (("id", names.CLIMATE_ID), ("type", names.CLIMATE_TYPE)),
        ("temperature", "relativeHumidity", "co2"),
    ),
    WantedSubscription(
        "canary",
        (("id", names.HEARTBEAT_ID), ("type", names.HEARTBEAT_TYPE)),
        ("probe",),
    ),
)


def wanted_for(
    robots: Iterable[str], tiles: Iterable[Tile] = ()
) -> tuple[WantedSubscription, ...]:
    """All subscriptions for a fleet and for other equipment."""
    copies = [one for robot_id in robots for one in _copies_of(robot_id)]
    return (*copies, *WANTED_OF_ALL, *map(_of_tile, tiles))


def _of_tile(tile: Tile) -> WantedSubscription:
    """One for each attribute: in a common one Orion would send what is silent along.

    Its notifications then prove that this very attribute was measured.
    """
    entity = (("id", tile.entity_id), ("type", tile.entity_type))
    return WantedSubscription(f"tile {tile.key}", entity, (tile.attribute,))


def _copies_of(robot_id: str) -> Iterator[WantedSubscription]:
    entity = (("id", robot_id), ("type", names.ROBOT_TYPE))
    for one in MEASURED:
        if one.is_copied:
            yield WantedSubscription(
                f"{one.name} {robot_id}",
                entity,
                _names_of(one),
                copied=(robot_id, one.of),
            )
