"""Reconciler: brings a fleet's devices and subscriptions in FIWARE to the wanted state.

Each step compares the wanted with the actual state, and changes only the differences.
So it may run at every start and every few seconds.  It keeps the path of commands to
the robot clear; the traps are in docs/fiware.md, "Provisioning".
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from operator import attrgetter

from iveg.adapters.fiware_http import Document
from iveg.adapters.iot_agent import (
    DEVICES,
    GROUPS,
    RESOURCE,
    IotAgentClient,
    write_device,
    write_group,
)
from iveg.adapters.orion import REGISTRATIONS, ROBOTS, SUBSCRIPTIONS, OrionClient
from iveg.domain.equipment import Tile
from iveg.domain.errors import HopError
from iveg.domain.kinds import KIND_OF, MEASURED
from iveg.domain.observations import LaserScan
from iveg.ngsi import names


@dataclass(frozen=True, slots=True)
class FiwareSite:
    """Wanted state of FIWARE, as the settings have it.

    Attributes:
        robots: Ids of the fleet.
        apikey: First part of every topic.
        context_broker_url: Orion's address as the agent reaches it.
        tiles: Tiles of other equipment; the devices that they name are made.
        scanned: Robots whose scans iVeg reads from the broker.
        notify_url: Address to which Orion posts notifications.
        notify_token: Secret that each notification carries.
        boot: Identity of this start in its probes.
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
        mended: Things that it made or corrected; empty when all was well.
        problems: Things for a person to look at, since iVeg may not change them.
        ids: Ids of our subscriptions.
        former_secrets: Secrets of earlier starts that our subscriptions still carried.
        failing: Reason why Orion cannot deliver, in its words; empty when it can.
    """

    mended: tuple[str, ...] = ()
    problems: tuple[str, ...] = ()
    ids: frozenset[str] = frozenset()
    former_secrets: frozenset[str] = frozenset()
    failing: str = ""


@dataclass(slots=True)
class OwnSubscriptions:
    """Known subscriptions of iVeg, which vouch for a notification.

    Attributes:
        ids: Their ids; empty until Orion has listed them.
        former_secrets: Secrets of earlier starts that they have carried.
        is_changing: Whether a check is under way, which may make some.
    """

    ids: frozenset[str] = frozenset()
    former_secrets: frozenset[str] = frozenset()
    is_changing: bool = False

    def is_ours(self, subscription_id: str) -> bool:
        """Whether a notification belongs to one of our subscriptions.

        Orion may notify before it has answered with a new subscription's id, and after
        a restart of iVeg for those of the run before.  While subscriptions are made,
        and until the first ids are known, each notification with our secret is ours.
        """
        return subscription_id in self.ids or self.is_changing or not self.ids

    def is_former(self, secret: str) -> bool:
        """Whether Orion may still send this secret from an earlier start.

        Any secret may be one, until Orion has listed our subscriptions.
        """
        return secret in self.former_secrets or not self.ids


def _matches(actual: object, wanted: object) -> bool:
    """Whether JSON has all that is wanted; objects may have more members."""
    if isinstance(wanted, dict):
        return isinstance(actual, dict) and all(
            _matches(actual.get(name), value) for name, value in wanted.items()
        )
    if isinstance(wanted, list):
        return (
            isinstance(actual, list)
            and len(actual) == len(wanted)
            and all(any(_matches(part, value) for part in actual) for value in wanted)
        )
    return actual == wanted


# --- devices and registrations ----------------------------------------------------


async def provision(
    agent: IotAgentClient, orion: OrionClient, site: FiwareSite
) -> Reconciled:
    """Bring group, devices and command registrations of a fleet to the wanted state.

    Raises:
        HopError: a neighbour does not answer or does not take something.
    """
    robots, apikey = site.robots, site.apikey
    group = write_group(apikey, site.context_broker_url)
    mended = [f"Made the group of API key {apikey}."]
    if not await agent.create(GROUPS, {"services": [group]}):
        mended = []
        # The agent never shows the address of its broker, so it is always sent again.
        members = ("entity_type", "cbroker", "autoprovision")
        changes = {name: group[name] for name in members}
        query = {"resource": RESOURCE, "apikey": apikey}
        await agent.ask("PUT", GROUPS, query=query, body=changes)
    devices = await agent.read_all(DEVICES, part="devices")
    known = {str(device.get("device_id")): device for device in devices}
    for device in _equipment_devices(site.tiles, apikey):
        mended += await _ensure_device(agent, known, device)
    for robot_id in robots:
        mended += await _ensure_robot(agent, orion, known, robot_id, apikey)
    # Last, so that a probe that returns proves all other devices.
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
    """Make or correct a robot's devices: sensors first, the command device last.

    An agent with its registry in memory sends commands to the newest device of an
    entity, an agent with MongoDB to the first by id.  ``AGI`` is both.
    """
    mended: list[str] = []
    for device in sorted(names.ROBOT_DEVICES, key=attrgetter("has_command")):
        is_lost = device.has_command and (
            bool(mended) or not await _registered(orion, robot_id)
        )
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


async def _ensure_device(
    agent: IotAgentClient,
    known: dict[str, Document],
    wanted: Document,
    *,
    anew: bool = False,
) -> list[str]:
    device_id = wanted["device_id"]
    actual = known.get(device_id)
    if actual is not None:
        if not anew and _matches(_as_read(actual), wanted):
            return []
        await agent.delete(f"{DEVICES}/{device_id}")
    if not await agent.create(DEVICES, {"devices": [wanted]}):
        # Another program has just made it, or it belongs to another tenant.
        await agent.delete(f"{DEVICES}/{device_id}")
        raise HopError("iot_agent", f"did not take device {device_id} at once")
    known[device_id] = wanted
    return [f"{'Made' if actual is None else 'Made anew'} device {device_id}."]


def _as_read(device: Document) -> Document:
    """A device as the agent answers, with the members that it may leave out."""
    attributes = [
        {**attribute, "object_id": attribute.get("object_id") or attribute["name"]}
        for attribute in device.get("attributes", [])
    ]
    answer = {"commands": [], **device}
    return answer | {"attributes": attributes, "protocol": names.PROTOCOL}


async def _clear_registration(orion: OrionClient, robot_id: str) -> list[str]:
    """Remove everything at Orion that keeps a command from the agent."""
    registered = await _registered(orion, robot_id)
    if not registered:
        raise HopError("iot_agent", f"did not register the command of {robot_id}")
    mended = []
    # Exactly one registration may take the commands.
    for registration_id in registered[:-1]:
        await orion.delete(f"{REGISTRATIONS}/{registration_id}")
        mended.append(f"Removed an old registration of the command of {robot_id}.")
    for name in names.COMMANDS:
        if await orion.has_attribute(robot_id, name):
            await orion.delete(f"/v2/entities/{robot_id}/attrs/{name}", ROBOTS)
            mended.append(
                f"Deleted attribute {name} of {robot_id} at Orion: "
                "commands were stored there and went no further."
            )
    return mended


async def _registered(orion: OrionClient, robot_id: str) -> list[str]:
    """Ids of the registrations of a robot's command, oldest first."""
    robot = {"id": robot_id, "type": names.ROBOT_TYPE}
    ids = []
    for registration in await orion.read_all(REGISTRATIONS):
        provided = registration.get("dataProvided", {})
        if names.COMMAND in provided.get("attrs", []) and any(
            robot.items() <= entity.items() for entity in provided.get("entities", [])
        ):
            ids.append(str(registration["id"]))
    return ids


