"""An IoT Agent for JSON: measures from MQTT to the context broker, commands back.

It runs in the process of both brokers: messages of devices and measures are passed by
function calls.  Topics, payloads and the north port match the real agent; its limits
are listed in ``docs/fiware.md``.
"""

import logging
from collections.abc import Mapping
from functools import lru_cache

import orjson

from iveg.adapters import clock
from iveg.lab.embedded.context_broker import ContextBroker
from iveg.lab.embedded.devices import (
    AgentDevice,
    DeviceCommand,
    Publishing,
    Tenancy,
    read_device,
)
from iveg.lab.embedded.entities import EntityChange, Scope
from iveg.lab.embedded.errors import FiwareError
from iveg.lab.embedded.measures import read_measures, read_single, status_changes
from iveg.lab.embedded.mqtt_broker import MqttBroker
from iveg.lab.embedded.orion_text import load_json
from iveg.lab.embedded.registrations import Registration, read_registration
from iveg.lab.embedded.registry import Registry

_log = logging.getLogger(__name__)


_Topic = tuple[str, str, str, str | None]
"""API key, device, ``attrs`` or ``cmdexe``, attribute if the topic names one."""


@lru_cache(maxsize=2048)
def _read_topic(topic: str) -> _Topic | None:
    parts = topic.split("/")
    if parts[:2] == ["", "json"]:
        del parts[0]
    named = len(parts) == 5 and parts[3] == "attrs"
    plain = len(parts) == 4 and parts[3] in ("attrs", "cmdexe")
    if not (named or plain) or parts[0] not in ("", "json"):
        return None
    return parts[1], parts[2], parts[3], parts[4] if named else None


def _read_answer(
    device: AgentDevice, payload: bytes, now: float
) -> list[dict[str, EntityChange]]:
    """Read the payload of a ``cmdexe`` topic; answers to unknown commands are left."""
    answers = load_json(payload)
    if not isinstance(answers, dict):
        return []
    known = {
        name: ("OK", answers[name])
        for name in answers
        if name in device.commands_by_name
    }
    return [status_changes(known, now)] if known else []


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
        self.url = ""
        """Address of the north port, for registrations; set when it is known."""
        mqtt.listen(self.hear)

    # --- measures ---------------------------------------------------------------

    def hear(self, topic: str, payload: bytes) -> None:
        """Handle an MQTT message, if it is for the agent.

        Topics are ``/{apikey}/{device}/attrs``, ``…/attrs/{name}`` and ``…/cmdexe``,
        the first slash or nothing also as ``/json/`` or ``json/``.
        """
        spoken = _read_topic(topic)
        if spoken is None:
            return
        try:
            self._take_from(spoken, payload, clock.wall())
        except FiwareError as error:
            # Devices get no error.
            _log.debug("a message on %s was discarded: %s", topic, error)

    def _take_from(self, spoken: _Topic, payload: bytes, now: float) -> None:
        apikey, device_id, kind, name = spoken
        device = self.registry.device_of(apikey, device_id)
        if device is None:
            device = self._autoprovision(apikey, device_id)
        if device is None:
            return
        if kind == "cmdexe":
            measures = _read_answer(device, payload, now)
        elif name is None:
            measures = read_measures(device, payload, now)
        else:
            measures = read_single(device, name, payload, now)
        for changes in measures:
            self._write(device, changes, now)

    def _write(
        self, device: AgentDevice, changes: Mapping[str, EntityChange], now: float
    ) -> None:
        # A correlator is made if somebody is notified.
        scope = Scope(device.service, device.service_path, "", now)
        self._broker.upsert(scope, device.entity_name, device.entity_type, changes)

    def _autoprovision(self, apikey: str, device_id: str) -> AgentDevice | None:
        group = self.registry.group_of(apikey)
        if group is None or group.autoprovision is False:
            return None
        raw = {"device_id": device_id, "commands": group.commands}
        return self._keep(read_device(raw, group.tenancy, group))

    # --- devices ----------------------------------------------------------------

    def provision(self, raw: Mapping[str, object], tenancy: Tenancy) -> None:
        """Create one device from a ``POST``.

        Raises:
            FiwareError: 400, or 409 if the device exists.
        """
        group = self.registry.group_in(tenancy, raw.get("apikey"))
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
        entity = {"type": device.entity_type, "id": device.entity_name}
        document = {
            "dataProvided": {
                "entities": [entity],
                "attrs": list(device.commands_by_name),
            },
            "provider": {"http": {"url": self.url}},
        }
        registration = read_registration(document, device.service_path)
        self._registrations(device)[registration.id] = registration
        return device.model_copy(update={"registration_id": registration.id})

    def change(self, old: AgentDevice, new: AgentDevice) -> None:
        """Replace a device; new attributes are written as null."""
        self.forget(old)
        self._keep(new)
        gained = dict(new.mapping.values()).items() - dict(old.mapping.values()).items()
        tenant = self._broker.tenant(new.service)
        key = (new.service_path, new.entity_name, new.entity_type)
        if gained and tenant.entities.get(*key) is not None:
            nothing = {name: EntityChange(kind, None) for name, kind in gained}
            self._write(new, nothing, clock.wall())

    def forget(self, device: AgentDevice) -> None:
        """Delete a device and its registration."""
        self._registrations(device).pop(device.registration_id, None)
        self.registry.remove(device)

    def _registrations(self, device: AgentDevice) -> dict[str, Registration]:
        return self._broker.tenant(device.service).registrations

    # --- commands ----------------------------------------------------------------

    async def command(
        self, tenancy: Tenancy, name: str, kind: str, values: Mapping[str, object]
    ) -> None:
        """Execute an ``op/update`` of one entity: publish its commands.

        An unknown command is ignored, and one without a connected robot is lost: the
        agent answers 204 to both.

        Raises:
            FiwareError: 404, no device has this entity.
        """
        device = self.registry.device_for(tenancy, name, kind)
        now = clock.wall()
        commands = device.commands_by_name
        known = {one: values[one] for one in values if one in commands}
        for command, value in known.items():
            self._publish(device, commands[command], value)
        if known:
            pending = dict.fromkeys(known, ("PENDING", None))
            self._write(device, status_changes(pending, now), now)

    def _publish(
        self, device: AgentDevice, command: DeviceCommand, value: object
    ) -> None:
        how = command.mqtt or Publishing()
        topic = f"/{device.apikey}/{device.device_id}/cmd"
        payload = orjson.dumps({command.name: value})
        self._mqtt.publish(topic, payload, how.qos, retain=how.retain)

    async def query(
        self, tenancy: Tenancy, name: str, kind: str, names: list[str]
    ) -> dict[str, object]:
        """Execute an ``op/query`` of one entity: its commands, with empty values.

        Raises:
            FiwareError: 404, no device has this entity.
        """
        device = self.registry.device_for(tenancy, name, kind)
        commands = {
            command: {"type": "command", "value": ""}
            for command in device.commands_by_name
            if not names or command in names
        }
        return {"type": kind, "id": name, **commands}
