"""The history's reading side: queries of the REST API.

Every query runs in a thread of its own small pool, so that a long query neither holds
up the event loop nor takes the threads that a STOP's journal needs.
"""

import asyncio
from collections.abc import Callable, Collection, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any, Literal, TypeVar

from sqlalchemy import Connection, Select, func, select
from sqlalchemy.exc import SQLAlchemyError

from iveg.adapters.history import ages, lists, series
from iveg.adapters.history.audit import chain_end
from iveg.adapters.history.cost import CostRows, cost_rows
from iveg.adapters.history.engine import reading_engine
from iveg.adapters.history.lists import Filter, Page, R, record_of
from iveg.adapters.history.migrate import reason_of
from iveg.adapters.history.rule_inputs import RuleInputs, rule_inputs
from iveg.adapters.history.tables import (
    alerts,
    command_events,
    commands,
    decisions,
    is_open_command,
    latency,
)
from iveg.domain.audit import ChainEnd
from iveg.domain.day import DaySighting, Pose
from iveg.domain.errors import HopError
from iveg.domain.records import (
    AlertRecord,
    AuditRecord,
    CommandEventRecord,
    CommandRecord,
    DecisionRecord,
    DetectionRecord,
    LatencyRecord,
    LogRecord,
    MeasurementRecord,
    OdometryRecord,
    ReadingRecord,
)

_THREADS = 4
_T = TypeVar("_T")


