"""Questions about the past, read and checked at the boundary.

Times are ISO-8601; one without an offset is UTC.  A name that is not a filter is
refused: a misspelt filter that answers everything would mislead.
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
"""Days with which time zones and ranges can be computed."""
_USUAL_RANGE_S = 15 * 60.0
_ROBOT_ID = r"^[A-Za-z0-9-]{1,64}$"
_NO_CONTROLS = r"^[^\x00-\x1f]*$"
"""PostgreSQL refuses text that holds NUL."""


def mend_plus(value: object) -> object:
    """A moment's text, with the plus that an address makes a space."""
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


Moment = Annotated[datetime, BeforeValidator(mend_plus), AfterValidator(_in_utc)]
HistoryDay = Annotated[date, AfterValidator(as_kept)]


class Span(BaseModel):
    """Since when and until when."""

    model_config = ConfigDict(extra="forbid")

    since: Moment | None = Field(None, description="From here on, inclusive (ISO-8601)")
    until: Moment | None = Field(None, description="Up to here, exclusive (ISO-8601)")

    @model_validator(mode="after")
    def _in_order(self) -> Self:
        if self.since and self.until and self.since > self.until:
            raise PydanticCustomError("order", "since is after until")
        return self


class Range(Span):
    """Since when, until when, and of which robot."""

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
    """Whether a detection that is in memory is one of those that are asked for."""
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
    """The question to the database.

    Raises:
        RequestValidationError: the cursor is none of such a list.
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


def range_of(
    asked: Span, now: float, usual_s: float = _USUAL_RANGE_S
) -> tuple[float, float]:
    """Since and until in Unix seconds; the last ``usual_s`` when nothing is asked.

    Raises:
        RequestValidationError: the range is turned round or too long to draw.
    """
    until = now if asked.until is None else asked.until.timestamp()
    since = until - usual_s if asked.since is None else asked.since.timestamp()
    if since > until:
        raise _invalid("since", "since is after until")
    if until - since > LONGEST_RANGE_S:
        raise _invalid("since", "a chart shows 31 days at most")
    return since, until


def seconds(moment: datetime | None) -> float | None:
    """Unix time (s); None where none was asked for."""
    return None if moment is None else moment.timestamp()


def _invalid(name: str, why: str) -> RequestValidationError:
    return RequestValidationError(
        [{"type": "invalid", "loc": ("query", name), "msg": why}]
    )
