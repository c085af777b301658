"""Composition of the pipeline from its ports, for iVeg and for its tests."""

from collections.abc import Callable, Iterable, Sequence

from iveg.domain.backfill import Silences
from iveg.domain.equipment import Equipment, Tile
from iveg.domain.events import LogEvent
from iveg.domain.fleet import FleetDescription
from iveg.domain.greenhouse import Greenhouse
from iveg.domain.latency.watch import LatencyWatch
from iveg.domain.observations import Instant, Received
from iveg.domain.rule.obstacles import Obstacles
from iveg.domain.tracking.people import People
from iveg.domain.transports import FIWARE
from iveg.domain.witness import Plan
from iveg.domain.world import World
from iveg.pipeline.backfill import PART as BACKFILL
from iveg.pipeline.backfill import Backfill
from iveg.pipeline.command import Commander
from iveg.pipeline.equipment import EquipmentMonitor
from iveg.pipeline.evaluate import Evaluator
from iveg.pipeline.event_log import EventLog
from iveg.pipeline.goals import GoalDispatcher
from iveg.pipeline.health_monitor import HealthMonitor
from iveg.pipeline.ingest import Ingest
from iveg.pipeline.latency import LatencyMonitor
from iveg.pipeline.loop import Recorded, RuleLoop
from iveg.pipeline.margins import MarginTotals
from iveg.pipeline.parts import Choices, Guard, Pipeline, Ports
from iveg.pipeline.peer_scans import PeerScans
from iveg.pipeline.publish import Hub
from iveg.pipeline.scans import ScanReader
from iveg.pipeline.second_witness import SecondWitness
from iveg.pipeline.shadow import ShadowRule
from iveg.pipeline.slow_time import SlowTime
from iveg.pipeline.supervision import Supervision
from iveg.pipeline.trace import Trace


def build(
    fleet: FleetDescription, greenhouse: Greenhouse, ports: Ports, choices: Choices
) -> Pipeline:
    """All parts, wired."""
    start, hub, supervision = ports.clock(), Hub(), Supervision(ports.clock)
    event_log = EventLog(hub, ports.sink, start, supervision)
    health_monitor = HealthMonitor(start, ports.history_state)
    probe, guard = health_monitor.probe, supervision.guard
    world = World(fleet, probe, greenhouse.bounds)
    latency, ingest, silences = _inputs(world, event_log, ports, supervision)
    scans, people = ScanReader(ingest.reject), choices.people(greenhouse)
    evaluator = Evaluator(
        world,
        greenhouse,
        people,
        choices.rule,
        ports.fleet,
        event_log,
        ports.new_id,
        choices.boot,
        probe.lag,
        scans.newest,
        obstacles := Obstacles(world, people, Plan.of(greenhouse)),
    )
    commander = _commander(fleet.ids, ports, choices, event_log, health_monitor, guard)
    goals = _goals(world, greenhouse, commander, ports, event_log)
    totals = _totals(world, evaluator.people, event_log)
    loop = RuleLoop(
        ingest,
        evaluator,
        commander,
        health_monitor,
        event_log,
        ports.clock,
        supervision,
        guard("latency", latency.watch.decided),
        _ticks(guard, ports, latency, totals),
        (guard("goals", goals.heard), guard("goals", goals.tick)),
        _recorded(guard, ports.trace),
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
        *totals,
        scans,
        goals,
        _equipment(choices.tiles, start, ports, event_log, supervision),
        PeerScans(world, scans, ports.fleet.publish_peer_scan, choices.boot),
        SecondWitness(world, scans, obstacles, ports.trace.looked),
        _backfill(fleet, evaluator, ports, silences, ingest),
        ShadowRule.beside(evaluator, scans.newest, supervision),
    )


def _backfill(
    fleet: FleetDescription,
    evaluator: Evaluator,
    ports: Ports,
    silences: Silences,
    ingest: Ingest,
) -> Backfill:
    return Backfill(
        fleet.members,
        lambda: evaluator.rule,
        ports.sink,
        silences,
        ingest.reject,
        evaluator.world.is_revoked,
    )


def _totals(
    world: World, people: People, event_log: EventLog
) -> tuple[MarginTotals, SlowTime]:
    margins = MarginTotals(world, people)
    event_log.margin_of = margins.of
    return margins, SlowTime(world, people)


def _latency(world: World, ports: Ports, event_log: EventLog) -> LatencyMonitor:
    watch = LatencyWatch(world.robots, world.ledger.composed_at)
    return LatencyMonitor(watch, ports.sink, event_log)


def _ticks(
    guard: Guard,
    ports: Ports,
    latency: LatencyMonitor,
    totals: Iterable[MarginTotals | SlowTime],
) -> Sequence[Callable[[Instant], None]]:
    """Comfort that is called with each tick of the loop."""
    return (
        guard("latency", latency.tick),
        *[guard("totals", one.tick) for one in totals],
        guard("recordings", ports.ticked),
    )


def _recorded(guard: Guard, trace: Trace) -> Recorded:
    return guard("recordings", trace.stepped), guard("recordings", trace.ticked)


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
    choices: Choices,
    event_log: EventLog,
    health_monitor: HealthMonitor,
    guard: Guard,
) -> Commander:
    return Commander(
        robots,
        ports.transports,
        ports.fleet,
        ports.journal,
        event_log,
        ports.new_id,
        ports.clock,
        drills=choices.drills,
        agent_lag_s=health_monitor.probe.lag,
        is_cut=lambda way, at: way == FIWARE.id and health_monitor.is_cut(at),
        sent=guard("recordings", ports.trace.sent),
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
) -> tuple[LatencyMonitor, Ingest, Silences]:
    latency, silences = _latency(world, ports, event_log), Silences()
    note_latency = supervision.guard("latency", latency.watch.arrived)
    trace = supervision.guard("recordings", ports.trace.arrived)
    note_heard = supervision.guard(BACKFILL, silences.hear)

    def log_rejected(source: str, reason: str) -> None:
        slots = {"source": source, "reason": reason}
        event_log.log(LogEvent("system", "log.rejected", slots), ports.clock())

    def passed(received: Received) -> None:
        note_latency(received)
        trace(received)
        note_heard(received)

    is_robot = world.robots.__contains__
    ingest = Ingest(is_robot, log_rejected, world.is_past, passed, world.is_revoked)
    return latency, ingest, silences
