"""Shared state of one iVeg: the world, its people, and the ports to the outside."""

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
    """Shared state of one iVeg, which every part gets whole.

    Attributes:
        supervision: Publishes events to comfort, and guards its failures.
        boot: Random, new at each start: identifies the feedback of this run.
    """

    world: World
    people: People
    greenhouse: Greenhouse
    ports: Ports
    event_log: EventLog
    health_monitor: HealthMonitor
    supervision: Supervision
    boot: str
