"""Batches of what a robot kept during a gap, both ways."""

from collections.abc import Iterable, Mapping, Sequence

import orjson
from pydantic import ValidationError

from iveg.domain.backfill import KEPT, MOST_BOXES, Batch
from iveg.domain.errors import UnreadableError
from iveg.domain.observations import (
    DetectionFrame,
    Observation,
    Origin,
)
from iveg.ngsi import payloads
from iveg.ngsi.codec.attributes import read_attributes
from iveg.ngsi.codec.fields import read_origin, write_origin
from iveg.ngsi.codec.untrusted import UnreadPart, first_complaint, load_json

LARGEST = 16_384
"""Size of a batch at most (bytes)."""


def write_backfill(robot_id: str, origin: Origin, kept: Iterable[bytes]) -> bytes:
    """The bytes of ``/{robot}/iveg/backfill``.

    Args:
        robot_id: Who sends them.
        origin: This moment; no count.
        kept: Payloads of the robot's measures, oldest first.
    """
    head = {"robot_id": robot_id, **write_origin(origin)}
    return orjson.dumps(head | {"messages": [orjson.Fragment(one) for one in kept]})


def read_backfill(
    robot_id: str, payload: bytes
) -> tuple[Batch, tuple[UnreadPart, ...]]:
    """Read ``/{robot}/iveg/backfill``; a message that cannot be read hurts no other.

    Raises:
        UnreadableError: ``too_large``, ``not_json``, ``not_a_backfill``, or
            ``another_robot`` than ``robot_id``.
    """
    if len(payload) > LARGEST:
        raise UnreadableError("too_large", f"{len(payload)} bytes")
    try:
        value = payloads.BackfillValue.model_validate(load_json(payload))
    except ValidationError as error:
        raise UnreadableError("not_a_backfill", first_complaint(error)) from error
    if value.robot_id != robot_id:
        raise UnreadableError("another_robot", value.robot_id)
    origin = read_origin(value)
    if origin.boot is None or origin.mono is None:
        raise UnreadableError("not_a_backfill", "boot and mono are needed")
    return _read(robot_id, origin, value.messages)


def _read(
    robot_id: str, origin: Origin, messages: Sequence[Mapping[str, object]]
) -> tuple[Batch, tuple[UnreadPart, ...]]:
    readings = [read_attributes(robot_id, message) for message in messages]
    observed = [one for reading in readings for one in reading.observations]
    problems = [one for reading in readings for one in reading.problems]
    kept: list[Observation] = []
    for one in observed:
        if not isinstance(one, KEPT):
            continue
        if reason := _objection(one, origin):
            problems.append(UnreadPart(robot_id, reason, f"seq {one.origin.seq}"))
        else:
            kept.append(one)
    return Batch(robot_id, origin, tuple(kept)), tuple(problems)


def _objection(one: Observation, sent: Origin) -> str:
    """Why a message is no part of the record; empty where it is."""
    own = one.origin
    if own.replay is not None or sent.replay is not None:
        return "late_replay"
    if own.boot != sent.boot or own.seq is None or own.mono is None:
        return "late_without_origin"
    if isinstance(one, DetectionFrame) and len(one.detections) > MOST_BOXES:
        return "late_too_many_boxes"
    return ""
