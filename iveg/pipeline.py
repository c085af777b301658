"""Parts of a running iVeg between its adapters and its pages, and their wiring.

Only this module connects comfort to the events of vital parts.
"""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

from iveg.comfort.equipment import PART as EQUIPMENT
from iveg.comfort.equipment import EquipmentMonitor
from iveg.comfort.goals import GoalDispatcher
from iveg.comfort.maps import CoverageMonitor, Mapper, PeerScans
from iveg.comfort.trials import Trials
from iveg.domain.equipment import Equipment, Tile
from iveg.domain.events import LogEvent
from iveg.domain.fleet import FleetDescription
from iveg.domain.greenhouse import Greenhouse
from iveg.domain.latency import LatencyWatch
from iveg.domain.tracking.people import People
from iveg.domain.world import World
from iveg.vital.command import Commander
from iveg.vital.core import Core
from iveg.vital.evaluate import Evaluator
from iveg.vital.event_log import EventLog
from iveg.vital.health_monitor import HealthMonitor
from iveg.vital.ingest import Ingest
from iveg.vital.loop import RuleLoop
from iveg.vital.operators import Detectors, KeptChoices, Rules, ThingMarks
from iveg.vital.ports import Ports
from iveg.vital.publish import Hub
from iveg.vital.supervision import Supervision


@dataclass(frozen=True, slots=True)
class Choices:
    """An operator's choices, and the identity of this start.

    Attributes:
        kept: Choices made while iVeg ran, from disk.
        boot: Random, new at each start; identity of our feedback.
        era: Suffix of people's ids, which makes them unique across starts.
        tiles: Tiles of other equipment.
        refused: Robots of the fleet whose messages are refused.
    """

    kept: KeptChoices
    boot: str = "iveg-boot"
    era: str = ""
    tiles: Sequence[Tile] = ()
    refused: Sequence[str] = ()


class Pipeline:
    """Parts by name; nothing runs until ``loop.run()``.

    STOP and speed limits need none from ``latency`` on.
    """

    def __init__(
        self,
        fleet: FleetDescription,
        greenhouse: Greenhouse,
        ports: Ports,
        choices: Choices,
    ) -> None:
        self.hub = Hub()
        self.core = core = _core(fleet, greenhouse, ports, choices)
        self.ingest = ingest = _ingest(core)
        world, supervision, kept = core.world, core.supervision, choices.kept
        self.evaluator = Evaluator(core, kept.rules[-1])
        self.commander = Commander(core)
        self.loop = RuleLoop(core, ingest, self.evaluator, self.commander)
        self.rules = Rules(core, self.evaluator, kept)
        self.detectors, self.things = Detectors(core, kept), ThingMarks(core)
        self.latency = latency = LatencyWatch(world.robots, world.ledger.composed_at)
        self.goals = goals = GoalDispatcher(core, self.commander.machines)
        self.equipment = EquipmentMonitor(core, Equipment(choices.tiles, ports.clock()))
        publish = ports.fleet.publish_peer_scan
        self.peer_scans = PeerScans(world, ingest.reject, publish, choices.boot)
        self.mapper = Mapper(world, greenhouse.bounds, ingest.reject)
        self.coverage = CoverageMonitor(world, greenhouse)
        supervision.listen("live", changed=self.hub.changed, appended=self.hub.append)
        supervision.listen("goals", goal_answered=goals.take_answer, ticked=goals.tick)
        supervision.listen(
            "latency",
            arrived=latency.arrived,
            decided=latency.decided,
            ticked=latency.tick,
        )
        supervision.listen(EQUIPMENT, entity_read=self.equipment.receive)
        self.trials = Trials(core, self.evaluator, self.rules)

    def counters(self) -> Counter[str]:
        """Counters of all parts."""
        total = Counter(self.ingest.counters)
        total.update(self.core.world.counters)
        total.update(self.commander.counters)
        total.update(self.core.supervision.counters)
        total["live.browsers"] = len(self.hub.subscribers)
        return total


def _core(
    fleet: FleetDescription, greenhouse: Greenhouse, ports: Ports, choices: Choices
) -> Core:
    start, supervision = ports.clock(), Supervision(ports.clock)
    health_monitor = HealthMonitor(start, ports.history_state)
    world = World(fleet, health_monitor.probe, greenhouse.robots_within)
    for robot_id in choices.refused:
        world.robot(robot_id).refused = True
    return Core(
        world,
        People(greenhouse, choices.era),
        greenhouse,
        ports,
        EventLog(ports.sink, start, supervision),
        health_monitor,
        supervision,
        choices.boot,
    )


def _ingest(core: Core) -> Ingest:
    world, event_log, clock = core.world, core.event_log, core.ports.clock

    def log_rejected(source: str, reason: str) -> None:
        slots = {"source": source, "reason": reason}
        event_log.log(LogEvent("system", "log.rejected", slots), clock())

    return Ingest(world, partial(core.supervision.tell, "arrived"), log_rejected)
