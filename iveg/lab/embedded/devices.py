"""Groups and devices: as clients make them, as the IoT Agent shows and keeps them."""

from collections.abc import Mapping
from functools import cached_property
from typing import NamedTuple, TypeVar

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from iveg.lab.embedded.entities import (
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

    object_id: str | None = None
    name: str
    type: str = "Text"


class DeviceCommand(BaseModel):
    """A command."""

    name: str
    type: str = "command"


class _Provisioned(BaseModel):
    """What groups and devices have in common; other fields are taken and ignored."""

    model_config = ConfigDict(frozen=True)

    apikey: str
    service: str
    entity_type: str
    attributes: list[DeviceAttribute] = []
    lazy: _NotDone = Field([], max_length=0)
    commands: list[DeviceCommand] = []
    static_attributes: _NotDone = Field([], max_length=0)

    def show(self) -> dict[str, object]:
        """It as the agent shows it."""
        return self.model_dump(exclude_none=True)


class Group(_Provisioned):
    """Common settings of the devices with one API key."""

    subservice: str
    resource: str
    autoprovision: bool | None = None

    @property
    def tenancy(self) -> Tenancy:
        """Whose it is."""
        return Tenancy(self.service, self.subservice)


class AgentDevice(_Provisioned):
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
    def command_names(self) -> frozenset[str]:
        """Names of its commands."""
        return frozenset(one.name for one in self.commands)

    def show(self) -> dict[str, object]:
        """The device as the agent shows it: with a name of each command at it."""
        commands = [
            {**one.model_dump(), "object_id": one.name} for one in self.commands
        ]
        return {**super().show(), "commands": commands}


def _read(kind: type[_Read], raw: Mapping[str, object]) -> _Read:
    try:
        return kind.model_validate(raw)
    except ValidationError as error:
        for one in error.errors():
            if one["type"] == "too_long":
                raise not_supported(str(one["loc"][0])) from error
        raise wrong_syntax() from error


def read_group(raw: Mapping[str, object], tenancy: Tenancy) -> Group:
    """Read a group from a ``POST``.

    Raises:
        FiwareError: 400 or 501.
    """
    if not raw.get("entity_type"):
        raise FiwareError(
            "MISSING_CONFIG_PARAMS",
            'The following mandatory configuration parameters were missing: ["type"]',
        )
    return _read(Group, {**raw, **tenancy._asdict()})


def read_device(
    raw: Mapping[str, object], tenancy: Tenancy, group: Group | None
) -> AgentDevice:
    """Read a device from a ``POST``; a group completes it.

    Raises:
        FiwareError: 400 or 501.
    """
    if "device_id" not in raw:
        raise FiwareError(
            "MISSING_ATTRIBUTES",
            "The request was not well formed:"
            'Missing attributes: ["device_id"] with: the device',
        )
    kind = raw.get("entity_type") or (group.entity_type if group else "Thing")
    defaults = {
        "apikey": group.apikey if group else "",
        "entity_name": f"{kind}:{raw['device_id']}",
    }
    own = {
        "entity_type": kind,
        "service": tenancy.service,
        "service_path": tenancy.subservice,
        "registration_id": "",
    }
    return _read(AgentDevice, {**defaults, **raw, **own})


class Registry:
    """The groups and devices of every tenant, oldest first."""

    def __init__(self) -> None:
        self._groups: dict[tuple[Tenancy, str, str], Group] = {}
        self._devices: dict[tuple[Tenancy, str, str], AgentDevice] = {}
        self._by_topic: dict[tuple[str, str], AgentDevice] = {}

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
        self, tenancy: Tenancy, resource: str, apikey: str, raw: Mapping[str, object]
    ) -> None:
        """Change a group; absent fields stay.

        Raises:
            FiwareError: 400, 404 or 501.
        """
        group = self._group(tenancy, resource, apikey)
        changed = _read(Group, {**group.model_dump(), **raw})
        self._groups[tenancy, resource, apikey] = changed

    def remove_group(self, tenancy: Tenancy, resource: str, apikey: str) -> None:
        """Forget a group; its devices stay.

        Raises:
            FiwareError: 404.
        """
        self._group(tenancy, resource, apikey)
        del self._groups[tenancy, resource, apikey]

    def _group(self, tenancy: Tenancy, resource: str, apikey: str) -> Group:
        found = self._groups.get((tenancy, resource, apikey))
        if found is None:
            raise FiwareError(
                "DEVICE_GROUP_NOT_FOUND",
                "Couldn\t find device group for fields: "
                '["resource","apikey"] and values: '
                f'{{"resource":"{resource}","apikey":"{apikey}"}}',
            )
        return found

    def group_of(self, apikey: object, tenancy: Tenancy | None = None) -> Group | None:
        """The group of an API key, in one tenancy or in any."""
        for one in self._groups.values():
            if one.apikey == apikey and tenancy in (None, one.tenancy):
                return one
        return None

    # --- devices ----------------------------------------------------------------

    def devices(self, tenancy: Tenancy) -> list[AgentDevice]:
        """The devices of a tenancy."""
        return [one for one in self._devices.values() if one.tenancy == tenancy]

    def device(self, tenancy: Tenancy, device_id: str) -> AgentDevice:
        """One device of a tenancy.

        Raises:
            FiwareError: 404.
        """
        for one in self.devices(tenancy):
            if one.device_id == device_id:
                return one
        raise no_device(device_id)

    def is_known(self, device: AgentDevice) -> bool:
        """Whether a device with this id, API key and tenant is stored."""
        return (device.tenancy, device.apikey, device.device_id) in self._devices

    def put(self, device: AgentDevice) -> None:
        """Store a device."""
        self._devices[device.tenancy, device.apikey, device.device_id] = device
        self._by_topic[device.apikey, device.device_id] = device

    def remove(self, device: AgentDevice) -> None:
        """Delete a device."""
        del self._devices[device.tenancy, device.apikey, device.device_id]
        self._by_topic.pop((device.apikey, device.device_id), None)

    def device_of(self, apikey: str, device_id: str) -> AgentDevice | None:
        """The device of a topic."""
        return self._by_topic.get((apikey, device_id))

    def device_for(self, tenancy: Tenancy, name: str, kind: str) -> AgentDevice:
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
