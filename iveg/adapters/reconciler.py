"""Reconciler: makes what FIWARE holds for a fleet what it should be.

Each step compares what is wanted with what is there, and calls only for what differs.
So it may run at every start and every few seconds.  It keeps the way of commands to
the robot clear; the traps are in docs/fiware.md, "Provisioning".
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from iveg.adapters.fiware_http import Document
from iveg.adapters.iot_agent import IotAgentClient, write_device, write_group
from iveg.adapters.orion import OrionClient
from iveg.domain.equipment import Tile
from iveg.domain.errors import HopError
from iveg.domain.kinds import MEASURED
from iveg.ngsi import names


@dataclass(frozen=True, slots=True)
class Reconciled:
    """Result of a step, as sentences.

    Attributes:
        mended: What it made or corrected; empty when all was well.
        problems: What it may not touch and a person should look at.
        ids: The subscriptions that are ours.
        former_ids: Those that had our name and are no more.
        former_secrets: Secrets that some with our name brought, of an earlier start.
        failing: Why Orion cannot deliver, in its words; empty when it can.
    """

    mended: tuple[str, ...] = ()
    problems: tuple[str, ...] = ()
    ids: frozenset[str] = frozenset()
    former_ids: frozenset[str] = frozenset()
    former_secrets: frozenset[str] = frozenset()
    failing: str = ""


# --- devices and registrations ----------------------------------------------------


async def provision(
    agent: IotAgentClient,
    orion: OrionClient,
    robots: Sequence[str],
    apikey: str,
    cbroker_url: str,
    tiles: Sequence[Tile] = (),
) -> Reconciled:
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
    known = {
        str(device.get("device_id")): device for device in await agent.read_devices()
    }
    for device in _devices_of_others(tiles, apikey):
        mended += await _ensure_device(agent, known, device)
    for robot_id in robots:
        mended += await _ensure_robot(agent, orion, known, robot_id, apikey)
    # Last, so that the probe's return says that all the others are there again.
    probe = names.HEARTBEAT_ID, names.HEARTBEAT_ID, names.HEARTBEAT_TYPE
    heartbeat = write_device(*probe, (("probe", "object"),), apikey)
    mended += await _ensure_device(agent, known, heartbeat)
    mended += await _remove_strays(orion, known.values(), robots)
    return Reconciled(tuple(mended), tuple(_conflicts(known.values(), robots)))


async def _ensure_group(
    agent: IotAgentClient, apikey: str, cbroker_url: str
) -> list[str]:
    wanted = write_group(apikey, cbroker_url)
    if await agent.create_group(wanted):
        return [f"Made the group of API key {apikey}."]
    groups = [
        group for group in await agent.read_groups() if group.get("apikey") == apikey
    ]
    # The agent never shows the address of its broker, so it is always sent again.
    sent = ("entity_type", "cbroker", "autoprovision")
    await agent.change_group(apikey, {name: wanted[name] for name in sent})
    if any(group.get("entity_type") == names.ROBOT_TYPE for group in groups):
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
    mended: list[str] = []
    for device in sorted(names.ROBOT_DEVICES, key=_takes_commands):
        is_lost = False
        if device.has_command:
            is_lost = bool(mended) or not await _registered(orion, robot_id)
        document = write_device(
            robot_id + device.suffix,
            robot_id,
            names.ROBOT_TYPE,
            device.attributes,
            apikey,
            has_command=device.has_command,
        )
        mended += await _ensure_device(agent, known, document, anew=is_lost)
    return mended + await _clear_registration(orion, robot_id)


def _takes_commands(device: names.RobotDevice) -> bool:
    return device.has_command


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
    return [f"{'Made' if there is None else 'Made anew'} device {device_id}."]


def _shape(device: Document) -> tuple[object, ...]:
    """The parts of a device that must be as wanted."""
    return (
        *map(device.get, ("apikey", "entity_name", "entity_type", "transport")),
        sorted(
            (
                attribute.get("object_id") or attribute["name"],
                attribute["name"],
                attribute.get("type"),
            )
            for attribute in device.get("attributes", [])
        ),
        sorted(
            (command["name"], command.get("type"))
            for command in device.get("commands", [])
        ),
    )


async def _clear_registration(orion: OrionClient, robot_id: str) -> list[str]:
    """Remove whatever at Orion stands between a command and the agent."""
    registered = await _registered(orion, robot_id)
    if not registered:
        raise HopError("iot_agent", f"did not register the command of {robot_id}")
    mended = []
    for registration_id in registered[:-1]:
        await orion.delete_registration(registration_id)
        mended.append(f"Removed an old registration of the command of {robot_id}.")
    for name in names.COMMANDS:
        if await orion.has_attribute(robot_id, name):
            await orion.delete_attribute(robot_id, name)
            mended.append(
                f"Deleted attribute {name} of {robot_id} at Orion: "
                "commands were stored there and went no further."
            )
    return mended


async def _registered(orion: OrionClient, robot_id: str) -> list[str]:
    """Ids of the registrations of a robot's command, oldest first."""
    robot = {"id": robot_id, "type": names.ROBOT_TYPE}
    found = []
    for registration in await orion.read_registrations():
        provided = registration.get("dataProvided", {})
        if names.COMMAND in provided.get("attrs", []) and any(
            robot.items() <= entity.items() for entity in provided.get("entities", [])
        ):
            found.append(str(registration["id"]))
    return found


