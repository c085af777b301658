"""Groups and devices as the IoT Agent stores and lists them."""

from collections.abc import Mapping
from functools import cached_property
from typing import Any, NamedTuple, Self, TypeVar

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from iveg.lab.embedded.documents import new_id
from iveg.lab.embedded.errors import (
    FiwareError,
    no_device,
    not_supported,
    wrong_syntax,
)

_Read = TypeVar("_Read", bound="_Provisioned")
_NotDone = list[object]


class Tenancy(NamedTuple):
    """Service and subservice that a request is about."""

    service: str
    subservice: str


class DeviceAttribute(BaseModel):
    """An attribute: its name at the device and at the context broker."""

    object_id: str = ""
    name: str
    type: str = "Text"


class Command(BaseModel):
    """A command; ``mqtt`` says how it is published."""

    object_id: str = ""
    name: str
    type: str = "command"
    mqtt: "Publishing | None" = None


class Publishing(BaseModel):
    """Quality of service of a command, and whether the broker keeps it."""

    qos: int = 0
    retain: bool = False


class _Provisioned(BaseModel):
    """What groups and devices have in common; other fields are taken and ignored."""

    model_config = ConfigDict(frozen=True, populate_by_name=True)

    apikey: str
    service: str
    entity_type: str
    attributes: list[DeviceAttribute] = []
    lazy: _NotDone = Field([], max_length=0)
    commands: list[Command] = []
    static_attributes: _NotDone = Field([], max_length=0)

    def show(self) -> dict[str, Any]:
        """It as the agent shows it."""
        shown = self.model_dump(by_alias=True, exclude_none=True)
        for one in (*shown["attributes"], *shown["commands"]):
            one["object_id"] = one["object_id"] or one["name"]
        return shown


class Group(_Provisioned):
    """Common settings of the devices with one API key."""

    id: str = Field(default_factory=new_id, alias="_id")
    version: int = Field(0, alias="__v")
    subservice: str
    resource: str
    internal_attributes: _NotDone = Field([], max_length=0)
    entity_name_exp: str | None = Field(None, alias="entityNameExp")
    autoprovision: bool | None = None

    @property
    def tenancy(self) -> Tenancy:
        """Whose it is."""
        return Tenancy(self.service, self.subservice)

    def entity_name(self, device_id: str) -> str:
        """Entity name of a device that was not provisioned.

        Of the agent's expressions only the plain ``id`` is supported.
        """
        if self.entity_name_exp == "id":
            return device_id
        return f"{self.entity_type}:{device_id}"


class Device(_Provisioned):
    """One device.

    Attributes:
        registration_id: Its registration at the context broker; empty for none.
    """

    device_id: str
    service_path: str
    entity_name: str
    transport: str = "MQTT"
    protocol: str | None = None
    registration_id: str = Field("", exclude=True)

    @property
    def tenancy(self) -> Tenancy:
        """Whose it is."""
        return Tenancy(self.service, self.service_path)

    @cached_property
    def mapping(self) -> Mapping[str, tuple[str, str]]:
        """Attribute name of the device → its NGSI name and type."""
        return {
            one.object_id or one.name: (one.name, one.type) for one in self.attributes
        }

    @cached_property
    def commands_by_name(self) -> Mapping[str, Command]:
        """Its commands."""
        return {one.name: one for one in self.commands}

    def changed(self, raw: Mapping[str, Any]) -> Self:
        """The device after a ``PUT``; absent fields stay.

        Raises:
            FiwareError: 400.
        """
        return _read(type(self), {**self.model_dump(), **raw})


def _read(kind: type[_Read], raw: Mapping[str, Any]) -> _Read:
    try:
        return kind.model_validate(raw)
    except ValidationError as error:
        for one in error.errors():
            if one["type"] == "too_long":
                raise not_supported(str(one["loc"][0])) from error
        raise wrong_syntax() from error


