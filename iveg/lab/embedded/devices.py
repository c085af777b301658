"""Groups and devices as the IoT Agent stores and lists them."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from iveg.domain.errors import IvegError
from iveg.lab.embedded.subscriptions import new_id

DEFAULT_APIKEY = "1234"


class AgentError(IvegError):
    """A request that the IoT Agent would refuse.

    Attributes:
        status: HTTP status.
        name: The agent's error name, such as ``DUPLICATE_DEVICE_ID``.
        message: The agent's sentence.
    """

    def __init__(self, status: int, name: str, message: str) -> None:
        super().__init__(f"{status} {name}: {message}")
        self.status = status
        self.name = name
        self.message = message


@dataclass(frozen=True, slots=True)
class Tenancy:
    """Service and subservice that a request is about."""

    service: str
    subservice: str


@dataclass(frozen=True, slots=True)
class Group:
    """Common settings of the devices with one API key."""

    tenancy: Tenancy
    apikey: str
    resource: str
    entity_type: str
    document: Mapping[str, Any]
    id: str = field(default_factory=new_id)

    @property
    def commands(self) -> list[dict[str, Any]]:
        """Commands of every device of the group."""
        return list(self.document.get("commands") or [])

    def entity_name(self, device_id: str) -> str:
        """Entity name of a device that was not provisioned.

        Of the agent's expressions only the plain ``id`` is supported.
        """
        if self.document.get("entityNameExp") == "id":
            return device_id
        return f"{self.entity_type}:{device_id}"

    def show(self) -> dict[str, Any]:
        """The group as the agent lists it, without the broker's address."""
        document = self.document
        shown = {
            "_id": self.id,
            "commands": self.commands,
            "lazy": document.get("lazy") or [],
            "attributes": document.get("attributes") or [],
            "resource": self.resource,
            "apikey": self.apikey,
            "service": self.tenancy.service,
            "subservice": self.tenancy.subservice,
            "__v": 0,
            "internal_attributes": document.get("internal_attributes") or [],
            "static_attributes": document.get("static_attributes") or [],
            "entity_type": self.entity_type,
        }
        for name in ("entityNameExp", "timestamp", "explicitAttrs", "autoprovision"):
            if name in document:
                shown[name] = document[name]
        return shown


@dataclass(frozen=True, slots=True)
class Device:
    """One device.

    Attributes:
        mapping: Attribute name of the device → its NGSI name and type.
        registration_id: Its registration at the context broker; empty for none.
    """

    tenancy: Tenancy
    device_id: str
    apikey: str
    entity_name: str
    entity_type: str
    document: Mapping[str, Any]
    mapping: Mapping[str, tuple[str, str]]
    registration_id: str = ""

    @property
    def commands(self) -> dict[str, dict[str, Any]]:
        """Commands by name."""
        return {one["name"]: one for one in self.document.get("commands") or []}

    @property
    def static_attributes(self) -> list[dict[str, Any]]:
        """Attributes that are added to every measure."""
        return list(self.document.get("static_attributes") or [])

    def show(self) -> dict[str, Any]:
        """The device as the agent shows it."""
        document = self.document
        shown = {
            "device_id": self.device_id,
            "apikey": self.apikey,
            "service": self.tenancy.service,
            "service_path": self.tenancy.subservice,
            "entity_name": self.entity_name,
            "entity_type": self.entity_type,
            "transport": document.get("transport", "MQTT"),
            "attributes": document.get("attributes") or [],
            "lazy": document.get("lazy") or [],
            "commands": [
                {"object_id": one["name"], **one} for one in self.commands.values()
            ],
            "static_attributes": self.static_attributes,
        }
        if "protocol" in document:
            shown["protocol"] = document["protocol"]
        return shown


def read_group(raw: Any, tenancy: Tenancy) -> Group:
    """Read a group from a ``POST``.

    Raises:
        AgentError: 400.
    """
    if not isinstance(raw, dict) or "apikey" not in raw or "resource" not in raw:
        raise wrong_syntax()
    kind = raw.get("entity_type") or raw.get("type")
    if not kind:
        raise AgentError(
            400,
            "MISSING_CONFIG_PARAMS",
            'The following mandatory configuration parameters were missing: ["type"]',
        )
    return Group(tenancy, raw["apikey"], raw["resource"], kind, raw)


def read_device(raw: Any, tenancy: Tenancy, group: Group | None) -> Device:
    """Read a device from a ``POST``.

    Raises:
        AgentError: 400.
    """
    if not isinstance(raw, dict):
        raise wrong_syntax()
    device_id = raw.get("device_id")
    if not isinstance(device_id, str):
        raise AgentError(
            400,
            "MISSING_ATTRIBUTES",
            "The request was not well formed:"
            'Missing attributes: ["device_id"] with: the device',
        )
    kind = raw.get("entity_type") or (group.entity_type if group else "Thing")
    apikey = raw.get("apikey") or (group.apikey if group else "")
    name = raw.get("entity_name") or (
        group.entity_name(device_id) if group else f"{kind}:{device_id}"
    )
    return Device(tenancy, device_id, apikey, name, kind, raw, _mapping(raw))


def changed_device(device: Device, raw: Mapping[str, Any]) -> Device:
    """The device after a ``PUT``; absent fields stay."""
    document = {**device.document, **raw}
    return replace(
        device,
        document=document,
        mapping=_mapping(document),
        entity_name=raw.get("entity_name", device.entity_name),
        entity_type=raw.get("entity_type", device.entity_type),
    )


