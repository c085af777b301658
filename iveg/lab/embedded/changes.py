"""Attributes of a request, read into changes of an entity."""

from collections.abc import Collection, Mapping

from iveg.lab.embedded.entities import EntityChange, default_type, metadata_json
from iveg.lab.embedded.errors import bad_request
from iveg.lab.embedded.orion_dates import date_text
from iveg.lab.embedded.orion_text import (
    UNRESTRICTED,
    check_given_name,
    check_name,
    holds_forbidden,
)


def read_changes(
    attributes: Mapping[str, object], *, key_values: bool, clean: bool
) -> dict[str, EntityChange]:
    """Read attributes from a request.

    Args:
        attributes: Name → attribute, without ``id`` and ``type``.
        key_values: Whether an attribute is its bare value.
        clean: Whether the body is known to hold no forbidden character.

    Raises:
        FiwareError: 400, with the sentence of the first complaint.
    """
    return {
        name: _read_change(name, {"value": one} if key_values else one, clean=clean)
        for name, one in attributes.items()
    }


def _read_change(name: str, raw: object, *, clean: bool) -> EntityChange:
    check_name(name, "attribute name")
    if not isinstance(raw, dict):
        raise bad_request(
            "attribute must be a JSON object, unless keyValues option is used"
        )
    kind, value = _read_typed(
        raw, ("type", "value", "metadata"), "attribute", clean=clean
    )
    if kind == "DateTime" and value is not None:
        date_text(value)
    metadata = raw.get("metadata")
    read = None if metadata is None else _read_metadata(metadata, clean=clean)
    return EntityChange(kind, value, read)


def _read_metadata(raw: object, *, clean: bool) -> dict[str, bytes]:
    if not isinstance(raw, dict):
        raise bad_request("metadata must be a JSON object")
    metadata = {}
    for name, one in raw.items():
        check_name(name, "metadata name")
        kind, value = _read_typed(one, ("type", "value"), "metadata", clean=clean)
        metadata[name] = metadata_json(kind or default_type(value), value)
    return metadata


def _read_typed(
    raw: object, known: Collection[str], what: str, *, clean: bool
) -> tuple[str | None, object]:
    """Type, if there is one, and value of an attribute or its metadata."""
    if not isinstance(raw, dict) or not raw.keys() <= set(known):
        raise bad_request(f"unrecognized property for {_PLACES[what]}")
    kind, value = raw.get("type"), raw.get("value")
    if kind is not None:
        check_given_name(kind, f"{what} type")
    if not clean and kind != UNRESTRICTED and holds_forbidden(value):
        raise bad_request(f"Invalid characters in {what} value")
    return kind, value


_PLACES = {"attribute": "context attribute", "metadata": "metadata"}