def _conflicts(devices: Iterable[Document], robots: Sequence[str]) -> list[str]:
    """Foreign devices that a robot's commands may go to instead."""
    ours = {
        (robot, robot + device.suffix)
        for robot in robots
        for device in names.ROBOT_DEVICES
    }
    fed = [(device.get("entity_name"), device["device_id"]) for device in devices]
    return [
        f"Device {device_id} also feeds {robot_id}; commands may go to it and "
        "be lost. Give it another entity or remove it."
        for robot_id, device_id in fed
        if robot_id in robots and (robot_id, device_id) not in ours
    ]


def _devices_of_others(tiles: Sequence[Tile], apikey: str) -> Iterator[Document]:
    """The climate's device, and one for each that tiles name, with what they show."""
    climate = names.CLIMATE_DEVICE, names.CLIMATE_ID, names.CLIMATE_TYPE
    yield write_device(*climate, [(name, "Number") for name in CLIMATE], apikey)
    for name in dict.fromkeys(tile.device for tile in tiles if tile.device):
        mine = [tile for tile in tiles if tile.device == name]
        attributes = [(tile.attribute, "Number") for tile in mine]
        entity, kind = mine[0].entity_id, mine[0].entity_type
        yield write_device(name, entity, kind, attributes, apikey)


_AT_ONCE = 50
"""Ids in one question: an address has a longest length."""


async def _remove_strays(
    orion: OrionClient, devices: Iterable[Document], robots: Iterable[str]
) -> list[str]:
    """Remove the entities that an agent made up and that no device of ours feeds.

    A measure of an unknown device made an entity ``{type}:{device_id}``, such as
    ``Robot:AGI_odom``, while an agent with its registry in memory had forgotten our
    devices.  Our group forbids that now (``autoprovision``).
    """
    ids = [robot + device.suffix for robot in robots for device in names.ROBOT_DEVICES]
    ids += [names.CLIMATE_DEVICE, names.HEARTBEAT_ID]
    fed = {str(device.get("entity_name")) for device in devices}
    strays = [
        entity
        for entity in (f"{names.ROBOT_TYPE}:{i}" for i in ids)
        if entity not in fed
    ]
    removed = []
    for start in range(0, len(strays), _AT_ONCE):
        for entity_id, kind in await orion.find_entities(strays[start:][:_AT_ONCE]):
            await orion.delete_entity(entity_id, kind)
            removed.append(
                f"Removed entity {entity_id}, which no device of ours feeds."
            )
    return removed


# --- subscriptions ----------------------------------------------------------------

PREFIX = "iVeg: "
"""Begins the description of our subscriptions, by which they are found again."""
TOKEN_HEADER = "X-Iveg-Notify-Token"  # noqa: S105 - a header's name
CLIMATE = ("temperature", "relativeHumidity", "co2")
_TIMEOUT_MS = 2000


@dataclass(frozen=True, slots=True)
class WantedSubscription:
    """One subscription that iVeg wants.

    Attributes:
        name: After the prefix in its description; never changes.
        entity: What it is about, as NGSI-v2 says it.
        attributes: What is sent.
        condition: What makes Orion send; the attributes where it is empty.
    """

    name: str
    entity: tuple[tuple[str, str], ...]
    attributes: tuple[str, ...]
    condition: tuple[str, ...] = ()


ALL_ROBOTS = (("idPattern", ".*"), ("type", names.ROBOT_TYPE))
WANTED_OF_ALL = (
    *(
        WantedSubscription(kind.name, ALL_ROBOTS, tuple(dict(kind.attributes)))
        for kind in MEASURED
    ),
    WantedSubscription(
        "commands", ALL_ROBOTS, (names.COMMAND_STATUS, names.COMMAND_INFO)
    ),
    WantedSubscription("goals", ALL_ROBOTS, (names.GOAL_INFO,)),
    WantedSubscription(
        "single uplink",
        ALL_ROBOTS,
        tuple(names.ALGORITHM_1),
        condition=("timestamp", "pose", "class"),
    ),
    WantedSubscription(
        "climate", (("id", names.CLIMATE_ID), ("type", names.CLIMATE_TYPE)), CLIMATE
    ),
    WantedSubscription(
        "canary",
        (("id", names.HEARTBEAT_ID), ("type", names.HEARTBEAT_TYPE)),
        ("probe",),
    ),
)


