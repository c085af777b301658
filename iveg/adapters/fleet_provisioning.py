"""Provisioning of a fleet at the IoT Agent: group, devices and registrations.

Provisioning reads first and changes only what differs, so it can run at every start.
It keeps the way of commands to the robot clear; the traps are in docs/fiware.md,
"Provisioning".
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

from iveg.adapters.fiware_http import Document
from iveg.adapters.iot_agent import IotAgentClient, write_device, write_group
from iveg.adapters.orion import OrionClient, remove_orphans
from iveg.domain.equipment import Tile
from iveg.domain.errors import HopError
from iveg.domain.records import Json
from iveg.ngsi import names


@dataclass(frozen=True, slots=True)
class Provisioned:
    """Result of provisioning, as sentences.

    Attributes:
        mended: What it made or corrected; empty when all was well.
        problems: What it may not touch and a person should look at.
    """

    mended: tuple[str, ...] = ()
    problems: tuple[str, ...] = ()


async def provision(
    agent: IotAgentClient,
    orion: OrionClient,
    robots: Sequence[str],
    apikey: str,
    cbroker_url: str,
    tiles: Sequence[Tile] = (),
) -> Provisioned:
    """Make group, devices and command registrations of a fleet what they should be.

    Args:
        agent: The IoT Agent.
        orion: Where the registrations of commands are.
        robots: The fleet.
        apikey: First part of every topic.
        cbroker_url: Orion as the agent reaches it.
        tiles: Of other equipment, whose devices are made where they name one.

    Raises:
        HopError: a neighbour does not answer or does not take something.
    """
    mended = await _ensure_group(agent, apikey, cbroker_url)
    known = {str(one.get("device_id")): one for one in await agent.read_devices()}
    for device in (_climate_device(apikey), *_devices_of(tiles, apikey)):
        mended += await _ensure_device(agent, known, device)
    problems = []
    for robot_id in robots:
        mended += await _ensure_robot(agent, orion, known, robot_id, apikey)
        problems += _thieves(known.values(), robot_id)
    # Last, so that the probe's return says that all the others are there again.
    mended += await _ensure_device(agent, known, _heartbeat_device(apikey))
    mended += await remove_orphans(orion, known, robots)
    return Provisioned(tuple(mended), tuple(problems))


async def _ensure_group(
    agent: IotAgentClient, apikey: str, cbroker_url: str
) -> list[str]:
    wanted = write_group(apikey, cbroker_url)
    if await agent.create_group(wanted):
        return [f"Made the group of API key {apikey}."]
    known = next(
        (one for one in await agent.read_groups() if one.get("apikey") == apikey), {}
    )
    # The agent never shows the address of its broker, so it is always sent again.
    sent = ("entity_type", "cbroker", "autoprovision")
    await agent.change_group(apikey, {name: wanted[name] for name in sent})
    if known.get("entity_type") == names.ROBOT_TYPE:
        return []
    return [f"Corrected the entity type of the group of API key {apikey}."]


async def _ensure_robot(
    agent: IotAgentClient,
    orion: OrionClient,
    known: dict[str, Document],
    robot_id: str,
    apikey: str,
) -> list[str]:
    """Sensors first, the command device last.

    An agent with its registry in memory gives commands to the device of an entity that
    was made last, one with MongoDB to the one that sorts first; ``AGI`` is both.
    """
    sensors = [one for one in names.ROBOT_DEVICES if not one.has_command]
    mended = []
    for sensor in sensors:
        device = _robot_device(robot_id, sensor, apikey)
        mended += await _ensure_device(agent, known, device)
    commander = next(one for one in names.ROBOT_DEVICES if one.has_command)
    device = _robot_device(robot_id, commander, apikey)
    registered = _registered(await orion.read_registrations(), robot_id)
    last = device["device_id"] in known and not mended
    mended += await _ensure_device(
        agent, known, device, anew=not last or not registered
    )
    return mended + await _clear_registration(orion, robot_id)


async def _ensure_device(
    agent: IotAgentClient,
    known: dict[str, Document],
    wanted: Document,
    *,
    anew: bool = False,
) -> list[str]:
    device_id = wanted["device_id"]
    there = known.get(device_id)
    if there is not None and not anew and _shape(there) == _shape(wanted):
        return []
    if there is not None:
        await agent.delete_device(device_id)
    if not await agent.create_device(wanted):
        # Somebody else made it in between, or it hid under another tenancy.
        await agent.delete_device(device_id)
        if not await agent.create_device(wanted):
            raise HopError("iot_agent", f"does not take device {device_id}")
    known[device_id] = wanted
    verb = "Made" if there is None else "Made anew"
    return [f"{verb} device {device_id}."]


def _shape(device: Json) -> tuple[object, ...]:
    """The parts of a device that must be as wanted."""
    return (
        device.get("apikey"),
        device.get("entity_name"),
        device.get("entity_type"),
        device.get("transport"),
        sorted(
            (one.get("object_id") or one["name"], one["name"], one.get("type"))
            for one in device.get("attributes", [])
        ),
        sorted((one["name"], one.get("type")) for one in device.get("commands", [])),
    )


async def _clear_registration(orion: OrionClient, robot_id: str) -> list[str]:
    """Remove whatever at Orion stands between a command and the agent."""
    mended = []
    registered = _registered(await orion.read_registrations(), robot_id)
    if not registered:
        raise HopError("iot_agent", f"did not register the command of {robot_id}")
    for old in registered[:-1]:
        await orion.delete_registration(old["id"])
        mended.append(f"Removed an old registration of the command of {robot_id}.")
    for name in names.COMMANDS:
        if await orion.has_attribute(robot_id, name):
            await orion.delete_attribute(robot_id, name)
            mended.append(
                f"Deleted attribute {name} of {robot_id} at Orion: "
                "commands were stored there and went no further."
            )
    return mended


def _registered(registrations: Sequence[Document], robot_id: str) -> list[Document]:
    """The registrations of a robot's command, oldest first."""
    return [
        one
        for one in registrations
        if names.COMMAND in one.get("dataProvided", {}).get("attrs", [])
        and any(
            entity.get("id") == robot_id and entity.get("type") == names.ROBOT_TYPE
            for entity in one.get("dataProvided", {}).get("entities", [])
        )
    ]


