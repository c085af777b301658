"""From Orion's notifications to observations.

A part that cannot be read becomes a ``Problem`` beside its neighbours and never hurts
them.
"""

from collections.abc import Container, Mapping

from pydantic import ValidationError

from iveg.domain.errors import UnreadableError
from iveg.domain.observations import EntityReading
from iveg.ngsi import names, payloads, texts
from iveg.ngsi.codec.attributes import (
    NO_OTHERS,
    IsPast,
    Readers,
    climate,
    heartbeat,
    read_attributes,
    read_one,
)
from iveg.ngsi.codec.untrusted import (
    ReadResult,
    first_complaint,
    load_json,
    merge,
    unread,
)


def read_notification(
    body: bytes,
    is_past: IsPast | None = None,
    instead: Readers = NO_OTHERS,
    equipment: Container[tuple[str, str]] = frozenset(),
) -> tuple[str, ReadResult]:
    """Read a notification, normalized or keyValues.

    Args:
        body: JSON.
        is_past: Tells by its identity what need not be read; None reads all.
        instead: Other readers of some attributes, such as ``UNREAD``.
        equipment: Id and type of entities whose attributes are handed on as they are.

    Returns:
        The subscription's id and what its entities hold.

    Raises:
        UnreadableError: not a notification at all.
    """
    try:
        notification = payloads.NotificationValue.model_validate(load_json(body))
    except ValidationError as error:
        raise UnreadableError("not_a_notification", first_complaint(error)) from error
    entities = [
        read_entity(entity, is_past, instead, equipment) for entity in notification.data
    ]
    read = entities[0] if len(entities) == 1 else merge(entities)
    return notification.subscriptionId, read


def read_entity(
    entity: Mapping[str, object],
    is_past: IsPast | None = None,
    instead: Readers = NO_OTHERS,
    equipment: Container[tuple[str, str]] = frozenset(),
) -> ReadResult:
    """Read one NGSI-v2 entity in either representation."""
    entity_id, entity_type = entity.get("id"), entity.get("type")
    if not isinstance(entity_id, str) or not isinstance(entity_type, str):
        return unread("?", "not_an_entity", "an entity needs id and type")
    attributes = {
        name: _attribute_value(value)
        for name, value in entity.items()
        if name not in ("id", "type")
    }
    if entity_type == names.ROBOT_TYPE:
        if not names.is_robot_id(entity_id):
            return unread(texts.clean_text(entity_id), "bad_robot_id")
        return read_attributes(entity_id, attributes, is_past, instead)
    if (entity_id, entity_type) == (names.CLIMATE_ID, names.CLIMATE_TYPE):
        return read_one(entity_id, climate, attributes)
    if (entity_id, entity_type) == (names.HEARTBEAT_ID, names.HEARTBEAT_TYPE):
        return read_one(entity_id, heartbeat, attributes)
    if (entity_id, entity_type) in equipment:
        return ReadResult(equipment=(EntityReading(entity_id, attributes),))
    return unread(
        texts.clean_text(entity_id),
        "foreign_entity",
        texts.clean_text(entity_type),
    )


def _attribute_value(attribute: object) -> object:
    if isinstance(attribute, dict) and "value" in attribute and "type" in attribute:
        return attribute["value"]
    return attribute
