"""Composition of the pipeline from its ports, for iVeg and for its tests."""

from collections.abc import Sequence

from iveg.domain.equipment import Equipment, Tile
from iveg.domain.events import LogEvent
from iveg.domain.fleet import FleetDescription
from iveg.domain.greenhouse import Greenhouse
from iveg.domain.latency import LatencyWatch
from iveg.domain.observations import Instant
from iveg.domain.transports import FIWARE
from iveg.domain.world import World
from iveg.pipeline.command import Commander
from iveg.pipeline.equipment import EquipmentMonitor
from iveg.pipeline.evaluate import Evaluator
from iveg.pipeline.event_log import EventLog
from iveg.pipeline.goals import GoalDispatcher
from iveg.pipeline.health_monitor import HealthMonitor
from iveg.pipeline.ingest import Ingest
from iveg.pipeline.loop import RuleLoop
from iveg.pipeline.margins import NewestMargins
from iveg.pipeline.parts import Choices, Pipeline, Ports
from iveg.pipeline.peer_scans import PeerScans
from iveg.pipeline.publish import Hub
from iveg.pipeline.scans import ScanReader
from iveg.pipeline.shadow import ShadowRule
from iveg.pipeline.supervision import Supervision


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

    is_robot = world.robots.__contains__
    ingest = Ingest(
        is_robot,
        log_rejected,
        world.is_past,
        note_latency,
        world.is_refused,
        world.misplaced,
    )
    return latency, ingest
