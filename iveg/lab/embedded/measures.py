"""From the payload of a device to changes of its entity.

Payloads that the agent discards without an error are discarded here too: text that is
not JSON, bare numbers and strings, lists of numbers, an invalid ``TimeInstant``.
"""

from collections.abc import Mapping

import orjson

from iveg.lab.embedded.devices import AgentDevice
from iveg.lab.embedded.entities import (
    EntityChange,
    Value,
)
from iveg.lab.embedded.errors import FiwareError, bad_request
from iveg.lab.embedded.orion_dates import date_json, date_text
from iveg.lab.embedded.orion_text import (
    UNRESTRICTED,
    check_name,
    holds_forbidden,
    load_json,
    looks_clean,
)

MAX_MEASURE = (1 << 20) - 256
_INSTANT = "TimeInstant"
_RENAMED = {"id": "measure_id", "type": "measure_type"}
_NOTHING: dict[str, object] = {"undefined": None}


def read_measures(
    device: AgentDevice, payload: bytes, now: float
) -> list[dict[str, EntityChange]]:
    """Read the payload of an ``attrs`` topic.

    Returns:
        One set of changes for each measure; none for a discarded payload.

    Raises:
        FiwareError: 400 or 413, what Orion says to the agent about it.
    """
    value = load_json(payload)
    clean = _check(payload)
    if value is None or value == {}:
        value = _NOTHING
    if isinstance(value, dict):
        measures = [value]
    elif isinstance(value, list) and value and all(isinstance(v, dict) for v in value):
        # A list of one is not a list of measures; the agent walks its index instead.
        measures = value if len(value) > 1 else [{"0": value[0]}]
    else:
        return []
    read = []
    for one in measures:
        changes = _read_one(device, one, now, clean=clean)
        if changes is None:
            return []
        read.append(changes)
    return read


def read_single(
    device: AgentDevice, name: str, payload: bytes, now: float
) -> list[dict[str, EntityChange]]:
    """Read the payload of ``attrs/{name}``; invalid JSON is stored as hexadecimal.

    Returns:
        The changes; none for a discarded payload.

    Raises:
        FiwareError: 400 or 413, what Orion says to the agent about it.
    """
    if not payload:
        return []
    try:
        value = orjson.loads(payload)
        clean = _check(payload)
    except orjson.JSONDecodeError:
        value, clean = payload.hex(), True
    changes = _read_one(device, {name: value}, now, clean=clean)
    return [] if changes is None else [changes]


def _check(payload: bytes) -> bool:
    if len(payload) > MAX_MEASURE:
        raise FiwareError("RequestEntityTooLarge", f"payload size: {len(payload)}")
    return looks_clean(payload)


def _read_one(
    device: AgentDevice, measure: Mapping[str, object], now: float, *, clean: bool
) -> dict[str, EntityChange] | None:
    given = measure.get(_INSTANT)
    try:
        instant = date_json(now) if given is None else date_text(given)
    except FiwareError:
        return None
    metadata = {_INSTANT: b'{"type":"DateTime","value":%b}' % instant}
    changes = {}
    mapping = device.mapping
    for key, value in measure.items():
        if key == _INSTANT:
            continue
        name, kind = mapping.get(key) or (_RENAMED.get(key, key), "Text")
        check_name(name, "attribute name")
        if not clean and kind != UNRESTRICTED and holds_forbidden(value):
            raise bad_request("Invalid characters in attribute value")
        changes[name] = EntityChange(kind, value, metadata)
    changes[_INSTANT] = EntityChange("DateTime", Value(json=instant))
    return changes


def status_changes(
    results: Mapping[str, tuple[str, object]], now: float
) -> dict[str, EntityChange]:
    """Changes that the agent writes for the status of commands.

    Args:
        results: Command → status, and the answer (for a status of ``OK``).
        now: Seconds, Unix time.

    Raises:
        FiwareError: 400, a forbidden character in an answer.
    """
    instant = date_json(now)
    metadata = {_INSTANT: b'{"type":"DateTime","value":%b}' % instant}
    changes = {}
    for name, (status, answer) in results.items():
        changes[f"{name}_status"] = EntityChange("commandStatus", status, metadata)
        if status == "OK":
            if holds_forbidden(answer):
                raise bad_request("Invalid characters in attribute value")
            changes[f"{name}_info"] = EntityChange("commandResult", answer, metadata)
    changes[_INSTANT] = EntityChange("DateTime", Value(json=instant))
    return changes
