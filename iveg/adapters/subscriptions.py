"""Repair of the subscriptions that iVeg wants at Orion.

They are found again after a restart by the beginning of their description, so there is
always one of each, however often iVeg starts.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Protocol

from iveg.adapters.fiware_http import Document
from iveg.adapters.wanted_subscriptions import (
    PREFIX,
    THROTTLING_S,
    TOKEN_HEADER,
    WantedSubscription,
)

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
        copies: Id of each subscription that may be throttled, and whether it is.
        former_ids: Of those that had our name and are no more.
        former_secrets: That some with our name brought, of an earlier start.
    """

    ids: frozenset[str]
    mended: tuple[str, ...]
    failing: str = ""
    copies: Mapping[WantedSubscription, tuple[str, bool]] = field(default_factory=dict)
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
    wrong.  No throttling (it drops the last value) but of copies, which may or may not
    have it, and no limit of failures (Orion would fall silent for good).

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
    failing, named = _failing(ours), [one for known in ours.values() for one in known]
    ids, mended, copies = [], [], {}
    for want in wanted:
        document = write_subscription(want, notify_url, token)
        known = ours.pop(document["description"], [])
        subscription_id, done = await _ensure(orion, want, document, known)
        ids.append(subscription_id)
        mended += done
        if want.copied is not None:
            kept = any(one["id"] == subscription_id for one in known)
            copies[want] = subscription_id, kept and is_throttled(known[0])
    for leftover in ours.values():
        for one in leftover:
            await orion.delete_subscription(one["id"])
            mended.append(f"Removed {one['description']!r}: it is not wanted any more.")
    return Ensured(
        frozenset(ids),
        tuple(mended),
        failing,
        copies,
        frozenset(str(one["id"]) for one in named).difference(ids),
        frozenset(map(_secret_of, named)) - {token, ""},
    )


def is_throttled(subscription: Document) -> bool:
    """Whether Orion leaves out notifications of this subscription."""
    return bool(subscription.get("throttling"))


def _failing(ours: Mapping[str, Sequence[Document]]) -> str:
    """Orion's account of failing deliveries; one sentence for all."""
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
    if limited := _limits(want, kept):
        # Not every Orion takes these away by a change.
        await orion.delete_subscription(kept["id"])
        made = await orion.create_subscription(document)
        return made, [*mended, f"Subscribed to {name} again: it had {limited[0]}."]
    if wrong := _differs(kept, document):
        await orion.update_subscription(kept["id"], {**document, "status": "active"})
        mended.append(f"Corrected the subscription to {name}: {wrong}.")
    return str(kept["id"]), mended


def _limits(want: WantedSubscription, kept: Document) -> list[str]:
    """Limits that a subscription must not have; a copy may be throttled our own way."""
    limits = [part for part in ("throttling", "expires") if kept.get(part)]
    if want.copied is not None and kept.get("throttling") == THROTTLING_S:
        limits.remove("throttling")
    return limits


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
