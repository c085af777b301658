"""The state of the fleet and the ways out of it, which the parts of iVeg share."""

from dataclasses import dataclass

from iveg.domain.greenhouse import Greenhouse
from iveg.domain.tracking.people import People
from iveg.domain.world import World
from iveg.vital.event_log import EventLog
from iveg.vital.health_monitor import HealthMonitor
from iveg.vital.ports import Ports
from iveg.vital.supervision import Supervision


@dataclass(frozen=True, slots=True)
class Core:
    """Shared state of one iVeg; every part is given it whole.

    Attributes:
        supervision: Tells comfort what happens.
        boot: Random, new at each start: identity of our feedback.
    """

    world: World
    people: People
    greenhouse: Greenhouse
    ports: Ports
    event_log: EventLog
    health_monitor: HealthMonitor
    supervision: Supervision
    boot: str
