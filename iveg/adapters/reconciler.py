"""Reconciler: makes what FIWARE holds for a fleet what it should be.

Each step compares what is wanted with what is there, and calls only for what differs.
So it may run at every start and every few seconds.  It keeps the way of commands to
the robot clear; the traps are in docs/fiware.md, "Provisioning".
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

from iveg.adapters.fiware_http import Document
from iveg.adapters.iot_agent import IotAgentClient, write_device, write_group
from iveg.adapters.orion import OrionClient
from iveg.domain.equipment import Tile
from iveg.domain.errors import HopError
from iveg.domain.kinds import KIND_OF, MEASURED
from iveg.domain.observations import LaserScan
from iveg.ngsi import names


@dataclass(frozen=True, slots=True)
class FiwareSite:
    """Facts of us that FIWARE should know.

    Attributes:
        robots: The fleet.
        apikey: First part of every topic.
        context_broker_url: Orion as the agent reaches it.
        tiles: Of other equipment, whose devices are made where they name one.
        scanned: Robots whose scans iVeg reads from the broker.
        notify_url: Where Orion shall post.
        notify_token: Secret that each notification carries.
        boot: Of this start, in its probes.
    """

    robots: Sequence[str]
    apikey: str
    context_broker_url: str
    tiles: Sequence[Tile] = ()
    scanned: Sequence[str] = ()
    notify_url: str = ""
    notify_token: str = ""
    boot: str = ""


@dataclass(frozen=True, slots=True)
class Reconciled:
    """Result of a step, as sentences.

    Attributes:
        mended: What it made or corrected; empty when all was well.
        problems: What it may not touch and a person should look at.
        ids: The subscriptions that are ours.
        former_secrets: Secrets that some with our name brought, of an earlier start.
        failing: Why Orion cannot deliver, in its words; empty when it can.
    """

    mended: tuple[str, ...] = ()
    problems: tuple[str, ...] = ()
    ids: frozenset[str] = frozenset()
    former_secrets: frozenset[str] = frozenset()
    failing: str = ""


def _holds(there: object, wanted: object) -> bool:
    """Whether JSON has all that is wanted; objects may have other members, too."""
    if isinstance(wanted, dict):
        return isinstance(there, dict) and all(
            _holds(there.get(name), value) for name, value in wanted.items()
        )
    if isinstance(wanted, list):
        return (
            isinstance(there, list)
            and len(there) == len(wanted)
            and all(any(_holds(part, value) for part in there) for value in wanted)
        )
    return there == wanted


# --- devices and registrations ----------------------------------------------------


async def provision(
    agent: IotAgentClient, orion: OrionClient, site: FiwareSite
) -> Reconciled:
    """Make group, devices and command registrations of a fleet what they should be.

    Raises:
        HopError: a neighbour does not answer or does not take something.
    """
    robots, apikey = site.robots, site.apikey
    group = write_group(apikey, site.context_broker_url)
    mended = [f"Made the group of API key {apikey}."]
    if not await agent.create_group(group):
        mended = []
        # The agent never shows the address of its broker, so it is always sent again.
        sent = ("entity_type", "cbroker", "autoprovision")
        await agent.change_group(apikey, {name: group[name] for name in sent})
    known = {
        str(device.get("device_id")): device for device in await agent.read_devices()
    }
    for device in _devices_of_others(site.tiles, apikey):
        mended += await _ensure_device(agent, known, device)
    for robot_id in robots:
        mended += await _ensure_robot(agent, orion, known, robot_id, apikey)
    # Last, so that the probe's return says that all the others are there again.
    probe = names.HEARTBEAT_ID, names.HEARTBEAT_ID, names.HEARTBEAT_TYPE
    heartbeat = write_device(*probe, (("probe", "object"),), apikey)
    mended += await _ensure_device(agent, known, heartbeat)
    return Reconciled(tuple(mended), tuple(_conflicts(known.values(), robots)))


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
    if there is not None:
        if not anew and _holds(_as_read(there), wanted):
            return []
        await agent.delete_device(device_id)
    if not await agent.create_device(wanted):
        # Somebody else made it in between, or it hid under another tenancy.
        await agent.delete_device(device_id)
        raise HopError("iot_agent", f"did not take device {device_id} at once")
    known[device_id] = wanted
    return [f"{'Made' if there is None else 'Made anew'} device {device_id}."]


def _as_read(device: Document) -> Document:
    """A device as the agent says it, with what it may leave out."""
    attributes = [
        {**attribute, "object_id": attribute.get("object_id") or attribute["name"]}
        for attribute in device.get("attributes", [])
    ]
    said = {"commands": [], **device}
    return said | {"attributes": attributes, "protocol": names.PROTOCOL}


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


# --- subscriptions ----------------------------------------------------------------

PREFIX = "iVeg: "
"""Begins the description of our subscriptions, by which they are found again."""
TOKEN_HEADER = "x-iveg-notify-token"  # noqa: S105 - a header's name
_SCANS = KIND_OF[LaserScan].name
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
        throttling_s: Least time between two of its notifications; 0: each comes.
    """

    name: str
    entity: tuple[tuple[str, str], ...]
    attributes: tuple[str, ...]
    condition: tuple[str, ...] = ()
    throttling_s: int = 0


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


