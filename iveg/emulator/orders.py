"""What may go wrong on purpose, as orders: the words of fault port and command line."""

import json
from collections.abc import Sequence
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from iveg.domain.errors import DataFileError, UnreadableError

Percent = Annotated[float, Field(ge=0, le=100)]
Milliseconds = Annotated[float, Field(ge=0, le=10_000)]
Metres = Annotated[float, Field(ge=-1e6, le=1e6)]


class _Order(BaseModel):
    model_config = ConfigDict(
        strict=True, extra="forbid", allow_inf_nan=False, frozen=True
    )


class OrderPlace(_Order):
    """A point in ``map`` (m)."""

    x: Metres
    y: Metres


class FaultOrder(_Order):
    """What goes wrong with one robot; a field that is absent changes nothing.

    Attributes:
        mute: Publishes nothing; ``deaf``: drives as it likes whatever iVeg says.
        freeze_odometry: ``silent`` (or true): its odometry falls silent; ``repeat``:
            the last message of it, stamp and count included, is sent again and again.
        clock_offset_s: Its wall clock is this far ahead (s).
        drop_percent: Of its telemetry, lost on the way.
        duplicate_percent: Of its telemetry, delivered twice.
        reorder_percent: Of its telemetry, overtaken by the next of the same topic.
        delay_ms: How long all that it publishes takes longer.
        jitter_ms: What is added to the delay at random, from none to all of it.
        local_hold: Somebody presses its red button, or it bumps.
        release_locally: The crew lifts those, and its boot hold.
        kill: Its software dies; ``revive`` starts it anew, held.
        false_person: Its camera sees a person there; null ends that.
        hide_people: Its camera sees no person.
    """

    robot: str
    mute: bool | None = None
    deaf: bool | None = None
    freeze_odometry: Literal["silent", "repeat"] | bool | None = None
    clock_offset_s: Annotated[float, Field(ge=-1e9, le=1e9)] | None = None
    drop_percent: Percent | None = None
    duplicate_percent: Percent | None = None
    reorder_percent: Percent | None = None
    delay_ms: Milliseconds | None = None
    jitter_ms: Milliseconds | None = None
    local_hold: Literal["hw", "bumper"] | None = None
    release_locally: bool = False
    kill: bool = False
    revive: bool = False
    false_person: OrderPlace | None = None
    hide_people: bool | None = None


class PersonOrder(_Order):
    """Puts one person somewhere; with ``hold`` to stay there.

    Attributes:
        person: Counted from 0.
        x: In ``map`` (m); ``y`` likewise.
    """

    person: int = Field(ge=0)
    x: Metres
    y: Metres
    hold: bool = False


Order = FaultOrder | PersonOrder


def read_order(body: bytes) -> Order:
    """One order as JSON.

    Raises:
        UnreadableError: it is none; one sentence names the field.
    """
    try:
        value = json.loads(body)
    except (ValueError, RecursionError) as error:
        raise UnreadableError("not_json") from error
    if not isinstance(value, dict):
        raise UnreadableError("no_object", "an order has a robot or a person")
    return _validated(PersonOrder if "person" in value else FaultOrder, value)


def read_translations(words: Sequence[str], robots: Sequence[str]) -> list[FaultOrder]:
    """The orders of a command line: ``field=value``, or ``robot:field=value`` for one.

    Args:
        words: As typed, such as ``drop_percent=10`` or ``AGI:deaf=true``.
        robots: Who is meant where no robot is named.

    Raises:
        DataFileError: a word is no order; says which and why.
    """
    orders: list[FaultOrder] = []
    for word in words:
        key, equals, text = word.partition("=")
        robot, colon, field = key.rpartition(":")
        if not equals or field in ("", "robot"):
            reason = "must be field=value or robot:field=value."
            raise DataFileError("--fault", word, reason)
        if colon and robot not in robots:
            reason = f"there is no robot {robot} among {', '.join(robots)}."
            raise DataFileError("--fault", word, reason)
        for one in [robot] if colon else robots:
            try:
                order = _validated(FaultOrder, {"robot": one, field: _value(text)})
            except UnreadableError as error:
                raise DataFileError("--fault", word, f"{error.detail}.") from error
            assert isinstance(order, FaultOrder)  # noqa: S101 - tells mypy which
            orders.append(order)
    return orders


def _value(text: str) -> object:
    """JSON where it is JSON, text elsewhere: nobody types quotation marks."""
    try:
        return json.loads(text)
    except ValueError:
        return text


def _validated(kind: type[Order], value: dict[str, object]) -> Order:
    try:
        return kind.model_validate(value)
    except ValidationError as error:
        complaints = error.errors(include_input=False, include_url=False)
        detail = _sentence([(one["loc"], one["msg"]) for one in complaints])
        raise UnreadableError("bad_order", detail) from error


def _sentence(complaints: Sequence[tuple[tuple[int | str, ...], str]]) -> str:
    """The first field that is wrong, and how."""
    place, said = complaints[0]
    # A field that allows several types complains once for each of them.
    same = [why for where, why in complaints if where[0] == place[0]]
    if len(same) > 1:
        return f"{place[0]}: {'; or '.join(same)}"
    return f"{'.'.join(str(part) for part in place)}: {said}"
