"""The parts of a running iVeg between its adapters and its pages, and their wiring.

Here alone vital parts are given comfort, as guarded calls.
"""

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

from iveg.comfort.coverage import CoverageMonitor
from iveg.comfort.equipment import EquipmentMonitor
from iveg.comfort.goals import GoalDispatcher
from iveg.comfort.mapping import Mapper
from iveg.comfort.margins import NewestMargins
from iveg.comfort.peer_scans import PeerScans
from iveg.comfort.scans import ScanReader
from iveg.comfort.shadow import ShadowRule
from iveg.comfort.trials import Trials
from iveg.domain.detection_rule import DetectionRule
from iveg.domain.detector import OutOfService
from iveg.domain.equipment import Equipment, Tile
from iveg.domain.events import LogEvent
from iveg.domain.fleet import FleetDescription
from iveg.domain.greenhouse import Greenhouse
from iveg.domain.latency import LatencyWatch
from iveg.domain.observations import Instant
from iveg.domain.rule.trial import Trial
from iveg.domain.tracking.looks import Calibrations
from iveg.domain.tracking.people import People
from iveg.domain.transports import FIWARE, Transport
from iveg.domain.words import WordAnswer
from iveg.domain.world import World
from iveg.vital.command import Commander
from iveg.vital.detectors import Detectors
from iveg.vital.evaluate import Evaluator
from iveg.vital.event_log import EventLog
from iveg.vital.health_monitor import HealthMonitor, HopState
from iveg.vital.ingest import Ingest
from iveg.vital.loop import RuleLoop
from iveg.vital.ports import (
    ChoiceStore,
    Clock,
    CommandPort,
    FleetPort,
    RuleStore,
    StopJournal,
)
from iveg.vital.publish import Hub
from iveg.vital.record import RecordSink
from iveg.vital.rules import Rules
from iveg.vital.supervision import Supervision
from iveg.vital.things import ThingMarks


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


@dataclass(frozen=True, slots=True)
class KeptChoices:
    """Choices that people made while iVeg ran, and their stores.

    Attributes:
        rules: Every version of the rule, oldest first.
        out_of_service: Detectors that nobody waits for, by robot.
        words: What operators said of words of detectors.
        trial: Of a candidate of the rule.
    """

    rule_store: RuleStore
    detector_store: ChoiceStore[Mapping[str, OutOfService]]
    word_store: ChoiceStore[Mapping[str, WordAnswer]]
    trial_store: ChoiceStore[Trial | None]
    rules: Sequence[DetectionRule] = ()
    out_of_service: Mapping[str, OutOfService] = field(default_factory=dict)
    words: Mapping[str, WordAnswer] = field(default_factory=dict)
    trial: Trial | None = None


@dataclass(frozen=True, slots=True)
class Services:
    """Parts beside the rule loop, for people; STOP and speed limits need none."""

    rules: Rules
    detectors: Detectors
    things: ThingMarks
    mapper: Mapper
    coverage: CoverageMonitor
    trials: Trials


def build_services(
    parts: Pipeline,
    kept: KeptChoices,
    clock: Clock,
) -> Services:
    """The parts beside a pipeline."""
    evaluator, event_log = parts.evaluator, parts.event_log
    greenhouse = evaluator.greenhouse
    rules = Rules(evaluator, kept.rule_store, event_log, kept.rules)
    store = kept.trial_store
    return Services(
        rules,
        Detectors(
            parts.world,
            kept.detector_store,
            kept.word_store,
            event_log,
            kept.out_of_service,
            kept.words,
        ),
        ThingMarks(evaluator.people, event_log),
        Mapper(parts.world, greenhouse.bounds, parts.scans),
        CoverageMonitor(parts.world, greenhouse),
        Trials(parts.shadow, evaluator, rules, store, kept.trial, clock),
    )


def build(
    fleet: FleetDescription, greenhouse: Greenhouse, ports: Ports, choices: Choices
) -> Pipeline:
    """All parts, wired."""
    start, hub, supervision = ports.clock(), Hub(), Supervision(ports.clock)
    event_log = EventLog(hub, ports.sink, start, supervision)
    health_monitor = HealthMonitor(start, ports.history_state)
    probe, guard = health_monitor.probe, supervision.guard
    world = World(fleet, probe, greenhouse.robots_within)
    latency, ingest = _inputs(world, event_log, ports, supervision)
    for robot_id in choices.refused:
        world.robot(robot_id).refused = True
    scans = ScanReader(ingest.reject)
    evaluator = Evaluator(
        world,
        greenhouse,
        choices.people(greenhouse),
        choices.rule,
        ports.fleet,
        event_log,
        ports.new_id,
        choices.boot,
        probe.lag,
    )
    commander = _commander(fleet.ids, ports, event_log, health_monitor)
    goals = _goals(world, greenhouse, commander, ports, event_log)
    margins = NewestMargins(world, evaluator.people)
    event_log.margin_of = margins.of
    loop = RuleLoop(
        ingest,
        evaluator,
        commander,
        health_monitor,
        event_log,
        ports.clock,
        supervision,
        guard("latency", latency.decided),
        (guard("latency", latency.tick), guard("margins", margins.tick)),
        (guard("goals", goals.heard), guard("goals", goals.tick)),
    )
    return Pipeline(
        hub,
        event_log,
        health_monitor,
        world,
        latency,
        ingest,
        evaluator,
        commander,
        loop,
        supervision,
        margins,
        scans,
        goals,
        _equipment(choices.tiles, start, ports, event_log, supervision),
        PeerScans(world, scans, ports.fleet.publish_peer_scan, choices.boot),
        ShadowRule.beside(evaluator, supervision),
    )


def _equipment(
    tiles: Sequence[Tile],
    start: Instant,
    ports: Ports,
    event_log: EventLog,
    supervision: Supervision,
) -> EquipmentMonitor:
    equipment = Equipment(tiles, start)
    return EquipmentMonitor(equipment, ports.sink, event_log, supervision)


def _commander(
    robots: Sequence[str],
    ports: Ports,
    event_log: EventLog,
    health_monitor: HealthMonitor,
) -> Commander:
    return Commander(
        robots,
        ports.transports,
        ports.fleet,
        ports.journal,
        event_log,
        ports.new_id,
        ports.clock,
        agent_lag_s=health_monitor.probe.lag,
        is_cut=lambda way, at: way == FIWARE.id and health_monitor.is_cut(at),
    )


def _goals(
    world: World,
    greenhouse: Greenhouse,
    commander: Commander,
    ports: Ports,
    event_log: EventLog,
) -> GoalDispatcher:
    transports, new_id = ports.transports, ports.new_id
    machines = commander.machines
    return GoalDispatcher(
        world, greenhouse, machines, transports, event_log, new_id, ports.clock
    )


def _inputs(
    world: World,
    event_log: EventLog,
    ports: Ports,
    supervision: Supervision,
) -> tuple[LatencyWatch, Ingest]:
    latency = LatencyWatch(world.robots, world.ledger.composed_at)
    note_latency = supervision.guard("latency", latency.arrived)

    def log_rejected(source: str, reason: str) -> None:
        slots = {"source": source, "reason": reason}
        event_log.log(LogEvent("system", "log.rejected", slots), ports.clock())

    return latency, Ingest(world, note_latency, log_rejected)
