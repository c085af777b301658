"""The pages of which pictures are taken: where they are and what makes them so."""

import json
from collections.abc import Callable

from playwright.sync_api import Page, Route

from tests.e2e.frozen import NOW, Frozen, settle

PAST_AT = "2026-11-21T03:30:00Z"
PAGES = {
    "live": "/",
    "live-robots": "/?#robots",
    "live-log": "/?#log-panel",
    "past": f"/?t={PAST_AT}",
    "past-gap": "/?t=2026-11-20T02:00:00Z",
    "wall": "/?wall",
    "tablet": "/",
    "tablet-pin": "/",
    "tablet-open": "/",
    "alerts": "/alerts",
    "commands": "/commands",
    "decisions": "/decisions",
    "decision": "/decisions/D1",
    "history": "/history",
    "day": "/day?day=2026-11-21",
    "compare": "/compare",
    "fleet": "/fleet",
    "command": "/commands/C1",
    "experiments": "/experiments",
    "what-if": "/what-if",
    "account": "/account",
    "users": "/users",
    "tokens": "/tokens",
    "sessions": "/sessions",
    "audit": "/audit",
    "climate": "/climate",
    "latency": "/latency",
    "settings": "/settings",
    "docs": "/docs",
    "about": "/about",
    "missing": "/no-such-page",
    "offline": "/static/offline.html",
}
TABLETS = ("tablet", "tablet-pin", "tablet-open")
"""Those of a shared tablet's session."""
READY = {
    **dict.fromkeys(
        ("live", "live-robots", "live-log", "past", "wall", *TABLETS),
        "#map-fit:enabled",
    ),
    "past-gap": "#past[data-problem=true]",
    "alerts": "#past-rows tbody tr",
    "commands": "#orders-rows tbody tr",
    "command": ".chain li",
    "decision": ".chain li",
    "history": "#chart-stops .main-svg",
    **{
        name: f"#{name}-rows tbody tr"
        for name in ("users", "tokens", "sessions", "audit")
    },
    "climate": "#trend-co2 .main-svg",
    "settings": "#rule-form:visible",
    "account": "#account-method:text-matches('[a-z]')",
    "experiments": "#experiment-start:enabled",
    "latency": "#hops-glance > *",
    "decisions": "#decisions-rows tbody tr",
    "fleet": "#machines tbody tr",
    "compare": "#compare-page table tbody tr",
}
"""What a page is about; of the others their frame will do."""
PIN = "2580"
OWN = {"X-IVEG": "1", "Sec-Fetch-Site": "same-origin"}


def prepare(page: Page, name: str, told: Frozen, url: str) -> None:
    """What a page needs before it is opened."""
    if name == "past":
        page.route("**/api/v1/world*", _then(told))
    if name == "tablet-open":
        people = page.request.get(f"{url}/api/v1/tablet").json()["people"]
        proof = {"person_id": people[0]["person_id"], "pin": PIN}
        page.request.post(f"{url}/api/v1/tablet/unlock", data=proof, headers=OWN)
    elif name in TABLETS:
        page.request.post(f"{url}/api/v1/tablet/lock", data={}, headers=OWN)


def act(page: Page, name: str) -> None:
    """What a person does once it is there."""
    if name == "tablet-pin":
        page.locator("#tablet").click()
        settle(page, "#tablet-people button")
        page.locator("#tablet-people button").first.click()


def _then(told: Frozen) -> Callable[[Route], None]:
    """A recorded moment, at which the fleet was as it is now."""
    seen = told["snapshot"]
    world = {
        **{k: v for k, v in seen.items() if k not in ("t", "server", "user")},
        "at": PAST_AT,
        "at_s": NOW - 80.2,
        "verified": True,
        "recorded_twice": False,
        "scans": [],
    }
    return lambda route: route.fulfill(
        body=json.dumps(world), content_type="application/json"
    )
