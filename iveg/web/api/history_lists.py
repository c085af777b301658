"""The lists of the history: of each its source and its models."""

from collections.abc import Awaitable, Callable, Sequence
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

from iveg.adapters.history import listings
from iveg.adapters.history.listings import ListOf
from iveg.adapters.history.queries import Queries
from iveg.domain.alerts.flood import FloodState as NoFlood
from iveg.domain.records import CommandRecord, Record
from iveg.models.alert import Alert, AlertListing, Flood
from iveg.models.audit import AuditEntry
from iveg.models.base import Listing, Model
from iveg.models.command import Command
from iveg.models.decision import Decision
from iveg.models.equipment import Measurement
from iveg.models.kept_detection import DetectionRow
from iveg.models.log_entry import LogEntry
from iveg.models.odometry import OdometryRow
from iveg.models.reading import Reading
from iveg.web.security.roles import Action

R = TypeVar("R", bound=Record)


@dataclass(frozen=True, slots=True)
class HistoryList(Generic[R]):
    """One list: its source and its models; ``more`` stands beside it.

    Attributes:
        model: Of a row, and of what ``beside`` found for it.
        beside: Other rows that the models of some rows need, in their order.
        needs: What whoever asks must be allowed.
    """

    path: str
    of: ListOf[R]
    model: Callable[..., Model]
    listing: type[Listing[Any]]
    says: str
    more: Callable[[], dict[str, Any]] = dict
    beside: Callable[[Sequence[R]], Awaitable[list[Any]]] | None = None
    needs: Action = "read"

    async def rows(self, records: Sequence[R]) -> list[tuple[Any, ...]]:
        """What ``model`` is called with, for each record."""
        if self.beside is None:
            return [(one,) for one in records]
        return list(zip(records, await self.beside(records), strict=True))


_MEASURED: tuple[HistoryList[Any], ...] = (
    HistoryList(
        "detections",
        listings.DETECTIONS,
        DetectionRow.of_row,
        Listing[DetectionRow],
        "What robots saw, by when it reached iVeg",
    ),
    HistoryList(
        "tracks",
        listings.TRACKS,
        DetectionRow.of_row,
        Listing[DetectionRow],
        "Where people were: their detections, by when each reached iVeg",
    ),
    HistoryList(
        "odometry",
        listings.ODOMETRY,
        OdometryRow.of_record,
        Listing[OdometryRow],
        "Poses and speeds of robots with their speed limits, twice a second",
    ),
    HistoryList(
        "readings",
        listings.READINGS,
        Reading.of_record,
        Listing[Reading],
        "What small sensors of robots said; `class` asks for a kind, as `battery`",
    ),
    HistoryList(
        "measurements",
        listings.MEASUREMENTS,
        Measurement.of_record,
        Listing[Measurement],
        "Numbers of other equipment; `class` asks for an entity or an attribute",
    ),
)
"""What was measured; each column of the CSV is a key of the JSON."""


def lists_of(
    queries: Queries, flood: Callable[[], Flood] = lambda: Flood.of(NoFlood())
) -> tuple[HistoryList[Any], ...]:
    """All lists of the history."""

    async def steps_of(records: Sequence[CommandRecord]) -> list[Any]:
        steps = await queries.steps_of([one.command_id for one in records])
        return [steps.get(one.command_id, ()) for one in records]

    return (
        HistoryList(
            "decisions",
            listings.DECISIONS,
            Decision.of_record,
            Listing[Decision],
            "Why robots were slowed, by when it began",
        ),
        HistoryList(
            "commands",
            listings.COMMANDS,
            Command.of_record,
            Listing[Command],
            "Every STOP, release and resume, by when it was asked",
            beside=steps_of,
        ),
        HistoryList(
            "alerts",
            listings.ALERTS,
            Alert.of_record,
            AlertListing,
            "Every alert, by when it was last raised, and how fast they come",
            lambda: {"flood": flood()},
        ),
        HistoryList(
            "log",
            listings.LOG,
            LogEntry.of_record,
            Listing[LogEntry],
            "The action and inference log",
        ),
        HistoryList(
            "audit",
            listings.AUDIT,
            AuditEntry.of_record,
            Listing[AuditEntry],
            "Who did what; `robot` asks for a subject, `class` for an action or name",
            needs="release",
        ),
        *_MEASURED,
    )
