"""IoT Agent for JSON: measures from MQTT to the context broker, commands back.

It runs in the process of both brokers: messages of devices, measures and commands are
passed by function calls.  Topics, payloads and the north port match the real agent; its
limits are listed in ``docs/fiware.md``.  Payloads that the agent discards without an
error are discarded here too: text that is not JSON, bare numbers and strings, an
invalid ``TimeInstant``.
"""

import logging
from collections.abc import Mapping, Sequence
from functools import lru_cache

import orjson
from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import Response

from iveg.adapters import clock
from iveg.lab.embedded.context_broker import ContextBroker, Registration
from iveg.lab.embedded.devices import (
    AgentDevice,
    Group,
    Registry,
    Tenancy,
    read_device,
    read_group,
)
from iveg.lab.embedded.entities import (
    EntityChange,
    FiwareError,
    Scope,
    Value,
    bad_request,
    check_name,
    check_value,
    date_json,
    date_text,
    fiware_app,
    load_object,
    looks_clean,
    new_id,
    wrong_syntax,
)
from iveg.lab.embedded.mqtt_broker import MqttBroker

MAX_MEASURE = (1 << 20) - 256
_INSTANT = "TimeInstant"
_RENAMED = {"id": "measure_id", "type": "measure_type"}


def read_measure(
    device: AgentDevice, payload: bytes, now: float
) -> dict[str, EntityChange]:
    """Read the payload of an ``attrs`` topic.

    Raises:
        FiwareError: 400, it is discarded.
    """
    measure = load_object(payload)
    if len(payload) > MAX_MEASURE:
        raise bad_request(f"payload size: {len(payload)}")
    clean = looks_clean(payload)
    given = measure.pop(_INSTANT, None)
    instant = date_json(now) if given is None else date_text(given)
    changes = {}
    mapping = device.mapping
    for key, value in measure.items():
        name, kind = mapping.get(key) or (_RENAMED.get(key, key), "Text")
        check_name(name, "attribute name")
        check_value(value, clean=clean)
        changes[name] = EntityChange(kind, value, instant)
    changes[_INSTANT] = EntityChange("DateTime", Value(json=instant))
    return changes


def read_answer(
    device: AgentDevice, payload: bytes, now: float
) -> dict[str, EntityChange]:
    """Read the payload of a ``cmdexe`` topic; answers to unknown commands are left.

    Raises:
        FiwareError: 400, it is discarded.
    """
    answers = load_object(payload)
    return status_changes(
        {name: ("OK", answers[name]) for name in device.command_names & answers.keys()},
        now,
    )


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
    if not results:
        return {}
    instant = date_json(now)
    changes = {}
    for name, (status, answer) in results.items():
        changes[f"{name}_status"] = EntityChange("commandStatus", status, instant)
        if status == "OK":
            check_value(answer, clean=False)
            changes[f"{name}_info"] = EntityChange("commandResult", answer, instant)
    changes[_INSTANT] = EntityChange("DateTime", Value(json=instant))
    return changes


_log = logging.getLogger(__name__)
_READERS = {"attrs": read_measure, "cmdexe": read_answer}
_Topic = tuple[str, str, str]
"""API key, device, ``attrs`` or ``cmdexe``."""


@lru_cache(maxsize=2048)
def _read_device_topic(topic: str) -> _Topic | None:
    match topic.split("/"):
        case ["", apikey, device, kind] if kind in _READERS:
            return apikey, device, kind
    return None


