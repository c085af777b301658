"""What the pipeline is given, and the parts that it is made of."""

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

from iveg.domain.detection_rule import DetectionRule
from iveg.domain.equipment import Tile
from iveg.domain.greenhouse import Greenhouse
from iveg.domain.latency import LatencyWatch
from iveg.domain.observations import Instant
from iveg.domain.tracking.calibration import Calibrations
from iveg.domain.tracking.people import People
from iveg.domain.transports import Transport
from iveg.domain.world import World
from iveg.pipeline.command import Commander
from iveg.pipeline.equipment import EquipmentMonitor
from iveg.pipeline.evaluate import Evaluator
from iveg.pipeline.event_log import EventLog
from iveg.pipeline.goals import GoalDispatcher
from iveg.pipeline.health_monitor import HealthMonitor, HopState
from iveg.pipeline.ingest import Ingest
from iveg.pipeline.loop import RuleLoop
from iveg.pipeline.margins import NewestMargins
from iveg.pipeline.peer_scans import PeerScans
from iveg.pipeline.ports import CommandPort, FleetPort, StopJournal
from iveg.pipeline.publish import Hub
from iveg.pipeline.record import RecordSink
from iveg.pipeline.scans import ScanReader
from iveg.pipeline.shadow import ShadowRule
from iveg.pipeline.supervision import Supervision


@dataclass(frozen=True, slots=True)
class Ports:
    """Ports of the pipeline to the outside.

    Attributes:
        fleet: Feedback and desired states of all robots.
        transports: Ways of an order to a robot.
        journal: Desired state of each robot, on disk.
        sink: The history.
        clock: Reads both clocks.
        new_id: A new id, sortable by time.
        history_state: State of the history.
    """

    fleet: FleetPort
    transports: Mapping[Transport, CommandPort]
    journal: StopJournal
    sink: RecordSink
    clock: Callable[[], Instant]
    new_id: Callable[[], str]
    history_state: Callable[[], HopState] = lambda: "ok"


@dataclass(frozen=True, slots=True)
class Choices:
    """An operator's choices.

    Attributes:
        boot: Random, new at each start; identity of our feedback.
        era: Ends the ids of people, which are unique across starts by it.
        tiles: Of other equipment.
        calibrations: How sure a look of a detector makes.
        refused: Robots of the fleet that are not heard.
    """

    rule: DetectionRule = field(default_factory=DetectionRule)
    boot: str = "iveg-boot"
    era: str = ""
    tiles: Sequence[Tile] = ()
    calibrations: Calibrations = field(default_factory=Calibrations)
    refused: Sequence[str] = ()

    def people(self, greenhouse: Greenhouse) -> People:
        """Nobody known yet."""
        return People(greenhouse, self.era, self.calibrations)


@dataclass(frozen=True, slots=True)
class Pipeline:
    """The parts, each by its name; nothing runs until ``loop.run()``."""

    hub: Hub
    event_log: EventLog
    health_monitor: HealthMonitor
    world: World
    latency: LatencyWatch
    ingest: Ingest
    evaluator: Evaluator
    commander: Commander
    loop: RuleLoop
    supervision: Supervision
    margins: NewestMargins
    scans: ScanReader
    goals: GoalDispatcher
    equipment: EquipmentMonitor
    peer_scans: PeerScans
    shadow: ShadowRule

    def counters(self) -> Counter[str]:
        """Everything that is counted in it."""
        total = Counter(self.ingest.counters)
        total.update(self.world.counters)
        total.update(self.commander.counters)
        total.update(self.supervision.counters)
        total["live.browsers"] = self.hub.watchers
        total["nlos.protected"] = self.evaluator.protected_unseen
        return total
