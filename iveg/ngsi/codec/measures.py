"""Measures and answers of robots, straight from their topics."""

from iveg.domain.errors import UnreadableError
from iveg.domain.kinds import KIND_OF
from iveg.domain.observations import DetectionFrame
from iveg.ngsi import names, texts
from iveg.ngsi.codec.attributes import (
    NO_OTHERS,
    IsPast,
    Readers,
    command_answer,
    goal_answer,
    read_attributes,
    read_one,
    refused_frame,
)
from iveg.ngsi.codec.untrusted import ReadResult, load_json, unread

_FRAME_SUFFIX = KIND_OF[DetectionFrame].suffix or ""


def read_measure(
    device_id: str,
    payload: bytes,
    is_past: IsPast | None = None,
    instead: Readers = NO_OTHERS,
) -> ReadResult:
    """Read what a robot's device published on its ``attrs`` topic."""
    robot_id = names.robot_of_device(device_id)
    if not names.is_robot_id(robot_id):
        return unread(texts.clean_text(device_id), "bad_robot_id")
    try:
        attributes = load_json(payload)
    except UnreadableError as error:
        read = unread(device_id, error.reason, error.detail)
    else:
        if isinstance(attributes, dict):
            return read_attributes(robot_id, attributes, is_past, instead)
        read = unread(device_id, "not_an_object")
    is_frame = device_id == robot_id + _FRAME_SUFFIX
    return refused_frame(robot_id, read) if is_frame else read


def read_answer(robot_id: str, payload: bytes) -> ReadResult:
    """Read a robot's answer on its ``cmdexe`` topic."""
    try:
        value = load_json(payload)
    except UnreadableError as error:
        return unread(robot_id, error.reason, error.detail)
    if not isinstance(value, dict):
        return unread(robot_id, "not_an_object")
    if names.GOAL in value and names.COMMAND not in value:
        return read_one(robot_id, goal_answer, value, names.GOAL)
    return read_one(robot_id, command_answer, value, names.COMMAND)