def read_group(raw: Any, tenancy: Tenancy) -> Group:
    """Read a group from a ``POST``.

    Raises:
        FiwareError: 400.
    """
    if not isinstance(raw, dict) or "apikey" not in raw or "resource" not in raw:
        raise wrong_syntax()
    kind = raw.get("entity_type") or raw.get("type")
    if not kind:
        raise FiwareError(
            "MISSING_CONFIG_PARAMS",
            'The following mandatory configuration parameters were missing: ["type"]',
        )
    return _read(Group, {**raw, **tenancy._asdict(), "entity_type": kind})


def read_device(raw: Any, tenancy: Tenancy, group: Group | None) -> Device:
    """Read a device from a ``POST``; a group completes it.

    Raises:
        FiwareError: 400.
    """
    if not isinstance(raw, dict):
        raise wrong_syntax()
    if "device_id" not in raw:
        raise FiwareError(
            "MISSING_ATTRIBUTES",
            "The request was not well formed:"
            'Missing attributes: ["device_id"] with: the device',
        )
    kind = raw.get("entity_type") or (group.entity_type if group else "Thing")
    name = f"{kind}:{raw['device_id']}"
    defaults = {
        "apikey": group.apikey if group else "",
        "entity_name": group.entity_name(raw["device_id"]) if group else name,
        "entity_type": kind,
        "service": tenancy.service,
        "service_path": tenancy.subservice,
    }
    given = {name: one for name, one in raw.items() if name not in defaults or one}
    return _read(Device, {**defaults, **given})


class Registry:
    """Groups and devices in memory, in the order that MongoDB's index would give."""

    def __init__(self) -> None:
        self._groups: dict[tuple[Tenancy, str, str], Group] = {}
        self._devices: dict[tuple[Tenancy, str, str], Device] = {}
        self._by_topic: dict[tuple[str, str], Device] = {}

    # --- groups -----------------------------------------------------------------

    def groups(self, tenancy: Tenancy) -> list[Group]:
        """The groups of a tenancy."""
        return [one for one in self._groups.values() if one.tenancy == tenancy]

    def add_group(self, group: Group) -> None:
        """Keep a group.

        Raises:
            FiwareError: 409, the API key and resource are in use.
        """
        key = (group.tenancy, group.resource, group.apikey)
        if key in self._groups:
            raise FiwareError(
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
            FiwareError: 400 or 404.
        """
        group = self.remove_group(tenancy, resource, apikey)
        self._groups[tenancy, resource, apikey] = _read(
            Group, {**group.model_dump(), **raw}
        )

    def remove_group(self, tenancy: Tenancy, resource: str, apikey: str) -> Group:
        """Forget a group; its devices stay.

        Raises:
            FiwareError: 404.
        """
        found = self._groups.pop((tenancy, resource, apikey), None)
        if found is None:
            raise FiwareError(
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
        found = self.groups(tenancy)
        return next((one for one in found if not apikey or apikey == one.apikey), None)

    # --- devices ----------------------------------------------------------------

    def devices(self, tenancy: Tenancy) -> list[Device]:
        """The devices of a tenancy, oldest first."""
        return [one for one in self._devices.values() if one.tenancy == tenancy]

    def device(self, tenancy: Tenancy, device_id: str) -> Device:
        """One device of a tenancy.

        Raises:
            FiwareError: 404.
        """
        for one in self.devices(tenancy):
            if one.device_id == device_id:
                return one
        raise no_device(device_id)

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
        """The device of a topic."""
        return self._by_topic.get((apikey, device_id))

    def device_for(self, tenancy: Tenancy, name: str, kind: str) -> Device:
        """The device that commands for an entity are sent to.

        Several may share the entity; MongoDB answers in the order of its index, so it
        is the one whose API key and id sort first, with the command or without.

        Raises:
            FiwareError: 404.
        """
        found = [
            one
            for one in self.devices(tenancy)
            if (one.entity_name, one.entity_type) == (name, kind)
        ]
        if not found:
            raise no_device(name)
        return min(found, key=lambda one: (one.apikey, one.device_id))