def _mapping(raw: Mapping[str, Any]) -> dict[str, tuple[str, str]]:
    for part in ("attributes", "commands", "static_attributes"):
        listed = raw.get(part) or []
        if not isinstance(listed, list) or not all(map(_named, listed)):
            raise wrong_syntax()
    return {
        one.get("object_id") or one["name"]: (one["name"], one.get("type", "Text"))
        for one in raw.get("attributes") or []
    }


def _named(one: Any) -> bool:
    return isinstance(one, dict) and isinstance(one.get("name"), str)


def wrong_syntax() -> AgentError:
    """400 for a body of another shape."""
    return AgentError(
        400, "WRONG_SYNTAX", "Wrong syntax in request: Errors found validating request."
    )


class Registry:
    """Groups and devices in memory, in the order that MongoDB's index would give."""

    def __init__(self) -> None:
        self._groups: dict[tuple[Tenancy, str, str], Group] = {}
        self._devices: dict[tuple[Tenancy, str, str], Device] = {}
        self._by_topic: dict[tuple[str, str], Device] = {}

    # --- groups -----------------------------------------------------------------

    def groups(self, tenancy: Tenancy) -> list[Group]:
        """The groups of a tenancy; of all its subservices for ``/*``."""
        everywhere = tenancy.subservice in ("/*", "/#")
        return [
            one
            for one in self._groups.values()
            if one.tenancy == tenancy
            or (everywhere and one.tenancy.service == tenancy.service)
        ]

    def add_group(self, group: Group) -> None:
        """Keep a group.

        Raises:
            AgentError: 409, the API key and resource are in use.
        """
        key = (group.tenancy, group.resource, group.apikey)
        if key in self._groups:
            raise AgentError(
                409,
                "DUPLICATE_GROUP",
                "A device configuration already exists for resource "
                f"{group.resource} and API Key {group.apikey}",
            )
        self._groups[key] = group

    def change_group(
        self, tenancy: Tenancy, resource: str, apikey: str, raw: Mapping[str, Any]
    ) -> None:
        """Change a group.

        Raises:
            AgentError: 404.
        """
        group = self._group(tenancy, resource, apikey)
        document = {**group.document, **raw}
        self._groups[tenancy, resource, apikey] = replace(
            group,
            document=document,
            entity_type=raw.get("entity_type", group.entity_type),
        )

    def remove_group(self, tenancy: Tenancy, resource: str, apikey: str) -> None:
        """Forget a group; its devices stay.

        Raises:
            AgentError: 404.
        """
        self._group(tenancy, resource, apikey)
        del self._groups[tenancy, resource, apikey]

    def _group(self, tenancy: Tenancy, resource: str, apikey: str) -> Group:
        found = self._groups.get((tenancy, resource, apikey))
        if found is None:
            raise AgentError(
                404,
                "DEVICE_GROUP_NOT_FOUND",
                "Couldn\t find device group for fields: "
                '["resource","apikey"] and values: '
                f'{{"resource":"{resource}","apikey":"{apikey}"}}',
            )
        return found

    def group_of(self, apikey: str) -> Group | None:
        """The group of an API key, in any tenant."""
        return next(
            (one for one in self._groups.values() if one.apikey == apikey), None
        )

    def group_in(self, tenancy: Tenancy, apikey: str | None) -> Group | None:
        """A group of a tenant: that of the API key, else the first one."""
        found = [one for one in self._groups.values() if one.tenancy == tenancy]
        return next((one for one in found if not apikey or apikey == one.apikey), None)

    # --- devices ----------------------------------------------------------------

    def devices(self, tenancy: Tenancy) -> list[Device]:
        """The devices of a tenancy, oldest first."""
        return [one for one in self._devices.values() if one.tenancy == tenancy]

    def device(self, tenancy: Tenancy, device_id: str) -> Device:
        """One device of a tenancy.

        Raises:
            AgentError: 404.
        """
        for one in self._devices.values():
            if one.tenancy == tenancy and one.device_id == device_id:
                return one
        raise AgentError(
            404, "DEVICE_NOT_FOUND", f"No device was found with id:{device_id}"
        )

    def is_known(self, device: Device) -> bool:
        """Whether a device with this id, API key and tenant is stored."""
        return (device.tenancy, device.apikey, device.device_id) in self._devices

    def put(self, device: Device) -> None:
        """Store a device; it replaces an older one with the same key."""
        self._devices[device.tenancy, device.apikey, device.device_id] = device
        self._by_topic[device.apikey, device.device_id] = device

    def remove(self, device: Device) -> None:
        """Delete a device."""
        del self._devices[device.tenancy, device.apikey, device.device_id]
        self._by_topic.pop((device.apikey, device.device_id), None)

    def device_of(self, apikey: str, device_id: str) -> Device | None:
        """The device of a topic; the agent's default key finds any by its id."""
        found = self._by_topic.get((apikey, device_id))
        if found is not None or apikey != DEFAULT_APIKEY:
            return found
        return next(
            (one for one in self._devices.values() if one.device_id == device_id), None
        )

    def device_for(self, tenancy: Tenancy, name: str, kind: str) -> Device | None:
        """The device that commands for an entity are sent to.

        Several may share the entity; MongoDB answers in the order of its index, so it
        is the one whose API key and id sort first, with the command or without.
        """
        found = [
            one
            for one in self._devices.values()
            if one.tenancy == tenancy
            and (one.entity_name, one.entity_type) == (name, kind)
        ]
        return min(found, key=lambda one: (one.apikey, one.device_id), default=None)