def wanted_for(
    tiles: Iterable[Tile] = (), scanned: Sequence[str] = ()
) -> tuple[WantedSubscription, ...]:
    """All subscriptions for robots and for other equipment.

    Orion sends one scan a second of robots in ``scanned``, whose scans iVeg reads from
    the broker: no rule rests on a scan, and copies of all cost a third of a processor
    with ten robots.  It throttles a subscription as a whole, so each has its own.

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
    if not scanned:
        return (*WANTED_OF_ALL, *of_tiles)
    scans = next(want for want in WANTED_OF_ALL if want.name == _SCANS)
    of_scans = (
        replace(
            scans,
            name=f"{_SCANS} {robot_id}",
            entity=(("id", robot_id), ("type", names.ROBOT_TYPE)),
            throttling_s=1,
        )
        for robot_id in scanned
    )
    others = (want for want in WANTED_OF_ALL if want is not scans)
    return (*others, *of_scans, *of_tiles)


async def ensure_subscriptions(
    orion: OrionClient,
    notify_url: str,
    token: str,
    wanted: Sequence[WantedSubscription],
) -> Reconciled:
    """Create, repair and remove subscriptions at Orion until they are as wanted.

    No throttling but of scans (it drops the last value), and no limit of failures
    (Orion would fall silent for good).

    Args:
        orion: Where subscriptions are kept.
        notify_url: Where Orion shall post.
        token: Secret that each notification carries.
        wanted: What iVeg wants to hear.

    Raises:
        HopError: Orion does not answer or does not take one.
    """
    ours = [
        subscription
        for subscription in await orion.read_subscriptions()
        if str(subscription.get("description", "")).startswith(PREFIX)
    ]
    spare = {str(subscription["id"]): subscription for subscription in ours}
    failing, secrets = describe_failures(ours), frozenset(map(_secret_of, ours))
    ids, mended = [], []
    for want in wanted:
        document = write_subscription(want, notify_url, token)
        subscription_id, done = await _ensure(orion, document, spare)
        spare.pop(subscription_id, None)
        ids.append(subscription_id)
        mended += done
    for subscription_id, subscription in spare.items():
        await orion.delete_subscription(subscription_id)
        if not any(_limits(subscription)):
            mended.append(f"Removed {subscription['description']!r}: one too many.")
    return Reconciled(
        tuple(mended),
        ids=frozenset(ids),
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
    orion: OrionClient, wanted: Document, ours: Mapping[str, Document]
) -> tuple[str, list[str]]:
    """Id of the one that is kept, corrected or made, and what was done."""
    name, limits = wanted["description"], _limits(wanted)
    # Not every Orion takes a limit away by a change: another is made instead.
    usable = (
        subscription_id
        for subscription_id, subscription in ours.items()
        if subscription["description"] == name and _limits(subscription) == limits
    )
    subscription_id = next(usable, None)
    if subscription_id is None:
        made = await orion.create_subscription(wanted)
        return made, [f"Subscribed to {name.removeprefix(PREFIX)}."]
    active = wanted | {"status": "active"}
    if _holds(ours[subscription_id], active):
        return subscription_id, []
    await orion.update_subscription(subscription_id, active)
    return subscription_id, [
        f"Corrected the subscription to {name.removeprefix(PREFIX)}."
    ]


def _limits(subscription: Document) -> tuple[object, ...]:
    """Throttling, end and most failures, each None where there is none."""
    failures = subscription.get("notification", {}).get("maxFailsLimit")
    parts = subscription.get("throttling"), subscription.get("expires"), failures
    return tuple(part or None for part in parts)


def _secret_of(subscription: Document) -> str:
    """The secret that its notifications bring; empty for none."""
    receiver = subscription.get("notification", {}).get("httpCustom", {})
    headers = {name.lower(): text for name, text in receiver.get("headers", {}).items()}
    return str(headers.get(TOKEN_HEADER, ""))


def write_subscription(
    want: WantedSubscription, notify_url: str, token: str
) -> Document:
    """The document that Orion is sent."""
    limits = {"throttling": want.throttling_s} if want.throttling_s else {}
    return limits | {
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
