"""Repair of the subscriptions that iVeg wants at Orion.

They are found again after a restart by the beginning of their description, so there is
always one of each, however often iVeg starts.

The subscriptions that iVeg wants at Orion.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Protocol

from iveg.adapters.fiware_http import Document
from iveg.domain.equipment import Tile
from iveg.domain.kinds import MEASURED, Kind
from iveg.ngsi import names

PREFIX = "iVeg: "


TOKEN_HEADER = "X-Iveg-Notify-Token"  # noqa: S105 - a header's name


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


def _names_of(kind: Kind) -> tuple[str, ...]:
    return tuple(name for name, _ in kind.attributes)


WANTED_OF_ALL = (
    *(WantedSubscription(one.name, ALL_ROBOTS, _names_of(one)) for one in MEASURED),
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
        "climate",
        (("id", names.CLIMATE_ID), ("type", names.CLIMATE_TYPE)),
        ("temperature", "relativeHumidity", "co2"),
    ),
    WantedSubscription(
        "canary",
        (("id", names.HEARTBEAT_ID), ("type", names.HEARTBEAT_TYPE)),
        ("probe",),
    ),
)


def wanted_for(tiles: Iterable[Tile] = ()) -> tuple[WantedSubscription, ...]:
    """All subscriptions for robots and for other equipment."""
    return (*WANTED_OF_ALL, *map(_of_tile, tiles))


def _of_tile(tile: Tile) -> WantedSubscription:
    """One for each attribute: in a common one Orion would send what is silent along.

    Its notifications then prove that this very attribute was measured.
    """
    entity = (("id", tile.entity_id), ("type", tile.entity_type))
    return WantedSubscription(f"tile {tile.key}", entity, (tile.attribute,))


_TIMEOUT_MS = 2000


class SubscriptionStore(Protocol):
    """Port to the subscriptions: Orion, or a fake of it."""

    async def read_subscriptions(self) -> list[Document]:
        """All of our tenant."""

    async def create_subscription(self, document: Document) -> str:
        """Add one; its id."""

    async def update_subscription(
        self, subscription_id: str, changes: Document
    ) -> None:
        """Replace the parts that are named."""

    async def delete_subscription(self, subscription_id: str) -> None:
        """Remove one."""


@dataclass(frozen=True, slots=True)
class Ensured:
    """Subscriptions at Orion now.

    Attributes:
        ids: The subscriptions that are ours.
        mended: What had to be done, as sentences; empty when all was well.
        failing: Why Orion cannot deliver, in its words; empty when it can.
        former_ids: Of those that had our name and are no more.
        former_secrets: That some with our name brought, of an earlier start.
    """

    ids: frozenset[str]
    mended: tuple[str, ...]
    failing: str = ""
    former_ids: frozenset[str] = frozenset()
    former_secrets: frozenset[str] = frozenset()


async def ensure_subscriptions(
    orion: SubscriptionStore,
    notify_url: str,
    token: str,
    wanted: Sequence[WantedSubscription],
) -> Ensured:
    """Create, repair and remove subscriptions at Orion until they are as wanted.

    Run it at every start and whenever notifications stay away; it changes only what is
    wrong.  No throttling (it drops the last value), and no limit of failures (Orion
    would fall silent for good).

    Args:
        orion: Where subscriptions are kept.
        notify_url: Where Orion shall post.
        token: Secret that each notification carries.
        wanted: What iVeg wants to hear.

    Raises:
        HopError: Orion does not answer or does not take one.
    """
    ours: dict[str, list[Document]] = {}
    for one in await orion.read_subscriptions():
        description = str(one.get("description", ""))
        if description.startswith(PREFIX):
            ours.setdefault(description, []).append(one)
    named = [one for known in ours.values() for one in known]
    failing, ids, mended = describe_failures(named), list[str](), list[str]()
    for want in wanted:
        document = write_subscription(want, notify_url, token)
        known = ours.pop(document["description"], [])
        subscription_id, done = await _ensure(orion, want, document, known)
        ids.append(subscription_id)
        mended += done
    for leftover in ours.values():
        for one in leftover:
            await orion.delete_subscription(one["id"])
            mended.append(f"Removed {one['description']!r}: it is not wanted any more.")
    return Ensured(
        frozenset(ids),
        tuple(mended),
        failing,
        frozenset(str(one["id"]) for one in named).difference(ids),
        frozenset(map(_secret_of, named)) - {token, ""},
    )


def describe_failures(subscriptions: Sequence[Document]) -> str:
    """Orion's account of failing deliveries, in one sentence; empty for none."""
    deliveries = [one.get("notification", {}) for one in subscriptions]
    reasons = {
        str(one.get("lastFailureReason", "no reason given"))
        for one in deliveries
        if one.get("failsCounter", 0) > 0
    }
    return f"Orion cannot deliver: {', '.join(sorted(reasons))}." if reasons else ""


async def _ensure(
    orion: SubscriptionStore,
    want: WantedSubscription,
    document: Document,
    known: list[Document],
) -> tuple[str, list[str]]:
    name = want.name
    if not known:
        made = await orion.create_subscription(document)
        return made, [f"Subscribed to {name}."]
    mended = []
    for spare in known[1:]:
        await orion.delete_subscription(spare["id"])
        mended.append(f"Removed a second subscription to {name}.")
    kept = known[0]
    limited = [part for part in ("throttling", "expires") if kept.get(part)]
    if limited:
        # Not every Orion takes these away by a change.
        await orion.delete_subscription(kept["id"])
        made = await orion.create_subscription(document)
        return made, [*mended, f"Subscribed to {name} again: it had {limited[0]}."]
    if wrong := _differs(kept, document):
        await orion.update_subscription(kept["id"], {**document, "status": "active"})
        mended.append(f"Corrected the subscription to {name}: {wrong}.")
    return str(kept["id"]), mended


def _differs(kept: Document, wanted: Document) -> str:
    """The difference from the wanted subscription; empty for none."""
    if kept.get("status") != "active":
        return f"it was {kept.get('status')}"
    subject, notification = kept.get("subject", {}), kept.get("notification", {})
    if subject.get("entities") != wanted["subject"]["entities"]:
        return "its entities were others"
    condition = subject.get("condition", {})
    if condition.get("attrs") != wanted["subject"]["condition"]["attrs"]:
        return "its condition was another"
    if "maxFailsLimit" in notification:
        return "it had maxFailsLimit"
    for part in ("attrs", "attrsFormat"):
        if notification.get(part) != wanted["notification"][part]:
            return f"its {part} were others"
    if not _same_receiver(notification, wanted["notification"]):
        return "its address or secret was another"
    return ""


def _secret_of(subscription: Document) -> str:
    """The secret that its notifications bring; empty for none."""
    custom = subscription.get("notification", {}).get("httpCustom", {})
    headers = custom.get("headers", {}).items()
    found = (str(one) for name, one in headers if name.lower() == TOKEN_HEADER.lower())
    return next(found, "")


def _same_receiver(kept: Document, wanted: Document) -> bool:
    there, here = kept.get("httpCustom", {}), wanted["httpCustom"]
    headers = {name.lower(): value for name, value in there.get("headers", {}).items()}
    return (
        there.get("url") == here["url"]
        and there.get("timeout") == here["timeout"]
        and headers == {n.lower(): v for n, v in here["headers"].items()}
    )


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