class Queries:
    """Reads the history.

    Every method raises ``HopError`` when the database does not answer.

    Attributes:
        url: The database, for a process that asks it itself.
    """

    def __init__(self, database_url: str) -> None:
        self.url = database_url
        self._engine = reading_engine(database_url)
        self._threads = ThreadPoolExecutor(_THREADS, "history-read")

    async def decisions(self, asked: Filter) -> Page[DecisionRecord]:
        """Decisions by ``started_at``."""
        return await self._ask(lambda c: lists.read_page(c, lists.DECISIONS, asked))

    async def detections(self, asked: Filter) -> Page[DetectionRecord]:
        """Detections by ``at``."""
        return await self._ask(lambda c: lists.read_page(c, lists.DETECTIONS, asked))

    async def tracks(self, asked: Filter) -> Page[DetectionRecord]:
        """Detections of people, by ``at``."""
        return await self._ask(lambda c: lists.read_page(c, lists.TRACKS, asked))

    async def odometry(self, asked: Filter) -> Page[OdometryRecord]:
        """Poses of robots, by ``at``."""
        return await self._ask(lambda c: lists.read_page(c, lists.ODOMETRY, asked))

    async def commands(self, asked: Filter) -> Page[CommandRecord]:
        """Commands by ``requested_at``."""
        return await self._ask(lambda c: lists.read_page(c, lists.COMMANDS, asked))

    async def alerts(self, asked: Filter) -> Page[AlertRecord]:
        """Alerts by ``raised_at``."""
        return await self._ask(lambda c: lists.read_page(c, lists.ALERTS, asked))

    async def log(self, asked: Filter) -> Page[LogRecord]:
        """Log lines by ``at``."""
        return await self._ask(lambda c: lists.read_page(c, lists.LOG, asked))

    async def audit(self, asked: Filter) -> Page[AuditRecord]:
        """Rows of the audit, by ``at``; class: an action or a name."""
        return await self._ask(lambda c: lists.read_page(c, lists.AUDIT, asked))

    async def audit_end(self) -> ChainEnd:
        """The newest row of the audit."""
        return await self._ask(chain_end)

    async def notes(self, asked: Filter) -> Page[LogRecord]:
        """Notes of people, by when they were written."""
        return await self._ask(lambda c: lists.read_page(c, lists.NOTES, asked))

    async def readings(self, asked: Filter) -> Page[ReadingRecord]:
        """Readings of small sensors, by ``at``; the class filter asks for the kind."""
        return await self._ask(lambda c: lists.read_page(c, lists.READINGS, asked))

    async def measurements(self, asked: Filter) -> Page[MeasurementRecord]:
        """Numbers of other equipment, by ``at``; class: an entity or an attribute."""
        return await self._ask(lambda c: lists.read_page(c, lists.MEASUREMENTS, asked))

    async def measurement_series(
        self, since: float, until: float
    ) -> Mapping[tuple[str, str], series.MeasurementSeries]:
        """Other equipment over a range, at most 288 points an entity and attribute."""
        return await self._ask(lambda c: series.measurement_series(c, since, until))

    async def decision(self, decision_id: str) -> DecisionRecord | None:
        """One decision; None when it is not known."""
        wanted = select(decisions).where(decisions.c.decision_id == decision_id)
        return next(iter(await self._records(DecisionRecord, wanted)), None)

    async def alert(self, alert_id: str) -> AlertRecord | None:
        """One alert; None when it is not known."""
        wanted = select(alerts).where(alerts.c.alert_id == alert_id)
        return next(iter(await self._records(AlertRecord, wanted)), None)

    async def command(self, command_id: str) -> CommandRecord | None:
        """One command; None when it is not known."""
        wanted = select(commands).where(commands.c.command_id == command_id)
        return next(iter(await self._records(CommandRecord, wanted)), None)

    async def open_commands(self) -> tuple[CommandRecord, ...]:
        """Commands whose last row says that they still go on, oldest first."""
        c = commands.c
        wanted = (
            select(commands)
            .where(is_open_command())
            .order_by(c.requested_at, c.command_id)
        )
        return await self._records(CommandRecord, wanted)

    async def open_decisions(self) -> tuple[DecisionRecord, ...]:
        """Decisions whose last row has no end."""
        wanted = select(decisions).where(decisions.c.ended_at.is_(None))
        return await self._records(DecisionRecord, wanted)

    async def open_alerts(self) -> tuple[AlertRecord, ...]:
        """Alerts whose last row says that they are active."""
        wanted = select(alerts).where(alerts.c.cleared_at.is_(None))
        return await self._records(AlertRecord, wanted)

    async def unseen_alerts(self, most: int) -> tuple[AlertRecord, ...]:
        """The newest P1s that nobody has acknowledged, active or over."""
        a = alerts.c
        wanted = (
            select(alerts)
            .where(a.priority == "P1", a.acknowledged_at.is_(None))
            .order_by(a.last_raised_at.desc(), a.alert_id.desc())
            .limit(most)
        )
        return await self._records(AlertRecord, wanted)

    async def drills(
        self, robot: str | None = None, most: int = 100
    ) -> tuple[CommandRecord, ...]:
        """The newest STOP drills, newest first."""
        c = commands.c
        wanted = (
            select(commands)
            .where(c.drill)
            .order_by(c.requested_at.desc(), c.command_id.desc())
            .limit(most)
        )
        if robot is not None:
            wanted = wanted.where(c.robot_id == robot)
        return await self._records(CommandRecord, wanted)

    async def last_drills(self) -> dict[str, float]:
        """Robot → when its last drill that ended in a standstill was asked (Unix s)."""
        c = commands.c
        newest = (
            select(c.robot_id, func.max(c.requested_at))
            .where(c.drill, c.standing_at.is_not(None))
            .group_by(c.robot_id)
        )
        return await self._ask(
            lambda connection: {row[0]: row[1] for row in connection.execute(newest)}
        )

    async def command_events(self, command_id: str) -> tuple[CommandEventRecord, ...]:
        """The audit trail of a command, oldest first."""
        steps = await self.steps_of([command_id])
        return tuple(steps.get(command_id, ()))

    async def steps_of(
        self, command_ids: Sequence[str]
    ) -> dict[str, list[CommandEventRecord]]:
        """The audit trails of some commands, each oldest first."""
        events = command_events.c
        wanted = (
            select(command_events)
            .where(events.command_id.in_(command_ids))
            .order_by(events.at, events.row_id)
        )
        steps: dict[str, list[CommandEventRecord]] = {}
        for step in await self._records(CommandEventRecord, wanted):
            steps.setdefault(step.command_id, []).append(step)
        return steps

    async def newest_lines(self, most: int) -> tuple[LogRecord, ...]:
        """The newest lines of the log, newest first."""
        return (await self.log(Filter(limit=most))).items

    async def speed_series(
        self, since: float, until: float, robot: str | None = None
    ) -> tuple[series.SpeedSeries, ...]:
        """Speed and factors of each robot over a range, at most 2,000 points each."""
        return await self._ask(lambda c: series.speed_series(c, since, until, robot))

    async def day_series(
        self, since: float, until: float
    ) -> tuple[tuple[Pose, ...], tuple[DaySighting, ...]]:
        """Poses of robots and positions of people in each second of a range."""
        poses = await self._ask(lambda c: series.poses_of(c, since, until))
        return poses, await self._ask(lambda c: series.people_seen(c, since, until))

    async def rule_inputs(
        self, robots: Collection[str], since: float, until: float
    ) -> RuleInputs:
        """What judgements of a range rest on, and what was decided (Unix s)."""
        return await self._ask(lambda c: rule_inputs(c, robots, since, until))

    async def lost_of_day(
        self, since: float, until: float
    ) -> tuple[Literal["places", "telemetry"], ...]:
        """What of a range is no longer kept, or of a part of it."""
        return await self._ask(lambda c: ages.lost_of(c, since, until))

    async def cost_rows(
        self, since: float, until: float, braking: Mapping[str, float]
    ) -> CostRows:
        """What a range cost and how near it was; ``braking`` of each robot (m/s²)."""
        return await self._ask(lambda c: cost_rows(c, since, until, braking))

    async def climate_series(self, since: float, until: float) -> series.ClimateSeries:
        """The air over a range, at most 288 points."""
        return await self._ask(lambda c: series.climate_series(c, since, until))

    async def confidence_counts(
        self, since: float, until: float, robot: str | None = None
    ) -> tuple[series.ConfidenceCount, ...]:
        """Detections of a range by class and confidence."""
        return await self._ask(
            lambda c: series.confidence_counts(c, since, until, robot)
        )

    async def command_latencies(
        self, since: float, until: float, robot: str | None = None
    ) -> tuple[series.CommandLatency, ...]:
        """Times of the newest STOPs of a range, oldest first."""
        return await self._ask(
            lambda c: series.command_latencies(c, since, until, robot)
        )

    async def latency_minutes(self, since: float) -> tuple[LatencyRecord, ...]:
        """Every minute of every hop from then on (Unix s), oldest first."""
        c = latency.c
        wanted = select(latency).where(c.at >= since).order_by(c.at, c.row_id)
        return await self._records(LatencyRecord, wanted)

    async def recorded_days(self, most: int) -> tuple[int, ...]:
        """Days (UTC, since 1970) with a line in the log, newest first."""
        return await self._ask(lambda c: ages.recorded_days(c, most))

    async def oldest_telemetry(self) -> float | None:
        """The oldest row of telemetry (Unix s); None where there is none."""
        return await self._ask(ages.oldest_telemetry)

    def close(self) -> None:
        """Let go of threads and connections."""
        self._threads.shutdown(wait=False, cancel_futures=True)
        self._engine.dispose()

    async def _records(self, kind: type[R], wanted: Select[Any]) -> tuple[R, ...]:
        """The rows that a statement finds, as records in its order."""

        def read(connection: Connection) -> tuple[R, ...]:
            rows = connection.execute(wanted).mappings()
            return tuple(record_of(kind, row) for row in rows)

        return await self._ask(read)

    async def _ask(self, question: Callable[[Connection], _T]) -> _T:
        loop = asyncio.get_running_loop()
        return await loop.run_in_executor(self._threads, self._answer, question)

    def _answer(self, question: Callable[[Connection], _T]) -> _T:
        try:
            with self._engine.connect() as connection:
                return question(connection)
        except SQLAlchemyError as error:
            raise HopError("database", reason_of(error)) from error
