"""IoT Agent for JSON: measures from MQTT to the context broker, commands back.

It runs in the process of both brokers: messages of devices, measures and commands are
passed by function calls.  Topics, payloads and the north port match the real agent; its
limits are listed in ``docs/fiware.md``.  Payloads that the agent discards without an
error are discarded here too: text that is not JSON, bare numbers and strings, an
invalid ``TimeInstant``.
"""

from collections.abc import Iterable, Mapping
from contextlib import suppress
from functools import cached_property
from typing import Any, TypeVar

import orjson
from pydantic import BaseModel, ConfigDict, Field, ValidationError
from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import Response

from iveg.adapters import clock
from iveg.lab.embedded.context_broker import ContextBroker, Registration
from iveg.lab.embedded.entities import (
    Attribute,
    FiwareError,
    Scope,
    bad_request,
    check_name,
    check_value,
    fiware_app,
    load_object,
    looks_clean,
    new_id,
    read_date,
    write_date,
)
from iveg.lab.embedded.mqtt_broker import MqttBroker

# --- groups and devices -----------------------------------------------------------

_Read = TypeVar("_Read", bound="_Provisioned")


def _wrong_syntax() -> FiwareError:
    return FiwareError(
        "WRONG_SYNTAX", "Wrong syntax in request: Errors found validating request."
    )


class DeviceAttribute(BaseModel):
    """An attribute: its name at the device and at the context broker."""

    object_id: str | None = None
    name: str
    type: str = "Text"


class DeviceCommand(BaseModel):
    """A command."""

    name: str
    type: str = "command"


class _Provisioned(BaseModel):
    """Common fields of groups and devices; other fields are ignored.

    Lazy and static attributes, which the embedded agent cannot do, are refused.
    """

    model_config = ConfigDict(frozen=True)

    apikey: str
    service: str
    entity_type: str
    attributes: list[DeviceAttribute] = []
    lazy: list[object] = Field([], max_length=0)
    commands: list[DeviceCommand] = []
    static_attributes: list[object] = Field([], max_length=0)


class Group(_Provisioned):
    """Common settings of the devices with one API key, as clients keep them here."""

    subservice: str
    resource: str
    autoprovision: bool | None = None


class AgentDevice(_Provisioned):
    """One device.

    Attributes:
        registration_id: Its registration at the context broker; empty for none.
    """

    device_id: str
    service_path: str
    entity_name: str
    entity_type: str = "Thing"
    transport: str = "MQTT"
    protocol: str | None = None
    registration_id: str = Field("", exclude=True)

    @property
    def place(self) -> str:
        """Beginning of its topics."""
        return f"/{self.apikey}/{self.device_id}"

    @cached_property
    def mapping(self) -> Mapping[str, tuple[str, str]]:
        """Attribute name of the device → its NGSI name and type."""
        return {
            attribute.object_id or attribute.name: (attribute.name, attribute.type)
            for attribute in self.attributes
        }

    @cached_property
    def command_names(self) -> frozenset[str]:
        """Names of its commands."""
        return frozenset(command.name for command in self.commands)

    def show(self) -> dict[str, Any]:
        """The device as the agent shows it: with a name of each command at it."""
        commands = [
            {**command.model_dump(), "object_id": command.name}
            for command in self.commands
        ]
        return {**self.model_dump(exclude_none=True), "commands": commands}


def _read(kind: type[_Read], raw: Mapping[str, Any]) -> _Read:
    try:
        return kind.model_validate(raw)
    except ValidationError as error:
        raise _wrong_syntax() from error


# --- messages of devices ----------------------------------------------------------

MAX_MEASURE = (1 << 20) - 256
_INSTANT = "TimeInstant"
_RENAMED = {"id": "measure_id", "type": "measure_type"}


def read_measure(
    device: AgentDevice, payload: bytes, now: float
) -> dict[str, Attribute]:
    """Read the payload of an ``attrs`` topic.

    Raises:
        FiwareError: 400, it is discarded.
    """
    measure = load_object(payload)
    if len(payload) > MAX_MEASURE:
        raise bad_request(f"payload size: {len(payload)}")
    clean = looks_clean(payload)
    instant_value = measure.pop(_INSTANT, None)
    instant = write_date(now) if instant_value is None else read_date(instant_value)
    changes = {}
    for key, value in measure.items():
        name, kind = device.mapping.get(key) or (_RENAMED.get(key, key), "Text")
        check_name(name, "attribute name")
        check_value(value, clean=clean)
        changes[name] = Attribute(kind, value, instant)
    changes[_INSTANT] = Attribute("DateTime", instant)
    return changes