def _conflicts(devices: Iterable[Document], robots: Sequence[str]) -> list[str]:
    """Warnings of foreign devices that may get a robot's commands instead."""
    own_ids = {
        (robot, robot + device.suffix)
        for robot in robots
        for device in names.ROBOT_DEVICES
    }
    feeds = [(device.get("entity_name"), device["device_id"]) for device in devices]
    return [
        f"Device {device_id} also feeds {robot_id}; commands may go to it and "
        "be lost. Give it another entity or remove it."
        for robot_id, device_id in feeds
        if robot_id in robots and (robot_id, device_id) not in own_ids
    ]


def _equipment_devices(tiles: Sequence[Tile], apikey: str) -> Iterator[Document]:
    """The climate's device, and each that tiles name, with the attributes they show."""
    climate = names.CLIMATE_DEVICE, names.CLIMATE_ID, names.CLIMATE_TYPE
    yield write_device(*climate, [(name, "Number") for name in CLIMATE], apikey)
    for name in dict.fromkeys(tile.device for tile in tiles if tile.device):
        its = [tile for tile in tiles if tile.device == name]
        attributes = [(tile.attribute, "Number") for tile in its]
        entity, kind = its[0].entity_id, its[0].entity_type
        yield write_device(name, entity, kind, attributes, apikey)


# --- subscriptions ----------------------------------------------------------------

PREFIX = "iVeg: "
"""Beginning of the description of our subscriptions, which tells them from others."""
TOKEN_HEADER = "x-iveg-notify-token"  # noqa: S105 - a header's name
_SCANS = KIND_OF[LaserScan].name
CLIMATE = ("temperature", "relativeHumidity", "co2")
_TIMEOUT_MS = 2000


@dataclass(frozen=True, slots=True)
class WantedSubscription:
    """One subscription that iVeg wants.

    Attributes:
        name: Text after the prefix in its description; never changes.
        entity: Its entities, as a member of NGSI-v2's ``subject.entities``.
        attributes: Attributes that are sent.
        condition: Attributes whose update makes Orion send; empty: ``attributes``.
        throttling_s: Least time between two of its notifications (s); 0: none.
    """

    name: str
    entity: Mapping[str, str]
    attributes: tuple[str, ...]
    condition: tuple[str, ...] = ()
    throttling_s: int = 0