def wanted_for(tiles: Iterable[Tile] = ()) -> tuple[WantedSubscription, ...]:
    """All subscriptions for robots and for other equipment.

    Each attribute of equipment has its own: in a common one Orion would send what is
    silent along.  Its notifications then prove that this very attribute was measured.
    """
    of_tiles = (
        WantedSubscription(
            f"tile {tile.key}",
            (("id", tile.entity_id), ("type", tile.entity_type)),
            (tile.attribute,),
        )
        for tile in tiles
    )
    return (*WANTED_OF_ALL, *of_tiles)


async def ensure_subscriptions(
    orion: OrionClient,
    notify_url: str,
    token: str,
    wanted: Sequence[WantedSubscription],
) -> Reconciled:
    """Create, repair and remove subscriptions at Orion until they are as wanted.

    No throttling (it drops the last value), and no limit of failures (Orion would fall
    silent for good).

    Args:
        orion: Where subscriptions are kept.
        notify_url: Where Orion shall post.
        token: Secret that each notification carries.
        wanted: What iVeg wants to hear.

    Raises:
        HopError: Orion does not answer or does not take one.
    """
    kept = await orion.read_subscriptions()
    ours = [
        subscription
        for subscription in kept
        if str(subscription.get("description", "")).startswith(PREFIX)
    ]
    failing, secrets = describe_failures(ours), frozenset(map(_secret_of, ours))
    documents = [write_subscription(want, notify_url, token) for want in wanted]
    spare = {str(subscription["id"]): subscription for subscription in ours}
    ids, mended = [], []
    for document in documents:
        there = [
            subscription
            for subscription in ours
            if subscription["description"] == document["description"]
        ]
        subscription_id, done = await _ensure(orion, document, there)
        spare.pop(subscription_id, None)
        ids.append(subscription_id)
        mended += done
    for subscription_id, subscription in spare.items():
        await orion.delete_subscription(subscription_id)
        if not _is_limited(subscription):
            mended.append(f"Removed {subscription['description']!r}: one too many.")
    return Reconciled(
        tuple(mended),
        ids=frozenset(ids),
        former_ids=frozenset(
            str(subscription["id"]) for subscription in ours
        ).difference(ids),
        former_secrets=secrets - {token, ""},
        failing=failing,
    )


def describe_failures(subscriptions: Sequence[Document]) -> str:
    """Orion's account of failing deliveries, in one sentence; empty for none."""
    deliveries = [
        subscription.get("notification", {}) for subscription in subscriptions
    ]
    reasons = {
        str(delivery.get("lastFailureReason", "no reason given"))
        for delivery in deliveries
        if delivery.get("failsCounter", 0) > 0
    }
    return f"Orion cannot deliver: {', '.join(sorted(reasons))}." if reasons else ""


async def _ensure(
    orion: OrionClient, wanted: Document, there: Sequence[Document]
) -> tuple[str, list[str]]:
    """Id of the one that is kept, corrected or made, and what was done."""
    name = wanted["description"].removeprefix(PREFIX)
    # Not every Orion takes a limit away by a change: another is made instead.
    usable = [subscription for subscription in there if not _is_limited(subscription)]
    if not usable:
        return await orion.create_subscription(wanted), [f"Subscribed to {name}."]
    subscription_id = str(usable[0]["id"])
    if _wiring(usable[0]) == _wiring({**wanted, "status": "active"}):
        return subscription_id, []
    await orion.update_subscription(subscription_id, {**wanted, "status": "active"})
    return subscription_id, [f"Corrected the subscription to {name}."]


def _is_limited(subscription: Document) -> bool:
    return bool(subscription.get("throttling") or subscription.get("expires"))


def _wiring(subscription: Document) -> tuple[object, ...]:
    """The parts of a subscription that must be as wanted."""
    subject = subscription.get("subject", {})
    notification = subscription.get("notification", {})
    receiver = notification.get("httpCustom", {})
    return (
        subscription.get("status"),
        subject.get("entities"),
        subject.get("condition", {}).get("attrs"),
        notification.get("maxFailsLimit"),
        notification.get("attrs"),
        notification.get("attrsFormat"),
        receiver.get("url"),
        receiver.get("timeout"),
        _headers(receiver),
    )


def _headers(receiver: Document) -> dict[str, Any]:
    return {name.lower(): value for name, value in receiver.get("headers", {}).items()}


def _secret_of(subscription: Document) -> str:
    """The secret that its notifications bring; empty for none."""
    receiver = subscription.get("notification", {}).get("httpCustom", {})
    return str(_headers(receiver).get(TOKEN_HEADER.lower(), ""))


def write_subscription(
    want: WantedSubscription, notify_url: str, token: str
) -> Document:
    """The document that Orion is sent."""
    return {
        "description": PREFIX + want.name,
        "subject": {
            "entities": [dict(want.entity)],
            "condition": {"attrs": list(want.condition or want.attributes)},
        },
        "notification": {
            "httpCustom": {
                "url": notify_url,
                "headers": {TOKEN_HEADER: token},
                "timeout": _TIMEOUT_MS,
            },
            "attrs": list(want.attributes),
            "attrsFormat": "normalized",
        },
    }
