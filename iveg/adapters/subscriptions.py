"""The subscriptions that iVeg wants at Orion, and keeping them as they should be.

They are found again after a restart by how their description begins, so there is
always one of each, however often iVeg starts.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

from iveg.ngsi import names

PREFIX = "iVeg: "
TOKEN_HEADER = "X-Iveg-Notify-Token"  # noqa: S105 - a header's name
_TIMEOUT_MS = 2000


class SubscriptionStore(Protocol):
    """Where subscriptions are kept: Orion, or a fake of it."""

    async def read_subscriptions(self) -> list[dict[str, Any]]:
        """All of our tenant."""

    async def create_subscription(self, document: Mapping[str, Any]) -> str:
        """Add one; its id."""

    async def update_subscription(
        self, subscription_id: str, changes: Mapping[str, Any]
    ) -> None:
        """Replace the parts that are named."""

    async def delete_subscription(self, subscription_id: str) -> None:
        """Remove one."""


@dataclass(frozen=True, slots=True)
class Wanted:
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


@dataclass(frozen=True, slots=True)
class Ensured:
    """What stands at Orion now.

    Attributes:
        ids: The subscriptions that are ours.
        mended: What had to be done, as sentences; empty when all was well.
        failing: Why Orion cannot deliver, in its words; empty when it can.
    """

    ids: frozenset[str]
    mended: tuple[str, ...]
    failing: str = ""


_ROBOTS = (("idPattern", ".*"), ("type", names.ROBOT_TYPE))

WANTED = (
    Wanted("odometry", _ROBOTS, (names.ODOMETRY,)),
    Wanted("lidar", _ROBOTS, (names.LIDAR, names.LIDAR_HEADER)),
    Wanted("detections", _ROBOTS, (names.BOXES, names.BOXES_HEADER)),
    Wanted("safety", _ROBOTS, (names.SAFETY,)),
    Wanted("navigation", _ROBOTS, (names.NAVIGATION,)),
    Wanted("commands", _ROBOTS, (names.COMMAND_STATUS, names.COMMAND_INFO)),
    Wanted(
        "single uplink",
        _ROBOTS,
        names.ALGORITHM_1,
        condition=("timestamp", "pose", "class"),
    ),
    Wanted(
        "climate",
        (("id", names.CLIMATE_ID), ("type", names.CLIMATE_TYPE)),
        ("temperature", "relativeHumidity", "co2"),
    ),
    Wanted(
        "canary",
        (("id", names.CANARY_ID), ("type", names.CANARY_TYPE)),
        ("probe",),
    ),
)


async def ensure_subscriptions(
    orion: SubscriptionStore,
    notify_url: str,
    token: str,
    wanted: Sequence[Wanted] = WANTED,
) -> Ensured:
    """Make what stands at Orion what iVeg wants, and nothing more of ours.

    Run it at every start and whenever notifications stay away; it changes only what is
    wrong.  No throttling (it drops the last value) and no limit of failures (Orion
    would fall silent for good).

    Args:
        orion: Where subscriptions are kept.
        notify_url: Where Orion shall post.
        token: Secret that each notification carries.
        wanted: What iVeg wants to hear.

    Raises:
        HopError: Orion does not answer or does not take one.
    """
    ours: dict[str, list[dict[str, Any]]] = {}
    for one in await orion.read_subscriptions():
        description = str(one.get("description", ""))
        if description.startswith(PREFIX):
            ours.setdefault(description, []).append(one)
    failing = _failing(ours)
    ids, mended = [], []
    for want in wanted:
        document = write_subscription(want, notify_url, token)
        known = ours.pop(document["description"], [])
        subscription_id, done = await _ensure(orion, want.name, document, known)
        ids.append(subscription_id)
        mended += done
    for leftover in ours.values():
        for one in leftover:
            await orion.delete_subscription(one["id"])
            mended.append(f"Removed {one['description']!r}: it is not wanted any more.")
    return Ensured(frozenset(ids), tuple(mended), failing)


def _failing(ours: Mapping[str, Sequence[Mapping[str, Any]]]) -> str:
    """What Orion says of the deliveries that fail now; one sentence for all."""
    deliveries = [
        one.get("notification", {}) for known in ours.values() for one in known
    ]
    reasons = {
        str(one.get("lastFailureReason", "no reason given"))
        for one in deliveries
        if one.get("failsCounter", 0) > 0
    }
    return f"Orion cannot deliver: {', '.join(sorted(reasons))}." if reasons else ""


async def _ensure(
    orion: SubscriptionStore,
    name: str,
    document: dict[str, Any],
    known: list[dict[str, Any]],
) -> tuple[str, list[str]]:
    if not known:
        made = await orion.create_subscription(document)
        return made, [f"Subscribed to {name}."]
    mended = []
    for spare in known[1:]:
        await orion.delete_subscription(spare["id"])
        mended.append(f"Removed a second subscription to {name}.")
    kept = known[0]
    if limited := [part for part in ("throttling", "expires") if kept.get(part)]:
        # A change can replace these and cannot take them away.
        await orion.delete_subscription(kept["id"])
        made = await orion.create_subscription(document)
        return made, [*mended, f"Subscribed to {name} again: it had {limited[0]}."]
    if wrong := _differs(kept, document):
        await orion.update_subscription(kept["id"], {**document, "status": "active"})
        mended.append(f"Corrected the subscription to {name}: {wrong}.")
    return str(kept["id"]), mended


def _differs(kept: Mapping[str, Any], wanted: Mapping[str, Any]) -> str:
    """What is wrong with a subscription; empty when nothing is."""
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


def _same_receiver(kept: Mapping[str, Any], wanted: Mapping[str, Any]) -> bool:
    there, here = kept.get("httpCustom", {}), wanted["httpCustom"]
    headers = {name.lower(): value for name, value in there.get("headers", {}).items()}
    return (
        there.get("url") == here["url"]
        and there.get("timeout") == here["timeout"]
        and headers == {n.lower(): v for n, v in here["headers"].items()}
    )


def write_subscription(want: Wanted, notify_url: str, token: str) -> dict[str, Any]:
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