ALL_ROBOTS = {"idPattern": ".*", "type": names.ROBOT_TYPE}
COMMON_SUBSCRIPTIONS = (
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
        "climate", {"id": names.CLIMATE_ID, "type": names.CLIMATE_TYPE}, CLIMATE
    ),
    WantedSubscription(
        "canary",
        {"id": names.HEARTBEAT_ID, "type": names.HEARTBEAT_TYPE},
        ("probe",),
    ),
)


def wanted_for(
    tiles: Iterable[Tile] = (), scanned: Sequence[str] = ()
) -> list[WantedSubscription]:
    """All subscriptions for robots and for other equipment.

    Orion sends one scan a second of robots in ``scanned``, whose scans iVeg reads from
    the broker: no rule rests on a scan, and copies of all cost a third of a processor
    with ten robots.  It throttles a subscription as a whole, so each robot has its own.

    Each attribute of equipment has its own, too.  A common subscription
    would also send attributes without a measure; so a notification proves a measure.
    """
    subscriptions = list(COMMON_SUBSCRIPTIONS)
    if scanned:
        scans = next(want for want in subscriptions if want.name == _SCANS)
        subscriptions.remove(scans)
        subscriptions += (
            replace(
                scans,
                name=f"{_SCANS} {robot_id}",
                entity={"id": robot_id, "type": names.ROBOT_TYPE},
                throttling_s=1,
            )
            for robot_id in scanned
        )
    subscriptions += (
        WantedSubscription(
            f"tile {tile.key}",
            {"id": tile.entity_id, "type": tile.entity_type},
            (tile.attribute,),
        )
        for tile in tiles
    )
    return subscriptions


async def ensure_subscriptions(
    orion: OrionClient,
    notify_url: str,
    token: str,
    wanted: Sequence[WantedSubscription],
) -> Reconciled:
    """Create, repair and remove subscriptions at Orion until they are as wanted.

    Only scans are throttled, as throttling drops the last value.  No subscription has
    a limit of failures: at the limit Orion would fall silent for good.

    Args:
        orion: Holds the subscriptions.
        notify_url: Address to which Orion posts notifications.
        token: Secret that each notification carries.
        wanted: All subscriptions of iVeg.

    Raises:
        HopError: Orion does not answer or refuses a subscription.
    """
    existing = await own_subscriptions(orion)
    spare = {str(subscription["id"]): subscription for subscription in existing}
    failing, secrets = describe_failures(existing), frozenset(map(_secret_of, existing))
    ids, mended = [], []
    for want in wanted:
        document = write_subscription(want, notify_url, token)
        subscription_id, done = await _ensure(orion, document, spare)
        spare.pop(subscription_id, None)
        ids.append(subscription_id)
        mended += done
    for subscription_id, subscription in spare.items():
        await orion.delete(f"{SUBSCRIPTIONS}/{subscription_id}")
        if not any(_limits(subscription)):
            mended.append(f"Removed {subscription['description']!r}: one too many.")
    return Reconciled(
        tuple(mended),
        ids=frozenset(ids),
        former_secrets=secrets - {token, ""},
        failing=failing,
    )


async def own_subscriptions(orion: OrionClient) -> list[Document]:
    """Subscriptions of our tenant whose description has our prefix."""
    return [
        subscription
        for subscription in await orion.read_all(SUBSCRIPTIONS)
        if str(subscription.get("description", "")).startswith(PREFIX)
    ]


def describe_failures(subscriptions: Sequence[Document]) -> str:
    """Orion's reasons of failing deliveries, in one sentence; empty for none."""
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
    """Keep, correct or make a subscription; returns its id, and the repairs."""
    name, limits = wanted["description"], _limits(wanted)
    # Some versions of Orion cannot remove a limit by a change: make another instead.
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
    if _matches(ours[subscription_id], active):
        return subscription_id, []
    await orion.ask("PATCH", f"{SUBSCRIPTIONS}/{subscription_id}", body=active)
    return subscription_id, [
        f"Corrected the subscription to {name.removeprefix(PREFIX)}."
    ]


def _limits(subscription: Document) -> tuple[object, ...]:
    """Throttling (s), expiry and limit of failures, each None where there is none."""
    failures = subscription.get("notification", {}).get("maxFailsLimit")
    parts = subscription.get("throttling"), subscription.get("expires"), failures
    return tuple(part or None for part in parts)


def _secret_of(subscription: Document) -> str:
    """The secret that its notifications carry; empty for none."""
    receiver = subscription.get("notification", {}).get("httpCustom", {})
    # Orion may answer with names of headers in another case.
    headers = {name.lower(): text for name, text in receiver.get("headers", {}).items()}
    return str(headers.get(TOKEN_HEADER, ""))


def write_subscription(
    want: WantedSubscription, notify_url: str, token: str
) -> Document:
    """The document of a subscription as it is sent to Orion."""
    limits = {"throttling": want.throttling_s} if want.throttling_s else {}
    return limits | {
        "description": PREFIX + want.name,
        "subject": {
            "entities": [want.entity],
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