def read_answer(
    device: AgentDevice, payload: bytes, now: float
) -> dict[str, Attribute]:
    """Read the payload of a ``cmdexe`` topic; answers to unknown commands are left.

    Raises:
        FiwareError: 400, it is discarded.
    """
    answers = load_object(payload)
    changes: dict[str, Attribute] = {}
    for name in device.command_names & answers.keys():
        check_value(answers[name], clean=False)
        instant = write_date(now)
        changes |= _status_change(name, "OK", now)
        changes[f"{name}_info"] = Attribute("commandResult", answers[name], instant)
    return changes


def _status_change(name: str, status: str, now: float) -> dict[str, Attribute]:
    """Changes that the agent writes for the status of a command."""
    instant = write_date(now)
    return {
        f"{name}_status": Attribute("commandStatus", status, instant),
        _INSTANT: Attribute("DateTime", instant),
    }


_ABOUT = {
    "libVersion": "4.14.0-iveg-embedded",
    "baseRoot": "/",
    "version": "3.14.0-iveg-embedded",
}
_READERS = {"attrs": read_measure, "cmdexe": read_answer}


class IotAgent:
    """Groups and devices of every tenant, with their measures and commands.

    Args:
        broker: The context broker.
        mqtt: The MQTT broker that devices use.

    Attributes:
        groups: By tenant and path, resource and API key, oldest first.
        devices: By tenant and path, API key and id, oldest first.
        url: Address of the north port, with which commands are registered.
    """

    def __init__(self, broker: ContextBroker, mqtt: MqttBroker) -> None:
        self._broker = broker
        self._mqtt = mqtt
        self.groups: dict[tuple[Scope, str, str], Group] = {}
        self.devices: dict[tuple[Scope, str, str], AgentDevice] = {}
        self._by_place: dict[str, AgentDevice] = {}
        self.url = ""
        mqtt.listen(self.receive)

    def north_port(self) -> Starlette:
        """Its HTTP side, which answers requests as the real one does."""
        table = {
            "GET /iot/about": self._about,
            "GET /iot/services": self._list_groups,
            "POST /iot/services": self._create_groups,
            "PUT /iot/services": self._change_group,
            "GET /iot/devices": self._list_devices,
            "POST /iot/devices": self._create_devices,
            "DELETE /iot/devices/{id}": self._delete_device,
        }
        return fiware_app(table, "name", "message")

    # --- measures ---------------------------------------------------------------

    def receive(self, topic: str, payload: bytes) -> None:
        """Handle an MQTT message of a provisioned device; ignore all others.

        Topics are ``/{apikey}/{device}/attrs`` and ``…/cmdexe``.
        """
        place, _, kind = topic.rpartition("/")
        device = self._by_place.get(place)
        if device is None or kind not in _READERS:
            return
        with suppress(FiwareError):  # devices get no error
            self._write(device, _READERS[kind](device, payload, clock.wall()))

    def _write(self, device: AgentDevice, changes: Mapping[str, Attribute]) -> None:
        if changes:
            scope = Scope(device.service, device.service_path)
            self._broker.upsert(scope, device.entity_name, device.entity_type, changes)

    # --- devices ----------------------------------------------------------------

    def provision(self, raw: Mapping[str, Any], scope: Scope) -> None:
        """Create one device from a ``POST``, and register its commands.

        Raises:
            FiwareError: 400 or 501, or 409 if the device exists.
        """
        if "device_id" not in raw:
            raise FiwareError(
                "MISSING_ATTRIBUTES",
                "The request was not well formed:"
                'Missing attributes: ["device_id"] with: the device',
            )
        service, path = scope
        registered = {
            "service": service,
            "service_path": path,
            "registration_id": new_id(),
        }
        device = _read(AgentDevice, {**raw, **registered})
        key = scope, device.apikey, device.device_id
        if key in self.devices:
            raise FiwareError(
                "DUPLICATE_DEVICE_ID",
                "A device with the same info (DeviceId, ApiKey, Service, Subservice) "
                f"was found:{device.device_id}",
            )
        if device.commands:
            self._registrations(device)[device.registration_id] = Registration(
                device.registration_id,
                path,
                device.entity_name,
                device.entity_type,
                tuple(command.name for command in device.commands),
                self.url,
                self.command,
            )
        self.devices[key] = self._by_place[device.place] = device

    def _registrations(self, device: AgentDevice) -> dict[str, Registration]:
        return self._broker.tenant(device.service).registrations

    # --- commands ----------------------------------------------------------------

    async def command(
        self, scope: Scope, name: str, kind: str, values: Mapping[str, object]
    ) -> None:
        """Publish commands of one entity.

        Several devices may share the entity.  MongoDB answers in the order of its
        index: the command goes to the device whose API key and id sort first, and is
        ignored if that device lacks it.  A command to a robot that is not connected is
        lost.

        Raises:
            FiwareError: 404, no device has this entity.
        """
        sharing = [
            device
            for key, device in sorted(self.devices.items(), key=lambda item: item[0])
            if key[0] == scope
            and (device.entity_name, device.entity_type) == (name, kind)
        ]
        if not sharing:
            raise _no_device(name)
        device, now = sharing[0], clock.wall()
        for command in device.command_names & values.keys():
            self._mqtt.publish(
                f"{device.place}/cmd", orjson.dumps({command: values[command]})
            )
            self._write(device, _status_change(command, "PENDING", now))

    # --- its HTTP side ------------------------------------------------------------

    async def _about(self, _: Request) -> Response:
        return _json(_ABOUT)

    async def _list_groups(self, request: Request) -> Response:
        scope = _scope(request)
        groups = [
            group.model_dump(exclude_none=True)
            for key, group in self.groups.items()
            if key[0] == scope
        ]
        return _page(request, "services", groups)

    async def _create_groups(self, request: Request) -> Response:
        scope = _scope(request)
        for raw in await _listed(request, "services"):
            if not raw.get("entity_type"):
                raise FiwareError(
                    "MISSING_CONFIG_PARAMS",
                    "The following mandatory configuration parameters were missing: "
                    '["type"]',
                )
            mine = {"service": scope.service, "subservice": scope.path}
            group = _read(Group, {**raw, **mine})
            key = scope, group.resource, group.apikey
            if key in self.groups:
                raise FiwareError(
                    "DUPLICATE_GROUP",
                    "A device configuration already exists for resource "
                    f"{group.resource} and API Key {group.apikey}",
                )
            self.groups[key] = group
        return _json({}, 201)

    async def _change_group(self, request: Request) -> Response:
        """Change a group; absent fields stay."""
        resource, apikey = (
            request.query_params.get(name, "") for name in ("resource", "apikey")
        )
        key = _scope(request), resource, apikey
        raw, group = load_object(await request.body()), self.groups.get(key)
        if group is None:
            raise FiwareError(
                "DEVICE_GROUP_NOT_FOUND",
                "Couldn\t find device group for fields: "
                '["resource","apikey"] and values: '
                f'{{"resource":"{resource}","apikey":"{apikey}"}}',
            )
        self.groups[key] = _read(Group, {**group.model_dump(), **raw})
        return Response(status_code=204)

    async def _list_devices(self, request: Request) -> Response:
        scope = _scope(request)
        devices = [
            device.show() for key, device in self.devices.items() if key[0] == scope
        ]
        return _page(request, "devices", devices)

    async def _create_devices(self, request: Request) -> Response:
        scope = _scope(request)
        for raw in await _listed(request, "devices"):
            self.provision(raw, scope)
        return _json({}, 201)

    async def _delete_device(self, request: Request) -> Response:
        """Delete a device and the registration of its commands."""
        mine = _scope(request), request.path_params["id"]
        for key, device in self.devices.items():
            if (key[0], device.device_id) == mine:
                break
        else:
            raise _no_device(mine[1])
        self._registrations(device).pop(device.registration_id, None)
        del self.devices[key]
        self._by_place.pop(device.place, None)
        return Response(status_code=204)