def _thieves(devices: Iterable[Document], robot_id: str) -> list[str]:
    """Conflicting devices: foreign ones that a robot's commands may go to instead."""
    ours = {robot_id + device.suffix for device in names.ROBOT_DEVICES}
    return [
        f"Device {one['device_id']} also feeds {robot_id}; commands may go to it and "
        "be lost. Give it another entity or remove it."
        for one in devices
        if one.get("entity_name") == robot_id and one["device_id"] not in ours
    ]


def _robot_device(robot_id: str, device: names.RobotDevice, apikey: str) -> Document:
    return write_device(
        robot_id + device.suffix,
        robot_id,
        names.ROBOT_TYPE,
        device.attributes,
        apikey,
        has_command=device.has_command,
    )


def _climate_device(apikey: str) -> Document:
    attributes = tuple(
        (name, "Number") for name in ("temperature", "relativeHumidity", "co2")
    )
    return write_device(
        names.CLIMATE_DEVICE, names.CLIMATE_ID, names.CLIMATE_TYPE, attributes, apikey
    )


def _devices_of(tiles: Sequence[Tile], apikey: str) -> Iterator[Document]:
    """A device for each that tiles name, with the attributes of all of them."""
    for name in dict.fromkeys(one.device for one in tiles if one.device):
        mine = [one for one in tiles if one.device == name]
        attributes = [(one.attribute, "Number") for one in mine]
        entity, kind = mine[0].entity_id, mine[0].entity_type
        yield write_device(name, entity, kind, attributes, apikey)


def _heartbeat_device(apikey: str) -> Document:
    return write_device(
        names.HEARTBEAT_ID,
        names.HEARTBEAT_ID,
        names.HEARTBEAT_TYPE,
        (("probe", "object"),),
        apikey,
    )