class IotAgent:
    """Devices with their measures and commands.

    Args:
        broker: The context broker.
        mqtt: The MQTT broker that devices use.
    """

    def __init__(self, broker: ContextBroker, mqtt: MqttBroker) -> None:
        self._broker = broker
        self._mqtt = mqtt
        self.registry = Registry()
        self._url = ""
        mqtt.listen(self.hear)

    def is_at(self, url: str) -> None:
        """Commands are registered with this address, that of the north port."""
        self._url = url
        self._broker.providers[url] = self.command

    # --- measures ---------------------------------------------------------------

    def hear(self, topic: str, payload: bytes) -> None:
        """Handle an MQTT message, if it is for the agent.

        Topics are ``/{apikey}/{device}/attrs`` and ``…/cmdexe``.
        """
        spoken = _read_device_topic(topic)
        if spoken is None:
            return
        try:
            self._take_from(spoken, payload, clock.wall())
        except FiwareError as error:
            # Devices get no error.
            _log.debug("a message on %s was discarded: %s", topic, error)

    def _take_from(self, spoken: _Topic, payload: bytes, now: float) -> None:
        apikey, device_id, kind = spoken
        device = self.registry.device_of(apikey, device_id)
        if device is None:
            device = self._autoprovision(apikey, device_id)
        if device is not None:
            self._write(device, _READERS[kind](device, payload, now), now)

    def _write(
        self, device: AgentDevice, changes: Mapping[str, EntityChange], now: float
    ) -> None:
        if changes:
            scope = Scope(device.service, device.service_path, now)
            self._broker.upsert(scope, device.entity_name, device.entity_type, changes)

    def _autoprovision(self, apikey: str, device_id: str) -> AgentDevice | None:
        group = self.registry.group_of(apikey)
        if group is None or group.autoprovision is False:
            return None
        return self._keep(read_device({"device_id": device_id}, group.tenancy, group))

    # --- devices ----------------------------------------------------------------

    def provision(self, raw: Mapping[str, object], tenancy: Tenancy) -> None:
        """Create one device from a ``POST``.

        Raises:
            FiwareError: 400 or 501, or 409 if the device exists.
        """
        group = self.registry.group_of(raw.get("apikey"), tenancy)
        device = read_device(raw, tenancy, group)
        if self.registry.is_known(device):
            raise FiwareError(
                "DUPLICATE_DEVICE_ID",
                "A device with the same info (DeviceId, ApiKey, Service, Subservice) "
                f"was found:{device.device_id}",
            )
        self._keep(device)

    def _keep(self, device: AgentDevice) -> AgentDevice:
        if device.commands:
            device = self._register(device)
        self.registry.put(device)
        return device

    def _register(self, device: AgentDevice) -> AgentDevice:
        """Register the commands of an entity at the context broker."""
        made = Registration(
            new_id(),
            device.service_path,
            device.entity_name,
            device.entity_type,
            tuple(one.name for one in device.commands),
            self._url,
        )
        self._registrations(device)[made.id] = made
        return device.model_copy(update={"registration_id": made.id})

    def forget(self, device: AgentDevice) -> None:
        """Delete a device and its registration."""
        self._registrations(device).pop(device.registration_id, None)
        self.registry.remove(device)

    def _registrations(self, device: AgentDevice) -> dict[str, Registration]:
        return self._broker.tenant(device.service).registrations

    # --- commands ----------------------------------------------------------------

    async def command(
        self, scope: Scope, name: str, kind: str, values: Mapping[str, object]
    ) -> None:
        """Publish commands of one entity.

        An unknown command is ignored, and one without a connected robot is lost:
        neither is an error.

        Raises:
            FiwareError: 404, no device has this entity.
        """
        device = self.registry.device_for(
            Tenancy(scope.service, scope.path), name, kind
        )
        now = clock.wall()
        known = {one: values[one] for one in values if one in device.command_names}
        for command, value in known.items():
            topic = f"/{device.apikey}/{device.device_id}/cmd"
            self._mqtt.publish(topic, orjson.dumps({command: value}))
        pending = dict.fromkeys(known, ("PENDING", None))
        self._write(device, status_changes(pending, now), now)


_ABOUT = {
    "libVersion": "4.14.0-iveg-embedded",
    "baseRoot": "/",
    "version": "3.14.0-iveg-embedded",
}
_JSON = "application/json; charset=utf-8"