def _no_device(name: str) -> FiwareError:
    return FiwareError("DEVICE_NOT_FOUND", f"No device was found with id:{name}")


def _scope(request: Request) -> Scope:
    names = "fiware-service", "fiware-servicepath"
    absent = [name for name in names if not request.headers.get(name)]
    if absent:
        raise FiwareError(
            "MISSING_HEADERS",
            "Some headers were missing from the request: "
            + orjson.dumps(absent).decode(),
        )
    service, path = (request.headers[name] for name in names)
    return Scope(service.lower(), path)


async def _listed(request: Request, name: str) -> Iterable[dict[str, Any]]:
    listed = load_object(await request.body()).get(name)
    if not isinstance(listed, list) or not all(isinstance(raw, dict) for raw in listed):
        raise _wrong_syntax()
    return listed


def _page(request: Request, name: str, listed: list[dict[str, Any]]) -> Response:
    query = request.query_params
    limit, offset = query.get("limit", "20"), query.get("offset", "0")
    if not (limit.isdecimal() and offset.isdecimal()):
        raise _wrong_syntax()
    part = listed[int(offset) : int(offset) + int(limit)]
    return _json({"count": len(listed), name: part})


def _json(value: object, status: int = 200) -> Response:
    return Response(orjson.dumps(value), status, media_type="application/json")
