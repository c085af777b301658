"""Parameters of requests to the history, read and checked at the boundary.

Times are ISO-8601; one without an offset is UTC.  A name that is not a filter is
refused: an ignored misspelt filter would mislead.
"""

from collections.abc import Callable
from datetime import UTC, date, datetime
from typing import Annotated, Self, TypeVar

from fastapi.exceptions import RequestValidationError
from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    model_validator,
)
from pydantic_core import PydanticCustomError

from iveg.adapters.history import lists
from iveg.adapters.history.lists import Filter, ListOf
from iveg.domain.errors import UnreadableError
from iveg.domain.records import Record
from iveg.vital.detections import JudgedDetection
from iveg.web.api.exports import Form

R = TypeVar("R", bound=Record)
LONGEST_RANGE_S = 31 * 86_400.0
_FIRST_DAY, _LAST_DAY = date(1970, 1, 2), date(9000, 1, 1)
"""Days for which every time zone and range can be computed without overflow."""
USUAL_RANGE_S = 15 * 60.0
_ROBOT_ID = r"^[A-Za-z0-9-]{1,64}$"
_NO_CONTROLS = r"^[^\x00-\x1f]*$"
"""PostgreSQL refuses text that holds NUL."""


def mend_plus(value: object) -> object:
    """A moment's text, with the plus sign that an address turned into a space."""
    # An unescaped "+00:00" reaches us as " 00:00", from nearly every first attempt.
    if isinstance(value, str) and "T" in value:
        return value.strip().replace(" ", "+")
    return value


def _in_utc(moment: datetime) -> datetime:
    zoned = moment if moment.tzinfo else moment.replace(tzinfo=UTC)
    as_kept(zoned.date())
    return zoned


def as_kept(day: date) -> date:
    """The day, if a history may have it.  Raises PydanticCustomError."""
    if not _FIRST_DAY <= day <= _LAST_DAY:
        raise PydanticCustomError("day", "no day of any history")
    return day


RecordId = Annotated[str, Field(pattern=r"^[ -~]{1,64}$")]
Moment = Annotated[datetime, BeforeValidator(mend_plus), AfterValidator(_in_utc)]
HistoryDay = Annotated[date, AfterValidator(as_kept)]


class Span(BaseModel):
    """Since when and until when."""

    model_config = ConfigDict(extra="forbid")

    since: Moment | None = Field(None, description="From here on, inclusive (ISO-8601)")
    until: Moment | None = Field(None, description="Up to here, exclusive (ISO-8601)")

    @model_validator(mode="after")
    def _in_order(self) -> Self:
        # An empty answer would hide that start and end were swapped.
        if self.since and self.until and self.since > self.until:
            raise PydanticCustomError("order", "since is after until")
        return self


class Range(Span):
    """Start, end and robot of a range."""

    robot: str | None = Field(None, pattern=_ROBOT_ID, description="Robot id")


class RowFilters(Range):
    """Filters of lists whose rows are all in memory."""

    class_: str | None = Field(
        None,
        alias="class",
        max_length=64,
        pattern=_NO_CONTROLS,
        description="Canonical class, or as sent",
    )
    person: str | None = Field(
        None,
        max_length=64,
        pattern=_NO_CONTROLS,
        description="Person id; of decisions, detections and tracks",
    )
    min_probability: float | None = Field(
        None, ge=0, le=1, allow_inf_nan=False, description="Least confidence, inclusive"
    )
    limit: int | None = Field(
        None, ge=1, le=lists.MOST_ROWS, description="Rows of a page; 100 unless told"
    )


class Filters(RowFilters):
    """Filters of every list of the history."""

    cursor: str | None = Field(
        None, max_length=200, description="`next` of the page before"
    )
    format: Form | None = Field(None, description="Instead of an `Accept` header")


def admitting(wanted: RowFilters) -> Callable[[JudgedDetection], bool]:
    """A filter for detections in memory: whether a request asks for one."""
    since = seconds(wanted.since) or float("-inf")
    until = seconds(wanted.until) or float("inf")

    def admits(judged: JudgedDetection) -> bool:
        seen, frame, received = judged
        person = None if seen.person is None else seen.person.person_id
        return (
            since <= received.at.wall < until
            and wanted.robot in (None, frame.robot_id)
            and wanted.class_ in (None, seen.class_, seen.detection.class_id)
            and wanted.person in (None, person)
            and seen.detection.probability >= (wanted.min_probability or 0.0)
        )

    return admits


def filter_of(filters: Filters, listed: ListOf[R]) -> Filter:
    """The database's filter for a request.

    Raises:
        RequestValidationError: the cursor belongs to another list.
    """
    try:
        text = filters.cursor
        cursor = None if text is None else lists.read_cursor(text, listed)
    except UnreadableError as error:
        raise _invalid("cursor", "not a cursor of this list") from error
    return Filter(
        since=seconds(filters.since),
        until=seconds(filters.until),
        robot=filters.robot,
        class_=filters.class_,
        person=filters.person,
        min_probability=filters.min_probability,
        limit=filters.limit or lists.USUAL_ROWS,
        cursor=cursor,
    )


def range_of(span: Span, now: float, usual_s: float) -> tuple[float, float]:
    """Since and until (Unix s); by default the last ``usual_s`` up to now.

    Raises:
        RequestValidationError: the range is turned round or too long to draw.
    """
    until = now if span.until is None else span.until.timestamp()
    since = until - usual_s if span.since is None else span.since.timestamp()
    if since > until:
        raise _invalid("since", "since is after until")
    if until - since > LONGEST_RANGE_S:
        raise _invalid("since", "a chart shows 31 days at most")
    return since, until


def seconds(moment: datetime | None) -> float | None:
    """Unix time (s); None without a moment."""
    return None if moment is None else moment.timestamp()


def _invalid(name: str, why: str) -> RequestValidationError:
    return RequestValidationError(
        [{"type": "invalid", "loc": ("query", name), "msg": why}]
    )