def iota_api(agent: IotAgent) -> Starlette:
    """The north port of an agent, which answers requests as the real one does."""
    devices, groups = _DeviceApi(agent), _GroupApi(agent.registry)
    table = {
        "GET /iot/about": _about,
        "GET /iot/services": groups.list,
        "POST /iot/services": groups.create,
        "PUT /iot/services": groups.change,
        "DELETE /iot/services": groups.delete,
        "GET /iot/devices": devices.list,
        "POST /iot/devices": devices.create,
        "DELETE /iot/devices/{id}": devices.delete,
    }
    return fiware_app(table, _refusal)


async def _about(_: Request) -> Response:
    return _json(_ABOUT)


class _GroupApi:
    """``/iot/services``."""

    def __init__(self, registry: Registry) -> None:
        self._registry = registry

    async def list(self, request: Request) -> Response:
        return _page(request, "services", self._registry.groups(_tenancy(request)))

    async def create(self, request: Request) -> Response:
        tenancy = _tenancy(request)
        for raw in await _listed(request, "services"):
            self._registry.add_group(read_group(raw, tenancy))
        return _json({}, 201)

    async def change(self, request: Request) -> Response:
        tenancy, key = _tenancy(request), _group_key(request)
        self._registry.change_group(tenancy, *key, await _object(request))
        return Response(status_code=204)

    async def delete(self, request: Request) -> Response:
        self._registry.remove_group(_tenancy(request), *_group_key(request))
        return Response(status_code=204)


class _DeviceApi:
    """``/iot/devices``."""

    def __init__(self, agent: IotAgent) -> None:
        self._agent = agent

    async def list(self, request: Request) -> Response:
        known = self._agent.registry.devices(_tenancy(request))
        return _page(request, "devices", known)

    async def create(self, request: Request) -> Response:
        tenancy = _tenancy(request)
        for raw in await _listed(request, "devices"):
            self._agent.provision(raw, tenancy)
        return _json({}, 201)

    async def delete(self, request: Request) -> Response:
        name = request.path_params["id"]
        self._agent.forget(self._agent.registry.device(_tenancy(request), name))
        return Response(status_code=204)


def _refusal(error: FiwareError) -> Response:
    return Response(error.body("name", "message"), error.status, media_type=_JSON)


def _tenancy(request: Request) -> Tenancy:
    missing = [
        name
        for name in ("fiware-service", "fiware-servicepath")
        if not request.headers.get(name)
    ]
    if missing:
        raise FiwareError(
            "MISSING_HEADERS",
            "Some headers were missing from the request: "
            + orjson.dumps(missing).decode(),
        )
    return Tenancy(
        request.headers["fiware-service"].lower(),
        request.headers["fiware-servicepath"],
    )


async def _object(request: Request) -> dict[str, object]:
    try:
        return load_object(await request.body())
    except FiwareError:
        raise wrong_syntax() from None


async def _listed(request: Request, name: str) -> list[dict[str, object]]:
    listed = (await _object(request)).get(name)
    if not isinstance(listed, list) or not all(isinstance(one, dict) for one in listed):
        raise wrong_syntax()
    return listed


def _group_key(request: Request) -> tuple[str, str]:
    query = request.query_params
    return query.get("resource", ""), query.get("apikey", "")


def _page(
    request: Request, name: str, listed: Sequence[Group] | Sequence[AgentDevice]
) -> Response:
    query = request.query_params
    limit, offset = query.get("limit", "20"), query.get("offset", "0")
    if not (limit.isdecimal() and offset.isdecimal()):
        raise wrong_syntax()
    shown = [one.show() for one in listed[int(offset) : int(offset) + int(limit)]]
    return _json({"count": len(listed), name: shown})


def _json(value: object, status: int = 200) -> Response:
    return Response(orjson.dumps(value), status, media_type=_JSON)
