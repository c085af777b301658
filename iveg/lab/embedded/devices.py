"""Groups and devices as clients make them and the IoT Agent shows them."""

from collections.abc import Mapping
from functools import cached_property
from typing import NamedTuple, Self, TypeVar

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from iveg.lab.embedded.documents import new_id
from iveg.lab.embedded.errors import (
    FiwareError,
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
    """A command; ``mqtt`` says how it is published."""

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
    commands: list[DeviceCommand] = []
    static_attributes: _NotDone = Field([], max_length=0)

    def show(self) -> dict[str, object]:
        """It as the agent shows it."""
        return self.model_dump(by_alias=True, exclude_none=True)

    def changed(self, raw: Mapping[str, object]) -> Self:
        """It after a ``PUT``; absent fields stay.

        Raises:
            FiwareError: 400 or 501.
        """
        return _read(type(self), {**self.model_dump(), **raw})


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

    def show(self) -> dict[str, object]:
        """The device as the agent shows it: with a name of each command at it."""
        commands = [
            {**one.model_dump(by_alias=True, exclude_none=True), "object_id": one.name}
            for one in self.commands
        ]
        return {**super().show(), "commands": commands}

    @cached_property
    def commands_by_name(self) -> Mapping[str, DeviceCommand]:
        """Its commands."""
        return {one.name: one for one in self.commands}


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
        FiwareError: 400.
    """
    if "apikey" not in raw or "resource" not in raw:
        raise wrong_syntax()
    kind = raw.get("entity_type") or raw.get("type")
    if not kind:
        raise FiwareError(
            "MISSING_CONFIG_PARAMS",
            'The following mandatory configuration parameters were missing: ["type"]',
        )
    return _read(Group, {**raw, **tenancy._asdict(), "entity_type": kind})


def read_device(
    raw: Mapping[str, object], tenancy: Tenancy, group: Group | None
) -> AgentDevice:
    """Read a device from a ``POST``; a group completes it.

    Raises:
        FiwareError: 400.
    """
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
        "entity_name": group.entity_name(str(raw["device_id"])) if group else name,
    }
    own = {
        "entity_type": kind,
        "service": tenancy.service,
        "service_path": tenancy.subservice,
        "registration_id": "",
    }
    given = {name: one for name, one in raw.items() if name not in defaults or one}
    return _read(AgentDevice, {**defaults, **given, **own})
